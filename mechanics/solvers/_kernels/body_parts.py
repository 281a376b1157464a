"""Numba kernels of parts of the bodies that no factor couples: subtrees of the elimination tree.

What bodies of a part contribute to those between the parts adds up in copies of these, one for each part, and the
copies are summed in order. So parts may be taken at once, in whatever order, with the same bits.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# numbers of the factors that lie between the parts, over all of them, at most [-]
_BETWEEN = 0.1
# parts, at most
_MOST = 16


class Parts(NamedTuple):
    """Parts of the factors, and what lies between them.

    Attributes
    ----------
    panel, body : (k, 2) int64, first panel and body of each part, and the ones after its last
    rest : int64, panels between the parts, in order
    shared : (ns,) int64, their bodies, in order
    row : int64, of each row of a panel the place where what the panel contributes to it adds up: its body, or, of a
        body between the parts, its copy nm + (part) ns + (number among the shared)
    """

    panel: NDArray[np.int64]
    body: NDArray[np.int64]
    rest: NDArray[np.int64]
    shared: NDArray[np.int64]
    row: NDArray[np.int64]


@njit(cache=True)
def _subtrees(panels):
    """Return the parent of each panel, the first panel of its subtree, and the numbers in it, in postorder."""
    body, first, row, start = panels.body, panels.first, panels.row, panels.start
    number = body.shape[0] - 1
    owner = np.empty(body[number], dtype=np.int64)
    parent = np.full(number, -1, dtype=np.int64)
    low, size = np.arange(number), np.empty(number, dtype=np.int64)
    for s in range(number):
        owner[body[s] : body[s + 1]] = s
        size[s] = start[s + 1] - start[s]
    for s in range(number):
        width = body[s + 1] - body[s]
        if first[s + 1] - first[s] > width:
            parent[s] = owner[row[first[s] + width]]
    for s in range(number):
        up = parent[s]
        if up >= 0:
            low[up] = min(low[up], low[s])
            size[up] += size[s]
    return parent, low, size


@njit(cache=True)
def parts_of(panels, several):  # pragma: no cover - compiled
    """Return parts of about the same size; they depend on the pattern alone, never on the number of threads.

    Inputs
    ------
    panels : Panels, in postorder
    several : bool; one part that holds everything, otherwise

    Outputs
    -------
    Parts
    """
    number, bodies = panels.body.shape[0] - 1, panels.body[-1]
    if not several:
        none = np.empty(0, dtype=np.int64)
        return Parts(np.array([[0, number]]), np.array([[0, bodies]]), none, none, panels.row)
    parent, low, size = _subtrees(panels)
    # roots of the parts: the largest is divided, as long as its own panel may lie between parts
    root = np.zeros(number, dtype=np.bool_)
    between = np.zeros(number, dtype=np.bool_)
    count = 0
    for s in range(number):
        root[s] = parent[s] < 0
        count += root[s]
    left = int(_BETWEEN * panels.start[-1])
    while True:
        largest = -1
        for s in range(number):
            if root[s] and low[s] < s and (largest < 0 or size[s] > size[largest]):
                largest = s
        if largest < 0:
            break
        children = 0
        for s in range(low[largest], largest):
            children += parent[s] == largest
        left -= panels.start[largest + 1] - panels.start[largest]
        if left < 0 or count - 1 + children > _MOST:
            break
        root[largest], between[largest] = False, True
        count += children - 1
        for s in range(low[largest], largest):
            if parent[s] == largest:
                root[s] = True
    panel, body = np.empty((count, 2), dtype=np.int64), np.empty((count, 2), dtype=np.int64)
    part = 0
    for s in range(number):
        if root[s]:
            panel[part, 0], panel[part, 1] = low[s], s + 1
            body[part, 0], body[part, 1] = panels.body[low[s]], panels.body[s + 1]
            part += 1
    rest = np.flatnonzero(between)
    rank, shared, n = np.full(bodies, -1, dtype=np.int64), np.empty(bodies, dtype=np.int64), 0
    for s in rest:
        for k in range(panels.body[s], panels.body[s + 1]):
            rank[k], shared[n] = n, k
            n += 1
    place = panels.row.copy()
    for part in range(count):
        for at in range(panels.first[panel[part, 0]], panels.first[panel[part, 1]]):
            if rank[place[at]] >= 0:
                place[at] = bodies + part * n + rank[place[at]]
    return Parts(panel, body, rest, shared[:n].copy(), place)
