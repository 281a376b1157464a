"""Volumes and centroids of solids, many at once."""

from collections.abc import Sequence

import numpy as np

from archmodel.arrays import Array

__all__ = ["solid_volume", "solid_volumes"]

Faces = Sequence[Sequence[int]]


def solid_volume(vertices: Array, faces: Faces) -> tuple[float, Array]:
    """Volume [m³] and centroid (3,) [m] of a closed polyhedron, by the divergence theorem.

    The volume is negative if the faces are clockwise seen from outside.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    faces : vertex indices of each planar face, counter-clockwise seen from outside
    """
    volumes, centroids = _alike(vertices[None], faces)
    return float(volumes[0]), centroids[0]


def solid_volumes(solids: Sequence[tuple[Array, tuple[tuple[int, ...], ...]]]) -> tuple[Array, Array]:
    """As `solid_volume` of many solids, (n,) and (n, 3); those with the same faces are computed together.

    Parameters
    ----------
    solids : (vertices, faces) of each
    """
    groups: dict[tuple[int, tuple[tuple[int, ...], ...]], list[int]] = {}
    for number, (vertices, faces) in enumerate(solids):
        groups.setdefault((len(vertices), faces), []).append(number)
    volumes, centroids = np.empty(len(solids)), np.empty((len(solids), 3))
    for (_, faces), members in groups.items():
        volumes[members], centroids[members] = _alike(np.stack([solids[i][0] for i in members]), faces)
    return volumes, centroids


def _alike(vertices: Array, faces: Faces) -> tuple[Array, Array]:
    """Volumes (n,) and centroids (n, 3) of solids that differ in their vertices (n, nv, 3) only."""
    origin = vertices.mean(axis=1)  # sums of small numbers, wherever the site's frame has its origin
    fans = np.array([(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)])
    local = vertices - origin[:, None]
    a, b, c = (local[:, fans[:, k]] for k in range(3))
    ux, uy, uz = np.moveaxis(b, 2, 0)
    vx, vy, vz = np.moveaxis(c, 2, 0)
    signed = a[..., 0] * (uy * vz - uz * vy)
    signed += a[..., 1] * (uz * vx - ux * vz)
    signed += a[..., 2] * (ux * vy - uy * vx)
    volume = signed.sum(axis=1) / 6.0
    moment = np.einsum("ij,ijk->ik", signed, a + b + c) / 24.0
    with np.errstate(invalid="ignore", divide="ignore"):
        offset = np.where(volume[:, None] != 0.0, moment / volume[:, None], 0.0)
    return volume, origin + offset
