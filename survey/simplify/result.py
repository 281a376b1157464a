"""Result of simplifying a stone: its solid, shape and changes."""

from dataclasses import dataclass
from enum import StrEnum

from survey.arrays import Array, Bools
from survey.geometry.solids import Solid


class BlockShape(StrEnum):
    """Shape of a simplified stone.

    HEXAHEDRON: six faces of four corners. WEDGE: a prism on a triangle. PRISM: one on a convex face of five corners
    or more. POLYHEDRON: general, convex or not, as surveyed.
    """

    HEXAHEDRON = "hexahedron"
    WEDGE = "wedge"
    PRISM = "prism"
    POLYHEDRON = "polyhedron"


@dataclass(frozen=True)
class Simplified:
    """Changes made by simplifying one stone, and their certainty; docs/theory.md has the formulas.

    Attributes
    ----------
    displacement : (nv,) of each corner of the surveyed solid [m]: its distance from the nearest edge of the simplified
        one or, where larger, the distance from the surveyed edges of a new corner that has this surveyed corner as its
        nearest. Of a surveyed corner in the middle of a planar face: its distance from that plane
    volume_change : new volume over surveyed volume, minus 1 [-]
    worst_angle : largest departure from a right angle of the angle between two neighbouring faces, inside the new
        solid [degrees]
    blockiness : 1 for a hexahedron; otherwise the volume of the intersection of the surveyed solid and a hexahedron
        over that of their union. The hexahedron is the result, or the one that the face would give without bounds;
        for an imported solid, the smallest box around it [-]
    tolerance : error of the survey: three standard deviations of its corners, or of its points from the plane of the
        face [m]
    within : whether every sound corner of the visible face, or of an imported solid, is within the tolerance of the
        edges of the new solid. A bevel's corners are on them; corners restored beyond appear in `displacement`
    reason : changes made, or the reason why there are none
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
    """Return the shape of a prism on a face of `count` corners."""
    return {3: BlockShape.WEDGE, 4: BlockShape.HEXAHEDRON}.get(count, BlockShape.PRISM)
