"""Numba kernel that cuts a graph of bodies and contacts into strips."""

import numpy as np
from numba import njit


@njit(cache=True)
def cut(bodies, moving, parts, along):  # pragma: no cover - compiled
    """Order contacts so that parts of them share no moving body, in body order or their own.

    The bodies are numbered breadth first from one end of each connected assembly (Cuthill & McKee 1969). Their numbers
    are cut into strips of as many contacts each, one for each part. Contacts between strips come last.

    Inputs
    ------
    bodies : (nc, 2) int64
    moving : (nb,) bool
    parts : int64
    along : bool, whether contacts within a part follow the body numbers; otherwise they keep their order

    Outputs
    -------
    order : (nc,) int64, contacts
    start : (parts + 2,) int64, offset of each part in that order, and of the contacts between strips
    rank : (nb,) int64, number of each moving body; -1 of the others
    """
    nc = bodies.shape[0]
    rank = _breadth_first(bodies, moving)
    # contacts by the larger rank of their bodies
    later, first = np.empty(nc, dtype=np.int64), np.zeros(rank.shape[0] + 1, dtype=np.int64)
    for c in range(nc):
        later[c] = max(rank[bodies[c, 0]], rank[bodies[c, 1]], 0)
        first[later[c] + 1] += 1
    first = np.cumsum(first)
    # part k holds the bodies whose contacts begin in its share of all contacts
    part = np.minimum(first * parts // max(nc, 1), parts - 1)
    follow, put = np.arange(nc), first.copy()
    start = np.zeros(parts + 2, dtype=np.int64)
    own = np.empty(nc, dtype=np.int64)
    for c in range(nc):
        if along:
            follow[put[later[c]]] = c
            put[later[c]] += 1
        a, b = rank[bodies[c, 0]], rank[bodies[c, 1]]
        own[c] = part[later[c]] if a < 0 or b < 0 or part[a] == part[b] else parts
        start[own[c] + 1] += 1
    start = np.cumsum(start)
    order, put = np.empty(nc, dtype=np.int64), start.copy()
    for c in follow:
        order[put[own[c]]] = c
        put[own[c]] += 1
    return order, start, rank


@njit(cache=True)
def _breadth_first(bodies, moving):
    """Number the moving bodies (nb,) breadth first from one end of each connected assembly; -1 for the others."""
    nb = moving.shape[0]
    begin = np.zeros(nb + 1, dtype=np.int64)
    for i, j in bodies:
        if moving[i] and moving[j]:
            begin[i + 1] += 1
            begin[j + 1] += 1
    begin = np.cumsum(begin)
    neighbour, put = np.empty(begin[nb], dtype=np.int64), begin.copy()
    for i, j in bodies:
        if moving[i] and moving[j]:
            neighbour[put[i]], neighbour[put[j]] = j, i
            put[i] += 1
            put[j] += 1
    rank, seen, queue = np.full(nb, -1), np.zeros(nb, dtype=np.int64), np.empty(nb, dtype=np.int64)
    done = 0
    for body in range(nb):
        if not moving[body] or seen[body] > 0:
            continue
        # the last body that a search reaches is peripheral; the second search begins there
        source = body
        for search in range(1, 3):
            queue[done], head, tail = source, done, done + 1
            seen[source] = search
            while head < tail:
                source = queue[head]
                head += 1
                for other in neighbour[begin[source] : begin[source + 1]]:
                    if seen[other] < search:
                        seen[other] = search
                        queue[tail] = other
                        tail += 1
        for n in range(done, tail):
            rank[queue[n]] = n
        done = tail
    return rank
