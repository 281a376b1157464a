"""Convergence and slope of the sides of arch stones."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from survey.arrays import Array
from survey.quality.facades import Facade, upright_frame
from survey.quality.precision import StoneQuality

__all__ = ["SideConvergence", "sloped_side", "wedges"]


_ARCH = ("voussoir", "keystone")
_REACH = 3.0  # of the stone's larger dimension: distance within which its neighbours in the arch are
_BULGE = 0.02  # least rise over the chord of the neighbours, over their distance, that shows the extrados
_LEVEL = 0.5  # sine of a radius' rise below which it does not show which end is up
_SHORT = 0.5  # of the longest side: length below which a side is an arris or a worn corner


@dataclass(frozen=True)
class SideConvergence:
    """Convergence of the two sides of an arch stone.

    Attributes
    ----------
    convergence : angle between them, positive if they meet beyond the intrados [rad]
    sigma : standard deviation [rad]
    """

    convergence: float
    sigma: float


def wedges(stones: Sequence[StoneQuality], facades: Sequence[Facade]) -> dict[int, SideConvergence]:
    """Return the convergence of every voussoir and keystone of the standing facades, by index.

    A stone's sides are those that face along the arch, from one of its neighbours to the other; the extrados
    is on the side where it rises over the chord between them. Stones whose sides have worn corners are left out, and
    those whose intrados cannot be identified.
    """
    found = {}
    for facade in facades:
        members = [i for i in facade.members.tolist() if stones[i].kind in _ARCH]
        if facade.azimuth is None or not members:
            continue
        flats = [facade.frame.flatten(stones[i].outline) for i in members]
        centres = np.array([flat.mean(axis=0) for flat in flats])
        tree = cKDTree(centres)
        for k, index in enumerate(members):
            radial = _radial(k, centres, tree, _REACH * float(np.ptp(flats[k], axis=0).max()))
            wedge = None if radial is None else _wedge(flats[k], radial, stones[index])
            if wedge is not None:
                found[index] = wedge
    return found


def sloped_side(stone: StoneQuality) -> tuple[float, float]:
    """Return the departure of the most sloped longer side from both level and plumb, and its sigma [rad]."""
    flat = upright_frame(stone.normal, stone.outline[0]).flatten(stone.outline)
    run = np.roll(flat, -1, axis=0) - flat
    length = np.linalg.norm(run, axis=1)
    slope = np.arctan2(np.abs(run).min(axis=1), np.abs(run).max(axis=1))
    slope[length < _SHORT * length.max()] = 0.0
    k = int(slope.argmax())
    return float(slope[k]), math.sqrt(2.0) * _corner(stone) / float(length[k])


def _corner(stone: StoneQuality) -> float:
    """Return the standard deviation of a corner in the plane of the face."""
    return stone.dimension_sigma / math.sqrt(2.0)


def _radial(k: int, centres: Array, tree: "cKDTree[None]", reach: float) -> Array | None:
    """Return the unit vector towards the extrados in the elevation; None if it cannot be determined."""
    if len(centres) == 1:
        return np.array([0.0, 1.0])  # an arch of one stone
    distances, near = tree.query(centres[k], k=min(3, len(centres)), distance_upper_bound=reach)
    others = [
        int(i)
        for i, d in zip(np.ravel(near), np.ravel(distances), strict=True)
        if i != k and math.isfinite(d)
    ]
    if not others:
        return np.array([0.0, 1.0])
    chord = centres[others[0]] - centres[k]
    rise = np.zeros(2)
    if len(others) == 2:  # of the three stones the middle one rises over the chord of the others
        three = centres[[k, *others]]
        longest = np.linalg.svd(three - three.mean(axis=0))[2][0]
        order = np.argsort(three @ longest)
        first, middle, last = three[order]
        rise = middle - (first + last) / 2.0
        chord = last - first if order[1] == 0 else chord
    size = float(np.linalg.norm(chord))
    radial = np.array([-chord[1], chord[0]]) / size
    if abs(radial[1]) > _LEVEL:
        return radial if radial[1] > 0.0 else -radial
    if abs(rise @ radial) > _BULGE * size:
        return radial if rise @ radial > 0.0 else -radial
    return None


def _wedge(flat: Array, radial: Array, stone: StoneQuality) -> SideConvergence | None:
    tangent = np.array([radial[1], -radial[0]])
    run = np.roll(flat, -1, axis=0) - flat
    length = np.linalg.norm(run, axis=1)
    outward = np.column_stack([run[:, 1], -run[:, 0]]) / length[:, None]
    angles, variance = [], 0.0
    for sign in (1.0, -1.0):
        facing = outward @ (sign * tangent)
        k = int(np.where(facing > math.sqrt(0.5), length, 0.0).argmax())
        if facing[k] <= math.sqrt(0.5) or {k, (k + 1) % len(flat)} & set(stone.worn_corners):
            return None
        up = run[k] if run[k] @ radial > 0.0 else -run[k]
        angles.append(sign * math.atan2(float(up @ tangent), float(up @ radial)))
        variance += 2.0 * _corner(stone) ** 2 / float(length[k]) ** 2
    return SideConvergence(sum(angles), math.sqrt(variance))
