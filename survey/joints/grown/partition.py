"""Partition of a rectangle among stones by few straight edges along the medial lines between their outlines."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import CORNERS, FEW, MAX_ROUNDS, MOST, PLACES, ROUNDS
from survey.geometry.polygons import inside
from survey.joints.grown.chains import apart, crosses, is_simple
from survey.joints.grown.medial_lines import Line, MedialLines

_CHORD = MOST  # of the mean thickness of a joint: largest distance of an edge from the medial line, within the mortar
_FLATTEST = FEW  # square of the growth of a difference of distances below which it tells no place
_SHIFT = MOST  # of its distance from the stones: farthest that a place moves
_MIN_LINES = CORNERS  # lines about a stone


@dataclass(frozen=True)
class Edge:
    """A straight edge between two stones, or between a stone and the frame.

    Attributes
    ----------
    ends : numbers of the corners at its ends
    left, right : numbers of the stones on its sides; openings follow the stones; negative for a side of the frame
    thickness : of the mortar: mean along it of the distances from the outlines of its stones [m]
    opening : angle by which the joint widens along it [degrees]
    """

    ends: tuple[int, int]
    left: int
    right: int
    thickness: float
    opening: float


@dataclass(frozen=True)
class Partition:
    """Division of a rectangle among stones.

    Attributes
    ----------
    corners : (n, 2) [m]
    rings : of each stone, the numbers of its corners, counter-clockwise
    edges : between them
    collapsed : number of edges that were too short and became a corner
    openings : number of the openings
    """

    corners: Array
    rings: tuple[tuple[int, ...], ...]
    edges: tuple[Edge, ...]
    collapsed: int
    openings: int = 0


def partition(
    lines: MedialLines, outlines: Sequence[Array], straightness: float, shortest: float
) -> Partition:
    """Replace medial lines by few straight edges.

    Parameters
    ----------
    lines : medial lines
    outlines : (n, 2) of the stones [m]
    straightness : largest distance of an edge from its line; half the mean thickness of the joint where less, beside an
        opening that of the usual joint [m]
    shortest : edges shorter than this become a corner [m]

    Returns
    -------
    Partition, whose polygons are simple and fill the rectangle but for its openings

    Raises
    ------
    GeometryError
        if the lines cannot be straightened without crossing each other
    """
    for drawn in (_exact(lines, outlines), lines):  # those of the samples hold where outlines cross
        bound = [
            min(straightness, _CHORD * _mean_thickness(line, outlines, lines.usual)) for line in drawn.lines
        ]
        for least in (shortest, 0.5 * shortest, 0.25 * shortest, 0.0):
            network = _Network(drawn)
            network.collapse(least)
            straight = _straightened(network, bound, least, len(outlines))
            if straight is not None:
                corners, chains, rings = straight
                edges = tuple(
                    _edge(corners, (a, b), line, outlines)
                    for line, chain in chains
                    for a, b in pairwise(chain)
                )
                return Partition(corners, rings, edges, network.collapsed, lines.openings)
    what = "the lines between the outlines cross each other when straightened"
    raise GeometryError(
        what, where="joints", remedy="look at outlines that touch or cross, and draw them apart"
    )


def _exact(lines: MedialLines, outlines: Sequence[Array]) -> MedialLines:
    """Return the lines moved to where the distances from the outlines beside them are equal, and not from samples.

    So edges hardly depend on where samples lie. Places move by Newton's rule; those on the frame stay on it, and those
    beside an opening where they are, on outlines.
    """
    about: dict[int, set[int]] = defaultdict(set)
    for line in lines.lines:
        for node in line.ends:
            about[node] |= {line.left, line.right}
    nodes = np.array(
        [
            place if max(about[k], default=0) >= len(outlines) else _met(place, about[k], outlines)
            for k, place in enumerate(lines.nodes)
        ]
    )
    moved = []
    for line in lines.lines:
        path = line.path.copy()
        path[[0, -1]] = nodes[list(line.ends)]
        if min(line.left, line.right) >= 0 and max(line.left, line.right) < len(outlines):
            path[1:-1] = _halfway(path[1:-1], outlines[line.left], outlines[line.right])
        moved.append(Line(line.ends, path, line.left, line.right))
    return replace(lines, nodes=nodes, lines=tuple(moved))


def _halfway(places: Array, first: Array, second: Array) -> Array:
    """Return places (n, 2) moved to where they are as far from one polygon as from the other."""
    moved = places
    for _ in range(ROUNDS):
        (near, out), (far, back) = _signed(moved, first), _signed(moved, second)
        rise = out - back
        steep = (rise**2).sum(axis=1)
        safe = np.where(steep > _FLATTEST, steep, np.inf)
        moved = moved - ((near - far) / safe)[:, None] * rise
    good = np.linalg.norm(moved - places, axis=1) < _SHIFT * np.abs(_signed(places, first)[0])
    halfway: Array = np.where(good[:, None], moved, places)
    return halfway


def _met(place: Array, about: set[int], outlines: Sequence[Array]) -> Array:
    """Return a node (2,) moved to where it is equally far from all stones about it, if these tell where that is."""
    stones, sides = (
        [number for number in about if number >= 0],
        {-number - 1 for number in about if number < 0},
    )
    free = [axis for axis in (0, 1) if not sides & {axis, axis + 2}]
    if len(stones) <= len(free) or not free:
        return place
    moved = place.copy()
    for _ in range(ROUNDS):
        distances = [_signed(moved[None], outlines[stone]) for stone in stones]
        apart_by = np.array([distances[0][0][0] - near[0] for near, _ in distances[1:]])
        rise = np.array([(distances[0][1][0] - out[0])[free] for _, out in distances[1:]])
        if np.linalg.svd(rise, compute_uv=False).min() ** 2 < _FLATTEST:
            return place
        moved[free] -= np.linalg.lstsq(rise, apart_by, rcond=None)[0]
    return moved if float(np.hypot(*(moved - place))) < _SHIFT * float(abs(distances[0][0][0])) else place


def _signed(places: Array, ring: Array) -> tuple[Array, Array]:
    """Return the distances (n,) of places from a polygon, negative inside, and in what direction (n, 2) they grow."""
    run = np.roll(ring, -1, axis=0) - ring
    size = np.maximum((run**2).sum(axis=1), 1e-300)
    off = places[:, None] - ring[None]
    along = np.clip((off * run).sum(axis=2) / size, 0.0, 1.0)
    gap = off - along[..., None] * run
    lengths = np.linalg.norm(gap, axis=2)
    nearest = lengths.argmin(axis=1)
    rows = np.arange(len(places))
    distance = np.where(inside(places, ring), -1.0, 1.0) * lengths[rows, nearest]
    out: Array = gap[rows, nearest] / np.where(distance == 0.0, np.inf, distance)[:, None]
    return distance, out


class _Network:
    """Lines between nodes, short ones of which become a node."""

    def __init__(self, lines: MedialLines) -> None:
        self.nodes = lines.nodes.copy()
        self.lines: dict[int, Line] = dict(enumerate(lines.lines))
        self.collapsed = 0
        self.about: dict[int, set[int]] = defaultdict(set)
        for line in lines.lines:
            for node in line.ends:
                self.about[node] |= {line.left, line.right}
        self.at: dict[int, set[int]] = defaultdict(set)
        self.sides = Counter(stone for line in lines.lines for stone in (line.left, line.right))
        for number, line in self.lines.items():
            for node in line.ends:
                self.at[node].add(number)

    def collapse(self, shortest: float) -> None:
        """Make nodes of lines whose ends are nearer than this, the shortest first."""
        merged = True
        while merged:
            merged = False
            for number in sorted(self.lines, key=self._length):
                if self._length(number) >= shortest:
                    break
                merged |= self._merge(number)

    def _length(self, number: int) -> float:
        a, b = self.lines[number].ends
        return float(np.hypot(*(self.nodes[b] - self.nodes[a]))) if a != b else np.inf

    def _merge(self, number: int) -> bool:
        """Make a node of a line; False if that would pinch a stone, cut off a corner of the frame, or lose a stone."""
        line = self.lines[number]
        a, b = line.ends
        if self.about[a] & self.about[b] != {line.left, line.right}:
            return False
        if len(self.at[a] & self.at[b]) != 1:
            return False
        sides_a, sides_b = ({side for side in self.about[node] if side < 0} for node in (a, b))
        if not (sides_a <= sides_b or sides_b <= sides_a):
            return False
        if any(stone >= 0 and self.sides[stone] <= _MIN_LINES for stone in (line.left, line.right)):
            return False
        if sides_a == sides_b:
            self.nodes[a] = 0.5 * (self.nodes[a] + self.nodes[b])
        elif len(sides_b) > len(sides_a):
            self.nodes[a] = self.nodes[b]
        self.about[a] |= self.about[b]
        del self.lines[number]
        self.sides.subtract((line.left, line.right))
        self.at[a].discard(number)
        for index in self.at.pop(b) - {number}:
            branch = self.lines[index]
            start, stop = (a if node == b else node for node in branch.ends)
            self.lines[index] = Line((start, stop), branch.path, branch.left, branch.right)
            self.at[a].add(index)
        self.collapsed += 1
        return True


Chains = list[tuple[Line, tuple[int, ...]]]


def _straightened(
    network: _Network, bound: list[float], shortest: float, count: int
) -> tuple[Array, Chains, tuple[tuple[int, ...], ...]] | None:
    """Return corners, the corners of each line, and the rings of the stones; None if they cross to the last."""
    closely = dict.fromkeys(network.lines, 1.0)
    for _ in range(MAX_ROUNDS):
        corners = list(network.nodes)
        chains: Chains = []
        of_stone: dict[int, list[int]] = defaultdict(list)
        for number, line in network.lines.items():
            path = line.path.copy()
            path[0], path[-1] = network.nodes[line.ends[0]], network.nodes[line.ends[1]]
            few = _few(path, bound[number] * closely[number], shortest * closely[number], line.ends)
            chain = (line.ends[0], *range(len(corners), len(corners) + len(few)), line.ends[1])
            corners += list(path[few])
            for stone in (line.left, line.right):
                if stone >= 0:
                    of_stone[stone].append(len(chains))
            chains.append((line, chain))
        places = np.array(corners)
        rings = [_ring(stone, [chains[k] for k in of_stone[stone]]) for stone in range(count)]
        wrong = [k for k, ring in enumerate(rings) if ring is None or not is_simple(places[list(ring)])]
        wrong += [
            k for k in of_stone if k >= count and crosses(places, [chains[one][1] for one in of_stone[k]])
        ]
        if not wrong:
            return places, chains, tuple(ring for ring in rings if ring is not None)
        for number, line in network.lines.items():
            if line.left in wrong or line.right in wrong:
                closely[number] *= 0.5
    return None


def _few(path: Array, tolerance: float, shortest: float, ends: tuple[int, int]) -> list[int]:
    """Return the places along a path, its ends left out, that a chain of straight edges needs (Douglas & Peucker)."""
    corners, stack = set[int](), [(0, len(path) - 1)]
    if ends[0] == ends[1]:  # about a single stone: three corners at least
        third = len(path) // 3
        corners = {third, 2 * third}
        stack = [(0, third), (third, 2 * third), (2 * third, len(path) - 1)]
    while stack:
        start, stop = stack.pop()
        if stop - start < 2:
            continue
        off = apart(path[start + 1 : stop], path[[start, stop]], closed=False)
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = start + 1 + worst
            corners.add(middle)
            stack += [(start, middle), (middle, stop)]
    chosen = [0, *sorted(corners), len(path) - 1]
    least = 4 if ends[0] == ends[1] else 2
    while len(chosen) > least:
        sides = np.linalg.norm(np.diff(path[chosen], axis=0), axis=1)
        short = int(np.argmin(sides))
        if sides[short] >= shortest:
            break
        # of the two ends of the shortest edge, the one that can be left out, and that is nearer to its neighbours
        ends_of = [k for k in (short, short + 1) if 0 < k < len(chosen) - 1]
        near = [
            apart(path[[chosen[k]]], path[[chosen[k - 1], chosen[k + 1]]], closed=False)[0] for k in ends_of
        ]
        del chosen[ends_of[int(np.argmin(near))]]
    return chosen[1:-1]


def _ring(stone: int, chains: Chains) -> tuple[int, ...] | None:
    """Return the corners around a stone, counter-clockwise; None unless its lines form one ring."""
    after: dict[int, tuple[int, ...]] = {}
    for line, chain in chains:
        directed = chain if line.left == stone else chain[::-1]
        if directed[0] in after:
            return None
        after[directed[0]] = directed
    if not after:
        return None
    start = here = next(iter(after))
    ring: list[int] = []
    for _ in range(len(after)):
        if here not in after:
            return None
        chain = after[here]
        ring += chain[:-1]
        here = chain[-1]
        if here == start:
            break
    return tuple(ring) if here == start and len(ring) == sum(len(one) - 1 for one in after.values()) else None


def _thickness(places: Array, line: Line, outlines: Sequence[Array]) -> Array:
    """Return the thickness (n,) of the mortar at places along a line: the distances from the outlines beside it [m]."""
    total = np.zeros(len(places))
    for stone in (line.left, line.right):
        if 0 <= stone < len(outlines):
            ring = outlines[stone]
            total += np.where(inside(places, ring), 0.0, apart(places, ring))
    return total


def _mean_thickness(line: Line, outlines: Sequence[Array], usual: float) -> float:
    if max(line.left, line.right) >= len(outlines):
        return usual
    places, lengths = _middles(line.path)
    return float(np.average(_thickness(places, line, outlines), weights=lengths)) if lengths.any() else 0.0


def _middles(path: Array) -> tuple[Array, Array]:
    ways = np.diff(path, axis=0)
    return path[:-1] + 0.5 * ways, np.linalg.norm(ways, axis=1)


def _edge(corners: Array, ends: tuple[int, int], line: Line, outlines: Sequence[Array]) -> Edge:
    start, stop = corners[list(ends)]
    along = (np.arange(PLACES) + 0.5) / PLACES
    thickness = _thickness(start + along[:, None] * (stop - start), line, outlines)
    widening = abs(float(np.polyfit(along, thickness, 1)[0])) / max(float(np.hypot(*(stop - start))), 1e-12)
    return Edge(ends, line.left, line.right, float(thickness.mean()), float(np.degrees(np.arctan(widening))))
