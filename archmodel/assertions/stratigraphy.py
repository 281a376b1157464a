"""Stratigraphic relations: stated, withdrawn, and refused where a unit would be later than itself."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sqlalchemy import insert, select, update
from sqlalchemy.orm import Session

from archmodel.assertions.statements import PLAIN, Remark, remark_row
from archmodel.assertions.validation import checked_choice, checked_label, checked_text
from archmodel.store.bulk import batches
from archmodel.store.find_by_code import Subjects
from archmodel.store.revisions import RowCounts, end_rows, table_of
from archmodel.stratigraphy.graphml import DrawnUnit
from archmodel.stratigraphy.order import check_order
from archmodel.stratigraphy.stored import load_links
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE, SYMMETRIC, Stratigraphy
from archmodel.tables.structures import StratigraphicUnit, Structure
from ground.errors import UsageError

_FORWARD = {inverse: name for name, inverse in INVERSE.items()}
_COLUMNS = ("entity_id", "structure_id", "relation", "object_entity_id", "object_structure_id")
_Key = tuple[int | None, int | None, str, int | None, int | None]

Thing = tuple[int | None, int | None]
"""Number of a stone, or of a structure."""


def relation_named(name: str) -> tuple[str, bool]:
    """Return a stratigraphic relation, and whether the name is that of its inverse.

    Raises
    ------
    UsageError
        naming the nearest relations
    """
    checked_choice("stratigraphic relation", name, (*DEFINITIONS, *_FORWARD))
    return (name, False) if name in DEFINITIONS else (_FORWARD[name], True)


def subjects_named(session: Session, codes: Iterable[str]) -> dict[str, Thing]:
    """Return the structures, and stones, among some codes; those that are neither are left out."""
    things: dict[str, Thing] = {}
    for batch in batches(dict.fromkeys(code for code in codes if code.isprintable())):
        for code, number in session.execute(select(Entity.code, Entity.id).where(Entity.code.in_(batch))):
            things[code] = (number, None)
        units = select(Structure.code, Structure.id).where(
            Structure.code.in_(batch), Structure.superseded_id.is_(None)
        )
        for code, number in session.execute(units):
            things[code] = (None, number)
    return things


def subjects_of(things: Iterable[Thing]) -> Subjects:
    """Return stones and structures as the subjects of a statement."""
    pairs = list(things)
    stones = tuple(stone for stone, _ in pairs if stone is not None)
    return Subjects(stones, tuple(structure for _, structure in pairs if structure is not None))


def declare_units(
    session: Session, entry: Entry, codes: Sequence[str], drawn: Mapping[str, DrawnUnit] | None = None
) -> RowCounts:
    """Declare stratigraphic units that are neither stones nor structures yet.

    Parameters
    ----------
    drawn : titles of units, and the units that they are parts of, which exist or are among the codes
    """
    drawn = drawn or {}
    rows = [
        {"code": checked_label("code", code), "kind": StratigraphicUnit.__mapper__.polymorphic_identity}
        | {"entry_id": entry.id, "title": checked_text("title", drawn[code].title) if code in drawn else None}
        for code in dict.fromkeys(codes)
    ]
    for batch in batches(rows):
        session.execute(insert(table_of(Structure)), list(batch))
    parents = {code: parent for code in codes if code in drawn and (parent := drawn[code].parent) is not None}
    numbers = subjects_named(session, {*parents, *parents.values()})
    for code, parent in parents.items():
        number, above = numbers[code][1], numbers[parent][1]
        if above is not None:
            table = table_of(Structure)
            session.execute(update(table).where(table.c.id == number).values(parent_id=above))
    return RowCounts(new=len(rows))


def say_stratigraphy(
    session: Session,
    entry: Entry,
    relations: Iterable[tuple[Thing, str, Thing]],
    remark: Remark = PLAIN,
) -> RowCounts:
    """State relations between units and stones.

    Parameters
    ----------
    relations : subject, name of the relation or of its inverse, object

    Raises
    ------
    UsageError
        if a unit would be in relation to itself, or later than itself by what this author states; names the loop
    """
    keys = list(dict.fromkeys(_key(*relation) for relation in relations))
    stated = _held(session, entry.author, keys)
    details = remark_row(session, entry, remark) | {"kind": Stratigraphy.__kind__, "entry_id": entry.id}
    rows = [dict(zip(_COLUMNS, key, strict=True)) | details for key in keys if key not in stated]
    for batch in batches(rows):
        session.execute(insert(table_of(Stratigraphy)), list(batch))
    if rows:
        check_order([link for link in load_links(session) if link.author == entry.author])
    return RowCounts(new=len(rows), unchanged=len(keys) - len(rows))


def withdraw_stratigraphy(
    session: Session, entry: Entry, relations: Iterable[tuple[Thing, str, Thing]]
) -> RowCounts:
    """Withdraw relations that the author of the entry states; those of any author if this one states none.

    Raises
    ------
    UsageError
        if nobody states any of them
    """
    keys = list(dict.fromkeys(_key(*relation) for relation in relations))
    stated = _held(session, entry.author, keys) or _held(session, None, keys, anybody=True)
    if not stated:
        raise UsageError("there is no such stratigraphic relation to withdraw", remedy="see: moma show CODE")
    for batch in batches(list(stated.values())):
        end_rows(session, entry, Stratigraphy, list(batch))
    return RowCounts(withdrawn=len(stated))


def _key(subject: Thing, name: str, target: Thing) -> _Key:
    relation, inverse = relation_named(name)
    if subject == target:
        raise UsageError(f"a unit would be {name} itself", remedy="name two units")
    if inverse or (relation in SYMMETRIC and _order(target) < _order(subject)):
        subject, target = target, subject
    return (*subject, relation, *target)


def _order(thing: Thing) -> tuple[int, int]:
    return (0, thing[0]) if thing[0] is not None else (1, thing[1] or 0)


def _held(
    session: Session, author: str | None, keys: Sequence[_Key], anybody: bool = False
) -> Mapping[_Key, int]:
    """Return the numbers of the statements that an author, or anybody, holds."""
    table = table_of(Stratigraphy)
    rows = select(table.c.id, table.c.author, *(table.c[name] for name in _COLUMNS)).where(
        table.c.kind == Stratigraphy.__kind__, table.c.superseded_id.is_(None)
    )
    wanted = set(keys)
    stated: dict[Any, int] = {}
    for number, voice, *key in session.execute(rows):
        if tuple(key) in wanted and (anybody or voice == author):
            stated[tuple(key)] = number
    return stated
