"""The rib vault over the room of a storey: its place above the openings, and the corbels that it stands on.

::

        T4 │         │ T1     Plan of the room. The springers T2 and T3 stand on corbels, whose tails lie in the corners
         B │  vault  │ C      of the walls, and lean against their inner faces. T1 and T4 stand on the open side, which
        T3 │_________│ T2     was not surveyed, and are fixed. Wall ribs and webs stay clear of the walls.
                A
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

import numpy as np

from survey.arrays import Array
from survey.extrusion.extrusion import prism
from synthetic.building import Draft, SolidDraft
from synthetic.buildings.ribs import WALL_RIB, RibVaultShape, vault_drafts

PROJECTION = 0.36
"""Distance to which corbels project from either wall, a little more than the springers that stand on them [m]."""
STANDING = ("T1", "T4")
"""Codes of the springers on the open side."""

_CORBELS = 0.5  # share of the courses up to the bed that the springers stand on
_SPRINGER = 0.8  # height of a springer below the web's soffit at its rib's joint [m]
_CLEAR = 0.06  # distance of the wall ribs from the walls, too wide for a joint [m]


@dataclass(frozen=True)
class StoreyVault:
    """A rib vault over the room of a storey.

    Attributes
    ----------
    shape : its dimensions
    course : of its corbels, in the inner facings
    flush : first and last course of the stones with which springers and corbels meet
    beds : heights of the beds below and above the corbels [m]
    middle : (3,) of the room on its ground [m]
    axes : (3, 3) rows: along wall A, from it into the room, and upwards [-]
    """

    shape: RibVaultShape
    course: int
    flush: tuple[int, int]
    beds: tuple[float, float]
    middle: Array
    axes: Array

    def webs_and_ribs(self, rng: Random) -> tuple[list[Draft], list[SolidDraft]]:
        """Draft the stones of the vault: webs, and what is modelled as solids."""
        centre = self.middle + (self.beds[1] - self.shape.heights[0]) * self.axes[2]
        return vault_drafts(self.shape, centre, self.axes, rng)

    def corbels(self, tail: float) -> list[SolidDraft]:
        """Draft the corbels in the corners left and right of wall A, whose tails are squares in the walls [m]."""
        inner, outer = self.shape.half - PROJECTION, self.shape.half + tail
        low, high = self.beds
        out = []
        for number, left in enumerate((-outer, inner), start=1):
            right = left + outer - inner
            plan = np.array([(left, -outer), (right, -outer), (right, -inner), (left, -inner)])
            top, bottom = (
                np.column_stack([plan, np.full(4, z)]) @ self.axes + self.middle for z in (high, low)
            )
            solid = prism(f"AI{self.course:02d}-K{number}", top, bottom)
            out.append(SolidDraft(solid, "corbel", self.course))
        return out


def plan_vault(heights: Sequence[float], half: float, middle: Array, axes: Array) -> StoreyVault | None:
    """Plan a rib vault halfway up a storey; None if it would be higher than the walls.

    Parameters
    ----------
    heights : of the beds, the ground first [m]
    half : half the side of the square room [m]
    middle : (3,) of the room on its ground [m]
    axes : (3, 3) rows: along wall A, from it into the room, and upwards [-]
    """
    shape = RibVaultShape(
        half=half, radius=math.sqrt(2.0) * half, springer=_SPRINGER, wall_rib=WALL_RIB, clear=_CLEAR
    )
    foot, corner, top = shape.heights
    course = round(_CORBELS * (len(heights) - 1))
    bed = heights[course]
    if bed + top - foot > heights[-1]:
        return None
    last = next(k for k, height in enumerate(heights) if height >= bed + corner - foot)
    return StoreyVault(shape, course, (course, last), (heights[course - 1], bed), middle, axes)
