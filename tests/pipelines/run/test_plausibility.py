"""Checks of values that no stone can have, and of corners out of place, before a scene is built."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.scene import Fidelity
from pipelines.ingest.ingest import ingest
from pipelines.reports.survey.report import report_surveys
from pipelines.run.check import check_scene
from pipelines.run.plausibility import depth_warnings
from tests.moma.commands import invoke, prints

WINDOW = Path("data/samples/window/window.moma")
SCENE = """
[scene]
name = "Low courses"
[select]
where = ["course <= 3"]
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[contact]
friction = 0.6
[bodies]
default = "rigid"
fixed = ["course = 1"]
"""


def checked(folder: Path, url: str, old: str = "", new: str = ""):
    path = folder / "low.toml"
    path.write_text(SCENE.replace(old, new) if old else SCENE)
    return check_scene(path, url)


def edited(folder: Path, code: str, change) -> Path:
    """Write the window bay with the four corners of one stone changed, as lists of three numbers."""
    lines = WINDOW.read_text().split("\n")
    start = next(k for k, line in enumerate(lines) if line.startswith(f"stone {code} "))
    rows = [k for k in range(start, start + 40) if lines[k].strip().startswith("vertex")][:4]
    corners = change([[float(one) for one in lines[k].split()[1:4]] for k in rows])
    for k, corner in zip(rows, corners, strict=True):
        lines[k] = "  vertex " + " ".join(f"{one:.4f}" for one in corner)
    path = folder / "edited.moma"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("2350.0", "2.2", "limestone: density 2.2 kg/m³ is not that of a stone"),
        ("12e9", "10.0", "limestone: young 10 Pa is not that of a stone"),
        ("0.6", "1e9", "low.toml:10: friction 1e+09 is not that of a stone"),
        ("0.6", "0.6\n[[laws]]\nmaterials = ['limestone', 'limestone']\ntype = 'dry'\nfriction = 35.0", "in degrees"),
    ],
)  # fmt: skip
def test_a_property_that_no_stone_has_is_a_problem(tmp_path, url, old, new, words):
    assert checked(tmp_path, url).problems == ()
    (problem,) = checked(tmp_path, url, old, new).problems
    assert words in problem


def test_a_property_that_hardly_any_stone_has_is_a_warning(tmp_path, url):
    report = checked(tmp_path, url, "2350.0", "900.0")
    assert report.problems == ()
    assert "density 900 kg/m³ is unusual" in report.warnings[0]


@pytest.mark.parametrize(
    ("step", "duration", "problem", "warning"),
    [
        ("1e-9", "1e6", "1e+15 steps, which takes longer than anyone waits", ""),
        ("1e-6", "2e3", "2e+09 steps", ""),
        ("1e-6", "20.0", "", "2e+07 steps, which takes hours"),
        ("0.5", "20.0", "", "falls by 2452 mm"),
        ("1e-3", "600.0", "", ""),
        ("0.01", "10.0", "", ""),
    ],
)
def test_steps_that_never_end_are_a_problem(tmp_path, url, step, duration, problem, warning):
    report = checked(tmp_path, url, "[contact]", f"[time]\nstep = {step}\nduration = {duration}\n[contact]")
    for found, words in ((report.problems, problem), (report.warnings, warning)):
        told = [one for one in found if "steps" in one]
        assert len(told) == bool(words)
        assert all(one.startswith(f"{tmp_path / 'low.toml'}:11: ") and words in one for one in told)


def test_steps_that_cannot_be_counted_are_refused(tmp_path, url):
    with pytest.raises(SceneError, match="too short to count the steps"):
        checked(tmp_path, url, "[contact]", "[time]\nstep = 1e-320\n[contact]")


def test_a_survey_in_millimetres_is_recognised(tmp_path):
    lines = WINDOW.read_text().split("\n")
    for k, line in enumerate(lines):
        if (words := line.split()) and words[0] in ("vertex", "point"):
            lines[k] = f"  {words[0]} " + " ".join(str(1e3 * float(one)) for one in words[1:4])
    path = tmp_path / "mm.moma"
    path.write_text("\n".join(lines))
    study = report_surveys([path], tmp_path / "report").study
    assert "in millimetres it would be 0.37" in study.warnings[0]
    url = f"sqlite:///{tmp_path}/mm.db"
    (file,) = ingest([path], url).files
    assert len(file.doubts) == 98
    assert "in millimetres" in file.doubts["W01-01"]
    problems = checked(tmp_path, url).problems
    assert "m is not that of a stone" in problems[0]


def test_a_vertex_at_100_km_is_a_problem(tmp_path):
    def far(corners):
        corners[2][0] += 1e5
        return corners

    path, url = edited(tmp_path, "W03-03", far), f"sqlite:///{tmp_path}/far.db"
    assert "doubtful: W03-03: length " in prints("ingest", path, "--db", url)
    assert any("stone W03-03: length " in one for one in checked(tmp_path, url).problems)


def test_a_corner_25_cm_off_in_its_plane_is_in_every_headline(tmp_path):
    def off(corners):
        (ax, ay, _), (bx, by, _) = corners[:2]
        corners[1] = [bx - 0.6 * (bx - ax), by - 0.6 * (by - ay), corners[1][2]]  # 25 cm inside: no overlap
        return corners

    path, url = edited(tmp_path, "W03-03", off), f"sqlite:///{tmp_path}/off.db"
    told = prints("survey-report", path, "--out", tmp_path / "report")
    assert "measure again, what changes a verdict first:\n  W03-03: its angle at" in told
    assert "\n  W03-03: its angle" not in prints("survey-report", WINDOW, "--out", tmp_path / "sound")
    ingest([path], url)
    assert any("stone W03-03: its angle at" in one for one in checked(tmp_path, url).warnings)


def test_corners_listed_crosswise_are_reported_with_their_stone(tmp_path):
    path = edited(tmp_path, "W03-03", lambda corners: [corners[k] for k in (0, 2, 1, 3)])
    words = "W03-03: the corners were not listed in order around the face"
    assert words in prints("survey-report", path, "--out", tmp_path / "report")
    assert "the corners were not listed in order" in (tmp_path / "report/report.html").read_text()
    assert words in prints("ingest", path, "--db", f"sqlite:///{tmp_path}/crossed.db")


def test_check_exits_with_1_on_what_no_stone_can_be(tmp_path, url):
    path = tmp_path / "low.toml"
    path.write_text(SCENE.replace("12e9", "10.0"))
    done = invoke("check", path, "--db", url)
    assert done.exit_code == 1
    assert "in GPa it would be 1e+10 Pa" in done.stdout
    assert "sound" not in done.stdout


def laid(depths, normal=(0.0, -1.0, 0.0), behind=()):
    """Stones of 0.6 x 0.3 m side by side in a façade at y = 0 with these depths, and others behind some of them."""
    turn = np.array([(-normal[1], normal[0], 0.0), (-normal[0], -normal[1], 0.0), (0.0, 0.0, 1.0)])
    stones = []
    for place, front, deep in [*((k, 0.0, one) for k, one in enumerate(depths)), *behind]:
        corners = [
            (x, y, z)
            for x in (0.6 * place, 0.6 * place + 0.6)
            for y in (front, front + deep)
            for z in (0, 0.3)
        ]
        record = SimpleNamespace(
            code=f"s{len(stones)}",
            normal=np.array(normal),
            solid_vertices=np.array(corners) @ turn,
            area=0.18,
        )
        stones.append(SimpleNamespace(record=record, listed=None))
    return stones


@pytest.mark.parametrize("normal", [(0.0, -1.0, 0.0), (0.6, 0.8, 0.0)])
def test_stones_thinner_than_their_wall_are_told(normal):
    (said,) = depth_warnings(laid([0.3, 0.5, 0.3, 0.3, 0.5], normal))
    assert said.startswith(
        "3 stones are thinner than the wall, 0.50 m, with nothing behind: s0 0.30 m, s2 0.30 m"
    )
    assert "propose a core" in said
    assert depth_warnings(laid([0.45, 0.5, 0.48], normal)) == []
    assert depth_warnings(laid([0.3] * 5, normal)) == []


def test_a_slab_of_ground_makes_no_wall_as_deep():
    stones = laid([0.3, 0.3, 4.0])
    assert depth_warnings(stones)
    stones[2].listed = Fidelity.FIXED
    assert depth_warnings(stones) == []


def test_a_core_or_a_second_leaf_fills_what_lies_behind_thin_stones():
    assert depth_warnings(laid([0.3, 0.5, 0.3], behind=[(0, 0.31, 0.19), (2, 0.31, 0.19)])) == []
    (said,) = depth_warnings(laid([0.3, 0.5, 0.3], behind=[(0, 0.31, 0.19)]))
    assert said.startswith("1 stone is thinner than the wall, 0.50 m, with nothing behind: s2 0.30 m;")
    # one deep quoin in thirty stones does not make the wall as deep
    assert depth_warnings(laid([0.3] * 29 + [0.9])) == []
