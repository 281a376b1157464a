"""Brittle mortar: cohesion as a shift of the normal impulse (Acary et al. 1999)."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.scene.laws.bonds import BROKEN, bonded, with_bonds
from mechanics.scene.laws.dry_joint import DryJoint, DynamicFriction, Friction, at_limit, slid
from mechanics.scene.laws.law import BOND, REST, SLIDING, SLIP, Approach, Joint, Law, Terms
from mechanics.stones.settings import check_settings

# a bond at its limit has broken
_OPENED = 1e-6  # in tension, when it is open by this part of a body's size [-]
_CREPT = 1e-3  # in shear, when it has crept by this part [-], or slides faster than solvers let it drift


def held_tension(friction: float, tension: float, shear: float) -> float:
    """Return the tension that a joint carries [Pa]: `tension`, cut at the apex c_t/μ of its Mohr–Coulomb cone."""
    return min(tension, shear / friction) if friction > 0 else tension


def check_tension(where: str, friction: float, tension: float, shear: float) -> None:
    """Refuse a tension of which nothing is held: with friction and without shear strength the cone ends at zero.

    Raises
    ------
    SceneError : naming the place, the strengths and a remedy

    >>> check_tension("mortar joint", 0.5, 1e5, 0.0)
    Traceback (most recent call last):
    ground.errors.SceneError: mortar joint: tension = 100000.0 holds nothing with friction = 0.5 and shear = 0; give a \
shear strength, of 50000 Pa or more to hold all of it, or tension = 0 for a dry joint
    """
    if tension > 0 and held_tension(friction, tension, shear) == 0:
        raise SceneError(
            f"tension = {tension!r} holds nothing with friction = {friction:g} and shear = 0",
            where=where,
            remedy=f"give a shear strength, of {friction * tension:.6g} Pa or more to hold all of it, or tension = 0 "
            "for a dry joint",
        )


@dataclass(frozen=True)
class MortarJoint(Joint):
    """A bond r_N ≥ -h c_n A, ‖r_T‖ ≤ h c_t A + μ r_N that breaks once and for all, then a dry joint.

    With r̃_N = r_N + h c_n A these are r̃_N ≥ 0 and ‖r_T‖ ≤ μ r̃_N + h A (c_t - μ c_n). A is the tributary area of the
    contact point. The bond breaks when it opens at its tensile limit or slides at its shear limit. μ is
    that of the bond and of the broken joint; the apex of the cone lies at a tension of c_t/μ.
    """

    friction: Friction
    tension: Annotated[float, Setting("Tensile strength c_n; no more than c_t/μ is held.", "Pa", at_least=0)]
    shear: Annotated[float, Setting("Shear strength without pressure, c_t.", "Pa", at_least=0)]
    dynamic_friction: DynamicFriction = None

    def __post_init__(self) -> None:
        check_settings("mortar joint", self)
        check_tension("mortar joint", self.friction, self.tension, self.shear)
        _ = self._dry  # checks the dynamic friction

    @property
    def bonded(self) -> bool:
        """True: stones that meet at the start are bonded."""
        return True

    def without_bond(self, parted: bool) -> Law:
        """Return mortar without strength, which fills the gap of a joint that bears, or a dry joint."""
        return self._dry if parted else replace(self, tension=0.0, shear=0.0)

    @property
    def _dry(self) -> DryJoint:
        return DryJoint(self.friction, self.dynamic_friction)

    def terms(self, contacts: Approach) -> Terms:
        """Return the shift of bonded contacts; broken ones are dry."""
        contacts = with_bonds(contacts)
        dry, holds = self._dry.terms(contacts), bonded(contacts)
        area = contacts.step * contacts.area * holds
        tension = held_tension(self.friction, self.tension, self.shear)
        return Terms(
            bias=dry.bias,
            friction=np.where(holds, self.friction, dry.friction),
            cohesion=area * max(self.shear - self.friction * tension, 0.0),
            adhesion=area * tension,
        )

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return the internal variables, with bonds broken that opened at their tensile limit, or slid."""
        contacts = with_bonds(contacts)
        terms = self.terms(contacts)
        state, holds = contacts.state.copy(), bonded(contacts)
        opening = contacts.gap - state[:, REST] + contacts.step * contacts.theta * velocity[:, 0]
        path = contacts.step * np.linalg.norm(velocity[:, 1:], axis=1)
        yields = at_limit(terms, impulse)
        state[:, SLIP] += np.where(holds & yields, path, 0.0)
        # at the apex of its cone a bond has no shear left, whichever way it moves
        away = np.where(yields, opening, np.maximum(opening, path))
        opened = (impulse[:, 0] <= 0) & (away > _OPENED * contacts.size)
        state[:, SLIDING] = slid(contacts, terms, impulse, velocity)
        sheared = (state[:, SLIDING] > 0) | (state[:, SLIP] > _CREPT * contacts.size)
        state[holds & (opened | sheared), BOND] = BROKEN
        return state
