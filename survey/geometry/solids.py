"""Closed solids with planar faces: the shape of a stone once its hidden half is known."""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array

__all__ = ["Solid", "area_vector", "highest_corner", "planes_of_solid", "volume_of"]


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


def area_vector(polygon: Array) -> Array:
    """Return area times normal of a polygon (n, 3) in space, counter-clockwise about it [m²]."""
    corners = polygon - polygon[0]
    out: Array = 0.5 * np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return out


def planes_of_solid(solid: Solid) -> Array:
    """Return the planes (nf, 4) of a solid's faces: outward unit normals [-], offsets d of n·x = d [m]."""
    rows = np.empty((len(solid.faces), 4))
    for row, face in zip(rows, solid.faces, strict=True):
        polygon = solid.vertices[list(face)]
        normal = area_vector(polygon)
        row[:3] = normal / np.linalg.norm(normal)
        row[3] = row[:3] @ polygon.mean(axis=0)
    return rows


def highest_corner(solid: Solid) -> float:
    """Return the largest height of a corner above the plane of a face; about zero if the solid is convex [m]."""
    # relative to a place among the corners: far from the origin, rounding would raise some
    local = Solid(solid.code, solid.vertices - solid.vertices.mean(axis=0), solid.faces)
    planes = planes_of_solid(local)
    return float((local.vertices @ planes[:, :3].T - planes[:, 3]).max())


def volume_of(solid: Solid) -> float:
    """Return the volume of a closed solid, by the divergence theorem; negative if seen from inside [m³]."""
    centre = solid.vertices.mean(axis=0)
    cones = (
        (solid.vertices[face[0]] - centre) @ area_vector(solid.vertices[list(face)]) for face in solid.faces
    )
    return float(sum(cones)) / 3.0
