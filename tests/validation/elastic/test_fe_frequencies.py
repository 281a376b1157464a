"""Frequencies of free elastic stones: VALIDATION F07 and F08.

Reference: polynomials x^i y^j z^k up to order 12 as in Visscher, Migliori, Bell & Reinert, J. Acoust. Soc. Am. 90
(1991) 2154; one of them, Lamé's mode of the cube, is exact: f = c_s/(√2 L).
"""

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from mechanics.stones.elasticity.operators import elastic_operators
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.solids import grid

CUBE = Material("cube", 2500.0, 30e9, 0.2)
CUBE_FREQUENCIES = np.array([1016.28] * 2 + [1358.32] * 3 + [1388.92] * 3 + [1531.07] * 3 + [1581.139])
SOFT = Material("soft", 1000.0, 1e9, 0.3)
SOFT_FREQUENCIES = np.array([281.905, 379.613, 386.057, 438.529, 451.353])
BRICK = Material("brick", 2000.0, 15.5e9, 0.2)
BRICK_FREQUENCIES = np.array([3018.98, 3300.33, 4565.09, 6530.70, 6760.60, 6915.23])


def frequencies(element, counts, sides, material, count, lumped=False):
    """The lowest elastic frequencies [Hz] of a free box; the six rigid motions before them are checked."""
    operators = elastic_operators(grid(element, counts, lambda x: x * np.array(sides)), material, lumped)
    shift = -((2 * np.pi * 100.0) ** 2)  # below zero, where the free stone's matrix can be factorised
    start = np.random.default_rng(0).normal(size=operators.mass.shape[0])
    values = np.sort(
        eigsh(
            operators.stiffness, count + 6, operators.mass, sigma=shift, v0=start, return_eigenvectors=False
        )
    )
    assert np.abs(values[:6]).max() < 1e-8 * values[6]
    return np.sqrt(values[6:]) / (2 * np.pi)


@pytest.mark.parametrize(
    ("element", "counts", "tolerance"),
    [
        (Element.HEX8, (10, 10, 10), 0.02),
        (Element.HEX20, (5, 5, 5), 0.005),
        (Element.HEX27, (4, 4, 4), 0.005),
        (Element.TET10, (6, 6, 6), 0.005),
        (Element.TET4, (10, 10, 10), 0.05),
    ],
)
def test_frequencies_of_a_free_cube(element, counts, tolerance):
    found = frequencies(element, counts, (1, 1, 1), CUBE, 12)
    np.testing.assert_allclose(found, CUBE_FREQUENCIES, rtol=tolerance)


@pytest.mark.parametrize("element", [Element.TET10, Element.HEX20, Element.HEX27])
def test_frequencies_of_a_free_cube_with_another_ratio_of_poisson(element):
    found = frequencies(element, (5, 5, 5), (1, 1, 1), SOFT, 15)
    distinct = found[np.r_[True, np.diff(found) > 0.01 * found[:-1]]]
    np.testing.assert_allclose(distinct[: len(SOFT_FREQUENCIES)], SOFT_FREQUENCIES, rtol=0.005)


@pytest.mark.parametrize(
    ("element", "counts", "lumped"),
    [
        (Element.HEX8, (20, 10, 8), False),
        (Element.HEX8, (20, 10, 8), True),
        (Element.HEX20, (6, 3, 2), False),
        (Element.HEX27, (6, 3, 2), False),
        (Element.HEX27, (6, 3, 2), True),
        (Element.TET10, (8, 4, 3), False),
        (Element.TET10, (10, 5, 3), True),
    ],
)
def test_frequencies_of_a_free_brick(element, counts, lumped):
    found = frequencies(element, counts, (0.2, 0.1, 0.05), BRICK, 6, lumped)
    np.testing.assert_allclose(found, BRICK_FREQUENCIES, rtol=0.02)


def test_lumping_costs_the_serendipity_brick_its_fourth_power():
    # most of its lumped mass is on the edges: frequencies from below, with the second power of the size
    errors = []
    for n in (1, 2):
        found = frequencies(Element.HEX20, (4 * n, 2 * n, n), (0.2, 0.1, 0.05), BRICK, 6, lumped=True)
        errors.append(found / BRICK_FREQUENCIES - 1)
    assert np.max(errors) < 0
    assert np.log2(errors[0][0] / errors[1][0]) == pytest.approx(2.0, abs=0.4)


@pytest.mark.parametrize(
    ("element", "counts", "slope"),
    [(Element.TET10, (3, 6), 3.2), (Element.HEX20, (2, 4), 3.5), (Element.HEX27, (2, 4), 3.5)],
)
def test_frequencies_converge_from_above_towards_the_fourth_power(element, counts, slope):
    exact = CUBE_FREQUENCIES[-1]  # the mode of Lamé, f = c_s/(√2 L), is the twelfth
    assert exact == pytest.approx(np.sqrt(CUBE.young / (2 * 1.2) / CUBE.density / 2), rel=1e-6)
    errors = [frequencies(element, (n, n, n), (1, 1, 1), CUBE, 12)[-1] / exact - 1 for n in counts]
    assert min(errors) > 0
    assert np.log(errors[0] / errors[1]) / np.log(counts[1] / counts[0]) > slope
