"""Load paths: all stones on which one rests, directly or through others; or, upwards, all that rest on it."""

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from sqlalchemy import Row, and_, literal, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from archmodel.entities import Entity
from archmodel.entries import held_at
from archmodel.finding import no_such_code
from archmodel.relations import Relation

__all__ = ["LoadPath", "LoadPathStone", "load_path", "place_of"]


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


def load_path(session: Session, code: str, *, up: bool = False, as_of: int | None = None) -> LoadPath:
    """All stones on which one rests, directly or through others; or, upwards, all that rest on it.

    Parameters
    ----------
    session : reading or writing
    code : of the stone
    up : what it carries, instead of what carries it
    as_of : number of an entry; None: what is held now
    """
    me = place_of(session, code).id
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


def place_of(session: Session, code: str) -> Row[int, float | None, float | None, float | None]:
    """Number and centroid of a stone."""
    row = None
    if code.isprintable():
        row = session.execute(
            select(Entity.id, Entity.x, Entity.y, Entity.z).where(Entity.code == code)
        ).one_or_none()
    if row is None:
        raise no_such_code(session, code, Entity.code)
    return row
