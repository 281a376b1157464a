"""Canonical proportions of kinds: stated, replaced and withdrawn."""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from archmodel.assertions.validation import checked_number, checked_text
from archmodel.query.attributes import Attribute, attributes_of
from archmodel.query.compile import condition, condition_in
from archmodel.query.grammar import AmountComparison, Call, Comparison, parse
from archmodel.query.scope import Context, StructureScope
from archmodel.query.structures import STRUCTURE_ATTRIBUTES
from archmodel.query.tokens import Token, complaint
from archmodel.store.revisions import RowCounts, end_rows, supersede, table_of
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, held_at
from archmodel.tables.hierarchy import kind_among, kind_of
from archmodel.tables.registered import Canon, all_kinds
from archmodel.tables.structures import Structure
from ground.errors import UsageError


def declare_canon(
    session: Session, entry: Entry, kind: str, proportions: str, tolerance: float | None = None
) -> RowCounts:
    """State the canonical proportions of a kind; they supersede those that were stated before.

    Parameters
    ----------
    kind : of stones or of structures, with its subkinds that have none of their own
    proportions : query expression over attributes
    tolerance : share of the canonical number by which it may be missed [-]; None: not stated

    Raises
    ------
    UsageError
        if there is no such kind, or an equation has no tolerance
    QueryError
        if the expression cannot be understood
    """
    cls = kind_among(all_kinds(), kind)
    text = str(checked_text("canon", proportions))
    allowed = checked_number("tolerance", tolerance, "-", above=0.0, below=1.0)
    check_canon(session, cls, text, allowed)
    current = _held(session, kind_of(cls))
    if current is not None and (current.proportions, current.tolerance) == (text, allowed):
        return RowCounts(unchanged=1)
    row = Canon(kind=kind_of(cls), proportions=text, tolerance=allowed)
    if current is not None:
        supersede(session, entry, current, row)
        return RowCounts(replaced=1)
    row.entry_id = entry.id
    session.add(row)
    session.flush()
    return RowCounts(new=1)


def withdraw_canon(session: Session, entry: Entry, kind: str) -> RowCounts:
    """Withdraw the canonical proportions of a kind; those that they superseded hold again.

    Proportions that came with the kind are withdrawn too: then those of the more general kind hold, if it has any.

    Raises
    ------
    UsageError
        if there is no such kind, or it has no proportions of its own
    """
    cls = kind_among(all_kinds(), kind)
    name = kind_of(cls)
    current, inherent = _held(session, name), cls.__dict__.get("__canon__")
    if current is None and inherent is None:
        ever = session.scalar(select(Canon.id).where(Canon.kind == name).limit(1))
        if ever is None:
            remedy = "withdraw those of the kind that states them; see: moma schema"
            raise UsageError(f"the kind {name} has no canonical proportions of its own", remedy=remedy)
        return RowCounts(unchanged=1)
    if current is not None and current.proportions is None:
        return RowCounts(unchanged=1)
    if current is None:
        session.add(Canon(kind=name, proportions=None, tolerance=None, entry_id=entry.id))
        session.flush()
        return RowCounts(withdrawn=1)
    earlier = current.supersedes_id
    end_rows(session, entry, Canon, [current.id])
    if earlier is not None:
        table = table_of(Canon)
        row = dict(session.execute(select(table).where(table.c.id == earlier)).mappings().one())
        del row["id"]
        session.execute(insert(table), {**row, "entry_id": entry.id, "superseded_id": None})
    return RowCounts(withdrawn=1)


def check_canon(session: Session, cls: type[object], canon: str, tolerance: float | None = None) -> None:
    """Refuse proportions that depend on runs, other stones or structures, or that no measured stone can have.

    Raises
    ------
    QueryError
        at the place in the expression
    """
    attributes: Mapping[str, Attribute] = STRUCTURE_ATTRIBUTES
    if issubclass(cls, Entity):
        attributes = attributes_of(session)
    for node in _nodes(parse(canon)):
        if isinstance(node, Call):
            raise complaint(node.function, "canonical proportions cannot ask functions", "compare attributes")
        if isinstance(node, Token) and node.role == "word":
            if "@" in node.text:
                what = "canonical proportions cannot ask a run"
                raise complaint(node, what, "leave out @ and what follows")
            if node.text.lower() == "departs_from_canon":
                raise complaint(node, "canonical proportions cannot ask for the departure from themselves")
        if tolerance is None and (token := _equated(node, attributes)) is not None:
            what = "no measured number equals another exactly"
            raise complaint(
                token, what, "give a tolerance, as a share of the canonical number: tolerance = 0.05"
            )
    if issubclass(cls, Structure):
        context = Context(session)
        condition_in(StructureScope(context, context.alias(Structure)), parse(canon))
    else:
        condition(session, canon)


def _equated(node: object, attributes: Mapping[str, Attribute]) -> Token | None:
    """Return a token of an equation between numbers."""
    if isinstance(node, Comparison) and node.operator == "=":
        attribute = attributes.get(node.attribute.text.lower())
        return node.attribute if attribute is not None and attribute.is_number else None
    if isinstance(node, AmountComparison) and node.operator == "=":
        return next((term.attribute for term in node.left.terms if term.attribute is not None), None)
    return None


def _held(session: Session, kind: str) -> Canon | None:
    return session.scalar(select(Canon).where(Canon.kind == kind, held_at(Canon)))


def _nodes(node: object) -> Iterator[object]:
    """Iterate over a node of an expression and all nodes in it."""
    yield node
    if is_dataclass(node) and not isinstance(node, Token):
        for field in fields(node):
            value = getattr(node, field.name)
            for item in value if isinstance(value, tuple) else (value,):
                yield from _nodes(item)
