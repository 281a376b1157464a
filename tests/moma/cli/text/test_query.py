"""moma query and moma schema: columns, runs and formats."""

import csv
import io
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from archmodel.database.session import open_database
from archmodel.describe.schema_tree import schema
from archmodel.query.attributes import ATTRIBUTES
from archmodel.tables.entities import Rubble, Voussoir, kinds, own_attributes
from moma.cli.text.formats import as_table
from moma.cli.text.schema import print_schema, schema_lines
from tests.archmodel.conftest import WALL
from tests.archmodel.known_wall import furnish
from tests.archmodel.stones import store
from tests.moma.commands import answer, invoke, prints


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    url = f"sqlite:///{tmp_path_factory.mktemp('answers') / 'moma.db'}"
    with open_database(url) as database:
        store(database, WALL, "window")
        furnish(database)
    return url


def heads(text: str) -> list[str]:
    return [word for word in text.splitlines()[0].split() if not word.startswith("[")]


def test_a_table_has_the_usual_columns_and_those_that_are_asked_for(url: str) -> None:
    usual = ["code", "kind", "course", "depth", "length", "height", "volume", "rms", "rejected"]
    assert heads(prints("query", "header", "--db", url)) == usual
    asked = prints(
        "query", "header", "--where", "phase = 1 and has_mark() and not rests_on(x > 0)", "--db", url
    )
    assert heads(asked) == [*usual, "phase"]


def test_a_table_shows_the_runs_that_were_compared(url: str) -> None:
    text = prints(
        "query", "voussoir", "--where", "von_mises_max@2 < von_mises_max@1 and rank > 0", "--db", url
    )
    assert heads(text)[-3:] == ["rank", "von_mises_max@2", "von_mises_max@1"]
    assert text.splitlines()[2].split()[-2:] == ["3e+05", "9e+05"]


def test_a_column_that_is_asked_for_is_shown_though_it_is_empty(url: str) -> None:
    assert heads(prints("query", "rubble", "--where", "phase is null", "--db", url))[-1] == "phase"


def test_columns_are_chosen(url: str) -> None:
    arguments = ("query", "voussoir", "--columns", "code, phase,von_mises_max@1")
    assert heads(prints(*arguments, "--db", url)) == ["code", "phase", "von_mises_max@1"]
    rows = list(csv.reader(io.StringIO(prints(*arguments, "--format", "csv", "--db", url))))
    assert rows == [
        ["code", "phase", "von_mises_max@1"],
        ["V1", "2", "900000.0"],
        ["V2", "2", "800000.0"],
        ["V3", "2", "700000.0"],
    ]
    done = invoke("query", "voussoir", "--columns", "code,fase", "--db", url)
    assert done.exit_code == 2
    assert "did you mean phase" in done.stderr


def test_json_has_every_attribute_and_those_of_the_kind(url: str) -> None:
    rows = answer("query", "voussoir", "--db", url)
    assert list(rows[0]) == [*ATTRIBUTES, *own_attributes(Voussoir)]
    assert list(answer("query", "rubble", "--db", url)[0]) == [*ATTRIBUTES, *own_attributes(Rubble)]


def test_a_run_is_chosen(url: str) -> None:
    stress = [
        answer("query", "keystone", *run, "--db", url)[0]["von_mises_max"]
        for run in ((), ("--run", "1"), ("--run", "2"))
    ]
    assert stress == [None, 7e5, None]
    done = invoke("query", "keystone", "--run", "12", "--db", url)
    assert done.exit_code == 2
    assert "the runs are 1, 2" in done.stderr


def test_geojson_lies_in_space_or_in_the_plane_of_the_wall(url: str) -> None:
    arguments = ("query", "voussoir", "--format", "geojson", "--columns", "code,phase")
    spatial = json.loads(prints(*arguments, "--db", url))
    flat = json.loads(prints(*arguments, "--flat", "--db", url))
    assert [one["properties"] for one in flat["features"]] == [
        {"code": code, "phase": "2"} for code in ("V1", "V2", "V3")
    ]
    for one, other in zip(spatial["features"], flat["features"], strict=True):
        corners, drawn = (feature["geometry"]["coordinates"][0] for feature in (one, other))
        assert drawn == [[x, z] for x, _, z in corners]


def test_geojson_has_a_line_for_each_stone(url: str) -> None:
    text = prints("query", "entity", "--format", "geojson", "--db", url)
    assert len(text.splitlines()) == len(WALL) + 2
    assert list(json.loads(text)["features"][0]["properties"])[: len(ATTRIBUTES)] == list(ATTRIBUTES)


def test_flat_is_for_geojson(url: str) -> None:
    done = invoke("query", "voussoir", "--flat", "--db", url)
    assert done.exit_code == 2
    assert "--format geojson" in done.stderr


def test_nothing_found_is_said(url: str) -> None:
    done = invoke("query", "sill", "--where", "depth > 9", "--columns", "code", "--db", url)
    assert (done.exit_code, done.stdout) == (0, "")
    assert "no sill found, where depth > 9" in done.stderr
    assert json.loads(prints("query", "sill", "--format", "geojson", "--db", url))["features"] == []


def test_the_schema_is_a_tree(url: str) -> None:
    lines = prints("schema", "--db", url).splitlines()
    assert lines[0].startswith("entity  A part of the building")
    tree = lines[: lines.index("")]
    assert [line.lstrip("│├└─ ").split("  ")[0] for line in tree if "──" in line] == list(kinds())[1:]
    depth = {line.lstrip("│├└─ ").split("  ")[0]: line.index("──") // 4 for line in tree if "──" in line}
    assert (depth["stone"], depth["ashlar"], depth["voussoir"], depth["keystone"]) == (0, 1, 2, 3)
    assert any(
        line.endswith("· tail_length [m]: how far it reaches behind the stretchers beside it")
        for line in tree
    )
    assert answer("schema", "--db", url) == schema()
    assert prints("schema", "keystone", "--db", url).startswith("keystone  The voussoir at the crown")


def test_the_schema_needs_no_database(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MOMA_DB", raising=False)
    done = invoke("schema", "header")
    assert done.exit_code == 0
    assert "canonical: depth >= length" in done.stdout
    assert list(tmp_path.iterdir()) == []
    assert invoke("schema", "--db", "sqlite:///none.db").exit_code == 1


def test_on_a_terminal_the_schema_is_the_same_in_colours(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    print_schema(schema(kind="voussoir"))
    shown = capsys.readouterr().out
    plain = re.sub(r"\x1b\[[0-9;]*m", "", shown)
    assert [line.rstrip() for line in plain.splitlines()] == list(schema_lines(schema(kind="voussoir")))


@pytest.mark.parametrize(
    ("value", "unit", "cell"),
    [
        (9.6e-12, "Pa", "0"),
        (-6e-17, "m", "0"),
        (2e-9, "m", "2e-09"),
        (6.7e-15, None, "6.7e-15"),
        (-4.8e-10, "N", "0"),
    ],
)
def test_a_table_writes_what_rounding_leaves_of_zero_as_zero(value, unit, cell):
    assert as_table({"value": unit}, [{"value": value}]).splitlines()[-1].strip() == cell
