"""Arches: rows of voussoirs that press on one another, with their springers and their keystone.

Voussoirs that touch make up an arch if their faces look one way, along its axis. Seen along that axis, a joint
between two stones of one ring is crossed by the ring (its normal runs along the arch), one between two rings is
not (its normal runs from the centre). Within a ring every stone has at most two such joints, and so the ring is a
row, which is read from left to right as one sees it who stands before it.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session, aliased

from archmodel.composing import Part
from archmodel.entities import Entity, Springer, Voussoir, kind_of, kinds
from archmodel.relations import Membership, Relation
from archmodel.stone_columns import StoneColumns, stone_columns
from archmodel.structures import Structure

__all__ = ["Arch", "ArchStone", "arch_parts", "find_arches"]

Array = NDArray[np.float64]

_ONE_WAY = 0.9  # length of the mean of unit normals of faces that look one way
_CROSSED = np.sin(
    np.radians(45.0)
)  # a joint whose normal is nearer to the ray from the centre lies between rings
_ROUNDS = 5  # until the centre and the joints within rings agree; two or three do
_FEWEST = 3  # stones of an arch, with its springers


@dataclass(frozen=True)
class ArchStone:
    """A stone in its place in an arch.

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
class Arch:
    """A row, or rings of rows, of voussoirs.

    Attributes
    ----------
    stones : in the order of ring and rank
    """

    stones: tuple[ArchStone, ...]


@dataclass(frozen=True)
class _Joint:
    """Two stones and the unit normal from the second to the first."""

    first: int
    second: int
    normal: Array


def find_arches(session: Session) -> list[Arch]:
    """The arches that the relations of the voussoirs make, by the smallest number of their stones."""
    stones = stone_columns(session, Entity.kind.in_(_names(Voussoir)))
    if len(stones) == 0:
        return []
    place = {number: i for i, number in enumerate(stones.ids.tolist())}
    springer = set(_names(Springer))
    foot = [kind in springer for kind in stones.kinds]
    joints = [
        _Joint(place[one], place[two], np.array(normal)) for one, two, *normal in _touching_voussoirs(session)
    ]
    free = [joint for joint in joints if not foot[joint.first] and not foot[joint.second]]
    ends = [joint for joint in joints if foot[joint.first] != foot[joint.second]]
    arches = []
    for group in _groups(free, [i for i in range(len(stones)) if not foot[i]]):
        arch = _arch(group, free, ends, stones)
        if arch is not None:
            arches.append(arch)
    return sorted(arches, key=lambda arch: min(stone.entity for stone in arch.stones))


def _names(cls: type[Entity]) -> list[str]:
    return [kind_of(one) for one in kinds().values() if issubclass(one, cls)]


def _touching_voussoirs(session: Session) -> Iterator[Any]:
    """Subject, object and normal of the joints between voussoirs."""
    subject, other = aliased(Entity), aliased(Entity)
    names = _names(Voussoir)
    yield from session.execute(
        select(Relation.subject_id, Relation.object_id, Relation.nx, Relation.ny, Relation.nz)
        .join(subject, subject.id == Relation.subject_id)
        .join(other, other.id == Relation.object_id)
        .where(
            subject.kind.in_(names),
            other.kind.in_(names),
            Relation.kind.in_(("rests_on", "beside")),
            Relation.superseded_id.is_(None),
            Relation.nx.is_not(None),
        )
        .order_by(Relation.subject_id, Relation.object_id)
    )


def _groups(joints: Sequence[_Joint], members: Sequence[int]) -> list[list[int]]:
    """Stones that hang together, each group and all of them in the order of their numbers."""
    parent = {i: i for i in members}

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for joint in joints:
        if joint.first in parent and joint.second in parent:
            one, two = root(joint.first), root(joint.second)
            parent[max(one, two)] = min(one, two)
    groups: dict[int, list[int]] = defaultdict(list)
    for i in members:
        groups[root(i)].append(i)
    return list(groups.values())


def _arch(
    group: Sequence[int], joints: Sequence[_Joint], ends: Sequence[_Joint], stones: StoneColumns
) -> Arch | None:
    """The arch of stones that hang together; None if they make none: one stone, or a web of a vault."""
    mean = stones.normals[list(group)].mean(axis=0)
    if not float(np.linalg.norm(mean)) >= _ONE_WAY:
        return None
    view = _View(mean / np.linalg.norm(mean), stones.centres)
    inside = set(group)
    mine = [joint for joint in joints if joint.first in inside]
    within, centre = _within_rings(group, mine, view)
    rows = [row for ring in _groups(within, group) if (row := _row_of(ring, within, view)) is not None]
    if sum(len(row) for row in rows) < len(group):
        return None
    rows.sort(key=lambda row: float(np.linalg.norm(view.flat[row] - centre, axis=1).mean()))
    found: dict[int, ArchStone] = {}
    for number, row in enumerate(rows, start=1):
        for stone in _placed(number, row, [*within, *ends], set(group), stones, view):
            found.setdefault(stone.entity, stone)
    return Arch(tuple(found.values())) if len(found) >= _FEWEST else None


class _View:
    """What one sees who looks at an arch along its axis.

    Attributes
    ----------
    right, up : (3,) unit vectors across the axis
    flat : (n, 2) centroids of all stones along these [m]
    """

    def __init__(self, axis: Array, centres: Array) -> None:
        across = np.array([-axis[1], axis[0], 0.0])
        if np.linalg.norm(across) < 1e-6:  # seen from below or above, any direction will do
            across = np.array([1.0, 0.0, 0.0])
        self.right = across / np.linalg.norm(across)
        self.up = np.cross(axis, self.right)
        self.flat = self.project(centres - np.nanmean(centres, axis=0))

    def project(self, vectors: Array) -> Array:
        """Components (…, 2) to the right and up."""
        out: Array = vectors @ np.column_stack([self.right, self.up])
        return out


def _within_rings(group: Sequence[int], joints: Sequence[_Joint], view: _View) -> tuple[list[_Joint], Array]:
    """The joints that the rings cross, and the centre about which they turn.

    The centre of the circle through the stones tells the joints apart well enough to find a better one: the
    place that is nearest to the planes of all joints within rings.
    """
    places = view.flat[list(group)]
    centre = _circle_centre(places)
    degrees = Counter(i for joint in joints for i in (joint.first, joint.second))
    if max(degrees.values(), default=0) <= 2 and len(joints) < len(group):
        return list(joints), centre  # one row, however its centre lies
    middle = np.array([0.5 * (view.flat[one.first] + view.flat[one.second]) for one in joints])
    normal = view.project(np.array([joint.normal for joint in joints]))
    for _ in range(_ROUNDS):
        ray = middle - centre
        ray /= np.maximum(np.linalg.norm(ray, axis=1), 1e-12)[:, None]
        crossing = np.abs((normal * ray).sum(axis=1)) <= _CROSSED
        if crossing.sum() < 2:
            break
        rows = normal[crossing]
        centre = np.linalg.lstsq(rows, (rows * middle[crossing]).sum(axis=1), rcond=1e-6)[0]
    return [joint for joint, is_within in zip(joints, crossing, strict=True) if is_within], centre


def _circle_centre(places: Array) -> Array:
    """Centre (2,) of the circle through places (n, 2), by linear least squares (Kåsa 1976)."""
    mean = places.mean(axis=0)
    local = places - mean
    rows = np.column_stack([2.0 * local, np.ones(len(local))])
    solution = np.linalg.lstsq(rows, (local**2).sum(axis=1), rcond=1e-9)[0]
    out: Array = mean + solution[:2]
    return out


def _row_of(ring: Sequence[int], joints: Sequence[_Joint], view: _View) -> list[int] | None:
    """The stones of a ring in their row, from left to right; None if they branch.

    A ring that is closed begins with its lowest stone.
    """
    inside = set(ring)
    beside: dict[int, list[int]] = {i: [] for i in ring}
    for joint in joints:
        if joint.first in inside and joint.second in inside:
            beside[joint.first].append(joint.second)
            beside[joint.second].append(joint.first)
    if max(len(others) for others in beside.values()) > 2:
        return None
    ends = [i for i in ring if len(beside[i]) < 2]
    closed = not ends
    start = min(ring if closed else ends, key=lambda i: view.flat[i, 1 if closed else 0])
    row, seen = [start], {start}
    while following := [i for i in beside[row[-1]] if i not in seen]:
        row.append(max(following, key=lambda i: view.flat[i, 0]))
        seen.add(row[-1])
    return row


def _placed(
    number: int,
    row: Sequence[int],
    joints: Sequence[_Joint],
    group: set[int],
    stones: StoneColumns,
    view: _View,
) -> Iterator[ArchStone]:
    """The stones of a ring and its springers, from left to right."""
    feet: tuple[list[int], list[int]] = ([], [])
    for end, joint in ((end, joint) for end in {row[0], row[-1]} for joint in joints):
        pair = {joint.first, joint.second}
        if end in pair and not pair <= group:
            (foot,) = pair - {end}
            right = view.flat[foot, 0] > view.flat[end, 0] if len(row) == 1 else end == row[-1]
            feet[int(right)].append(foot)
    left, right = (sorted(set(side)) for side in feet)
    ranked = [(i, 1) for i in left]
    ranked += [(i, rank) for rank, i in enumerate(row, start=2 if left else 1)]
    ranked += [(i, len(row) + (2 if left else 1)) for i in right]
    place = dict(ranked)
    for i, rank in ranked:
        before = _mean_normal(i, rank - 1, place, joints, view)
        after = _mean_normal(i, rank + 1, place, joints, view)
        angle = None if before is None or after is None or i in left or i in right else _turn(before, -after)
        yield ArchStone(int(stones.ids[i]), number, rank, angle)


def _mean_normal(
    stone: int, rank: int, place: Mapping[int, int], joints: Sequence[_Joint], view: _View
) -> Array | None:
    """Normal towards a stone of its joints with the stones of a rank, seen along the axis; None without any."""
    found = np.zeros(3)
    for joint in joints:
        if joint.first == stone and place.get(joint.second) == rank:
            found = found + joint.normal
        elif joint.second == stone and place.get(joint.first) == rank:
            found = found - joint.normal
    return view.project(found) if found.any() else None


def _turn(one: Array, other: Array) -> float:
    """Angle between two directions of the plane [rad]."""
    return float(np.arctan2(abs(one[0] * other[1] - one[1] * other[0]), one @ other))


def arch_parts(session: Session, arches: Sequence[Arch]) -> list[Part]:
    """The arches as structures; one that shares most of its stones with an arch of the database keeps its code."""
    number = {stone.entity: i for i, arch in enumerate(arches) for stone in arch.stones}
    votes: Counter[tuple[int, str]] = Counter()
    known = (
        select(Membership.entity_id, Structure.code)
        .join(Structure, Structure.id == Membership.structure_id)
        .where(
            Structure.kind == "arch",
            Structure.superseded_id.is_(None),
            Membership.superseded_id.is_(None),
            Membership.declared.is_(False),
        )
    )
    for entity, code in session.execute(known):
        if entity in number:
            votes[number[entity], code] += 1
    codes: dict[int, str] = {}
    for (i, code), _ in sorted(votes.items(), key=lambda vote: (-vote[1], vote[0])):
        if i not in codes and code not in codes.values():
            codes[i] = code
    taken = {*codes.values(), *session.scalars(select(Structure.code).where(Structure.code.like("arch %")))}
    fresh = (code for k in count(1) if (code := f"arch {k}") not in taken)
    return [
        Part(
            "arch",
            codes[i] if i in codes else next(fresh),
            None,
            None,
            tuple(stone.entity for stone in arch.stones),
            tuple(stone.rank for stone in arch.stones),
        )
        for i, arch in enumerate(arches)
    ]
