"""docs/unseen.md is true: its commands run and print what it shows, its numbers are the program's."""

import re
import shlex
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from moma.cli import app
from survey.unseen.core.settings import InfillSettings
from survey.unseen.missing.settings import MissingSettings
from synthetic.buildings.facings import two_facings
from synthetic.buildings.window import make_window
from synthetic.formats import write_moma
from tests.paths import ROOT

PAGE = (ROOT / "docs/unseen.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What each command of the page prints, run in their order in one folder."""
    place = tmp_path_factory.mktemp("doc")
    sample = place / "data/samples/window"
    sample.mkdir(parents=True)
    (sample / "window.moma").symlink_to(ROOT / "data/samples/window/window.moma")
    survey = make_window().survey
    gone = {"W05-02", "V6", "W10-05"}
    holes = replace(survey, blocks=tuple(one for one in survey.blocks if one.code not in gone))
    write_moma(holes, place / "holes.moma")
    write_moma(two_facings(3.0, 4, 2).building.survey, place / "two.moma")
    (place / "flue.toml").write_text(blocks("toml")[1], encoding="utf-8")
    said = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        patch.delenv("MOMA_DB", raising=False)
        for line in "".join(blocks("bash")).splitlines():
            done = CliRunner().invoke(app, shlex.split(line)[1:])
            assert done.exit_code == 0, (line, done.output)
            said[line] = done.stdout, done.stderr
    return said


def test_the_commands_print_what_the_page_shows(printed):
    assert printed["moma propose missing"][0] == ""
    assert "nothing to propose among 98 stones" in printed["moma propose missing"][1]
    shown = blocks("text")[0]
    assert printed["moma propose missing --db sqlite:///holes.db"][0] == shown
    listed = next(out for line, (out, _) in printed.items() if line.startswith("moma query entity"))
    assert [line.split()[0] for line in listed.splitlines()[2:]] == [
        line.split()[0] for line in shown.splitlines()[2:]
    ]


def test_blocks_that_are_recorded_are_those_that_were_proposed(printed):
    out = {line: text for line, (text, _) in printed.items() if "two.db" in line}
    proposed = next(text for line, text in out.items() if line.startswith("moma propose infill --db"))
    listed = next(text for line, text in out.items() if line.startswith("moma query infill"))
    codes = [[line.split()[0] for line in text.splitlines()[2:]] for text in (proposed, listed)]
    assert len(codes[0]) > 20
    assert codes[0] == codes[1]


def test_what_was_withdrawn_remains_in_its_history(printed):
    assert "1 withdrawn" in printed["moma record flue.toml --db sqlite:///holes.db"][0]
    history = next(out for line, (out, _) in printed.items() if "--history" in line)
    assert "withdrawn measurement" in history
    assert "seen from the scaffold: a flue, no stone" in history


def test_the_tolerances_are_those_of_the_program():
    missing, infill = MissingSettings(), InfillSettings()
    assert f"wider than a joint ({100 * missing.max_joint:.0f} cm)" in PAGE
    assert f"above over {missing.covered:.0%}".replace("%", " %") in PAGE
    assert (missing.max_courses, missing.max_stones) == (2, 3)
    assert "more than two\n  courses high; gaps for more than three stones" in PAGE
    assert f"at most {infill.max_thickness} m\napart" in PAGE
    assert f"nearer than\n{100 * infill.merge:.0f} cm" in PAGE
    assert f"one depth (within {100 * infill.level:.0f} cm)" in PAGE
