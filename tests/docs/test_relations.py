"""docs/relations.md is true: its tolerances are the program's, its commands run, and print what it shows."""

import re
import shlex
from dataclasses import asdict

import pytest
from typer.testing import CliRunner

from archmodel.relations.classify import RelationSettings
from moma.cli import app
from tests.paths import ROOT

PAGE = (ROOT / "docs/relations.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("doc")
    sample = place / "data/samples/window"
    sample.mkdir(parents=True)
    (sample / "window.moma").symlink_to(ROOT / "data/samples/window/window.moma")
    return place


@pytest.fixture(scope="module")
def printed(folder):
    """What each command of the page prints, run in their order in one folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("MOMA_DB", raising=False)
        said = {}
        for line in blocks("bash")[0].splitlines():
            done = CliRunner().invoke(app, shlex.split(line)[1:])
            assert done.exit_code == 0, (line, done.output)
            said[line] = done.stdout
    return said


def test_the_tolerances_are_those_of_the_program():
    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) \|", PAGE, re.MULTILINE)
    assert {name: float(value) for name, value in rows} == asdict(RelationSettings())


def test_the_commands_print_what_the_page_shows(printed):
    assert printed["moma load-path W10-04 --up"] == blocks("text")[0]
    assert len(printed) == 6


def test_the_python_of_the_page_runs(printed, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    exec(compile(blocks("python")[0], "relations.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert lines[1] == "['V3', 'V5']"
    assert lines[3] == "('W01-01', 'W01-02', 'W01-03')"
    assert len(lines) == 5


def test_the_joints_of_the_sample_are_as_many_as_it_says(printed, folder):
    first = re.search(r"of the (\d+) joints of the sample, (\d+) are found", PAGE)
    assert first is not None
    counts = {line.split()[0]: line.split() for line in printed["moma relate"].splitlines()[2:]}
    assert int(counts["rests_on"][2]) + int(counts["beside"][2]) == int(first[2])
