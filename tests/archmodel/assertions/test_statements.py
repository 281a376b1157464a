"""Statements about stones and structures: one at a time where there can be but one, each with its provenance."""

from collections.abc import Callable
from datetime import date

import pytest
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_structure
from archmodel.assertions.declare import declare_document, declare_material, declare_phase
from archmodel.assertions.statements import (
    Remark,
    say_depth,
    say_made_of,
    say_mason_mark,
    say_note,
    say_observation,
    say_of_phase,
    say_reference,
)
from archmodel.assertions.withdraw import withdraw_members, withdraw_relations, withdraw_statements
from archmodel.database.session import Database
from archmodel.store.find_by_code import Subjects, subjects
from archmodel.store.revisions import RowCounts, supersede, withdraw
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import DepthEvidence, MadeOf, MasonMark, Note, Observation, Statement
from ground.errors import UsageError


@pytest.fixture
def known(filled: Database) -> Database:
    """The wall with two materials, a phase, a document and a structure."""
    with filled.session() as session:
        entry = new_entry(session, "declaration", "a test")
        declare_material(session, entry, "tuff")
        declare_material(session, entry, "limestone")
        declare_phase(session, entry, "2")
        declare_document(session, entry, "P1", "photograph", "The arch")
        declare_structure(session, entry, "arch", "ARCH")
    return filled


def entry_of(session: Session) -> Entry:
    return new_entry(session, "declaration", "a test")


def test_a_stone_is_of_one_material(known: Database) -> None:
    with known.session() as session:
        about = subjects(session, ["V1", "V2"], ["ARCH"])
        first, second = entry_of(session), entry_of(session)
        assert say_made_of(session, first, about, "tuff") == RowCounts(new=3)
        assert say_made_of(session, first, about, "tuff") == RowCounts(unchanged=3)
        one = subjects(session, ["V1"])
        assert say_made_of(session, second, one, "limestone", Remark("by colour")) == RowCounts(replaced=1)
        # the same material, but for another reason, is another statement
        assert say_made_of(session, second, one, "limestone") == RowCounts(replaced=1)
        rows = session.scalars(
            select(MadeOf).where(MadeOf.entity_id.in_(one.entities)).order_by(MadeOf.id)
        ).all()
        assert [row.material.name for row in rows if row.material] == ["tuff", "limestone", "limestone"]
        assert [row.supersedes_id for row in rows] == [None, rows[0].id, rows[1].id]
        assert [row.superseded_id for row in rows] == [second.id, second.id, None]


def test_marks_add_up_until_one_is_withdrawn(known: Database) -> None:
    with known.session() as session:
        entry, about = entry_of(session), subjects(session, ["V1", "V2"])
        assert say_mason_mark(session, entry, about, "star", "left") == RowCounts(new=2)
        assert say_mason_mark(session, entry, about, "star") == RowCounts(new=2)
        assert say_mason_mark(session, entry, about, "arrow") == RowCounts(new=2)
        later = entry_of(session)
        match = {"sign": "star", "place": "left"}
        assert withdraw_statements(session, later, MasonMark, about, match) == RowCounts(withdrawn=2)
        # done already
        assert withdraw_statements(session, later, MasonMark, about, match) == RowCounts(unchanged=2)
        with pytest.raises(UsageError, match="there is no such mason_mark to withdraw"):
            withdraw_statements(session, later, MasonMark, about, {"sign": "cross"})
        held = select(MasonMark.sign).where(MasonMark.superseded_id.is_(None)).order_by(MasonMark.id)
        assert session.scalars(held).all() == ["star", "star", "arrow", "arrow"]


def test_an_observation_keeps_everything_that_was_said(known: Database) -> None:
    with known.session() as session:
        remark = Remark("open by 1 mm", "P1", "centre", date(2024, 5, 14))
        about = subjects(session, ["V3"])
        place = {"place": "intrados", "at": (1.0, 2.5, -3.0)}
        say_observation(session, entry_of(session), about, "crack", severity=3, **place, remark=remark)
    with known.session(read_only=True) as session:
        (one,) = session.scalars(select(Observation)).all()
        assert (one.type, one.severity, one.place, one.x, one.y, one.z) == (
            "crack",
            3,
            "intrados",
            1.0,
            2.5,
            -3.0,
        )
        assert (one.text, one.locator, one.observed_on) == ("open by 1 mm", "centre", date(2024, 5, 14))
        assert one.entity is not None
        assert one.document is not None
        assert (one.entity.code, one.document.code) == ("V3", "P1")


def test_a_note_and_a_reference_say_something(known: Database) -> None:
    with known.session() as session:
        entry, about = entry_of(session), subjects(session, structures=["ARCH"])
        assert say_note(session, entry, about, "tooling", Remark("two\nlines")) == RowCounts(new=1)
        assert say_reference(session, entry, about, Remark(document="P1")) == RowCounts(new=1)
        (note,) = session.scalars(select(Note)).all()
        assert note.structure is not None
        assert (note.key, note.text, note.structure.code) == ("tooling", "two\nlines", "ARCH")
        replacement = Note(key="tooling", text="diagonal", structure_id=note.structure_id)
        supersede(session, entry, note, replacement)
        assert (note.superseded_id, replacement.supersedes_id) == (entry.id, note.id)
        with pytest.raises(UsageError, match="a MasonMark cannot replace a Note"):
            supersede(session, entry, replacement, MasonMark(sign="x"))


def test_a_depth_is_only_replaced(known: Database) -> None:
    with known.session() as session:
        entry, about = entry_of(session), subjects(session, ["V3"])
        assert say_depth(session, entry, about, 0.4) == RowCounts(new=1)
        assert say_depth(session, entry, about, 0.4, 0.01) == RowCounts(replaced=1)
        (held,) = session.scalars(select(DepthEvidence).where(DepthEvidence.superseded_id.is_(None)))
        for attempt in (
            lambda: withdraw(session, entry, held),
            lambda: withdraw_statements(session, entry, DepthEvidence, about),
        ):
            with pytest.raises(UsageError, match="a depth cannot be withdrawn; record the depth that holds"):
                attempt()


Say = Callable[[Session, Entry, Subjects], object]


def test_what_cannot_be_said_is_refused_and_nothing_is_kept(known: Database) -> None:
    cases: list[tuple[Say, str]] = [
        (lambda s, e, a: say_made_of(s, e, a, "tufff"), "no material 'tufff'; did you mean tuff"),
        (lambda s, e, a: say_of_phase(s, e, a, "zwei"), "no phase 'zwei'; declare it first; known are 2"),
        (lambda s, e, a: say_observation(s, e, a, "crakc"), "did you mean crack"),
        (
            lambda s, e, a: say_observation(s, e, a, "crack", severity=5),
            "severity is 5; give a whole number from 0",
        ),
        (lambda s, e, a: say_observation(s, e, a, "crack", severity=True), "severity is True"),
        (lambda s, e, a: say_observation(s, e, a, "crack", at=(1.0, 2.0)), "a place of 2 numbers"),
        (lambda s, e, a: say_observation(s, e, a, "crack", at=(1, 2, float("inf"))), "z is inf"),
        (lambda s, e, a: say_mason_mark(s, e, a, ""), "sign '' is not a name"),
        (lambda s, e, a: say_depth(s, e, a, 0.0), "depth is 0.0; give a finite number in m, above 0"),
        (lambda s, e, a: say_depth(s, e, a, 0.4, -1.0), "sigma is -1.0"),
        (lambda s, e, a: say_reference(s, e, a, Remark("x")), "names no document"),
        (lambda s, e, a: say_reference(s, e, a, Remark(document="P2")), "did you mean P1"),
        (lambda s, e, a: say_note(s, e, a, "edge", Remark()), "the note 'edge' says nothing"),
        (lambda s, e, a: say_note(s, e, a, "edge", Remark("x", None, "p. 2")), "is in no document"),
        (lambda s, e, a: say_note(s, e, a, "edge", Remark("x" * 10_001)), "text has 10001 characters"),
        (lambda s, e, a: withdraw_members(s, e, a), "no such declared membership"),
        (lambda s, e, a: withdraw_relations(s, e, "beside", [1], [2]), "no such declared relation beside"),
    ]
    with known.session() as session:
        entry, about = entry_of(session), subjects(session, ["V1"])
        for say, message in cases:
            with pytest.raises(UsageError, match=message):
                say(session, entry, about)
        assert session.scalar(select(func.count()).select_from(Statement)) == 0
