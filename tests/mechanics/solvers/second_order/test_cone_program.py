"""Cone programmes: closed forms, singular W, accuracy, and what is refused."""

import builtins
from dataclasses import replace

import numpy as np
import pytest
from mechanics.solvers.second_order.cone_program import ConeProgram

from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import natural_map
from mechanics.scene.scene import Fidelity
from moma.errors import SolverError
from tests.mechanics.dense_operator import blocks_apart, products_alone
from tests.mechanics.shapes import brick, ground, posed, scene


def cold(problem):
    zero = np.zeros_like(problem.u_free)
    return ContactStart(zero, zero.copy())


def alone(count=3, **given):
    """Contacts that do not see one another, W = 1, each driven down at 1 and sideways at (1, 3), μ = 0.1."""
    parts = {"friction": np.full(count, 0.1), "cohesion": np.zeros(count), "bias": np.zeros(count)} | given
    u_free = np.tile([-1.0, 1.0, 3.0], (count, 1))
    return ContactProblem(blocks_apart(*[np.eye(3)] * count), u_free, **parts)


BOTH = pytest.mark.parametrize("polish", [True, False], ids=["polished", "programmes alone"])


@BOTH
def test_the_first_example_of_siconos(polish):
    """r_N = 1 stops the normal velocity, and μ r_N = 0.1 opposes (1, 3)/√10 without stopping it."""
    problem = alone()
    answer = ConeProgram(1e-10, 1.0, polish=polish)(problem, cold(problem))
    assert answer.converged
    exact = [1.0, -0.1 / np.sqrt(10), -0.3 / np.sqrt(10)]
    np.testing.assert_allclose(answer.impulse, np.tile(exact, (3, 1)), atol=1e-9)


@BOTH
def test_cohesion_bias_and_no_friction(polish):
    """One contact with k = 0.5, one without friction, one that a bias keeps open and cohesion holds back."""
    problem = alone(
        friction=np.array([0.1, 0.0, 0.1]),
        cohesion=np.array([0.5, 0.0, 0.5]),
        bias=np.array([0.25, 0.0, 2.0]),
    )
    answer = ConeProgram(1e-10, 1.0, polish=polish)(problem, cold(problem))
    along = np.array([1.0, 3.0]) / np.sqrt(10)
    exact = np.vstack([[0.75, *(-0.575 * along)], [1.0, 0.0, 0.0], [0.0, *(-0.5 * along)]])
    np.testing.assert_allclose(answer.impulse, exact, atol=1e-8)


def test_a_column_of_blocks_is_solved_whatever_the_masses():
    """A block of 1,000 t on one of 1 kg: W is singular, and its entries differ by 10⁶; the weight comes through."""
    blocks = [
        ground(),
        brick("light", (0, 0, 0), (0.1, 0.1, 0.05)),
        brick("heavy", (0, 0, 0.05), (10, 10, 5.05)),
    ]
    problem = posed(scene(*blocks, alert=0.01)).problem
    answer = ConeProgram(1e-10, 1.0)(problem, cold(problem))
    assert answer.natural_map <= 1e-10
    assert answer.natural_map == natural_map(problem, answer.impulse)


@pytest.mark.parametrize("bias", [7.6, 1e6])
def test_what_opens_fast_hides_nothing_of_what_closes_slowly(bias):
    """Two contacts press at 1 cm/s, a third slides by at 0.6 m/s, far from touching."""
    slow = alone(bias=np.array([0.0, 0.0, bias]))
    u_free = np.array([[-0.01, 0.0, 0.0], [-0.01, 1.0, 0.0], [-4e-7, 0.56, 0.14]])
    problem = replace(slow, u_free=u_free)
    answer = ConeProgram(1e-10, 1.0)(problem, cold(problem))
    assert answer.converged
    exact = [[0.01, 0.0, 0.0], [0.01, -0.001, 0.0], [0.0, 0.0, 0.0]]
    np.testing.assert_allclose(answer.impulse, exact, atol=1e-11)


def test_a_contact_that_is_pushed_out_fast_is_solved():
    problem = alone(bias=np.full(3, -1e9), friction=np.zeros(3))
    answer = ConeProgram(1e-10, 1.0)(problem, cold(problem))
    assert answer.converged
    np.testing.assert_allclose(answer.impulse[:, 0], 1e9, rtol=1e-8)


def test_where_a_start_is_the_solution_nothing_is_done():
    problem = alone()
    first = ConeProgram(1e-10, 1.0)(problem, cold(problem))
    again = ConeProgram(1e-10, 1.0)(problem, ContactStart(first.impulse, first.velocity))
    assert first.iterations > 0
    assert again.iterations == 0
    np.testing.assert_array_equal(again.impulse, first.impulse)


def test_iterations_are_limited_and_the_residual_is_true():
    block = brick("a", (0, 0, 0), (1, 1, 1), Fidelity.DEFORMABLE, velocity=(1.0, 0, 0, 0, 0, 0))
    problem = posed(scene(ground(), block, friction=0.3)).problem
    answer = ConeProgram(1e-16, 0.0, 5)(problem, cold(problem))
    assert not answer.converged
    assert answer.iterations == 5
    assert answer.natural_map == natural_map(problem, answer.impulse)


def test_a_problem_whose_w_is_known_by_products_alone_is_refused():
    problem = products_alone(alone())
    with pytest.raises(SolverError, match="cone programme: W is not known as a matrix"):
        ConeProgram()(problem, cold(problem))


def test_without_clarabel_it_says_what_to_install(monkeypatch):
    found = builtins.__import__

    def missing(name, *rest, **more):
        if name == "clarabel":
            raise ImportError(name)
        return found(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(SolverError, match="pip install clarabel"):
        ConeProgram()(alone(), cold(alone()))
