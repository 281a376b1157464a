"""Runs of a diagnosis: files beside the scene, stages, and movements that count from rest, on a block on the ground."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.assess.diagnosis.file import read_diagnosis
from pipelines.assess.diagnosis.fit import Fit
from pipelines.assess.diagnosis.ranking import rank
from pipelines.assess.diagnosis.results import write_best
from pipelines.assess.diagnosis.search import cases_of, check_case, runs_of
from pipelines.assess.diagnosis.trials import Trial, Tried, run_trial, since_rest
from pipelines.assess.motions import Motions
from pipelines.ingest.ingest import ingest
from pipelines.scene.file import read_scene

SCENE = """
[diagnosis]
[materials.limestone]
density = 2000.0
young = 12e9
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["G"]
[time]
step = 0.01
theta = 1.0
start = "equilibrium"
[[hypotheses]]
name = "moved"
"""

SETTLED = """
[[hypotheses.unknowns]]
name = "depth"
unit = "m"
start = 0.01
low = 0.0
high = 0.05
[[hypotheses.scene.loads]]
type = "settlement"
stones = ["G"]
displacement = [0.0, 0.0, "= -depth"]
duration = 0.2
"""

SHAKEN = """
[[hypotheses.unknowns]]
name = "peak"
unit = "m/s2"
start = 1.0
low = 0.0
high = 4.0
[[hypotheses.scene.loads]]
type = "ground_motion"
stones = ["G"]
x = "records/pulse.csv"
unit = "m/s2"
scale = "= peak"
"""

YIELDING = """
[[laws]]
type = "elastic_joint"
friction = 0.6
normal_stiffness = 1e6
shear_stiffness = 1e6
damping_time = 0.1
"""

CUBE = """\
o {code}
v {x0} {x0} {z0}
v {x1} {x0} {z0}
v {x1} {x1} {z0}
v {x0} {x1} {z0}
v {x0} {x0} {z1}
v {x1} {x0} {z1}
v {x1} {x1} {z1}
v {x0} {x1} {z1}
f {f[0]} {f[3]} {f[2]} {f[1]}
f {f[4]} {f[5]} {f[6]} {f[7]}
f {f[0]} {f[1]} {f[5]} {f[4]}
f {f[1]} {f[2]} {f[6]} {f[5]}
f {f[2]} {f[3]} {f[7]} {f[6]}
f {f[3]} {f[0]} {f[4]} {f[7]}
"""


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    """A database with a block of 1 m that stands on the ground."""
    folder = tmp_path_factory.mktemp("block")
    ground = CUBE.format(code="G:support", x0=-1, x1=2, z0=-1, z1=0, f=range(1, 9))
    block = CUBE.format(code="A", x0=0, x1=1, z0=0, z1=1, f=range(9, 17))
    (folder / "stones.obj").write_text(ground + block, encoding="utf-8")
    ingest([folder / "stones.obj"], f"sqlite:///{folder / 'stones.db'}", "solids")
    return f"sqlite:///{folder / 'stones.db'}"


def diagnosis(folder, text):
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    return read_diagnosis(folder / "scene.toml")


def moved(file, url, amount):
    """Displacement (3,) of the middle of the block."""
    (case,) = cases_of(file, {})
    (tried,) = runs_of(file, url, lambda trials: [run_trial(one) for one in trials])([(case, (amount,))])
    assert tried.fault == ""
    return tried.motions.field["A"][0]


def test_records_beside_the_scene_are_found_and_go_with_the_best_scene(url, tmp_path, monkeypatch):
    (tmp_path / "records").mkdir()
    # up and down again within 0.2 s: the ground has moved by 0.01 m at the end
    lines = [f"{k * 0.1:.1f}, {a}" for k, a in enumerate((0.0, 1.0, -1.0, 0.0))]
    (tmp_path / "records/pulse.csv").write_text("\n".join(lines), encoding="utf-8")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    file = diagnosis(tmp_path, SCENE + SHAKEN)
    (case,) = cases_of(file, {})
    assert check_case(file, case, url, False) == ""
    shaken = moved(file, url, 2.0)
    assert shaken[0] > 0.01
    (elsewhere / "pulse.csv").write_text("of something else", encoding="utf-8")
    found = Fit((2.0,), np.ones(3), np.eye(1), (), 1)
    write_best(elsewhere, file, case, rank("moved", (), case.hypothesis.unknowns, found, 3, 0))
    best = read_scene(elsewhere / "best.toml")
    assert best.loads[0].values["x"].peak == pytest.approx(1.0)
    assert (elsewhere / "pulse.csv").read_text(encoding="utf-8") == "of something else"
    again = run_trial(Trial(best.text, best.document.path, url))
    assert again.motions.field["A"][0] == pytest.approx(shaken)


def test_a_building_in_stages_is_run_in_its_stages(url, tmp_path):
    stages = '[[stages]]\nname = "laid"\nlay = ["A"]\n[[stages]]\nname = "settling"\n'
    text = SCENE + SETTLED + 'stages = ["settling"]\n' + stages
    file = diagnosis(tmp_path, text)
    (case,) = cases_of(file, {})
    assert check_case(file, case, url, False) == ""
    assert moved(file, url, 0.02) == pytest.approx([0.0, 0.0, -0.02], abs=1e-5)


def test_movements_count_from_where_the_scene_rests(url, tmp_path):
    # the block weighs 19.62 kN on 1 m² of springs of 1 MN/m³
    drawn = diagnosis(tmp_path, SCENE + SETTLED + YIELDING)
    assert moved(drawn, url, 0.02)[2] == pytest.approx(-0.02 - 0.01962, rel=1e-3)
    resting = diagnosis(
        tmp_path, (SCENE + SETTLED + YIELDING).replace("[diagnosis]", "[diagnosis]\nfrom_rest = true")
    )
    assert moved(resting, url, 0.02)[2] == pytest.approx(-0.02, rel=1e-3)


def test_a_scene_that_does_not_rest_without_any_cause_is_told():
    tried = Tried(Motions({}, {}), "", 1.0)
    fallen = Tried(None, "the run ended in collapse", 1.0)
    assert since_rest(tried, fallen).fault == "without any cause: the run ended in collapse"
    assert since_rest(tried, fallen).motions is None
    assert since_rest(fallen, tried).fault == fallen.fault
    assert since_rest(tried, replace(tried, fault="moving")).fault == "without any cause: moving"


def test_a_run_that_collapses_has_no_motions(url, tmp_path):
    """The block weighs 19.6 kN, and is pushed away by 20 kN."""
    push = '[[loads]]\ntype = "force"\nstones = ["A"]\nforce = [20e3, 0.0, 0.0]\n'
    text = SCENE.split("[[hypotheses]]")[0].replace("[diagnosis]", "") + push
    tried = run_trial(Trial(text, str(tmp_path / "scene.toml"), url))
    assert (tried.motions, tried.fault) == (None, "the run ended in collapse")
