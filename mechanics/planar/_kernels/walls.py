"""Contacts between disks and walls."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Ints
from mechanics.planar._kernels.disks import FACE, longer
from mechanics.planar._kernels.grid import cells_along

_BEND = 1e-9  # sine of the angle from which two walls form a bend


class EndNeighbours(NamedTuple):
    """Walls that pass through the ends of others.

    Attributes
    ----------
    start : (2 nw + 1,) int64, the neighbours of end e of wall w are start[2 w + e]:start[2 w + e + 1]
    wall : (n,) int64
    place : (n,) float64, parameter of the end on the neighbour, 0 and 1 at its own ends [-]
    """

    start: Ints
    wall: Ints
    place: Array


@njit(cache=True)
def _foot(x, y, ends):
    """Return the parameter, within 0 to 1, of the point of a wall that is nearest to (x, y)."""
    dx, dy = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1]
    s = ((x - ends[0, 0]) * dx + (y - ends[0, 1]) * dy) / (dx * dx + dy * dy)
    return min(max(s, 0.0), 1.0)


@njit(cache=True)
def end_neighbours(ends):  # pragma: no cover - compiled
    """Find the walls that pass through the ends of others, given `ends` (nw, 2, 2) float64 [m]."""
    nw = ends.shape[0]
    length = np.empty(nw)
    for w in range(nw):
        length[w] = np.hypot(ends[w, 1, 0] - ends[w, 0, 0], ends[w, 1, 1] - ends[w, 0, 1])
    start = np.zeros(2 * nw + 1, dtype=np.int64)
    wall, place = np.empty((16, 1), dtype=np.int64), np.empty((16, 1))
    n = 0
    for w in range(nw):
        for e in range(2):
            x, y = ends[w, e, 0], ends[w, e, 1]
            for k in range(nw):
                if k == w:
                    continue
                s = _foot(x, y, ends[k])
                fx = ends[k, 0, 0] + s * (ends[k, 1, 0] - ends[k, 0, 0])
                fy = ends[k, 0, 1] + s * (ends[k, 1, 1] - ends[k, 0, 1])
                slack = 1e-9 * min(length[w], length[k])
                if np.hypot(fx - x, fy - y) > slack:
                    continue
                if n == wall.shape[0]:
                    wall, place = longer(wall), longer(place)
                near = slack / length[k]
                wall[n, 0], place[n, 0] = k, 0.0 if s <= near else 1.0 if s >= 1.0 - near else s
                n += 1
            start[2 * w + e + 1] = n
    return EndNeighbours(start, wall[:n, 0].copy(), place[:n, 0].copy())


@njit(cache=True)
def _touch_wall(x, y, w, ends, neighbours, overshoot):
    """Return feature, n and distance of the point (x, y) from a wall; feature -1 where other walls have the contact.

    Past an end of the wall: where another wall goes on from there and is met on its face, this wall steps back, so that
    the end cannot catch what rolls along the two; but if this wall rises from the other like a valley's far side, its
    line is met before its end, and is watched a little ahead (`overshoot`). Of walls that are all met at the one end,
    the first has it.
    """
    start, wall, place = neighbours
    ax, ay, bx, by = ends[w, 0, 0], ends[w, 0, 1], ends[w, 1, 0], ends[w, 1, 1]
    dx, dy = bx - ax, by - ay
    length = np.hypot(dx, dy)
    ux, uy = dx / length, dy / length
    along, across = (x - ax) * ux + (y - ay) * uy, (y - ay) * ux - (x - ax) * uy
    if 0.0 < along < length:
        side = 1.0 if across >= 0.0 else -1.0
        return FACE, -side * uy, side * ux, abs(across)
    e = 0 if along <= 0.0 else 1
    vx, vy = ends[w, e, 0], ends[w, e, 1]
    # away from the end along this wall
    ox, oy = (ux, uy) if e == 0 else (-ux, -uy)
    past = -along if e == 0 else along - length
    taken, valley, first = False, True, True
    side = 0.0
    for q in range(start[2 * w + e], start[2 * w + e + 1]):
        k = wall[q]
        s = _foot(x, y, ends[k])
        if s == place[q]:
            first = first and w < k
            continue
        taken = True
        kx, ky = ends[k, 1, 0] - ends[k, 0, 0], ends[k, 1, 1] - ends[k, 0, 1]
        turn = 1.0 if s > place[q] else -1.0
        kx, ky = turn * kx, turn * ky
        rise = kx * oy - ky * ox
        mine = kx * (y - vy) - ky * (x - vx)
        bend = abs(rise) > _BEND * np.hypot(kx, ky)
        if not (bend and rise * mine > 0.0):
            valley = False
        else:
            # of this wall's two sides, the one on which the other wall lies
            side = -1.0 if rise > 0.0 else 1.0
    if not taken:
        if not first:
            return -1, 0.0, 0.0, 0.0
        distance = np.hypot(x - vx, y - vy)
        if distance == 0.0:
            return e + 1, -ox, -oy, 0.0
        return e + 1, (x - vx) / distance, (y - vy) / distance, distance
    if not valley or past > overshoot:
        return -1, 0.0, 0.0, 0.0
    nx, ny = -side * oy, side * ox
    distance = nx * (x - vx) + ny * (y - vy)
    return (FACE, nx, ny, distance) if distance > 0.0 else (-1, 0.0, 0.0, 0.0)


@njit(cache=True)
def find_walls(disks, watch, grid, ends, pace, neighbours):  # pragma: no cover - compiled
    """Find the contacts of disks with walls; wall w is body nd + w.

    Inputs
    ------
    disks, watch, grid : as of `find_disks`
    ends : (nw, 2, 2) float64 [m]
    pace : (nw,) float64, largest speed of each wall [m/s]
    neighbours : EndNeighbours

    Outputs
    -------
    names, values : as of `find_disks`
    """
    centre, radius, velocity, fixed, ahead, _, asked = disks
    alert, reach, step = watch
    width, level = grid.width, grid.level
    nd, nw = centre.shape[0], ends.shape[0]
    members = np.zeros(width.shape[0] + 1, dtype=np.int64)
    for i in range(nd):
        members[level[i] + 1] += 1
    for k in range(width.shape[0]):
        members[k + 1] += members[k]
    of_level, filled = np.empty(nd, dtype=np.int64), members[:-1].copy()
    for i in range(nd):
        of_level[filled[level[i]]] = i
        filled[level[i]] += 1
    names, values = np.empty((64, 3), dtype=np.int64), np.empty((64, 3))
    near = np.empty(max(nd, 1), dtype=np.int64)
    n = 0
    for w in range(nw):
        for k in range(width.shape[0]):
            far = 0.5 * width[k] + step * pace[w]
            found = cells_along(ends[w], far, k, grid, near)
            if found < 0:
                # the wall passes more cells than there are disks
                found = members[k + 1] - members[k]
                near[:found] = of_level[members[k] : members[k + 1]]
            for q in range(found):
                i = near[q]
                if fixed[i] or not asked[i]:
                    continue
                x, y = centre[i, 0], centre[i, 1]
                closing = step * (np.hypot(velocity[i, 0], velocity[i, 1]) + pace[w])
                margin = alert * radius[i] + reach + closing + ahead[i]
                feature, nx, ny, distance = _touch_wall(x, y, w, ends, neighbours, margin)
                if feature < 0 or distance - radius[i] > margin:
                    continue
                if n == names.shape[0]:
                    names, values = longer(names), longer(values)
                names[n, 0], names[n, 1], names[n, 2] = i, nd + w, feature
                values[n, 0], values[n, 1], values[n, 2] = nx, ny, distance - radius[i]
                n += 1
    return names[:n], values[:n]
