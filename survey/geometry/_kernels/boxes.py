"""Numba kernels of overlapping boxes in a tree of boxes.

The tree is complete and binary over boxes in Morton order: node 1 is the root, the children of k are 2k and
2k + 1, and the leaves begin at `size`, a power of two; empty leaves have boxes that overlap nothing.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def morton_codes(centres, low, scale):
    """Interleave 21 bits of each coordinate, so that nearby boxes have similar codes.

    Inputs
    ------
    centres : (n, 3) float64 [m]
    low, scale : (3,) float64, origin [m] and cells per metre [1/m]

    Outputs
    -------
    codes : (n,) uint64; returned
    """
    out = np.empty(centres.shape[0], np.uint64)
    for i in range(centres.shape[0]):
        code = np.uint64(0)
        for k in range(3):
            cell = np.uint64(min(max((centres[i, k] - low[k]) * scale[k], 0.0), 2097151.0))
            for bit in range(21):
                code |= ((cell >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + k)
        out[i] = code
    return out


@njit(cache=True)
def _apart(one, other):
    """Return whether two boxes (6,), lower corner first, are disjoint."""
    for k in range(3):  # noqa: SIM110  (numba has no any())
        if one[k] > other[3 + k] or other[k] > one[3 + k]:
            return True
    return False


@njit(cache=True)
def _near(leaf, tree, size, order, wanted, found, stop):
    """Write pairs of the leaf with later leaves, at least one of them wanted, to `found` from row `stop`."""
    box = tree[size + leaf]
    mine = order[leaf]
    stack = np.empty(64, np.int64)
    stack[0], top = 1, 1
    while top:
        top -= 1
        node = stack[top]
        if _apart(box, tree[node]):
            continue
        if node >= size:
            other = order[node - size]
            if node - size > leaf and (wanted[mine] or wanted[other]):
                if stop < found.shape[0]:
                    found[stop, 0], found[stop, 1] = min(mine, other), max(mine, other)
                stop += 1
            continue
        for child in (2 * node, 2 * node + 1):
            last = child
            while last < size:
                last = 2 * last + 1
            if last - size > leaf:
                stack[top] = child
                top += 1
    return stop


@njit(cache=True)
def count_near(tree, size, order, wanted):
    """Count the pairs of overlapping boxes by the leaf of the first.

    Inputs
    ------
    tree : (2 size, 6) float64, boxes, lower corner first [m]
    size : int, index of the first leaf
    order : (n,) int64, solid of each leaf
    wanted : (n,) bool, solids of which at least one must be in a pair

    Outputs
    -------
    counts : (n,) int64; returned
    """
    nothing = np.empty((0, 2), np.int64)
    counts = np.zeros(order.shape[0], np.int64)
    for leaf in range(order.shape[0]):
        counts[leaf] = _near(leaf, tree, size, order, wanted, nothing, np.int64(0))
    return counts


@njit(cache=True)
def list_near(tree, size, order, wanted, start, stop, found):
    """List the pairs of the leaves `start` to `stop`, smaller index first.

    Inputs
    ------
    tree, size, order, wanted : as for `count_near`
    start, stop : int, range of leaves

    Outputs
    -------
    found : (n, 2) int64, pairs of solids
    """
    row = np.int64(0)  # of no literal type, for each of which numba would compile the callee once more
    for leaf in range(start, stop):
        row = _near(leaf, tree, size, order, wanted, found, row)
