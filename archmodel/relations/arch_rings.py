"""Rings of arches from the joints between voussoirs, as plain values.

Voussoirs that touch make up an arch if their faces look one way, along its axis. Seen along that axis, a joint
between two stones of one ring is crossed by the ring (its normal runs along the arch), one between two rings is
not (its normal runs from the centre). Within a ring every stone has at most two such joints, and so the ring is a
row, which is read from left to right as one sees it who stands before it.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from archmodel.arrays import Array
from archmodel.store.stone_arrays import StoneColumns

_ONE_WAY = 0.9  # length of the mean of unit normals of faces that look one way
_CROSSED = np.sin(
    np.radians(45.0)
)  # of a joint's normal and the ray from the centre: more lies between rings
_PARALLEL = 0.02  # sine of the angle between joints of which it cannot be told where they meet
_POINTS_THERE = 0.1  # sine of the angle by which a joint may point past the centre
_CANDIDATES = 400  # places that are tried for the centre
_MAX_ITERATIONS = 5  # until the centre and the joints within rings agree; two or three do
_MIN_ARCH_STONES = 3  # stones of an arch, with its springers


@dataclass(frozen=True)
class ArchStone:
    """Stone in its place in an arch.

    Attributes
    ----------
    entity : its number
    ring : from the intrados outwards, from 1
    rank : place in its ring, from 1 at the left springer; springers of one side share theirs
    angle : between its two joints [rad]; None where it has but one within the arch
    """

    entity: int
    ring: int
    rank: int
    angle: float | None


@dataclass(frozen=True)
class ArchRings:
    """Row, or rings of rows, of voussoirs.

    Attributes
    ----------
    stones : in the order of ring and rank
    """

    stones: tuple[ArchStone, ...]


@dataclass(frozen=True, eq=False)
class ArchJoint:
    """Joint of two stones in contact.

    Attributes
    ----------
    first, second : their indices
    normal : (3,) unit vector from the second to the first
    """

    first: int
    second: int
    normal: Array

    def other(self, stone: int) -> int:
        """Return the stone on the other side."""
        return self.second if stone == self.first else self.first

    def towards(self, stone: int) -> Array:
        """Return the normal that points to one of the stones."""
        return self.normal if stone == self.first else -self.normal


def arches_among(stones: StoneColumns, feet: Sequence[bool], joints: Iterable[ArchJoint]) -> list[ArchRings]:
    """Return the arches that voussoirs form, by the smallest number of their stones.

    Parameters
    ----------
    stones : voussoirs
    feet : (n,) which of them are springers: an arch ends there
    joints : where they touch
    """
    touching: dict[int, list[ArchJoint]] = defaultdict(list)
    for joint in joints:
        touching[joint.first].append(joint)
        touching[joint.second].append(joint)
    members = [i for i in range(len(stones)) if not feet[i]]
    arches = (_arch(group, touching, stones) for group in _groups(members, touching))
    present = [arch for arch in arches if arch is not None]
    return sorted(present, key=lambda arch: min(stone.entity for stone in arch.stones))


def _groups(members: Sequence[int], touching: Mapping[int, Sequence[ArchJoint]]) -> Iterator[list[int]]:
    """Return connected groups of stones, each group and all of them in the order of their numbers."""
    left = set(members)
    for start in members:
        if start not in left:
            continue
        left.remove(start)
        group, front = [start], [start]
        while front:
            voussoir = front.pop()
            linked = {
                second for joint in touching.get(voussoir, ()) if (second := joint.other(voussoir)) in left
            }
            left -= linked
            group += linked
            front += linked
        yield sorted(group)


def _arch(
    group: Sequence[int], touching: Mapping[int, Sequence[ArchJoint]], stones: StoneColumns
) -> ArchRings | None:
    """Return the arch of connected stones; None if they form none: one stone, or a web of a vault."""
    mean = stones.normals[list(group)].mean(axis=0)
    if not float(np.linalg.norm(mean)) >= _ONE_WAY:
        return None
    inside = set(group)
    view = _View(mean / np.linalg.norm(mean), group, touching, stones.centres)
    mine = [
        joint for i in group for joint in touching.get(i, ()) if joint.first == i and joint.second in inside
    ]
    within, centre = _within_rings(group, mine, view)
    crossed: dict[int, list[ArchJoint]] = defaultdict(list)
    for joint in within:
        crossed[joint.first].append(joint)
        crossed[joint.second].append(joint)
    rows = [row for ring in _groups(group, crossed) if (row := _row_of(ring, crossed, view)) is not None]
    if sum(len(row) for row in rows) < len(group):
        return None
    rows.sort(key=lambda row: float(np.linalg.norm(view.places(row) - centre, axis=1).mean()))
    for i in group:  # a ring ends at the springers that its last stones touch
        crossed[i] += [joint for joint in touching.get(i, ()) if joint.other(i) not in inside]
    arch_stones: dict[int, ArchStone] = {}
    for number, row in enumerate(rows, start=1):
        for stone in _placed(number, row, crossed, inside, stones, view):
            arch_stones.setdefault(stone.entity, stone)
    return ArchRings(tuple(arch_stones.values())) if len(arch_stones) >= _MIN_ARCH_STONES else None


class _View:
    """View along the axis of an arch: the places of its stones and of those that they touch."""

    def __init__(
        self,
        axis: Array,
        group: Sequence[int],
        touching: Mapping[int, Sequence[ArchJoint]],
        centres: Array,
    ) -> None:
        across = np.array([-axis[1], axis[0], 0.0])
        if np.linalg.norm(across) < 1e-6:  # seen from below or above, any direction will do
            across = np.array([1.0, 0.0, 0.0])
        across /= np.linalg.norm(across)
        self._axes = np.column_stack([across, np.cross(axis, across)])
        seen = list(
            dict.fromkeys([*group, *(joint.other(i) for i in group for joint in touching.get(i, ()))])
        )
        flat = self.project(centres[seen] - np.nanmean(centres[seen], axis=0))
        self._flat = dict(zip(seen, flat, strict=True))

    def project(self, vectors: Array) -> Array:
        """Return components (…, 2) to the right and up."""
        out: Array = vectors @ self._axes
        return out

    def places(self, stones: Iterable[int]) -> Array:
        """Return centroids (m, 2) of some stones, to the right and up [m]."""
        return np.array([self._flat[i] for i in stones])

    def right(self, stone: int) -> float:
        """Return the distance of a stone to the right [m]."""
        return float(self._flat[stone][0])

    def up(self, stone: int) -> float:
        """Return the height of a stone [m]."""
        return float(self._flat[stone][1])


def _within_rings(
    group: Sequence[int], joints: Sequence[ArchJoint], view: _View
) -> tuple[list[ArchJoint], Array]:
    """Return the joints that the rings cross, and the centre about which they turn."""
    degrees = Counter(i for joint in joints for i in (joint.first, joint.second))
    if max(degrees.values(), default=0) <= 2 and len(joints) < len(group):
        return list(joints), np.zeros(2)  # one row, however its centre lies
    middle = 0.5 * (
        view.places(joint.first for joint in joints) + view.places(joint.second for joint in joints)
    )
    normal = view.project(np.array([joint.normal for joint in joints]))
    centre = _centre(middle, normal)
    for _ in range(_MAX_ITERATIONS):
        crossing = _off(centre, middle, normal) <= _CROSSED
        if crossing.sum() < 2:
            break
        rows = normal[crossing]
        centre = np.linalg.lstsq(rows, (rows * middle[crossing]).sum(axis=1), rcond=1e-6)[0]
    return [joint for joint, is_within in zip(joints, crossing, strict=True) if is_within], centre


def _centre(middle: Array, normal: Array) -> Array:
    """Return the place (2,) to which most joints point: joints within rings meet there, those between rings nowhere.

    Parameters
    ----------
    middle, normal : (m, 2) of the joints, seen along the axis
    """
    count = len(middle)
    steps = [step for step in (1, 2, 3, 5, 8, 13, count // 3, count // 2) if 0 < step < count]
    first = np.tile(np.arange(count), len(steps))
    second = (first + np.repeat(np.array(steps, dtype=np.int64), count)) % count
    sine = normal[first, 0] * normal[second, 1] - normal[first, 1] * normal[second, 0]
    chosen = np.flatnonzero(np.abs(sine) > _PARALLEL)
    chosen = chosen[:: max(1, len(chosen) // _CANDIDATES)]
    best: Array = middle.mean(axis=0)
    most = 0
    for i, j in zip(first[chosen].tolist(), second[chosen].tolist(), strict=True):
        pair = normal[[i, j]]
        place = np.linalg.solve(pair, (pair * middle[[i, j]]).sum(axis=1))
        votes = int((_off(place, middle, normal) <= _POINTS_THERE).sum())
        if votes > most:
            best, most = place, votes
    return best


def _off(centre: Array, middle: Array, normal: Array) -> Array:
    """Return the sine of the angle (m,) by which the face of each joint points past a place."""
    ray = middle - centre
    out: Array = np.abs((normal * ray).sum(axis=1)) / np.maximum(np.linalg.norm(ray, axis=1), 1e-12)
    return out


def _row_of(ring: Sequence[int], crossed: Mapping[int, Sequence[ArchJoint]], view: _View) -> list[int] | None:
    """Order the stones of a ring from left to right; None if they branch.

    A ring that is closed begins with its lowest stone.
    """
    beside = {i: sorted({joint.other(i) for joint in crossed.get(i, ())}) for i in ring}
    if max(len(others) for others in beside.values()) > 2:
        return None
    ends = [i for i in ring if len(beside[i]) < 2]
    start = min(ends, key=view.right) if ends else min(ring, key=view.up)
    row, seen = [start], {start}
    while following := [i for i in beside[row[-1]] if i not in seen]:
        row.append(max(following, key=view.right))
        seen.add(row[-1])
    return row


def _placed(
    number: int,
    row: Sequence[int],
    crossed: Mapping[int, Sequence[ArchJoint]],
    inside: set[int],
    stones: StoneColumns,
    view: _View,
) -> Iterator[ArchStone]:
    """Place the stones of a ring and its springers, from left to right."""
    feet: tuple[set[int], set[int]] = (set(), set())
    for end in {row[0], row[-1]}:
        for foot in (joint.other(end) for joint in crossed[end]):
            if foot not in inside:
                right = view.right(foot) > view.right(end) if len(row) == 1 else end == row[-1]
                feet[int(right)].add(foot)
    first = 2 if feet[0] else 1
    place = {i: rank for rank, i in enumerate(row, start=first)}
    place |= dict.fromkeys(sorted(feet[0]), 1) | dict.fromkeys(sorted(feet[1]), first + len(row))
    for i, rank in sorted(place.items(), key=lambda item: (item[1], item[0])):
        angle = _angle(i, place, crossed[i], view) if i in inside else None
        yield ArchStone(int(stones.ids[i]), number, rank, angle)


def _angle(stone: int, place: Mapping[int, int], joints: Sequence[ArchJoint], view: _View) -> float | None:
    """Return the angle between the joints of a stone with its neighbours in the row [rad]; None without these."""
    sides = [np.zeros(3), np.zeros(3)]
    for joint in joints:
        apart = place.get(joint.other(stone), place[stone]) - place[stone]
        if abs(apart) == 1:
            sides[int(apart > 0)] += joint.towards(stone) * -apart
    if not sides[0].any() or not sides[1].any():
        return None
    first, second = view.project(sides[0]), view.project(sides[1])
    return float(np.arctan2(abs(first[0] * second[1] - first[1] * second[0]), first @ second))
