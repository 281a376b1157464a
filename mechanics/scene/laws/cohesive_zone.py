"""Mortar that softens as it opens or slides: a cohesive zone (after Jean, Acary & Monerie 2001)."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.scene.laws.bonds import BROKEN, bonded, with_bonds
from mechanics.scene.laws.dry_joint import DryJoint, Friction, at_limit, slid
from mechanics.scene.laws.law import BOND, OPENING, REST, SLIDING, SLIP, Approach, Joint, Law, Terms
from mechanics.scene.laws.mortar import MortarJoint, held_tension
from mechanics.stones.settings import check_settings


@dataclass(frozen=True)
class CohesiveZone(Joint):
    """A bond whose intact fraction β falls linearly as it opens and slides; broken, a dry joint.

        β = 1 - δ_N/δ_f,N - δ_T/δ_f,T,   δ_f = 2 G/σ0,   r_N ≥ -h A β σ_N,   ‖r_T‖ ≤ h A β σ_T + μ r_N

    with the largest opening δ_N and the path of sliding δ_T so far. There is no elastic branch: a whole bond is rigid.
    Opening alone dissipates G_I A, sliding alone G_II A (besides friction); in mixed mode the bond breaks where the two
    parts add up to one, for any path: ∫σ_N β dδ_N/G_I + ∫σ_T β dδ_T/G_II = 1. The tension of a bond that closes again
    is proportional to its opening; its shear acts like friction.

    The tension of a step is that of the opening at mid-step, at the velocity before. An opening smaller than the motion
    due to the full tension in one step cannot be resolved: there the tension stays full until the bond has closed. The
    proportional part begins at that opening, so that h²W·(tension/opening) stays below 1/θ, where steps are stable.
    """

    friction: Friction
    tension: Annotated[float, Setting("Tensile strength σ_N; no more than σ_T/μ is held.", "Pa", above=0)]
    shear: Annotated[float, Setting("Shear strength without pressure, σ_T.", "Pa", above=0)]
    energy_tension: Annotated[float, Setting("Energy G_I that opening costs.", "J/m²", above=0)]
    energy_shear: Annotated[float, Setting("Energy G_II that sliding costs.", "J/m²", above=0)]

    def __post_init__(self) -> None:
        check_settings("cohesive zone", self)

    @property
    def reach(self) -> float:
        """Opening at which the bond is broken, δ_f,N [m]."""
        return 2.0 * self.energy_tension / self.held

    @property
    def softening(self) -> float:
        """Shortest displacement over which the bond is lost, the least of δ_f,N and δ_f,T [m]."""
        return min(self.reach, 2.0 * self.energy_shear / self.shear)

    @property
    def held(self) -> float:
        """Tension that a whole bond holds [Pa]."""
        return held_tension(self.friction, self.tension, self.shear)

    @property
    def bonded(self) -> bool:
        """True: stones that meet at the start are bonded."""
        return True

    def without_bond(self, parted: bool) -> Law:
        """Return mortar without strength, which fills the gap of a joint that bears, or a dry joint."""
        return self._dry if parted else MortarJoint(self.friction, 0.0, 0.0)

    @property
    def _dry(self) -> DryJoint:
        return DryJoint(self.friction)

    def intact(self, opening: Array, slip: Array) -> Array:
        """Return β (n,) after a largest opening and a path of sliding [m], for contacts that were bonded."""
        intact: Array = np.maximum(
            1.0 - opening / self.reach - slip * self.shear / (2.0 * self.energy_shear), 0.0
        )
        return intact

    def terms(self, contacts: Approach) -> Terms:
        """Return the shift of bonded contacts for their opening and damage."""
        contacts = with_bonds(contacts)
        dry, state = self._dry.terms(contacts), contacts.state
        step, theta = contacts.step, contacts.theta
        opening = np.maximum(contacts.gap - state[:, REST] + step * (theta - 0.5) * contacts.speed, 0.0)
        largest = np.maximum(state[:, OPENING], opening)
        area = step * contacts.area * self.intact(largest, state[:, SLIP]) * bonded(contacts)
        full = area * self.held
        unresolved = step * theta * contacts.compliance * full
        opened = largest > 0
        part = np.where(opened, (opening + unresolved) / np.where(opened, largest, 1.0), 1.0)
        pull = full * np.minimum(part, 1.0)
        cohesion = np.maximum(area * self.shear - self.friction * pull, 0.0)
        return Terms(dry.bias, dry.friction, cohesion, pull)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return the internal variables after the openings and slides of this step have damaged the bonds."""
        contacts = with_bonds(contacts)
        terms, holds = self.terms(contacts), bonded(contacts)
        step, state = contacts.step, contacts.state.copy()
        opening = contacts.gap - state[:, REST] + step * contacts.theta * velocity[:, 0]
        state[:, OPENING] = np.where(holds, np.maximum(state[:, OPENING], opening), state[:, OPENING])
        # an open contact is free in its plane; of closed ones, those on their cone have slid
        free = holds & ((impulse[:, 0] <= 0) | at_limit(terms, impulse))
        state[:, SLIP] += np.where(free, step * np.linalg.norm(velocity[:, 1:], axis=1), 0.0)
        state[:, SLIDING] = slid(contacts, terms, impulse, velocity)
        intact = self.intact(state[:, OPENING], state[:, SLIP])
        state[holds, BOND] = np.where(intact > 0, intact, BROKEN)[holds]
        return state
