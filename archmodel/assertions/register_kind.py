"""Registration of a user's own kind of stone or structure in a database."""

import re
from collections.abc import Mapping

from sqlalchemy.orm import Session

from archmodel.assertions.canons import check_canon
from archmodel.assertions.validation import checked_label, checked_text
from archmodel.query.attributes import ATTRIBUTES
from archmodel.query.functions.registry import FUNCTIONS, STRUCTURE_FUNCTIONS
from archmodel.query.tokens import KEYWORDS
from archmodel.store.revisions import RowCounts
from archmodel.tables.base import StoneAttribute
from archmodel.tables.entities import Entity, kinds, own_attributes
from archmodel.tables.entries import Entry
from archmodel.tables.hierarchy import kind_among, kind_chain, kind_of
from archmodel.tables.registered import NO_ATTRIBUTES, RegisteredKind, all_kinds, declare_registered
from ground.errors import QueryError, UsageError

MAX_LEVELS = 20
"""Most kinds from the most general one down to the most particular."""

_NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")


def register_kind(
    session: Session,
    entry: Entry,
    name: str,
    parent: str,
    definition: str,
    *,
    canon: str | None = None,
    attributes: Mapping[str, tuple[str | None, str]] | None = None,
) -> RowCounts:
    """Register a kind in this database; it is a class of the hierarchy from now on.

    Parameters
    ----------
    name : in lower case, with _ between words
    parent : the kind that it is a case of, of stones or of structures
    definition : one sentence: one word, one role
    canon : canonical proportions, as a query expression; None: those of the parent
    attributes : of its own, by name: unit ("-" for numbers without one, None for texts) and definition;
        kinds of structures have none

    Raises
    ------
    UsageError
        if the name is taken, the parent unknown, an attribute is named like another one, or a kind of structure
        has attributes
    QueryError
        if the canon is no expression, or asks for what is not known
    """
    declare_registered(session)
    above = kind_among(all_kinds(), parent)
    if len(kind_chain(above)) >= MAX_LEVELS:
        remedy = "make it a case of a kind that is less particular"
        raise UsageError(f"{name} is a case of a case, {MAX_LEVELS} times over", remedy=remedy)
    given = {key: (unit, definition.strip()) for key, (unit, definition) in (attributes or {}).items()}
    row = RegisteredKind(
        name=_checked_name("a kind", name),
        parent=kind_of(above),
        definition=" ".join(str(checked_text("definition", definition)).split()),
        canon=checked_text("canon", canon),
        attributes=given,
        entry_id=entry.id,
    )
    known = session.get(RegisteredKind, name)
    if known is not None:
        _refuse_changes(known, row)
        return RowCounts(unchanged=1)
    if name in all_kinds():
        raise UsageError(f"there is a kind {name} already", remedy="give yours another name")
    if issubclass(above, Entity):
        _check_attributes(given, own_attributes(above))
    elif given:
        raise UsageError(f"{name} is {NO_ATTRIBUTES}", remedy="leave out attributes")
    _store(session, row)
    return RowCounts(new=1)


def _refuse_changes(registered: RegisteredKind, row: RegisteredKind) -> None:
    """Refuse a kind that is registered with another definition, or with other proportions."""
    before, now = registered.says(), row.says()
    if before == now:
        return
    if (*before[:3], *before[4:]) == (*now[:3], *now[4:]):
        what = f"the kind {row.name} is registered already, with other canonical proportions"
        remedy = f'change these alone: [[canon]] kind = "{row.name}", proportions = "…"'
        raise UsageError(what, remedy=remedy)
    remedy = "give the new one another name; definitions of kinds do not change"
    raise UsageError(f"the kind {row.name} is registered already, with another definition", remedy=remedy)


def _store(session: Session, row: RegisteredKind) -> None:
    """Store a kind whose canon is an expression of what its stones have; otherwise leave no trace of it."""
    try:
        with session.begin_nested():
            session.add(row)
            session.flush()
            declare_registered(session)
            if row.canon is not None:
                check_canon(session, all_kinds()[row.name], row.canon)
    except QueryError:
        declare_registered(session)
        raise


def _check_attributes(
    given: Mapping[str, tuple[str | None, str]], inherited: Mapping[str, StoneAttribute]
) -> None:
    """Refuse an attribute without a name of its own, for which a query could not ask."""
    # what the classes call their own members (own, entry, metadata, …) would be written over
    built_in = [name for cls in kinds().values() if cls.__users__ is None for name in dir(cls)]
    taken = {*ATTRIBUTES, *built_in, *inherited, *KEYWORDS, *FUNCTIONS, *STRUCTURE_FUNCTIONS}
    units = {one.name: one.unit for cls in kinds().values() for one in cls.__own__}
    for name, (unit, definition) in given.items():
        _checked_name("an attribute", name)
        checked_text(f"definition of {name}", definition)
        if unit is not None:
            checked_label(f"unit of {name}", unit)
        if name in taken:
            remedy = "give it another name"
            raise UsageError(f"{name} means something already", remedy=remedy)
        if name in units and units[name] != unit:
            what = f"{name} [{unit or 'text'}] is an attribute of another kind, in {units[name] or 'text'}"
            raise UsageError(what, remedy="give it the same unit, or another name")


def _checked_name(thing: str, name: str) -> str:
    if not _NAME.fullmatch(name) or len(name) > 40:
        remedy = "write it in small letters a–z and digits, with _ between words, e.g. corner_merlon"
        raise UsageError(f"{name[:40]!a} is not the name of {thing}", remedy=remedy)
    return name
