"""Openings of a wall known by its outlines, in what `moma check`, `moma pushover` and `moma run` tell of it."""

import json

import pytest

from tests.moma.commands import invoke, prints
from tests.paths import ROOT

CASES = ROOT.parent / "shared/cases/newcomer-wall"
needs_shared = pytest.mark.skipif(not CASES.is_dir(), reason="the cases lie beside the project")

# two piers of two stones, 0.3 m apart, under a lintel; a joint of 10 mm
BOXES = (
    (0, 0, 0.4, 0.195),
    (0, 0.205, 0.4, 0.395),
    (0.7, 0, 1.1, 0.195),
    (0.7, 0.205, 1.1, 0.395),
    (0, 0.405, 1.1, 0.6),
)
SCENE = """
[scene]
name = "Door"
[materials.stone]
density = 2000.0
young = 10e9
poisson = 0.2
[joints]
mode = "mortar"
mortar_density = 1500.0
[contact]
friction = 0.6
[bodies]
fixed = ["code = S001", "code = S003"]
[time]
step = 0.01
duration = 0.02
[output]
pictures = []
[[laws]]
type = "elastic_joint"
friction = 0.6
normal_stiffness = 1e11
shear_stiffness = 4e10
[pushover]
height = 0.61
load = 10e3
to = [0.001]
step = 5e-4
"""
OPENING = (
    "an opening stays open: 0.30 × 0.41 m, at 0.40 and 0.00 m from the lower left corner, up to the foot"
)


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    folder = tmp_path_factory.mktemp("door")
    stones = [
        {"stone": k, "outline": [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]}
        for k, (x0, y0, x1, y1) in enumerate(BOXES, start=1)
    ]
    (folder / "door.json").write_text(json.dumps(stones))
    found = f"sqlite:///{folder / 'door.db'}"
    prints("ingest", "--outlines", folder / "door.json", "--size", "1.1x0.6", "--depth", "0.2", "--db", found)
    return found


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "door.toml"
    path.write_text(SCENE)
    return path


def test_check_tells_what_stays_open_and_what_the_stones_took_in(url, scene, tmp_path):
    told = prints("check", scene, "--db", url, "--pictures", tmp_path / "pictures")
    assert OPENING in told
    assert "mortar fills what is up to 50 mm wide (max_width in [joints])" in told
    found = json.loads((tmp_path / "pictures/check.json").read_text())
    (leaf,) = found["joints"]["leaves"]
    assert leaf["openings"][0]["sides"] == ["below"]
    surveyed = sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in BOXES) * 0.2
    filled = (1.1 * 0.6 - leaf["openings"][0]["area"]) * 0.2
    amounts = found["filling"]
    assert amounts["surveyed"] == pytest.approx(surveyed, rel=1e-6)
    assert amounts["modelled"] == pytest.approx(filled, rel=1e-6)
    weight = 9.81 * (2000.0 * surveyed + 1500.0 * (filled - surveyed))
    assert amounts["modelled_weight"] == pytest.approx(weight, rel=1e-3)
    change = 100.0 * (filled / surveyed - 1.0)
    assert f"m³ as surveyed ({change:+.1f} %)" in told
    assert "stones take in mortar of 1500 kg/m³" in told
    assert amounts["mortar_density"] == 1500.0


def test_a_run_tells_so_too(url, scene, tmp_path):
    invoke("run", scene, "--db", url, "--out", tmp_path / "run")  # two steps, after which it is still moving
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    joints = summary["inputs"]["Joints of the survey"]
    assert any(OPENING in line for line in joints)
    assert joints[-1].startswith("stones fill")
    assert summary["filling"]["modelled"] > summary["filling"]["surveyed"]


def test_pushover_warns_of_what_stays_open(url, scene, tmp_path):
    scene.write_text(SCENE.replace('fixed = ["code = S001", "code = S003"]', ""))
    told = prints("pushover", scene, "--db", url, "--out", tmp_path / "pushed")
    assert OPENING in told
    assert OPENING in (tmp_path / "pushed/report.html").read_text()
    assert any(
        OPENING in line for line in json.loads((tmp_path / "pushed/pushover.json").read_text())["cautions"]
    )


@pytest.mark.slow
@needs_shared
@pytest.mark.parametrize(
    ("source", "size", "depth", "scene", "opening", "strength"),
    [
        ("win.json", "3.0x2.4", "0.4", "p_true.toml", (0.92, 0.82), 116.2),
        ("mask_with_door.png", "6x4", "0.5", "pushover_door.toml", (1.40, 2.20), 235.7),
    ],
)
def test_walls_with_a_window_and_a_door(source, size, depth, scene, opening, strength, tmp_path):
    """Hold the strength against that of the same stones with closed joints, which do not grow."""
    found = f"sqlite:///{tmp_path / 'wall.db'}"
    option = "--outlines" if source.endswith("json") else "--masks"
    prints("ingest", option, CASES / source, "--size", size, "--depth", depth, "--db", found)
    prints("pushover", CASES / scene, "--db", found, "--out", tmp_path / "pushed")
    summary = json.loads((tmp_path / "pushed/pushover.json").read_text())
    width, height = opening
    assert any(f"{width:.2f} × {height:.2f} m" in line for line in summary["cautions"])
    assert summary["strength"]["forwards"] / 1e3 == pytest.approx(strength, rel=0.03)
