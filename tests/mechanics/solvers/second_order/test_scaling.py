"""Contacts in units of their own: the same problem, in which all contacts yield alike."""

import numpy as np
import pytest

from mechanics.problem.residual import residual
from mechanics.scene.scene import Fidelity
from mechanics.solvers.second_order.scaling import equilibrated
from mechanics.stones.materials import Material
from tests.mechanics.shapes import brick, ground, posed, scene

HEAVY, LIGHT = (Material(name, density, 20e9, 0.2) for name, density in (("heavy", 2.4e6), ("light", 2.4)))


def pile(fidelity):
    return posed(
        scene(
            ground(),
            brick("a", (0, 0, 0), (0.5, 0.4, 0.3), fidelity, material=LIGHT),
            brick("b", (0.1, 0, 0.3), (0.6, 0.4, 0.6), material=HEAVY),
            brick("c", (1.0, 0, 0), (1.6, 0.4, 0.6), material=HEAVY),
        )
    ).problem


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, Fidelity.DEFORMABLE])
def test_products_sweeps_and_factors_are_those_of_d_w_d(fidelity):
    problem = pile(fidelity)
    even, unit = equilibrated(problem)
    nc, rng = len(unit), np.random.default_rng(1)
    w = np.column_stack([problem.delassus.apply(e.reshape(nc, 3)).ravel() for e in np.eye(3 * nc)])
    d = np.repeat(unit, 3)
    scaled = d[:, None] * w * d
    r = rng.normal(size=(nc, 3))
    np.testing.assert_allclose(even.delassus.apply(r).ravel(), scaled @ r.ravel(), rtol=1e-8, atol=1e-9)
    own = scaled.reshape(nc, 3, nc, 3)[np.arange(nc), :, np.arange(nc)]
    np.testing.assert_allclose(even.delassus.diagonal, own, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(np.trace(own, axis1=1, axis2=2), 3.0, rtol=1e-12)
    assert even.delassus.scale == pytest.approx(1.0)
    theta = np.tile(0.1 * np.eye(3), (nc, 1, 1)) + 0.02 * rng.normal(size=(nc, 3, 3))
    matrix = scaled.copy()
    for c in range(nc):
        matrix[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] += theta[c]
    b = rng.normal(size=3 * nc)
    form = even.delassus.form
    np.testing.assert_allclose(matrix @ form.shifted(theta)(b), b, atol=1e-9)
    shift = problem.u_free.copy()
    shift[:, 0] += problem.bias
    plain, swept = np.zeros((nc, 3)), np.zeros((nc, 3))
    problem.delassus.gauss_seidel(shift, problem.friction, problem.cohesion)(plain, 5)
    even.delassus.gauss_seidel(shift * unit[:, None], even.friction, even.cohesion)(swept, 5)
    np.testing.assert_allclose(swept * unit[:, None], plain, rtol=1e-6, atol=1e-9 * np.abs(plain).max())


def test_a_solution_stays_one():
    """Laws hold in both or in neither; what is left of them is measured in other units."""
    problem = pile(Fidelity.RIGID)
    even, unit = equilibrated(problem)
    rng = np.random.default_rng(2)
    r = np.abs(rng.normal(size=(len(unit), 3)))
    one, other = residual(problem, r * unit[:, None]), residual(even, r)
    assert one.natural_map > 1e-3
    assert other.natural_map > 1e-3
    np.testing.assert_allclose(one.dual * unit[:, None], other.dual, rtol=1e-9, atol=1e-9)


def test_light_and_heavy_stones_yield_differently():
    """Otherwise the tests above would say nothing."""
    diagonal = np.trace(pile(Fidelity.RIGID).delassus.diagonal, axis1=1, axis2=2)
    assert diagonal.max() > 1e5 * diagonal.min()
