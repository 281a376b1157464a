"""Kinds of a user's own: classes of their hierarchy while a database that registers them is open."""

import itertools
from collections.abc import Callable

import pytest
from sqlalchemy import select, update
from sqlalchemy.orm import Session, aliased

from archmodel.assertions.arrange import declare_members, declare_structure
from archmodel.assertions.correct import correct
from archmodel.assertions.register_kind import MAX_LEVELS, register_kind
from archmodel.database.session import Database, open_database
from archmodel.describe.entity import describe
from archmodel.describe.history import history
from archmodel.query.api import find
from archmodel.relations.graph import courses_in_order
from archmodel.store.revisions import RowCounts
from archmodel.store.stones import store_survey
from archmodel.tables.entities import (
    Ashlar,
    Entity,
    canon_of,
    kind_named,
    kinds,
    own_attributes,
)
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.hierarchy import definition_of, kind_chain
from archmodel.tables.knowledge import Correction
from archmodel.tables.registered import all_kinds
from archmodel.tables.structures import Rib, Structure, structure_kind_named, structure_kinds
from ground.errors import DatabaseError, MomaError, UsageError
from tests.archmodel.stones import box_stone

OWN: dict[str, tuple[str | None, str]] = {
    "slit_width": ("m", "clear width of the slit"),
    "slit_shape": (None, "in words"),
    "slit_count": ("-", "how many"),
}


def entry_of(session: Session) -> Entry:
    return new_entry(session, "declaration", "a test")


def merlon(session: Session, definition: str = "A stone of a merlon.") -> RowCounts:
    return register_kind(
        session, entry_of(session), "merlon", "coping", definition, canon="depth < length", attributes=OWN
    )


def test_a_registered_kind_is_like_any_other(filled: Database) -> None:
    with filled.session() as session:
        assert merlon(session) == RowCounts(new=1)
        assert merlon(session) == RowCounts(unchanged=1)
        register_kind(session, entry_of(session), "corner_merlon", "merlon", "A merlon's stone at a corner.")
        cls = kind_named("Corner merlon")
        assert definition_of(kind_named("merlon")) == "A stone of a merlon."
        assert canon_of(cls) == "depth < length"
        assert list(own_attributes(cls))[-len(OWN) :] == list(OWN)
        store_survey(
            session,
            "more",
            "more.moma",
            "cd" * 32,
            [box_stone("M1", "merlon"), box_stone("M2", "corner_merlon")],
        )
        assert [one.code for one in find(session, "merlon")] == ["M1", "M2"]
        assert [one.code for one in find(session, "coping", ["kind = corner_merlon"])] == ["M2"]
        assert len(session.scalars(select(Ashlar)).all()) == 8


def test_values_of_its_attributes_are_set_by_corrections(filled: Database) -> None:
    with filled.session() as session:
        merlon(session)
        entry = entry_of(session)
        values = {"kind": "merlon", "slit_width": 0.1, "slit_shape": "a cross", "slit_count": 2}
        correct(session, entry, "W01-01", values)
        correct(session, entry, "W01-01", {"slit_width": 0.12, "slit_shape": None})
        told = describe(session, "W01-01")
        assert told["own"] == {
            "slit_width": {"value": 0.12, "unit": "m", "definition": "clear width of the slit"},
            "slit_count": {"value": 2.0, "unit": "-", "definition": "how many"},
        }
        with pytest.raises(UsageError, match="slit_width is wide; give a finite number in m"):
            correct(session, entry, "W01-01", {"slit_width": "wide"})
        with pytest.raises(UsageError, match="slit_shape is 3; give a text"):
            correct(session, entry, "W01-01", {"slit_shape": 3})
        correct(session, entry, "W01-01", {"kind": "header"})
        stone = session.scalars(select(Entity).where(Entity.code == "W01-01")).one()
        assert stone.own is None
        last = session.scalars(select(Correction).order_by(Correction.id.desc()).limit(3)).all()
        assert {(one.attribute, one.before, one.after) for one in last} == {
            ("kind", "merlon", "header"),
            ("slit_width", 0.12, None),
            ("slit_count", 2.0, None),
        }


def test_it_is_known_as_long_as_a_database_that_registers_it_is_open(new_url: Callable[[], str]) -> None:
    url = new_url()
    with open_database(url) as database, database.session() as session:
        merlon(session)
        assert "merlon" in kinds()
    assert "merlon" not in kinds()
    with pytest.raises(UsageError, match="unknown kind 'merlon'"):
        kind_named("merlon")
    with open_database(url), open_database(url) as again:
        assert "merlon" in kinds()
        again.close()
        assert "merlon" in kinds()
    assert "merlon" not in kinds()


def test_what_was_rolled_back_is_not_known(empty: Database) -> None:
    with empty.session() as session:
        attempt = session.begin_nested()
        merlon(session)
        attempt.rollback()
        assert merlon(session, "Another stone.") == RowCounts(new=1)
        assert definition_of(kind_named("merlon")) == "Another stone."


def test_two_buildings_can_mean_different_things_but_not_at_once(new_url: Callable[[], str]) -> None:
    first, second = new_url(), new_url()
    for url, definition in ((first, "A stone of a merlon."), (second, "A small merle.")):
        with open_database(url) as database, database.session() as session:
            merlon(session, definition)
            store_survey(session, "w", "w.moma", "ef" * 32, [box_stone("M1", "merlon")])
    with open_database(first):
        with pytest.raises(DatabaseError, match="the kind merlon means something else here"):
            open_database(second)
        assert definition_of(kind_named("merlon")) == "A stone of a merlon."
    with open_database(second) as database, database.session(read_only=True) as session:
        (stone,) = find(session, "merlon")
        assert definition_of(type(stone)) == "A small merle."


def test_what_cannot_be_registered_is_refused(empty: Database) -> None:
    cases: list[tuple[dict[str, object], str]] = [
        ({"name": "header"}, "there is a kind header already"),
        ({"name": "tower"}, "there is a kind tower already"),
        ({"name": "header", "parent": "rib"}, "there is a kind header already"),
        ({"parent": "ribb"}, "unknown kind 'ribb'; did you mean rib"),
        (
            {"parent": "rib", "canon": "depth > 1"},
            "unknown attribute 'depth'; the attributes are code, kind, title",
        ),
        ({"canon": "depth/length = 2"}, "no measured number equals another exactly; give a tolerance"),
        ({"parent": "rib", "attributes": {"slit": ("m", "x")}}, "leave out attributes"),
        ({"name": "merlon"}, "registered already, with another definition"),
        (
            {"name": "merlon", "parent": "coping", "definition": "A stone of a merlon.", "attributes": OWN},
            r"with other canonical proportions; change these alone: \[\[canon\]\] kind = \"merlon\"",
        ),
        ({"name": "Merlon"}, "'Merlon' is not the name of a kind; write it in small letters"),
        ({"name": "x" * 41}, "is not the name of a kind"),
        ({"name": "drop table"}, "is not the name of a kind"),
        ({"parent": "ashlra"}, "unknown kind 'ashlra'; did you mean ashlar"),
        ({"definition": "  "}, "definition '  ' has no visible character"),
        ({"canon": "depth >"}, "is not a value"),
        ({"canon": "slit_widht < depth"}, "unknown attribute 'slit_widht'"),
        ({"attributes": {"within": ("m", "x")}}, "within means something already"),
        ({"attributes": {"depth": ("m", "x")}}, "depth means something already"),
        ({"attributes": {"metadata": ("m", "x")}}, "metadata means something already"),
        ({"attributes": {"own": ("m", "x")}}, "own means something already"),
        ({"canon": "rests_on(V1) or depth > 1"}, "rests_on.* canonical proportions cannot ask functions"),
        ({"canon": "not canonical()"}, "canonical proportions cannot ask functions"),
        ({"canon": "depth > 1 and length > von_mises_max@5"}, "canonical proportions cannot ask a run"),
        ({"attributes": {"and": ("m", "x")}}, "and means something already"),
        ({"attributes": {"tail_length": ("m", "x")}}, "tail_length means something already"),
        ({"attributes": {"Slit": ("m", "x")}}, "'Slit' is not the name of an attribute"),
        (
            {"attributes": {"slit_width": ("cm", "x")}},
            "slit_width .cm. is an attribute of another kind, in m",
        ),
        ({"attributes": {"slit": ("m", "")}}, "definition of slit '' has no visible character"),
    ]
    usual: dict[str, object] = {"name": "slab_of_merlon", "parent": "ashlar", "definition": "A slab."}
    with empty.session() as session:
        merlon(session)
        entry = entry_of(session)
        for given, message in cases:
            with pytest.raises(MomaError, match=message):
                register_kind(session, entry, **(usual | given))  # type: ignore[arg-type]
        assert set(kinds()) & {"merlon", "slab_of_merlon"} == {"merlon"}


def test_cases_of_cases_end_somewhere_and_cost_no_more_than_others(filled: Database) -> None:
    with filled.session() as session:
        entry = entry_of(session)
        names = ["coping", *(f"case_{k}" for k in range(1, MAX_LEVELS - 3))]
        for parent, name in itertools.pairwise(names):
            register_kind(session, entry, name, parent, f"A case of {parent}.")
        with pytest.raises(UsageError, match="case_18 is a case of a case, 20 times over"):
            register_kind(session, entry, "case_18", names[-1], "One too many.")
        store_survey(session, "deep", "deep.moma", "ef" * 32, [box_stone("D1", names[-1])])
        # an alias of an entity takes one of each kind, not one of each way through the hierarchy
        other = aliased(Entity)
        assert [one.code for one in session.scalars(select(other).where(other.kind == names[-1]))] == ["D1"]
        assert [one.code for one in find(session, "case_9")] == ["D1"]


@pytest.mark.parametrize("name", ["own", "metadata", "registry", "entry", "tail_length"])
def test_attributes_are_not_named_like_members_of_the_classes(empty: Database, name: str) -> None:
    given = {name: ("m", "the width")}
    with empty.session() as session, pytest.raises(UsageError, match=f"{name} means something"):
        register_kind(session, entry_of(session), "slab_of_own", "ashlar", "A slab.", attributes=given)


def wall_rib(session: Session, definition: str = "A rib along a wall.", parent: str = "rib") -> RowCounts:
    return register_kind(session, entry_of(session), "wall_rib", parent, definition)


def test_no_name_is_in_both_hierarchies() -> None:
    assert not set(kinds()) & set(structure_kinds())
    assert len(all_kinds()) == len(kinds()) + len(structure_kinds())


def test_a_registered_kind_of_structure_is_like_any_other(filled: Database) -> None:
    with filled.session() as session:
        assert wall_rib(session) == RowCounts(new=1)
        assert wall_rib(session) == RowCounts(unchanged=1)
        register_kind(session, entry_of(session), "corner_rib", "wall_rib", "A wall rib at a corner.")
        cls = structure_kind_named("Corner rib")
        assert kind_chain(cls) == (Structure, Rib, structure_kind_named("wall_rib"), cls)
        assert "wall_rib" not in kinds()
        stones = {one.code: one.id for one in session.scalars(select(Entity))}
        for kind, code, stone in (("rib", "R", "V1"), ("wall_rib", "W", "V2"), ("corner_rib", "C", "V3")):
            declare_structure(session, entry_of(session), kind, code)
            declare_members(session, entry_of(session), code, [stones[stone]])
        session.expire_all()
        assert describe(session, "C")["definition"] == "A wall rib at a corner."
        for question, found in (
            ("kind like rib", ["V1"]),
            ("kind = rib", ["V1", "V2", "V3"]),
            ("kind != wall_rib", ["V1"]),
            ("is_a(rib)", ["V1", "V2", "V3"]),
            ("is_a(wall_rib)", ["V2", "V3"]),
            ("is_a(structure) and not is_a(wall_rib)", ["V1"]),
            ("is_a(arch)", []),
        ):
            assert [one.code for one in find(session, "voussoir", [f"member_of({question})"])] == found
        with pytest.raises(UsageError, match="did you mean wall_rib"):
            find(session, "entity", ["member_of(is_a(wallrib))"])
        # a class of its hierarchy alone
        with pytest.raises(UsageError, match=r"it is a kind of structure; ask .*member_of\(is_a\(wall_rib"):
            find(session, "wall_rib")
        rows = {one.code: type(one) for one in session.scalars(select(Structure))}
        assert (rows["C"], rows["R"]) == (cls, Rib)


def test_what_a_structure_was_before_its_kind_was_told_better_is_kept(filled: Database) -> None:
    with filled.session() as session:
        first = entry_of(session)
        declare_structure(session, first, "rib", "R", title="the southern one")
        wall_rib(session)
        assert declare_structure(session, entry_of(session), "wall_rib", "R") == RowCounts(replaced=1)
        session.expire_all()
        assert describe(session, "R")["kind"] == "wall_rib"
        then = describe(session, "R", first.id)
        assert (then["kind"], then["title"]) == ("rib", "the southern one")
        assert [one.says["kind"] for one in history(session, "R")] == ["rib", "wall_rib"]


def test_kinds_of_structures_are_known_while_a_database_that_registers_them_is_open(
    new_url: Callable[[], str],
) -> None:
    first, second = new_url(), new_url()
    with open_database(first) as database, database.session() as session:
        wall_rib(session)
        declare_structure(session, entry_of(session), "wall_rib", "R")
    assert "wall_rib" not in structure_kinds()
    with open_database(second) as database, database.session() as session:
        # the same name, and even in the other hierarchy, once the first one is closed
        wall_rib(session, "A stone.", "ashlar")
        assert "wall_rib" in kinds()
        assert "wall_rib" not in structure_kinds()
        with pytest.raises(DatabaseError, match="the kind wall_rib means something else here"):
            open_database(first)
    with open_database(first) as database, database.session(read_only=True) as session:
        assert describe(session, "R")["definition"] == "A rib along a wall."
        assert "wall_rib" not in kinds()


def test_a_kind_of_structure_that_was_rolled_back_is_not_known(empty: Database) -> None:
    with empty.session() as session:
        attempt = session.begin_nested()
        wall_rib(session)
        attempt.rollback()
        assert wall_rib(session, "A stone.", "ashlar") == RowCounts(new=1)
        assert "wall_rib" not in structure_kinds()


def test_a_kind_of_structure_that_another_program_stored_is_named(filled: Database) -> None:
    with filled.session() as session:
        declare_structure(session, entry_of(session), "rib", "R")
        session.execute(update(Structure).values(kind="tierceron"))
        session.expunge_all()
        for told in (describe, history):
            with pytest.raises(DatabaseError, match="a kind 'tierceron' that is not declared"):
                told(session, "R")


def test_a_case_of_a_course_is_a_course(filled: Database) -> None:
    with filled.session() as session:
        entry = entry_of(session)
        numbers = session.scalars(select(Entity.id).where(Entity.course == 1)).all()
        register_kind(session, entry, "plinth", "course", "A course that projects at the foot of a wall.")
        declare_structure(session, entry, "plinth", "P", number=1)
        declare_members(session, entry, "P", numbers, ordered=True)
        assert [one.code for one in courses_in_order(session)] == ["P"]
