"""Settings of the core between two facings."""

from dataclasses import dataclass
from enum import StrEnum

from survey.conventions import WEAR, WIDEST_JOINT

MAX_JOINT = 0.06
"""Largest distance of stones of a course without a hole or an opening between them [m]."""


class InfillShape(StrEnum):
    """Make of the core of a wall.

    BLOCKS: convex blocks, cut at the joints of both facings. STOREYS: one continuum for each storey.
    """

    BLOCKS = "blocks"
    STOREYS = "storeys"


@dataclass(frozen=True)
class InfillSettings:
    """Detection of two facings, and make of the core between them.

    Attributes
    ----------
    shape : blocks, or a continuum for each storey
    storey_height : height of a storey, which ends at the next bed [m]; None: the whole wall is one
    max_thickness : largest thickness of a wall, from one face to the other [m]
    max_angle : largest angle between two faces of a wall [degrees]
    max_joint : largest distance of stones of a course without a hole or an opening between them [m]
    merge : distance of joints of the two facings below which they make one cut of the core [m]
    min_thickness : least distance of two hidden sides with core between them [m]
    level : difference of depth below which hidden sides have one plane in a continuum [m]
    """

    shape: InfillShape = InfillShape.BLOCKS
    storey_height: float | None = None
    max_thickness: float = 2.5
    max_angle: float = 15.0
    max_joint: float = MAX_JOINT
    merge: float = WIDEST_JOINT
    min_thickness: float = WEAR
    level: float = WIDEST_JOINT
