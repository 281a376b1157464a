"""Which solids are near each other, by their boxes."""

from collections.abc import Iterator

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.geometry._kernels.boxes import count_near, list_near, morton_codes

__all__ = ["boxes_of", "near_pairs"]


_PAIRS = 1 << 15  # neighbours that are looked at in one go, so that memory does not grow with the crowd


def boxes_of(faces: Array, starts: Ints, width: float) -> Array:
    """Boxes (n, 6) of solids from those of their faces, wider by half a joint on all sides."""
    out = np.empty((len(starts) - 1, 6))
    out[:, :3] = np.minimum.reduceat(faces[:, :3], starts[:-1]) - 0.5 * width
    out[:, 3:] = np.maximum.reduceat(faces[:, 3:], starts[:-1]) + 0.5 * width
    return out


def near_pairs(boxes: Array, wanted: Bools) -> Iterator[Ints]:
    """Pairs of overlapping boxes, about `_PAIRS` at a time."""
    centres = boxes[:, :3] + boxes[:, 3:]
    low, extent = centres.min(axis=0), np.ptp(centres, axis=0)
    # one scale for all axes: a flat wall is not stretched into a cube
    scale = np.full(3, (2.0**21 - 1.0) / max(float(extent.max()), 1e-300))
    order = np.argsort(morton_codes(centres, low, scale), kind="stable")
    size = 1 << max(len(boxes) - 1, 0).bit_length()
    tree = np.empty((2 * size, 6))
    tree[:, :3], tree[:, 3:] = np.inf, -np.inf
    tree[size : size + len(boxes)] = boxes[order]
    level = size
    while level > 1:
        level //= 2
        below = tree[2 * level : 4 * level].reshape(level, 2, 6)
        tree[level : 2 * level, :3] = below[:, :, :3].min(axis=1)
        tree[level : 2 * level, 3:] = below[:, :, 3:].max(axis=1)
    counts = count_near(tree, size, order, wanted)
    before = np.concatenate([[0], np.cumsum(counts)])
    start = 0
    while start < len(order):
        stop = int(np.searchsorted(before, before[start] + _PAIRS, side="right")) - 1
        stop = min(max(stop, start + 1), len(order))
        found = np.empty((int(before[stop] - before[start]), 2), np.int64)
        list_near(tree, size, order, wanted, start, stop, found)
        yield found
        start = stop
