"""What was known at every entry can be read back, whatever was declared, corrected and withdrawn since."""

import copy
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_members, declare_relation, declare_structure
from archmodel.assertions.correct import correct
from archmodel.assertions.declare import PropertyValue, declare_material, declare_phase
from archmodel.assertions.statements import say_made_of, say_mason_mark, say_observation, say_of_phase
from archmodel.assertions.withdraw import withdraw_members, withdraw_relations, withdraw_statements
from archmodel.database.as_known import as_known
from archmodel.database.session import Database, open_database
from archmodel.describe.entity import describe
from archmodel.describe.history import history, known_at
from archmodel.store.find_by_code import held_named, subjects
from archmodel.store.revisions import withdraw
from archmodel.store.stones import store_survey
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import MasonMark, Material
from ground.errors import UsageError
from tests.archmodel.stones import SHA, box_stone

CODES = ("A", "B", "C")
STRUCTURES = ("WALL", "ARCH")
MATERIALS = ("limestone", "tuff")
PHASES = ("1", "2")
SIGNS = ("arrow", "star")
STONES = tuple(box_stone(code, "header", course=1, at=(x, 0.0, 0.0)) for x, code in enumerate(CODES))

Action = tuple[Any, ...]


@dataclass
class Stone:
    """What a plain Python program knows of a stone."""

    kind: str = "header"
    course: int | None = 1
    zone: str | None = None
    tail: float | None = None
    material: str | None = None
    phase: str | None = None
    marks: set[str] = field(default_factory=set)
    seen: set[tuple[str, int]] = field(default_factory=set)
    structures: set[str] = field(default_factory=set)
    beside: set[str] = field(default_factory=set)


@dataclass
class Model:
    """The whole state: replaced as a plain program would replace it."""

    stones: dict[str, Stone] = field(default_factory=lambda: {code: Stone() for code in CODES})
    densities: dict[str, float] = field(default_factory=lambda: dict.fromkeys(MATERIALS, 2000.0))
    descriptions: dict[str, str] = field(default_factory=lambda: dict.fromkeys(MATERIALS, "first"))
    begins: dict[str, int] = field(default_factory=lambda: dict.fromkeys(PHASES, 1000))
    titles: dict[str, str] = field(default_factory=lambda: dict.fromkeys(STRUCTURES, "first"))


code = st.sampled_from(CODES)
ACTIONS = st.one_of(
    st.tuples(st.just("made_of"), code, st.sampled_from(MATERIALS)),
    st.tuples(st.just("of_phase"), code, st.sampled_from(PHASES)),
    st.tuples(st.just("mark"), code, st.sampled_from(SIGNS)),
    st.tuples(st.just("unmark"), code, st.sampled_from(SIGNS)),
    st.tuples(st.just("seen"), code, st.sampled_from(("crack", "stain")), st.integers(0, 4)),
    st.tuples(st.just("correct"), code, st.just("course"), st.none() | st.integers(0, 3)),
    st.tuples(st.just("correct"), code, st.just("zone"), st.none() | st.sampled_from(("a", "b"))),
    st.tuples(st.just("correct"), code, st.just("kind"), st.sampled_from(("header", "stretcher"))),
    st.tuples(st.just("correct"), code, st.just("tail_length"), st.none() | st.sampled_from((0.25, 0.5))),
    st.tuples(st.just("member"), code, st.sampled_from(STRUCTURES)),
    st.tuples(st.just("leave"), code, st.sampled_from(STRUCTURES)),
    st.tuples(st.just("beside"), code, code),
    st.tuples(st.just("apart"), code, code),
    st.tuples(st.just("density"), st.sampled_from(MATERIALS), st.sampled_from((2000.0, 2300.0, 2500.0))),
    st.tuples(st.just("description"), st.sampled_from(MATERIALS), st.sampled_from(("first", "second"))),
    st.tuples(st.just("begins"), st.sampled_from(PHASES), st.integers(1000, 1003)),
    st.tuples(st.just("title"), st.sampled_from(STRUCTURES), st.sampled_from(("first", "second"))),
)


def begin(session: Session) -> Entry:
    """The stones, and everything else once."""
    store_survey(session, "window", "window.moma", SHA, STONES)
    entry = new_entry(session, "declaration", "first")
    for name in MATERIALS:
        declare_material(session, entry, name, "first", {"density": PropertyValue(2000.0)})
    for name in PHASES:
        declare_phase(session, entry, name, begins=1000)
    for name in STRUCTURES:
        declare_structure(session, entry, "wall", name, title="first")
    return entry


def act(session: Session, entry: Entry, action: Action) -> None:
    """One action on the database; what cannot be done is refused."""
    verb, one, *rest = action
    about = subjects(session, [one]) if one in CODES else subjects(session)
    match verb:
        case "made_of":
            say_made_of(session, entry, about, rest[0])
        case "of_phase":
            say_of_phase(session, entry, about, rest[0])
        case "mark":
            say_mason_mark(session, entry, about, rest[0])
        case "unmark":
            withdraw_statements(session, entry, MasonMark, about, {"sign": rest[0]})
        case "seen":
            say_observation(session, entry, about, rest[0], severity=rest[1])
        case "correct":
            correct(session, entry, one, {rest[0]: rest[1]})
        case "member":
            declare_members(session, entry, rest[0], about.entities)
        case "leave":
            withdraw_members(session, entry, subjects(session, [one], [rest[0]]))
        case "beside":
            declare_relation(session, entry, "beside", about.entities, subjects(session, rest).entities)
        case "apart":
            withdraw_relations(session, entry, "beside", about.entities, subjects(session, rest).entities)
        case "density":
            declare_material(session, entry, one, properties={"density": PropertyValue(rest[0])})
        case "description":
            declare_material(session, entry, one, rest[0])
        case "begins":
            declare_phase(session, entry, one, begins=rest[0])
        case "title":
            declare_structure(session, entry, "wall", one, title=rest[0])


def imagine(model: Model, action: Action) -> None:
    """The same action on the plain model; what cannot be done is left."""
    verb, one, *rest = action
    stone = model.stones.get(one, Stone())
    match verb:
        case "made_of":
            stone.material = rest[0]
        case "of_phase":
            stone.phase = rest[0]
        case "mark":
            stone.marks.add(rest[0])
        case "unmark":
            stone.marks.discard(rest[0])
        case "seen":
            stone.seen.add((rest[0], rest[1]))
        case "correct":
            if rest[0] == "tail_length":
                stone.tail = rest[1] if stone.kind == "header" else None
            else:
                setattr(stone, rest[0], rest[1])
                stone.tail = stone.tail if stone.kind == "header" else None
        case "member":
            stone.structures.add(rest[0])
        case "leave":
            stone.structures.discard(rest[0])
        case "beside" if one != rest[0]:
            stone.beside.add(rest[0])
            model.stones[rest[0]].beside.add(one)
        case "apart":
            stone.beside.discard(rest[0])
            model.stones[rest[0]].beside.discard(one)
        case "density":
            model.densities[one] = rest[0]
        case "description":
            model.descriptions[one] = rest[0]
        case "begins":
            model.begins[one] = rest[0]
        case "title":
            model.titles[one] = rest[0]


def expected(model: Model, one: str) -> dict[str, object]:
    """What the description of a stone should say."""
    stone = model.stones[one]
    name, phase = stone.material, stone.phase
    return {
        "kind": stone.kind,
        "course": stone.course,
        "zone": stone.zone,
        "tail": stone.tail,
        "material": None if name is None else (name, model.descriptions[name], model.densities[name]),
        "phase": None if phase is None else (phase, model.begins[phase]),
        "marks": sorted(stone.marks),
        "seen": sorted(stone.seen),
        "structures": sorted((code, model.titles[code]) for code in stone.structures),
        "beside": sorted(stone.beside),
    }


def told(known: Any) -> dict[str, object]:
    """The same from a description."""
    said = known["knowledge"]
    material, phase = said["material"], said["phase"]
    return {
        "kind": known["kind"],
        "course": known["course"],
        "zone": known["zone"],
        "tail": known["own"]["tail_length"]["value"] if "tail_length" in known["own"] else None,
        "material": None
        if material is None
        else (material["name"], material["description"], material["properties"]["density"]["value"]),
        "phase": None if phase is None else (phase["name"], phase["begins"]),
        "marks": sorted(one["sign"] for one in said["marks"]),
        "seen": sorted((one["type"], one["severity"]) for one in said["observations"]),
        "structures": sorted((one["code"], one["title"]) for one in known["structures"]),
        "beside": [one["code"] for one in known["relations"].get("beside", [])],
    }


def play(database: Database, actions: list[Action]) -> None:
    """Do the actions in the database and in the model; then every earlier state must be told as it was."""
    model, states = Model(), {}
    with database.session() as session:
        states[begin(session).id] = copy.deepcopy(model)
    for action in actions:
        with database.session() as session:
            entry = new_entry(session, "declaration", str(action))
            try:
                with session.begin_nested():
                    act(session, entry, action)
            except UsageError:
                pass
            imagine(model, action)
            states[entry.id] = copy.deepcopy(model)
    with database.session(read_only=True) as session:
        for number, state in states.items():
            with as_known(session, number) as then:
                for one in CODES:
                    assert told(describe(then, one)) == expected(state, one), (number, one)
        assert session.scalars(select(Entry)).all()[-1].id == max(states)


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(ACTIONS, max_size=16))
def test_every_earlier_state_is_read_back(actions: list[Action]) -> None:
    with open_database("sqlite://") as database:
        play(database, actions)


def random_actions(count: int) -> list[Action]:
    """Many actions that depend on nothing but this seed."""
    draw = random.Random(6)
    kinds: list[Callable[[], Action]] = [
        lambda: ("made_of", draw.choice(CODES), draw.choice(MATERIALS)),
        lambda: ("mark", draw.choice(CODES), draw.choice(SIGNS)),
        lambda: ("unmark", draw.choice(CODES), draw.choice(SIGNS)),
        lambda: ("correct", draw.choice(CODES), "kind", draw.choice(("header", "stretcher"))),
        lambda: ("correct", draw.choice(CODES), "tail_length", draw.choice((None, 0.5, 0.75))),
        lambda: ("member", draw.choice(CODES), draw.choice(STRUCTURES)),
        lambda: ("leave", draw.choice(CODES), draw.choice(STRUCTURES)),
        lambda: ("beside", *draw.sample(CODES, 2)),
        lambda: ("apart", *draw.sample(CODES, 2)),
        lambda: ("density", draw.choice(MATERIALS), draw.choice((2000.0, 2300.0))),
        lambda: ("title", draw.choice(STRUCTURES), draw.choice(("first", "second", "third"))),
    ]
    return [draw.choice(kinds)() for _ in range(count)]


def test_so_it_is_on_every_database(empty: Database) -> None:
    play(empty, random_actions(30))


def test_a_history_tells_who_said_what_and_what_it_replaced(empty: Database) -> None:
    with empty.session() as session:
        begin(session)
        first = new_entry(session, "declaration", "by eye", author="A")
        say_made_of(session, first, subjects(session, ["A"]), "tuff")
        say_mason_mark(session, first, subjects(session, ["A"]), "star")
        second = new_entry(session, "correction", "thin section", author="B")
        say_made_of(session, second, subjects(session, ["A"]), "limestone")
        correct(session, second, "A", {"kind": "quoin", "code": "A1"})
        third = new_entry(session, "declaration", "it was a scratch", author="B")
        withdraw_statements(session, third, MasonMark, subjects(session, ["A1"]))
    with empty.session(read_only=True) as session:
        events = history(session, "A1")
        with pytest.raises(UsageError, match="no stone 'A' in the database; it is called A1 now"):
            history(session, "A")
    told = [(e.action, e.author, e.source, e.event, e.what, e.says, e.before) for e in events]
    by_eye = ("declaration", "A", "by eye")
    thin = ("correction", "B", "thin section")
    assert told[0][3:6] == ("recorded", "entity", {"code": "A", "kind": "header", "course": 1, "depth": 0.4})
    assert told[1][3:5] == ("measured", "measurement")
    assert told[2:] == [
        (*by_eye, "said", "made_of", {"material": "tuff"}, None),
        (*by_eye, "said", "mason_mark", {"sign": "star"}, None),
        (*thin, "corrected", "kind", {"value": "quoin"}, {"value": "header"}),
        (*thin, "corrected", "code", {"value": "A1"}, {"value": "A"}),
        (*thin, "said", "made_of", {"material": "limestone"}, None),
        ("declaration", "B", "it was a scratch", "withdrawn", "mason_mark", {"sign": "star"}, None),
    ]
    assert [e.entry for e in events] == sorted(e.entry for e in events)


def test_the_history_of_a_structure_goes_through_its_versions(empty: Database) -> None:
    with empty.session() as session:
        begin(session)
        for title in ("second", "third"):
            entry = new_entry(session, "declaration", title)
            declare_structure(session, entry, "arch", "ARCH", title=title)
        declare_members(session, entry, "ARCH", subjects(session, ["B", "A"]).entities, ordered=True)
        last = new_entry(session, "declaration", "no arch after all")
        from archmodel.tables.structures import Structure

        withdraw(session, last, held_named(session, Structure, "ARCH"))
    with empty.session(read_only=True) as session:
        events = [(e.source, e.event, e.what, e.says) for e in history(session, "ARCH")]
        assert known_at(session, "ARCH", entry.id)["members"] == ["B", "A"]
        assert known_at(session, "ARCH", last.id)["members"] == []
        assert known_at(session, "ARCH", last.id)["withdrawn"] is not None
    assert events == [
        ("first", "recorded", "structure", {"kind": "wall", "title": "first"}),
        ("second", "replaced", "structure", {"kind": "arch", "title": "second"}),
        ("third", "replaced", "structure", {"kind": "arch", "title": "third"}),
        ("third", "said", "member", {"code": "B", "rank": 1}),
        ("third", "said", "member", {"code": "A", "rank": 2}),
        ("no arch after all", "withdrawn", "member", {"code": "B", "rank": 1}),
        ("no arch after all", "withdrawn", "member", {"code": "A", "rank": 2}),
        ("no arch after all", "withdrawn", "structure", {"kind": "arch", "title": "third"}),
    ]


def test_what_is_in_use_is_withdrawn_last(empty: Database) -> None:
    with empty.session() as session:
        entry = begin(session)
        say_made_of(session, entry, subjects(session, ["A", "B"]), "tuff")
        tuff = held_named(session, Material, "tuff")
        with pytest.raises(UsageError, match="material tuff cannot be withdrawn: there are 2 statements"):
            withdraw(session, entry, tuff)


def test_an_entry_that_is_not_there_is_wrong_use(empty: Database) -> None:
    with empty.session() as session:
        begin(session)
        with pytest.raises(UsageError, match="there is no entry 99"):
            known_at(session, "A", 99)
        late = new_entry(session, "declaration", "late")
        declare_structure(session, late, "window", "LATE")
        with pytest.raises(UsageError, match="LATE was not known at entry 1"):
            known_at(session, "LATE", 1)
