"""How the core between two facings is made."""

from dataclasses import dataclass
from enum import StrEnum

__all__ = ["InfillSettings", "InfillShape"]


class InfillShape(StrEnum):
    """What the core of a wall is made of.

    BLOCKS: convex blocks, cut where the joints of either facing are. STOREYS: one continuum for each storey.
    """

    BLOCKS = "blocks"
    STOREYS = "storeys"


@dataclass(frozen=True)
class InfillSettings:
    """How two facings are recognised, and how the core between them is made.

    Attributes
    ----------
    shape : blocks, or a continuum for each storey
    storey_height : of a storey, which ends at the next bed [m]; None: the whole wall is one
    max_thickness : of a wall, from one face to the other [m]
    max_angle : by which two faces of a wall may be out of parallel [degrees]
    max_joint : stones of a course that are farther apart have a hole or an opening between them [m]
    merge : joints of the two facings that are nearer than this make one cut of the core [m]
    min_thickness : where less is left between two hidden sides there is no core [m]
    level : hidden sides whose depths differ by less have one plane in a continuum [m]
    """

    shape: InfillShape = InfillShape.BLOCKS
    storey_height: float | None = None
    max_thickness: float = 2.5
    max_angle: float = 15.0
    max_joint: float = 0.06
    merge: float = 0.05
    min_thickness: float = 0.03
    level: float = 0.05
