"""Statements about entities and structures: material, phase, marks, observations, depth, documents, notes.

One thing said of many subjects is one statement about each. Of what a subject can have but one (`SINGLE`), a new
statement supersedes the one before of the same author, a depth that of any author, as the solid follows it; the
others add up. What an author says already, word for word, is not said again.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, timedelta

from sqlalchemy import insert, select
from sqlalchemy.orm import Session, aliased

from archmodel.assertions.validation import (
    checked_label,
    checked_number,
    checked_text,
    checked_whole,
)
from archmodel.store.bulk import batches
from archmodel.store.find_by_code import Subjects, held_named
from archmodel.store.revisions import NOTHING, RowCounts, end_rows, table_of
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import (
    DepthEvidence,
    Document,
    MadeOf,
    MasonMark,
    Material,
    Note,
    Observation,
    OfPhase,
    Phase,
    Reference,
    Statement,
)
from archmodel.tables.terms import term_for, vocabulary
from ground.errors import UsageError

SINGLE: tuple[type[Statement], ...] = (MadeOf, OfPhase, DepthEvidence)
"""Statements of which an author has at most one about a subject."""

FARTHEST = 50.0
"""Largest distance of an observation from the centroid of its stone [m]: some ten times the largest stones ever
laid, so that only another frame, unit or stone is farther away."""


@dataclass(frozen=True)
class Remark:
    """Details that every statement can have.

    Attributes
    ----------
    text : in words
    document, locator : code of the document that says so, and where in it
    observed_on : date on which it was seen
    stated_on : date of the opinion; None: that of the recording
    certainty : how sure the author is, from 0 to 1
    """

    text: str | None = None
    document: str | None = None
    locator: str | None = None
    observed_on: date | None = None
    stated_on: date | None = None
    certainty: float | None = None


PLAIN = Remark()


def say_made_of(
    session: Session, entry: Entry, about: Subjects, material: str, remark: Remark = PLAIN
) -> RowCounts:
    """State their material, which must have been declared."""
    number = held_named(session, Material, term_for(session, "material", material)).id
    return _say(session, entry, MadeOf, about, {"material_id": number}, remark)


def say_of_phase(
    session: Session, entry: Entry, about: Subjects, phase: str, remark: Remark = PLAIN
) -> RowCounts:
    """State the phase in which they were built or put in place; it must have been declared."""
    number = held_named(session, Phase, phase).id
    return _say(session, entry, OfPhase, about, {"phase_id": number}, remark)


def say_mason_mark(
    session: Session,
    entry: Entry,
    about: Subjects,
    sign: str,
    place: str | None = None,
    remark: Remark = PLAIN,
) -> RowCounts:
    """State a mason's mark; `sign` is the same for the same mark, `place` is where on the stone, in words."""
    named = term_for(session, "mark", checked_label("sign", sign))
    values = {"sign": named, "place": checked_text("place", place)}
    return _say(session, entry, MasonMark, about, values, remark)


def say_observation(
    session: Session,
    entry: Entry,
    about: Subjects,
    type: str,
    *,
    severity: int | None = None,
    place: str | None = None,
    at: Sequence[float] | None = None,
    remark: Remark = PLAIN,
) -> RowCounts:
    """State an observation made on them.

    Parameters
    ----------
    type : term of the vocabulary of observations, or a label of it
    severity : from 0 (traces) to 4 (lost, or about to be)
    place : on the stone, in words
    at : (x, y, z) in the frame of the site [m]
    """
    x, y, z = _point(at)
    if at is not None:
        _refuse_far(session, about, at)
    values = {
        "type": vocabulary(session, "observation").named(type),
        "severity": checked_whole("severity", severity, 0, 4),
        "place": checked_text("place", place),
        "x": x,
        "y": y,
        "z": z,
    }
    return _say(session, entry, Observation, about, values, remark)


def _refuse_far(session: Session, about: Subjects, at: Sequence[float]) -> None:
    """Refuse a place that is too far from a stone to be on it: in another frame, or of another stone."""
    for batch in batches(about.entities):
        rows = select(Entity.code, Entity.x, Entity.y, Entity.z).where(Entity.id.in_(batch))
        for row in session.execute(rows.where(Entity.x.is_not(None))):
            code, distance = row[0], math.dist(at, tuple(value or 0.0 for value in row[1:]))
            if distance > FARTHEST:
                what = f"at is {distance:.0f} m from the stone {code}, more than {FARTHEST:.0f} m"
                raise UsageError(what, remedy="give metres in the frame of the site, or leave at out")


def _refuse_future(remark: Remark) -> None:
    """Refuse dates to come; tomorrow can be today in another time zone."""
    for day in (remark.observed_on, remark.stated_on):
        if day is not None and day > date.today() + timedelta(days=1):
            raise UsageError(f"the date {day} is in the future", remedy="check its year")


def say_depth(
    session: Session,
    entry: Entry,
    about: Subjects,
    value: float,
    sigma: float | None = None,
    remark: Remark = PLAIN,
) -> RowCounts:
    """State their depth [m], with its standard deviation [m].

    This is the statement alone; ``pipelines.record.depth`` makes the solid follow it.
    """
    values = {
        "value": checked_number("depth", value, "m", above=0.0),
        "sigma": checked_number("sigma", sigma, "m", at_least=0.0),
    }
    return _say(session, entry, DepthEvidence, about, values, remark)


def say_reference(session: Session, entry: Entry, about: Subjects, remark: Remark) -> RowCounts:
    """State a document or photograph, named in the remark, that treats or shows them."""
    if remark.document is None:
        raise UsageError("a reference names no document", remedy="give the code of a document")
    return _say(session, entry, Reference, about, {}, remark)


def say_note(session: Session, entry: Entry, about: Subjects, key: str, remark: Remark) -> RowCounts:
    """State a note, the text of the remark, under a key such as "edge"."""
    if remark.text is None:
        raise UsageError(f"the note {key[:40]!r} says nothing", remedy="give its text")
    return _say(session, entry, Note, about, {"key": checked_label("key", key)}, remark)


def without_replaced(session: Session, cls: type[Statement], about: Subjects, author: str | None) -> Subjects:
    """Leave out the subjects of which an author has replaced a statement of this kind by a later one."""
    later = aliased(Statement)
    replaced: dict[str, set[int]] = {"entity_id": set(), "structure_id": set()}
    for owner, batch in about.batches():
        column = getattr(Statement, owner)
        rows = (
            select(column)
            .join(later, later.supersedes_id == Statement.id)
            .where(column.in_(batch), Statement.kind == cls.__kind__, Statement.author == author)
            .where(later.superseded_id.is_(None))
        )
        replaced[owner].update(session.scalars(rows))
    return Subjects(
        tuple(number for number in about.entities if number not in replaced["entity_id"]),
        tuple(number for number in about.structures if number not in replaced["structure_id"]),
    )


def _say(
    session: Session,
    entry: Entry,
    cls: type[Statement],
    about: Subjects,
    values: Mapping[str, object],
    remark: Remark,
) -> RowCounts:
    """Store one statement about each subject that lacks it."""
    full = {**values, **remark_row(session, entry, remark)}
    outcome = NOTHING
    for owner, batch in about.batches():
        outcome += _say_of_batch(session, entry, cls, owner, batch, full)
    return outcome


def _say_of_batch(
    session: Session,
    entry: Entry,
    cls: type[Statement],
    owner: str,
    numbers: Sequence[int],
    values: Mapping[str, object],
) -> RowCounts:
    session.flush()
    table = table_of(Statement)
    held = select(table).where(
        table.c[owner].in_(numbers), table.c.kind == cls.__kind__, table.c.superseded_id.is_(None)
    )
    same: set[int] = set()
    others: dict[int, int] = {}
    for row in session.execute(held).mappings():
        # the same opinion on another day is no other one
        if all(row[name] == value for name, value in values.items() if name != "stated_on"):
            same.add(row[owner])
        elif cls is DepthEvidence or (cls in SINGLE and row["author"] == values["author"]):
            others[row[owner]] = row["id"]
    if others:
        end_rows(session, entry, Statement, list(others.values()))
    rows = [
        {"kind": cls.__kind__, "entry_id": entry.id, owner: number, "supersedes_id": others.get(number)}
        | dict(values)
        for number in numbers
        if number not in same
    ]
    if rows:
        session.execute(insert(table), rows)
    return RowCounts(new=len(rows) - len(others), replaced=len(others), unchanged=len(same))


def remark_row(session: Session, entry: Entry, remark: Remark) -> dict[str, object]:
    """Return the columns of a statement that say whose it is, of which day, and its details; no day to come."""
    _refuse_future(remark)
    document = remark.document
    if remark.locator is not None and document is None:
        raise UsageError(f"the locator {remark.locator[:40]!r} is in no document", remedy="name the document")
    return {
        "text": checked_text("text", remark.text),
        "document_id": None if document is None else held_named(session, Document, document).id,
        "locator": checked_text("locator", remark.locator),
        "observed_on": remark.observed_on,
        "certainty": checked_number("certainty", remark.certainty, "-", at_least=0.0, at_most=1.0),
        "author": entry.author,
        "stated_on": remark.stated_on or entry.recorded_at.date(),
    }


def _point(at: Sequence[float] | None) -> tuple[float | None, float | None, float | None]:
    if at is None:
        return None, None, None
    if len(at) != 3:
        raise UsageError(f"a place of {len(at)} numbers", remedy="give x, y and z in metres")
    x, y, z = (checked_number(name, value, "m") for name, value in zip("xyz", at, strict=True))
    return x, y, z
