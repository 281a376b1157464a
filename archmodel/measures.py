"""Sizes of a stone that can be asked for: of its face and of its solid."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["face_area", "face_extent", "solid_volume"]

Array = NDArray[np.float64]

LEVEL = 0.05
"""A face whose normal is nearer to the vertical than this (sine) has no horizontal direction of its own."""


def face_area(outline: Array) -> float:
    """Area of a plane polygon [m²], outline (nv, 3) in order [m]: half of |Σ pᵢ × pᵢ₊₁|."""
    corners = outline - outline[0]
    return 0.5 * float(np.linalg.norm(np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)))


def face_extent(outline: Array, normal: Array) -> tuple[float, float]:
    """Length and height of a face [m]: its extents along the horizontal and upwards, both in its plane.

    A level face (a paving, the top of a wall) has its larger and smaller principal extents instead.

    Parameters
    ----------
    outline : (nv, 3) corners [m]
    normal : (3,) unit normal of the face
    """
    along = np.array([-normal[1], normal[0], 0.0])
    if float(np.linalg.norm(along)) > LEVEL:
        along /= np.linalg.norm(along)
        extents = [float(np.ptp(outline @ axis)) for axis in (along, np.cross(normal, along))]
    else:
        axes = np.linalg.svd(outline - outline.mean(axis=0), full_matrices=False)[2][:2]
        extents = sorted((float(np.ptp(outline @ axis)) for axis in axes), reverse=True)
    return extents[0], extents[1]


def solid_volume(vertices: Array, faces: Sequence[Sequence[int]]) -> tuple[float, Array]:
    """Volume [m³] and centroid (3,) [m] of a closed polyhedron, by the divergence theorem.

    The volume is negative if the faces are clockwise seen from outside.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    faces : vertex indices of each planar face, counter-clockwise seen from outside
    """
    origin = vertices.mean(axis=0)  # sums of small numbers, wherever the site's frame has its origin
    fans = [(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)]
    a, b, c = np.moveaxis((vertices - origin)[np.array(fans)], 1, 0)
    signed = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(signed.sum())
    if volume == 0.0:
        return 0.0, origin
    return volume, origin + (signed @ (a + b + c)) / (4.0 * volume)
