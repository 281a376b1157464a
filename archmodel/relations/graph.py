"""Walks along relations: loads above and below a stone, its neighbours, the courses.

Each question is a statement or two, whatever the size of the building; `archmodel.database.as_known` asks them of an
earlier day. A relation that is both computed and declared counts once.
"""

import math
from dataclasses import dataclass
from itertools import groupby

from sqlalchemy import ColumnElement, func, select, union_all
from sqlalchemy.orm import Session, aliased

from archmodel.relations.load_paths import place_of
from archmodel.store.find_by_code import no_such_code
from archmodel.tables.entities import Entity
from archmodel.tables.entries import held_at
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.relations import INVERSE, Membership, Relation
from archmodel.tables.structures import Course, Structure
from ground.errors import UsageError


@dataclass(frozen=True)
class Neighbour:
    """Stone in relation to the given one.

    Attributes
    ----------
    code, kind : of the stone
    relation : what the one that was asked for does: rests_on it, supports it, is beside it, …
    area : that they share, all of it if they touch at several places; None if it was only declared [m²]
    gap : mean width of the joint; None if it was only declared [m]
    declared : somebody says so
    """

    code: str
    kind: str
    relation: str
    area: float | None
    gap: float | None
    declared: bool


@dataclass(frozen=True)
class CourseStones:
    """Course with its stones.

    Attributes
    ----------
    code, zone, number : of the course
    stones : codes of its stones, from left to right as one sees them who stands before the wall
    """

    code: str
    zone: str | None
    number: int | None
    stones: tuple[str, ...]


@dataclass(frozen=True)
class NearStone:
    """Stone near the given one.

    Attributes
    ----------
    code, kind : of the stone
    distance : of the centroids of their solids [m]
    """

    code: str
    kind: str
    distance: float


def carries(session: Session, code: str) -> tuple[Neighbour, ...]:
    """List the stones that rest directly on this one.

    Raises
    ------
    UsageError
        if there is no stone of this code or no such entry, here as in what follows; names the nearest codes
    """
    return tuple(neighbour for neighbour in neighbours(session, code) if neighbour.relation == "supports")


def carried_by(session: Session, code: str) -> tuple[Neighbour, ...]:
    """List the stones on which this one rests directly."""
    return tuple(neighbour for neighbour in neighbours(session, code) if neighbour.relation == "rests_on")


def neighbours(session: Session, code: str) -> tuple[Neighbour, ...]:
    """List every stone in any relation to this one, by relation and code.

    Parameters
    ----------
    session : reading or writing
    code : of the stone
    """
    me = place_of(session, code).id
    sides = ((Relation.subject_id, Relation.object_id), (Relation.object_id, Relation.subject_id))
    rows = union_all(
        *(
            select(Entity.code, Entity.kind, Relation.kind.label("relation"), Relation.subject_id)
            .add_columns(Relation.area, Relation.gap, Relation.declared)
            .join(Relation, theirs == Entity.id)
            .where(mine == me, held_at(Relation))
            for mine, theirs in sides
        )
    )
    found: dict[tuple[str, str], Neighbour] = {}
    for name, kind, relation, subject, area, gap, declared in session.execute(rows):
        seen = relation if subject == me else INVERSE[relation]
        before = found.get((seen, name))
        if before is not None:  # computed and declared: the numbers are those of the geometry
            area, gap = (area, gap) if before.area is None else (before.area, before.gap)
            declared = declared or before.declared
        found[seen, name] = Neighbour(name, kind, seen, area, gap, declared)
    return tuple(found[key] for key in sorted(found))


def courses_in_order(session: Session, zone: str | None = None) -> tuple[CourseStones, ...]:
    """List the courses by zone and number, each with its stones from left to right.

    Parameters
    ----------
    session : reading or writing
    zone : code of the zone; None: all, the stones without a zone first

    Raises
    ------
    UsageError
        if there is no such zone; names the nearest ones
    """
    part = aliased(Structure)
    statement = (
        select(Structure.code, part.code, Structure.number, Entity.code)
        .join(Membership, Membership.structure_id == Structure.id)
        .join(Entity, Entity.id == Membership.entity_id)
        .outerjoin(part, part.id == Structure.parent_id)
        .where(
            Structure.kind.in_(kinds_below(Course)),
            Structure.superseded_id.is_(None),
            held_at(Membership),
        )
        .order_by(
            func.coalesce(part.code, ""), Structure.number, Structure.code, Membership.rank, Membership.id
        )
    )
    if zone is not None:
        statement = statement.where(part.code == _zone(session, zone))
    rows = session.execute(statement)
    return tuple(
        CourseStones(code, within, number, tuple(dict.fromkeys(row[3] for row in members)))
        for (code, within, number), members in groupby(rows, key=lambda row: (row[0], row[1], row[2]))
    )


def stones_near(session: Session, code: str, distance: float) -> tuple[NearStone, ...]:
    """List the stones with centroids within a distance of that of one, nearest first.

    Parameters
    ----------
    session : reading or writing
    code : of the stone, which is not among those found
    distance : [m]

    Raises
    ------
    UsageError
        if there is no such stone, nothing is known of its place, or the distance is no distance
    """
    if not 0.0 <= distance < math.inf:
        raise UsageError(f"a distance of {distance} m", remedy="give one that is zero or more")
    me = place_of(session, code)
    if me.x is None or me.y is None or me.z is None:
        raise UsageError("nothing is known of its place", where=code, remedy="measure it")
    squared: ColumnElement[float] = sum(
        ((column - place) * (column - place))
        for column, place in ((Entity.x, me.x), (Entity.y, me.y), (Entity.z, me.z))
    )
    rows = session.execute(
        select(Entity.code, Entity.kind, squared).where(
            Entity.x.between(me.x - distance, me.x + distance),
            Entity.y.between(me.y - distance, me.y + distance),
            Entity.z.between(me.z - distance, me.z + distance),
            Entity.id != me.id,
        )
    )
    found = [NearStone(name, kind, math.sqrt(far)) for name, kind, far in rows]
    return tuple(
        sorted((one for one in found if one.distance <= distance), key=lambda one: (one.distance, one.code))
    )


def _zone(session: Session, zone: str) -> str:
    held = select(Structure.id).where(Structure.code == zone, Structure.superseded_id.is_(None))
    if not zone.isprintable() or session.scalar(held) is None:
        raise no_such_code(session, zone, Structure.code)
    return zone
