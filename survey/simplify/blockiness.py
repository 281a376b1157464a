"""Measures of a simplified solid: displacement of its corners, skewness, and share in common with a hexahedron."""

from functools import lru_cache

import numpy as np

from survey.arrays import Array, Ints
from survey.geometry.solids import Solid
from survey.simplify._kernels.blockiness import (
    area_vectors,
    common_volume,
    edge_distances,
    face_planes,
    volume,
    worst_angle,
)


def about(solid: Solid, origin: Array) -> Solid:
    """Return a solid relative to an origin (3,) near it, which keeps rounding small."""
    return Solid(solid.code, solid.vertices - origin, solid.faces)


def solid_volume(solid: Solid) -> float:
    """Return the volume [m³]; negative if the faces are seen from inside."""
    return float(volume(*_arrays(solid)))


def solid_planes(solid: Solid) -> Array:
    """Return the planes (nf, 4) of the faces: outward unit normal [-], distance from the origin [m]."""
    planes: Array = face_planes(*_arrays(solid))
    return planes


def face_vectors(solid: Solid) -> Array:
    """Return area times outward normal of each face (nf, 3) [m²]."""
    vectors: Array = area_vectors(*_arrays(solid))
    return vectors


def largest_skew(solid: Solid) -> float:
    """Return the largest departure from a right angle of the inside angle between neighbouring faces [degrees]."""
    return float(np.degrees(worst_angle(*_arrays(solid))))


def from_edges(points: Array, solid: Solid) -> Array:
    """Return the distance (n,) of each point (n, 3) from the nearest edge of a solid [m]."""
    distances: Array = edge_distances(np.ascontiguousarray(points), *_arrays(solid))
    return distances


def moved_corners(old: Solid, new: Solid, left: Array) -> Array:
    """Return the displacement of each corner of a solid, (nv,) [m].

    Parameters
    ----------
    old, new : solid before and after
    left : (nv,) distance of each old corner from the new solid [m]

    Returns
    -------
    that distance or, if larger, the distance from the old solid's edges of a new corner that has this old corner
    as its nearest
    """
    out = left.copy()
    gone = from_edges(new.vertices, old)
    apart = np.linalg.norm(old.vertices[:, None, :] - new.vertices, axis=2)
    for corner, nearest in enumerate(apart.argmin(axis=0).tolist()):
        out[nearest] = max(out[nearest], gone[corner])
    return out


def common_share(solid: Solid, convex: Solid) -> float:
    """Return the volume of the intersection with a convex solid over that of the union, 0 to 1 [-]."""
    common = float(common_volume(*_arrays(solid), solid_planes(convex)))
    share = common / (solid_volume(solid) + solid_volume(convex) - common)
    return min(max(share, 0.0), 1.0)


def _arrays(solid: Solid) -> tuple[Array, Ints, Ints]:
    return np.ascontiguousarray(solid.vertices), *_corners(solid.faces)


@lru_cache(maxsize=1024)
def _corners(faces: tuple[tuple[int, ...], ...]) -> tuple[Ints, Ints]:
    """Return the corners of all faces, concatenated, and the index of the first corner of each face."""
    corners = np.array([i for face in faces for i in face], dtype=np.int64)
    return corners, np.cumsum([0, *(len(face) for face in faces)], dtype=np.int64)
