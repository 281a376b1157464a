"""Corrections: the entity has the new value, and both are kept."""

import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.correct import correct
from archmodel.database.session import Database
from archmodel.query.api import find
from archmodel.store.revisions import RowCounts
from archmodel.tables.entities import Entity, Header, Quoin, Voussoir
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import Correction
from ground.errors import UsageError


def entry_of(session: Session) -> Entry:
    return new_entry(session, "correction", "a test")


def corrections(session: Session) -> list[tuple[str, str, object, object]]:
    rows = session.scalars(select(Correction).order_by(Correction.id))
    return [(one.entity.code, one.attribute, one.before, one.after) for one in rows]


def test_a_stone_of_another_kind_is_found_among_those(filled: Database) -> None:
    with filled.session() as session:
        (loaded,) = find(session, "header", ["code = W01-01"])
        assert isinstance(loaded, Header)
        assert correct(session, entry_of(session), "W01-01", {"kind": "Quoin"}) == RowCounts(replaced=1)
        assert [one.code for one in find(session, "quoin")] == ["W01-01"]
        assert isinstance(find(session, "quoin")[0], Quoin)
        assert find(session, "header") == []
        assert corrections(session) == [("W01-01", "kind", "header", "quoin")]


def test_what_the_new_kind_has_not_is_given_up(filled: Database) -> None:
    with filled.session() as session:
        entry = entry_of(session)
        correct(session, entry, "V2", {"ring": 1, "rank": 2, "intrados_angle": 0.1})
        correct(session, entry, "V2", {"kind": "rib_segment"})
        stone = session.scalars(select(Entity).where(Entity.code == "V2")).one()
        assert (stone.kind, stone.rank) == ("rib_segment", 2)  # type: ignore[attr-defined]
        lost = {(name, before, after) for _, name, before, after in corrections(session)[3:]}
        assert lost == {("kind", "voussoir", "rib_segment"), ("ring", 1, None), ("intrados_angle", 0.1, None)}


def test_several_attributes_at_once(filled: Database) -> None:
    with filled.session() as session:
        values = {"code": "W9", "course": 3, "zone": "north", "tail_length": 0.2}
        assert correct(session, entry_of(session), "W01-01", values) == RowCounts(replaced=1)
        assert correct(session, entry_of(session), "W9", values) == RowCounts(unchanged=1)
        stone = session.scalars(select(Header)).one()
        assert (stone.code, stone.course, stone.zone, stone.tail_length) == ("W9", 3, "north", 0.2)
        assert correct(session, entry_of(session), "W9", {"zone": None, "course": None}) == RowCounts(
            replaced=1
        )
        assert corrections(session)[-2:] == [("W9", "zone", "north", None), ("W9", "course", 3, None)]


def test_what_cannot_be_corrected_is_refused(filled: Database) -> None:
    cases: list[tuple[str, dict[str, object], str]] = [
        ("W01-1", {"course": 1}, "no stone 'W01-1' in the database; did you mean W01-0"),
        ("W01-01", {"kind": "quion"}, "unknown kind 'quion'; did you mean quoin"),
        ("W01-01", {"kind": None}, "kind is None"),
        ("W01-01", {"curse": 1}, "unknown attribute 'curse'; did you mean course"),
        ("W01-01", {"ring": 1}, "unknown attribute 'ring'"),
        ("W01-01", {"code": "V1"}, "the code V1 is taken"),
        ("W01-01", {"code": None}, "code is None"),
        ("W01-01", {"code": " x"}, "is not a name"),
        ("W01-01", {"course": 1.5}, "course is 1.5"),
        ("W01-01", {"course": 2**40}, "course is 1099511627776"),
        ("W01-01", {"zone": 3}, "zone is 3; give a text"),
        ("W01-01", {"depth": 0.3}, "depth is no plain attribute; record it as a depth"),
        ("W01-01", {"volume": 0.3}, "volume of W01-01 follows from its survey"),
        ("W01-01", {"tail_length": "long"}, "tail_length is long; give a finite number in m"),
        ("W01-01", {"tail_length": float("inf")}, "tail_length is inf"),
        ("V2", {"rank": 1.5}, "rank is 1.5; give a whole number"),
        ("W01-01", {"id": 3}, "unknown attribute 'id'"),
        ("W01-01", {"own": 3}, "unknown attribute 'own'"),
    ]
    with filled.session() as session:
        entry = entry_of(session)
        for code, values, message in cases:
            with pytest.raises(UsageError, match=message):
                correct(session, entry, code, values)
        assert corrections(session) == []


def test_the_attributes_of_the_new_kind_can_come_with_it(filled: Database) -> None:
    with filled.session() as session:
        correct(session, entry_of(session), "R1", {"kind": "voussoir", "rank": 3})
        stone = session.scalars(select(Voussoir).where(Voussoir.code == "R1")).one()
        assert stone.rank == 3
