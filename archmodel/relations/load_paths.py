"""Load paths: all stones on which one rests, directly or through others; or, upwards, all that rest on it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal

from sqlalchemy import CTE, ColumnElement, Row, and_, literal, select
from sqlalchemy.orm import Session

from archmodel.store.find_by_code import no_such_code
from archmodel.store.revisions import table_of
from archmodel.tables.entities import Entity
from archmodel.tables.relations import Relation


@dataclass(frozen=True, slots=True)  # slots: paths of 10,000 stones are usual, and each is made anew
class LoadPathStone:
    """Stone on a load path.

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
        """Number of joints to the farthest stone."""
        return max((stone.level for stone in self.stones), default=0)

    @property
    def last(self) -> tuple[LoadPathStone, ...]:
        """Stones where the path ends: on the way down, those that stand on the ground."""
        return tuple(stone for stone in self.stones if stone.last)


def load_path(session: Session, code: str, *, up: bool = False) -> LoadPath:
    """Return the load path of a stone down to the ground or, upwards, of all stones that rest on it.

    Parameters
    ----------
    session : reading or writing
    code : of the stone
    up : what it carries, instead of what carries it
    """
    me = place_of(session, code).id
    reached, holds, start, end = _reached(me, up)
    entity = table_of(Entity)
    facts = (entity.c.code, entity.c.kind, entity.c.course, entity.c.zone)
    edges = (
        select(start, end, *facts).join(reached, start == reached.c.id).join(entity, entity.c.id == end)
    ).where(holds)
    steps: dict[int, list[int]] = {}
    stones: dict[int, tuple[Any, ...]] = {me: (code, None, None, None)}
    for before, after, *known in session.execute(edges).all():
        following = steps.setdefault(before, [])
        if after not in following:  # else it is computed and declared
            following.append(after)
        stones[after] = tuple(known)
    levels = _levels(me, steps)
    order = sorted(levels, key=lambda number: (levels[number], number))
    through: dict[int, list[str]] = {number: [] for number in order}
    for before in order:
        for after in steps.get(before, ()):
            through[after].append(stones[before][0])
    return LoadPath(
        code,
        "up" if up else "down",
        tuple(
            LoadPathStone(
                name, kind, course, zone, levels[number], tuple(through[number]), number not in steps
            )
            for number, (name, kind, course, zone) in ((number, stones[number]) for number in order)
            if number != me
        ),
    )


def _reached(me: int, up: bool) -> tuple[CTE, ColumnElement[bool], ColumnElement[int], ColumnElement[int]]:
    """Select the stones on the path, the condition of its steps, and start and end of a step; UNION ends circles."""
    columns = table_of(Relation).c
    start, end = (columns.object_id, columns.subject_id) if up else (columns.subject_id, columns.object_id)
    holds = and_(columns.kind == "rests_on", columns.superseded_id.is_(None))
    reached = select(literal(me).label("id")).cte("reached", recursive=True)
    reached = reached.union(select(end).join(reached, start == reached.c.id).where(holds))
    return reached, holds, start, end


def _levels(me: int, steps: Mapping[int, Sequence[int]]) -> dict[int, int]:
    """Count the most steps to every stone on the path, so that each comes after all through which its load comes.

    Where stones bear one another in a circle, the one that the fewest steps lead to is taken to be the first.
    """
    waiting = Counter(chain.from_iterable(steps.values()))
    waiting.pop(me, None)
    levels, ready, fewest = {me: 0}, [me], None
    while ready:
        one = ready.pop()
        below = levels[one] + 1
        for after in steps.get(one, ()):
            if after in waiting:
                if below > levels.get(after, 0):
                    levels[after] = below
                waiting[after] -= 1
                if waiting[after] == 0:
                    del waiting[after]
                    ready.append(after)
        if waiting and not ready:
            fewest = fewest or _fewest_steps(me, steps)
            first = min(waiting, key=lambda number: (fewest[number], number))
            del waiting[first]
            ready.append(first)
    return levels


def _fewest_steps(me: int, steps: Mapping[int, Sequence[int]]) -> dict[int, int]:
    found, front, level = {me: 0}, [me], 0
    while front:
        level += 1
        following = (after for one in front for after in steps.get(one, ()) if after not in found)
        front = list(dict.fromkeys(following))
        found.update(dict.fromkeys(front, level))
    return found


def place_of(session: Session, code: str) -> Row[int, float | None, float | None, float | None]:
    """Return number and centroid of a stone."""
    row = None
    if code.isprintable():
        row = session.execute(
            select(Entity.id, Entity.x, Entity.y, Entity.z).where(Entity.code == code)
        ).one_or_none()
    if row is None:
        raise no_such_code(session, code, Entity.code)
    return row
