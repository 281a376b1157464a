"""Contacts between disks, and the order of contacts."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Bools
from mechanics.planar._kernels.grid import bucket

# feature 0 of a contact: on the face of both bodies; 1 and 2 are the ends of a wall
FACE = 0


class Disks(NamedTuple):
    """Disks in motion.

    Attributes
    ----------
    centre : (nd, 2) float64 [m]
    radius : (nd,) float64 [m]
    velocity : (nd, 3) float64, vx, vy [m/s] and ω [rad/s]
    fixed : (nd,) bool
    ahead : (nd,) float64, by which the watch of each disk is widened [m]
    extent : (nd,) float64, radius and all that is watched around it [m]
    asked : (nd,) bool, contacts of which one disk at least is asked for are found
    """

    centre: Array
    radius: Array
    velocity: Array
    fixed: Bools
    ahead: Array
    extent: Array
    asked: Bools


class GapWatch(NamedTuple):
    """Gaps that are watched: alert × smaller radius [-], the reach of the laws [m], and what a step [s] can close."""

    alert: float
    reach: float
    step: float


@njit(cache=True)
def longer(rows):  # pragma: no cover - compiled
    """Return a copy with room for twice as many rows."""
    more = np.empty((2 * rows.shape[0], rows.shape[1]), dtype=rows.dtype)
    more[: rows.shape[0]] = rows
    return more


@njit(cache=True)
def find_disks(disks, watch, grid):  # pragma: no cover - compiled
    """Find the contacts between disks.

    A pair is watched if its gap is at most alert × smaller radius + reach + what it can close in a step at its present
    relative velocity, + `ahead` of both. The normal points from the second disk to the first, which has the smaller
    index.

    Inputs
    ------
    disks : Disks
    watch : Watch
    grid : Grid, of the disks and their extents

    Outputs
    -------
    names : (n, 3) int64, bodies and feature
    values : (n, 3) float64, n [-] and gap [m]
    """
    centre, radius, velocity, fixed, ahead, extent, asked = disks
    alert, reach, step = watch
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
            # in its own class the five cells from its own on: the others look at it
            for spot in range(4 if k == level[i] else 0, 9):
                x, y = mine_x + spot % 3 - 1, mine_y + spot // 3 - 1
                b = bucket(x, y, k, low, count, base, buckets)
                if b < 0:
                    continue
                for e in range(start[b], start[b + 1]):
                    j = order[e]
                    if (k == level[i] and spot == 4 and j <= i) or (fixed[i] and fixed[j]):
                        continue
                    if cell[j, 0] != x or cell[j, 1] != y or not (asked[i] or asked[j]):
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
                    # two disks with one centre are separated along y
                    values[n, 0] = sign * dx / distance if distance > 0.0 else 0.0
                    values[n, 1] = sign * dy / distance if distance > 0.0 else 1.0
                    values[n, 2] = gap
                    n += 1
    return names[:n], values[:n]


@njit(cache=True)
def sort_contacts(names, values, bodies):  # pragma: no cover - compiled
    """Sort contacts by first body, second body and feature.

    Inputs
    ------
    names : (n, 3) int64, bodies and feature
    values : (n, 3) float64
    bodies : int64, number of disks

    Outputs
    -------
    names, values : in order
    """
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
