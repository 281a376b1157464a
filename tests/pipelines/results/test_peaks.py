"""Peaks, slivers and limits of a run whose numbers are known: in its summary, text, tables, pictures and database."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.results.result import JointSeries, Largest, Peak, Peaks, Series
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.scene import ContactSettings, Fidelity, LawRule
from moma.cli.text.runs_and_surveys import run_lines
from pipelines.draw.pictures import _heading, _top
from pipelines.reports.html import kilonewtons, megapascals, millimetres, percent
from pipelines.reports.run import write_report
from pipelines.results.run_csv import write_joints, write_series
from pipelines.results.stone_values import stone_results
from pipelines.results.summary import indeterminacy, length_tolerance, summarise
from pipelines.run.record import joint_columns
from pipelines.run.run import RunReport
from tests.pipelines.reports.page import Page
from tests.pipelines.results_by_hand import deformable_body, joints_of, result_of, rigid_body


def largest(*values, partners=(-1, -1, -1), time=2.5):
    return Largest(np.array(values, float), np.full(len(values), time), np.array(partners))


@pytest.fixture
def shaken():
    """Two stones on a base, which rocked by 12.4 mm and came back to half a micron."""
    bodies = [
        rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
        rigid_body("A-1", (0, 0, 1), (1, 1, 2), shift=(5e-7, 0, 0)),
        rigid_body("B-2", (0, 0, 2), (1, 1, 3)),
    ]
    unknown = largest(np.nan, np.nan, np.nan)
    peaks = Peaks(
        displacement=largest(np.nan, 8e-3, 12.4e-3),
        relative=largest(np.nan, 1e-3, 2e-3, time=2.0),
        relative_end=np.array([np.nan, 5e-7, 0.0]),
        opening=largest(3e-3, 4e-3, 4e-3, partners=(1, 2, 1)),
        sliding=largest(0.0, 0.0, 0.0),
        pressure=largest(9e5, 9e5, 1e5, partners=(1, 0, 1)),
        von_mises=unknown,
        tension=unknown,
        compression=unknown,
        reaction=Peak(50e3, 1.0, 20010.0),
        shear=Peak(7e3, 1.5, -0.0),
    )
    one = result_of(bodies, pairs=((1, 0), (2, 1)), forces=((0, 0, 2000.0), (0, 0, 1000.0)))
    return replace(one, peaks=peaks)


@pytest.fixture
def splintered(shaken):
    """The same, with a third joint, a sliver of 0.24 cm² that carries 18.5 kN, 771 MPa."""
    joints = joints_of(((1, 0), (2, 1), (2, 0)), ((0, 0, 2e3), (0, 0, 1e3), (0, 0, 18504.0)), (1, 2, 2))
    area = np.array([1.0, 1.0, 0.24e-4])
    pressure = joints.pressure_mean / area
    narrow = replace(
        joints,
        area=area,
        sliver=area < 0.005,
        pressure_mean=pressure,
        pressure_max=1.5 * pressure,
        kern=np.array([0.5, 1.2, 40.0]),
    )
    return replace(shaken, joints=narrow)


def lines_of(path: Path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def written(result, folder: Path, **more):
    summary = {**summarise(result, version="1", seconds={"solve": 1.0}), "files": [], **more}
    write_report(folder / "report.html", result, summary, stone_results(result), [])
    page = " ".join(Page(folder / "report.html").text)
    return summary, page, "\n".join(run_lines(RunReport(folder, summary, (), 1), verbose=False))


def test_the_largest_displacement_is_that_of_the_run(shaken, tmp_path):
    """Not that of its last instant, half a micron, which the text, the report and the summary state besides."""
    summary, page, text = written(shaken, tmp_path)
    found = summary["displacement"]
    assert (found["max"], found["time"], found["stones"]) == (12.4e-3, 2.5, ["B-2"])
    assert found["end"] == pytest.approx(5e-7)
    peak = summary["peaks"]["displacement"]
    assert (peak["value"], peak["unit"], peak["time"], peak["stones"]) == (12.4e-3, "m", 2.5, ["B-2"])
    assert peak["end"] == pytest.approx(5e-7)
    assert summary["peaks"]["relative_displacement"]["end"] == 5e-7
    assert summary["peaks"]["von_mises"] is None
    assert "largest displacement 12.4 mm after 2.5 s" in text
    assert "largest displacement 12.4 mm after 2.5 s" in page.lower().replace(
        "displacement ", "displacement ", 1
    )
    assert "opening of a joint: 4 mm after 2.5 s, A-1 – B-2; 0.1 mm at the end" in text
    assert "A-1 – B-2" in page
    assert "reaction of the supports against gravity: 50.00 kN after 1 s; 20.01 kN at the end" in text
    assert "across gravity: 7.00 kN after 1.5 s; 0.00 kN at the end" in text


def test_peaks_that_the_end_shows_are_not_repeated(shaken, tmp_path):
    quiet = replace(shaken.peaks, reaction=Peak(20010.0, 0.1, 20010.0), shear=Peak(1.0, 0.1, 0.0))
    _, page, text = written(replace(shaken, peaks=quiet), tmp_path)
    assert "reaction of the supports" not in text
    assert "Reaction of the supports against gravity" in page  # in the table of all


def test_every_stone_has_its_own_peaks(shaken):
    base, first, second = stone_results(shaken)
    assert "displacement_peak" not in base.values
    assert second.values["displacement_peak"] == 12.4e-3
    assert second.values["displacement_peak_time"] == 2.5
    assert second.values["relative_displacement_peak"] == 2e-3
    assert (base.values["joint_opening_peak"], first.values["joint_pressure_peak"]) == (3e-3, 9e5)
    assert second.displacement_max == 0.0
    assert "von_mises_peak" not in first.values


def test_a_picture_of_the_end_states_the_peak(shaken):
    lines = _heading(shaken, "displacement")
    assert lines[1:] == ["at the end; during the run up to 12.4 mm (B-2 after 2.5 s)"]
    assert _heading(replace(shaken, peaks=None), "displacement")[1:] == []


@pytest.mark.parametrize(
    ("outcome", "words"), [(Outcome.UNDECIDED, "UNDECIDED"), (Outcome.INTERRUPTED, "INTERRUPTED")]
)
def test_an_open_outcome_and_its_caution_are_plain_everywhere(outcome, words, shaken, tmp_path):
    one = replace(shaken, outcome=outcome, reason="step 3 of 10 was not solved", cautions=("stones overlap",))
    _, page, text = written(one, tmp_path)
    assert words in _heading(one, "displacement")[0]
    assert _heading(one, "displacement")[1] == "stones overlap"
    first = text.splitlines()[0].lower()
    assert "step 3 of 10 was not solved; but stones overlap" in first
    assert f"{words.capitalize()} after 0.1 s: step 3 of 10 was not solved; but stones overlap" in page
    assert "Caution: stones overlap" in page
    assert page.index("Caution: stones overlap") < page.index("Contact points")
    assert 'class="lead open"' in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_slivers_count_apart(splintered, tmp_path):
    """Number and force are stated; pressures, kern and colours are those of the other joints."""
    summary, page, text = written(splintered, tmp_path)
    joints = summary["joints"]
    assert (joints["count"], joints["pressed"], joints["out_of_kern"]) == (3, 2, 1)
    assert joints["largest_pressure"] == pytest.approx(3000.0)
    assert joints["slivers"]["count"] == 1
    assert joints["slivers"]["force"] == pytest.approx(18504.0)
    assert joints["slivers"]["largest_pressure"] == pytest.approx(1.5 * 771e6)
    assert "of no more than 0.5 % of the faces of their stones: 1, with 18.5 kN" in text
    assert "0.5 % of the faces of their stones: 1 of 3." in page
    assert "18.50 kN" in page
    assert _top(splintered, "pressure") == pytest.approx(2000.0)
    assert _heading(splintered, "pressure")[1] == "largest: 2 kPa, between base and A-1; without slivers (1)"
    values = [stone.values["joint_pressure"] for stone in stone_results(splintered)]
    assert values == pytest.approx([3000.0, 3000.0, 1500.0])
    record = joint_columns(splintered.joints, np.zeros(3), np.full(3, np.nan))
    assert np.isnan([record[name][2] for name in ("pressure_max", "pressure_mean", "kern")]).all()
    assert record["force_normal"][2] == pytest.approx(18504.0)
    write_joints(tmp_path / "joints.csv", splintered, np.zeros(3))
    rows = lines_of(tmp_path / "joints.csv")
    assert [row["sliver"] for row in rows] == ["0", "0", "1"]


def test_the_scale_of_pressures_ends_where_joints_with_a_hundredth_of_the_force_exceed_it(splintered):
    """A joint with 0.5 % of the force does not set the scale; with 2 % it does."""
    for share, end in ((0.005, 1e3), (0.02, 5e6)):
        joints = replace(
            splintered.joints,
            sliver=np.zeros(3, bool),
            pressure_mean=np.array([1e3, 1e3, 5e6]),
            area=np.array([0.5, 0.5 - share, share * 1e3 / 5e6]),
        )
        assert _top(replace(splintered, joints=joints), "pressure") == pytest.approx(end)


def test_lengths_within_the_tolerance_are_shown_as_such(shaken, tmp_path):
    """v tolerance × g h × h × steps = 1e-5 × 9.81 × 1e-6 × 10 m: what contacts may drift apart."""
    assert length_tolerance(shaken) == pytest.approx(1e-5 * 9.81 * 1e-6 * 10)
    assert millimetres(4e-10, 1e-9) == "0 within 1e-06 mm"
    assert millimetres(-4e-10, 1e-9) == "0 within 1e-06 mm"
    assert millimetres(2e-9, 1e-9) == "2e-06 mm"
    _, page, text = written(
        replace(shaken, peaks=None, joints=replace(shaken.joints, sliding=np.full(2, 1e-12))), tmp_path
    )
    assert "largest sliding 0 within 1e-06 mm" in text
    assert "below tolerance 1e-06" in page


def test_elastic_stones_do_not_drift(mixed):
    assert length_tolerance(mixed) == pytest.approx(1e-5 * 9.81 * 1e-6)


def test_nothing_is_minus_nothing():
    shown = [millimetres(-0.0), millimetres(-1e-20), kilonewtons(-1e-9), megapascals(-1.0), percent(-1e-9)]
    assert shown[0] == "0 mm"
    assert shown[2:] == ["0.00 kN", "0.0000 MPa", "0.0 %"]


def test_forces_that_are_one_state_of_many_say_so(shaken, tmp_path):
    """A column: resultants follow from equilibrium, 2 joints for 2 stones; a third joint is one too many."""
    assert indeterminacy(shaken)["of"] is None  # one contact point each
    four = replace(
        shaken.contacts,
        **{
            name: np.repeat(getattr(shaken.contacts, name), 4, axis=0)
            for name in shaken.contacts.__dataclass_fields__
        },
    )
    assert indeterminacy(replace(shaken, contacts=four))["of"] == "pressures"
    joints = joints_of(((1, 0), (2, 1), (2, 0)), ((0, 0, 1e3),) * 3, (1, 2, 2))
    found = indeterminacy(replace(shaken, joints=joints))
    assert (found["of"], found["joints"], found["stones"]) == ("joints", 3, 2)
    _, page, text = written(replace(shaken, joints=joints), tmp_path)
    assert "one admissible state of many: 18 unknowns of 3 joints, 12 equations" in text
    assert "one admissible state of many" in page


def test_between_elastic_joints_forces_are_unique(shaken):
    joints = joints_of(((1, 0), (2, 1), (2, 0)), ((0, 0, 1e3),) * 3, (1, 2, 2))
    springs, codes = ElasticJoint(0.6, 1e9, 1e9), [frozenset({body.code}) for body in shaken.bodies]
    for contact, count in (
        (ContactSettings(springs), 0),
        (ContactSettings(rules=(LawRule(codes[1], codes[0], springs),)), 2),
        (ContactSettings(springs, (LawRule(codes[0], codes[2], DryJoint()),)), 1),
    ):
        found = indeterminacy(replace(shaken, joints=joints, scene=replace(shaken.scene, contact=contact)))
        assert found["joints"] == count
        assert found["of"] != "joints"


def test_between_elastic_stones_forces_are_unique():
    bodies = [
        rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
        deformable_body("D", (0, 0, 1), (1, 1, 2), lambda points: points[:, 2], 0.5),
    ]
    assert indeterminacy(result_of(bodies))["of"] is None


def test_the_report_states_what_went_into_the_run(shaken, tmp_path):
    inputs = {"Survey": ["window bay: 98 stones"], "Supports": ["A-1", "B-2"], "Loads": []}
    _, page, _ = written(shaken, tmp_path, inputs=inputs, versions={"moma": "0.1", "numpy": "2.4"})
    assert "window bay: 98 stones" in page
    assert "moma 0.1, numpy 2.4" in page
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    # codes stay in one line
    assert '<span class="code">A-1</span>' in text
    assert '<td class="code">A-1 – B-2</td>' in text
    assert ".code" in text
    assert "nowrap" in text


def test_a_series_has_one_line_for_each_step_and_stone(shaken, tmp_path):
    """Angles in degrees, places in the frame of the site."""
    steps = 2
    motion = np.zeros((steps, 1, 6))
    motion[..., 3] = np.radians(90.0)
    series = Series(
        body=np.array([2]),
        start=np.array([[0.5, 0.5, 2.5]]),
        time=np.array([0.1, 0.2]),
        centre=np.array([[[0.5, 0.5, 2.6]], [[0.5, 0.5, 2.7]]]),
        turn=np.full((steps, 1, 3), np.pi / 6),
        velocity=motion,
        joints=JointSeries(np.array([1]), *(np.full((steps, 1), -0.0) for _ in range(4))),
    )
    write_series(tmp_path, replace(shaken, series=series), np.array([100.0, 0, 0]))
    rows = lines_of(tmp_path / "series_stones.csv")
    assert [row["stone"] for row in rows] == ["B-2", "B-2"]
    assert float(rows[0]["x"]) == pytest.approx(100.5)
    assert [float(row["dz"]) for row in rows] == pytest.approx([0.1, 0.2])
    assert float(rows[0]["turn_y"]) == pytest.approx(30.0)
    assert float(rows[0]["spin_x"]) == pytest.approx(90.0)
    (joint, _) = lines_of(tmp_path / "series_joints.csv")
    assert (joint["first"], joint["second"], joint["opening"]) == ("A-1", "B-2", "0")
    write_series(tmp_path / "none", shaken, np.zeros(3))  # nothing to write
    assert not (tmp_path / "none").exists()
