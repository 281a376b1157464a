"""Elastic joint: springs across and along it, with Mohr and Coulomb's strength, as distinct-element codes have it."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.scene.laws.bonds import with_bonds
from mechanics.scene.laws.dry_joint import DryJoint, DynamicFriction, Friction, at_limit
from mechanics.scene.laws.law import BOND, ENERGY, REST, SPRING, Approach, Law, Springs, Terms
from mechanics.scene.laws.mortar import MortarJoint, check_tension
from mechanics.stones.settings import Setting, check_settings

__all__ = ["ElasticJoint"]

_ALONG = slice(SPRING.start + 1, SPRING.stop)


@dataclass(frozen=True)
class ElasticJoint:
    """Springs k_N and k_T per area of joint, with dashpots c = τk beside them, that open, slide and break.

    With x the gap, or the stretch of the spring along the joint, and both sides of the mean over the step that the
    θ-scheme takes of forces and motions,

        r = -h A (k x̄ + c v̄),     x̄ = x_i + θ h v̄,     v̄ = (1-θ) u_i + θ u

    so that with d = k θ h + c

        u + (k x_i/d + (1-θ) u_i)/θ + E r = 0,     E = 1/(h A d θ)

    holds where the joint neither opens nor slides: a shift of u and a compliance E of the contact. With θ = ½ springs
    keep their energy, with θ = 1 they come to rest. A contact that slides ends with its spring at the limit, if that is
    less stretched; one that opens, without any stretch. Edges and corners have no area, and are rigid. Overlaps under
    load are the compression of the joint, not an error. Without tensile and shear strength the joint is dry, else
    mortar (`MortarJoint`).

    Springs never hold more than the work that was done on them. Where the area or the points of a joint change, they
    begin the step with no more energy than they had; where a joint closes within a step, with no more than the work of
    its force in it. The stretch across a joint then differs from the gap, until it opens.
    """

    friction: Friction
    normal_stiffness: Annotated[float, Setting("Stiffness k_N across the joint, per area.", "Pa/m", above=0)]
    shear_stiffness: Annotated[float, Setting("Stiffness k_T along the joint, per area.", "Pa/m", above=0)]
    damping_time: Annotated[
        float,
        Setting("Dashpots over springs, τ = c/k; a mode of frequency f is damped by π f τ.", "s", at_least=0),
    ] = 0.0
    tension: Annotated[
        float, Setting("Tensile strength c_n; no more than c_t/μ is held.", "Pa", at_least=0)
    ] = 0.0
    shear: Annotated[float, Setting("Shear strength without pressure, c_t.", "Pa", at_least=0)] = 0.0
    dynamic_friction: DynamicFriction = None

    def __post_init__(self) -> None:
        check_settings("elastic joint", self)
        check_tension("elastic joint", self.friction, self.tension, self.shear)
        _ = self._strength  # checks the dynamic friction

    @property
    def reach(self) -> float:
        """Zero: no force acts across a gap, except that of a bond, which yields by less than is watched anyway [m]."""
        return 0.0

    @property
    def bonded(self) -> bool:
        """True for mortar, which holds tension or shear without pressure."""
        return self.shear > 0 or self.tension > 0

    @property
    def _strength(self) -> Law:
        if self.bonded:
            return MortarJoint(self.friction, self.tension, self.shear, self.dynamic_friction)
        return DryJoint(self.friction, self.dynamic_friction)

    def terms(self, contacts: Approach) -> Terms:
        """Return the strength of the joint, with its springs."""
        contacts = with_bonds(contacts) if self.bonded else contacts
        strength = self._strength.terms(contacts)
        step, theta, has = contacts.step, contacts.theta, contacts.area > 0
        begin = self._begin(contacts)
        compliance, shift = np.zeros((len(has), 3)), np.zeros((len(has), 2))
        area = np.where(has, contacts.area, 1.0)
        for columns, stiffness in ((slice(0, 1), self.normal_stiffness), (slice(1, 3), self.shear_stiffness)):
            compliance[:, columns] = (has / (step * theta * self._hold(contacts, stiffness) * area))[:, None]
        across = self._lag(contacts, self.normal_stiffness, begin[:, 0], contacts.speed)
        along = self._lag(contacts, self.shear_stiffness, begin[:, 1:], contacts.slide)
        shift[has] = along[has]
        return replace(
            strength, bias=np.where(has, across, strength.bias), springs=Springs(compliance, shift)
        )

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return the internal variables with the springs at the end of the step, and what they hold."""
        contacts = with_bonds(contacts) if self.bonded else contacts
        strength = self._strength.terms(contacts)
        step, theta, has = contacts.step, contacts.theta, contacts.area > 0
        area = np.where(has, contacts.area, np.inf)
        begin = self._begin(contacts)
        way = step * ((1.0 - theta) * np.column_stack([contacts.speed, contacts.slide]) + theta * velocity)
        traction, stiffness = -impulse[:, 1:] / (step * area)[:, None], self.shear_stiffness
        longer = step * (traction - stiffness * begin[:, 1:]) / self._hold(contacts, stiffness)
        slip = velocity.copy()
        slip[has, 1:] = ((way[:, 1:] - longer) / step)[has]
        state = self._strength.after(contacts, impulse, slip)
        closed: Bools = has & (impulse[:, 0] > 0)
        along, limit = begin[:, 1:] + longer, traction / stiffness
        ends = at_limit(strength, impulse) & (_square(limit) < _square(along))
        along = np.where(ends[:, None], limit, along) * closed[:, None]
        gap = contacts.gap - state[:, REST] + step * theta * velocity[:, 0]
        most = np.where(_holds(state), strength.adhesion / (step * area * self.normal_stiffness), np.inf)
        opened = np.minimum(np.maximum(gap, 0.0), most)
        across = np.where(closed, self._pressed(contacts, state, begin[:, 0], way[:, 0]), opened)
        state[:, SPRING] = np.column_stack([across - gap, along]) * has[:, None]
        state[:, ENERGY] = self._energy(contacts, np.column_stack([across, along]), state)
        return state

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

    def _pressed(self, contacts: Approach, state: Array, begin: Array, way: Array) -> Array:
        """Return the stretch across joints (n,) at the end of a step that pressed them, or that bonds held [m].

        Where a joint closes within the step, its force is that of the mean, and the spring holds no more than its work.
        """
        end = begin + way
        work = np.maximum(2.0 * way * (begin + contacts.theta * way), 0.0)
        closes = (begin > 0) & (end < 0) & ~_holds(state)
        return np.where(closes, np.maximum(end, -np.sqrt(work)), end)

    def _energy(self, contacts: Approach, stretch: Array, state: Array) -> Array:
        """Return what springs (n,) hold [J]: nothing across a joint that is open without a bond."""
        across = np.where(_holds(state), stretch[:, 0], np.minimum(stretch[:, 0], 0.0))
        held = self.normal_stiffness * across**2 + self.shear_stiffness * _square(stretch[:, 1:])
        energy: Array = 0.5 * contacts.area * held
        return energy

    def _hold(self, contacts: Approach, stiffness: float) -> float:
        """Return d = k θ h + c, traction per mean velocity of the step [Pa s/m]."""
        return stiffness * (contacts.theta * contacts.step + self.damping_time)

    def _lag(self, contacts: Approach, stiffness: float, begin: Array, speed: Array) -> Array:
        """Return the shift of u by springs that begin the step with a stretch [m] and its rate [m/s]."""
        theta = contacts.theta
        lag: Array = (stiffness / self._hold(contacts, stiffness) * begin + (1.0 - theta) * speed) / theta
        return lag


def _holds(state: Array) -> Bools:
    """Return the contacts (n,) whose bond is not broken."""
    holds: Bools = state[:, BOND] > 0
    return holds


def _square(vectors: Array) -> Array:
    """Return the squares (n,) of the lengths of vectors (n, d)."""
    square: Array = np.einsum("ci,ci->c", vectors, vectors)
    return square
