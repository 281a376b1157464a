"""The notebooks run as they stand, in their folder, and come to what they say; every page is in the contents."""

import contextlib
import io
import re
import runpy
from pathlib import Path

import matplotlib
import pytest

from tests.paths import ROOT

FOLDER = ROOT / "docs/notebooks"


def ran(name, monkeypatch):
    """What a notebook prints, and its names."""
    matplotlib.use("Agg")
    monkeypatch.chdir(FOLDER)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        names = runpy.run_path(name)
    matplotlib.pyplot.close("all")
    return said.getvalue(), names


@pytest.mark.slow
def test_the_notebook_of_an_archaeologist_finds_marks_phases_and_a_history(monkeypatch):
    said, names = ran("archaeologist.py", monkeypatch)
    assert len(names["rows"]) == 98
    assert {"1", "2"} <= set(names["phases"])
    assert "closer" in said


@pytest.mark.slow
def test_the_notebook_of_an_engineer_ends_in_rest_and_tips_the_column(monkeypatch):
    said, names = ran("engineer.py", monkeypatch)
    assert names["report"].summary["outcome"] == "equilibrium"
    assert len(names["pressed"]) > 50
    tilt, geometry = map(int, re.search(r"at (\d+)° of tilt; geometry: (\d+)°", said).groups())
    assert 0 <= tilt - geometry <= 8


@pytest.mark.slow
def test_the_notebook_of_a_geologist_measures_a_slope(monkeypatch):
    said, _ = ran("geologist.py", monkeypatch)
    assert float(re.search(r"angle of repose \[°\]: (\S+)", said)[1]) > 5.0


def test_every_notebook_is_tested_and_has_a_title():
    tests = Path(__file__).read_text(encoding="utf-8")
    for path in FOLDER.glob("*.py"):
        assert re.match(r'"""\n.+\n=+\n', path.read_text(encoding="utf-8")), path.name
        assert f'ran("{path.name}"' in tests


def test_every_page_stands_in_the_contents_of_the_site():
    docs = ROOT / "docs"
    index = (docs / "index.md").read_text(encoding="utf-8")
    listed = {
        line for block in re.findall(r"```\{toctree\}\n(.*?)```", index, re.DOTALL) for line in block.split()
    }
    pages = {
        str(path.relative_to(docs).with_suffix("")) for path in (*docs.glob("*.md"), *docs.glob("howto/*.md"))
    }
    assert pages - listed - {"index"} == set()
    assert "design/*" in listed
