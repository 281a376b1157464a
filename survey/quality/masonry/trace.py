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

from survey.arrays import Array
from survey.conventions import JOINT, SAME, STONE, TOUCHING

_JOINT = 0.08  # widest joint between two stones [m]; beyond is an opening, or the end of the wall
_HEIGHTS = (0.7, 1.5)  # straight distances at which it is measured, about a metre [m]; their mean is taken
_MIN_DISTANCE = STONE  # least straight distance: of a low wall [m]
_BESIDE = JOINT  # distance of the upright from the corner at whose head joint it begins [m]
_SAMPLES = 40  # most lines of a wall, spread evenly
_SMALL = 200  # stones of a wall up to which all its joints are a network
_WINDOW = 1.2  # half width of the part of a larger wall around each upright, whose joints are one [m]
_LONGEST = 3.0  # ratio beyond which it is not looked for: far more than any limit


@dataclass
class _Network:
    """Joints as a graph: places, and ways between them."""

    places: list[Array]
    ways: list[tuple[int, int]]

    def add(self, place: Array) -> int:
        """Add a node at a place (2,) [m]; return its number."""
        self.places.append(place)
        return len(self.places) - 1

    def matrix(self) -> csr_array:
        """Return the lengths of the edges [m] as a sparse matrix (n, n)."""
        size = len(self.places)
        if not self.ways:
            return csr_array((size, size))
        ends, places = np.array(self.ways), np.array(self.places)
        length = np.maximum(np.hypot(*(places[ends[:, 0]] - places[ends[:, 1]]).T), 1e-9)
        return coo_array((length, (ends[:, 0], ends[:, 1])), shape=(size, size)).tocsr()


def minimum_traces(faces: Sequence[Array]) -> Array:
    """Return the line of minimum trace over the straight distance at places all over a wall.

    Parameters
    ----------
    faces : outlines of its stones (k, 2) in the elevation, counter-clockwise, along and up [m]

    Returns
    -------
    (n,) ratios [-]; empty for a wall that is too low, or has no joints to go up
    """
    if len(faces) < 3:
        return np.zeros(0)
    centres = np.array([face.mean(axis=0) for face in faces])
    order = np.lexsort((centres[:, 0], centres[:, 1].round(1)))
    chosen = order[np.unique(np.linspace(0, len(faces) - 1, _SAMPLES).round().astype(int))]
    near = _around(centres, centres[chosen])
    members = np.flatnonzero(near)
    number = {k: i for i, k in enumerate(members.tolist())}
    network, uprights = _joints([faces[k] for k in members.tolist()], [number[k] for k in chosen.tolist()])
    matrix = network.matrix()
    means = []
    for start, stops in uprights:
        rise = np.array([network.places[stop][1] - network.places[start][1] for stop in stops])
        here = (rise >= _HEIGHTS[0]) & (rise <= _HEIGHTS[1])
        if not here.any() and (rise >= _MIN_DISTANCE).any():
            here = (rise >= _MIN_DISTANCE) & (rise == rise[rise <= _HEIGHTS[1]].max(initial=0.0))
        if not here.any():
            continue
        reach = dijkstra(matrix, directed=False, indices=start, limit=_LONGEST * float(rise[here].max()))
        ratios = reach[np.array(stops)[here]] / rise[here]
        if np.isfinite(ratios).all():  # a pile of single stones has no way up
            means.append(float(ratios.mean()))
    return np.array(means)


def _around(centres: Array, chosen: Array) -> NDArray[np.bool_]:
    """Return the stones near the uprights above some of them; in a small wall all of them."""
    if len(centres) <= _SMALL:
        return np.ones(len(centres), dtype=bool)
    away = centres[:, None] - chosen
    inside = (
        (np.abs(away[..., 0]) <= _WINDOW) & (away[..., 1] >= -0.5 * _WINDOW) & (away[..., 1] <= 1.5 * _WINDOW)
    )
    return np.asarray(inside.any(axis=1))


def _joints(faces: Sequence[Array], chosen: Sequence[int]) -> tuple[_Network, list[tuple[int, list[int]]]]:
    """Return the network of joints, and for the upright at each chosen stone its foot and the beds that it crosses."""
    network = _Network([], [])
    corners = np.concatenate(faces)
    owner = np.repeat(np.arange(len(faces)), [len(face) for face in faces])
    ends = np.concatenate([np.roll(face, -1, axis=0) for face in faces])
    node = [network.add(corner) for corner in corners]
    first = np.concatenate([[0], np.cumsum([len(face) for face in faces])])
    low = np.array([face.min(axis=0) for face in faces]) - _JOINT
    high = np.array([face.max(axis=0) for face in faces]) + _JOINT
    uprights = np.array([faces[k][_lower_left(faces[k])][0] for k in chosen]) + _BESIDE
    starts: dict[int, int] = {}
    crossings: dict[int, list[int]] = {}
    for k, face in enumerate(faces):
        beside = np.flatnonzero((low <= high[k]).all(axis=1) & (high >= low[k]).all(axis=1))
        others = np.flatnonzero(np.isin(owner, beside[beside != k]))
        if len(others) == 0:
            continue
        segments = corners[others], ends[others]
        ways: list[tuple[int, int]] = []
        beds: list[tuple[int, int]] = []
        for side in range(len(face)):
            start, stop = face[side], face[(side + 1) % len(face)]
            at = node[first[k] + side], node[first[k] + (side + 1) % len(face)]
            on_side = [(0.0, at[0]), (1.0, at[1])]
            for i, share in _feet(corners[others], start, stop):
                if SAME < share < 1.0 - SAME:
                    foot = network.add(start + share * (stop - start))
                    on_side.append((share, foot))
                else:
                    foot = at[int(share > 0.5)]
                network.ways.append((foot, node[others[i]]))
            run = stop - start
            if run[0] > abs(run[1]):  # counter-clockwise, the lower sides run to the right
                for u in np.flatnonzero((uprights > start[0]) & (uprights < stop[0])).tolist():
                    share = float((uprights[u] - start[0]) / run[0])
                    beds.append((u, network.add(start + share * run)))
                    on_side.append((share, beds[-1][1]))
            on_side.sort()
            ways += [(one, other) for (_, one), (_, other) in pairwise(on_side)]
        middles = [(network.places[first] + network.places[second]) / 2.0 for first, second in ways]
        asked = np.array([*middles, *(network.places[place] for _, place in beds)])
        joint = _distance(asked, *segments) <= _JOINT
        network.ways += [way for way, there in zip(ways, joint, strict=False) if there]
        for (u, place), there in zip(beds, joint[len(ways) :], strict=True):
            if there:
                crossings.setdefault(u, []).append(place)
                if chosen[u] == k:
                    starts[u] = place
    return network, [(place, crossings[u]) for u, place in starts.items()]


def _lower_left(face: Array) -> int:
    """Return the corner at the left end of the lowest side that runs to the right."""
    run = np.roll(face, -1, axis=0) - face
    level = np.flatnonzero(run[:, 0] > np.abs(run[:, 1]))
    if len(level) == 0:
        return int(face[:, 1].argmin())
    return int(level[face[level, 0].argmin()])


def _feet(points: Array, start: Array, stop: Array) -> Iterator[tuple[int, float]]:
    """Yield the points that lie beside a side, within a joint's width: index, and share of the side."""
    run = stop - start
    square = float(run @ run)
    if square < TOUCHING**2:
        return
    share = np.clip((points - start) @ run / square, 0.0, 1.0)
    distance = np.hypot(*(points - start - share[:, None] * run).T)
    for i in np.flatnonzero(distance <= _JOINT).tolist():
        yield i, float(share[i])


def _distance(places: Array, starts: Array, stops: Array) -> Array:
    """Return the distance of places (n, 2) from the nearest of some sides (m, 2)."""
    run = stops - starts
    square = np.maximum((run**2).sum(axis=1), TOUCHING**2)
    away = places[:, None] - starts
    share = np.clip((away * run).sum(axis=2) / square, 0.0, 1.0)
    nearest: Array = np.hypot(*np.moveaxis(away - share[..., None] * run, 2, 0)).min(axis=1)
    return nearest


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
        if start <= stop + TOUCHING:
            allowed = (ends >= start - TOUCHING) & (ends <= stop + TOUCHING)
        elif start >= thick - TOUCHING or stop <= TOUCHING:
            allowed = (ends <= TOUCHING) | (ends >= thick - TOUCHING)
        else:
            allowed = np.abs(ends - (start + stop) / 2.0) <= abs(start - stop) / 2.0 + TOUCHING
        moved: NDArray[np.float64] = (cost[None, :] + np.abs(ends[:, None] - ends)).min(axis=1)
        cost = np.where(allowed, moved, math.inf)
    height = float(levels.sum())
    return min((height + float(cost.min())) / height, _LONGEST)
