"""Numba kernels of contacts between disks, and of the order of contacts."""

import numpy as np
from numba import njit

from mechanics.planar._kernels.grid import bucket

__all__ = ["FACE", "find_disks", "longer", "sort_contacts"]

# feature 0 of a contact: on the face of both bodies; 1 and 2 are the ends of a wall
FACE = 0


@njit(cache=True)
def longer(rows):  # pragma: no cover - compiled
    """Room for twice as many rows."""
    more = np.empty((2 * rows.shape[0], rows.shape[1]), dtype=rows.dtype)
    more[: rows.shape[0]] = rows
    return more


@njit(cache=True)
def find_disks(
    centre, radius, velocity, fixed, alert, reach, step, ahead, extent, grid
):  # pragma: no cover - compiled
    """Contacts between disks: bodies and feature (n, 3), n and gap (n, 3).

    A pair is watched if its gap is at most alert × smaller radius + reach + what it can close in a step at its present
    relative velocity, + `ahead` (nd,) of both. The normal points from the second disk to the first, which has the
    smaller index.
    """
    origin, width, low, count, base, buckets, start, order, level, cell = grid
    names, values = np.empty((64, 3), dtype=np.int64), np.empty((64, 3))
    n = 0
    for i in range(centre.shape[0]):
        for k in range(level[i], width.shape[0]):
            if k == level[i]:
                mine_x, mine_y = cell[i, 0], cell[i, 1]
            else:
                mine_x = np.int64(np.floor((centre[i, 0] - origin[0]) / width[k]))
                mine_y = np.int64(np.floor((centre[i, 1] - origin[1]) / width[k]))
            for spot in range(9):
                x, y = mine_x + spot % 3 - 1, mine_y + spot // 3 - 1
                b = bucket(x, y, k, low, count, base, buckets)
                if b < 0:
                    continue
                for e in range(start[b], start[b + 1]):
                    j = order[e]
                    if (k == level[i] and j <= i) or (fixed[i] and fixed[j]):
                        continue
                    if cell[j, 0] != x or cell[j, 1] != y:
                        continue
                    dx, dy = centre[i, 0] - centre[j, 0], centre[i, 1] - centre[j, 1]
                    square, far = dx * dx + dy * dy, extent[i] + extent[j]
                    if square > far * far:
                        continue
                    distance = np.sqrt(square)
                    gap = distance - (radius[i] + radius[j])
                    pace = np.hypot(velocity[i, 0] - velocity[j, 0], velocity[i, 1] - velocity[j, 1])
                    if gap > alert * min(radius[i], radius[j]) + reach + step * pace + ahead[i] + ahead[j]:
                        continue
                    if n == names.shape[0]:
                        names, values = longer(names), longer(values)
                    sign = 1.0 if i < j else -1.0
                    names[n, 0], names[n, 1], names[n, 2] = min(i, j), max(i, j), FACE
                    # two disks with one centre must be parted in some direction
                    values[n, 0] = sign * dx / distance if distance > 0.0 else 0.0
                    values[n, 1] = sign * dy / distance if distance > 0.0 else 1.0
                    values[n, 2] = gap
                    n += 1
    return names[:n], values[:n]


@njit(cache=True)
def sort_contacts(names, values, bodies):  # pragma: no cover - compiled
    """Contacts by first body, second body and feature."""
    n = names.shape[0]
    start = np.zeros(bodies + 1, dtype=np.int64)
    for c in range(n):
        start[names[c, 0] + 1] += 1
    for b in range(bodies):
        start[b + 1] += start[b]
    place, filled = np.empty(n, dtype=np.int64), start[:-1].copy()
    for c in range(n):
        place[filled[names[c, 0]]] = c
        filled[names[c, 0]] += 1
    rank = np.empty(n, dtype=np.int64)
    for c in range(n):
        rank[c] = 3 * names[c, 1] + names[c, 2]
    for b in range(bodies):
        if start[b + 1] - start[b] > 32:
            part = place[start[b] : start[b + 1]]
            part[:] = part[np.argsort(rank[part])]
            continue
        for p in range(start[b] + 1, start[b + 1]):
            c, q = place[p], p
            while q > start[b] and rank[place[q - 1]] > rank[c]:
                place[q] = place[q - 1]
                q -= 1
            place[q] = c
    return names[place], values[place]
