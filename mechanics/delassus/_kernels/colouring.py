"""Numba kernel of the colouring of contacts."""

import numpy as np
from numba import njit

__all__ = ["first_fit"]

_FULL = np.uint64(0xFFFFFFFFFFFFFFFF)
_ONE = np.uint64(1)


@njit(cache=True)
def first_fit(bodies, moving):  # pragma: no cover - compiled
    """Give each contact, in order, the smallest colour that no earlier contact of its moving bodies has.

    The colours a body has used are bits of its own row of words. A contact never needs a colour beyond the number
    of the other contacts of its two bodies, which bounds the rows; the first word of a row with a bit left is
    remembered, so that a body with very many contacts costs no more for each of them.

    Inputs
    ------
    bodies : (nc, 2) int64
    moving : (nb,) bool

    Outputs
    -------
    (nc,) int64
    """
    nc, nb = bodies.shape[0], moving.shape[0]
    degree = np.zeros(nb, dtype=np.int64)
    for c in range(nc):
        for s in range(2):
            degree[bodies[c, s]] += moving[bodies[c, s]]
    reach = np.zeros(nb, dtype=np.int64)
    for c in range(nc):
        both = degree[bodies[c, 0]] + degree[bodies[c, 1]]
        for s in range(2):
            b = bodies[c, s]
            if moving[b] and both > reach[b]:
                reach[b] = both
    ptr = np.zeros(nb + 1, dtype=np.int64)
    for b in range(nb):
        ptr[b + 1] = ptr[b] + (reach[b] + 63) // 64
    used = np.zeros(ptr[nb], dtype=np.uint64)
    begin = np.zeros(nb, dtype=np.int64)
    colour = np.zeros(nc, dtype=np.int64)
    for c in range(nc):
        a, b = bodies[c, 0], bodies[c, 1]
        word = max(begin[a] if moving[a] else 0, begin[b] if moving[b] else 0)
        taken = _FULL
        while True:
            taken = used[ptr[a] + word] if moving[a] else np.uint64(0)
            if moving[b]:
                taken |= used[ptr[b] + word]
            if taken != _FULL:
                break
            word += 1
        bit = 0
        while (taken >> np.uint64(bit)) & _ONE:
            bit += 1
        colour[c] = 64 * word + bit
        for s in range(2):
            d = bodies[c, s]
            if moving[d]:
                used[ptr[d] + word] |= _ONE << np.uint64(bit)
                while ptr[d] + begin[d] < ptr[d + 1] - 1 and used[ptr[d] + begin[d]] == _FULL:
                    begin[d] += 1
    return colour
