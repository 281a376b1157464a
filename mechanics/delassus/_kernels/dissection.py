"""Numba kernel of nested dissection by planes that sweep along the axes (George 1973)."""

import numpy as np
from numba import njit

# smallest share of the bodies on either side of a cut: where a wall narrows, an uneven cut is better
_SIDE = 0.2


@njit(cache=True)
def _separators(along, start, near, part, place, low, high):
    """Write the size of the separator between the first r bodies of a part and its others, for each r.

    Either those among the first that touch one of the others, or those among the others that touch one of the first.
    """
    m, name = along.shape[0], part[along[0]]
    low[: m + 1] = 0
    high[: m + 1] = 0
    for k in range(m):
        place[along[k]] = k
    for k in range(m):
        least = most = k
        for p in range(start[along[k]], start[along[k] + 1]):
            if part[near[p]] == name:
                least, most = min(least, place[near[p]]), max(most, place[near[p]])
        # in the first set for k < r <= most, in the other for least < r <= k
        low[k + 1] += 1
        low[most + 1] -= 1
        high[least + 1] += 1
        high[k + 1] -= 1
    for r in range(1, m + 1):
        low[r] += low[r - 1]
        high[r] += high[r - 1]


@njit(cache=True)
def _best(low, high, m):
    """Return the cost of the best cut of m bodies, its place, and whether its separator lies in the first set.

    The cost is the size of the separator over the root of the size of the smaller side.
    """
    cost, cut, first = np.inf, 0, True
    margin = max(1, int(_SIDE * m))
    for r in range(margin, m - margin + 1):
        for lower in (True, False):
            between = low[r] if lower else high[r]
            side = min(r - between, m - r) if lower else min(r, m - r - between)
            if side > 0 and (1 + between) < cost * np.sqrt(side):
                cost, cut, first = (1 + between) / np.sqrt(side), r, lower
    return cost, cut, first


@njit(cache=True)
def _sides(own, cut, first, start, near, part, place, side):
    """Write the side of each body of a part (0 or 1; 2: separator); return the number of each."""
    name, count = part[own[0]], np.zeros(3, np.int64)
    for k in range(own.shape[0]):
        place[own[k]] = k
    for k in range(own.shape[0]):
        b = own[k]
        side[b] = 0 if k < cut else 1
        if (k < cut) == first:
            for p in range(start[b], start[b + 1]):
                if part[near[p]] == name and (place[near[p]] < cut) != first:
                    side[b] = 2
        count[side[b]] += 1
    return count


@njit(cache=True)
def dissect(start, near, along, leaf):  # pragma: no cover - compiled
    """Return the rank (n,) of each body: one side of a cut, the other, then the separator; recursively in each side.

    Inputs
    ------
    start : (n + 1,) int64, where the neighbours of each body begin
    near : int64, neighbours
    along : (d, n) int64, bodies sorted along each axis, overwritten
    leaf : int64, bodies of a part that is not divided further
    """
    axes, n = along.shape
    rank, part, side, place = (
        np.empty(n, np.int64),
        np.zeros(n, np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
    )
    low, high, spare = np.empty(n + 2, np.int64), np.empty(n + 2, np.int64), np.empty(n, np.int64)
    waiting, parts = [(0, n)], 1
    while len(waiting) > 0:
        begin, end = waiting.pop()
        cost, axis, cut, first = np.inf, 0, 0, True
        if end - begin > leaf:
            for a in range(axes):
                _separators(along[a, begin:end], start, near, part, place, low, high)
                found = _best(low, high, end - begin)
                if found[0] < cost:
                    (cost, cut, first), axis = found, a
        if cut == 0:
            for k in range(begin, end):
                rank[along[0, k]] = k
            continue
        count = _sides(along[axis, begin:end], cut, first, start, near, part, place, side)
        middle, last = begin + count[0], begin + count[0] + count[1]
        for a in range(axes):
            at = np.array([begin, middle, last])
            for k in range(begin, end):
                b = along[a, k]
                spare[at[side[b]]] = b
                at[side[b]] += 1
            along[a, begin:end] = spare[begin:end]
        for k in range(begin, last):
            part[along[0, k]] = parts + side[along[0, k]]
        for k in range(last, end):
            part[along[0, k]], rank[along[0, k]] = -1, k
        parts += 2
        waiting.append((begin, middle))
        waiting.append((middle, last))
    return rank
