"""Functions of expressions against a slow and simple reference: plain Python over the stored rows.

The rows are drawn by chance, with stones that rest on one another in circles, structures in structures,
statements about both, and a third of everything no longer held.
"""

import random
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import select

from archmodel.database.session import Database, open_database
from archmodel.query.api import find
from archmodel.store.bulk import insert_rows
from archmodel.store.stones import store_survey
from archmodel.tables.base import Base
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from archmodel.tables.knowledge import (
    OBSERVATIONS,
    Document,
    MasonMark,
    Observation,
    OfPhase,
    Phase,
    Reference,
    Statement,
)
from archmodel.tables.relations import RELATIONS, SYMMETRIC, Membership, Relation
from archmodel.tables.structures import Structure
from tests.archmodel.stones import SHA, box_stone

STONES = tuple(f"S{number}" for number in range(14))
WHOLES = tuple(f"T{number}" for number in range(7))
TYPES = tuple(OBSERVATIONS)[:3]
SIGNS = ("A", "B")
PHASES = ("1", "2", "3")
KINDS = ("header", "stretcher", "voussoir", "keystone", "rubble")
SIDES = ("outer", "inner", None)

Row = dict[str, object]


@dataclass(frozen=True)
class Site:
    """All rows of a database that are held, and the database."""

    database: Database
    entities: dict[int, Row]
    relations: list[Row]
    structures: dict[int, Row]
    memberships: list[Row]
    statements: list[Row]
    phases: dict[int, str]
    documents: dict[int, str]

    def related(self, kind: str, subject: int, *, inverse: bool = False) -> set[int]:
        """The entities that one stands in a relation to."""
        found = set()
        for row in self.relations:
            ends = (row["subject_id"], row["object_id"])
            if row["kind"] == kind:
                for mine, theirs in (
                    (ends, ends[::-1]) if kind in SYMMETRIC else (ends[:: -1 if inverse else 1],)
                ):
                    if mine == subject:
                        found.add(theirs)
        return found  # type: ignore[return-value]

    def path(self, start: int, *, up: bool) -> set[int]:
        """All that rests on an entity, or that it rests on, directly or through others."""
        found: set[int] = set()
        waiting = [start]
        while waiting:
            for other in self.related("rests_on", waiting.pop(), inverse=up) - found:
                found.add(other)
                waiting.append(other)
        return found

    def parts(self, structure: int) -> set[int]:
        """A structure and all parts of it."""
        found = {structure}
        while more := {n for n, row in self.structures.items() if row["parent_id"] in found} - found:
            found |= more
        return found

    def wholes(self, entity: int) -> list[set[int]]:
        """Structures that an entity is a member of, then those that these are parts of, and so on."""
        level = {row["structure_id"] for row in self.memberships if row["entity_id"] == entity}
        levels = []
        while level and len(levels) < 20:
            levels.append(level & set(self.structures))
            level = {self.structures[n]["parent_id"] for n in levels[-1]} - {None}
        return levels  # type: ignore[return-value]

    def said(self, kind: str, *, of: int | None = None, about: int | None = None) -> list[Row]:
        """Statements of a kind about an entity, or about a structure."""
        return [
            row
            for row in self.statements
            if row["kind"] == kind
            and (row["entity_id"] == of if of is not None else row["structure_id"] == about)
        ]

    def phase(self, entity: int) -> str | None:
        """Name of the phase: its own, else that of the nearest structure; the latest statement decides."""
        said = self.said("of_phase", of=entity)
        for level in self.wholes(entity):
            if said:
                break
            said = [row for number in level for row in self.said("of_phase", about=number)]
        return self.phases[max(said, key=lambda row: row["id"])["phase_id"]] if said else None  # type: ignore[index,arg-type,return-value]

    def observations(self, entity: int) -> list[Row]:
        """Its own, and those of its structures of types that it has none of."""
        own = self.said("observation", of=entity)
        types = {row["type"] for row in own}
        above = set().union(*self.wholes(entity)) if self.wholes(entity) else set()
        inherited = [row for number in above for row in self.said("observation", about=number)]
        return own + [row for row in inherited if row["type"] not in types]


def _fill(database: Database, chance: random.Random) -> None:
    with database.session() as session:
        stones = [
            box_stone(
                code,
                chance.choice(KINDS),
                course=chance.choice([None, 1, 2]),
                at=(0.7 * n, 0.0, chance.random()),
            )
            for n, code in enumerate(STONES)
        ]
        store_survey(session, "site", "site.moma", SHA, stones)
        entry, later = (new_entry(session, "declaration", source) for source in ("first", "second"))

        def when() -> Row:
            return {"entry_id": entry.id, "superseded_id": chance.choice([None, None, later.id])}

        now = {"entry_id": entry.id, "superseded_id": None}
        entities = list(session.scalars(select(Entity.id).order_by(Entity.id)))
        _relate(session, chance, entities, when)
        structures: list[int] = []
        for code in WHOLES:
            row = Structure(
                kind="wall_facing",
                code=code,
                side=chance.choice(SIDES),
                number=chance.randrange(4),
                parent_id=chance.choice([None, *structures[-2:], *2 * structures[-1:]]),
                **now,
            )
            session.add(row)
            session.flush()
            structures.append(row.id)
        for _ in range(20):
            owner = {"entity_id": chance.choice(entities), "structure_id": chance.choice(structures)}
            session.add(Membership(**owner, declared=True, **when()))
        phases = [Phase(name=name, **now) for name in PHASES]
        document = Document(code="D1", type="drawing", title="Elevation", **now)
        session.add_all([*phases, document])
        session.flush()
        for _ in range(90):
            about = chance.choice(
                [{"entity_id": chance.choice(entities)}, {"structure_id": chance.choice(structures)}]
            )
            severity = chance.choice([None, 0, 1, 2, 3, 4])
            statement = chance.choice(
                [
                    OfPhase(phase_id=chance.choice(phases).id, **about, **when()),
                    MasonMark(sign=chance.choice(SIGNS), **about, **when()),
                    Observation(type=chance.choice(TYPES), severity=severity, **about, **when()),
                    Reference(document_id=document.id, **about, **when()),
                ]
            )
            session.add(statement)
            session.flush()


def _relate(session: object, chance: random.Random, entities: list[int], when: Callable[[], Row]) -> None:
    rows = []
    for number in range(60):
        kind = chance.choice([*RELATIONS, "rests_on"])
        first, second = chance.sample(entities, 2)
        if kind in SYMMETRIC:
            first, second = sorted((first, second))
        ends = {"subject_id": first, "object_id": second}
        empty = dict.fromkeys(("area", "gap", "x", "y", "z", "nx", "ny", "nz"))
        rows.append({"id": number + 1, "kind": kind, "declared": True, **ends, **empty, **when()})
    insert_rows(session, Relation, rows)  # type: ignore[arg-type]


def _held(database: Database, cls: type[Base]) -> list[Row]:
    """The rows of a table that are held, as they are stored."""
    with database.session(read_only=True) as session:
        rows = [dict(row) for row in session.execute(select(cls.__table__)).mappings()]
    return [row for row in rows if row.get("superseded_id") is None]


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def site(request: pytest.FixtureRequest) -> Iterator[Site]:
    with ExitStack() as held:
        url = "sqlite://"
        if request.param == "postgresql":
            url = held.enter_context(request.getfixturevalue("postgresql").database())
        database = held.enter_context(open_database(url))
        _fill(database, random.Random(9))
        yield Site(
            database,
            {row["id"]: row for row in _held(database, Entity)},  # type: ignore[misc]
            _held(database, Relation),
            {row["id"]: row for row in _held(database, Structure)},  # type: ignore[misc]
            _held(database, Membership),
            _held(database, Statement),
            {row["id"]: row["name"] for row in _held(database, Phase)},  # type: ignore[misc]
            {row["id"]: row["code"] for row in _held(database, Document)},  # type: ignore[misc]
        )


Meaning = Callable[[Site, int], bool | None]
Sentence = tuple[str, Meaning]


def coded(code: str) -> Sentence:
    return f"code = {code}", lambda site, n: site.entities[n]["code"] == code


def of_course(number: int) -> Sentence:
    def meaning(site: Site, n: int) -> bool | None:
        course = site.entities[n]["course"]
        return None if course is None else course == number

    return f"course = {number}", meaning


def of_kind(kind: str) -> Sentence:
    subkinds = {"stone": set(KINDS), "voussoir": {"voussoir", "keystone"}, "rubble": {"rubble"}}[kind]
    return f"is_a({kind})", lambda site, n: site.entities[n]["kind"] in subkinds


def near(code: str, radius: float) -> Sentence:
    def meaning(site: Site, n: int) -> bool:
        here = site.entities[n]
        there = next(row for row in site.entities.values() if row["code"] == code)
        square = sum((here[axis] - there[axis]) ** 2 for axis in "xyz")  # type: ignore[operator]
        return here is not there and square <= radius**2

    return f"within({code}, {radius})", meaning


def boxed(low: float, high: float) -> Sentence:
    low, high = min(low, high), max(low, high)
    return (
        f"within_box({low}, -9, 0, {high}, 9, 0.7)",
        lambda site, n: (
            low <= site.entities[n]["x"] <= high and 0 <= site.entities[n]["z"] <= 0.7  # type: ignore[operator]
        ),
    )


RELATED = {name: (name, False) for name in RELATIONS} | {"supports": ("rests_on", True)}


def related(name: str, other: Sentence | str | None) -> Sentence:
    kind, inverse = RELATED[name]

    def meaning(site: Site, n: int) -> bool:
        others = site.related(kind, n, inverse=inverse)
        return any(_meant(site, one, other) for one in others)

    return f"{name}({_written(other)})", meaning


def loaded(name: str, other: Sentence | str) -> Sentence:
    def meaning(site: Site, n: int) -> bool:
        return any(_meant(site, one, other) for one in site.path(n, up=name == "below"))

    return f"{name}({_written(other)})", meaning


def _written(other: Sentence | str | None) -> str:
    return other or "" if not isinstance(other, tuple) else other[0]


def _meant(site: Site, n: int, other: Sentence | str | None) -> bool:
    if isinstance(other, tuple):
        return other[1](site, n) is True
    return other is None or site.entities[n]["code"] == other


def member(code: str) -> Sentence:
    def meaning(site: Site, n: int) -> bool:
        (whole,) = (number for number, row in site.structures.items() if row["code"] == code)
        parts = site.parts(whole)
        return any(row["entity_id"] == n and row["structure_id"] in parts for row in site.memberships)

    return f"member_of({code})", meaning


def member_of_side(side: str) -> Sentence:
    def meaning(site: Site, n: int) -> bool:
        wholes = [number for number, row in site.structures.items() if row["side"] == side]
        parts = set().union(*(site.parts(number) for number in wholes))
        return any(row["entity_id"] == n and row["structure_id"] in parts for row in site.memberships)

    return f"member_of(side = {side})", meaning


def of_phase(name: str) -> Sentence:
    def meaning(site: Site, n: int) -> bool | None:
        phase = site.phase(n)
        return None if phase is None else phase == name

    return f"phase = {name}", meaning


def without_phase() -> Sentence:
    return "phase is null", lambda site, n: site.phase(n) is None


def marked(sign: str) -> Sentence:
    return f"has_mark({sign})", lambda site, n: any(
        not sign or row["sign"] == sign for row in site.said("mason_mark", of=n)
    )


def marks(count: int) -> Sentence:
    return f"marks >= {count}", lambda site, n: len(site.said("mason_mark", of=n)) >= count


def seen(type_: str, severity: int | None) -> Sentence:
    def meaning(site: Site, n: int) -> bool:
        return any(
            row["type"] == type_
            and (severity is None or (row["severity"] is not None and row["severity"] >= severity))  # type: ignore[operator]
            for row in site.observations(n)
        )

    return f"observed({type_}{'' if severity is None else f', {severity}'})", meaning


def severe(least: int) -> Sentence:
    def meaning(site: Site, n: int) -> bool | None:
        known = [row["severity"] for row in site.observations(n) if row["severity"] is not None]
        return max(known) >= least if known else None  # type: ignore[type-var,operator]

    return f"severity >= {least}", meaning


def counted(count: int) -> Sentence:
    return f"observations = {count}", lambda site, n: len(site.observations(n)) == count


def documented() -> Sentence:
    def meaning(site: Site, n: int) -> bool:
        above = set().union(*site.wholes(n)) if site.wholes(n) else set()
        about = [row for number in above for row in site.said("reference", about=number)]
        return bool(site.said("reference", of=n) or about)

    return "documented(D1)", meaning


def denied(inner: Sentence) -> Sentence:
    def meaning(site: Site, n: int) -> bool | None:
        value = inner[1](site, n)
        return None if value is None else not value

    return f"not ({inner[0]})", meaning


def joined(parts: list[Sentence], word: str) -> Sentence:
    decisive = word == "or"  # one true decides an or, one false decides an and

    def meaning(site: Site, n: int) -> bool | None:
        values = [part[1](site, n) for part in parts]
        if decisive in values:
            return decisive
        return None if None in values else not decisive

    return f" {word} ".join(f"({part[0]})" for part in parts), meaning


codes = st.sampled_from(STONES)
plain = st.one_of(
    st.builds(coded, codes),
    st.builds(of_course, st.integers(1, 2)),
    st.builds(of_kind, st.sampled_from(["stone", "voussoir", "rubble"])),
    st.builds(near, codes, st.floats(0.0, 5.0)),
    st.builds(boxed, st.floats(-1.0, 10.0), st.floats(-1.0, 10.0)),
    st.builds(related, st.sampled_from(sorted(RELATED)), st.one_of(st.none(), codes)),
    st.builds(loaded, st.sampled_from(["above", "below"]), codes),
    st.builds(member, st.sampled_from(WHOLES)),
    st.builds(member_of_side, st.sampled_from(["outer", "inner"])),
    st.builds(of_phase, st.sampled_from(PHASES)),
    st.builds(without_phase),
    st.builds(marked, st.sampled_from(["", *SIGNS])),
    st.builds(marks, st.integers(0, 2)),
    st.builds(seen, st.sampled_from(TYPES), st.one_of(st.none(), st.integers(0, 4))),
    st.builds(severe, st.integers(0, 4)),
    st.builds(counted, st.integers(0, 3)),
    st.builds(documented),
)
sentences = st.recursive(
    plain,
    lambda inner: st.one_of(
        inner.map(denied),
        st.builds(joined, st.lists(inner, min_size=2, max_size=3), st.sampled_from(["and", "or"])),
        st.builds(related, st.sampled_from(sorted(RELATED)), inner),
        st.builds(loaded, st.sampled_from(["above", "below"]), inner),
    ),
    max_leaves=5,
)


@settings(max_examples=150, deadline=None)
@given(sentences)
def test_a_function_finds_what_it_means(site: Site, sentence: Sentence) -> None:
    text, meaning = sentence
    expected = [row["code"] for n, row in site.entities.items() if meaning(site, n)]
    with site.database.session(read_only=True) as session:
        assert [one.code for one in find(session, "entity", text)] == expected


def test_the_site_has_what_the_sentences_ask_for(site: Site) -> None:
    """Else the test above could not fail."""
    numbers = list(site.entities)
    assert any(n in site.path(n, up=True) for n in numbers)
    assert any(len(site.wholes(n)) > 2 for n in numbers)
    own = {n for n in numbers if site.said("of_phase", of=n)}
    assert own
    assert any(site.phase(n) is not None for n in set(numbers) - own)
    assert any(site.phase(n) is None for n in numbers)
    assert any({row["structure_id"] for row in site.observations(n)} > {None} for n in numbers)
