"""Planes of faces between versions 1 and 2: covariance of the offset there, of the height at the centroid here.

Version 1 kept the normal, the offset d, and the covariance of (θ₁, θ₂, d): with the centroid c and the axes eᵢ of the
accepted points, d = n·c and var θᵢ = tᵢ, it is tᵢ on the diagonal, -tᵢ (eᵢ·c) beside it, and h + Σ tᵢ (eᵢ·c)² for d.
Version 2 keeps c, eᵢ and diag(t₁, t₂, h). The fit was to points and corners together, all of one weight, so that c
and eᵢ follow from what version 1 kept, and h = t₁ s₁² / n with the first singular value s₁ of the n accepted ones: at
10⁶ m from the origin nothing would be left of it in the variance of d.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from archmodel.arrays import Array

__all__ = ["Plane", "covariance_of_offset", "plane_of_version_1"]


@dataclass(frozen=True)
class Plane:
    """What version 2 keeps of a plane besides normal and offset.

    Attributes
    ----------
    centroid : (3,) of the accepted points and corners [m]
    axes : (2, 3) unit directions of largest and of smaller spread [-]
    covariance : (3, 3) of two tilts [rad] and the height at the centroid [m]
    rejected_vertices : indices into the outline of corners that were no part of the fit
    """

    centroid: Array
    axes: Array
    covariance: Array
    rejected_vertices: tuple[int, ...]

    @classmethod
    def fitted(cls, accepted: Array, normal: Array, covariance: Array, rejected: tuple[int, ...]) -> Self:
        """Of the (n, 3) accepted points and corners, and the covariance of version 1."""
        centroid = accepted[0] + (accepted - accepted[0]).mean(axis=0)
        _, singular, vectors = np.linalg.svd(accepted - centroid)
        first = vectors[0] - (vectors[0] @ normal) * normal
        first *= np.copysign(1.0 / np.linalg.norm(first), first[np.argmax(np.abs(first))])
        tilts = covariance.diagonal()[:2]
        height = tilts[0] * singular[0] ** 2 / len(accepted)
        axes = np.array([first, np.cross(normal, first)])
        return cls(centroid, axes, np.diag([*tilts, height]), rejected)


def plane_of_version_1(
    points: Array,
    vertices: Array,
    outline: Array,
    rejected: list[int],
    redundancy: int,
    normal: Array,
    offset: float,
    covariance: Array,
) -> Plane:
    """The plane as version 2 keeps it.

    Which corners were left out version 1 did not keep, but how many follows from the redundancy: they are those
    farthest from the plane.

    Parameters
    ----------
    points, vertices : (np, 3), (nv, 3) as measured [m]
    outline : (nv, 3) the corners on the plane, in the order of `vertices` or in the opposite one [m]
    rejected : indices of the points left out
    redundancy : number of accepted points and corners minus 3
    normal, offset, covariance : (3,), [m], (3, 3) as version 1 kept them
    """
    count = len(points) + len(vertices) - len(rejected) - 3 - redundancy
    count = min(max(count, 0), len(vertices) - 1)
    distances = np.abs(vertices @ normal - offset)
    broken = np.sort(np.argsort(distances, kind="stable")[len(vertices) - count :])
    accepted = np.vstack([np.delete(points, rejected, axis=0), np.delete(vertices, broken, axis=0)])
    on_outline = broken if _same_order(vertices, outline) else np.sort(len(vertices) - 1 - broken)
    return Plane.fitted(accepted, normal, covariance, tuple(on_outline.tolist()))


def _same_order(vertices: Array, outline: Array) -> bool:
    """Whether an outline has its corners in the order in which they were measured."""
    along, against = (float(np.abs(outline - one).sum()) for one in (vertices, vertices[::-1]))
    return along <= against


def covariance_of_offset(centroid: Array, axes: Array, covariance: Array) -> Array:
    """(3, 3) covariance of two tilts and the offset, as version 1 kept it, from that of version 2."""
    levers, tilts = axes @ centroid, covariance.diagonal()[:2]
    out = np.diag([*tilts, covariance[2, 2] + float(tilts @ levers**2)])
    out[:2, 2] = out[2, :2] = -tilts * levers
    return out
