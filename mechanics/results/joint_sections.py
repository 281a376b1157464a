"""Polygons of joints, and the centres of pressure on them.

A joint is the common polygon of two flat faces, with the area A, the centroid c, and S = ∫ (y - c)(y - c)ᵀ / A. A
force F and a moment M about c, with the compression N = F·n, meet its plane in the centre of pressure, at
e = n × M / N from c. A linear pressure with this resultant,

    p(y) = N/A (1 + eᵀ S⁻¹ (y - c)),

presses everywhere, and the resultant is within the kern, if p ≥ 0 in all corners of the polygon.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.results._kernels import Faces
from mechanics.stones.convex_polygons import following, moments, overlaps

_THIN = 1e-6  # least overlap of the faces of a joint, over the area of the smaller one [-]


@dataclass(frozen=True)
class JointPolygons:
    """Polygons of joints.

    Attributes
    ----------
    frame : (nj, 3, 3) rows n, t1, t2; n from the second to the first body, t1 along the larger second moment
    centroid : (nj, 3), half-way between the faces [m]
    area : (nj,) [m²]
    moment : (nj, 2) second moments ∫ y₁², ∫ y₂² along t1 and t2 [m⁴]
    corner : (nj, m, 2) from the centroid, along t1 and t2, counter-clockwise about n [m]
    count : (nj,) corners of each
    gap : (nj, m) between the faces at the corners [m]
    middle : (nj, m) half-way between the faces at the corners, above the centroid along n [m]
    """

    frame: Array
    centroid: Array
    area: Array
    moment: Array
    corner: Array
    count: Ints
    gap: Array
    middle: Array

    def polygons(self) -> tuple[Array, ...]:
        """Return the (k, 3) corners of each joint [m]."""
        meant = np.arange(self.corner.shape[1]) < self.count[:, None]
        joint = np.repeat(np.arange(len(self.count)), self.count)
        flat, above = self.corner[meant], self.middle[meant]
        corner = self.centroid[joint] + np.einsum("kd,kdi->ki", flat, self.frame[joint, 1:])
        corner += above[:, None] * self.frame[joint, 0]
        return tuple(corner[a:b] for a, b in pairwise([0, *np.cumsum(self.count).tolist()]))


def sections(faces: Faces, pair: Ints) -> JointPolygons:
    """Return the common polygons of pairs of faces (nj, 2), in the plane between them."""
    a, b = pair.T
    n = faces.normal[b] - faces.normal[a]
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    flat = _axes_across(n)
    origin = 0.5 * (faces.centre[a] + faces.centre[b])
    candidate = np.einsum("jki,jdi->jkd", faces.corner[a] - origin[:, None], flat)
    antagonist = np.einsum("jki,jdi->jkd", faces.corner[b] - origin[:, None], flat)
    # seen along n, the faces of the first bodies run clockwise
    place, count = np.arange(candidate.shape[1]), faces.corners[a]
    candidate = candidate[
        np.arange(len(a))[:, None], np.where(place < count[:, None], count[:, None] - 1 - place, 0)
    ]
    corner, left = overlaps(candidate, count, antagonist, faces.corners[b])
    area, middle, second = moments(corner, left)
    smaller = np.minimum(moments(candidate, count)[0], moments(antagonist, faces.corners[b])[0])
    values, axes = np.linalg.eigh(second)
    axes = np.swapaxes(axes, 1, 2)[:, ::-1]
    axes[:, 1] *= np.sign(np.linalg.det(axes))[:, None]
    heights = [_heights(faces, one, origin, n, flat, corner) for one in (a, b)]
    levels = [_heights(faces, one, origin, n, flat, middle[:, None])[:, 0] for one in (a, b)]
    level = 0.5 * (levels[0] + levels[1])
    return JointPolygons(
        frame=np.concatenate([n[:, None], axes @ flat], axis=1),
        centroid=origin + np.einsum("jd,jdi->ji", middle, flat) + level[:, None] * n,
        area=np.where(area > _THIN * smaller, area, 0.0),
        moment=values[:, ::-1],
        corner=np.einsum("jkd,jed->jke", corner - middle[:, None], axes),
        count=left,
        gap=heights[0] - heights[1],
        middle=0.5 * (heights[0] + heights[1]) - level[:, None],
    )


def _axes_across(n: Array) -> Array:
    """Return two axes (nj, 2, 3) at right angles to n, right-handed with it."""
    least = np.eye(3)[np.abs(n).argmin(axis=1)]
    first = np.cross(least, n)
    first = first / np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(n, first)], axis=1)


def _heights(faces: Faces, face: Ints, origin: Array, n: Array, flat: Array, place: Array) -> Array:
    """Return the heights along n of the planes of faces (nj,) above places (nj, m, 2) in the origin's plane [m]."""
    normal = faces.normal[face]
    at = origin[:, None] + np.einsum("jkd,jdi->jki", place, flat) - faces.centre[face][:, None]
    slope = np.einsum("ji,ji->j", n, normal)
    height: Array = -np.einsum("jki,ji->jk", at, normal) / slope[:, None]
    return height


def eccentricity(
    section: JointPolygons, force: Array, moment: Array, least: float
) -> tuple[Array, Array, Array]:
    """Locate the resultants on the joints, relative to kern and edge.

    Parameters
    ----------
    force, moment : (nj, 3) on the first body, about the centroid [N], [N m]
    least : compression below which a joint counts as free of force [N]

    Returns
    -------
    place : (nj, 2) e, along t1 and t2; NaN without compression [m]
    kern : (nj,) largest tension of a linear pressure, over the mean pressure; up to 1: in the kern [-]
    edge : (nj,) distance from the centroid (0) relative to the edge of the joint (1), and beyond [-]
    """
    n, t1, t2 = np.moveaxis(section.frame, 1, 0)
    compression = np.einsum("ji,ji->j", force, n)
    pressed = (compression > least) & (section.area > 0)
    place = np.column_stack([-np.einsum("ji,ji->j", moment, t2), np.einsum("ji,ji->j", moment, t1)])
    place = place / np.where(pressed, compression, np.nan)[:, None]
    # the second moment of a sliver can vanish in rounding
    solid = section.moment > 0.0
    slope = np.where(solid, place * section.area[:, None] / np.where(solid, section.moment, 1.0), np.nan)
    meant = np.arange(section.corner.shape[1]) < section.count[:, None]
    kern = _largest(-np.einsum("jd,jkd->jk", slope, section.corner), meant)
    rows = np.arange(len(section.count))[:, None]
    after = following(section.count, section.corner.shape[1])
    along = section.corner[rows, after] - section.corner
    reach = along[..., 1] * section.corner[..., 0] - along[..., 0] * section.corner[..., 1]
    out = along[..., 1] * place[:, None, 0] - along[..., 0] * place[:, None, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        edge = _largest(np.where(reach > 0, out / reach, -np.inf), meant)
    return place, kern, edge


def _largest(values: Array, meant: Bools) -> Array:
    largest: Array = np.where(meant, values, -np.inf).max(axis=1, initial=-np.inf)
    return np.where(np.isfinite(largest), largest, np.nan)
