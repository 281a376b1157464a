"""The command line: what it prints, its exit codes, and one line for every mistake."""

import csv
import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from typing import Annotated, get_args, get_type_hints

import pytest
import typer

import moma
from moma.cli import app
from moma.cli.console import reporting
from moma.cli.options import SurveyFormat
from survey.formats.reading import FORMATS
from tests.moma.commands import answer, fails, invoke, prints
from tests.paths import ROOT
from tests.pipelines.scenes import TWO_COURSES

SAMPLE = ROOT / "data/samples/window"
COMMANDS = ("ingest", "survey-report", "query", "show", "check", "run")


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    """A database with the sample in it; tests do not write into it."""
    url = f"sqlite:///{tmp_path_factory.mktemp('db') / 'window.db'}"
    prints("ingest", SAMPLE / "window.moma", "--db", url)
    return url


def test_the_formats_that_can_be_named_are_those_that_are_read():
    assert [*get_args(SurveyFormat)] == list(FORMATS)


@dataclass(frozen=True)
class Choices:
    """A group of options."""

    width: Annotated[float, typer.Option("--wide", min=0.0, help="Width [m].")] = 0.5
    marks: Annotated[list[str] | None, typer.Option("--mark")] = None


def test_the_fields_of_a_dataclass_are_options_in_its_place():
    received = []

    @reporting
    def measure(
        *,
        code: Annotated[str, typer.Argument()],
        choices: Choices,
        verbose: Annotated[bool, typer.Option("-v")] = False,
    ) -> None:
        received.append((code, choices, verbose))

    single = typer.Typer(add_completion=False)
    single.command()(measure)
    command = typer.main.get_command(single)
    assert [option.opts for option in command.params] == [["code"], ["--wide"], ["--mark"], ["-v"]]
    for line in (["A1"], ["A1", "--wide", "2", "--mark", "a", "--mark", "b", "-v"]):
        command.main(line, standalone_mode=False)
    assert received == [("A1", Choices(), False), ("A1", Choices(2.0, ["a", "b"]), True)]
    with pytest.raises(Exception, match="greater than or equal to 0"):
        command.main(["A1", "--wide", "-1"], standalone_mode=False)


@pytest.mark.slow
def test_help_is_fast():
    """Less than 0.5 s of CPU time, the best of three."""
    spent = []
    for _ in range(3):
        start = os.times()
        done = subprocess.run(
            [sys.executable, "-m", "moma", "--help"], capture_output=True, text=True, check=True
        )
        end = os.times()
        spent.append(end.children_user - start.children_user + end.children_system - start.children_system)
    assert all(command in done.stdout for command in COMMANDS)
    assert min(spent) < 0.5


def test_the_command_line_loads_no_heavy_package():
    code = "import sys, moma.cli; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"numpy", "scipy", "numba", "sqlalchemy", "pyvista", "matplotlib", "gmsh", "jinja2", "trimesh"}
    assert heavy.isdisjoint(done.stdout.split())


def test_a_command_ends_without_a_last_search_for_garbage():
    code = "import gc, atexit, moma.cli; atexit.register(lambda: print(gc.get_count()[0], gc.get_freeze_count()))"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}; moma.cli.main()", "--version"],
        capture_output=True,
        text=True,
        check=True,
    )
    left, kept = map(int, done.stdout.splitlines()[-1].split())
    assert left < 1000 < kept  # nearly all objects of a loaded program are beyond it


def test_a_query_loads_no_package_that_it_does_not_ask(tmp_path):
    url = f"sqlite:///{tmp_path / 'wall.db'}"
    made = (
        "from archmodel.database.session import open_database; import sys; open_database(sys.argv[1]).close()"
    )
    subprocess.run([sys.executable, "-c", made, url], capture_output=True, check=True)
    code = "import sys, atexit, moma.cli; atexit.register(lambda: print(*sys.modules)); moma.cli.main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "query", "stone", "--db", url],
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = done.stdout.split()
    heavy = {
        *("scipy", "numba", "pyvista", "matplotlib", "gmsh", "jinja2", "trimesh", "alembic", "h5py"),
        "skfem",
    }
    assert "sqlalchemy" in loaded
    assert heavy.isdisjoint(loaded)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command):
    done = invoke(command, "--help")
    assert done.exit_code == 0
    assert "--json" in done.stdout
    assert ("--db" in done.stdout) == (command != "survey-report")


def test_version():
    assert invoke("--version").stdout == f"moma {moma.__version__}\n"


@pytest.mark.parametrize(
    "arguments",
    [("ingset",), ("query",), ("query", "header", "--format", "xml"), ("query", "header", "--sort")],
)
def test_wrong_use_ends_in_2(arguments):
    assert invoke(*arguments).exit_code == 2


def test_ingest_tells_what_it_found(tmp_path):
    url = f"sqlite:///{tmp_path / 'new.db'}"
    (file,) = answer("ingest", SAMPLE / "window.moma", "--db", url)["files"]
    assert sum(file["stones"].values()) == 98
    again = fails(1, "ingest", SAMPLE / "window.moma", "--db", url)
    assert "in the database already" in again


@pytest.mark.parametrize(
    ("written", "instead", "said"),
    [
        ("  vertex ", "  vertex ab ", ""),
        ("stone W01-01 header", "stone W01-01 heder", "unknown kind 'heder'; did you mean header?"),
        ("depth stretcher ", "depth quoin ", "no depth is known for a stretcher"),
    ],
)
def test_a_bad_survey_is_one_line_and_makes_no_database(tmp_path, written, instead, said):
    text = (SAMPLE / "window.moma").read_text(encoding="utf-8")
    line = text[: text.index(written)].count("\n") + 1
    bad = tmp_path / "bad.moma"
    bad.write_text(text.replace(written, instead, 1), encoding="utf-8")
    message = fails(1, "ingest", bad, "--db", f"sqlite:///{tmp_path / 'new.db'}")
    assert f"{bad}:" in message
    assert said in message
    assert said or f"{bad}:{line}: " in message
    assert not (tmp_path / "new.db").exists()


def test_one_bad_file_keeps_the_others_out(tmp_path, database):
    bad = tmp_path / "bad.moma"
    bad.write_text("moma-survey 1\nrubbish\n", encoding="utf-8")
    url = f"sqlite:///{tmp_path / 'new.db'}"
    assert ":2: " in fails(1, "ingest", SAMPLE / "window.moma", bad, "--db", url)
    assert not (tmp_path / "new.db").exists()


def test_a_missing_survey_file_is_wrong_use(tmp_path):
    assert "no such file" in fails(
        2, "ingest", tmp_path / "none.moma", "--db", f"sqlite:///{tmp_path / 'n.db'}"
    )


def test_query_gives_the_same_in_every_format(database):
    question = ("query", "voussoir", "--where", "depth < 0.44", "--db", database)
    rows = answer(*question)
    assert [row["code"] for row in rows] == [f"V{number}" for number in range(1, 8)]
    assert {row["kind"] for row in rows} == {"voussoir", "keystone"}
    listed = list(csv.DictReader(io.StringIO(invoke(*question, "--format", "csv").stdout)))
    assert [row["code"] for row in listed] == [row["code"] for row in rows]
    assert float(listed[0]["volume"]) == rows[0]["volume"]
    assert list(listed[0]) == list(rows[0])
    table = invoke(*question)
    assert table.stdout.splitlines()[0].split()[:3] == ["code", "kind", "depth"]
    assert len(table.stdout.splitlines()) == 2 + 7
    assert "von_mises_max" not in table.stdout  # nothing was computed yet
    assert "7 found" in table.stderr


def test_a_column_that_is_asked_for_is_shown(database):
    done = invoke("query", "header", "--where", "redundancy > 3 and course = 2", "--db", database)
    assert "redundancy" in done.stdout.splitlines()[0]


def test_nothing_found_is_no_error(database):
    done = invoke("query", "header", "--where", "depth > 5", "--db", database)
    assert (done.exit_code, done.stdout) == (0, "")
    assert answer("query", "header", "--where", "depth > 5", "--db", database) == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("query", "heder"), "did you mean header?"),
        (("query", "header", "--where", "dept > 0.4"), "did you mean depth"),
        (("query", "header", "--where", "depth >"), "character"),
        (("query", "header", "--json", "--format", "csv"), "two formats"),
        (("show", "V44"), "did you mean V4?"),
    ],
)
def test_a_wrong_question_is_one_line_with_a_remedy(database, arguments, said):
    assert said in fails(2, *arguments, "--db", database)


def test_a_missing_database_is_named_and_not_made(tmp_path, monkeypatch):
    monkeypatch.setenv("MOMA_DB", f"sqlite:///{tmp_path / 'none.db'}")
    assert "none.db" in fails(1, "query", "header")
    assert "moma ingest" in fails(1, "show", "V1")
    assert not list(tmp_path.iterdir())


def test_the_database_comes_from_the_environment(database, monkeypatch):
    monkeypatch.setenv("MOMA_DB", database)
    assert answer("show", "V4")["kind"] == "keystone"


def test_show_tells_what_it_is_and_what_was_measured(database):
    text = invoke("show", "V4", "--db", database).stdout
    for words in ("keystone", "voussoir", "ashlar", "normal", "rms", "0.42 m", "synthetic"):
        assert words in text


@pytest.fixture
def scene(tmp_path):
    """A scene that takes a second."""
    path = tmp_path / "low.toml"
    path.write_text(TWO_COURSES, encoding="utf-8")
    return path


def test_check_tells_the_plan(scene, database):
    text = prints("check", scene, "--db", database)
    assert "sound" in text
    plan = answer("check", scene, "--db", database)
    assert plan["bodies"]["rigid"] + plan["bodies"]["fixed"] == sum(plan["kinds"].values())
    assert plan["cost"]["unknowns"] == 6 * plan["bodies"]["rigid"]
    assert plan["cost"]["contacts"] >= 3 * plan["bodies"]["rigid"]
    low, likely, high = plan["cost"]["seconds"]
    assert 0.0 < low <= likely <= high
    assert plan["cost"]["peak"] > plan["cost"]["memory"] > 0
    assert "of one processor" in text
    assert plan["joints"]["max_displacement"] < 0.1
    assert plan["problems"] == []


@pytest.mark.parametrize(
    ("written", "instead", "said"),
    [
        ('fixed = ["course = 1"]', "", "no stone is fixed"),
        (
            '"course <= 2"',
            '"course in (1, 4)"',
            "no chain of touching stones ties these to a fixed one: W04-01",
        ),
        ("[scene]", "[joints]\nmax_displacement = 0.001\n[scene]", "max_displacement"),
    ],
)
def test_an_unsound_scene_ends_in_1_with_its_problem(scene, database, written, instead, said):
    scene.write_text(TWO_COURSES.replace(written, instead), encoding="utf-8")
    done = invoke("check", scene, "--db", database)
    assert done.exit_code == 1
    assert any(said in line for line in done.stdout.splitlines() if line.startswith("problem: "))
    assert json.loads(invoke("check", scene, "--db", database, "--json").stdout)["problems"]


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_wrong_scene_is_wrong_use(command, scene, database):
    scene.write_text(TWO_COURSES.replace("density", "densty"), encoding="utf-8")
    assert "low.toml:7: unknown key 'densty'" in fails(2, command, scene, "--db", database)
    assert "no such scene file" in fails(2, command, scene.with_name("none.toml"), "--db", database)
    scene.write_text(TWO_COURSES.replace("course <= 2", "course > 99"), encoding="utf-8")
    assert "no stone is selected" in fails(2, command, scene, "--db", database)


def test_run_tells_how_it_ended_and_query_knows_it(scene, tmp_path):
    url = f"sqlite:///{tmp_path / 'own.db'}"
    prints("ingest", SAMPLE / "window.moma", "--db", url)
    text = prints("run", scene, "--db", url, "--out", tmp_path / "out", "-v")
    assert text.startswith("Two courses: equilibrium after ")
    assert str(tmp_path / "out/report.html") in text
    rows = answer("query", "entity", "--where", "fidelity = rigid", "--db", url)
    assert rows
    assert all(row["course"] == 2 for row in rows)
    summary = answer("run", scene, "--db", url, "--out", tmp_path / "out")
    assert summary["bodies"]["rigid"] == len(rows)
    other = tmp_path / "other.toml"
    other.write_text(TWO_COURSES, encoding="utf-8")
    said = fails(2, "run", other, "--db", url, "--out", tmp_path / "out")
    assert f"holds the results of {scene}" in said
    assert "--overwrite" in said


def test_a_full_disk_is_one_line_wherever_it_is_found(database, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device", "/tmp/some.file")

    monkeypatch.setattr("archmodel.describe.entity.describe", full)
    assert fails(1, "show", "V4", "--db", database) == (
        "moma: error: /tmp/some.file: the disk is full; make room on it and try again"
    )


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")
def test_a_full_disk_under_the_standard_output_is_one_line():
    words = [sys.executable, "-m", "moma", "schema", "--json"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False, cwd=ROOT)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert "the disk is full" in line


def test_an_unexpected_error_is_one_line_and_whole_with_v(database, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("by hand")

    monkeypatch.setattr("archmodel.describe.entity.describe", broken)
    message = fails(1, "show", "V4", "--db", database)
    assert "unexpected ZeroDivisionError: by hand" in message
    assert isinstance(invoke("show", "V4", "--db", database, "-v").exception, ZeroDivisionError)


def test_a_foreseen_error_shows_its_traceback_with_v(database):
    done = invoke("show", "nobody", "--db", database, "-v")
    assert done.exit_code == 2
    assert "Traceback" in done.stderr
    assert done.stderr.splitlines()[-1].startswith("moma: error: ")


def test_help_is_shown_as_it_is_written(monkeypatch):
    monkeypatch.setenv("COLUMNS", "400")
    monkeypatch.setenv("TERMINAL_WIDTH", "400")
    whole = invoke("--help").output
    for command in app.registered_commands:
        name, function = command.name, command.callback
        shown = " ".join(invoke(name, "--help").output.replace("│", " ").split())
        said = [function.__doc__.split("\n\n")[0]]
        said += [
            one.help
            for hint in get_type_hints(function, include_extras=True).values()
            for one in get_args(hint)[1:]
        ]
        for text in filter(None, said):
            assert " ".join(text.split()) in shown, name
        assert command.hidden or name in whole
    assert "[[assess]]" in invoke("assess", "--help").output
