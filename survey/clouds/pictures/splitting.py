"""Joints that are missing between strong ones: straight lines across a region, from one of its borders to the other.

A joint that a stain or flush mortar hides is too weak to part regions, but the mean along a line across the
whole stone, one that a head
joint would follow from bed to bed, may still stand out. Such a line is proposed if its probability, by the
same weights as of all borders, is high.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from survey.arrays import Array, Bools, Ints
from survey.clouds.pictures.bond import GAP, LIKELY, WEIGHTS
from survey.clouds.pictures.joints import STRONGEST, WIDTH, Field, Strength
from survey.conventions import LARGELY

_ACROSS = LARGELY  # part of the height of a region that a line crosses at least
_LEAN = 4  # pixels by which the ends of a line lean to either side
_CLEAR = 2.0  # distance from the ends of a region over the width of a joint


@dataclass(frozen=True)
class Line:
    """A line across a region: mean strength, share of gaps, strength over that of the lines beside it, place [px].

    Attributes
    ----------
    strength : mean along it, over that of a usual joint
    gaps : share of it without a joint
    prominence : logarithm of its strength over the median of all lines across
    middle, lean : column of its middle, and by how many its ends lie to either side
    """

    strength: float
    gaps: float
    prominence: float
    middle: int
    lean: int


def propose_missing(
    regions: Ints,
    strength: Strength,
    hidden: Bools,
    least: float = LIKELY,
    weights: Sequence[float] | Array = WEIGHTS["missing"],
) -> Ints:
    """Part regions where a straight joint across them is likely.

    Parameters
    ----------
    regions : (h, w) numbers; those that are joined have one
    strength : of joints, 1 at a usual one
    hidden : (h, w) where joints cannot be seen
    least : probability from which a line is proposed
    weights : of constant, strength, gaps, prominence, how much fuller the whole is, and size

    Returns
    -------
    (h, w) numbers, of new regions above all others
    """
    from scipy.ndimage import find_objects

    out = regions.copy()
    following = int(out.max()) + 1
    waiting = [(k, box) for k, box in enumerate(find_objects(out), start=1) if box is not None]
    while waiting:
        number, box = waiting.pop()
        best: tuple[float, Bools] | None = None
        for axis, whole, after, line in dividing_lines(out, number, box, strength, hidden):
            chance = float(expit(line_features(whole, after, line) @ np.array(weights)))
            if chance >= least and (best is None or chance > best[0]):
                best = chance, after if axis else after.T
        if best is None:
            continue
        out[box][best[1]] = following
        waiting += [(piece, _within(box, out[box] == piece)) for piece in (number, following)]
        following += 1
    return out


def dividing_lines(
    regions: Ints, number: int, box: tuple[slice, ...], strength: Strength, hidden: Bools
) -> Iterator[tuple[int, Bools, Bools, Line]]:
    """Yield the axis, the region, the part beyond and the line: upright (1) and level (0, transposed)."""
    mask = regions[box] == number
    for axis, field in ((1, strength.upright), (0, strength.level)):
        ratio, whole, veil = np.minimum(field[box], STRONGEST), mask, hidden[box]
        if axis == 0:
            ratio, whole, veil = ratio.T, whole.T, veil.T
        line = _best_line(ratio, whole, veil)
        if line is not None and line.strength > 0.0:
            after = _beyond(whole.shape, line) & whole
            if min(after.sum(), (whole & ~after).sum()) >= (_CLEAR * WIDTH) ** 2:
                yield axis, whole, after, line


def _best_line(ratio: Field, mask: Bools, hidden: Bools) -> Line | None:
    """Return the strongest line from top to bottom of a region; None where it is too narrow."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    rows, columns = mask.shape
    clear = round(_CLEAR * WIDTH)
    if columns < 2 * clear + 3 or rows < WIDTH:
        return None
    wide = maximum_filter1d(ratio, 3, axis=1)
    # the joints at the sides of a region are no joints within it
    seen = (
        minimum_filter1d(mask.view(np.uint8), 2 * clear + 1, axis=1, mode="constant").view(np.bool_) & ~hidden
    )
    sums = np.zeros((3, rows + 1, columns), dtype=np.float32)
    np.cumsum(np.stack([seen, wide * seen, (wide < GAP) & seen]), axis=1, out=sums[:, 1:])
    best: Line | None = None
    for lean in range(-_LEAN, _LEAN + 1, 2):
        count, total, lack = _along(sums, lean)
        enough = count >= _ACROSS * rows
        mean = np.where(enough, total / np.maximum(count, 1.0), 0.0)
        middle = int(np.argmax(mean))
        if best is None or mean[middle] > best.strength:
            usual = float(np.median(mean[enough])) if mean[middle] > 0.0 else 1.0
            prominence = float(np.log((mean[middle] + 0.02) / (usual + 0.02)))
            gaps = float(lack[middle] / max(count[middle], 1.0))
            best = Line(float(mean[middle]), gaps, prominence, middle, lean)
    return best


def _along(sums: NDArray[np.float32], lean: int) -> NDArray[np.float32]:
    """Return sums (k, w) along lines whose ends lean to either side, of cumulative sums (k, h + 1, w) of columns."""
    shifts = np.round(lean * np.linspace(-1.0, 1.0, sums.shape[1] - 1)).astype(int)
    ends = [0, *(np.flatnonzero(np.diff(shifts)) + 1).tolist(), len(shifts)]
    out = np.zeros((len(sums), sums.shape[2] + 2 * _LEAN), dtype=np.float32)
    for start, stop in pairwise(ends):
        first = _LEAN - int(shifts[start])
        out[:, first : first + sums.shape[2]] += sums[:, stop] - sums[:, start]
    return out[:, _LEAN:-_LEAN]


def _beyond(shape: tuple[int, ...], line: Line) -> Bools:
    """Return which pixels lie to the right of a line."""
    rows, columns = shape
    place = line.middle + np.round(line.lean * np.linspace(-1.0, 1.0, rows)).astype(int)
    return np.arange(columns)[None] > place[:, None]


def line_features(whole: Bools, after: Bools, line: Line) -> Array:
    """Return the features (6,) of a line across a region, whose part to its right is given."""
    before = whole & ~after
    first, second, total = (float(one.sum()) for one in (before, after, whole))
    fill = (first * first / _box_area(before) + second * second / _box_area(after)) / total
    size = np.log(min(np.sqrt(min(first, second)) / WIDTH, 20.0))
    return np.array([1.0, line.strength, line.gaps, line.prominence, total / _box_area(whole) - fill, size])


def _within(box: tuple[slice, ...], mask: Bools) -> tuple[slice, ...]:
    """Return the box of the pixels that are chosen within a box."""
    starts = (int(side.start) for side in box)
    places = ((start, np.flatnonzero(mask.any(axis=1 - axis))) for axis, start in enumerate(starts))
    return tuple(slice(start + int(chosen[0]), start + int(chosen[-1]) + 1) for start, chosen in places)


def _box_area(mask: Bools) -> float:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return float((rows[-1] - rows[0] + 1) * (columns[-1] - columns[0] + 1))
