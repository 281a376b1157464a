"""Line of minimum trace: the shortest way through the joints, over the straight distance.

On the face of a wall from the foot of a head joint to the beds about a metre above it; through a wall down a section
(Borri et al. 2015). It is 1 where head joints are aligned, or where nothing bonds the two faces; the longer, the better
stones interlock.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from survey.arrays import Array

__all__ = ["minimum_traces", "section_trace"]

_JOINT = 0.08  # widest joint between two stones [m]; beyond is an opening, or the end of the wall
_HEIGHTS = (0.7, 1.5)  # straight distances at which it is measured, about a metre [m]; their mean is taken
_LEAST = 0.5  # least straight distance: of a low wall [m]
_BESIDE = 0.01  # distance of the upright from the corner at whose head joint it begins [m]
_SAMPLES = 60  # most lines of a wall, spread evenly
_LONGEST = 3.0  # ratio beyond which it is not looked for: far more than any limit
_SAME = 1e-6  # places closer than this are one [m]


@dataclass
class _Network:
    """Joints as a graph: places, and ways between them."""

    places: list[Array]
    ways: list[tuple[int, int, float]]

    def add(self, place: Array) -> int:
        self.places.append(place)
        return len(self.places) - 1

    def join(self, one: int, other: int) -> None:
        length = float(np.hypot(*(self.places[one] - self.places[other])))
        self.ways.append((one, other, max(length, 1e-9)))

    def matrix(self) -> csr_array:
        if not self.ways:
            return csr_array((len(self.places), len(self.places)))
        first, second, length = (np.array(column) for column in zip(*self.ways, strict=True))
        size = len(self.places)
        return coo_array((length, (first, second)), shape=(size, size)).tocsr()


def minimum_traces(faces: Sequence[Array]) -> Array:
    """Return the line of minimum trace over the straight distance at places all over a wall.

    Parameters
    ----------
    faces : outlines of its stones (k, 2) in the elevation, counter-clockwise, along and up [m]

    Returns
    -------
    (n,) ratios [-], at most 3; empty for a wall that is too low
    """
    if len(faces) < 3:
        return np.zeros(0)
    network, uprights = _joints(faces)
    matrix = network.matrix()
    found = []
    for start, stops in uprights:
        rise = np.array([network.places[stop][1] - network.places[start][1] for stop in stops])
        near = (rise >= _HEIGHTS[0]) & (rise <= _HEIGHTS[1])
        if not near.any() and (rise >= _LEAST).any():
            near = (rise >= _LEAST) & (rise == rise[rise <= _HEIGHTS[1]].max(initial=0.0))
        if not near.any():
            continue
        reach = dijkstra(matrix, directed=False, indices=start, limit=_LONGEST * float(rise[near].max()))
        ratios = reach[np.array(stops)[near]] / rise[near]
        found.append(float(np.minimum(ratios, _LONGEST).mean()))
    return np.array(found)


def _joints(faces: Sequence[Array]) -> tuple[_Network, list[tuple[int, list[int]]]]:
    """Return the network of joints, and for each upright its foot and where it crosses the beds above."""
    network = _Network([], [])
    corners = np.concatenate(faces)
    owner = np.repeat(np.arange(len(faces)), [len(face) for face in faces])
    node = [network.add(corner) for corner in corners]
    tree = cKDTree(corners)
    first = np.concatenate([[0], np.cumsum([len(face) for face in faces])])
    centres = np.array([face.mean(axis=0) for face in faces])
    radius = np.array(
        [np.hypot(*(face - centre).T).max() for face, centre in zip(faces, centres, strict=True)]
    )
    around = cKDTree(centres)
    chosen = np.unique(np.linspace(0, len(faces) - 1, _SAMPLES).round().astype(int))
    chosen = np.lexsort((centres[:, 0], centres[:, 1].round(1)))[chosen]
    feet = np.array([faces[k][_lower_left(faces[k])] for k in chosen.tolist()])
    uprights = feet[:, 0] + _BESIDE
    starts: dict[int, int] = {}
    crossings: dict[int, list[int]] = {}
    for k, face in enumerate(faces):
        near = [i for i in tree.query_ball_point(centres[k], radius[k] + _JOINT) if owner[i] != k]
        reach = radius[k] + float(radius.max()) + _JOINT
        beside = [faces[j] for j in around.query_ball_point(centres[k], reach) if j != k]
        for side, (start, stop) in enumerate(zip(face, np.roll(face, -1, axis=0), strict=True)):
            ends = node[first[k] + side], node[first[k] + (side + 1) % len(face)]
            on_side = [(0.0, ends[0]), (1.0, ends[1])]
            for i, share, distance in _feet(corners[near], start, stop):
                place = network.add(start + share * (stop - start)) if _SAME < share < 1.0 - _SAME else None
                foot = ends[int(share > 0.5)] if place is None else place
                if place is not None:
                    on_side.append((share, place))
                if distance <= _JOINT:
                    network.join(foot, node[near[i]])
            run = stop - start
            if run[0] > abs(run[1]):  # counter-clockwise, the lower sides run to the right
                for u in np.flatnonzero((uprights > start[0]) & (uprights < stop[0])).tolist():
                    share = float((uprights[u] - start[0]) / run[0])
                    place = network.add(start + share * run)
                    on_side.append((share, place))
                    if not _faces_another(network.places[place], beside):
                        continue
                    if chosen[u] == k:
                        starts[u] = place
                    crossings.setdefault(u, []).append(place)
            on_side.sort()
            for (_, one), (_, other) in pairwise(on_side):
                if _faces_another((network.places[one] + network.places[other]) / 2.0, beside):
                    network.join(one, other)
    return network, [(place, crossings[u]) for u, place in starts.items()]


def _lower_left(face: Array) -> int:
    """Return the corner at the left end of the lowest side that runs to the right."""
    run = np.roll(face, -1, axis=0) - face
    level = np.flatnonzero(run[:, 0] > np.abs(run[:, 1]))
    if len(level) == 0:
        return int(face[:, 1].argmin())
    return int(level[face[level, 0].argmin()])


def _feet(points: Array, start: Array, stop: Array) -> Iterator[tuple[int, float, float]]:
    """Yield the points that lie beside a side: index, share of the side, and distance."""
    if len(points) == 0:
        return
    run = stop - start
    square = float(run @ run)
    if square < _SAME**2:
        return
    share = np.clip((points - start) @ run / square, 0.0, 1.0)
    distance = np.hypot(*(points - start - share[:, None] * run).T)
    for i in np.flatnonzero(distance <= _JOINT).tolist():
        yield i, float(share[i]), float(distance[i])


def _faces_another(place: Array, beside: Sequence[Array]) -> bool:
    """Return whether another stone is within a joint's width of a place."""
    for face in beside:
        if (place < face.min(axis=0) - _JOINT).any() or (place > face.max(axis=0) + _JOINT).any():
            continue
        run = np.roll(face, -1, axis=0) - face
        square = np.maximum((run**2).sum(axis=1), _SAME**2)
        share = np.clip(((place - face) * run).sum(axis=1) / square, 0.0, 1.0)
        if float(np.hypot(*(place - face - share[:, None] * run).T).min()) <= _JOINT:
            return True
    return False


def section_trace(levels: Array, front: Array, back: Array) -> float:
    """Return the line of minimum trace down a section through a wall, over its height.

    Parameters
    ----------
    levels : (n,) heights of the rows of the section [m]
    front, back : (n,) where the stones of the front end, and where those of the back begin, from the front [m]; 0 and
        the thickness of the wall where there is no stone

    Notes
    -----
    In each row the line may be where no stone is, or in the joint between a stone of the front and one of the back. A
    stone that reaches to the other face is passed at its ends. From row to row the line runs along a bed.
    """
    thick = float(back.max())
    ends = np.unique(np.concatenate([front, back, [0.0, thick]]))
    cost = np.zeros(len(ends))
    for start, stop in zip(front, back, strict=True):
        if start <= stop + _SAME:
            allowed = (ends >= start - _SAME) & (ends <= stop + _SAME)
        elif start >= thick - _SAME or stop <= _SAME:
            allowed = (ends <= _SAME) | (ends >= thick - _SAME)
        else:
            allowed = np.abs(ends - (start + stop) / 2.0) <= abs(start - stop) / 2.0 + _SAME
        moved: NDArray[np.float64] = (cost[None, :] + np.abs(ends[:, None] - ends)).min(axis=1)
        cost = np.where(allowed, moved, math.inf)
    height = float(levels.sum())
    return min((height + float(cost.min())) / height, _LONGEST)
