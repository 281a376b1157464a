"""The schema as a tree, held against the classes themselves."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from archmodel.assertions.register_kind import register_kind
from archmodel.database.session import Database
from archmodel.describe.schema_tree import schema
from archmodel.query.api import attributes, find, find_rows
from archmodel.query.compile import condition
from archmodel.store.stones import store_survey
from archmodel.tables.entities import (
    Entity,
    Keystone,
    kinds,
    own_attributes,
)
from archmodel.tables.entries import new_entry
from archmodel.tables.hierarchy import definition_of, kind_of
from archmodel.tables.registered import RegisteredKind, declare_registered
from archmodel.tables.relations import INVERSE
from archmodel.tables.structures import structure_kinds
from ground.errors import QueryError, UsageError
from moma.cli.text.schema import schema_lines
from tests.archmodel.stones import SHA, box_stone, store


def branches(tree: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for branch in tree["kinds"]:
        yield branch
        yield from branches(branch)


def test_every_kind_is_below_what_it_is_a_case_of() -> None:
    tree = json.loads(json.dumps(schema()))
    assert [branch["kind"] for branch in branches(tree)] == list(kinds())
    for branch in branches(tree):
        cls = kinds()[branch["kind"]]
        assert branch["definition"] == definition_of(cls)
        assert [one["name"] for one in branch["attributes"]] == [
            one.name for one in cls.__dict__.get("__own__", ())
        ]
        assert branch["canonical"] == cls.__dict__.get("__canon__")
        # kinds that another test registered remain classes, but are known no longer
        known = [sub for sub in cls.__subclasses__() if kinds().get(kind_of(sub)) is sub]
        assert [sub["kind"] for sub in branch["kinds"]] == [kind_of(sub) for sub in known]


def test_structures_relations_and_attributes_are_all_there() -> None:
    tree: Any = schema()
    assert [one["kind"] for one in tree["structures"]] == list(structure_kinds())
    assert {one["relation"] for one in tree["relations"]} == {*INVERSE, "member_of"}
    assert [one["name"] for one in tree["attributes"]] == [one.name for one in attributes()]
    assert all(one["definition"] for key in ("structures", "relations", "attributes") for one in tree[key])


def test_one_kind_tells_what_it_inherits() -> None:
    tree: Any = schema(kind="keystone")
    assert list(tree) == ["kinds"]
    (keystone,) = tree["kinds"]
    assert [one["name"] for one in keystone["attributes"]] == [*own_attributes(Keystone)]
    assert keystone["kinds"] == []
    with pytest.raises(UsageError, match="did you mean keystone"):
        schema(kind="kestone")


@pytest.fixture
def with_merlon(empty: Database) -> Database:
    """A database that registers merlons, corner merlons, and has two of them."""
    with empty.session() as session:
        entry = new_entry(session, "declaration", "field book")
        register_kind(
            session,
            entry,
            "merlon",
            "ashlar",
            "A stone of a parapet between two openings.",
            canon="height >= length and width_of_top > 0",
            attributes={"width_of_top": ("m", "of its upper face"), "form": (None, "flat or swallowtail")},
        )
        register_kind(session, entry, "corner_merlon", "merlon", "A merlon where two parapets meet.")
    with empty.session() as session:
        stones = [
            box_stone("M1", "merlon", size=(0.5, 0.4, 0.9)),
            box_stone("M2", "corner_merlon", size=(0.9, 0.4, 0.5)),
            box_stone("M3", "merlon"),
            box_stone("H1", "header"),
        ]
        store_survey(session, "parapet", "parapet.moma", SHA, stones)
    with empty.session() as session:
        own = {
            "M1": {"width_of_top": 0.4, "form": "flat"},
            "M2": {"width_of_top": 0.2, "form": "Swallowtail"},
        }
        for entity in session.query(Entity):
            entity.own = own.get(entity.code)  # type: ignore[assignment]
    return empty


def test_a_registered_kind_is_in_the_tree_of_its_database_alone(with_merlon: Database) -> None:
    with with_merlon.session(read_only=True) as session:
        (merlon,) = (one for one in branches(schema(session)) if one["kind"] == "merlon")
    assert merlon["registered"]
    assert [sub["kind"] for sub in merlon["kinds"]] == ["corner_merlon"]
    assert "merlon" not in [one["kind"] for one in branches(schema())]


def test_a_registered_kind_of_structure_is_listed_with_its_parent(empty: Database) -> None:
    with empty.session() as session:
        entry = new_entry(session, "declaration", "field book")
        register_kind(session, entry, "wall_rib", "rib", "A rib where a web meets a wall: formeret.")
        tree: Any = schema(session)
        ribs: Any = schema(session, "rib")
    assert [one["kind"] for one in ribs["structures"]] == ["rib", "wall_rib"]
    assert next(schema_lines(ribs)) == "Structures"
    listed = {one["kind"]: (one["registered"], one["parent"]) for one in tree["structures"]}
    assert (listed["structure"], listed["rib"]) == ((False, None), (False, "structure"))
    assert listed["wall_rib"] == (True, "rib")
    line = next(line for line in schema_lines(tree) if "wall_rib" in line)
    told = "registered, a case of rib: A rib where a web meets a wall: formeret."
    assert line.split(maxsplit=1) == ["wall_rib", told]
    assert "wall_rib" not in [one["kind"] for one in schema()["structures"]]  # type: ignore[attr-defined]


FOUND = {
    "width_of_top > 0.3": ["M1"],
    "width_of_top <= depth": ["M1", "M2"],
    "width_of_top is null": ["M3", "H1"],
    "form = flat": ["M1"],
    "form like swallow%": ["M2"],
    "form in (flat, Swallowtail)": ["M1", "M2"],
    "canonical() and is_a(merlon)": ["M1"],
    "not canonical() and is_a(merlon)": ["M2", "M3"],
    "is_a(merlon) and canonical() is null": [],
    "kind = corner_merlon": ["M2"],
}


def test_attributes_of_registered_kinds_can_be_asked_for(with_merlon: Database) -> None:
    with with_merlon.session(read_only=True) as session:
        found = {text: [one.code for one in find(session, "entity", text)] for text in FOUND}
        rows = find_rows(session, "merlon", columns=["code", "form", "width_of_top"])
        assert [one.code for one in session.query(Entity).where(condition(session, "form = flat"))] == ["M1"]
    # height < length decides for M3, though its width is not known
    assert found == FOUND
    assert rows[0] == {"code": "M1", "form": "flat", "width_of_top": 0.4}
    assert [one["form"] for one in rows] == ["flat", "Swallowtail", None]


def test_another_database_does_not_know_them(
    with_merlon: Database, new_database: Callable[[], Database]
) -> None:
    other = new_database()
    store(other, [box_stone("H1", "header")])
    with other.session(read_only=True) as session:
        with pytest.raises(QueryError, match="unknown attribute 'form'"):
            find(session, "entity", "form = flat")
        assert [one.code for one in find(session, "entity", "canonical() is not null")] == ["H1"]
        assert "merlon" not in [one["kind"] for one in branches(schema(session))]


@pytest.mark.parametrize(
    ("canon", "message"),
    [
        ("breadth > 2", r"character 1: the canonical proportions of odd .*'breadth'"),
        ("not canonical()", "canonical proportions of odd .* cannot refer to canonical"),
        ("depth >", "canonical proportions of odd .* the end is not a value"),
    ],
)
def test_proportions_that_cannot_be_understood_are_named(empty: Database, canon: str, message: str) -> None:
    """As another version of the program may have stored them; `register_kind` refuses them."""
    with empty.session() as session:
        entry = new_entry(session, "declaration", "field book")
        odd = RegisteredKind(
            name="odd",
            parent="ashlar",
            definition="An odd stone.",
            canon=canon,
            attributes={},
            entry_id=entry.id,
        )
        session.add(odd)
        session.flush()
        declare_registered(session)
        with pytest.raises(QueryError, match=message):
            find(session, "entity", "canonical()")


def test_a_kind_with_a_column_of_its_own_is_asked_for_like_any_other() -> None:
    # In a process of its own, since a kind cannot be taken back.
    program = '''
from sqlalchemy.orm import Mapped
from archmodel.database.session import open_database
from archmodel.tables.base import attribute
from archmodel.tables.entities import Ashlar
from archmodel.query.api import find
from archmodel.store.stones import store_survey
from tests.archmodel.stones import SHA, box_stone

question = "not rests_on(depth > 9) and is_a(header)"
with open_database("sqlite://") as database, database.session() as session:
    assert find(session, "entity", question) == []

class Merlon(Ashlar):
    """A stone of a parapet between two openings."""

    __canon__ = "top_width < length"

    top_width: Mapped[float | None] = attribute("m", "of its upper face")

with open_database("sqlite://") as database, database.session() as session:
    store_survey(session, "parapet", "p", SHA, [box_stone("M1", "merlon"), box_stone("M2", "merlon")])
    merlon, other = find(session, "merlon")
    merlon.top_width = 0.2
    session.flush()
    for text in ("top_width > 0.1", "canonical()", "kind = merlon and not top_width is null"):
        assert find(session, "entity", text) == [merlon]
        assert find(session, "entity", f"not supports({text}) and code = M1") == [merlon]
'''
    subprocess.run([sys.executable, "-W", "error", "-c", program], check=True)
