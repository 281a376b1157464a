"""Sections through point clouds as polylines.

Level sections and those across a wall thin the points near a plane to cells and join these. A section along a wall
nearly touches its surface, so that points near it fill areas; there the line is the contour of the depth map.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ground.errors import UsageError
from survey.arrays import Array, Ints
from survey.clouds.views.orthophoto import Picture, filled
from survey.clouds.wall import Wall
from survey.conventions import ROWS

_PLANE = re.compile(r"\s*([zsd])\s*=\s*([-+]?\d+(?:[.,]\d+)?)\s*(?:m\s*)?")
_REACH = 3.0  # cells between neighbours on a line: two may be empty, and joints are recessed
_SHORTEST = 4  # cells of the shortest line; fewer are stray points


@dataclass(frozen=True)
class SectionPlane:
    """Plane of a section.

    Attributes
    ----------
    name : as it was asked for
    origin : (3,) [m]
    axes : (3, 3) rows: two in the plane, its normal
    """

    name: str
    origin: Array
    axes: Array


def section_plane(text: str, wall: Wall) -> SectionPlane:
    """Read the plane of a section: z=HEIGHT, level; s=PLACE, upright across the wall; d=DISTANCE, along the wall.

    Raises
    ------
    UsageError
        if it is written otherwise

    Examples
    --------
    >>> from survey.clouds.wall import read_wall
    >>> section_plane("z=1.5", read_wall("0,0 1,0")).axes.tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    match = _PLANE.fullmatch(text)
    if match is None:
        remedy = "write z=1.5 for a level section, s=2.0 for one across the wall, d=-0.01 for one along it"
        raise UsageError(f"cannot be read: {text!r}", where="--section", remedy=remedy)
    which, value = match[1], float(match[2].replace(",", "."))
    right, up, out = wall.axes
    name = f"{which}={value:g}"
    if which == "z":
        return SectionPlane(name, np.array([*wall.origin[:2], value]), np.eye(3))
    if which == "s":
        return SectionPlane(name, wall.origin + value * right, np.array([out, up, np.cross(out, up)]))
    return SectionPlane(name, wall.origin + value * out, np.array([right, up, out]))


class Section:
    """Cells of a section while a cloud is read.

    Parameters
    ----------
    plane : its plane
    thickness : points count within half of it on either side [m]
    cell : side of a cell [m]
    """

    def __init__(self, plane: SectionPlane, thickness: float, cell: float) -> None:
        self.plane, self._half, self._cell = plane, 0.5 * thickness, cell
        self._keys: list[Ints] = []
        self._sums: list[Array] = []
        self._held = 0

    def add(self, places: Array, origin: Array) -> None:
        """Add points (n, 3) about an origin."""
        local = (places - (self.plane.origin - origin)) @ self.plane.axes.T
        flat = local[np.abs(local[:, 2]) <= self._half, :2]
        if not len(flat):
            return
        cells = np.floor(flat / self._cell).astype(np.int64)
        self._keys.append(cells)
        self._sums.append(np.column_stack([flat, np.ones(len(flat))]))
        self._held += len(flat)
        if self._held > ROWS:
            self._compact()

    def lines(self, tolerance: float) -> list[Array]:
        """Return the polylines of the section, (n, 3) in space [m], the longest first.

        Parameters
        ----------
        tolerance : largest distance of a cell from the line [m]
        """
        self._compact()
        if not self._held:
            return []
        sums = self._sums[0]
        flat = _drawn_together(sums[:, :2] / sums[:, 2:], sums[:, 2], self._cell)
        return [
            self.plane.origin + line @ self.plane.axes[:2]
            for line in join(flat, _REACH * self._cell, tolerance, _SHORTEST)
        ]

    def _compact(self) -> None:
        """Add up the points of each cell."""
        if len(self._keys) < 2 and self._held <= ROWS and not self._keys:
            return
        keys, sums = np.concatenate(self._keys), np.concatenate(self._sums)
        cells, which = np.unique(keys, axis=0, return_inverse=True)
        total = np.zeros((len(cells), 3))
        np.add.at(total, which.ravel(), sums)
        self._keys, self._sums, self._held = [cells], [total], len(cells)


def _drawn_together(places: Array, weights: Array, cell: float) -> Array:
    """Move places (n, 2) to the mean of those around, and thin them: noise makes a line two or three cells thick."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(places).query_pairs(1.2 * cell, output_type="ndarray")
    sums, total = places * weights[:, None], weights.copy()
    for first, second in ((0, 1), (1, 0)):
        np.add.at(sums, pairs[:, first], places[pairs[:, second]] * weights[pairs[:, second], None])
        np.add.at(total, pairs[:, first], weights[pairs[:, second]])
    moved = sums / total[:, None]
    linked: list[list[int]] = [[] for _ in moved]
    for first, second in cKDTree(moved).query_pairs(0.7 * cell):
        linked[first].append(second)
        linked[second].append(first)
    free = np.ones(len(moved), dtype=bool)
    chosen = []
    for k in np.argsort(-total, kind="stable").tolist():
        if free[k]:
            chosen.append(k)
            free[linked[k]] = False
    out: Array = moved[np.sort(chosen)]
    return out


def contour(picture: Picture, plane: SectionPlane, shortest: float, tolerance: float) -> list[Array]:
    """Return where the surface of a wall crosses a plane along it, (n, 3) in space [m], the longest first.

    Parameters
    ----------
    picture : of the wall
    plane : d=DISTANCE
    shortest : length of the shortest line [m]
    tolerance : largest distance of the contour from the line [m]
    """
    from contourpy import contour_generator

    height = float((plane.origin - picture.wall.origin) @ picture.wall.axes[2])
    depths = np.ma.masked_invalid(filled(picture.depths).astype(np.float64))
    lines = []
    for line in contour_generator(z=depths).lines(height):
        ring = np.asarray(line, dtype=np.float64)
        # the picture's first row is at the top
        flat = (
            picture.low
            + np.column_stack([ring[:, 0] + 0.5, len(picture.depths) - 0.5 - ring[:, 1]]) * picture.pixel
        )
        if float(np.linalg.norm(np.diff(flat, axis=0), axis=1).sum()) >= shortest:
            lines.append(plane.origin + _thinned(flat, tolerance) @ plane.axes[:2])
    return sorted(lines, key=lambda line: -float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()))


def join(places: Array, reach: float, tolerance: float, shortest: int) -> list[Array]:
    """Join places near a curve to polylines, the longest first.

    The places are joined to their nearest neighbours by a minimum spanning tree. Its longest path is a line; what
    branches off it is searched in the same way, until only short branches, which are noise, are left.

    Parameters
    ----------
    places : (n, 2)
    reach : largest distance of neighbours
    tolerance : distance of places from a line up to which they are left out of it
    shortest : smallest number of places of a line
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree
    from scipy.spatial import cKDTree

    if len(places) < shortest:
        return []
    pairs = cKDTree(places).query_pairs(reach, output_type="ndarray")
    if not len(pairs):
        return []
    apart = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
    graph = coo_array(
        (np.maximum(apart, 1e-12), (pairs[:, 0], pairs[:, 1])), shape=(len(places), len(places))
    )
    tree = minimum_spanning_tree(graph.tocsr()).tocoo()
    links: list[list[tuple[int, float]]] = [[] for _ in places]
    for a, b, length in zip(tree.row.tolist(), tree.col.tolist(), tree.data.tolist(), strict=True):
        links[a].append((b, length))
        links[b].append((a, length))
    lines = []
    for path in _paths(links, shortest):
        closed = (
            len(path) > 2 * shortest
            and float(np.linalg.norm(places[path[0]] - places[path[-1]])) <= 1.5 * reach
        )
        line = _thinned(places[path], tolerance)
        lines.append(np.concatenate([line, line[:1]]) if closed else line)
    return sorted(lines, key=lambda line: -float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()))


def _paths(links: list[list[tuple[int, float]]], shortest: int) -> Iterator[list[int]]:
    """Yield the longest paths of a forest, each without the places of those before."""
    free = [True] * len(links)
    stack = list(range(len(links)))
    while stack:
        start = stack.pop()
        if not free[start]:
            continue
        end, _ = _farthest(links, free, start)
        other, before = _farthest(links, free, end)
        path = [other]
        while path[-1] != end:
            path.append(before[path[-1]])
        if len(path) < shortest:
            for place in before:
                free[place] = False
            continue
        for place in path:
            free[place] = False
        stack += [next_ for place in path for next_, _ in links[place] if free[next_]]
        yield path


def _farthest(
    near: list[list[tuple[int, float]]], free: list[bool], start: int
) -> tuple[int, dict[int, int]]:
    """Return the place farthest from another along the tree, and the place before each."""
    before, farthest, best = {start: start}, start, 0.0
    stack = [(start, 0.0)]
    while stack:
        place, length = stack.pop()
        if length > best:
            farthest, best = place, length
        for next_, step in near[place]:
            if free[next_] and next_ not in before:
                before[next_] = place
                stack.append((next_, length + step))
    return farthest, before


def _thinned(line: Array, tolerance: float) -> Array:
    """Leave out places of an open line that its other places describe (Douglas and Peucker 1973)."""
    corners, stack = {0, len(line) - 1}, [(0, len(line) - 1)]
    while stack:
        start, stop = stack.pop()
        if stop - start < 2:
            continue
        side, inner = line[stop] - line[start], line[start + 1 : stop] - line[start]
        length = float(np.hypot(*side))
        apart = np.abs(inner @ [-side[1], side[0]]) / length if length > 0.0 else np.hypot(*inner.T)
        worst = int(np.argmax(apart))
        if apart[worst] > tolerance:
            corners.add(start + 1 + worst)
            stack += [(start, start + 1 + worst), (start + 1 + worst, stop)]
    return line[sorted(corners)]
