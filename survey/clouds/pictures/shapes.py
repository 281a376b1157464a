"""Stones without their mortar: masks, outlines with straight sides, and how sure their corners are."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Bools, Ints
from survey.clouds.outlines.reading import SMOOTH
from survey.clouds.outlines.tracing import few_corners, trace
from survey.clouds.pictures.joints import WIDTH, Field
from survey.conventions import CHECKED, ONE_WAY, SOME
from survey.geometry.polygons import ring_area

_STRAIGHT = SMOOTH  # distance of a traced boundary from the sides of its outline [px of the work]
_MIN_CORNERS = CHECKED  # corners of an outline that has none to spare
_BEVEL = 1.5  # length of a side that cuts a corner off, over the width of a joint
_SIDE = 4.0  # length of what is seen of a side, over the width of a joint, from which it goes straight on when hidden
_SQUARE = math.sin(ONE_WAY)  # sine of the angle between the sides beside it
_MIN_STONE_WIDTH = 1.5  # width of a stone over that of a joint
_SEEN = SOME  # contrast of mortar over the scatter of the wall from which its edge can be seen
_PIXEL = (
    0.75  # standard deviation of a corner where two straight sides meet [px of the work]: of rendered walls
)


@dataclass(frozen=True)
class Shape:
    """Outline of a region.

    Attributes
    ----------
    number : of the region
    ring : (n, 2) column and row of its corners [px of the work]
    sigma : standard deviation of a corner [px of the work]
    """

    number: int
    ring: Array
    sigma: float


def without_mortar(regions: Ints, image: Field, hidden: Bools, reach: float) -> Bools:
    """Return where (h, w) there is stone: what within a region is nearer to its inside than to its joints.

    Parameters
    ----------
    regions : (h, w) numbers; 0 is no region
    image : (h, w) in which joints are high
    hidden : (h, w) where joints cannot be seen: they are of the usual width there
    reach : farthest distance of mortar from the middle of a joint, over the width of a joint
    """
    from scipy.ndimage import distance_transform_edt, gaussian_filter, maximum_filter

    border = np.zeros(regions.shape, dtype=np.bool_)
    for axis in (0, 1):
        change = np.diff(regions, axis=axis) != 0
        border[tuple(slice(None, -1) if k == axis else slice(None) for k in (0, 1))] |= change
        border[tuple(slice(1, None) if k == axis else slice(None) for k in (0, 1))] |= change
    distance = distance_transform_edt(~border)
    inside = (distance > 1.3 * WIDTH) & (regions > 0)
    smooth = gaussian_filter(image, 0.6)
    stone = _spread(smooth, inside, 4.0 * WIDTH)
    joint = _spread(maximum_filter(smooth, 3), border & (regions > 0), 2.5 * WIDTH)
    contrast = joint - stone
    mortar = (smooth - stone > 0.5 * contrast) & (contrast > _SEEN) & (distance <= reach * WIDTH)
    mortar = np.where(hidden, distance <= 0.5 * WIDTH, mortar)
    return np.asarray((regions > 0) & ~border & ~mortar, dtype=np.bool_)


def _spread(image: Field, where: Bools, reach: float) -> Field:
    """Return the mean of a picture over the pixels that are chosen within a standard deviation [px]."""
    from scipy.ndimage import uniform_filter

    size = round(np.sqrt(12.0) * reach)  # a square of the same standard deviation
    middle = float(image[where].mean()) if where.any() else 0.0
    weight = uniform_filter(where.astype(np.float32), size) + np.float32(1e-4)
    total = uniform_filter(np.where(where, image, 0.0).astype(np.float32), size)
    out: Field = (total + np.float32(1e-4 * middle)) / weight
    return out


def outline_shapes(regions: Ints, stone: Bools, hidden: Bools) -> list[Shape]:
    """Trace the stone of each region with straight sides, which go straight on where they are hidden.

    Parameters
    ----------
    regions : (h, w) numbers
    stone : (h, w) where there is stone
    hidden : (h, w) where joints cannot be seen
    """
    from scipy.ndimage import binary_fill_holes, binary_opening, find_objects, maximum_filter

    veil = maximum_filter(hidden, 2 * round(WIDTH) + 1)
    out = []
    for number, box in enumerate(find_objects(regions), start=1):
        if box is None:
            continue
        mask: NDArray[np.bool_] = np.pad((regions[box] == number) & stone[box], 1)
        mask = binary_fill_holes(binary_opening(mask, np.ones((3, 3), dtype=bool)))
        if not mask.any() or np.sqrt(mask.sum()) < _MIN_STONE_WIDTH * WIDTH:
            continue
        dense, _, _ = trace(mask)
        if len(dense) < 3:
            continue
        dense = _straight_behind(dense, np.pad(veil[box], 1, mode="edge"))
        ring = _sharp(few_corners(dense, _STRAIGHT))
        if abs(ring_area(ring)) < (_MIN_STONE_WIDTH * WIDTH) ** 2:
            continue
        sigma = float(np.hypot(_PIXEL, _scatter(dense, ring)))
        out.append(Shape(number, ring + np.array([box[1].start - 1, box[0].start - 1]), sigma))
    return out


def _straight_behind(dense: Array, veil: Bools) -> Array:
    """Return a boundary (n, 2) whose sides go straight on behind a veil (h, w), where they meet or are one."""
    columns, rows = np.round(dense).astype(int).T
    hidden = veil[rows, columns]
    if not hidden.any() or hidden.all():
        return dense
    first = int(np.flatnonzero(~hidden & np.roll(hidden, 1))[0])
    dense, hidden = np.roll(dense, -first, axis=0), np.roll(hidden, -first)
    ends = [0, *(np.flatnonzero(np.diff(hidden)) + 1).tolist(), len(dense)]
    parts = [dense[a:b] for a, b in pairwise(ends)]  # seen and hidden by turns
    for k in range(0, len(parts), 2):
        parts[k + 1] = _between(parts[k], parts[k + 1], parts[(k + 2) % len(parts)], veil)
    return np.concatenate(parts)


def _between(before: Array, hidden: Array, after: Array, veil: Bools) -> Array:
    """Return what is between two seen parts of a boundary: nothing if they are one side, else their corners."""
    span = round(_SIDE * WIDTH)
    if min(len(before), len(after)) < span:
        return hidden
    (p, a, apart), (q, b, further) = _line(before[-span:]), _line(after[:span])
    if max(apart, further) > _STRAIGHT:
        return hidden
    turn = float(a[0] * b[1] - a[1] * b[0])
    off = q - p
    if abs(turn) < _SQUARE:
        if float(a @ b) < 0.0:  # both ends of a side that is hidden
            return np.stack([p + ((hidden - p) @ a).max() * a, q + ((hidden - q) @ b).min() * b])
        one_side = abs(float(a[0] * off[1] - a[1] * off[0])) < _STRAIGHT + abs(turn) * float(np.hypot(*off))
        return hidden[:0] if one_side else hidden
    corner = p + float(off[0] * b[1] - off[1] * b[0]) / turn * a
    column, row = np.round(corner).astype(int)
    within = 0 <= row < veil.shape[0] and 0 <= column < veil.shape[1] and veil[row, column]
    return corner[None] if within else hidden


def _line(points: Array) -> tuple[Array, Array, float]:
    """Fit a line: a point of it, its unit direction from first to last, and the largest distance of the points."""
    middle = points.mean(axis=0)
    direction = np.linalg.svd(points - middle, full_matrices=False)[2][0]
    direction *= np.sign(direction @ (points[-1] - points[0]))
    apart = (points - middle) @ np.array([-direction[1], direction[0]])
    return middle, direction, float(np.abs(apart).max())


def _sharp(ring: Array) -> Array:
    """Return an outline whose corners are not cut off: short sides between long ones about square to each other."""
    k = 0
    while k < len(ring) > _MIN_CORNERS:
        before, start, stop, after = (ring[(k + n) % len(ring)] for n in (-1, 0, 1, 2))
        first, second = start - before, after - stop
        lengths = np.linalg.norm(first), np.linalg.norm(second)
        turn = float(first[0] * second[1] - first[1] * second[0]) / max(float(lengths[0] * lengths[1]), 1e-12)
        short = float(np.linalg.norm(stop - start))
        if short > _BEVEL * WIDTH or min(lengths) < 2.0 * short or abs(turn) < _SQUARE:
            k += 1
            continue
        along = float((stop - start)[0] * second[1] - (stop - start)[1] * second[0]) / (
            turn * lengths[0] * lengths[1]
        )
        meet = start + along * first
        if not 0.0 <= along * lengths[0] <= _BEVEL * WIDTH:
            k += 1
            continue
        ring = ring.copy()
        ring[k] = meet
        ring = np.delete(ring, (k + 1) % len(ring), axis=0)
        k = max(0, k - 1)
    return ring


def _scatter(dense: Array, ring: Array) -> float:
    """Return the root mean square of the distances of a traced boundary from an outline [px]."""
    start, side = ring, np.roll(ring, -1, axis=0) - ring
    length = np.maximum((side**2).sum(axis=1), 1e-12)
    sparse = dense[:: max(1, len(dense) // 200)]
    apart = sparse[:, None] - start[None]
    along = np.clip((apart * side).sum(axis=2) / length, 0.0, 1.0)
    off = np.linalg.norm(apart - along[..., None] * side, axis=2).min(axis=1)
    return float(np.sqrt((off**2).mean()))
