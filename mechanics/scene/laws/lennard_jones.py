"""Attraction at a short distance: the non-smooth Lennard-Jones law (Renouf, Dubois & Alart 2006)."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import DryJoint, Friction
from mechanics.scene.laws.law import Approach, Terms
from mechanics.stones.settings import Setting, check_settings

__all__ = ["LennardJones"]


@dataclass(frozen=True)
class LennardJones:
    """A constant pull γ as long as the gap is within d_w; else a dry joint.

    r̃_N = r_N + hγ: where the contact is open, r̃_N = 0 says that the full pull acts; where it is closed, r̃_N is the
    pressure, and Coulomb's cone ‖r_T‖ ≤ μ r̃_N stands on it. In the step that crosses d_w, the pull acts for the part of
    the path that lies within, so the work of an escape is γ d_w, but for what the velocity changes in that step.
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
        """The pull as a shift."""
        pull = contacts.step * self.force * self._within(contacts)
        return replace(self._dry.terms(contacts), adhesion=pull)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Remember which contacts slide."""
        return self._dry.after(contacts, impulse, velocity)

    def _within(self, contacts: Approach) -> Array:
        """Part (n,) of this step's path that lies within d_w, at the velocity before the step [-]."""
        path = contacts.step * contacts.speed
        start = contacts.gap - (1 - contacts.theta) * path
        nearest, length = np.minimum(start, start + path), np.abs(path)
        part = np.where(length > 0, (self.distance - nearest) / np.where(length > 0, length, 1.0), np.inf)
        within: Array = np.where(nearest > self.distance, 0.0, np.minimum(part, 1.0))
        return within
