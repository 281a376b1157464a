"""Opinions of several authors stand side by side, and one of them holds: compared with a plain model at every entry."""

import copy
import random
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date, timedelta
from pathlib import Path

import pytest
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_members, declare_structure
from archmodel.assertions.declare import declare_phase
from archmodel.assertions.opinions import decide, set_rule
from archmodel.assertions.statements import Remark, say_mason_mark, say_of_phase
from archmodel.assertions.withdraw import withdraw_statements
from archmodel.database.as_known import as_known, entry_named
from archmodel.database.session import Database, open_database
from archmodel.describe.entity import describe
from archmodel.describe.history import history
from archmodel.exchange.reader import import_building
from archmodel.exchange.writer import write_building
from archmodel.query.api import find, find_rows
from archmodel.store.find_by_code import subjects
from archmodel.store.stones import store_survey
from archmodel.tables.entries import new_entry
from archmodel.tables.knowledge import Decision, OfPhase
from ground.errors import QueryError, UsageError
from tests.archmodel.stones import SHA, box_stone

CODES = ("A", "B", "C")
AUTHORS = ("Ada", "Ben", "Cleo", None)
PHASES = {"I": 1100, "II": 1200, "III": 1300}
FIRST = date(2020, 1, 1)


@dataclass
class Opinion:
    """What one author states of one stone."""

    author: str | None
    phase: str
    day: date
    certainty: float | None
    number: int


@dataclass
class Model:
    """Opinions by stone and author, each with those that it replaced; decisions by stone; the rule."""

    opinions: dict[str, dict[str | None, list[Opinion]]] = field(
        default_factory=lambda: {code: {} for code in CODES}
    )
    decided: dict[str, Opinion] = field(default_factory=dict)
    rule: tuple[str, tuple[str, ...]] = ("latest", ())

    def holding(self, code: str) -> tuple[str | None, bool]:
        """Return the phase that holds, and whether opinions on it differ."""
        held = [chain[-1] for chain in self.opinions[code].values()]
        if not held:
            return None, False
        rule, authors = self.rule
        ranks = [0.0] * len(held)
        if rule == "certainty":
            ranks = [-1.0 if one.certainty is None else one.certainty for one in held]
        elif rule == "author":
            ranks = [-float(authors.index(one.author)) if one.author in authors else -99.0 for one in held]
        best = max(
            zip(held, ranks, strict=True),
            key=lambda pair: (pair[0] is self.decided.get(code), pair[1], pair[0].day, pair[0].number),
        )[0]
        return best.phase, len({one.phase for one in held}) > 1


def play(session: Session, model: Model, chance: random.Random, number: int) -> int:
    """Do one random act in the database and in the model; return its entry."""
    author, code = chance.choice(AUTHORS), chance.choice(CODES)
    entry = new_entry(session, "declaration", str(number), author=author)
    about = subjects(session, [code])
    chains = model.opinions[code]
    match chance.choice(("say", "say", "say", "withdraw", "decide", "rule")):
        case "say":
            phase, day = chance.choice(list(PHASES)), FIRST + timedelta(chance.randrange(50))
            certainty = chance.choice((None, 0.2, 0.9))
            before = chains.get(author)
            say_of_phase(session, entry, about, phase, Remark(stated_on=day, certainty=certainty))
            if before and (before[-1].phase, before[-1].certainty) == (phase, certainty):
                return entry.id  # said already
            chains.setdefault(author, []).append(Opinion(author, phase, day, certainty, number))
        case "withdraw":
            who = author if author in chains else next(iter(chains), None) if len(chains) == 1 else None
            if author not in chains and len(chains) != 1:
                with suppress(UsageError):  # of several other authors, or there is nothing
                    assert not withdraw_statements(session, entry, OfPhase, about).withdrawn
                return entry.id
            withdraw_statements(session, entry, OfPhase, about)
            gone = chains[who].pop()
            if chains[who]:  # held again, as a row that came now
                chains[who][-1] = copy.copy(chains[who][-1])
                chains[who][-1].number = number
            else:
                del chains[who]
            if model.decided.get(code) is gone:
                del model.decided[code]
        case "decide" if chains:
            chosen = chance.choice(list(chains))
            match = {"phase": chains[chosen][-1].phase, "author": chosen}
            decide(session, entry, "of_phase", about, match)
            model.decided[code] = chains[chosen][-1]
        case "rule":
            rule = chance.choice(("latest", "certainty", "author"))
            authors = tuple(chance.sample(AUTHORS[:3], 2)) if rule == "author" else ()
            set_rule(session, entry, "of_phase", rule, authors)
            model.rule = rule, authors
    return entry.id


def answers(session: Session) -> dict[str, tuple[object, bool]]:
    """Return what holds and whether it is disputed, as queries say; descriptions must agree."""
    disputed = {one.code for one in find(session, "entity", ["disputed(phase)"])}
    rows = {row["code"]: row["phase"] for row in find_rows(session, "entity", columns=["code", "phase"])}
    for code in CODES:
        known = describe(session, code)["knowledge"]["phase"]  # type: ignore[index]
        assert (None if known is None else known["name"]) == rows[code]
        assert bool(known and known.get("disputed")) == (code in disputed)
    return {code: (rows[code], code in disputed) for code in CODES}


def run_history(database: Database, seed: int, length: int) -> None:
    """Play a random history, and compare every state with the model's, also after a round trip."""
    chance, model = random.Random(seed), Model()
    with database.session() as session:
        store_survey(
            session, "w", "w.moma", SHA, [box_stone(code, at=(x, 0.0, 0.0)) for x, code in enumerate(CODES)]
        )
        entry = new_entry(session, "declaration", "phases")
        for name, year in PHASES.items():
            declare_phase(session, entry, name, year)
    states = {}
    for number in range(length):
        with database.session() as session:
            entry_id = play(session, model, chance, number)
            states[entry_id] = {code: model.holding(code) for code in CODES}
    with database.session(read_only=True) as session:
        assert answers(session) == list(states.values())[-1]
        for entry_id, state in states.items():
            with as_known(session, entry_id) as then:
                assert answers(then) == state, (seed, entry_id)


@pytest.mark.parametrize("seed", range(3))
def test_what_holds_at_every_entry_is_what_a_plain_model_says(seed: int) -> None:
    with open_database("sqlite://") as database:
        run_history(database, seed, 8)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3, 103))
def test_a_hundred_histories(seed: int, tmp_path: Path) -> None:
    with open_database("sqlite://") as database:
        run_history(database, seed, 25)
        path = tmp_path / "all.json"
        with database.session(read_only=True) as session, path.open("wb") as file:
            write_building(session, file)
            told = answers(session)
    with open_database("sqlite://") as again:
        import_building(path, again)
        with again.session(read_only=True) as session:
            assert answers(session) == told


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
