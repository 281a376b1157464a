"""Reports of assessments and loading tests: what governs in words, in the axes of the wall, and what went into it."""

import base64

import pytest

from pipelines.reports.assessment import write_assessment
from pipelines.reports.movement import write_comparison
from pipelines.reports.pushover import write_pushover
from tests.pipelines.reports.page import Page
from tests.pipelines.reports.summaries import WALL, assessed, pushed

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


def words(folder, write, summary):
    for name in ("curve", "peak", "end"):
        (folder / f"{name}.png").write_bytes(PIXEL)
    write(folder / "report.html", summary)
    return Page(folder / "report.html").text


def test_an_assessment_says_first_what_governs_in_the_axes_of_the_wall(tmp_path):
    told = words(tmp_path, write_assessment, assessed())
    lead = next(text for text in told if text.startswith("Pushed inwards, (0, 1, 0), the stones hold 12.5 %"))
    assert (
        "of their weight, 5.00 kN, and fall at 12.52 %. Capacity against demand: linear: 1 against 0.5"
        in lead
    )
    assert "horizontal y: λ = 0.125 (held" in lead
    start = told.index("What governs")
    rows = dict(zip(told[start + 1 : start + 13 : 2], told[start + 2 : start + 14 : 2], strict=True))
    assert rows["Direction"] == "inwards, (0, 1, 0)"
    assert rows["Capacity"] == "λ = 0.125: 5.00 kN on all stones that may move"
    assert rows["Capacity against demand"] == "linear: 1 against 0.5 m/s², ratio 2.00, passed"
    assert rows["How it falls"] == (
        "2 stones move, the fastest, W03-01, inwards, (0, 1, 0); their centres are 1.50 to 2.25 m above the foot and "
        "0.50 to 2.00 m from the left end"
    )
    assert "falls by 2.0 % with 10 % less friction" in rows["How sure it is"]
    assert "falls by 10.0 % with 10 % less depth" in rows["How sure it is"]
    assert "the limit itself was not sought anew" in rows["How sure it is"]
    assert start < told.index("What each number is") < told.index("What went into it")


def test_stones_that_look_several_ways_have_no_axes_but_x_y_z(tmp_path):
    one = assessed(wall=None)
    one["loads"][0] |= {"sensitivity": {"friction": 0.2, "depth": None}, "direction": [3.0, 0.0, 4.0]}
    told = " ".join(words(tmp_path, write_assessment, one))
    assert "(0.6, 0, 0.8)" in told
    assert "inwards" not in told
    assert "depth of all stones" not in told


def test_what_falls_by_itself_states_no_capacity(tmp_path):
    one = assessed()
    one["loads"][0] |= {
        "candidate": None,
        "bound": None,
        "limit": None,
        "outcome": "falls",
        "sensitivity": None,
    }
    told = words(tmp_path, write_assessment, one)
    assert "Capacity" not in " ".join(told)
    assert "friction, depths and densities are taken as certain" in told


@pytest.mark.parametrize(("write", "summary"), [(write_assessment, assessed()), (write_pushover, pushed())])
def test_every_report_states_what_went_into_it(tmp_path, write, summary):
    told = words(tmp_path, write, summary)
    start = told.index("What went into it")
    for title, lines in summary["inputs"].items():
        place = told.index(title, start)
        assert told[place + 1] == lines[0]
    assert "moma 1.2, python 3.13" in told[start:]


def test_a_loading_test_says_first_what_the_stones_bear_and_how_sure_that_is(tmp_path):
    told = words(tmp_path, write_pushover, pushed())
    start = told.index("What governs")
    assert told[start + 2].startswith("72.00 kN to the right along the wall, (1, 0, 0), 1.3 m above the foot")
    assert told[start + 4] == "74.00 kN; predicted over measured 0.973"
    assert told[start + 6].startswith("± 5.00 kN holds 90 % of the outcomes, from the scatter of friction")
    told = " ".join(
        words(tmp_path, write_pushover, pushed(band=None, wall={**WALL, "along": [-1.0, 0.0, 0.0]}))
    )
    assert "72.00 kN to the left along the wall" in told
    assert "no scatter was stated" in told


@pytest.mark.parametrize(("outcome", "doubt"), [("moving", True), ("undecided", True), ("settled", False)])
def test_a_comparison_with_a_run_that_did_not_rest_says_so_in_its_first_line(tmp_path, outcome, doubt):
    one = assessed(chi2=10.0, dof=8, chi2_still=20.0, walls=[], courses=[], outcome=outcome)
    write_comparison(tmp_path / "c.html", one, None)
    lead = next(text for text in Page(tmp_path / "c.html").text if text.startswith("Measured against"))
    assert (f"the stones did not come to rest: {outcome}" in lead) == doubt
