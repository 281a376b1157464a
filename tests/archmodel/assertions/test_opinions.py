"""Opinions of several authors stand side by side, and one of them holds: compared with a plain model at every entry."""

import random
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_members, declare_structure
from archmodel.assertions.declare import declare_phase
from archmodel.assertions.opinions import decide
from archmodel.assertions.statements import Remark, say_mason_mark, say_of_phase
from archmodel.assertions.withdraw import withdraw_statements
from archmodel.database.as_known import entry_named
from archmodel.database.session import Database, open_database
from archmodel.describe.entity import describe
from archmodel.describe.history import history
from archmodel.migrations.migrate import migrate
from archmodel.query.api import find, find_rows
from archmodel.store.find_by_code import subjects
from archmodel.tables.entries import new_entry
from archmodel.tables.knowledge import Decision, OfPhase
from ground.errors import QueryError, UsageError
from tests.archmodel.assertions.histories import FIRST, PHASES, History


@pytest.mark.parametrize("seed", range(3))
def test_what_holds_at_every_entry_is_what_a_plain_model_says(seed: int, tmp_path: Path) -> None:
    history = History(tmp_path, seed)
    for number in range(8):
        history.act(number)
    history.check()


def test_what_holds_is_the_same_after_migrations_and_a_document(tmp_path: Path) -> None:
    history = History(tmp_path, 1)
    history.begin_in_version_1(6)
    history.check()
    for number in range(4):
        history.act(number)
    history.migrate_there_and_back()
    history.act(4)
    history.move()
    history.act(5)
    history.check()


def test_opinions_that_stood_side_by_side_for_a_time_survive_the_first_layout(tmp_path: Path) -> None:
    """What it cannot hold now is told; what was withdrawn meanwhile is the same at every entry afterwards."""
    history = History(tmp_path, 1)

    def act(author: str, phase: str | None) -> None:
        with open_database(history.url) as database, database.session() as session:
            entry, about = new_entry(session, "declaration", "x", author=author), subjects(session, ["A"])
            if phase is None:
                withdraw_statements(session, entry, OfPhase, about)
            else:
                say_of_phase(session, entry, about, phase)
            history.states[entry.id] = {}

    for author, phase in (("Ada", "I"), ("Ben", "II"), ("Ben", None)):
        act(author, phase)
    before = history.all_answers()
    assert migrate(history.url, 1).lost == ()
    migrate(history.url)
    assert history.all_answers() == before
    assert [state["A"] for state in before.values()] == [("I", False), ("II", True), ("I", False)]
    act("Ben", "III")
    assert migrate(history.url, 1, lossy=True).lost == ("1 opinions beside later ones",)


def test_dates_and_authors_of_statements_are_told_to_be_lost(tmp_path: Path) -> None:
    history = History(tmp_path, 1)
    with open_database(history.url) as database, database.session() as session:
        about = subjects(session, ["A"])
        for author, day in (("Ada", FIRST), ("Ben", None)):
            entry = new_entry(session, "declaration", "x", author=author)
            say_of_phase(session, entry, about, "I", Remark(stated_on=day))
    lost = migrate(history.url, 1, lossy=True).lost
    assert "1 dates of statements other than those of their entries" in lost
    assert not any("authors" in text for text in lost)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3, 103))
def test_a_hundred_histories(seed: int, tmp_path: Path) -> None:
    chance, history = random.Random(-seed), History(tmp_path, seed)
    if seed % 2:
        history.begin_in_version_1(8)
    for number in range(25):
        history.act(number)
        if chance.random() < 0.08:
            history.migrate_there_and_back()
        if chance.random() < 0.08:
            history.move()
    history.check()


@pytest.fixture
def wall(filled: Database) -> Database:
    """The wall, with phases."""
    with filled.session() as session:
        entry = new_entry(session, "declaration", "phases")
        for name, year in PHASES.items():
            declare_phase(session, entry, name, year)
    return filled


def state(session: Session, author: str, phase: str, *codes: str) -> None:
    entry = new_entry(session, "declaration", author, author=author)
    say_of_phase(session, entry, subjects(session, structures=codes), phase)


def test_of_two_structures_at_the_same_distance_query_and_description_take_the_same(wall: Database) -> None:
    with wall.session() as session:
        entry = new_entry(session, "declaration", "structures")
        for code in ("NORTH", "SOUTH"):
            declare_structure(session, entry, "wall", code)
            declare_members(session, entry, code, subjects(session, ["V1"]).entities)
        state(session, "Ada", "II", "NORTH")
        state(session, "Ben", "I", "SOUTH")
        known = describe(session, "V1")["knowledge"]["phase"]  # type: ignore[index]
        (row,) = find_rows(session, "entity", ["code = V1"], columns=["phase", "phase_author"])
        assert (known["name"], known["disputed"], [one["phase"] for one in known["others"]]) == (
            "I",
            True,
            ["II"],
        )
        assert row == {"phase": "I", "phase_author": "Ben"}
        assert [one.code for one in find(session, "entity", ["disputed(phase)"])] == ["V1"]
        assert [one.code for one in find(session, "entity", ["by(Ada)"])] == ["V1"]
        says = [one.says.get("said_of") for one in history(session, "V1") if one.what == "of_phase"]
        assert says == ["NORTH", "SOUTH"]


def test_a_decision_holds_until_it_is_withdrawn(wall: Database) -> None:
    with wall.session() as session:
        about = subjects(session, ["V1"])
        for author, phase in (("Ada", "II"), ("Ben", "I")):
            say_of_phase(session, new_entry(session, "declaration", "x", author=author), about, phase)
        entry = new_entry(session, "declaration", "council", author="Cleo")
        with pytest.raises(UsageError, match=r"no opinions of of_phase about 1 of the subjects match"):
            decide(session, entry, "of_phase", about, {"phase": "III"})
        decide(session, entry, "of_phase", about, {"author": "Ada"})
        known = describe(session, "V1")["knowledge"]["phase"]  # type: ignore[index]
        assert (known["name"], known["rule"]) == ("II", f"decided by Cleo in entry {entry.id}")
        withdraw_statements(session, new_entry(session, "declaration", "x", author="Cleo"), Decision, about)
        assert describe(session, "V1")["knowledge"]["phase"]["name"] == "I"  # type: ignore[index]


def test_phases_are_ordered_by_their_years_and_other_texts_are_not(wall: Database) -> None:
    with wall.session() as session:
        for code, phase in (("V1", "I"), ("V2", "II"), ("V3", "III")):
            entry = new_entry(session, "declaration", "x")
            say_of_phase(session, entry, subjects(session, [code]), phase)
        asked = {
            text: [one.code for one in find(session, "entity", [text])]
            for text in ("phase < III", "phase >= II")
        }
        assert asked == {"phase < III": ["V1", "V2"], "phase >= II": ["V2", "V3"]}
        for wrong, what in (
            ("phase < IV", "no phase 'IV'"),
            ("zone < b", "zone is a text, which has no order"),
        ):
            with pytest.raises(QueryError, match=what):
                find(session, "entity", [wrong])


def test_a_stone_with_two_marks_is_found_by_either_and_two_authors_see_one_mark(wall: Database) -> None:
    with wall.session() as session:
        about = subjects(session, ["V1"])
        for author, sign in (("Ada", "fish"), ("Ben", "fish"), ("Ben", "star")):
            say_mason_mark(session, new_entry(session, "declaration", "x", author=author), about, sign)
        for text, found in (
            ("mark = star", ["V1"]),
            ("mark in (star, x)", ["V1"]),
            ('mark like "st%"', ["V1"]),
            ("mark != fish", []),
        ):
            assert [one.code for one in find(session, "entity", [text])] == found, text
        assert find_rows(session, "entity", ["marks > 0"], columns=["marks"]) == [{"marks": 2}]


@pytest.mark.parametrize("text", ["0", "77", "2019-01-01", "2019-13-01", "yesterday", ""])
def test_an_entry_that_is_not_there_is_refused(wall: Database, text: str) -> None:
    with wall.session(read_only=True) as session, pytest.raises(UsageError, match="--at"):
        entry_named(session, text)


def test_an_entry_is_found_by_number_and_by_date(wall: Database) -> None:
    with wall.session(read_only=True) as session:
        assert entry_named(session, "1") == 1
        last = entry_named(session, "9998")
        assert entry_named(session, "9998-12") == entry_named(session, "9998-12-31") == last > 1
