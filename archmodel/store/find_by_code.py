"""Search for entities and structures by code; errors name the nearest codes."""

import difflib
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from archmodel.store.bulk import batches
from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import Correction, Document, Material, Phase
from archmodel.tables.structures import Structure
from ground.errors import UsageError

T = TypeVar("T", Material, Phase, Document, Structure)

MAX_CANDIDATES = 1000
"""Most codes among which to search for one like a mistyped code."""

SHOWN = 12
"""Names that an error lists where none is like what was written."""


@dataclass(frozen=True)
class Subjects:
    """Subjects of a statement.

    Attributes
    ----------
    entities, structures : their numbers in the database
    """

    entities: tuple[int, ...] = ()
    structures: tuple[int, ...] = ()

    def __len__(self) -> int:
        return len(self.entities) + len(self.structures)

    def batches(self) -> Iterator[tuple[str, list[int]]]:
        """Yield the column of statements that names the subjects, and their numbers, a batch at a time."""
        for owner, numbers in (("entity_id", self.entities), ("structure_id", self.structures)):
            for batch in batches(numbers):
                yield owner, batch


def subjects(session: Session, stones: Iterable[str] = (), structures: Iterable[str] = ()) -> Subjects:
    """Find stones and structures by their codes; each counts once.

    Raises
    ------
    UsageError
        if there is no such stone or structure; names the nearest codes
    """
    return Subjects(
        tuple(entity_numbers(session, list(stones)).values()),
        tuple(structure_numbers(session, list(structures)).values()),
    )


def entity_numbers(session: Session, codes: Sequence[str]) -> dict[str, int]:
    """Return the primary keys of entities by code, in the order of the codes."""
    return _numbers(session, codes, Entity)


def structure_numbers(session: Session, codes: Sequence[str]) -> dict[str, int]:
    """Return the primary keys of the structures that are held now, by code, in the order of the codes."""
    return _numbers(session, codes, Structure, Structure.superseded_id.is_(None))


def _numbers(
    session: Session,
    codes: Sequence[str],
    cls: type[Entity] | type[Structure],
    *conditions: ColumnElement[bool],
) -> dict[str, int]:
    codes = [unicodedata.normalize("NFC", code) for code in codes]
    found: dict[str, int] = {}
    for batch in batches(dict.fromkeys(codes)):
        rows = session.execute(select(cls.code, cls.id).where(cls.code.in_(_typable(batch)), *conditions))
        found.update((code, number) for code, number in rows)
    for code in codes:
        if code not in found:
            raise no_such_code(session, code, cls.code)
    return {code: found[code] for code in codes}


def no_such_code(session: Session, code: str, *columns: InstrumentedAttribute[str]) -> UsageError:
    """Return the error for a code that is in none of the columns, the first of which gives the kind of thing."""
    things = "stone" if columns[0].class_ is Entity else "structure"
    if not code.isprintable():
        remedy = "list the codes by: moma query entity"
        return UsageError(f"{code[:40]!a} is not a {things}'s code", remedy=remedy)
    what = f"there is no {things} {code[:40]!r} in the database"
    if Entity.code in columns and (renamed := _renamed(session, code)) is not None:
        return UsageError(what, remedy=f"it is called {renamed} now")
    known: list[str] = []
    for column in columns:
        alike = select(column).where(column.istartswith(code[:1], autoescape=True)).limit(MAX_CANDIDATES)
        known += session.scalars(alike)
    near = difflib.get_close_matches(code[:40], known, n=3, cutoff=0.5)
    remedy = f"did you mean {' or '.join(near)}?" if near else "list the codes by: moma query entity"
    return UsageError(what, remedy=remedy)


def _typable(codes: Iterable[str]) -> list[str]:
    """Return the codes that can be stored: PostgreSQL refuses some unprintable characters even as values."""
    return [code for code in codes if code.isprintable()]


def _renamed(session: Session, code: str) -> str | None:
    """Return the present code of the entity that had this one before a correction."""
    rows = session.execute(
        select(Correction.before, Entity.code)
        .join(Correction.entity)
        .where(Correction.attribute == "code")
        .order_by(Correction.id.desc())
    )
    return next((now for before, now in rows if before == code), None)


def held_named(session: Session, cls: type[T], name: str) -> T:
    """Return the material, phase, document or structure of this name or code that is held now.

    Raises
    ------
    UsageError
        if there is none; names the nearest ones
    """
    found = held_or_none(session, cls, name)
    if found is not None:
        return found
    column = _name_column(cls)
    known = sorted(session.scalars(select(column).where(cls.superseded_id.is_(None)).limit(MAX_CANDIDATES)))
    near = difflib.get_close_matches(name[:40], known, n=3, cutoff=0.5)
    thing = cls.__name__.lower()
    remedy = f"declare it first; there is no {thing} yet"
    if near:
        remedy = f"did you mean {' or '.join(near)}?"
    elif known:
        remedy = (
            f"declare it first; known are {', '.join(known[:SHOWN])}{', …' if len(known) > SHOWN else ''}"
        )
    raise UsageError(f"there is no {thing} {name[:40]!r}", remedy=remedy)


def held_or_none(session: Session, cls: type[T], name: str) -> T | None:
    """Return what `held_named` finds, or None."""
    name = unicodedata.normalize("NFC", name)
    if not name.isprintable():
        return None
    return session.scalar(select(cls).where(_name_column(cls) == name, cls.superseded_id.is_(None)))


def _name_column(cls: type[Material | Phase | Document | Structure]) -> InstrumentedAttribute[str]:
    column: InstrumentedAttribute[str] = cls.name if issubclass(cls, Material | Phase) else cls.code
    return column
