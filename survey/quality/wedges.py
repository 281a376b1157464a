"""Arch stones: convergence and slope of their sides, and the stones of arches by the fan of their joints."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from survey.arrays import Array
from survey.conventions import ALIKE, GROUP, LARGELY, LEVEL, MOST, NEGLIGIBLE, SOME, WIDEST_JOINT
from survey.quality.facades import Facade, upright_frame
from survey.quality.precision import StoneQuality

_ARCH = ("voussoir", "keystone")
_SPANNING = (*_ARCH, "lintel")
_REACH = 3.0  # of the stone's larger dimension: distance within which its neighbours in the arch are
_BULGE = (
    NEGLIGIBLE  # least rise over the chord of the neighbours, over their distance, that shows the extrados
)
_LEVEL = MOST  # sine of a radius' rise below which it does not show which end is up
_SHORT = MOST  # of the smaller extent of a face: length below which a side is an arris or a worn corner
_ALONG = ALIKE  # largest angle between two sides of a joint
_OVERLAP = LARGELY  # of the longer of two sides of a radial joint: their common length, at least
_CONVERGES = LEVEL  # least angle between the joints of an arch stone: stones are cut to 1° or 2°
_FAN = ALIKE  # least angle that the joints of an arch turn by: a flat arch's turn by 30° and more
_MIN_FAN_STONES = GROUP  # least number of stones in such a fan


@dataclass(frozen=True)
class SideConvergence:
    """Convergence of the two sides of an arch stone.

    Attributes
    ----------
    convergence : angle between them, positive if they meet beyond the intrados [rad]
    sigma : standard deviation [rad]
    """

    convergence: float
    sigma: float


def wedges(stones: Sequence[StoneQuality], facades: Sequence[Facade]) -> dict[int, SideConvergence]:
    """Return the convergence of every voussoir and keystone of the standing facades, by index.

    A stone's sides are those that face along the arch, from one of its neighbours to the other; the extrados
    is on the side where it rises over the chord between them. Stones whose sides have worn corners are left out, and
    those whose intrados cannot be identified.
    """
    convergences = {}
    for facade in facades:
        members = [i for i in facade.members.tolist() if stones[i].kind in _ARCH]
        if facade.azimuth is None or not members:
            continue
        flats = [facade.frame.flatten(stones[i].outline) for i in members]
        centres = np.array([flat.mean(axis=0) for flat in flats])
        tree = cKDTree(centres)
        for k, index in enumerate(members):
            radial = _radial(k, centres, tree, _REACH * float(np.ptp(flats[k], axis=0).max()))
            wedge = None if radial is None else _wedge(flats[k], radial, stones[index])
            if wedge is not None:
                convergences[index] = wedge
    return convergences


class Side(NamedTuple):
    """Sides of stones in the elevation of their facade, m of them.

    Attributes
    ----------
    stone : (m,) index of the stone of each
    start, run : (m, 2) its first corner, and the way to the next; the stone is to its left [m]
    """

    stone: NDArray[np.intp]
    start: Array
    run: Array

    @property
    def length(self) -> Array:
        """Length of each [m]."""
        return np.asarray(np.linalg.norm(self.run, axis=1))

    def without(self, stone: int) -> "Side":
        """Return the sides of all stones but one."""
        rest = self.stone != stone
        return Side(self.stone[rest], self.start[rest], self.run[rest])

    def of(self, stones: Collection[int]) -> "Side":
        """Return the sides of some stones."""
        chosen = np.isin(self.stone, list(stones))
        return Side(self.stone[chosen], self.start[chosen], self.run[chosen])


def sides_of(stones: Sequence[StoneQuality], facade: Facade) -> Side:
    """Return all sides of the stones of a facade that have a length."""
    members = facade.members.tolist()
    flats = [facade.frame.flatten(stones[i].outline) for i in members]
    index = np.repeat(np.array(members, dtype=np.intp), [len(flat) for flat in flats])
    start = np.concatenate([np.zeros((0, 2)), *flats])
    run = np.concatenate([np.zeros((0, 2)), *(np.roll(flat, -1, axis=0) - flat for flat in flats)])
    sound = np.linalg.norm(run, axis=1) > 1e-6
    return Side(index[sound], start[sound], run[sound])


def spanning_stones(stones: Sequence[StoneQuality], sides: Side) -> frozenset[int]:
    """Return the indices of the stones that span an opening: by their kinds, or by joints that fan out.

    A stone of an arch has two joints, which converge towards the intrados; its neighbours in the arch have one of them
    each, and converge on the same side. Three stones and more whose joints turn by 20° in all are an arch, whatever
    they are called.

    Parameters
    ----------
    stones : of the survey
    sides : of the stones of one facade
    """
    named = {int(i) for i in np.unique(sides.stone) if stones[i].kind in _SPANNING}
    joints = _radial_joints(sides)
    angles: dict[int, float] = {}
    radial: set[int] = set()
    for i in np.unique(joints.stone).tolist():
        fan = _fan(sides, joints, i, _corner(stones[i]))
        if fan is not None:
            angles[i] = fan[0]
            radial.update(fan[1])
    between = np.isin(joints.side, list(radial)) & np.isin(joints.opposite, list(radial))
    links = list(zip(joints.stone[between].tolist(), joints.neighbour[between].tolist(), strict=True))
    fans: set[int] = set()
    for group in _connected(angles, links):
        if len(group) >= _MIN_FAN_STONES and sum(angles[i] for i in group) >= _FAN:
            ends = np.isin(joints.stone, list(group)) & np.isin(joints.side, list(radial))
            fans |= group | set(joints.neighbour[ends].tolist())
    return frozenset(named | fans)


def lies_along(start: Array, run: Array, sides: Side) -> NDArray[np.bool_]:
    """Return which sides (m,) of a stone face one of other sides across a joint, over some of their length.

    Parameters
    ----------
    start, run : (m, 2) of the stone [m]
    sides : of other stones
    """
    lying = np.zeros(len(start), dtype=bool)
    if len(sides.stone) == 0:
        return lying
    length, lengths = np.linalg.norm(run, axis=1), sides.length
    for k in range(len(start)):
        if length[k] <= 0.0:
            continue
        direction = run[k] / length[k]
        parallel = -(sides.run @ direction) >= math.cos(_ALONG) * lengths
        first = sides.start - start[k]
        ends = np.stack([first, first + sides.run])
        along, across = ends @ direction, ends @ np.array([-direction[1], direction[0]])
        common = np.minimum(along.max(axis=0), length[k]) - np.maximum(along.min(axis=0), 0.0)
        close = (np.abs(across.mean(axis=0)) <= WIDEST_JOINT) & (np.abs(across).min(axis=0) <= WIDEST_JOINT)
        lying[k] = bool((parallel & close & (common >= SOME * np.minimum(length[k], lengths))).any())
    return lying


class _Joints(NamedTuple):
    """Radial joints, twice each: rows of the side and of that across it, and the stones of both."""

    side: NDArray[np.intp]
    opposite: NDArray[np.intp]
    stone: NDArray[np.intp]
    neighbour: NDArray[np.intp]


def _radial_joints(sides: Side) -> _Joints:
    """Return the joints between sides that are nearly as long as each other and lie along each other."""
    middle, length = sides.start + 0.5 * sides.run, sides.length
    pairs = (
        cKDTree(middle).query_pairs(4.0 * WIDEST_JOINT, output_type="ndarray")
        if len(middle)
        else np.zeros((0, 2), int)
    )
    a, b = pairs[:, 0], pairs[:, 1]
    direction = sides.run[a] / length[a][:, None]
    gap = middle[b] - middle[a]
    shift = np.abs((gap * direction).sum(axis=1))
    apart = np.abs(gap[:, 0] * direction[:, 1] - gap[:, 1] * direction[:, 0])
    common = 0.5 * (length[a] + length[b]) - shift
    facing = -(sides.run[a] * sides.run[b]).sum(axis=1) >= math.cos(_ALONG) * length[a] * length[b]
    chosen = (
        (sides.stone[a] != sides.stone[b])
        & facing
        & (apart <= WIDEST_JOINT)
        & (common >= _OVERLAP * np.maximum(length[a], length[b]))
    )
    here, there = np.concatenate([a[chosen], b[chosen]]), np.concatenate([b[chosen], a[chosen]])
    return _Joints(here, there, sides.stone[here], sides.stone[there])


def _fan(sides: Side, joints: _Joints, stone: int, sigma: float) -> tuple[float, tuple[int, int]] | None:
    """Return the angle between the two joints of a stone that converge most [rad], and the rows of their sides.

    None stands for an angle that is not significant.
    """
    rows = np.unique(joints.side[joints.stone == stone])
    if len(rows) < 2:
        return None
    run, length = sides.run[rows], sides.length[rows]
    turn = np.arctan2(run[:, 1], run[:, 0])
    best: tuple[float, tuple[int, int]] | None = None
    for i in range(len(rows)):
        for k in range(i):
            # opposite sides of a counter-clockwise outline run in opposite ways
            angle = float(abs((turn[i] - turn[k]) % (2.0 * math.pi) - math.pi))
            # two corners at either end of both
            certain = angle > max(_CONVERGES, 3.0 * 2.0 * sigma / float(min(length[i], length[k])))
            if certain and angle <= math.pi / 4.0 and (best is None or angle > best[0]):
                best = angle, (int(rows[i]), int(rows[k]))
    return best


def _connected(members: Collection[int], links: Sequence[tuple[int, int]]) -> Iterator[set[int]]:
    """Yield the sets of members that links join."""
    number = {member: k for k, member in enumerate(members)}
    if not number:
        return
    rows = np.array([(number[a], number[b]) for a, b in links], dtype=np.intp).reshape(-1, 2)
    graph = coo_array((np.ones(len(rows)), (rows[:, 0], rows[:, 1])), shape=(len(number), len(number)))
    label = connected_components(graph, directed=False)[1]
    names = np.array(list(number))
    for k in np.unique(label):
        yield set(names[label == k].tolist())


def sloped_side(stone: StoneQuality) -> tuple[float, float]:
    """Return the departure of the most sloped longer side from both level and plumb, and its sigma [rad]."""
    flat = upright_frame(stone.normal, stone.outline[0]).flatten(stone.outline)
    run = np.roll(flat, -1, axis=0) - flat
    length = np.linalg.norm(run, axis=1)
    slope = np.arctan2(np.abs(run).min(axis=1), np.abs(run).max(axis=1))
    slope[length < _SHORT * np.ptp(flat, axis=0).min()] = 0.0
    k = int(slope.argmax())
    return float(slope[k]), math.sqrt(2.0) * _corner(stone) / float(length[k])


def _corner(stone: StoneQuality) -> float:
    """Return the standard deviation of a corner in the plane of the face."""
    return stone.dimension_sigma / math.sqrt(2.0)


def _radial(k: int, centres: Array, tree: "cKDTree[None]", reach: float) -> Array | None:
    """Return the unit vector towards the extrados in the elevation; None if it cannot be determined."""
    if len(centres) == 1:
        return np.array([0.0, 1.0])  # an arch of one stone
    distances, near = tree.query(centres[k], k=min(3, len(centres)), distance_upper_bound=reach)
    others = [
        int(i)
        for i, d in zip(np.ravel(near), np.ravel(distances), strict=True)
        if i != k and math.isfinite(d)
    ]
    if not others:
        return np.array([0.0, 1.0])
    chord = centres[others[0]] - centres[k]
    rise = np.zeros(2)
    if len(others) == 2:  # of the three stones the middle one rises over the chord of the others
        three = centres[[k, *others]]
        longest = np.linalg.svd(three - three.mean(axis=0))[2][0]
        order = np.argsort(three @ longest)
        first, middle, last = three[order]
        rise = middle - (first + last) / 2.0
        chord = last - first if order[1] == 0 else chord
    size = float(np.linalg.norm(chord))
    radial = np.array([-chord[1], chord[0]]) / size
    if abs(radial[1]) > _LEVEL:
        return radial if radial[1] > 0.0 else -radial
    if abs(rise @ radial) > _BULGE * size:
        return radial if rise @ radial > 0.0 else -radial
    return None


def _wedge(flat: Array, radial: Array, stone: StoneQuality) -> SideConvergence | None:
    tangent = np.array([radial[1], -radial[0]])
    run = np.roll(flat, -1, axis=0) - flat
    length = np.linalg.norm(run, axis=1)
    outward = np.column_stack([run[:, 1], -run[:, 0]]) / length[:, None]
    angles, variance = [], 0.0
    for sign in (1.0, -1.0):
        facing = outward @ (sign * tangent)
        k = int(np.where(facing > math.sqrt(0.5), length, 0.0).argmax())
        if facing[k] <= math.sqrt(0.5) or {k, (k + 1) % len(flat)} & set(stone.worn_corners):
            return None
        up = run[k] if run[k] @ radial > 0.0 else -run[k]
        angles.append(sign * math.atan2(float(up @ tangent), float(up @ radial)))
        variance += 2.0 * _corner(stone) ** 2 / float(length[k]) ** 2
    return SideConvergence(sum(angles), math.sqrt(variance))
