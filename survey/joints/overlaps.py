"""Detection and separation of overlapping stones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array, Bools
from survey.conventions import JOINT, ON_PLANE, ROUNDING, SOME
from survey.geometry._kernels.convexity import deepest_overlaps
from survey.geometry.adjacency import boxes_of, near_pairs
from survey.geometry.cutting import common_part, cut_stones, moves
from survey.geometry.solids import Solid, volume_of

LEAST_VOLUME = 1e-12  # cubic metres: smallest overlap
_ALIKE = SOME  # difference of unit normals below which two faces have no plane between them


@dataclass(frozen=True)
class Overlapping:
    """Two convex solids that overlap.

    Attributes
    ----------
    pair : their indices
    codes : of their stones
    part : intersection of the two
    volume : of the intersection [m³]
    depth : distance that one would have to move along a face's normal to be clear [m]
    """

    pair: tuple[int, int]
    codes: tuple[str, str]
    part: Solid
    volume: float
    depth: float


def find_overlaps(solids: Sequence[Solid], planes: Mapping[int, Array]) -> list[Overlapping]:
    """Return overlapping pairs among the solids that `planes` names: convex ones, with their planes (n, 4).

    Parts of one stone have one code and are ignored.
    """
    chosen = sorted(planes)
    if len(chosen) < 2:
        return []
    vertices = [solids[i].vertices for i in chosen]
    rows = [planes[i] for i in chosen]
    boxes = np.array([[*v.min(axis=0), *v.max(axis=0)] for v in vertices])
    starts = np.arange(len(chosen) + 1)
    vertex_starts = np.cumsum([0, *map(len, vertices)])
    plane_starts = np.cumsum([0, *map(len, rows)])
    all_vertices, all_planes = np.concatenate(vertices), np.concatenate(rows)
    out = []
    for pair in near_pairs(boxes_of(boxes, starts, 0.0), np.ones(len(chosen), np.bool_)):
        depth = deepest_overlaps(pair, all_vertices, vertex_starts, all_planes, plane_starts, ROUNDING)
        for k in np.flatnonzero(depth > ROUNDING):
            i, j = sorted((chosen[pair[k, 0]], chosen[pair[k, 1]]))
            if solids[i].code == solids[j].code:
                continue
            overlap = _overlapping(i, j, solids[i], solids[j], planes, float(depth[k]))
            if overlap is not None:
                out.append(overlap)
    return sorted(out, key=lambda one: one.pair)


def _overlapping(
    i: int, j: int, first: Solid, second: Solid, planes: Mapping[int, Array], depth: float
) -> Overlapping | None:
    """Return the intersection of two solids; None if it is empty within rounding."""
    low, high = first.vertices.min(axis=0), first.vertices.max(axis=0)
    part = common_part(planes[i], planes[j], 0.5 * (low + high), 2.0 * float((high - low).max()))
    if part is None or (volume := volume_of(part)) <= LEAST_VOLUME:
        return None
    return Overlapping((i, j), (first.code, second.code), part, volume, depth)


@dataclass
class _Parting:
    """State of the separation: original and current stones, their planes, and the planes that are free to move."""

    originals: Sequence[Solid]
    solids: list[Solid]
    planes: dict[int, Array]
    free: dict[int, Bools]
    bound: float

    def part(self, overlap: Overlapping) -> None:
        """Separate two stones by the cheapest method that moves no corner farther than the bound."""
        i, j = overlap.pair
        current = _overlapping(i, j, self.solids[i], self.solids[j], self.planes, overlap.depth)
        if current is None:
            return
        ways = [*self._retreats(i, j, current), *self._retreats(j, i, current)]
        for _, stone, plane, row in sorted(
            (retreat for retreat in ways if retreat[0] <= JOINT), key=lambda way: way[:3]
        ):
            new = self.planes[stone].copy()
            new[plane] = row
            if self._cut({stone: new}):
                return
        self._divide(current)

    def _retreats(self, first: int, other: int, overlap: Overlapping) -> list[tuple[float, int, int, Array]]:
        """Return moves of a stone's free faces that clear another: (distance, stone, plane, its new place).

        A face moves back as a whole, or turns about one of its edges, as an intrados does at the foot of an arch.
        """
        out = []
        for p in np.flatnonzero(self.free[first]).tolist() if first in self.free else ():
            row = self.planes[first][p]
            low = float((self.solids[other].vertices @ row[:3]).min())
            out.append((float(row[3]) - low, first, p, np.array([*row[:3], low])))
            polygon = _face_on(self.solids[first], row)
            out += [(far, first, p, turned) for far, turned in _turns(row, polygon, overlap.part.vertices)]
        return out

    def _divide(self, overlap: Overlapping) -> None:
        """Cut one along a face of the other, or both through the middle of their overlap: the least volume lost."""
        i, j = overlap.pair
        ways = [*self._beside(i, j), *self._beside(j, i), *self._between(overlap)]
        for _, cuts in sorted(ways, key=lambda way: way[0]):
            if self._cut({k: np.vstack([self.planes[k], plane]) for k, plane in cuts.items()}):
                return

    def _beside(self, first: int, other: int) -> list[tuple[float, dict[int, Array]]]:
        """Return cuts of one stone along each face of another: volume lost [m³], and plane."""
        if first not in self.free:
            return []
        return [(self._lost(first, -plane), {first: -plane}) for plane in self.planes[other]]

    def _between(self, overlap: Overlapping) -> list[tuple[float, dict[int, Array]]]:
        """Return cuts of both along a plane half-way between a face of each."""
        i, j = overlap.pair
        middle, ways = overlap.part.vertices.mean(axis=0), []
        if i not in self.free or j not in self.free:
            return []
        for a in self.planes[i]:
            for b in self.planes[j]:
                normal = a[:3] - b[:3]
                if (length := float(np.linalg.norm(normal))) < _ALIKE:
                    continue
                plane = np.array([*(normal / length), float(middle @ normal) / length])
                ways.append((self._lost(i, plane) + self._lost(j, -plane), {i: plane, j: -plane}))
        return ways

    def _lost(self, stone: int, plane: Array) -> float:
        """Return the volume of a stone above a plane [m³]."""
        solid = self.solids[stone]
        low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
        over = common_part(
            self.planes[stone], -plane[None], 0.5 * (low + high), 2.0 * float((high - low).max())
        )
        return 0.0 if over is None else volume_of(over)

    def _cut(self, planes: dict[int, Array]) -> bool:
        """Cut stones, all or none, if no corner moves farther than the bound."""
        cut = {i: stone.solid for i, stone in cut_stones(self.originals, planes).items() if stone is not None}
        if len(cut) < len(planes) or any(moves(self.originals[i], cut[i]).max() > self.bound for i in cut):
            return False
        for i, solid in cut.items():
            self.solids[i] = solid
            further = len(planes[i]) - len(self.free[i])
            self.planes[i] = planes[i]
            self.free[i] = np.concatenate([self.free[i], np.zeros(further, np.bool_)])
        return True


def part_stones(
    originals: Sequence[Solid],
    solids: Sequence[Solid],
    planes: Mapping[int, Array],
    free: Mapping[int, Bools],
    bound: float,
) -> tuple[list[Solid], list[Overlapping]]:
    """Separate overlapping stones; stones only shrink, so that no new overlap arises.

    Parameters
    ----------
    originals : all stones before any was cut
    solids : current solids
    planes : of all convex ones, (n, 4); the first belong to the faces of the originals, in order
    free : of each of these, whether it is a face that touches no stone; stones that are not listed are not cut, such
        as parts of stones that keep their shape
    bound : largest displacement of a corner [m]

    Returns
    -------
    the stones, and the pairs that still overlap
    """
    moved = {i: rows.copy() for i, rows in planes.items()}
    state = _Parting(originals, list(solids), moved, dict(free), bound)
    for overlap in find_overlaps(state.solids, moved):
        state.part(overlap)
    return state.solids, find_overlaps(state.solids, moved)


def _face_on(solid: Solid, plane: Array) -> Array:
    """Return the corners (n, 3) of the face of a solid on a plane; empty if there is no such face."""
    for face in solid.faces:
        polygon = solid.vertices[list(face)]
        if np.abs(polygon @ plane[:3] - plane[3]).max() <= ON_PLANE:
            return polygon
    return np.zeros((0, 3))


def _turns(plane: Array, polygon: Array, part: Array) -> list[tuple[float, Array]]:
    """Return turns of a face about each edge until the overlap (n, 3) is in front of it: (displacement, plane)."""
    out = []
    for k in range(len(polygon)):
        start, along = polygon[k - 1], polygon[k] - polygon[k - 1]
        normals = np.cross(along, part - start)
        lengths = np.linalg.norm(normals, axis=1)
        normals = normals[lengths > 1e-9 * float(along @ along)]
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        normals *= np.where(normals @ plane[:3] < 0.0, -1.0, 1.0)[:, None]
        for normal in normals:
            if ((part - start) @ normal).min() >= -ROUNDING:
                far = float(((polygon - start) @ normal).max())
                out.append((far, np.array([*normal, float(start @ normal)])))
                break
    return out
