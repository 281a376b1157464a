"""docs/knowledge.md is true: its keys, properties, types, example and Python are those of the program."""

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from archmodel.assertions.declare import PROPERTIES
from archmodel.tables.knowledge import OBSERVATIONS
from archmodel.tables.relations import RELATIONS
from archmodel.tables.structures import structure_kinds
from archmodel.tables.terms import DOCUMENT_TYPES
from ground.toml.schema import REQUIRED, Key
from moma.cli import app
from pipelines.record.file import read_record
from pipelines.record.keys import ABOUT, ARRAYS, ATTRIBUTE, CITED, PROPERTY, RECORD, WHO, WITHDRAWN
from pipelines.record.record import record
from tests.paths import ROOT

PAGE = (ROOT / "docs/knowledge.md").read_text(encoding="utf-8")
STATEMENTS = ("made_of", "of_phase", "mark", "observation", "reference", "note", "decision")
SAMPLE = ROOT / "data/samples/window"


def section(heading: str) -> str:
    return re.split(r"\n#+ ", PAGE.split(f"# `{heading}`\n", 1)[1], maxsplit=1)[0]


def tables(text: str) -> list[list[list[str]]]:
    """The cells of every table of a text, without heads."""
    found = re.findall(r"(?:^\|.*\n)+", text + "\n", re.MULTILINE)
    return [
        [[cell.strip() for cell in line.strip("|").split("|")] for line in one.splitlines()[2:]]
        for one in found
    ]


def default_text(key: Key) -> str:
    if key.default is REQUIRED:
        return "required"
    written = {None: "", False: "`false`", (): "`[]`"}
    return "`{ }`" if isinstance(key.default, dict) else written[key.default]  # type: ignore[index]


def rows(*keys: Key) -> list[list[str]]:
    return [[f"`{key.name}`", key.unit, default_text(key), key.doc] for key in keys]


def test_every_key_is_documented() -> None:
    assert tables(section("[record]")) == [rows(*RECORD), rows(*WHO)]
    common = PAGE.split("# Statements\n")[1].split("\n## ")[0]
    assert tables(common) == [rows(*ABOUT, *CITED)]
    for name, keys in ARRAYS.items():
        left_out = [*WHO, *(CITED if name == "depth" else ())]
        left_out += [*ABOUT, *CITED] if name in STATEMENTS else []
        assert all(one in keys for one in left_out)
        own = rows(*(key for key in keys if key not in left_out))
        found = tables(section(f"[[{name}]]"))
        assert found[:1] == ([own] if own else []), name


def test_properties_and_types_are_those_of_the_program() -> None:
    _, inner, usual = tables(section("[[material]]"))
    assert inner == rows(*PROPERTY)
    assert usual == [[f"`{name}`", unit, meaning] for name, (unit, meaning) in PROPERTIES.items()]
    assert tables(section("[[kind]]"))[1] == rows(*ATTRIBUTE)
    assert tables(section("[[observation]]"))[1] == [
        [f"`{name}`", meaning] for name, meaning in OBSERVATIONS.items()
    ]
    for heading, names in (
        ("[[document]]", DOCUMENT_TYPES),
        ("[[structure]]", structure_kinds()),
        ("[[relation]]", (*RELATIONS, "supports")),
        ("[[withdraw]]", WITHDRAWN),
    ):
        assert set(names) <= set(re.findall(r"`(\w+)`", section(heading).split("| key")[0])), heading


def test_the_order_of_recording_is_that_of_the_program() -> None:
    (order,) = re.findall(r"are recorded in this order, whatever the order in the file: ([^.]*)\.", PAGE)
    named = {"kinds": "kind", "withdrawals": "withdraw", "corrections": "correction"}
    written = [named.get(one, one.removesuffix("s")) for one in re.split(r",\s+", order)]
    assert written[:-1] == list(ARRAYS)[: len(written) - 1]
    assert set(list(ARRAYS)[len(written) - 1 :]) == set(STATEMENTS)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "data/samples").mkdir(parents=True)
    (tmp_path / "data/samples/window").symlink_to(SAMPLE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MOMA_DB", raising=False)
    return tmp_path


def test_the_example_does_what_the_page_says(place: Path) -> None:
    example, *others = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    (place / "west.toml").write_text(example, encoding="utf-8")
    (session,) = re.findall(r"```session\n(.*?)```", PAGE, re.DOTALL)
    steps = re.findall(r"^moma (.*)\n((?:(?!moma ).*\n)*)", session, re.MULTILINE)
    assert [command.split()[0] for command, _ in steps] == ["ingest", "record", "record", "query", "query"]
    for command, answer in steps:
        done = CliRunner().invoke(app, shlex.split(command))
        assert done.exit_code == 0, (command, done.stderr)
        if command.startswith("query"):
            assert [line.split(",")[0] for line in done.stdout.splitlines()[1:]] == answer.split()
        elif answer:
            # how many entries an ingest makes is not the page's business
            told, written = (re.sub(r"(entry|entries) [\d, ]+", r"\1 ", one) for one in (done.stdout, answer))
            assert told == written
    # the other pieces, one after the other, in the building that the sample describes
    record([SAMPLE / "knowledge.toml"], "sqlite:///moma.db")
    for number, text in enumerate(others):
        (place / f"{number}.toml").write_text(text, encoding="utf-8")
        (file,) = record([place / f"{number}.toml"], "sqlite:///moma.db").files
        assert file.entries, text


def test_the_python_runs(place: Path) -> None:
    assert CliRunner().invoke(app, ["ingest", str(SAMPLE / "window.moma")]).exit_code == 0
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(code, "docs/knowledge.md", "exec"), names)
    events: list[object] = list(names["events"])  # type: ignore[call-overload]
    assert [event.what for event in events[-2:]] == ["of_phase", "mason_mark"]  # type: ignore[attr-defined]
    assert names["before"]["knowledge"]["marks"] == []  # type: ignore[index]


def test_the_sample_uses_every_table_but_those_that_undo_or_decide() -> None:
    used = {table.name for table in read_record(SAMPLE / "knowledge.toml").tables}
    assert used == set(ARRAYS) - {"withdraw", "rule", "decision"}
