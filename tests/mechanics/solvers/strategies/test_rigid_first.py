"""Deformable stones among many rigid ones: as if all were rigid first, then Newton's method for W itself."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from mechanics.solvers.second_order.proximal_newton import ProximalNewton
from mechanics.solvers.strategies.rigid_first import RigidFirst

from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.second_order import proximal_newton
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.scaling import equilibrated
from mechanics.solvers.second_order.sparse_blocks import SparseBlocks
from moma.errors import SolverError
from tests.mechanics.dense_operator import blocks_apart
from tests.mechanics.shapes import partly_deformable_wall, posed

SHARE = 1e-3  # E over the mean diagonal of W


@cache
def problem(share=SHARE):
    """The first step of a wall in which three stones deform, with joints that yield by as much as they do, or more."""
    rigid_joints = posed(partly_deformable_wall(), step=5e-3).problem
    each = np.full_like(rigid_joints.u_free, share * rigid_joints.delassus.scale)
    return replace(rigid_joints, delassus=CompliantDelassus(rigid_joints.delassus, each))


def cold(one):
    zero = np.zeros_like(one.u_free)
    return ContactStart(zero, zero.copy())


@cache
def solved():
    return RigidFirst()(problem(), cold(problem()))


def test_a_cold_start_is_solved_far_beyond_the_tolerances():
    left = residual(problem(), solved().impulse)
    assert solved().converged
    assert left.within(1e-9, 1e-8)
    assert solved().natural_map == left.natural_map
    np.testing.assert_array_equal(solved().velocity, left.dual)


def test_forces_are_those_of_an_independent_method():
    # with joints that yield they are determined, but for what slides
    other = InteriorPoint(1e-10, 1e-9, 200)(problem(), cold(problem()))
    assert other.converged
    most = np.abs(other.impulse).max()
    np.testing.assert_allclose(solved().impulse, other.impulse, atol=1e-3 * most)


def test_a_solution_costs_nothing_and_what_is_near_no_stones_as_rigid_ones():
    assert RigidFirst()(problem(), ContactStart(solved().impulse, solved().velocity)).iterations == 0
    rng = np.random.default_rng(1)
    near = solved().impulse * (1.0 + 1e-4 * rng.normal(size=solved().impulse.shape))
    answer = RigidFirst()(problem(), ContactStart(near, np.zeros_like(near)))
    assert answer.converged
    assert 1 <= answer.iterations <= 8 < solved().iterations


def test_equations_of_a_step_of_newton_are_solved_with_w_itself():
    even, unit = equilibrated(problem())
    start = cold(even)
    found = ProximalNewton(1e-12, 1e-11, 60)(even, start)
    assert found.converged
    np.testing.assert_allclose(
        found.impulse * unit[:, None], solved().impulse, atol=1e-6 * np.abs(solved().impulse).max()
    )


@pytest.mark.parametrize(("again", "fewer"), [(12, True), (1, False)])
def test_factors_of_an_earlier_step_lead_where_few_products_suffice(monkeypatch, again, fewer):
    made, factorise = [], proximal_newton._YieldingSystem._factorise

    def counted(system, *given):
        made.append(1)
        return factorise(system, *given)

    monkeypatch.setattr(proximal_newton._YieldingSystem, "_factorise", counted)
    even, _ = equilibrated(problem(1.0))
    newton = ProximalNewton(1e-12, 1e-11, 60)
    with monkeypatch.context() as patch:
        patch.setattr(proximal_newton, "_TURNED", -1)
        wanted = newton(even, cold(even))
    assert wanted.converged
    assert len(made) == wanted.iterations
    made.clear()
    monkeypatch.setattr(proximal_newton, "_AGAIN", again)
    found = newton(even, cold(even))
    assert found.converged
    assert (len(made) < found.iterations) == fewer
    most = np.abs(wanted.impulse).max()
    np.testing.assert_allclose(found.impulse, wanted.impulse, atol=1e-6 * most)


@pytest.mark.parametrize(
    ("share", "fails", "ends"), [(1.0, False, True), (1e-4, False, False), (1.0, True, False)]
)
def test_factors_of_many_bodies_are_single_unless_these_fail(monkeypatch, share, fails, ends):
    single, factorise = [], SparseBlocks.factorise

    def noted(factors, value):
        single.append(value.dtype == np.float32)
        return not (fails and single[-1]) and factorise(factors, value)

    even, _ = equilibrated(problem(share))
    wanted = ProximalNewton(1e-12, 1e-11, 60)(even, cold(even))
    monkeypatch.setattr(SparseBlocks, "factorise", noted)
    monkeypatch.setattr(proximal_newton, "_MANY", 1)
    found = ProximalNewton(1e-12, 1e-11, 60)(even, cold(even))
    assert wanted.converged
    assert found.converged
    assert single[0]
    assert single[-1] == ends
    most = np.abs(wanted.impulse).max()
    np.testing.assert_allclose(found.impulse, wanted.impulse, atol=1e-6 * most)


def test_iterations_of_newton_are_limited_too():
    assert RigidFirst(max_iterations=3)(problem(), cold(problem())).iterations <= 12


def test_other_operators_are_refused():
    none = np.zeros(1)
    other = ContactProblem(blocks_apart(np.eye(3)), np.array([[-1.0, 0.0, 0.0]]), none, none, none)
    with pytest.raises(SolverError, match="not that of bodies"):
        RigidFirst()(other, cold(other))
