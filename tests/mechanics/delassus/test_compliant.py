"""W + E of compliant joints against dense matrices, and the methods that solve problems with it."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.auto import Auto
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from tests.mechanics.dense_operator import DenseDelassus
from tests.mechanics.shapes import brick, ground, posed, scene
from tests.mechanics.solvers.cone_program import ConeProgram


@pytest.fixture(scope="module")
def problem():
    """Four stones side by side and on one another, in points that hold them many times over."""
    stones = [brick(f"{i}{k}", (i, 0, k), (i + 1, 1, k + 1)) for i in range(2) for k in range(2)]
    return posed(scene(ground(), *stones, step=2e-3)).problem


@pytest.fixture(scope="module")
def soft(problem):
    chance = np.random.default_rng(3)
    size = problem.delassus.scale * chance.uniform(0.5, 2.0, (len(problem.bias), 3))
    return replace(problem, delassus=CompliantDelassus(problem.delassus, 1e-2 * size))


def dense(operator):
    """The operator as a matrix, column by column."""
    count = operator.diagonal.size // 3
    columns = [operator.apply(unit.reshape(-1, 3)).ravel() for unit in np.eye(count)]
    return np.column_stack(columns)


def test_the_operator_is_w_and_a_diagonal(problem, soft):
    matrix = dense(problem.delassus) + np.diag(soft.delassus.joint_compliance.ravel())
    np.testing.assert_allclose(dense(soft.delassus), matrix, atol=1e-12)
    n = np.arange(len(problem.bias))
    blocks = matrix.reshape(len(n), 3, len(n), 3)[n, :, n]
    np.testing.assert_allclose(soft.delassus.diagonal, blocks, atol=1e-12)


def test_its_form_solves_for_the_sum(problem, soft):
    matrix, scale = dense(soft.delassus), problem.delassus.scale
    b = np.random.default_rng(5).normal(size=len(matrix))
    theta = np.tile(0.1 * scale * np.eye(3), (len(problem.bias), 1, 1))
    shifted = np.linalg.solve(matrix + 0.1 * scale * np.eye(len(matrix)), b)
    np.testing.assert_allclose(soft.delassus.form.shifted(theta)(b), shifted, rtol=1e-9, atol=1e-9)


def test_units_of_the_contacts_scale_both_parts(soft):
    unit = np.random.default_rng(7).uniform(0.5, 2.0, len(soft.bias))
    each = np.repeat(unit, 3)
    matrix = each[:, None] * dense(soft.delassus) * each
    np.testing.assert_allclose(dense(soft.delassus.scaled(unit)), matrix, atol=1e-12)


@pytest.mark.parametrize(
    "solver",
    [
        NSGS(1e-11, 1e-9, 5000),
        Newton(1e-11, 1e-9),
        InteriorPoint(1e-11, 1e-9),
        Auto(1e-11, 1e-9),
    ],
    ids=lambda one: type(one).__name__,
)
def test_every_method_finds_the_one_solution(soft, solver):
    """W + E is positive definite, so that impulses are unique where those of rigid joints are not."""
    plain = DenseDelassus(dense(soft.delassus))
    zero = np.zeros_like(soft.u_free)
    start = ContactStart(zero, zero)
    known = ConeProgram(1e-10, 1e-8)(replace(soft, delassus=plain), start)
    assert known.converged
    found = solver(soft, start)
    assert residual(soft, found.impulse).natural_map < 1e-7
    np.testing.assert_allclose(found.impulse, known.impulse, atol=1e-5 * np.abs(known.impulse).max())
