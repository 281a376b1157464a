"""`moma pushover`: from outlines to the curve of a block that rocks, with its band, and mistakes."""

import csv
import json

import numpy as np
import pytest

from tests.moma.commands import answer, fails, invoke, prints

OUTLINES = "code,x,y\nA,0,0\nA,0.6,0\nA,0.6,0.5\nA,0,0.5\nB,0,0.5\nB,0.6,0.5\nB,0.6,1\nB,0,1\n"
LOAD, WEIGHT = 40e3, 2000.0 * 9.81 * 0.6 * 0.2
SCENE = """
[scene]
name = "Two blocks"
[materials.stone]
density = 2000.0
young = 10e9
poisson = 0.2
[joints]
mode = "as-surveyed"
[contact]
friction = 1.0
[[laws]]
type = "elastic_joint"
friction = 1.0
normal_stiffness = 1e12
shear_stiffness = 4e11
[pushover]
height = 1.1
load = 40e3
to = [0.01]
step = 5e-4
"""
MEASURED = "displacement [mm],force [kN]\n2,9\n,\nNaN,NaN\n5,11\n"


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pushover")
    (folder / "blocks.csv").write_text(OUTLINES)
    found = f"sqlite:///{folder / 'blocks.db'}"
    prints("ingest", "--outlines", folder / "blocks.csv", "--size", "0.6x1", "--depth", "0.2", "--db", found)
    return found


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "measured.csv").write_text(MEASURED)
    path = tmp_path / "blocks.toml"
    path.write_text(SCENE)
    return path


def test_the_curve_of_blocks_that_rock_stands_beside_the_measured_one_within_its_band(url, scene, tmp_path):
    scene.write_text(
        SCENE.replace("step", 'measured = "measured.csv"\nstep')
        + "[pushover.scatter]\nload = 0.1\ndensity = 0.1\n"
    )
    told = answer("pushover", scene, "--db", url, "--out", tmp_path / "out")
    expected = (LOAD + WEIGHT) * 0.3 / 1.1
    assert told["strength"]["forwards"] == pytest.approx(expected, rel=0.03)
    assert told["strength"]["backwards"] == 0.0
    assert told["turning"] == pytest.approx(1.0, abs=0.05)
    assert "it rocks" in told["headline"]
    band = told["band"]
    assert band["by_one_sigma"]["load"] == pytest.approx(0.1 * LOAD * 0.3 / 1.1, rel=0.05)
    assert band["by_one_sigma"]["density"] == pytest.approx(0.1 * WEIGHT * 0.3 / 1.1, rel=0.1)
    assert band["strength"] == pytest.approx(1.645 * np.hypot(*band["by_one_sigma"].values()), rel=1e-3)
    assert told["measured"]["ratio"]["forwards"] == pytest.approx(expected / 11e3, rel=0.03)
    assert told["errors"]["unsolved"] == 0
    assert sorted(told["files"]) == sorted(path.name for path in (tmp_path / "out").iterdir())
    with (tmp_path / "out/curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 20
    assert float(rows[-1]["displacement"]) == pytest.approx(0.01)
    page = (tmp_path / "out/report.html").read_text(encoding="utf-8")
    assert "density" in page
    assert json.loads((tmp_path / "out/pushover.json").read_text(encoding="utf-8")) == told
    assert "pushed" in prints("runs", "--db", url)


def test_the_lines_tell_strength_stiffness_and_errors(url, scene, tmp_path):
    said = prints("pushover", scene, "--db", url, "--out", tmp_path / "out")
    assert said.startswith("Two blocks: bears 11")
    assert "kN/mm, secants at 15 and 30 % of the largest force" in said
    assert "dry joints of 1e+03 GPa/m" in said
    assert "20 steps, 0 not solved" in said
    checked = invoke("check", scene, "--db", url)
    assert checked.exit_code == 0
    assert "no stone is fixed: only `moma pushover`" in checked.stderr
    assert "dry joints of 1e+03 GPa/m" in checked.stderr


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[pushover]\n", "", "unknown key"),
        ("height = 1.1", "height = 0.9", "below the stones' top"),
        ("to = [0.01]", "to = []", "no displacement"),
        ("to = [0.01]", 'to = [0.01]\nhead = "sideways"', "head"),
        ("load = 40e3", "load = 40e3\ndirection = [0, 0, 1]", "horizontal direction"),
        ("to = [0.01]", 'to = [0.01]\nmeasured = "none.csv"', "measured curve cannot be read"),
        ("step = 5e-4", "step = 5e-4\n[pushover.scatter]\nfriktion = 0.1", "friction"),
    ],
)
def test_mistakes_name_their_place(url, scene, tmp_path, old, new, words):
    scene.write_text(SCENE.replace(old, new))
    assert words in fails(2, "pushover", scene, "--db", url, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_scene_without_a_rig_is_refused(url, scene, tmp_path):
    scene.write_text(SCENE[: SCENE.index("[pushover]")])
    assert "no table [pushover]" in fails(2, "pushover", scene, "--db", url, "--out", tmp_path / "out")


REFUSED = 'fix the lowest: [bodies] fixed = ["A"]'


def test_a_run_of_a_scene_for_a_rig_names_the_stones_to_fix(url, scene, tmp_path):
    assert REFUSED in fails(1, "run", scene, "--db", url, "--out", tmp_path / "run")


@pytest.mark.slow
def test_a_run_with_these_stones_fixed_stands(url, scene, tmp_path):
    scene.write_text(SCENE + '[bodies]\nfixed = ["A"]\n')
    assert "equilibrium" in prints("run", scene, "--db", url, "--out", tmp_path / "run")


def test_stones_that_do_not_rest_in_the_rig_are_named(scene, tmp_path):
    (tmp_path / "aside.csv").write_text(OUTLINES.replace("B,0,", "B,0.35,").replace("B,0.6,", "B,0.95,"))
    url = f"sqlite:///{tmp_path / 'aside.db'}"
    prints("ingest", "--outlines", tmp_path / "aside.csv", "--size", "0.95x1", "--depth", "0.2", "--db", url)
    scene.write_text(SCENE.replace("height = 1.1\nload = 40e3", 'height = 0.9\nhead = "free"'))
    said = fails(1, "pushover", scene, "--db", url, "--out", tmp_path / "out")
    assert "still moving or fallen: B at (" in said
