"""Zones and courses as structures, from the survey and from the order of stones along the wall."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import and_, or_, select
from sqlalchemy.orm import Session, aliased

from archmodel.arrays import Array, Ints
from archmodel.relations.store import Act, Changes, supersede
from archmodel.store.bulk import batches, insert_rows
from archmodel.store.stone_arrays import ENTITY, StoneColumns, id_conditions, joined, stone_columns
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Course, Structure, structure_kind_named

_ONE_WAY = 0.5  # length of the mean of the faces' directions in plan from which on they look one way
_LONG = 3.0  # a course so many times as long as wide is a wall, else it runs around a tower


@dataclass(frozen=True)
class StructurePart:
    """Structure with its members, from the survey or from the geometry.

    Attributes
    ----------
    kind, code : of the structure
    number : its place among its like; None if it has none
    parent : code of the structure that it is a part of; None if of none
    members : numbers of its entities
    ranks : their places in it, from 1; None where there is no order
    """

    kind: str
    code: str
    number: int | None
    parent: str | None
    members: tuple[int, ...]
    ranks: tuple[int | None, ...]


def course_code(zone: str | None, course: int) -> str:
    """Return the code of the structure of a course."""
    return f"course {course}" if zone is None else f"{zone}/course {course}"


def parts_of_survey(stones: StoneColumns) -> list[StructurePart]:
    """Return the zones and courses of some stones; members of a zone are its stones without a course.

    Parameters
    ----------
    stones : all stones of each zone and course that is among them
    """
    courses: dict[tuple[str | None, int], list[int]] = defaultdict(list)
    zones: dict[str, list[int]] = defaultdict(list)
    for i, (zone, course) in enumerate(zip(stones.zones, stones.courses, strict=True)):
        if zone is not None:
            zones[zone]  # a zone of which every stone has a course has no members of its own
        if course is not None:
            courses[zone, course].append(i)
        elif zone is not None:
            zones[zone].append(i)
    parts = [
        StructurePart("structure", zone, None, None, tuple(stones.ids[rows].tolist()), (None,) * len(rows))
        for zone, rows in sorted(zones.items())
    ]
    for zone, course in sorted(courses, key=lambda key: (key[0] or "", key[1])):
        rows = np.array(courses[zone, course])
        order = rows[along_the_wall(stones.centres[rows], stones.normals[rows])]
        ranks = tuple(range(1, len(rows) + 1))
        members = tuple(stones.ids[order].tolist())
        parts.append(StructurePart("course", course_code(zone, course), course, zone, members, ranks))
    return parts


def whole_courses(session: Session, entities: Collection[int]) -> StoneColumns:
    """Return all stones of the zones and courses to which some entities belong, or belonged until now."""
    places: set[tuple[str | None, int | None]] = set()
    zone = aliased(Structure)
    query = (
        select(zone.code, Structure.number)
        .join(Membership, Membership.structure_id == Structure.id)
        .outerjoin(zone, zone.id == Structure.parent_id)
        .where(
            Structure.kind.in_(kinds_below(Course)),
            Membership.superseded_id.is_(None),
            Membership.declared.is_(False),
        )
    )
    for condition in id_conditions(ENTITY.id, entities):
        places.update(
            (part, course)
            for part, course in session.execute(
                select(ENTITY.zone, ENTITY.course).where(condition).distinct()
            )
        )
    for condition in id_conditions(Membership.entity_id, entities):
        places.update((part, course) for part, course in session.execute(query.where(condition).distinct()))
    places.discard((None, None))
    return joined(
        [
            stone_columns(
                session, or_(*(and_(ENTITY.zone == part, ENTITY.course == course) for part, course in some))
            )
            for some in batches(sorted(places, key=lambda place: (place[0] or "", place[1] or 0)))
        ]
    )


def along_the_wall(centres: Array, normals: Array) -> Ints:
    """Order the stones of a course from left to right as seen from in front of the wall.

    Stones that look all ways lie around a tower: they are ordered to the right, counter-clockwise from above,
    from the first after the widest gap. Two facings of one wall are ordered along it together.

    Parameters
    ----------
    centres : (n, 3) centroids [m]; stones without one come last
    normals : (n, 3) of their faces; NaN where not known
    """
    finite = np.isfinite(centres).all(axis=1)
    place = np.full(len(centres), np.inf)
    flat = centres[finite, :2] - centres[finite, :2].mean(axis=0) if finite.any() else np.zeros((0, 2))
    looks = normals[np.isfinite(normals).all(axis=1), :2]
    mean = looks.mean(axis=0) if len(looks) else np.zeros(2)
    size = float(np.linalg.norm(mean))
    if size >= _ONE_WAY:
        place[finite] = flat @ np.array([-mean[1], mean[0]]) / size
    elif len(flat):
        _, spread, axes = np.linalg.svd(flat, full_matrices=False)
        if spread[0] >= _LONG * spread[-1]:
            axis = axes[0] * (1.0 if axes[0][np.abs(axes[0]).argmax()] > 0.0 else -1.0)
            place[finite] = flat @ axis
        else:
            place[finite] = _around(flat)
    return np.argsort(place, kind="stable")


def _around(flat: Array) -> Array:
    """Return the angles of places about their mean, counted from behind the widest gap between them."""
    angle = np.arctan2(flat[:, 1], flat[:, 0])
    ordered = np.sort(angle)
    gaps = np.diff(ordered, append=ordered[0] + 2.0 * np.pi)
    first = ordered[(int(gaps.argmax()) + 1) % len(ordered)]
    out: Array = (angle - first) % (2.0 * np.pi)
    return out


def store_parts(
    session: Session,
    parts: Sequence[StructurePart],
    act: Act,
    *,
    kinds: Iterable[str],
    among: Iterable[int] | None = None,
) -> tuple[Changes, Changes]:
    """Replace the computed structures and memberships of some kinds with those that were found.

    Structures that are held under a code are taken as they are; what was declared is left alone.

    Parameters
    ----------
    session : a writing session
    parts : structures, parents before their parts
    act : that they come with
    kinds : of structures, whose computed memberships are superseded if they are not among those found
    among : entities whose memberships are looked at; None: all

    Returns
    -------
    Changes of structures and of memberships
    """
    numbers, structures = _structures(session, parts, act)
    wanted = {
        (entity, numbers[part.code]): rank
        for part in parts
        for entity, rank in zip(part.members, part.ranks, strict=True)
    }
    looked_at = None if among is None else {*among, *(entity for entity, _ in wanted)}
    stored, declared = _held(session, tuple(kinds), looked_at)
    stay = {key for key, (_, rank) in stored.items() if key in wanted and wanted[key] == rank}
    supersede(session, Membership, [number for key, (number, _) in stored.items() if key not in stay], act)
    new = [key for key in wanted if key not in stay and key not in declared]
    if new:
        entry = act.id
        insert_rows(session, Membership, (_row(*key, wanted[key], entry) for key in new))
    return structures, Changes(len(new), len(stay), len(stored) - len(stay))


def _row(entity: int, structure: int, rank: int | None, entry: int) -> dict[str, object]:
    return {
        "entity_id": entity,
        "structure_id": structure,
        "rank": rank,
        "declared": False,
        "entry_id": entry,
        "superseded_id": None,
    }


def _structures(session: Session, parts: Sequence[StructurePart], act: Act) -> tuple[dict[str, int], Changes]:
    """Return the numbers of the structures by code; make those that are missing."""
    numbers: dict[str, int] = {}
    for batch in batches({code for part in parts for code in (part.code, part.parent) if code is not None}):
        query = select(Structure.code, Structure.id).where(
            Structure.code.in_(batch), Structure.superseded_id.is_(None)
        )
        numbers.update((code, number) for code, number in session.execute(query))
    missing = [part for part in parts if part.code not in numbers]
    for part in missing:
        made = structure_kind_named(part.kind)(
            code=part.code,
            number=part.number,
            parent_id=None if part.parent is None else numbers[part.parent],
            entry_id=act.id,
        )
        session.add(made)
        session.flush()
        numbers[part.code] = made.id
    return numbers, Changes(len(missing), len(parts) - len(missing), 0)


def _held(
    session: Session, kinds: tuple[str, ...], among: set[int] | None
) -> tuple[dict[tuple[int, int], tuple[int, int | None]], set[tuple[int, int]]]:
    """Return number and rank of the held computed memberships by entity and structure, and the declared ones."""
    stored: dict[tuple[int, int], tuple[int, int | None]] = {}
    declared: set[tuple[int, int]] = set()
    statement = (
        select(
            Membership.id,
            Membership.entity_id,
            Membership.structure_id,
            Membership.rank,
            Membership.declared,
        )
        .join(Structure, Structure.id == Membership.structure_id)
        .where(Membership.superseded_id.is_(None), Structure.kind.in_(kinds))
    )
    chosen = [statement]
    if among is not None:
        chosen = [statement.where(condition) for condition in id_conditions(Membership.entity_id, among)]
    for query in chosen:
        for number, entity, structure, rank, is_declared in session.execute(query):
            if is_declared:
                declared.add((entity, structure))
            else:
                stored[entity, structure] = (number, rank)
    return stored, declared
