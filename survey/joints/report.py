"""What closing the joints of a building found, changed, and left open."""

from collections.abc import Mapping
from dataclasses import dataclass

from survey.arrays import Array
from survey.joints.settings import JointMode

__all__ = ["ClosingReport", "Gap", "Joint", "Overlap"]


@dataclass(frozen=True)
class Joint:
    """Where two stones face each other.

    Attributes
    ----------
    stones : codes of the two
    plane : number of the contact plane; all joints of a straight bed have the same. -1 where it stays open
    width : mean distance of the two faces as surveyed; negative where they overlap [m]
    opening : angle between the two faces as surveyed [degrees]
    area : that they share, after closing; as surveyed, seen square to the joint, where it stays open [m²]
    centroid : (3,) of that area [m]
    normal : (3,) unit normal, from the second stone to the first [-]
    left_open : why it stays open; empty if it is closed
    """

    stones: tuple[str, str]
    plane: int
    width: float
    opening: float
    area: float
    centroid: Array
    normal: Array
    left_open: str


@dataclass(frozen=True)
class Gap:
    """Two stones that face each other and do not meet.

    Attributes
    ----------
    stones : codes of the two
    width : mean [m]
    area : over which they face each other [m²]
    centroid : (3,) [m]
    reason : why it was not closed
    """

    stones: tuple[str, str]
    width: float
    area: float
    centroid: Array
    reason: str


@dataclass(frozen=True)
class Overlap:
    """Two stones that lie in each other.

    Attributes
    ----------
    stones : codes of the two
    volume : that both take [m³]
    depth : by which one would have to move to be free [m]
    centroid : (3,) [m]
    """

    stones: tuple[str, str]
    volume: float
    depth: float
    centroid: Array


@dataclass(frozen=True)
class ClosingReport:
    """What closing the joints has changed, stone by stone and joint by joint.

    Attributes
    ----------
    mode : what was made of the joints
    joints : all that were found, open ones too
    displacement : by code, how far each corner of the stone's solid moved [m]
    volume_change : by code, new volume over old, minus 1 [-]
    alone : codes of stones without any joint
    gaps, overlaps : what remains
    """

    mode: JointMode
    joints: tuple[Joint, ...]
    displacement: Mapping[str, Array]
    volume_change: Mapping[str, float]
    alone: tuple[str, ...]
    gaps: tuple[Gap, ...]
    overlaps: tuple[Overlap, ...]

    @property
    def largest_displacement(self) -> float:
        """Largest distance that any corner moved [m]."""
        return max((float(moved.max()) for moved in self.displacement.values()), default=0.0)
