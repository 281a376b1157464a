"""Every kind of input on a block whose answers are known: samples and gradients against closed forms."""

import csv

import numpy as np
import pytest
from scipy.stats import norm

from pipelines.assess.study.estimates import monte_carlo
from pipelines.assess.study.study import run_study
from tests.pipelines.assess.study.surveys import DEPTH, HEIGHT, SCENE, block_survey, study_file

WEIGHT_DENSITY = 2000.0 * 9.81
BASE = 0.5 * DEPTH
WEIGHT = WEIGHT_DENSITY * BASE * HEIGHT
PUSH = '[[quantities]]\ntype = "bound"\nload = "horizontal y"\n'
ROUGH = SCENE.replace("friction = 0.35", "friction = 0.6")
CLOSE = 1e-6  # of λ: programmes leave 10⁻⁹


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    return folder, block_survey(folder)


def sampled(place, out, scene, table, quantity=PUSH, samples=4):
    """The summary of a study of one input, its values in each sample, and those of the quantity."""
    folder, url = place
    (folder / "block.toml").write_text(scene, encoding="utf-8")
    done = run_study(study_file(folder, "monte_carlo", table, quantity, samples=samples), url, out)
    rows = list(csv.reader((out / "samples.csv").read_text().splitlines()))
    return done.summary, monte_carlo(samples, 1, 1)[:, 0], np.array([float(row[1]) for row in rows[1:]])


def mortar(friction, tension, shear):
    return ROUGH + f'[[laws]]\ntype = "mortar"\nfriction = {friction}\ntension = {tension}\nshear = {shear}\n'


LIMITS = {
    # a strip of the width N/σ bears the weight
    "strength": (
        ROUGH.replace("poisson", "compressive_strength = 1e6\npoisson"),
        '[[inputs]]\ntype = "strength"\ncov = 0.1\n',
        lambda z: (DEPTH - WEIGHT_DENSITY * HEIGHT * DEPTH / (1e6 * (1.0 + 0.1 * z))) / HEIGHT,
    ),
    "tension": (
        mortar(0.6, 2e3, 1e5),
        '[[inputs]]\ntype = "tension"\ncov = 0.1\n',
        lambda z: DEPTH / HEIGHT * (1.0 + 2e3 * (1.0 + 0.1 * z) * BASE / WEIGHT),
    ),
    "cohesion": (
        mortar(0.1, 0.0, 2e3),
        '[[inputs]]\ntype = "cohesion"\ncov = 0.1\n',
        lambda z: 0.1 + 2e3 * (1.0 + 0.1 * z) * BASE / WEIGHT,
    ),
    "load": (
        ROUGH + '[[loads]]\ntype = "force"\nstones = ["BLOCK"]\nforce = [0.0, 300.0, 0.0]\n',
        '[[inputs]]\ntype = "load"\nacts = "factor"\nsigma = 0.2\n',
        lambda z: DEPTH / HEIGHT - 300.0 * (1.0 + 0.2 * z) / WEIGHT,
    ),
    "direction": (
        ROUGH,
        '[[inputs]]\ntype = "direction"\nsigma = 5.0\n',
        lambda z: DEPTH / HEIGHT / np.cos(np.radians(5.0 * z)),
    ),
}


@pytest.mark.parametrize("name", LIMITS)
def test_limit_loads_follow_the_input(place, tmp_path, name):
    scene, table, expected = LIMITS[name]
    summary, z, values = sampled(place, tmp_path / "out", scene, table)
    assert values == pytest.approx(expected(z), rel=CLOSE)
    slope = (expected(1e-4) - expected(-1e-4)) / 2e-4
    assert summary["linear"]["sigma"] == pytest.approx(abs(slope), abs=1e-5)


@pytest.mark.slow
def test_settlement_follows_the_stiffness_of_joints(place, tmp_path):
    """A block of the pressure ρ g h on springs of k settles by ρ g h/k."""
    law = '[[laws]]\ntype = "elastic_joint"\nfriction = 0.6\nnormal_stiffness = 1e9\nshear_stiffness = 4e8\n'
    scene = ROUGH + law + "[time]\nstep = 0.01\nduration = 5.0\nrelaxation = true\n"
    quantity = '[[quantities]]\ntype = "summary"\nkey = "settlement.max"\n'
    table = '[[inputs]]\ntype = "stiffness"\nacts = "factor"\ncov = 0.1\n'
    _, z, values = sampled(place, tmp_path / "out", scene, table, quantity)
    assert values == pytest.approx(WEIGHT_DENSITY * HEIGHT / (1e9 * (1.0 + 0.1 * z)), rel=0.01)


@pytest.mark.slow
def test_each_record_of_a_folder_is_as_probable(place, tmp_path):
    """One record is weak, and the block stays; the other throws it down."""
    folder, _ = place
    (folder / "records").mkdir(exist_ok=True)
    for name, peak in (("a.txt", 0.5), ("b.txt", 30.0)):
        times = np.arange(0.0, 0.8, 0.01)
        rows = np.column_stack([times, peak * ((times < 0.3) - 1.0 * (times >= 0.3) * (times < 0.6))])
        np.savetxt(folder / "records" / name, rows, fmt="%.4f")
    motion = (
        '[[loads]]\ntype = "ground_motion"\nstones = ["course = 1"]\ny = "records/a.txt"\nunit = "m/s2"\n'
    )
    scene = SCENE.replace("friction = 0.35", "friction = 2.0") + motion
    scene += "[time]\nstep = 0.004\nduration = 4.0\n"
    table = '[[inputs]]\ntype = "record"\nfolder = "records"\nentry = 1\n'
    quantity = '[[quantities]]\ntype = "outcome"\n'
    summary, z, values = sampled(place, tmp_path / "out", scene, table, quantity, samples=4)
    assert values.tolist() == (norm.cdf(z) < 0.5).astype(float).tolist()
    assert summary["failure"]["probability"] == 1.0 - values.mean()
