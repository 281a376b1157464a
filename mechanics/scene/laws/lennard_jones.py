"""Attraction at a short distance: the non-smooth Lennard-Jones law (Renouf, Dubois & Alart 2006)."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import DryJoint, Friction
from mechanics.scene.laws.law import Approach, Joint, Terms
from mechanics.stones.settings import check_settings


@dataclass(frozen=True)
class LennardJones(Joint):
    """Constant attraction γ while the gap is within d_w; a dry joint beyond.

    r̃_N = r_N + hγ: in an open contact r̃_N = 0, and the full attraction acts; in a closed one r̃_N is the pressure, on
    which Coulomb's cone ‖r_T‖ ≤ μ r̃_N stands. In the step that crosses d_w, the attraction acts for the part of the
    path within, so that the work of an escape is γ d_w, apart from the change of velocity in that step.
    """

    friction: Friction
    force: Annotated[float, Setting("Pull γ of each contact point.", "N", above=0)]
    distance: Annotated[float, Setting("Gap d_w within which it acts.", "m", above=0)]

    def __post_init__(self) -> None:
        check_settings("Lennard-Jones law", self)

    @property
    def reach(self) -> float:
        """d_w [m]."""
        return self.distance

    @property
    def _dry(self) -> DryJoint:
        return DryJoint(self.friction)

    def terms(self, contacts: Approach) -> Terms:
        """Return the attraction as a shift."""
        pull = contacts.step * self.force * self._within(contacts)
        return replace(self._dry.terms(contacts), adhesion=pull)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return the internal variables with the contacts that slide."""
        return self._dry.after(contacts, impulse, velocity)

    def _within(self, contacts: Approach) -> Array:
        """Return the part (n,) of this step's path within d_w, at the velocity before the step [-]."""
        path = contacts.step * contacts.speed
        start = contacts.gap - (1 - contacts.theta) * path
        nearest, length = np.minimum(start, start + path), np.abs(path)
        part = np.where(length > 0, (self.distance - nearest) / np.where(length > 0, length, 1.0), np.inf)
        within: Array = np.where(nearest > self.distance, 0.0, np.minimum(part, 1.0))
        return within
