"""Shape functions of facets, the inverse of their map, and quadrature on triangles, against their definitions."""

import itertools
from math import factorial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from skfem import ElementQuad1, ElementQuad2, ElementQuadS2, ElementTriP1, ElementTriP2

from mechanics.contact._kernels import facets as kernel
from tests.mechanics.contact.box_faces import KINDS, nodes_of

# scikit-fem's elements of the unit square or triangle, which number mid nodes by edges in their own order
ELEMENTS = {3: ElementTriP1, 4: ElementQuad1, 6: ElementTriP2, 8: ElementQuadS2, 9: ElementQuad2}


def values(kind, r, s):
    out = np.empty(9)
    kernel.shape_functions(kind, r, s, out)
    return out[:kind]


@pytest.mark.parametrize("kind", KINDS)
def test_each_shape_function_is_one_at_its_node_and_zero_at_the_others(kind):
    np.testing.assert_allclose([values(kind, *x) for x in nodes_of(kind)], np.eye(kind), atol=1e-15)


@pytest.mark.parametrize("kind", KINDS)
def test_shape_functions_are_those_of_scikit_fem(kind):
    rng = np.random.default_rng(kind)
    for x in rng.uniform(0.0, 0.5, (10, 2)):
        theirs = np.array([ELEMENTS[kind]().lbasis(x[:, None], i)[0][0] for i in range(kind)])
        own = values(kind, *(x if kind in (3, 6) else 2 * x - 1))
        # the same functions, each in its own place
        np.testing.assert_allclose(np.sort(own), np.sort(theirs), atol=1e-14)


@pytest.mark.parametrize("wanted", range(1, 7))
def test_quadrature_is_exact_to_its_degree(wanted):
    """∫ x^a y^b over the unit triangle is a! b! / (a + b + 2)!."""
    first, last = kernel.rule_of(wanted)
    x, y, w = kernel.QUADRATURE[first:last].T
    assert (w > 0).all()
    assert ((x > 0) & (y > 0) & (x + y < 1)).all()
    for a, b in itertools.product(range(wanted + 1), repeat=2):
        if a + b <= wanted:
            exact = factorial(a) * factorial(b) / factorial(a + b + 2)
            assert 0.5 * w @ (x**a * y**b) == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize("kind", KINDS)
def test_the_degree_of_shape_functions_is_the_least_that_holds_them(kind):
    """On a line through the plane they are polynomials of that degree: differences of the next order vanish."""
    wanted = kernel.degree(kind)
    line = np.array([values(kind, 0.1 + 0.07 * t, 0.2 + 0.05 * t) for t in range(wanted + 2)])
    assert np.abs(np.diff(line, wanted + 1, axis=0)).max() < 1e-13
    assert np.abs(np.diff(line, wanted, axis=0)).max() > 1e-7


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-0.2, 0.2), min_size=8, max_size=8), st.tuples(*[st.floats(-1.0, 1.0)] * 2))
def test_points_of_any_convex_quadrilateral_are_located(moves, x):
    corner = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) + np.reshape(moves, (4, 2))
    there = values(4, *x) @ corner
    np.testing.assert_allclose(kernel.locate(corner, 4, *there), x, atol=1e-11)


def test_points_of_a_triangle_are_located():
    corner = np.array([(0.3, 0.2), (2.0, -0.4), (0.9, 1.7)])
    there = np.array([0.5, 0.2, 0.3]) @ corner
    np.testing.assert_allclose(kernel.locate(corner, 3, *there), (0.2, 0.3), atol=1e-15)
