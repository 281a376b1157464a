"""Solids made of the cells between planes of three families: closed, never touching themselves along an edge."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label

from survey.arrays import Array, Bools
from survey.geometry.solids import Solid

Node = tuple[int, int, int]

# corners of each side of a cell, counter-clockwise seen from outside; axes: along, up, from the front to the back
_SIDES: dict[Node, tuple[Node, ...]] = {
    (-1, 0, 0): ((0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)),
    (1, 0, 0): ((1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0)),
    (0, -1, 0): ((0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)),
    (0, 1, 0): ((0, 1, 0), (1, 1, 0), (1, 1, 1), (0, 1, 1)),
    (0, 0, -1): ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)),
    (0, 0, 1): ((0, 0, 1), (0, 1, 1), (1, 1, 1), (1, 0, 1)),
}


@dataclass(frozen=True)
class CellGrid:
    """Cells between upright planes, beds and levels.

    Attributes
    ----------
    places : (ni,) positions of the upright planes along the wall, increasing [m]
    beds : (nj, 4) planes n·x = d, from below
    levels : (nk, 4) planes, from the front of the wall to its back
    filled : (ni - 1, nj - 1, nk - 1) whether each cell belongs to the solid
    """

    places: Array
    beds: Array
    levels: Array
    filled: Bools


def grid_solids(grid: CellGrid) -> Iterator[Solid]:
    """Yield a solid for each connected part of the filled cells, without cells where it would touch itself."""
    filled = _without_edges(grid.filled) if grid.filled.size else grid.filled
    parts, count = label(filled)
    for number in range(1, count + 1):
        yield _solid(grid, parts == number)


def _solid(grid: CellGrid, filled: Bools) -> Solid:
    """Return the solid of connected cells, without planes that cut nothing of it."""
    planes = [grid.places, grid.beds, grid.levels]
    for axis in range(3):
        filled, planes[axis] = _coarser(filled, planes[axis], axis)
    loops = [_around(low, high, side) for side in _SIDES for low, high in _rectangles(filled, side)]
    corners = {node for loop in loops for node in _turns(loop)}
    numbers: dict[Node, int] = {}
    faces = [
        tuple(numbers.setdefault(node, len(numbers)) for node in loop if node in corners) for loop in loops
    ]
    vertices = np.array([_node(planes, node) for node in numbers])
    return Solid("", vertices, tuple(faces))


def _rectangles(filled: Bools, side: Node) -> Iterator[tuple[Node, Node]]:
    """Yield the free sides of cells that face one way, merged: first and last cell of each rectangle."""
    padded = np.pad(filled, 1)
    free = (padded & ~np.roll(padded, [-s for s in side], axis=(0, 1, 2)))[1:-1, 1:-1, 1:-1]
    along, across = (axis for axis in range(3) if side[axis] == 0)
    for first in np.argwhere(free).tolist():
        if not free[tuple(first)]:
            continue
        last = list(first)
        for axis in (along, across):
            while last[axis] + 1 < free.shape[axis]:
                span = [slice(a, b + 1) for a, b in zip(first, last, strict=True)]
                span[axis] = slice(last[axis] + 1, last[axis] + 2)
                if not free[tuple(span)].all():
                    break
                last[axis] += 1
        free[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))] = False
        yield (first[0], first[1], first[2]), (last[0], last[1], last[2])


def _around(low: Node, high: Node, side: Node) -> list[Node]:
    """Return all nodes on the edge of a rectangle of cells' sides, counter-clockwise seen from outside."""
    ends = [
        tuple(a if bit == 0 else b + 1 for a, b, bit in zip(low, high, corner, strict=True))
        for corner in _SIDES[side]
    ]
    loop: list[Node] = []
    for start, stop in zip(ends, [*ends[1:], ends[0]], strict=True):
        run = [b - a for a, b in zip(start, stop, strict=True)]
        count = max(abs(r) for r in run)
        x, y, z = (r // count for r in run)
        loop += [(start[0] + k * x, start[1] + k * y, start[2] + k * z) for k in range(count)]
    return loop


def _turns(loop: list[Node]) -> Iterator[Node]:
    """Yield the nodes at which a loop turns."""
    for before, here, after in zip([loop[-1], *loop[:-1]], loop, [*loop[1:], loop[0]], strict=True):
        if any(2 * h != a + b for a, h, b in zip(before, here, after, strict=True)):
            yield here


def _coarser(filled: Bools, planes: Array, axis: int) -> tuple[Bools, Array]:
    """Drop planes with the same cells on both sides everywhere, and empty layers at the ends."""
    layers = np.moveaxis(filled, axis, 0)
    used = np.flatnonzero(layers.reshape(len(layers), -1).any(axis=1))
    layers, planes = layers[used[0] : used[-1] + 1], planes[used[0] : used[-1] + 2]
    distinct = [0, *(k for k in range(1, len(layers)) if (layers[k] != layers[k - 1]).any())]
    return np.moveaxis(layers[distinct], 0, axis), planes[[*distinct, len(layers)]]


def _node(planes: list[Array], node: Node) -> Array:
    """Return the intersection of three planes."""
    place, bed, level = (family[k] for family, k in zip(planes, node, strict=True))
    matrix = np.array([[1.0, 0.0, 0.0], bed[:3], level[:3]])
    out: Array = np.linalg.solve(matrix, np.array([float(place), bed[3], level[3]]))
    return out


def _without_edges(filled: Bools) -> Bools:
    """Empty cells until no two touch only along an edge or at a corner, each time the one that settles most."""
    filled = filled.copy()
    while True:
        touching = _touching(filled)
        if not touching:
            return filled
        filled[max(touching, key=lambda cell: (touching[cell], cell))] = False


def _touching(filled: Bools) -> Counter[Node]:
    """Count for each cell its forbidden contacts with others."""
    touching: Counter[Node] = Counter()
    padded = np.pad(filled, 1)
    for step in _DIAGONALS:
        moved = np.roll(padded, [-s for s in step], axis=(0, 1, 2))
        both = padded & moved
        for between in _between(step):
            both &= ~np.roll(padded, [-s for s in between], axis=(0, 1, 2))
        for cell in np.argwhere(both).tolist():
            for place in (cell, [c + s for c, s in zip(cell, step, strict=True)]):
                touching[(place[0] - 1, place[1] - 1, place[2] - 1)] += 1
    return touching


_DIAGONALS = [
    (a, b, c)
    for a in (-1, 0, 1)
    for b in (-1, 0, 1)
    for c in (-1, 0, 1)
    if (a, b, c) > (0, 0, 0) and (a != 0) + (b != 0) + (c != 0) > 1
]


def _between(step: Node) -> list[Node]:
    """Return the steps to the cells around the edge, or the corner, that a diagonal step goes through."""
    choices = [(0,) if s == 0 else (0, s) for s in step]
    around = [(a, b, c) for a in choices[0] for b in choices[1] for c in choices[2]]
    return [shift for shift in around if shift not in ((0, 0, 0), step)]
