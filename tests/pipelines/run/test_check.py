"""`moma check`: its report on simplified stones, joints and meshes, and the folder of its pictures."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from ground.errors import UsageError
from moma.cli.text.checks import check_lines, duration
from pipelines.ingest.ingest import ingest
from pipelines.run.check import check_scene
from pipelines.run.check_report import CheckReport
from pipelines.run.closing_check import joints_report, simplification_report
from survey.joints.report import ClosingReport, Gap, Overlap, StoneJoint
from survey.joints.settings import JointMode
from survey.simplify.simplify import simplify
from synthetic.buildings.walls import wall
from tests.pipelines.scenes import TWO_COURSES, survey_text

PLACE, UP = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 1.0])


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "low.toml"
    path.write_text(TWO_COURSES)
    return path


def joint(stones, plane, width, area, left_open=""):
    return StoneJoint(stones, plane, width, 0.5, area, PLACE, UP, left_open)


REPORT = ClosingReport(
    mode=JointMode.CLOSE,
    joints=(
        joint(("A", "B"), 0, 0.010, 0.3),
        joint(("B", "C"), 0, 0.020, 0.1),
        joint(("C", "D"), -1, 0.040, 0.1, "too wide"),
    ),
    displacement={"A": np.array([0.001, 0.004]), "B": np.array([0.006, 0.002]), "E": np.zeros(0)},
    volume_change={"A": 0.02, "B": -0.05},
    alone=("E",),
    gaps=(Gap(("A", "D"), 0.01, 0.1, PLACE, "bent"), Gap(("C", "D"), 0.04, 0.1, PLACE, "too wide")),
    overlaps=(Overlap(("A", "E"), 1e-6, 0.001, PLACE), Overlap(("B", "E"), 1e-5, 0.002, PLACE)),
)


def test_joints_are_counted_and_remaining_gaps_and_overlaps_have_site_coordinates():
    told = joints_report(REPORT, np.array([100.0, 200.0, 0.0]))
    assert (told.mode, told.count, told.planes, told.left_open) == ("close", 2, 1, {"too wide": 1})
    assert told.mean_width == pytest.approx((0.3 * 10 + 0.1 * 20 + 0.1 * 40) / 0.5 * 1e-3)
    assert told.area == pytest.approx(0.4)
    assert (told.max_displacement, told.worst_stone, told.max_volume_change) == (0.006, "B", 0.05)
    assert told.displacement == {"A": 0.004, "B": 0.006, "E": 0.0}
    assert [one.stones for one in told.gaps] == [("C", "D"), ("A", "D")]  # the largest first
    assert [one.stones for one in told.overlaps] == [("B", "E"), ("A", "E")]
    assert told.gaps[0].place == (101.0, 202.0, 3.0)
    empty = joints_report(ClosingReport(JointMode.AS_SURVEYED, (), {}, {}, (), (), ()), np.zeros(3))
    assert (empty.count, empty.mean_width, empty.worst_stone) == (0, 0.0, None)


def test_zero_is_never_negative():
    gaps = (Gap(("A", "B"), -2e-5, 0.1, np.array([-1e-5, 0.0, 0.0]), "bent"),)
    told = joints_report(ClosingReport(JointMode.CLOSE, (), {}, {}, (), gaps, ()), np.zeros(3))
    report = CheckReport("s", {}, {"deformable": 0}, 0, (), (), (), None, None, told, None, (), (), (), ())
    lines = "\n".join(check_lines(report, verbose=False))
    assert "A and B touch on less than half of 0.100 m² at (0.000, 0.000, 0.000)" in lines
    # a bed of which less than half is closed is no closed joint without a word
    assert "0 closed (1 of them on less than half of their area)" in lines


def test_simplified_stones_are_reported_by_shape_and_against_the_tolerance_of_the_survey():
    stones = [simplify(one) for one in wall(30, 3).blocks()]
    told = simplification_report(stones)
    assert told is not None
    assert sum(told.shapes.values()) == len(stones) > 20
    assert told.blockiness == min(one.report.blockiness for one in stones)
    assert {one.code for one in told.outside} == {one.code for one in stones if not one.report.within}
    assert told.displacement[told.worst_stone] == told.max_displacement == max(told.displacement.values())
    assert set(told.general) == {one.code for one in stones if one.shape == "polyhedron"}
    assert simplification_report([]) is None


def test_the_report_has_the_stones_and_joints_of_the_scene(scene, url):
    report = check_scene(scene, url)
    assert report.problems == ()
    assert report.simplification is not None
    assert sum(report.simplification.shapes.values()) == sum(report.kinds.values()) == 18
    assert report.joints is not None
    assert report.joints.mode == "close"
    assert report.joints.count > 18
    assert json.loads(json.dumps(asdict(report), allow_nan=False))["joints"]["gaps"] == []
    lines = "\n".join(check_lines(report, verbose=False))
    assert "simplified: 18 hexahedra; corners moved by" in lines
    assert f"joints (close): {report.joints.count} closed on {report.joints.planes} planes" in lines
    assert "0 left open" in lines
    assert "W01-02 moved by" in "\n".join(check_lines(report, verbose=True))
    assert report.mesh_quality is None


def test_the_report_has_the_quality_of_the_meshes(scene, url):
    scene.write_text(TWO_COURSES.replace('"rigid"', '"deformable"') + "[mesh]\nsize = 0.4\n")
    quality = check_scene(scene, url).mesh_quality
    assert quality is not None
    assert 0.0 < quality.smallest_jacobian <= 1.0
    assert 0.0 < quality.smallest_angle <= 90.0
    assert sum(quality.how.values()) == 8
    assert "smallest scaled Jacobian" in "\n".join(check_lines(check_scene(scene, url), verbose=False))


def test_what_is_left_open_is_listed_with_reasons_and_is_a_problem_where_nothing_closes(scene, url):
    scene.write_text(TWO_COURSES + "[joints]\nmax_displacement = 0.001\n")
    report = check_scene(scene, url)
    assert report.joints is not None
    assert len(report.joints.gaps) >= 18
    lines = check_lines(report, verbose=False)
    assert sum(" over " in line and " open by " in line for line in lines) == 5
    assert any(line.endswith("more, with -v") for line in lines)
    every = check_lines(report, verbose=True)
    assert sum(" over " in line and " open by " in line for line in every) == len(report.joints.gaps)
    assert any("max_displacement" in one for one in report.problems)
    scene.write_text(TWO_COURSES + '[joints]\nmode = "as-surveyed"\n')
    report = check_scene(scene, url)
    assert not any("could be closed" in one for one in report.problems)
    assert report.joints is not None
    assert (report.joints.mode, report.joints.count) == ("as-surveyed", 0)


def test_pictures_and_the_report_lie_in_a_folder_of_their_own(scene, url, tmp_path):
    folder = tmp_path / "pictures"
    report = check_scene(scene, url, folder)
    (thin,) = report.warnings
    assert "6 stones are thinner than the wall" in thin
    assert sorted(one.name for one in folder.iterdir()) == sorted(report.files)
    assert {"joints.png", "moved.png", "joints-3d.png", "check.json"} <= {*report.files}
    told = json.loads((folder / "check.json").read_text())
    assert told["joints"]["count"] == report.joints.count  # type: ignore[union-attr]
    check_scene(scene, url, folder)  # in place of the earlier ones
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(UsageError, match=r"notes\.txt"):
        check_scene(scene, url, folder)
    assert (folder / "notes.txt").read_text() == "mine"


def test_only_deep_overlaps_of_measured_stones_are_to_be_looked_at():
    """Closed joints of stones measured 4, 6 and 9 mm into each other, the last one with a stone that nobody saw."""
    joints = tuple(
        joint(stones, k, width, 0.2)
        for k, (stones, width) in enumerate(
            ((("A", "B"), -0.004), (("B", "C"), -0.006), (("C", "H"), -0.009), (("A", "D"), 0.02))
        )
    )
    told = joints_report(replace(REPORT, joints=joints), np.zeros(3), frozenset({"H"}))
    assert [(one.stones, one.width) for one in told.measured_overlaps] == [(("B", "C"), -0.006)]
    every = joints_report(replace(REPORT, joints=joints), np.zeros(3))
    assert [one.stones for one in every.measured_overlaps] == [("C", "H"), ("B", "C")]  # the deepest first


def test_what_check_prints_has_units_and_is_sound_only_without_problems(scene, url):
    report = replace(check_scene(scene, url), joints=joints_report(REPORT, np.zeros(3)))
    lines = check_lines(report, verbose=False)
    text = "\n".join(lines)
    for words in (
        "material limestone: 18 stones, ρ 2350 kg/m³, E 12 GPa, ν 0.2",
        "2 closed on 1 planes, 0.40 m² in all; 18.0 mm wide on average as surveyed; 1 left open",
        "closing moved corners by 6.0 mm at most (stone B), and changed volumes by 5.0 % at most",
        "C and D open by 40.0 mm over 0.100 m² at (1.000, 2.000, 3.000): too wide",
        "B and E lie 2.0 mm in each other (10 cm³)",
        "1 stone without any joint: E",
    ):
        assert words in text
    assert any(line.startswith("sound") for line in lines)
    told = check_lines(replace(report, problems=("it falls", "it is open")), verbose=False)
    assert [line for line in told if line.startswith("problem")] == [
        "problem: it falls",
        "problem: it is open",
    ]
    assert not any(line.startswith("sound") for line in told)


@pytest.mark.parametrize(("sunk", "found"), [(0.002, []), (0.05, ["LOW and TOP lie 50 mm in each other"])])
def test_stones_that_lie_deep_in_each_other_are_a_problem(tmp_path, sunk, found):
    """A stone on another, measured 2 mm or 50 mm too low, with its joints as surveyed."""

    def face(course, z):
        corners = np.array([(0.0, 0.0, z), (0.6, 0.0, z), (0.6, 0.0, z + 0.3), (0.0, 0.0, z + 0.3)])
        inside = np.array([(0.4, 0.0, 0.15), (0.2, 0.0, 0.2), (0.3, 0.0, 0.05), (0.5, 0.0, 0.25)])
        return course, corners, inside + np.array([0.0, 0.0, z])

    stones = {"LOW": face(1, 0.0), "TOP": face(2, 0.3 - sunk)}
    (tmp_path / "two.moma").write_text(survey_text(stones, np.zeros(3)), encoding="utf-8")
    url = f"sqlite:///{tmp_path / 'two.db'}"
    ingest([tmp_path / "two.moma"], url)
    (tmp_path / "two.toml").write_text(TWO_COURSES + '[joints]\nmode = "as-surveyed"\n', encoding="utf-8")
    problems = check_scene(tmp_path / "two.toml", url).problems
    assert [one.partition(";")[0] for one in problems if "in each other" in one] == found


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (0.123, "0.12 s"),
        (9.96, "10 s"),
        (100.0, "100 s"),
        (121.0, "2 min"),
        (7000.0, "117 min"),
        (7300.0, "2 h"),
    ],
)
def test_times_are_given_in_a_convenient_unit(seconds, told):
    assert duration(seconds) == told
