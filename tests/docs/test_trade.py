"""docs/howto/trade.md is true: its commands run, and what it shows is what the program makes of the study beside it."""

import io
import json
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from moma.cli import app
from moma.cli.text.tradeoff import trade_lines
from pipelines.results.quantities import QUANTITIES
from pipelines.tradeoff import study as trade_module
from pipelines.tradeoff.grid import grid
from pipelines.tradeoff.pareto import front
from pipelines.tradeoff.report import study_png
from pipelines.tradeoff.study import TradeReport
from tests.docs.pages import blocks
from tests.docs.test_docs import commands
from tests.paths import ROOT

PAGE = "docs/howto/trade.md"
STUDY = ROOT / "docs/howto/trade/window.json"
PICTURE = ROOT / "docs/images/window-trade.png"


@pytest.fixture(scope="module")
def record():
    """The study of the sample that the page shows."""
    return json.loads(STUDY.read_text(encoding="utf-8"))


def test_the_commands_run(place, monkeypatch):
    """With one setting, on rigid stones; what all settings do is tested elsewhere."""
    monkeypatch.chdir(place)
    monkeypatch.setattr(trade_module, "grid", lambda *of, **asked: grid(*of, **asked)[:1])
    found = commands(PAGE)
    assert [one[1] for one in found] == ["ingest", "trade", "trade"]
    for command in found:
        done = CliRunner().invoke(app, command[1:])
        assert done.exit_code == 0, (command, done.output)
    assert (place / "out/window-trade/trade.png").exists()


def test_the_table_is_that_of_the_study(record):
    shown = blocks(PAGE, "text")[0].splitlines()
    said = trade_lines(TradeReport(Path("out/window-trade"), record), verbose=False)
    assert shown == said


def test_the_picture_is_that_of_the_study(record):
    shown = Image.open(PICTURE).convert("RGB")
    drawn = Image.open(io.BytesIO(study_png(record))).convert("RGB")
    assert drawn.size == shown.size
    apart = np.abs(np.asarray(shown, dtype=float) - np.asarray(drawn, dtype=float))
    assert apart.mean() < 6.0  # other fonts and libraries draw a little otherwise


def test_the_front_of_the_study_is_monotone_and_ends_near_the_reference(record):
    done = [row for row in record["rows"] if row["status"] == "done" and row["errors"]["outcome"] == 0.0]
    known = [row for row in done if row["errors"][record["quantity"]] is not None]
    points = [(row["cpu"], row["errors"][record["quantity"]]) for row in known]
    chosen = front(points)
    assert [row["setting"] for row in known if row["front"]] == [known[one]["setting"] for one in chosen]
    errors = [points[one][1] for one in chosen]
    assert errors == sorted(errors, reverse=True)
    assert len(chosen) >= 2


def test_the_lines_on_the_page_are_those_that_are_recommended(record):
    shown = [tomllib.loads(one) for one in blocks(PAGE, "toml")]
    assert tomllib.loads(record["recommended"]["lines"]) in shown


def test_all_quantities_are_listed_with_what_they_are():
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    listed = dict(re.findall(r"^\| `(\w+)` \| (.*?) \|$", text, re.MULTILINE))
    assert listed == dict(QUANTITIES)


@pytest.mark.slow
def test_a_study_of_the_sample_finds_the_quadratic_elements_worth_their_time(tmp_path):
    url = f"sqlite:///{tmp_path / 'window.db'}"
    for line in (
        f"ingest {ROOT / 'data/samples/window/window.moma'} --db {url}",
        f"trade {ROOT / 'data/samples/window/window.toml'} --db {url} --budget 10 --out {tmp_path / 'study'}",
    ):
        done = CliRunner().invoke(app, shlex.split(line))
        assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "study/trade.json").read_text(encoding="utf-8"))
    rows = {row["setting"]: row for row in found["rows"]}
    assert rows["rigid"]["errors"]["von_mises_p99"] is None
    assert found["reference"]["name"].split(",")[0] in ("tet10", "hex20", "profile accurate")
    assert rows["hex20, 1 cell"]["errors"]["von_mises_p99"] < rows["hex8, 1 cell"]["errors"]["von_mises_p99"]
