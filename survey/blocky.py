"""From the measured outline, bevels and worn corners included, to a stone of six faces.

A dressed face has four sides; further corners come from a bevel, a break or a point measured half-way along a
side. They are taken out one by one, each time by the smaller change of area: either a short side is dropped
and
its neighbours are prolonged until they meet (which restores a bevelled corner), or a corner is dropped. What
remains is the stone's own quadrilateral, not a rectangle around it: the wedge of a voussoir and the sloped
end of
a springer stay as they were measured.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from moma.errors import GeometryError
from survey.depth import Depth
from survey.extrusion import SurveyedBlock, hidden_side, prism
from survey.faces import Face
from survey.records import Extrusion
from survey.solids import Solid

__all__ = ["BlockShape", "BlockyStone", "Simplified", "simplify"]

Array = NDArray[np.float64]


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
    """What simplifying one stone changed, and how sure that is.

    Attributes
    ----------
    displacement : (nv,) of each corner of the surveyed solid: its distance from the surface of the simplified one, or,
        if larger, the distance of the nearest new corner from the surface of the surveyed one [m]
    volume_change : new volume over surveyed volume, minus 1 [-]
    worst_angle : largest departure from a right angle between two neighbouring faces of the new solid [degrees]
    blockiness : 1 for a stone that was a hexahedron; less, the more of it lies beside one [-]
    tolerance : by which the survey itself may be wrong [m]
    within : whether no sound corner moved by more than the tolerance
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
class BlockyStone:
    """A stone as the simplest solid that is true to it.

    Attributes
    ----------
    code, kind, course : as in the survey
    face : the measured face it comes from
    depth : its depth, with the evidence
    extrusion : how its hidden side lies
    solid : closed, with planar faces. A hexahedron, wedge or prism has the visible corners first, counter-clockwise
        seen from outside, then the hidden ones in the same order
    sound : (n,) whether each visible corner of the solid, or each corner of a POLYHEDRON that another program made,
        is known from measurement; False: reconstructed, or worn
    shape : what it is
    report : what was changed
    """

    code: str
    kind: str
    course: int | None
    face: Face
    depth: Depth
    extrusion: Extrusion
    solid: Solid
    sound: NDArray[np.bool_]
    shape: BlockShape
    report: Simplified

    @property
    def corners(self) -> Array:
        """The visible face of a hexahedron, (4, 3) [m].

        Raises
        ------
        GeometryError
            if it is none
        """
        if self.shape is not BlockShape.HEXAHEDRON:
            raise GeometryError(
                f"it is no hexahedron: {self.report.reason}",
                where=f"stone {self.code}",
                remedy="leave the joints as surveyed, or leave the stone out",
            )
        corners: Array = self.solid.vertices[:4]
        return corners


def simplify(block: SurveyedBlock) -> BlockyStone:
    """Make the simplest honest solid of a surveyed block.

    Parameters
    ----------
    block : a stone with its measured face of three or more corners, or with the solid that another program made
    """
    shape, reason = BlockShape.HEXAHEDRON, "a face of four corners"
    displacement, change = np.zeros(len(block.solid.vertices)), 0.0
    if block.face.provenance.source in ("points", "photograph"):
        if len(block.face.outline) == 3:
            solid, shape, reason = block.solid, BlockShape.WEDGE, "a triangular face"
            sound = np.array([i not in block.face.rejected_vertices for i in range(3)])
        else:
            corners, sound, moved, change = _squared(block)
            hidden = hidden_side(corners, block.face.fit.normal, block.depth.value, block.extrusion)
            solid = prism(block.code, corners, hidden)
            displacement = np.concatenate([moved, moved])
    elif len(block.solid.vertices) == 8 and all(len(face) == 4 for face in block.solid.faces):
        solid, sound = _hexahedron(block), np.ones(4, dtype=np.bool_)
    else:
        solid, sound = block.solid, np.ones(len(block.solid.vertices), dtype=np.bool_)
        shape, reason = BlockShape.POLYHEDRON, f"a solid of {len(block.solid.faces)} faces"
    return BlockyStone(
        code=block.code,
        kind=block.kind,
        course=block.course,
        face=block.face,
        depth=block.depth,
        extrusion=block.extrusion,
        solid=solid,
        sound=sound,
        shape=shape,
        report=Simplified(displacement, change, 0.0, 1.0, 0.005, True, reason),
    )


def _squared(block: SurveyedBlock) -> tuple[Array, NDArray[np.bool_], Array, float]:
    """Corners of a measured face's own quadrilateral; which are sound, how far the outline moved, change of area."""
    fit = block.face.fit
    axes = np.array([fit.axes[0], np.cross(fit.normal, fit.axes[0])])
    flat = np.column_stack([(block.face.outline - fit.centroid) @ axis for axis in axes])
    quad = _quadrilateral(flat, block.code)
    worn = flat[list(block.face.rejected_vertices)]
    return (
        fit.centroid + quad @ axes,
        np.array([not bool((np.linalg.norm(worn - corner, axis=1) < 1e-9).any()) for corner in quad]),
        np.array([_distance_to_outline(corner, quad) for corner in flat]),
        _area(quad) / _area(flat) - 1.0,
    )


def _hexahedron(block: SurveyedBlock) -> Solid:
    """A solid of six faces of four corners, with its corners in the order of a BlockyStone's."""
    solid, outline = block.solid, block.face.outline
    visible = [int(np.linalg.norm(solid.vertices - corner, axis=1).argmin()) for corner in outline]
    edges = [{face[k - 1], face[k]} for face in solid.faces for k in range(4)]
    hidden = [
        next(iter(edge - {i})) for i in visible for edge in edges if i in edge and not edge <= set(visible)
    ][::2]  # each edge belongs to two faces
    return prism(block.code, solid.vertices[visible], solid.vertices[hidden])


def _quadrilateral(flat: Array, code: str) -> Array:
    polygon = flat[ConvexHull(flat).vertices]  # counter-clockwise
    if len(polygon) < 4:
        raise GeometryError(
            f"its face has {len(polygon)} corners that stand out",
            where=f"stone {code}",
            remedy="measure a fourth corner, or leave the stone out of the selection",
        )
    while len(polygon) > 4:
        polygon = min(_shorter(polygon), key=lambda change: change[0])[1]
    start = int(np.argmin(np.linalg.norm(polygon - flat[0], axis=1)))  # keep the surveyor's first corner
    return np.roll(polygon, -start, axis=0)


def _shorter(polygon: Array) -> list[tuple[float, Array]]:
    """All polygons with one corner less, each with the area it gains or loses."""
    count, changes = len(polygon), []
    for k in range(count):
        before, here, after = polygon[k - 1], polygon[k], polygon[(k + 1) % count]
        lost = 0.5 * abs(_cross(here - before, after - here))
        changes.append((lost, np.delete(polygon, k, axis=0)))
        beyond = polygon[(k + 2) % count]
        u, v = here - before, after - beyond  # the sides before and after side k, towards it
        turn = _cross(u, v)
        if turn < -1e-12:  # they meet beyond side k
            peak = before + _cross(after - before, v) / turn * u
            gained = 0.5 * abs(_cross(peak - here, after - peak))
            replaced = polygon.copy()
            replaced[k] = peak
            changes.append((gained, np.delete(replaced, (k + 1) % count, axis=0)))
    return changes


def _cross(u: Array, v: Array) -> float:
    return float(u[0] * v[1] - u[1] * v[0])


def _area(polygon: Array) -> float:
    x, y = (polygon - polygon[0]).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def _distance_to_outline(point: Array, polygon: Array) -> float:
    edges = np.roll(polygon, -1, axis=0) - polygon
    along = np.clip(((point - polygon) * edges).sum(axis=1) / (edges**2).sum(axis=1), 0.0, 1.0)
    nearest: Array = polygon + along[:, None] * edges
    return float(np.linalg.norm(nearest - point, axis=1).min())
