"""The residual that judges solutions: its units, its limits, and contacts that contradict each other."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.delassus.rigid import RigidDelassus
from mechanics.problem.problem import ContactProblem
from mechanics.problem.residual import natural_map, residual
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings, Fidelity
from mechanics.solvers.first_order.nsgs import NSGS
from tests.mechanics.dense_operator import DenseDelassus, blocks_apart
from tests.mechanics.shapes import brick, ground, posed, scene
from tests.mechanics.solvers.problems import BACK, FORWARD, cold, stack, velocity_of

BOTH = pytest.mark.parametrize("fidelity", [Fidelity.RIGID, Fidelity.DEFORMABLE])


def sliding(fidelity, law=None):
    """A stone pushed along the ground, with a rigid one on it that slides."""
    one = stack(fidelity, below=FORWARD, above=BACK)
    return posed(one if law is None else replace(one, contact=ContactSettings(law))).problem


def contradiction(u_free, bias):
    """Two contacts of one body along the same line, from both sides: u_1 = -u_2 whatever the impulses.

    Between them W_NN = ±1, and W_TT = 1 each; no impulse can open both.
    """
    across = np.diag([-1.0, 0, 0])
    operator = DenseDelassus(np.block([[np.eye(3), across], [across, np.eye(3)]]))
    free = np.zeros((2, 3))
    free[:, 0] = u_free
    none = np.zeros(2)
    return ContactProblem(operator, free, np.full(2, float(bias)), none, none)


@pytest.mark.parametrize(("u_free", "bias"), [(-1.0, 0.0), (0.0, -1.0), (-1e-3, -1.0)])
@pytest.mark.parametrize("size", [0.0, 1.0, 1e6, 1e12, 1e17, 1e30, 1e70])
def test_no_impulse_solves_a_contradiction(u_free, bias, size):
    """Beyond 10¹⁶ rounding of W r hides u_free; then u reads zero, η is zero, and both would seem right."""
    impulse = np.zeros((2, 3))
    impulse[:, 0] = size
    left = residual(contradiction(u_free, bias), impulse)
    assert not left.within(1e-6, 1e-2)


def test_large_impulses_that_are_needed_count():
    """Pushed out at 10⁹ m/s while it moves at 10⁻³: W r is as large as what it is for."""
    operator = blocks_apart(np.eye(3))
    free, none = np.array([[-1e-3, 0.0, 0.0]]), np.zeros(1)
    problem = ContactProblem(operator, free, none - 1e9, none + 0.5, none)
    assert residual(problem, np.array([[1e9 + 1e-3, 0.0, 0.0]])).within(1e-6, 1e-5)


def test_a_heavy_contact_does_not_hide_a_light_one_that_it_does_not_touch():
    """1 mg beside 10⁹ t: the bound from the largest W and the largest r would be 100 m/s, though none is lost."""
    operator = blocks_apart(1e6 * np.eye(3), 1e-12 * np.eye(3))
    free, none = np.array([[-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), np.zeros(2)
    problem = ContactProblem(operator, free, none, none, none)
    impulse = np.array([[1e-6, 0, 0], [1e12, 0, 0]])
    assert residual(problem, impulse).within(1e-6, 1e-5)


@BOTH
def test_natural_map_is_one_without_impulses_and_zero_at_the_solution(fidelity):
    problem = sliding(fidelity)
    assert natural_map(problem, np.zeros_like(problem.u_free)) == pytest.approx(1.0, rel=1e-13)
    solved = NSGS(1e-12, 1.0, 200_000)(problem, cold(problem))
    assert solved.natural_map <= 1e-12


def test_natural_map_is_zero_where_nothing_touches_or_nothing_presses():
    problem = posed(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6)))).problem
    assert natural_map(problem, np.zeros((0, 3))) == 0.0
    lifted = brick("a", (0, 0, 0), (1, 1, 1), velocity=(0, 0, 1.0, 0, 0, 0))
    problem = posed(scene(ground(), lifted)).problem
    assert natural_map(problem, np.zeros((4, 3))) == 0.0


def scaled(problem, mass, speed):
    """The same problem with masses and velocities in other units."""
    w = problem.delassus
    if isinstance(w, RigidDelassus):
        w = replace(w, inertia=w.inertia / mass)
    else:
        parts = {name: getattr(w, name) / mass for name in ("response", "block", "diagonal", "scale")}
        w = replace(w, **parts)
    return replace(
        problem,
        delassus=w,
        u_free=problem.u_free * speed,
        bias=problem.bias * speed,
        cohesion=problem.cohesion * mass * speed,
        adhesion=problem.adhesion * mass * speed,
    )


@BOTH
@pytest.mark.parametrize("law", [None, MortarJoint(0.4, 200.0, 1000.0)], ids=["dry", "mortar"])
@pytest.mark.parametrize(("mass", "speed"), [(1e3, 1.0), (1.0, 1e-3), (1e-6, 1e4)])
def test_the_residual_does_not_depend_on_the_units(fidelity, law, mass, speed):
    problem = sliding(fidelity, law)
    r = NSGS(0.0, 0.0, 5)(problem, cold(problem)).impulse
    one, other = residual(problem, r), residual(scaled(problem, mass, speed), r * mass * speed)
    assert other.natural_map == pytest.approx(one.natural_map, rel=1e-8)
    assert other.velocity == pytest.approx(one.velocity, rel=1e-8)
    np.testing.assert_allclose(
        other.error, one.error * mass * speed, rtol=1e-8, atol=1e-10 * one.error.max() * mass * speed
    )
    np.testing.assert_allclose(other.dual, one.dual * speed, rtol=1e-8, atol=1e-10 * speed)
    assert one.natural_map > 1e-6


@BOTH
def test_natural_map_sees_a_wrong_impulse(fidelity):
    problem = sliding(fidelity)
    r = NSGS(1e-10, 1.0, 200_000)(problem, cold(problem)).impulse
    assert natural_map(problem, 1.01 * r) > 1e-4
    assert natural_map(problem, -r) > 0.5


@pytest.mark.parametrize("eta", [1e-4, 1e-8])
def test_the_dual_velocity_is_that_of_the_impulse(eta):
    problem = sliding(Fidelity.RIGID)
    answer = NSGS(eta, 1.0, 50_000)(problem, cold(problem))
    u = velocity_of(problem, answer)
    u[:, 0] += problem.bias + problem.friction * np.linalg.norm(u[:, 1:], axis=1)
    np.testing.assert_allclose(answer.velocity, u, atol=1e-12)


def test_both_tolerances_count():
    problem = sliding(Fidelity.RIGID)
    loose, tight = (NSGS(1e-2, limit, 50_000, 1)(problem, cold(problem)) for limit in (1.0, 1e-9))
    assert loose.iterations < tight.iterations
    assert residual(problem, loose.impulse).velocity > 1e-9
    assert residual(problem, tight.impulse).velocity <= 1e-9
