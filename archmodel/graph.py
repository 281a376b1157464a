"""Walking along relations: what a stone carries and is carried by, its load path, its neighbours, the courses.

Each question is one statement, whatever the size of the building, and can be asked of what was known at an
earlier entry (`as_of`). A relation that is both computed and declared counts once.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

from sqlalchemy import ColumnElement, Row, and_, func, literal, or_, select
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased

from archmodel.entities import Entity
from archmodel.entries import held_at
from archmodel.finding import no_such_code
from archmodel.relations import INVERSE, Membership, Relation
from archmodel.structures import Structure
from moma.errors import UsageError

__all__ = [
    "CourseStones",
    "LoadPath",
    "LoadPathStone",
    "NearStone",
    "Neighbour",
    "carried_by",
    "carries",
    "courses_in_order",
    "load_path",
    "neighbours",
    "stones_near",
]


@dataclass(frozen=True)
class Neighbour:
    """A stone in relation to the one that was asked for.

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
class LoadPathStone:
    """A stone on a load path.

    Attributes
    ----------
    code, kind : of the stone
    course, zone : where it is
    level : the most joints through which the load comes to it, from 1, so that it comes after all stones of `through`
    through : codes of the stones of the path from which the load comes to it directly
    last : the load goes no further: nothing is known that it rests on, or that rests on it on the way up
    """

    code: str
    kind: str
    course: int | None
    zone: str | None
    level: int
    through: tuple[str, ...]
    last: bool


@dataclass(frozen=True)
class LoadPath:
    """All stones on which one rests, directly or through others; upwards, all that rest on it.

    Attributes
    ----------
    code : of the stone that was asked for
    direction : down or up
    stones : by level, and in the order of the survey within one
    """

    code: str
    direction: Literal["down", "up"]
    stones: tuple[LoadPathStone, ...]

    @property
    def levels(self) -> int:
        """How many joints lead to the farthest stone."""
        return max((stone.level for stone in self.stones), default=0)

    @property
    def last(self) -> tuple[LoadPathStone, ...]:
        """The stones where the path ends: on the way down, those that stand on the ground."""
        return tuple(stone for stone in self.stones if stone.last)


@dataclass(frozen=True)
class CourseStones:
    """A course with its stones.

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
    """A stone near another.

    Attributes
    ----------
    code, kind : of the stone
    distance : of the centroids of their solids [m]
    """

    code: str
    kind: str
    distance: float


def carries(session: Session, code: str, as_of: int | None = None) -> tuple[Neighbour, ...]:
    """The stones that rest directly on this one.

    Raises
    ------
    UsageError
        if there is no stone of this code, here as in what follows; names the nearest codes
    """
    return tuple(one for one in neighbours(session, code, as_of) if one.relation == "supports")


def carried_by(session: Session, code: str, as_of: int | None = None) -> tuple[Neighbour, ...]:
    """The stones on which this one rests directly."""
    return tuple(one for one in neighbours(session, code, as_of) if one.relation == "rests_on")


def neighbours(session: Session, code: str, as_of: int | None = None) -> tuple[Neighbour, ...]:
    """Every stone in any relation to this one, by relation and code.

    Parameters
    ----------
    session : reading or writing
    code : of the stone
    as_of : number of an entry; None: what is held now
    """
    me = _stone(session, code).id
    other = aliased(Entity)
    rows = session.execute(
        select(other.code, other.kind, Relation.kind, Relation.subject_id, Relation.area, Relation.gap)
        .add_columns(Relation.declared)
        .join(
            other,
            or_(
                and_(Relation.subject_id == me, other.id == Relation.object_id),
                and_(Relation.object_id == me, other.id == Relation.subject_id),
            ),
        )
        .where(or_(Relation.subject_id == me, Relation.object_id == me), held_at(Relation, as_of))
    )
    found: dict[tuple[str, str], Neighbour] = {}
    for name, kind, relation, subject, area, gap, declared in rows:
        seen = relation if subject == me else INVERSE[relation]
        before = found.get((seen, name))
        if before is not None:  # computed and declared: the numbers are those of the geometry
            area, gap = (area, gap) if before.area is None else (before.area, before.gap)
            declared = declared or before.declared
        found[seen, name] = Neighbour(name, kind, seen, area, gap, declared)
    return tuple(found[key] for key in sorted(found))


def load_path(session: Session, code: str, *, up: bool = False, as_of: int | None = None) -> LoadPath:
    """All stones on which one rests, directly or through others; or, upwards, all that rest on it.

    Parameters
    ----------
    session : reading or writing
    code : of the stone
    up : what it carries, instead of what carries it
    as_of : number of an entry; None: what is held now
    """
    me = _stone(session, code).id
    start, end = Relation.subject_id, Relation.object_id
    if up:
        start, end = end, start
    steps: dict[int, list[int]] = defaultdict(list)
    stones: dict[int, tuple[str, str, int | None, str | None]] = {}
    for before, after, name, kind, course, zone in _steps(session, me, start, end, as_of):
        if after not in steps[before]:  # else it is computed and declared
            steps[before].append(after)
        stones[after] = (name, kind, course, zone)
    levels = _levels(me, steps)
    codes = {number: facts[0] for number, facts in stones.items()} | {me: code}
    through: dict[int, list[str]] = defaultdict(list)
    for before in sorted(levels, key=lambda number: (levels[number], number)):
        for after in steps.get(before, ()):
            through[after].append(codes[before])
    return LoadPath(
        code,
        "up" if up else "down",
        tuple(
            LoadPathStone(*stones[number], levels[number], tuple(through[number]), not steps.get(number))
            for number in sorted(levels, key=lambda number: (levels[number], number))
            if number != me
        ),
    )


def _steps(
    session: Session,
    me: int,
    start: InstrumentedAttribute[int],
    end: InstrumentedAttribute[int],
    as_of: int | None,
) -> Iterable[Row[int, int, str, str, int | None, str | None]]:
    """Every step of every path from a stone, with the stone that it leads to; UNION ends circles."""
    reached = select(literal(me).label("id")).cte("reached", recursive=True)
    holds = and_(Relation.kind == "rests_on", held_at(Relation, as_of))
    reached = reached.union(select(end).join(reached, start == reached.c.id).where(holds))
    return session.execute(
        select(start, end, Entity.code, Entity.kind, Entity.course, Entity.zone)
        .join(reached, start == reached.c.id)
        .join(Entity, Entity.id == end)
        .where(holds)
        .order_by(start, end)
    )


def _levels(me: int, steps: dict[int, list[int]]) -> dict[int, int]:
    """Most steps to every stone that can be reached, so that each comes after all through which the load comes.

    Where stones bear one another in a circle, the one that the fewest steps lead to is taken to be the first.
    """
    fewest = _fewest_steps(me, steps)
    waiting = Counter(after for one in fewest for after in steps.get(one, ()) if after != me)
    levels, ready = {me: 0}, [me]
    left = {number: far for number, far in fewest.items() if number != me}
    while left or ready:
        if not ready:
            first = min(left, key=lambda number: (left[number], number))
            ready, waiting[first] = [first], 0
        one = ready.pop()
        left.pop(one, None)
        for after in steps.get(one, ()):
            if after in left:
                levels[after] = max(levels.get(after, 0), levels[one] + 1)
                waiting[after] -= 1
                if waiting[after] == 0:
                    ready.append(after)
    return levels


def _fewest_steps(me: int, steps: dict[int, list[int]]) -> dict[int, int]:
    found, front, level = {me: 0}, [me], 0
    while front:
        following = (after for one in front for after in steps.get(one, ()) if after not in found)
        front = list(dict.fromkeys(following))
        level += 1
        found.update(dict.fromkeys(front, level))
    return found


def courses_in_order(
    session: Session, zone: str | None = None, as_of: int | None = None
) -> tuple[CourseStones, ...]:
    """The courses by zone and number, each with its stones from left to right.

    Parameters
    ----------
    session : reading or writing
    zone : code of the zone; None: all, the stones without a zone first
    as_of : number of an entry; None: what is held now

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
        .where(Structure.kind == "course", held_at(Structure, as_of), held_at(Membership, as_of))
        .order_by(
            func.coalesce(part.code, ""), Structure.number, Structure.code, Membership.rank, Membership.id
        )
    )
    if zone is not None:
        statement = statement.where(part.code == _zone(session, zone, as_of))
    rows = session.execute(statement)
    return tuple(
        CourseStones(code, within, number, tuple(dict.fromkeys(row[3] for row in members)))
        for (code, within, number), members in groupby(rows, key=lambda row: (row[0], row[1], row[2]))
    )


def stones_near(session: Session, code: str, distance: float) -> tuple[NearStone, ...]:
    """The stones whose centroids are at most so far from that of one, nearest first.

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
    me = _stone(session, code)
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


def _stone(session: Session, code: str) -> Row[int, float | None, float | None, float | None]:
    """Number and centroid of a stone."""
    row = None
    if code.isprintable():
        row = session.execute(
            select(Entity.id, Entity.x, Entity.y, Entity.z).where(Entity.code == code)
        ).one_or_none()
    if row is None:
        raise no_such_code(session, code, Entity.code)
    return row


def _zone(session: Session, zone: str, as_of: int | None) -> str:
    held = select(Structure.id).where(Structure.code == zone, held_at(Structure, as_of))
    if not zone.isprintable() or session.scalar(held) is None:
        raise no_such_code(session, zone, Structure.code)
    return zone
