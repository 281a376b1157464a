"""Materials, phases, documents, structures, relations: declared, declared again, declared otherwise, refused."""

from collections.abc import Callable

import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_members, declare_relation, declare_structure
from archmodel.assertions.declare import (
    PROPERTIES,
    PropertyValue,
    declare_document,
    declare_material,
    declare_phase,
)
from archmodel.assertions.withdraw import withdraw_members
from archmodel.database.session import Database
from archmodel.describe.entity import describe
from archmodel.store.find_by_code import Subjects, held_named, subjects
from archmodel.store.revisions import RowCounts, supersede, withdraw
from archmodel.tables.entries import Entry, held_at, new_entry
from archmodel.tables.knowledge import Document, MaterialProperty, Phase
from archmodel.tables.relations import Membership, Relation
from archmodel.tables.structures import Arch, Structure
from ground.errors import DatabaseError, UsageError

NEW, SAME, OTHER = RowCounts(new=1), RowCounts(unchanged=1), RowCounts(replaced=1)


def entry_of(session: Session) -> Entry:
    return new_entry(session, "declaration", "a test", author="T")


def test_a_phase_declared_otherwise_keeps_its_number_and_its_past(empty: Database) -> None:
    with empty.session() as session:
        first = entry_of(session)
        assert declare_phase(session, first, "2", begins=1240) == NEW
        assert declare_phase(session, first, "2", begins=1240) == SAME
        number = held_named(session, Phase, "2").id
        second = entry_of(session)
        assert declare_phase(session, second, "2", ends=1260, description="later") == OTHER
        assert declare_phase(session, second, "2") == SAME
        held = held_named(session, Phase, "2")
        assert (held.id, held.begins, held.ends, held.entry_id) == (number, 1240, 1260, second.id)
        (before,) = session.scalars(select(Phase).where(held_at(Phase, first.id)))
        assert (before.begins, before.ends, before.description) == (1240, None, None)
        assert held.supersedes_id == before.id


def test_properties_are_replaced_one_by_one(empty: Database) -> None:
    with empty.session() as session:
        entry = entry_of(session)
        given = {"density": PropertyValue(2300), "young": PropertyValue(9e9, sigma=1e9, source="cores")}
        assert declare_material(session, entry, "tuff", "soft", given) == RowCounts(new=3)
        assert declare_material(session, entry, "tuff", None, given) == RowCounts(unchanged=3)
        # from another source, nothing else is said
        elsewhere = new_entry(session, "declaration", "another test")
        assert declare_material(session, elsewhere, "tuff", None, given) == RowCounts(unchanged=3)
        later = entry_of(session)
        better = {"density": PropertyValue(2310, sigma=20), "grain": PropertyValue(0.004, unit="m")}
        assert declare_material(session, later, "tuff", None, better) == RowCounts(1, 1, 1)
        rows = session.scalars(select(MaterialProperty).order_by(MaterialProperty.id)).all()
        told = [(one.name, one.value, one.sigma, one.unit, one.source, one.superseded_id) for one in rows]
    assert told == [
        ("density", 2300.0, None, "kg/m³", "a test", later.id),
        ("young", 9e9, 1e9, "Pa", "cores", None),
        ("density", 2310.0, 20.0, "kg/m³", "a test", None),
        ("grain", 0.004, None, "m", "a test", None),
    ]


def test_a_property_that_cannot_be_is_refused(empty: Database) -> None:
    cases = [
        ("young", PropertyValue(9.0, unit="GPa"), "young in GPa; give it in Pa"),
        ("grain", PropertyValue(0.1), "the property 'grain' has no unit"),
        ("density", PropertyValue(0.0), "density is 0.0; give a finite number in kg/m³, above 0"),
        ("density", PropertyValue(float("nan")), "density is nan; give a finite number"),
        ("poisson", PropertyValue(0.5), "poisson is 0.5; give a finite number, at least 0.0, below 0.5"),
        ("density", PropertyValue(True), "density is True"),
        ("density", PropertyValue(2000.0, sigma=-1.0), "sigma of density is -1.0"),
        ("density", PropertyValue(10**400), "density is 1000"),
    ]
    with empty.session() as session:
        entry = entry_of(session)
        declare_material(session, entry, "tuff")
        for name, given, message in cases:
            with pytest.raises(UsageError, match=message):
                declare_material(session, entry, "tuff", properties={name: given})
        assert session.scalars(select(MaterialProperty)).all() == []


def test_every_usual_property_has_an_si_unit() -> None:
    assert {unit for unit, _ in PROPERTIES.values()} <= {"kg/m³", "Pa", "-"}


def test_members_are_ranked_and_stay(filled: Database) -> None:
    with filled.session() as session:
        entry = entry_of(session)
        declare_structure(session, entry, "building", "B")
        with pytest.raises(UsageError, match="V1 is a stone; give the structure a code of its own"):
            declare_structure(session, entry, "arch", "V1")
        assert declare_structure(session, entry, "arch", "ARCH", title="Arch", parent="B") == NEW
        stones = subjects(session, ["V3", "V1"]).entities
        assert declare_members(session, entry, "ARCH", stones) == RowCounts(new=2)
        assert declare_members(session, entry, "ARCH", stones, ordered=True) == RowCounts(replaced=2)
        assert declare_members(session, entry, "ARCH", stones) == RowCounts(unchanged=2)
        rows = session.scalars(select(Membership).where(held_at(Membership)).order_by(Membership.rank))
        assert [(one.entity.code, one.rank) for one in rows] == [("V3", 1), ("V1", 2)]
        arch = held_named(session, Structure, "ARCH")
        assert isinstance(arch, Arch)
        assert arch.parent is not None
        assert arch.parent.code == "B"


def test_no_structure_is_a_part_of_itself(empty: Database) -> None:
    with empty.session() as session:
        entry = entry_of(session)
        declare_structure(session, entry, "tower", "T")
        declare_structure(session, entry, "wall", "W", parent="T")
        with pytest.raises(UsageError, match="T would be a part of itself"):
            declare_structure(session, entry, "tower", "T", parent="W")


def test_relations_are_stored_once_whatever_side_they_are_seen_from(filled: Database) -> None:
    with filled.session() as session:
        entry = entry_of(session)
        one, other = subjects(session, ["W01-01", "W02-01"]).entities
        assert declare_relation(session, entry, "supports", [one], [other]) == NEW
        assert declare_relation(session, entry, "rests_on", [other], [one]) == SAME
        assert declare_relation(session, entry, "beside", [other], [one]) == NEW
        assert declare_relation(session, entry, "beside", [one], [other]) == SAME
        rows = session.scalars(select(Relation).order_by(Relation.id)).all()
        told = [(row.kind, row.subject_id, row.object_id, row.declared) for row in rows]
        assert told == [("rests_on", other, one, True), ("beside", one, other, True)]
        with pytest.raises(UsageError, match="1 stones would be in relation to themselves"):
            declare_relation(session, entry, "beside", [one], [one, other])


Declare = Callable[[Session, Entry], object]


def test_what_cannot_be_declared_is_refused(filled: Database) -> None:
    cases: list[tuple[Declare, str]] = [
        (lambda s, e: declare_phase(s, e, "2", 1300, 1200), "begins in 1300 and ends in 1200"),
        (lambda s, e: declare_phase(s, e, "2", 1.5), "begins is 1.5; give a whole number"),
        (lambda s, e: declare_phase(s, e, " "), "is not a name"),
        (lambda s, e: declare_phase(s, e, "2\n"), "is not a name"),
        (lambda s, e: declare_phase(s, e, "2", description="\0"), "cannot be typed"),
        (lambda s, e: declare_document(s, e, "D", "foto", "x"), "unknown type of document 'foto'"),
        (lambda s, e: declare_structure(s, e, "towr", "T"), "did you mean tower"),
        (lambda s, e: declare_structure(s, e, "tower", "T", parent="X"), "there is no structure 'X'"),
        (lambda s, e: declare_structure(s, e, "tower", "T", side="left"), "unknown side 'left'"),
        (lambda s, e: declare_structure(s, e, "tower", "T", number=-1), "number is -1"),
        (lambda s, e: declare_members(s, e, "WALL", [1]), "there is no structure 'WALL'"),
        (lambda s, e: declare_relation(s, e, "next_to", [1], [2]), "unknown relation 'next_to'"),
        (lambda s, e: subjects(s, ["W01-3"]), "no stone 'W01-3' in the database; did you mean W01-0"),
        (lambda s, e: subjects(s, ["\0"]), "is not a stone's code"),
    ]
    with filled.session() as session:
        entry = entry_of(session)
        for declare, message in cases:
            with pytest.raises(UsageError, match=message):
                declare(session, entry)
        for cls in (Phase, Document, Structure, Membership, Relation):
            assert session.scalars(select(cls)).all() == []


def test_a_declaration_after_a_withdrawal_is_a_new_one(empty: Database) -> None:
    with empty.session() as session:
        entry = entry_of(session)
        declare_document(session, entry, "P1", "photograph", "The arch", dated="1898")
        document = held_named(session, Document, "P1")
        assert withdraw(session, entry, document) == RowCounts(withdrawn=1)
        with pytest.raises(DatabaseError, match="is held no longer"):
            withdraw(session, entry, document)
        with pytest.raises(UsageError, match="there is no document 'P1'; declare it first"):
            held_named(session, Document, "P1")
        assert declare_document(session, entry, "P1", "photograph", "The door") == NEW
        assert held_named(session, Document, "P1").dated is None


def test_only_like_replaces_like(empty: Database) -> None:
    with empty.session() as session:
        entry = entry_of(session)
        declare_phase(session, entry, "2")
        with pytest.raises(UsageError, match="a Document cannot replace a Phase"):
            supersede(session, entry, held_named(session, Phase, "2"), Document(code="D"))


def test_what_was_computed_can_be_declared_too(filled: Database) -> None:
    with filled.session() as session:
        computed, entry = new_entry(session, "geometry", "solids"), entry_of(session)
        declare_structure(session, entry, "course", "course 1")
        one, other = subjects(session, ["W01-01", "W01-02"]).entities
        course = held_named(session, Structure, "course 1").id
        for number, rank in ((one, 1), (other, 2)):
            session.add(
                Membership(
                    entity_id=number, structure_id=course, rank=rank, declared=False, entry_id=computed.id
                )
            )
        session.flush()
        assert declare_members(session, entry, "course 1", [other]) == OTHER
        assert declare_members(session, entry, "course 1", [other]) == SAME
        held = session.scalars(select(Membership).where(held_at(Membership)).order_by(Membership.rank))
        assert [(row.entity_id, row.rank, row.declared) for row in held] == [
            (one, 1, False),
            (other, 2, True),
        ]
        with pytest.raises(UsageError, match="no such declared membership to withdraw"):
            withdraw_members(session, entry, Subjects((one,), (course,)))
        assert withdraw_members(session, entry, Subjects((other,), (course,))) == RowCounts(withdrawn=1)


def test_a_relation_that_is_computed_and_declared_is_told_once(filled: Database) -> None:
    with filled.session() as session:
        computed, entry = new_entry(session, "geometry", "solids"), entry_of(session)
        one, other = subjects(session, ["W01-01", "W02-01"]).entities
        values = {"subject_id": other, "object_id": one, "area": 0.12, "gap": 0.01, "declared": False}
        session.add(Relation(kind="rests_on", entry_id=computed.id, **values))
        declare_relation(session, entry, "rests_on", [other], [one])
        told = describe(session, "W01-01")["relations"]
    expected = {"code": "W02-01", "declared": True, "area": 0.12, "gap": 0.01, "entry": computed.id}
    assert told == {"supports": [expected]}
