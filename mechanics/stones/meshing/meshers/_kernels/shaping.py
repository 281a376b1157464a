"""Numba kernels that move the nodes of tetrahedra to better places."""

from math import sqrt

import numpy as np
from numba import njit

_REACH = 0.4  # first trial step of a node over its shortest edge; each further step over the one before
_STEPS = 4  # trial steps of a node
_FIXED = 1e-12  # largest diagonal entry of the projector of a node that is fixed


@njit(cache=True)
def _six_volumes(nodes, a, b, c, d):
    """Return six times the volume of a tetrahedron, positive if it is not inside out."""
    ux, uy, uz = nodes[b, 0] - nodes[a, 0], nodes[b, 1] - nodes[a, 1], nodes[b, 2] - nodes[a, 2]
    vx, vy, vz = nodes[c, 0] - nodes[a, 0], nodes[c, 1] - nodes[a, 1], nodes[c, 2] - nodes[a, 2]
    wx, wy, wz = nodes[d, 0] - nodes[a, 0], nodes[d, 1] - nodes[a, 1], nodes[d, 2] - nodes[a, 2]
    return ux * (vy * wz - vz * wy) + uy * (vz * wx - vx * wz) + uz * (vx * wy - vy * wx)


@njit(cache=True)
def _square(nodes, a, b):
    """Return the square of the distance between two nodes."""
    return (
        (nodes[a, 0] - nodes[b, 0]) ** 2 + (nodes[a, 1] - nodes[b, 1]) ** 2 + (nodes[a, 2] - nodes[b, 2]) ** 2
    )


@njit(cache=True)
def shape(nodes, a, b, c, d):
    """Return 6 √2 V over the cube of the root mean square edge: 1 for a regular tetrahedron, ≤ 0 for one inside out."""
    squares = (
        _square(nodes, a, b) + _square(nodes, a, c) + _square(nodes, a, d)
        + _square(nodes, b, c) + _square(nodes, b, d) + _square(nodes, c, d)
    ) / 6.0  # fmt: skip
    if squares <= 0.0:
        return 0.0
    return sqrt(2.0) * _six_volumes(nodes, a, b, c, d) / (squares * sqrt(squares))


@njit(cache=True)
def relax(nodes, cells, free, planes, on_plane, weight):
    """Move each node, in place, to the mean of the centres of its tetrahedra, weighted by volume over nodal weight.

    A node keeps at least half of its distance from the planes that it does not lie on.

    Inputs
    ------
    nodes : (n, 3) float64, changed
    cells : (nc, 4) int64
    free : (n, 3, 3) float64 projectors on the faces that a node lies on
    planes : (m, 4) float64 rows (n, d) with n·x ≤ d inside
    on_plane : (n, m) bool
    weight : (n,) float64
    """
    count = len(nodes)
    total = np.zeros(count)
    mean = np.zeros((count, 3))
    for t in range(len(cells)):
        a, b, c, d = cells[t]
        w = abs(_six_volumes(nodes, a, b, c, d)) / (weight[a] + weight[b] + weight[c] + weight[d])
        for k in range(3):
            middle = 0.25 * (nodes[a, k] + nodes[b, k] + nodes[c, k] + nodes[d, k])
            for one in cells[t]:
                mean[one, k] += w * middle
        for one in cells[t]:
            total[one] += w
    for n in range(count):
        if total[n] <= 0.0:
            continue
        move = np.zeros(3)
        for i in range(3):
            for k in range(3):
                move[i] += free[n, i, k] * (mean[n, k] / total[n] - nodes[n, k])
        for p in range(len(planes)):
            if on_plane[n, p]:
                continue
            deep = planes[p, 3]
            nearer = 0.0
            for k in range(3):
                deep -= planes[p, k] * nodes[n, k]
                nearer += planes[p, k] * move[k]
            if nearer > 0.0 and nearer > 0.5 * deep:
                for k in range(3):
                    move[k] *= max(0.0, 0.5 * deep / nearer)
        for k in range(3):
            nodes[n, k] += move[k]


@njit(cache=True)
def _worst(nodes, cells, around, start, n, enough):
    """Return the shape of the worst tetrahedron around a node, or of the first one no better than `enough`."""
    least = 2.0
    for j in range(start[n], start[n + 1]):
        t = around[j]
        least = min(least, shape(nodes, cells[t, 0], cells[t, 1], cells[t, 2], cells[t, 3]))
        if least <= enough:
            break
    return least


@njit(cache=True)
def _mark_bad(nodes, cells, good, marked):
    """Mark the nodes of tetrahedra shaped worse than `good`; return True if there are any."""
    marked[:] = False
    any_bad = False
    for t in range(len(cells)):
        if shape(nodes, cells[t, 0], cells[t, 1], cells[t, 2], cells[t, 3]) < good:
            any_bad = True
            for one in cells[t]:
                marked[one] = True
    return any_bad


@njit(cache=True)
def _shortest(nodes, cells, around, start, n):
    """Return the length of the shortest edge at a node."""
    least = 1e300
    for j in range(start[n], start[n + 1]):
        for one in cells[around[j]]:
            if one != n:
                least = min(least, _square(nodes, n, one))
    return sqrt(least)


@njit(cache=True)
def _improve_node(nodes, cells, free, around, start, tries, n, least):
    """Move one node so that the worst tetrahedron around it, of shape `least`, gets better; return True if it moved."""
    reach = _REACH * _shortest(nodes, cells, around, start, n)
    place = np.zeros(3)
    moved = False
    for _ in range(_STEPS):
        best_x, best_y, best_z = nodes[n]
        found = False
        for i in range(3):
            place[i] = nodes[n, i]
        for k in range(len(tries)):
            for i in range(3):
                along = 0.0
                for m in range(3):
                    along += free[n, i, m] * tries[k, m]
                nodes[n, i] = place[i] + reach * along
            value = _worst(nodes, cells, around, start, n, least)
            if value > least:
                least, found = value, True
                best_x, best_y, best_z = nodes[n]
        nodes[n, 0], nodes[n, 1], nodes[n, 2] = best_x, best_y, best_z
        if found:
            moved = True
        else:
            reach *= _REACH
    return moved


@njit(cache=True)
def improve(nodes, cells, free, around, start, tries, good, rounds):
    """Move the nodes of badly shaped tetrahedra, in place, where this makes the worst tetrahedron around a node better.

    Inputs
    ------
    nodes : (n, 3) float64, changed
    cells : (nc, 4) int64
    free : (n, 3, 3) float64 projectors on the directions in which a node may move
    around, start : int64; the tetrahedra of node n are around[start[n]:start[n + 1]]
    tries : (k, 3) float64 directions in which a node is moved
    good : shape of tetrahedra that are left alone
    rounds : at most
    """
    marked = np.zeros(len(nodes), dtype=np.bool_)
    for _ in range(rounds):
        if not _mark_bad(nodes, cells, good, marked):
            return
        moved = False
        for n in range(len(nodes)):
            if not marked[n] or max(free[n, 0, 0], free[n, 1, 1], free[n, 2, 2]) <= _FIXED:
                continue
            least = _worst(nodes, cells, around, start, n, -2.0)
            if least < good and _improve_node(nodes, cells, free, around, start, tries, n, least):
                moved = True
        if not moved:
            return
