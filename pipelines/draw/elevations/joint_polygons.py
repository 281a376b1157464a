"""Common area of two stones as a polygon in space, by which pictures show a joint."""

from collections.abc import Sequence

import numpy as np

from pipelines.arrays import Array
from survey.geometry.solids import Solid, area_vector

__all__ = ["joint_polygon"]


_FACING = np.cos(np.radians(45.0))  # faces turned farther from the joint are not sides of it
_NOTHING = 1e-10  # smaller areas are rounding [m²]


def joint_polygon(first: Solid, second: Solid, normal: Array, centroid: Array) -> Array | None:
    """Intersect a face of one stone with a face of the other, projected onto their joint.

    Of several pairs of faces, the one with the largest intersection counts. Faces are taken for convex.

    Parameters
    ----------
    first, second : the two stones
    normal : (3,) unit normal of the joint, from the second to the first [-]
    centroid : (3,) a place of the joint [m]

    Returns
    -------
    (k, 3) corners on the joint's plane, counter-clockwise about its normal [m]; None where no faces face each other
    """
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along /= np.linalg.norm(along)
    axes = np.array([along, np.cross(normal, along)])
    best: Array | None = None
    most = _NOTHING
    for above in _sides(first, -normal, axes, centroid):
        for below in _sides(second, normal, axes, centroid):
            common = _clipped(above, below)
            if (area := _area(common)) > most:
                best, most = common, area
    return None if best is None else centroid + best @ axes


def _sides(solid: Solid, towards: Array, axes: Array, centroid: Array) -> list[Array]:
    """Project the faces of a stone that look in a direction onto the joint: (k, 2) each, counter-clockwise."""
    found = []
    for face in solid.faces:
        polygon = solid.vertices[list(face)]
        area = area_vector(polygon)
        if area @ towards > _FACING * float(np.linalg.norm(area)):
            flat = (polygon - centroid) @ axes.T
            found.append(flat if _area(flat) > 0.0 else flat[::-1])
    return found


def _clipped(subject: Array, window: Array) -> Array:
    """Clip a polygon by a convex one, both counter-clockwise, (k, 2) (Sutherland and Hodgman 1974)."""
    corners: Sequence[Array] = list(subject)
    for start, end in zip(window, np.roll(window, -1, axis=0), strict=True):
        edge = end - start
        inside = [float(edge[0] * (one[1] - start[1]) - edge[1] * (one[0] - start[0])) for one in corners]
        kept: list[Array] = []
        for i, corner in enumerate(corners):
            before = inside[i - 1]
            if before * inside[i] < 0.0:
                kept.append(corners[i - 1] + before / (before - inside[i]) * (corner - corners[i - 1]))
            if inside[i] >= 0.0:
                kept.append(corner)
        corners = kept
        if not corners:
            break
    return np.array(corners).reshape(-1, 2)


def _area(polygon: Array) -> float:
    """Return the area of a polygon (k, 2), positive if it is counter-clockwise [m²]."""
    if len(polygon) < 3:
        return 0.0
    x, y = (polygon - polygon[0]).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
