"""Recognition of prisms, with corners in the order of a stone, visible ones first."""

import numpy as np

from survey.arrays import Array
from survey.extrusion.extrusion import prism
from survey.geometry.solids import Solid
from survey.simplify.blockiness import solid_planes

__all__ = ["as_prism", "box_around"]


def as_prism(solid: Solid, outward: Array, first: Array) -> Solid | None:
    """Return the solid with the corners of one end first, then those behind them; None if it is no prism.

    A prism here has two ends of n corners and n faces of four corners between them; its ends need not be parallel.

    Parameters
    ----------
    solid : closed, its faces plane
    outward : (3,) normal of the visible face; the end whose normal is nearest to it comes first
    first : (3,) the corner nearest to this point comes first [m]
    """
    count = len(solid.faces) - 2
    ends = [k for k, face in enumerate(solid.faces) if len(face) == count]
    if len(solid.vertices) != 2 * count or sum(len(face) == 4 for face in solid.faces) < count:
        return None
    if len(ends) < 2 or (count != 4 and set(solid.faces[ends[0]]) & set(solid.faces[ends[1]])):
        return None
    towards = solid_planes(solid)[ends, :3] @ outward
    front = solid.faces[ends[int(towards.argmax())]]
    behind = {a: b for face in solid.faces for a, b in _both_ways(face) if a in front and b not in front}
    if len(set(behind.values())) != count:
        return None
    start = int(np.linalg.norm(solid.vertices[list(front)] - first, axis=1).argmin())
    visible = list(front[start:] + front[:start])
    return prism(solid.code, solid.vertices[visible], solid.vertices[[behind[i] for i in visible]])


def _both_ways(face: tuple[int, ...]) -> list[tuple[int, int]]:
    edges = [(face[k - 1], face[k]) for k in range(len(face))]
    return edges + [(b, a) for a, b in edges]


def box_around(solid: Solid, outward: Array) -> Solid:
    """Return the smallest box around a solid with sides parallel to its visible face and one of the face's edges.

    Parameters
    ----------
    solid : closed
    outward : (3,) unit normal of the visible face [-]
    """
    ends = np.array([edge for face in solid.faces for edge in zip(face, face[1:] + face[:1], strict=True)])
    along = solid.vertices[ends[:, 1]] - solid.vertices[ends[:, 0]]
    along -= np.outer(along @ outward, outward)
    lengths = np.linalg.norm(along, axis=1)
    along = along[lengths > 1e-6 * lengths.max()] / lengths[lengths > 1e-6 * lengths.max(), None]
    across = np.cross(outward, along)
    areas = np.ptp(solid.vertices @ along.T, axis=0) * np.ptp(solid.vertices @ across.T, axis=0)
    best = int(areas.argmin())
    axes = np.array([along[best], across[best], outward])
    placed = solid.vertices @ axes.T
    (x0, y0, z0), (x1, y1, z1) = placed.min(axis=0), placed.max(axis=0)
    front = np.array([(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)])
    return prism(solid.code, front @ axes, (front - [0.0, 0.0, z1 - z0]) @ axes)
