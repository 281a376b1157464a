"""A leaf pushed off its front edge topples at λ = d/h: a depth that its stones share, and a depth of each."""

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.query.api import find
from archmodel.store.stones import load_stones
from pipelines.assess.study.study import run_study
from tests.pipelines.assess.study.surveys import block_survey, leaf_survey, study_file

SHARED = '[[inputs]]\ntype = "depth"\nstones = ["kind = stretcher"]\n'
EACH = SHARED + "sigma = 0.0\nscatter = 0.03\n"
OUT = '[[quantities]]\ntype = "bound"\nload = "horizontal -y"\n'


def spread(folder, url, tables, samples, name):
    """The mean and the coefficient of variation of λ."""
    path = study_file(folder, "monte_carlo", tables, OUT, samples=samples)
    mean = run_study(path, url, folder / name).summary["means"]["bound horizontal -y"]
    return mean["value"], mean["sigma"] / mean["value"]


@pytest.mark.slow
def test_depths_taken_as_independent_make_a_wall_look_safer(tmp_path):
    """Of four courses, h = 1 m: λ = .4, COV .075 by one depth; a depth of each averages out over 18 stones."""
    url = leaf_survey(tmp_path, courses=4)
    shared = spread(tmp_path, url, SHARED, 40, "shared")
    each = spread(tmp_path, url, EACH, 40, "each")
    assert shared[0] == pytest.approx(0.4, abs=0.012)
    assert shared[1] == pytest.approx(0.075, abs=0.02)
    assert each[1] < 0.4 * shared[1]


def test_positions_of_planes_scatter_as_the_survey_predicts(tmp_path):
    """The offset d = n·c of a face: σ_d² = var(height) + Σ var(tilt) (e·c)², from corners of 1 mm."""
    url = block_survey(tmp_path)
    points = '[[inputs]]\ntype = "point"\nstones = ["BLOCK"]\n'
    offset = '[[quantities]]\ntype = "aggregate"\nkey = "offset"\nstones = ["BLOCK"]\n'
    path = study_file(tmp_path, "latin_hypercube", points, offset, samples=100)
    done = run_study(path, url, tmp_path / "out")
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        (stone,) = load_stones(session, find(session, "ashlar", ["code = 'BLOCK'"]))
    tilts, height = stone.covariance.diagonal()[:2], stone.covariance[2, 2]
    predicted = np.sqrt(height + tilts @ (stone.axes @ stone.centroid) ** 2)
    sigma = done.summary["means"]["aggregate offset"]["sigma"]
    # the standard error of a standard deviation of 100 samples is 7 %
    assert sigma == pytest.approx(predicted, rel=0.2)
