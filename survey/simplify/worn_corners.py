"""Restoration of worn corners from points on the dressed margin, which still run along the lost sides.

An eroded corner is measured where the stone now ends, some centimetres from where its sides met. Points measured
along the margin of the face lie at about the same distance from all its sides, and the sound sides give that distance.
Of each of the two sides shortened by wear one end is left, the sound neighbour: the side is the line through it at
the same distance from the points beside it. Two such sides meet in the corner. Where no such distance is common to
the sound sides, or too few points lie at it, the corner stays as it was measured.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from survey.arrays import Array, Bools
from survey.conventions import CHECKED, MOST
from survey.simplify.squaring import SquaredFace

_FEWEST_BESIDE_SOUND = CHECKED  # least number of points that give the width of the margin
_FEWEST_BESIDE_WORN = 2  # least number of points that give a side: one finds it, another checks
_REACH = MOST  # of the side's length: least distance from the sound end of a point beside no other side


def restore_worn(
    face: SquaredFace, worn: Bools, points: Array, tolerance: float, farthest: float
) -> tuple[SquaredFace, int]:
    """Put worn corners where the sides beside them meet.

    Parameters
    ----------
    face : convex
    worn : (n,) whether each measured corner is worn
    points : (np, 2) that were measured on the face, without blunders [m]
    tolerance : of the survey, by which the width of an even margin may vary [m]
    farthest : largest distance of a restored corner outside the sides as measured [m]

    Returns
    -------
    the face, and the number of restored corners, whose `source` is -1
    """
    count, restored = len(face.corners), 0
    lost = [k for k in range(count) if face.source[k] >= 0 and worn[face.source[k]]]
    margin = _margin(face.corners, lost, points, tolerance, farthest) if lost else None
    if margin is None:
        return face, 0
    corners, source = face.corners.copy(), face.source.copy()
    for k in lost:
        before, after = (k - 1) % count, (k + 1) % count
        if before in lost or after in lost:
            continue
        ends = corners[before], corners[k], corners[after]
        clear = [_clear(face.corners, side, points, 0.5 * farthest) for side in (before, k)]
        along = _direction(ends[0], ends[1] - ends[0], points, clear[0], margin, tolerance, farthest)
        back = _direction(ends[2], ends[2] - ends[1], points, clear[1], margin, tolerance, farthest)
        if along is None or back is None:
            continue
        moved = corners.copy()
        moved[k] = _meeting(ends[0], along, ends[2], back)
        if _stands_out(ends, moved[k], tolerance, farthest) and _is_convex(moved):
            corners, restored = moved, restored + 1
            source[k] = -1
    return replace(face, corners=corners, source=source), restored


def _margin(
    corners: Array, lost: list[int], points: Array, tolerance: float, farthest: float
) -> float | None:
    """Return the distance of the margin's points from the sound sides [m]; None if most have no common one."""
    count = len(corners)
    gathered = []
    for k in range(count):
        if k in lost or (k + 1) % count in lost:
            continue
        run = corners[(k + 1) % count] - corners[k]
        step = points - corners[k]
        height, share = _cross(run, step) / np.linalg.norm(run), step @ run / (run @ run)
        gathered.append(height[(share > 0.0) & (share < 1.0) & (height < farthest)])
    heights = np.concatenate(gathered) if gathered else np.empty(0)
    alike = np.abs(heights[:, None] - heights) <= tolerance
    best = alike[int(alike.sum(axis=1).argmax())] if len(heights) else alike
    if best.sum() < max(_FEWEST_BESIDE_SOUND, 0.5 * len(heights)):
        return None
    return float(heights[best].mean())


def _clear(corners: Array, side: int, points: Array, beside: float) -> Bools:
    """Return the points (np,) that are not beside any other side, so that they can only be those of this one."""
    count = len(corners)
    clear = np.ones(len(points), dtype=np.bool_)
    for k in range(count):
        if k != side:
            run = corners[(k + 1) % count] - corners[k]
            share = np.clip((points - corners[k]) @ run / (run @ run), 0.0, 1.0)
            clear &= np.linalg.norm(points - corners[k] - share[:, None] * run, axis=1) > beside
    return clear


def _direction(
    anchor: Array,
    run: Array,
    points: Array,
    clear: Bools,
    margin: float,
    tolerance: float,
    farthest: float,
) -> Array | None:
    """Return the direction (2,) of a side through its sound end, points at a distance on its left; None if unknown.

    Parameters
    ----------
    anchor : (2,) sound end [m]
    run : (2,) the side as measured, counter-clockwise around the face [m]
    clear : (np,) points that are beside no other side
    """
    length = float(np.linalg.norm(run))
    step = points - anchor
    reach = step @ run / length
    inward = 1.0 if np.median(reach) > 0.0 else -1.0  # -1: the sound end is the last of the side
    reach, height = inward * reach, _cross(run, step) / length
    close = (np.abs(height) <= farthest) & (reach > 0.0) & (reach < length + farthest)
    close &= np.hypot(reach, height) > abs(margin) + tolerance
    if not close.any():
        return None
    distance, angle = np.hypot(reach[close], height[close]), np.arctan2(height[close], reach[close])
    # each point gives one line through the end; the one that fits most points counts
    turns = angle - np.arcsin(margin / distance)
    misses = distance * np.sin(angle - turns[:, None]) - margin
    fits = np.abs(misses) <= tolerance
    # no point lies nearer to a side than the margin's do
    worth = fits.sum(axis=1) - 2 * (misses < -tolerance).sum(axis=1)
    best = min(range(len(turns)), key=lambda i: (-int(worth[i]), float(np.abs(misses[i][fits[i]]).sum())))
    chosen = fits[best]
    reaching = distance[chosen & clear[close]].max(initial=0.0)
    distance, angle = distance[chosen], angle[chosen] - turns[best]
    if len(distance) < _FEWEST_BESIDE_WORN or reaching < _REACH * length:
        return None
    leverage = distance * np.cos(angle)
    turn = turns[best] + float((distance * np.sin(angle) - margin) @ leverage / (leverage @ leverage))
    c, s = np.cos(inward * turn), np.sin(inward * turn)
    return np.array([c * run[0] - s * run[1], s * run[0] + c * run[1]]) / length


def _cross(u: Array, v: Array) -> Array:
    out: Array = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return out


def _meeting(a: Array, u: Array, b: Array, v: Array) -> Array:
    """Return the intersection of the lines through a along u and through b along v; a if they are parallel."""
    turn = float(_cross(u, v))
    return a if abs(turn) < 1e-9 else a + float(_cross(b - a, v)) / turn * u


def _stands_out(ends: tuple[Array, Array, Array], place: Array, tolerance: float, farthest: float) -> bool:
    """Return whether a corner between two sides is outside both, within the tolerance, but not too far."""
    heights = []
    for start, stop in pairwise(ends):
        run = stop - start
        heights.append(float(_cross(place - start, run)) / float(np.linalg.norm(run)))
    return min(heights) >= -tolerance and max(heights) >= 0.0 and min(heights) <= farthest


def _is_convex(corners: Array) -> bool:
    run = np.roll(corners, -1, axis=0) - corners
    return bool((_cross(run, np.roll(run, -1, axis=0)) > 0.0).all())
