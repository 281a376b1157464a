"""Forces that arise from nothing, and forces without self-stress, on columns of blocks."""

import numpy as np
import pytest

from mechanics.problem.residual import project_on_cone, residual
from mechanics.solvers import from_nothing
from mechanics.solvers.auto import Auto
from mechanics.solvers.chain import follow, without_self_stress
from mechanics.solvers.from_nothing import rests_from_nothing
from tests.mechanics.solvers.problems import SIDE, STEP, G, carried, cold, column

WEIGHT = 0.25 * SIDE**2 * G  # of a block, per density [N m³/kg]


@pytest.mark.parametrize("densities", [(2000.0,), (2000.0, 1000.0), (1000.0, 1000.0, 3000.0)])
def test_blocks_on_level_ground_rest_by_forces_that_bear_them(densities):
    problem = column(densities)
    rests, impulse = rests_from_nothing(problem)
    assert rests is True
    above = np.cumsum(densities[::-1])[::-1] * WEIGHT
    np.testing.assert_allclose(carried(problem, impulse), above, rtol=1e-4)
    assert residual(problem, impulse).within(1e-5, 1e-4)


@pytest.mark.parametrize(("tilt", "rests"), [(25.0, True), (40.0, False), (60.0, False)])
def test_a_block_rests_below_its_angle_of_friction(tilt, rests):
    """μ = 0.6: 31°."""
    assert rests_from_nothing(column([2000.0], [0.1], tilt))[0] is rests


@pytest.mark.parametrize("tilt", [0.0, 25.0, 40.0])
def test_forces_that_no_method_finds_decide_nothing(tilt, monkeypatch):
    monkeypatch.setattr(from_nothing, "follow", lambda _, *problem: follow((), *problem))
    assert rests_from_nothing(column([2000.0], [0.1], tilt))[0] is None


def clamping(problem, size):
    """Normal forces of the four corners of the lowest joint that no block feels: one diagonal against the other."""
    contacts = np.flatnonzero(
        problem.delassus.rigid.body.max(axis=1) == problem.delassus.rigid.body.max(axis=1).min()
    )
    out = np.zeros_like(problem.u_free)
    for signs in ((1, -1, 1, -1), (1, -1, -1, 1), (1, 1, -1, -1)):
        out[:] = 0.0
        out[contacts[:4], 0] = size * np.array(signs)
        if np.abs(problem.delassus.apply(out)).max() < 1e-9 * size * problem.delassus.scale:
            return out
    raise AssertionError("no such forces")


@pytest.mark.parametrize("densities", [(2000.0,), (2000.0, 2000.0), (2e6, 2.0), (2.0, 2e4)])
def test_what_no_block_feels_is_taken_away(densities):
    problem = column(densities)
    found = Auto(1e-10, 1e-9, 20_000)(problem, cold(problem)).impulse
    least = without_self_stress(problem, found)
    stressed = found + clamping(problem, 0.5 * found[:, 0].min())
    assert np.abs(stressed - found).max() > 0.1 * np.abs(found).min()
    np.testing.assert_allclose(without_self_stress(problem, stressed), least, atol=1e-6 * np.abs(least).max())
    np.testing.assert_allclose(
        problem.delassus.apply(least), problem.delassus.apply(found), atol=1e-6 * np.abs(problem.u_free).max()
    )
    assert np.linalg.norm(least) <= np.linalg.norm(found) * (1 + 1e-9)


def test_the_forces_keep_the_law():
    problem = column([2000.0])
    beyond = np.tile([1.0, 0.9, 0.0], (len(problem.u_free), 1)) * STEP * WEIGHT
    found = without_self_stress(problem, beyond)
    np.testing.assert_allclose(found, project_on_cone(found, problem.friction, problem.cohesion), atol=1e-12)
    assert (np.hypot(found[:, 1], found[:, 2]) <= 0.6 * found[:, 0] * (1 + 1e-9)).all()
