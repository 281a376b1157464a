"""A building goes through one document and comes back to the last bit."""

import gzip
import json
import struct
from collections.abc import Callable
from datetime import UTC
from math import isfinite
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import (
    JSON,
    Boolean,
    Column,
    Date,
    Double,
    Integer,
    Interval,
    MetaData,
    String,
    Table,
    func,
    select,
    update,
)

from archmodel.database.session import Database, open_database
from archmodel.exchange.reader import import_building
from archmodel.exchange.sections import sections
from archmodel.exchange.values import value_of
from archmodel.exchange.writer import export_building
from archmodel.tables.base import ArrayType, UtcDateTime
from archmodel.tables.entities import Entity, Header, kinds
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import MadeOf, Material
from archmodel.tables.structures import Building, Tower, structure_kinds
from ground.errors import ExchangeError
from tests.archmodel.random_databases import everything, exact, fill, tables
from tests.postgresql import Server


def export(database: Database, path: Path) -> bytes:
    with database.session(read_only=True) as session:
        export_building(session, path)
    return path.read_bytes()


def random_building(database: Database, seed: int, rows: int = 5) -> None:
    with database.session() as session:
        fill(session, Random(seed), rows)


def test_every_column_of_every_table_has_its_place():
    told = {(section.table.name, field.column.name) for section in sections() for field in section.fields}
    assert told == {(table.name, column.name) for table in tables() for column in table.columns}


def test_what_a_row_refers_to_comes_before_it():
    order = [section.table for section in sections()]
    for table in order:
        targets = {key.column.table for key in table.foreign_keys} - {table}
        assert all(order.index(target) < order.index(table) for target in targets)


def test_a_column_whose_type_has_no_form_is_refused():
    table = Table("t", MetaData(), Column("lasted", Interval()))
    with pytest.raises(TypeError, match=r"t\.lasted: there is no JSON form for Interval"):
        value_of(table.c.lasted)


@pytest.mark.parametrize("seed", range(3))
def test_every_table_comes_back_as_it_was(seed: int, new_database: Callable[[], Database], tmp_path: Path):
    one, other = new_database(), new_database()
    random_building(one, seed)
    first = export(one, tmp_path / "one.json")
    counts = import_building(tmp_path / "one.json", other)
    assert counts == {table.name: 5 for table in tables()}
    assert everything(other) == everything(one)
    assert export(other, tmp_path / "other.json") == first


@settings(max_examples=5, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 2**64), rows=st.integers(1, 3))
def test_whatever_the_values_they_come_back(tmp_path_factory: pytest.TempPathFactory, seed: int, rows: int):
    path = tmp_path_factory.mktemp("exchange") / "building.json"
    with open_database("sqlite://") as one, open_database("sqlite://") as other:
        with one.session() as session:
            fill(session, Random(seed), rows)
        first = export(one, path)
        json.loads(first, parse_constant=pytest.fail)
        import_building(path, other)
        assert everything(other) == everything(one)
        assert export(other, path) == first


finite = st.floats(allow_nan=False, width=64)


@settings(max_examples=50, deadline=None)
@given(rows=st.lists(st.lists(st.one_of(finite, st.just(float("nan"))), min_size=3, max_size=3), max_size=4))
def test_arrays_keep_every_bit(rows: list[list[float]]):
    value = value_of(Column("points", ArrayType(-1, 3)))
    array = np.array(rows, dtype=float).reshape(-1, 3)
    again = value.decode(json.loads(json.dumps(value.encode(array), allow_nan=False)))
    assert (again.shape, again.dtype) == (array.shape, array.dtype)
    assert again.tobytes() == array.tobytes()


SCALARS: tuple[tuple[Any, st.SearchStrategy[Any]], ...] = (
    (Double(), finite),
    (Integer(), st.integers(-(2**63), 2**63 - 1)),
    (Boolean(), st.booleans()),
    (String(), st.text()),
    (Date(), st.dates()),
    (UtcDateTime(), st.datetimes(timezones=st.just(UTC))),
    (JSON(), st.recursive(st.none() | st.integers() | finite.filter(isfinite) | st.text(), st.lists)),
)


@settings(max_examples=100, deadline=None)
@given(case=st.sampled_from(SCALARS).flatmap(lambda one: st.tuples(st.just(one[0]), one[1])))
def test_single_values_keep_type_and_bits(case: tuple[Any, Any]):
    kind, value = case
    form = value_of(Column("c", kind))
    said = json.dumps(form.encode(value), allow_nan=False, ensure_ascii=False)
    assert exact(form.decode(json.loads(said))) == exact(value)


def test_from_sqlite_to_postgresql_and_back(postgresql: Server, tmp_path: Path):
    with (
        open_database("sqlite://") as one,
        postgresql.database() as url,
        open_database(url) as server,
        open_database("sqlite://") as again,
    ):
        random_building(one, 7)
        first = export(one, tmp_path / "one.json")
        import_building(tmp_path / "one.json", server)
        assert everything(server) == everything(one)
        assert export(server, tmp_path / "server.json") == first
        import_building(tmp_path / "server.json", again)
        assert everything(again) == everything(one)


def test_new_rows_are_numbered_after_those_taken_in(new_database: Callable[[], Database], tmp_path: Path):
    one, other = new_database(), new_database()
    random_building(one, 1)
    export(one, tmp_path / "one.json")
    import_building(tmp_path / "one.json", other)
    with other.session() as session:
        last = session.scalar(select(func.max(Entry.id)))
        assert last == 13
        assert new_entry(session, "declaration", "afterwards").id == 14
        session.add(Header(code="after", entry_id=14))
        session.flush()
        assert session.scalar(select(Entity.id).where(Entity.code == "after")) == 14


def test_entities_of_registered_kinds_are_of_them_at_once(
    new_database: Callable[[], Database], tmp_path: Path
):
    one, other = new_database(), new_database()
    with one.session() as session:
        fill(session, Random(2), 3)
    export(one, tmp_path / "one.json")
    assert "own_kind_0" not in kinds()
    import_building(tmp_path / "one.json", other)
    assert {"own_kind_0", "own_kind_2"} <= kinds().keys()
    assert "own_kind_1" in structure_kinds()
    with other.session(read_only=True) as session:
        assert len(list(session.scalars(select(Entity)))) == 3


def test_history_is_kept_in_whatever_order_rows_refer_to_one_another(
    empty: Database, new_database: Callable[[], Database], tmp_path: Path
):
    """The row that is held now keeps its number, so it names an older state that has a higher one."""
    with empty.session() as session:
        first = new_entry(session, "declaration", "the book").id
        then = new_entry(session, "declaration", "a better book").id
        session.add(Material(id=2, name="trachyte", entry_id=first, superseded_id=then))
        session.flush()
        session.add(Material(id=1, name="basalt", entry_id=then, supersedes_id=2))
        session.add(Building(id=9, code="castle", entry_id=first))
        session.flush()
        session.add(Tower(id=4, code="keep", entry_id=first, parent_id=9))
        session.flush()
        session.add(MadeOf(structure_id=4, material_id=1, entry_id=then))
    export(empty, tmp_path / "castle.json")
    other = new_database()
    import_building(tmp_path / "castle.json", other)
    assert everything(other) == everything(empty)
    with other.session(read_only=True) as session:
        assert session.get_one(Tower, 4).parent == session.get_one(Building, 9)
        assert session.get_one(Material, 1).supersedes_id == 2


def test_a_person_finds_every_row_of_a_stone_by_its_code(filled: Database, tmp_path: Path):
    lines = export(filled, tmp_path / "wall.json").decode().splitlines()
    document = json.loads("\n".join(lines))
    assert [*document] == [
        *("format", "format_version", "moma", "schema_version", "recorded_until", "units", "frame", "tables")
    ]
    assert document["units"]["length"] == "m"
    assert sum('"V3"' in line for line in lines) == 2
    (entity,) = (row for row in document["tables"]["entity"] if row["code"] == "V3")
    (measured,) = (row for row in document["tables"]["measurement"] if row["entity"] == "V3")
    assert measured["entity_id"] == entity["id"]
    assert measured["survey"] == "window"
    assert measured["rejected"] == [2, 5]
    assert entity["kind"] == "keystone"
    assert "course" not in entity
    corners = [[1.6, 0.0, 1.2], [1.8, 0.0, 1.2], [1.8, 0.0, 1.52], [1.6, 0.0, 1.52]]
    assert np.array(measured["outline"]) == pytest.approx(np.array(corners))


def test_numbers_have_the_shortest_digits_that_give_them_back(filled: Database, tmp_path: Path):
    text = export(filled, tmp_path / "wall.json").decode()
    assert '"depth": 0.42,' in text
    for number, said in (
        (-0.0, "-0.0"),
        (5e-324, "5e-324"),
        (1e308, "1e+308"),
        (1 / 3, "0.3333333333333333"),
    ):
        value = value_of(Column("depth", Double()))
        assert json.dumps(value.encode(number)) == said
        assert struct.pack("<d", value.decode(json.loads(said))) == struct.pack("<d", number)


def test_what_is_not_known_in_an_array_is_null(filled: Database, tmp_path: Path):
    encode = value_of(Column("a", ArrayType(-1))).encode
    assert encode(np.array([1.0, np.nan, np.inf, -np.inf])) == [1.0, None, "Infinity", "-Infinity"]


def test_compressed_documents_hold_the_same_bytes(
    filled: Database, new_database: Callable[[], Database], tmp_path: Path
):
    plain = export(filled, tmp_path / "wall.json")
    packed = export(filled, tmp_path / "wall.json.gz")
    assert gzip.decompress(packed) == plain
    assert export(filled, tmp_path / "again.json.gz") == packed
    other = new_database()
    import_building(tmp_path / "wall.json.gz", other)
    assert everything(other) == everything(filled)


def test_an_empty_database_makes_a_document_too(new_database: Callable[[], Database], tmp_path: Path):
    document = json.loads(export(new_database(), tmp_path / "empty.json"))
    assert document["recorded_until"] is None
    assert set(map(len, document["tables"].values())) == {0}
    other = new_database()
    assert set(import_building(tmp_path / "empty.json", other).values()) == {0}


def test_a_file_is_replaced_only_by_a_complete_one(filled: Database, tmp_path: Path):
    path = tmp_path / "wall.json"
    path.write_text("what was there")
    with filled.session() as session:
        session.execute(update(Entry).values(settings=[1, 2]))
    with pytest.raises(ExchangeError, match="entry id 1 settings: is a list, expected an object"):
        export(filled, path)
    assert path.read_text() == "what was there"
    assert [one.name for one in tmp_path.glob("*wall*")] == ["wall.json"]
