"""Elastic joint: springs across and along it, with Mohr and Coulomb's strength, as distinct-element codes have it."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array, Bools
from mechanics.scene.laws.bonds import BROKEN, bonded, with_bonds
from mechanics.scene.laws.closure import FLOOR, Closure
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint, DynamicFriction, Friction, at_limit, slid
from mechanics.scene.laws.law import (
    BOND,
    CRUSHED,
    ENERGY,
    OPENING,
    REST,
    SLIDING,
    SLIP,
    SPRING,
    Approach,
    Joint,
    Law,
    Springs,
    Terms,
)
from mechanics.scene.laws.mortar import MortarJoint, check_tension
from mechanics.stones.settings import check_settings

_WHERE = "elastic joint"
_AT_STRENGTH = 1e-8  # part of the strength by which a pressure at it may differ [-]
_ANY = 1.0  # thickness for those who ask for the strength of mortar alone, where none is known [m]
_HARDENS = 1e-3  # stiffness of a joint that crushes, over that below its strength [-]


@dataclass(frozen=True)
class _Springs:
    """Springs of a step, linear about their stretch at its start.

    Attributes
    ----------
    begin : (n, 3) that stretch, across the joint first [m]
    pull : (n,) traction across the joint there, negative under pressure [Pa]
    across, along : (n,) stiffness [Pa/m]
    """

    begin: Array
    pull: Array
    across: Array
    along: Array


@dataclass(frozen=True)
class ElasticJoint(Joint):
    """Springs k_N and k_T per area of joint, with dashpots c = τk beside them, that open, slide, break and crush.

    With x the gap, or the stretch of the spring along the joint, and both sides of the mean over the step that the
    θ-scheme takes of forces and motions,

        r = -h A (t_i + k (x̄ - x_i) + c v̄),     x̄ = x_i + θ h v̄,     v̄ = (1-θ) u_i + θ u

    with the traction t_i = k x_i at the start, so that with d = k θ h + c

        u + (t_i/d + (1-θ) u_i)/θ + E r = 0,     E = 1/(h A d θ)

    holds where the joint neither opens nor slides: a shift of u and a compliance E of the contact. With θ = ½ springs
    keep their energy, with θ = 1 they come to rest. A contact that slides ends with its spring at the limit, if that is
    less stretched; one that opens, without any stretch. Edges and corners have no area, and are rigid. Overlaps under
    load are the compression of the joint, not an error. Without tensile and shear strength the joint is dry, else
    mortar: brittle (`MortarJoint`), or with energies of fracture a cohesive zone (`CohesiveZone`) in series with the
    springs.

    Springs never hold more than the work that was done on them. Where the area or the points of a joint change, they
    begin the step with no more energy than they had; where a joint closes within a step, with no more than the work of
    its force in it. The stretch across a joint then differs from the gap, until it opens.

    Stiffness may come from a mortar's modulus over its local thickness, and may grow with the pressure (`Closure`):
    then k is the tangent at the start of the step. Where a joint crushes, its pressure stays, and what closes beyond
    that is lost.
    """

    friction: Friction
    normal_stiffness: Annotated[
        float | None,
        Setting(
            "Stiffness k_N across the joint, per area; with `shear_stiffness`, or a mortar.", "Pa/m", above=0
        ),
    ] = None
    shear_stiffness: Annotated[
        float | None, Setting("Stiffness k_T along the joint, per area.", "Pa/m", above=0)
    ] = None
    damping_time: Annotated[
        float,
        Setting("Dashpots over springs, τ = c/k; a mode of frequency f is damped by π f τ.", "s", at_least=0),
    ] = 0.0
    tension: Annotated[
        float, Setting("Tensile strength c_n; no more than c_t/μ is held.", "Pa", at_least=0)
    ] = 0.0
    shear: Annotated[float, Setting("Shear strength without pressure, c_t.", "Pa", at_least=0)] = 0.0
    dynamic_friction: DynamicFriction = None
    energy_tension: Annotated[
        float, Setting("Energy G_I that opening costs; 0: the bond is brittle.", "J/m²", at_least=0)
    ] = 0.0
    energy_shear: Annotated[
        float, Setting("Energy G_II that sliding costs, besides friction; 0: brittle.", "J/m²", at_least=0)
    ] = 0.0
    compressive_strength: Annotated[
        float | None,
        Setting("Pressure at which the joint crushes; if not given, it does not.", "Pa", above=0),
    ] = None
    stiffening: Annotated[
        float,
        Setting(
            "Exponent n of stiffness that grows with pressure p, by the factor (p/`reference_pressure`)ⁿ.",
            "-",
            at_least=0,
            below=1,
        ),
    ] = 0.0
    reference_pressure: Annotated[
        float | None, Setting("Pressure at which the stiffness is the one given.", "Pa", above=0)
    ] = None
    mortar_young: Annotated[
        float | None,
        Setting("Young's modulus E of mortar: k_N = E/t, k_T = G/t of its local thickness t.", "Pa", above=0),
    ] = None
    mortar_poisson: Annotated[
        float, Setting("Poisson's ratio of mortar, for G.", "-", at_least=0, below=0.5)
    ] = 0.2
    thickness: Annotated[
        float | None, Setting("Thickness t of mortar in joints whose own is not known.", "m", above=0)
    ] = None

    def __post_init__(self) -> None:
        check_settings(_WHERE, self)
        check_tension(_WHERE, self.friction, self.tension, self.shear)
        _ = self._strength  # checks the dynamic friction
        springs, mortar = (self.normal_stiffness, self.shear_stiffness), self.mortar_young is not None
        if None in springs and not (mortar and springs == (None, None)):
            given = "mortar_young" if mortar else "one of them" if any(springs) else "neither"
            raise SceneError(
                f"normal_stiffness and shear_stiffness belong together, but there is {given}",
                where=_WHERE,
                remedy="give both, or mortar_young alone",
            )
        refused = (
            (mortar and None not in springs, "mortar_young beside stiffness", "give one of the two"),
            (
                self.thickness is not None and not mortar,
                "thickness without mortar_young",
                "give it, or leave it out",
            ),
            (
                (self.stiffening > 0) != (self.reference_pressure is not None),
                "stiffening and reference_pressure belong together, but there is one of them",
                "give both, with stiffening above 0, or neither",
            ),
            (
                self.softens and 0.0 in (self.tension, self.shear, self.energy_tension, self.energy_shear),
                "a bond softens by tension, shear, energy_tension and energy_shear, but one of them is 0",
                "give all four, or no energy for a brittle bond",
            ),
        )
        for wrong, what, remedy in refused:
            if wrong:
                raise SceneError(what, where=_WHERE, remedy=remedy)

    @property
    def reach(self) -> float:
        """Opening at which a bond that softens is broken [m]; others yield by less than is watched anyway."""
        return self._zone.reach if self.softens else 0.0

    @property
    def softening(self) -> float:
        """Shortest displacement over which a bond is lost, 2 G/c; infinite where none softens [m]."""
        return self._zone.softening if self.softens else np.inf

    @property
    def sprung(self) -> bool:
        """True: joints yield."""
        return True

    @property
    def crushes(self) -> bool:
        """True where the joint has a compressive strength."""
        return self.compressive_strength is not None

    def without_bond(self, parted: bool) -> Law:
        """Return the same springs without strength: they stay in a joint that bears."""
        return replace(self, tension=0.0, shear=0.0, energy_tension=0.0, energy_shear=0.0)

    @property
    def bonded(self) -> bool:
        """True for mortar, which holds tension or shear without pressure."""
        return self.shear > 0 or self.tension > 0

    @property
    def softens(self) -> bool:
        """True for bonds that fracture costs energy."""
        return self.energy_tension > 0 or self.energy_shear > 0

    @property
    def by_thickness(self) -> bool:
        """True where the stiffness is that of mortar, and joints without thickness have none."""
        return self.mortar_young is not None

    @cached_property
    def _zone(self) -> CohesiveZone:
        return CohesiveZone(self.friction, self.tension, self.shear, self.energy_tension, self.energy_shear)

    @property
    def _strength(self) -> Law:
        if self.bonded and not self.softens:
            return MortarJoint(self.friction, self.tension, self.shear, self.dynamic_friction)
        return DryJoint(self.friction, self.dynamic_friction)

    def terms(self, contacts: Approach) -> Terms:
        """Return the strength of the joint, with its springs."""
        contacts = with_bonds(contacts) if self.bonded else contacts
        return self._terms(contacts, self._springs(contacts))

    def crushing(self, contacts: Approach, impulse: Array | None = None) -> Bools:
        """Return the contacts (n,) whose pressure exceeds the strength of the joint in a step with r̃ (n, d) [N s].

        Before its solution is known, those that are at their strength and close further are.
        """
        if self.compressive_strength is None:
            return np.zeros(len(contacts.gap), dtype=bool)
        contacts = with_bonds(contacts) if self.bonded else contacts
        if impulse is None:
            full = -(1.0 - _AT_STRENGTH) * self._closure(contacts).at_pressure(self.compressive_strength)
            at_strength: Bools = (self._begin(contacts)[:, 0] <= full) & (contacts.speed < 0)
            return at_strength & (contacts.area > 0)
        adhesion = self._terms(contacts, self._springs(contacts)).adhesion
        over = impulse[:, 0] - adhesion - contacts.step * contacts.area * self.compressive_strength
        slack = _AT_STRENGTH * contacts.step * contacts.area * self.compressive_strength
        crushing = np.zeros(len(over), dtype=bool) if contacts.crushing is None else contacts.crushing
        pressed: Bools = (over > slack) | (crushing & (over > -slack))
        return pressed & (contacts.area > 0)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return the internal variables with the springs at the end of the step, and what they hold."""
        contacts = with_bonds(contacts) if self.bonded else contacts
        springs = self._springs(contacts)
        terms, begin = self._terms(contacts, springs), springs.begin
        step, theta, has = contacts.step, contacts.theta, contacts.area > 0
        area = np.where(has, contacts.area, np.inf)
        displacement = step * (
            (1.0 - theta) * np.column_stack([contacts.speed, contacts.slide]) + theta * velocity
        )
        traction = -impulse / (step * area)[:, None]
        traction[:, 0] += terms.adhesion / (step * area)
        along = begin[:, 1:] + step * (
            (traction[:, 1:] - springs.along[:, None] * begin[:, 1:])
            / self._hold(contacts, springs.along)[:, None]
        )
        slip = velocity.copy()
        slip[has, 1:] = ((displacement[:, 1:] - along + begin[:, 1:]) / step)[has]
        if self.softens:
            state = self._damaged(contacts, terms, impulse, slip, begin[:, 0] + displacement[:, 0])
        else:
            state = self._strength.after(contacts, impulse, slip)
        closed: Bools = has & (impulse[:, 0] > 0)
        limit = traction[:, 1:] / springs.along[:, None]
        ends = at_limit(terms, impulse) & (_square(limit) < _square(along))
        # a brittle bond is whole or broken, one that softens holds where it is drawn to its limit
        holding = closed | (_holds(state) & has) if self.softens else closed
        along = np.where(ends[:, None], limit, along) * holding[:, None]
        across, crushed = self._across(contacts, state, springs, displacement[:, 0], traction[:, 0], closed)
        state[:, REST] -= crushed
        state[:, CRUSHED] += crushed
        gap = contacts.gap - state[:, REST] + step * theta * velocity[:, 0]
        most = np.where(_holds(state), terms.adhesion / (step * area * self._stiff(contacts)[0]), np.inf)
        across = np.where(holding, across, np.minimum(np.maximum(gap, 0.0), most))
        along = along * self._restiffened(contacts, springs, across)[:, None]
        state[:, SPRING] = np.column_stack([across - gap, along]) * has[:, None]
        state[:, ENERGY] = self._energy(contacts, np.column_stack([across, along]), state)
        return state

    def _terms(self, contacts: Approach, springs: _Springs) -> Terms:
        strength = self._softened(contacts, springs) if self.softens else self._strength.terms(contacts)
        step, theta, has = contacts.step, contacts.theta, contacts.area > 0
        compliance, shift = np.zeros((len(has), 3)), np.zeros((len(has), 2))
        area = np.where(has, contacts.area, 1.0)
        for columns, stiffness in ((slice(0, 1), springs.across), (slice(1, 3), springs.along)):
            compliance[:, columns] = (has / (step * theta * self._hold(contacts, stiffness) * area))[:, None]
        hold = self._hold(contacts, springs.across), self._hold(contacts, springs.along)
        across = (springs.pull / hold[0] + (1.0 - theta) * contacts.speed) / theta
        part = (springs.along / hold[1])[:, None]
        along = (part * springs.begin[:, 1:] + (1.0 - theta) * contacts.slide) / theta
        shift[has] = along[has]
        return replace(
            strength, bias=np.where(has, across, strength.bias), springs=Springs(compliance, shift)
        )

    def _stiff(self, contacts: Approach) -> tuple[Array, Array]:
        """Return k_N and k_T (n,) without pressure: those in tension [Pa/m]."""
        count = len(contacts.gap)
        if self.mortar_young is None:
            across, along = np.full(count, self.normal_stiffness), np.full(count, self.shear_stiffness)
        else:
            thickness = np.zeros(count) if contacts.thickness is None else contacts.thickness
            across = self.mortar_young / np.where(thickness > 0, thickness, self.thickness or _ANY)
            along = across / (2.0 * (1.0 + self.mortar_poisson))
        part = FLOOR**self.stiffening
        return part * across, part * along

    def _closure(self, contacts: Approach) -> Closure:
        floor = np.inf if self.reference_pressure is None else FLOOR * self.reference_pressure
        return Closure(self._stiff(contacts)[0], 1.0 / (1.0 - self.stiffening), floor)

    def _along(self, contacts: Approach, across: Array) -> Array:
        """Return k_T (n,) under the pressure at stretches across the joint (n,) [Pa/m]."""
        closure = self._closure(contacts)
        stiffer: Array = closure.stiffer(closure.pressure(np.maximum(-across, 0.0)))
        return self._stiff(contacts)[1] * stiffer

    def _springs(self, contacts: Approach) -> _Springs:
        """Return the springs of a step from their state at its start."""
        begin, closure = self._begin(contacts), self._closure(contacts)
        across, closed = begin[:, 0], np.maximum(-begin[:, 0], 0.0)
        pressed, tensile = across < 0, self._tensile(contacts, contacts.state)
        stiffness = np.where(pressed, closure.tangent(closed), tensile)
        pull = np.where(pressed, -closure.pressure(closed), tensile * across)
        if self.compressive_strength is not None:
            crushing = self.crushing(contacts) if contacts.crushing is None else contacts.crushing
            strength, stiff = self.compressive_strength, np.where(crushing, _HARDENS, 1.0)
            pull = np.where(crushing, -strength + _HARDENS * (pull + strength), pull)
            stiffness = stiff * stiffness
        return _Springs(begin, pull, stiffness, self._along(contacts, across))

    def _begin(self, contacts: Approach) -> Array:
        """Return the stretch of the springs (n, 3), that across the joint first, at the start of the step [m].

        Where areas, or points, have changed since the last step so that the springs of a pair of shapes would hold more
        than they did, all of them are less stretched.
        """
        flight = contacts.step * (1.0 - contacts.theta) * contacts.speed
        stretch = contacts.state[:, SPRING].copy()
        stretch[:, 0] += contacts.gap - contacts.state[:, REST] - flight
        now = np.bincount(contacts.pair, self._energy(contacts, stretch, contacts.state))
        before = np.bincount(contacts.pair, contacts.state[:, ENERGY])
        factor = np.sqrt(np.divide(before, now, out=np.ones(len(now)), where=now > before))[contacts.pair]
        is_open = (stretch[:, 0] > 0) & ~_holds(contacts.state)
        stretch[:, 0] *= np.where(is_open, 1.0, factor)
        stretch[:, 1:] *= factor[:, None]
        return stretch

    def _across(
        self,
        contacts: Approach,
        state: Array,
        springs: _Springs,
        displacement: Array,
        traction: Array,
        closed: Bools,
    ) -> tuple[Array, Array]:
        """Return stretches across joints (n,) at the end of a step that pressed or drew them, and what crushed [m].

        Where a joint closes within the step, or its stiffness is not the same all along the way, it holds no more than
        before and the work of its force; and no more than its strength.
        """
        begin, closure = springs.begin[:, 0], self._closure(contacts)
        end, soft = begin + displacement, _holds(state) & self.softens
        energy = self._energy_across(contacts, begin, contacts.state)
        work = np.where(
            soft,
            displacement * traction,
            displacement * (springs.pull + contacts.theta * springs.across * displacement),
        )
        most = np.maximum(energy + work, 0.0)
        limited = ((begin > 0) & ~_holds(state)) | soft | (not closure.linear)
        end = np.where(limited & (end < 0), np.maximum(end, -closure.at_energy(most)), end)
        drawn = np.sqrt(2.0 * most / self._tensile(contacts, state))
        end = np.where(soft & (end > 0), np.minimum(end, drawn), end)
        if self.compressive_strength is None:
            return end, np.zeros(len(end))
        full = closure.at_pressure(self.compressive_strength)
        crushed = np.where(closed, np.maximum(-end - full, 0.0), 0.0)
        return end + crushed, crushed

    def _restiffened(self, contacts: Approach, springs: _Springs, across: Array) -> Array:
        """Return the factor (n,) on stretches along joints whose stiffness has changed: they keep force, or energy."""
        if self._closure(contacts).linear:
            return np.ones(len(across))
        ratio = springs.along / self._along(contacts, across)
        return np.minimum(ratio, np.sqrt(ratio))

    def _energy(self, contacts: Approach, stretch: Array, state: Array) -> Array:
        """Return what springs (n,) hold [J]."""
        along = 0.5 * self._along(contacts, stretch[:, 0]) * _square(stretch[:, 1:])
        energy: Array = contacts.area * (self._energy_across(contacts, stretch[:, 0], state) + along)
        return energy

    def _energy_across(self, contacts: Approach, across: Array, state: Array) -> Array:
        """Return what springs across joints (n,) hold [J/m²]: nothing where they are open without a bond."""
        drawn = 0.5 * self._tensile(contacts, state) * np.maximum(across, 0.0) ** 2
        pressed = self._closure(contacts).energy(np.maximum(-across, 0.0))
        energy: Array = np.where(_holds(state), drawn, 0.0) + pressed
        return energy

    def _hold(self, contacts: Approach, stiffness: Array) -> Array:
        """Return d = k θ h + c (n,), traction per mean velocity of the step [Pa s/m]."""
        return stiffness * (contacts.theta * contacts.step + self.damping_time)

    # --- bonds that soften ---

    def _tensile(self, contacts: Approach, state: Array) -> Array:
        """Return the stiffness (n,) in tension: of a damaged bond, towards its opening without force [Pa/m]."""
        stiffness = self._stiff(contacts)[0]
        if not self.softens:
            return stiffness
        strength = np.maximum(state[:, BOND], 0.0) * self._zone.held
        damaged = _holds(state) & (state[:, OPENING] > 0)
        softer = strength * stiffness / np.where(damaged, strength + stiffness * state[:, OPENING], 1.0)
        return np.where(damaged, softer, stiffness)

    def _opening(self, contacts: Approach, state: Array, across: Array) -> Array:
        """Return the opening of bonds (n,) beyond the stretch of their springs, where drawn to their limit [m].

        A bond whose springs hold more than it costs breaks at once.
        """
        zone, stiffness = self._zone, self._stiff(contacts)[0]
        beyond = across - zone.held * zone.intact(np.zeros_like(across), state[:, SLIP]) / stiffness
        part = 1.0 - zone.held / (stiffness * zone.reach)
        opening: Array = np.maximum(
            np.where(part > 0, beyond / np.where(part > 0, part, 1.0), np.where(beyond > 0, zone.reach, 0.0)),
            0.0,
        )
        return opening

    def _softened(self, contacts: Approach, springs: _Springs) -> Terms:
        """Return the strength of bonds as damaged in the middle of the step, at the velocities before it."""
        zone, state, holds = self._zone, contacts.state, bonded(contacts)
        half = 0.5 * contacts.step
        middle = springs.begin[:, 0] + half * contacts.speed
        opening = np.maximum(state[:, OPENING], self._opening(contacts, state, middle))
        limit = zone.intact(opening, state[:, SLIP]) * self.shear - self.friction * springs.pull
        along = np.sqrt(_square(springs.begin[:, 1:] + half * contacts.slide))
        beyond = np.maximum(along - np.maximum(limit, 0.0) / springs.along, 0.0)
        full = 2.0 * self.energy_shear / self.shear
        part = 1.0 - self.shear / (springs.along * full)
        slip = state[:, SLIP] + np.where(
            part > 0, beyond / np.where(part > 0, part, 1.0), full * (beyond > 0)
        )
        area = contacts.step * contacts.area * zone.intact(opening, slip) * holds
        pull = area * zone.held
        dry = self._strength.terms(contacts)
        friction = np.where(holds, self.friction, dry.friction)
        return Terms(dry.bias, friction, np.maximum(area * self.shear - self.friction * pull, 0.0), pull)

    def _damaged(self, contacts: Approach, terms: Terms, impulse: Array, slip: Array, across: Array) -> Array:
        """Return internal variables after a step in which bonds opened to `across` (n,), or slid by `slip`."""
        state, holds = contacts.state.copy(), bonded(contacts)
        opening = np.maximum(state[:, OPENING], self._opening(contacts, state, across))
        state[:, OPENING] = np.where(holds, opening, state[:, OPENING])
        path = contacts.step * np.linalg.norm(slip[:, 1:], axis=1)
        state[:, SLIP] += np.where(holds & at_limit(terms, impulse), path, 0.0)
        state[:, SLIDING] = slid(contacts, terms, impulse, slip)
        intact = self._zone.intact(state[:, OPENING], state[:, SLIP])
        state[holds, BOND] = np.where(intact > 0, intact, BROKEN)[holds]
        return state


def _holds(state: Array) -> Bools:
    """Return the contacts (n,) whose bond is not broken."""
    holds: Bools = state[:, BOND] > 0
    return holds


def _square(vectors: Array) -> Array:
    """Return the squares (n,) of the lengths of vectors (n, d)."""
    square: Array = np.einsum("ci,ci->c", vectors, vectors)
    return square
