"""Closed regions between joints, and the borders that they share."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Bools, Ints
from survey.clouds._kernels.flooding import flood
from survey.clouds.pictures.joints import STRONGEST, WIDTH, Field, Strength
from survey.conventions import NEGLIGIBLE

_WEAK = 0.3  # strength over that of a joint below which there is stone
_APART = 2.0 * WIDTH  # distance between the middles of two regions [px]
_TOWARDS = NEGLIGIBLE  # by which the place farthest from all joints is lower, over the strength of a joint
_REACH = round(WIDTH)  # distance from the middle of a joint at which the colour is that of the stone [px]


@dataclass(frozen=True)
class Borders:
    """Borders between regions.

    Attributes
    ----------
    pairs : (n, 2) numbers of the regions, the smaller first
    lengths : (n,) pixels along each
    sums : (n, k + 3) sums of what is measured along each, of rows and columns, and the number of its pixels that part
        columns
    steps : (n, 1 + c) number of its pixels beyond which both regions go on, and the sums of the steps of the colours
        there, from the first to the second
    """

    pairs: Ints
    lengths: Array
    sums: Array
    steps: Array


def over_texture(strength: Strength) -> Strength:
    """Return the strength of joints so that it is 1 at a usual joint; evidence is 0 at the texture of a stone.

    Crests are pixels that no neighbour across exceeds; grain has many weak ones, joints few strong ones. The
    two classes are parted where the variance between them is largest (Otsu 1979). Their medians are the texture
    of a stone and a usual joint. So what is left of texture does not depend on how faint the joints of a picture are.
    """
    evidence = strength.evidence
    inner = evidence[1:-1, 1:-1]
    across = (inner >= evidence[1:-1, :-2]) & (inner > evidence[1:-1, 2:])
    down = (inner >= evidence[:-2, 1:-1]) & (inner > evidence[2:, 1:-1])
    crest = inner[(across | down) & (inner > 0.0)]
    if len(crest) < 10:
        return strength
    values = np.sort(np.sqrt(crest[:: max(1, len(crest) // 200_000)]).astype(np.float64))
    sums, count = np.cumsum(values), np.arange(1, len(values) + 1)
    low, high = sums / count, (sums[-1] - sums) / np.maximum(len(values) - count, 1)
    between = count * (len(values) - count) * (low - high) ** 2
    parted = int(np.argmax(between))
    texture, joint = (
        np.float32(np.median(crests) ** 2) for crests in (values[: parted + 1], values[parted:])
    )
    return Strength(
        np.maximum(evidence - texture, 0.0) / max(joint - texture, np.float32(1e-9)),
        strength.upright / joint,
        strength.level / joint,
        strength.angle,
    )


def closed_regions(evidence: Field, void: Bools) -> Ints:
    """Part a picture into regions along the crests of its joints.

    Regions grow from the places farthest from all joints, so that gaps of joints narrower than the stone are
    closed. They are too many: what no joint parts is joined later.

    Parameters
    ----------
    evidence : (h, w) of joints, over that of a usual one
    void : (h, w) where there is no wall

    Returns
    -------
    (h, w) numbers of the regions from 1; 0 where there is no wall
    """
    from scipy.ndimage import distance_transform_edt, gaussian_filter, label, maximum_filter

    free = (evidence < _WEAK) & ~void
    far = gaussian_filter(distance_transform_edt(free).astype(np.float32), 0.5 * WIDTH)
    peaks = (far == maximum_filter(far, size=2 * round(_APART) + 1)) & (far > 1.0) & ~void
    seeds, _ = label(peaks, structure=np.ones((3, 3)))
    height = np.minimum(evidence, STRONGEST) - _TOWARDS * far / max(float(far.max()), 1.0)
    finest = np.iinfo(np.int16).max / (STRONGEST + _TOWARDS)
    levels = np.round((height + _TOWARDS) * finest).astype(np.int16)
    levels[void] = -1
    levels, flooded = np.pad(levels, 1, constant_values=-1), np.pad(seeds.astype(np.int32), 1)
    flood(levels, int(levels.max()), flooded)
    return flooded[1:-1, 1:-1].astype(np.int64)


def borders_of(
    regions: Ints, measures: NDArray[np.float32], sides: NDArray[np.float32], hidden: Bools
) -> Borders:
    """Measure the borders between regions.

    Parameters
    ----------
    regions : (h, w) numbers; 0 is no region
    measures : (k, h, w) what is summed along borders; of two pixels on both sides the larger counts
    sides : (c, h, w) colours, of which the steps across borders are summed
    hidden : (h, w) where colours are not seen
    """
    seen = np.where(hidden, 0, regions)
    pairs, values, colours = [], [], []
    for axis in (1, 0):
        a, b = (regions[:, :-1], regions[:, 1:]) if axis else (regions[:-1], regions[1:])
        at = np.nonzero((a != b) & (a > 0) & (b > 0))
        first, second = a[at], b[at]
        pairs.append(np.sort(np.column_stack([first, second]), axis=1))
        larger = np.maximum(_at(measures, at, axis, 0), _at(measures, at, axis, 1)).T
        rows, columns = at[0] + (1 - axis), at[1] + axis
        values.append(np.column_stack([larger, rows, columns, np.full(len(first), float(axis))]))
        before, behind = -_REACH, 1 + _REACH
        inside = (_at(seen, at, axis, before) == first) & (_at(seen, at, axis, behind) == second)
        turned = np.where(first < second, inside, -1.0 * inside)
        steps = (_at(sides, at, axis, behind) - _at(sides, at, axis, before)) * turned
        colours.append(np.column_stack([inside, steps.T]))
    every = np.concatenate(pairs)
    base = int(regions.max()) + 1
    keys, where = np.unique(every[:, 0] * base + every[:, 1], return_inverse=True)
    lengths = np.bincount(where, minlength=len(keys)).astype(np.float64)
    sums, steps = (
        np.column_stack(
            [np.bincount(where, column, len(keys)).astype(np.float64) for column in np.concatenate(parts).T]
        )
        for parts in (values, colours)
    )
    return Borders(np.column_stack([keys // base, keys % base]), lengths, sums, steps)


def _at(image: NDArray[Any], places: tuple[NDArray[np.intp], ...], axis: int, shift: int) -> NDArray[Any]:
    """Return the values (…, n) of an image (…, h, w) at places, moved along an axis within it."""
    rows, columns = places
    if axis == 0:
        return image[..., np.clip(rows + shift, 0, image.shape[-2] - 1), columns]
    return image[..., rows, np.clip(columns + shift, 0, image.shape[-1] - 1)]
