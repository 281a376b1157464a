"""Numba kernel that floods a picture from seeds."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def flood(levels, highest, regions):
    """Grow numbered regions over a picture, the lowest pixels first and of equal ones the oldest (Meyer 1991).

    Inputs: levels (h, w) int16, 0 to `highest`, or negative where no region goes, as on the outermost pixels; regions
    (h, w) int32, 0 beyond the seeds. Output: regions.
    """
    width = levels.shape[1]
    level_of, region_of = levels.ravel(), regions.ravel()
    following = np.full(len(level_of), -1, dtype=np.int32)  # pixel after each in the queue of its level
    first, last = np.full(highest + 1, -1, dtype=np.int32), np.full(highest + 1, -1, dtype=np.int32)
    for pixel in range(len(level_of)):
        if region_of[pixel] > 0 and level_of[pixel] >= 0:
            _append(first, last, following, level_of[pixel], pixel)
    level = 0
    while level <= highest:
        pixel = first[level]
        if pixel < 0:
            level += 1
            continue
        first[level] = following[pixel]
        for step in (-width, -1, 1, width):
            beside = pixel + step
            if region_of[beside] == 0 and level_of[beside] >= 0:
                region_of[beside] = region_of[pixel]
                _append(first, last, following, level_of[beside], beside)
                level = min(level, level_of[beside])


@njit(cache=True, nogil=True)
def _append(first, last, following, level, pixel):
    """Put a pixel at the end of the queue of a level."""
    if first[level] < 0:
        first[level] = pixel
    else:
        following[last[level]] = pixel
    last[level] = pixel
