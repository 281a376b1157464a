"""Closed solids with planar faces: the shape of a stone once its hidden half is known."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from survey.arrays import AXES, Array, Ints


def _sides_of_box(axis: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the corners of the lower and the upper side of a box across an axis."""
    across, second, third = (1 << (2 - (axis + k) % 3) for k in range(3))
    lower = (0, third, third + second, second)
    return lower, tuple(across + corner for corner in (lower[0], *lower[:0:-1]))


BOX = tuple(side for axis in range(AXES) for side in _sides_of_box(axis))
"""Faces of a box whose corner k is at bits k₂ k₁ k₀ of its three axes; outward if the axes are right-handed."""


@dataclass(frozen=True)
class Solid:
    """A closed polyhedron with planar faces.

    Attributes
    ----------
    code : the stone's code in the survey
    vertices : (nv, 3) corner coordinates [m]
    faces : vertex indices of each face, counter-clockwise seen from outside
    """

    code: str
    vertices: Array
    faces: tuple[tuple[int, ...], ...]


def plane_frame(normal: Array) -> Array:
    """Return a right-handed frame (3, 3), rows: two directions perpendicular to a unit normal, and the normal."""
    along = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    along /= np.linalg.norm(along)
    frame: Array = np.array([along, np.cross(normal, along), normal])
    return frame


def area_vector(polygon: Array) -> Array:
    """Return area times normal of a polygon (n, 3) in space, counter-clockwise about it [m²]."""
    corners = polygon - polygon[0]
    out: Array = 0.5 * np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return out


def area_vectors(vertices: Array, faces: tuple[tuple[int, ...], ...]) -> Array:
    """Return area times normal of all faces (…, nf, 3) of one solid or several, as `area_vector` does of one [m²].

    Parameters
    ----------
    vertices : (…, nv, 3) of solids with the same faces [m]
    faces : of each
    """
    vectors = np.empty((*vertices.shape[:-2], len(faces), 3))
    for rows, corners in _faces_by_size(faces):
        points = np.take(vertices, corners, axis=-2)
        x, y, z = np.moveaxis(points - points[..., :1, :], -1, 0)
        u, v, w = (
            np.concatenate([coordinate[..., 1:], coordinate[..., :1]], axis=-1) for coordinate in (x, y, z)
        )
        across = np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
        vectors[..., rows, :] = 0.5 * across.sum(axis=-2)
    return vectors


@lru_cache(maxsize=1024)
def _faces_by_size(faces: tuple[tuple[int, ...], ...]) -> tuple[tuple[Ints, Ints], ...]:
    """Return the faces (n,) with equal numbers of corners, and their corners (n, k).

    The stones of a building share a few lists of faces.
    """
    number = np.array([len(face) for face in faces])
    groups = [np.flatnonzero(number == count) for count in np.unique(number)]
    return tuple((rows, np.array([faces[row] for row in rows.tolist()])) for rows in groups)


def planes_of_solid(solid: Solid) -> Array:
    """Return the planes (nf, 4) of a solid's faces: outward unit normals [-], offsets d of n·x = d [m]."""
    return planes_alike(solid.vertices, solid.faces)


def planes_alike(vertices: Array, faces: tuple[tuple[int, ...], ...]) -> Array:
    """Return the planes (…, nf, 4), as `planes_of_solid`, of solids (…, nv, 3) with the same faces."""
    vectors = area_vectors(vertices, faces)
    planes = np.empty((*vectors.shape[:-1], 4))
    planes[..., :3] = vectors / np.sqrt(np.vecdot(vectors, vectors))[..., None]
    for rows, corners in _faces_by_size(faces):
        middle = np.take(vertices, corners, axis=-2).mean(axis=-2)
        planes[..., rows, 3] = np.vecdot(planes[..., rows, :3], middle)
    return planes


def highest_corner(solid: Solid) -> float:
    """Return the largest height of a corner above the plane of a face; about zero if the solid is convex [m]."""
    return float(highest_corners(solid.vertices, solid.faces))


def highest_corners(vertices: Array, faces: tuple[tuple[int, ...], ...]) -> Array:
    """Return the largest heights (…) of a corner, as `highest_corner`, of solids (…, nv, 3) with the same faces [m]."""
    # relative to a place among the corners: far from the origin, rounding would raise some
    local = vertices - vertices.mean(axis=-2, keepdims=True)
    planes = planes_alike(local, faces)
    heights = local @ np.swapaxes(planes[..., :3], -1, -2) - planes[..., None, :, 3]
    highest: Array = heights.max(axis=(-1, -2))
    return highest


def volume_of(solid: Solid) -> float:
    """Return the volume of a closed solid, by the divergence theorem; negative if seen from inside [m³]."""
    return float(volumes_alike(solid.vertices, solid.faces))


def volumes_alike(vertices: Array, faces: tuple[tuple[int, ...], ...]) -> Array:
    """Return the volumes (…), as `volume_of`, of solids (…, nv, 3) with the same faces [m³]."""
    tips = vertices[..., [face[0] for face in faces], :] - vertices.mean(axis=-2, keepdims=True)
    cones = np.vecdot(tips, area_vectors(vertices, faces))
    # one after the other, in the order of the faces
    volume: Array = np.cumsum(cones, axis=-1)[..., -1] / 3.0
    return volume
