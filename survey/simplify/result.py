"""What simplifying a stone yields: its solid, what that is, and what has changed."""

from dataclasses import dataclass
from enum import StrEnum

from survey.arrays import Array, Bools
from survey.geometry.solids import Solid

__all__ = ["BlockShape", "SimpleSolid", "Simplified", "prism_shape"]


class BlockShape(StrEnum):
    """What a simplified stone is.

    HEXAHEDRON: six faces of four corners. WEDGE: a prism on a triangle. PRISM: one on a convex face of five corners
    or more. POLYHEDRON: general, convex or not, as it was surveyed.
    """

    HEXAHEDRON = "hexahedron"
    WEDGE = "wedge"
    PRISM = "prism"
    POLYHEDRON = "polyhedron"


@dataclass(frozen=True)
class Simplified:
    """What simplifying one stone changed, and how sure that is. docs/theory.md has the formulas.

    Attributes
    ----------
    displacement : (nv,) of each corner of the surveyed solid [m]: its distance from the nearest edge of the simplified
        one; where that is larger, the distance from the surveyed edges of a new corner to which no surveyed corner is
        nearer. Of a surveyed corner amid a plane face: its distance from that plane
    volume_change : new volume over surveyed volume, minus 1 [-]
    worst_angle : largest departure from a right angle of the angle between two neighbouring faces, inside the new
        solid [degrees]
    blockiness : 1 for a hexahedron; else what the surveyed solid and a hexahedron have in common, over what they fill
        together: that which it has become, or which its face would have become without bounds; for the solid of
        another program the smallest box around it [-]
    tolerance : by which the survey may be wrong: three standard deviations of its corners, or of its points from the
        plane of the face [m]
    within : whether no sound corner of the visible face, or of a solid of another program, is left farther from the
        edges of the new solid than the tolerance. A bevel's corners are on them; what was restored beyond is told by
        `displacement`
    reason : what was done, or why nothing was, in words
    """

    displacement: Array
    volume_change: float
    worst_angle: float
    blockiness: float
    tolerance: float
    within: bool
    reason: str


@dataclass(frozen=True)
class SimpleSolid:
    """A simplified solid; its attributes are those of a `BlockyStone`."""

    solid: Solid
    sound: Bools
    shape: BlockShape
    report: Simplified


def prism_shape(count: int) -> BlockShape:
    """What a prism on a face of so many corners is."""
    return {3: BlockShape.WEDGE, 4: BlockShape.HEXAHEDRON}.get(count, BlockShape.PRISM)
