"""The published schema is that of the code, takes what is exported, and refuses what is not right."""

import json
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from archmodel.database.session import Database, open_database
from archmodel.exchange.json_schema import building_schema, schema_text
from archmodel.exchange.writer import export_building
from tests.archmodel.random_databases import fill, tables
from tests.paths import ROOT


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    return Draft202012Validator(building_schema())


def exported(seed: int, path: Path) -> Any:
    with open_database("sqlite://") as database:
        with database.session() as session:
            fill(session, Random(seed), 4)
        with database.session(read_only=True) as session:
            export_building(session, path)
    return json.loads(path.read_text(encoding="utf-8"))


def test_what_is_published_is_what_the_code_says():
    published = (ROOT / "docs/exchange.schema.json").read_text(encoding="utf-8")
    again = "python -m archmodel.exchange.json_schema > docs/exchange.schema.json"
    assert published == schema_text(), f"write it again: {again}"


def test_it_is_a_schema(validator: Draft202012Validator):
    Draft202012Validator.check_schema(building_schema())


def test_it_has_every_column_of_every_table():
    said = {
        name: {*row["properties"]} for name, row in building_schema()["$defs"].items() if name != "number"
    }
    assert said.keys() == {table.name for table in tables()}
    for table in tables():
        assert {column.name for column in table.columns} <= said[table.name]
        required = building_schema()["$defs"][table.name]["required"]
        assert set(required) == {column.name for column in table.columns if not column.nullable}


def test_most_columns_say_what_they_are():
    columns = [
        column
        for name, row in building_schema()["$defs"].items()
        if name != "number"
        for column in row["properties"].values()
    ]
    assert sum("description" in column for column in columns) > 0.95 * len(columns)
    assert not any("None" in column.get("description", "") for column in columns)


@pytest.mark.parametrize("seed", range(3))
def test_it_takes_what_is_exported(seed: int, validator: Draft202012Validator, tmp_path: Path):
    assert not [error.json_path for error in validator.iter_errors(exported(seed, tmp_path / "a.json"))]


def test_it_takes_surveyed_stones(filled: Database, validator: Draft202012Validator, tmp_path: Path):
    with filled.session(read_only=True) as session:
        export_building(session, tmp_path / "wall.json")
    assert validator.is_valid(json.loads((tmp_path / "wall.json").read_text(encoding="utf-8")))


BROKEN: tuple[tuple[str, Callable[[Any], object]], ...] = (
    ("$.format", lambda document: document.update(format="a diary")),
    ("$", lambda document: document.pop("units")),
    ("$", lambda document: document.update(more=1)),
    ("$.tables", lambda document: document["tables"].pop("relation")),
    ("$.tables.entity", lambda document: document["tables"].update(entity={})),
    ("$.tables.entity[0]", lambda document: document["tables"]["entity"][0].pop("code")),
    ("$.tables.entity[0]", lambda document: document["tables"]["entity"][0].update(heigth=1.0)),
    ("$.tables.entity[0].depth", lambda document: document["tables"]["entity"][0].update(depth="deep")),
    ("$.tables.entity[0].course", lambda document: document["tables"]["entity"][0].update(course=1.5)),
    ("$.tables.statement[0].kind", lambda document: document["tables"]["statement"][0].update(kind="guess")),
    ("$.tables.measurement[0].normal", lambda document: document["tables"]["measurement"][0].update(normal=[1.0])),
    (
        "$.tables.measurement[0].points[0][1]",
        lambda document: document["tables"]["measurement"][0].update(points=[[0.0, "1", 2.0]]),
    ),
    (
        "$.tables.entry[0].recorded_at",
        lambda document: document["tables"]["entry"][0].update(recorded_at="yesterday"),
    ),
)  # fmt: skip


@pytest.mark.parametrize(("path", "break_it"), BROKEN, ids=[path for path, _ in BROKEN])
def test_it_refuses_what_is_not_right(
    path: str, break_it: Callable[[Any], object], validator: Draft202012Validator, tmp_path: Path
):
    document = exported(0, tmp_path / "a.json")
    break_it(document)
    assert path in {error.json_path for error in validator.iter_errors(document)}
