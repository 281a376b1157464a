"""A leaf pushed out of its plane topples at λ = d/h: a depth that its stones share, and a depth of each."""

import pytest

from pipelines.assess.study.study import run_study
from tests.pipelines.assess.study.surveys import leaf_survey, study_file

SHARED = '[[inputs]]\ntype = "depth"\nstones = ["kind = stretcher"]\n'
EACH = SHARED + "sigma = 0.0\nscatter = 0.03\n"
OUT = '[[quantities]]\ntype = "bound"\nload = "horizontal y"\n'


def spread(folder, url, tables, samples, name):
    """The mean and the coefficient of variation of λ."""
    path = study_file(folder, "monte_carlo", tables, OUT, samples=samples)
    mean = run_study(path, url, folder / name).summary["means"]["bound horizontal y"]
    return mean["value"], mean["sigma"] / mean["value"]


@pytest.mark.slow
def test_depths_taken_as_independent_make_a_wall_look_safer(tmp_path):
    """Of a leaf of four courses, h = 1 m: λ = .4, COV .075 by one depth; about .046 by a depth of each."""
    url = leaf_survey(tmp_path, courses=4)
    shared = spread(tmp_path, url, SHARED, 40, "shared")
    each = spread(tmp_path, url, EACH, 40, "each")
    assert shared[0] == pytest.approx(0.4, abs=0.012)
    assert shared[1] == pytest.approx(0.075, abs=0.02)
    assert each[1] < 0.8 * shared[1]
