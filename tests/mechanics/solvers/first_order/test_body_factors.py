"""Factors of many bodies in parts, by any number of threads."""

from dataclasses import dataclass

import numpy as np
import pytest

from mechanics.arrays import Array
from mechanics.solvers._kernels.body_cholesky import Panels, panels_of, solve
from mechanics.solvers._kernels.body_parts import Parts, parts_of
from mechanics.solvers.first_order import body_factors
from mechanics.solvers.first_order.body_factors import factorise
from tests.mechanics.solvers.body_matrix import dense_and_panels, strip


@dataclass(frozen=True)
class Problem:
    """A matrix, its panels, and their parts."""

    dense: Array
    panels: Panels
    value: Array
    parts: Parts

    def solution(self, factors, load):
        """Return A⁻¹ b by factors."""
        x = load.astype(factors.dtype)
        solve(self.panels, factors, x, np.empty(6 * np.diff(self.panels.first).max(), factors.dtype))
        return x


@pytest.fixture(scope="module", params=[np.float64, np.float32])
def problem(request):
    """A strip of 80 × 4 bodies."""
    pairs, count = strip(80, 4)
    panels = panels_of(np.ascontiguousarray(pairs), count, 0.2, 6)
    dense, value = dense_and_panels(pairs, panels, np.random.default_rng(3))
    return Problem(dense, panels, value.astype(request.param), parts_of(panels, True))


def factors(problem, threads=1, parts=None):
    value = problem.value.copy()
    assert factorise(problem.panels, value, parts, threads)
    return value


@pytest.fixture
def small_blocks(monkeypatch):
    """Blocks of three bodies, so that each panel between parts has several, the last of them shorter."""
    monkeypatch.setattr(body_factors.kernel, "AT_ONCE", 18)


@pytest.mark.usefixtures("small_blocks")
def test_factors_in_parts_have_the_same_bits_for_any_number_of_threads(problem):
    assert len(problem.parts.panel) > 3
    found = [factors(problem, threads, problem.parts) for threads in (1, 2, 3)]
    assert len({one.tobytes() for one in found}) == 1


@pytest.mark.usefixtures("small_blocks")
def test_factors_in_parts_solve_as_those_of_the_whole_do(problem):
    parts = problem.parts
    assert (np.diff(problem.panels.body)[parts.rest] % 3 > 0).any()
    load = np.random.default_rng(4).normal(size=len(problem.dense))
    whole, several = (problem.solution(factors(problem, 1, one), load) for one in (None, parts))
    rounding = 1e-13 if problem.value.dtype == np.float64 else 1e-6
    np.testing.assert_allclose(several, np.linalg.solve(problem.dense, load), atol=rounding)
    np.testing.assert_allclose(several, whole, atol=rounding)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("between", [False, True])
def test_a_matrix_that_is_not_positive_definite_is_refused_in_a_part_and_between(problem, threads, between):
    panels, parts = problem.panels, problem.parts
    value = problem.value.copy()
    at = panels.start[parts.rest[0] if between else parts.panel[-1, 0]]
    value[at] = -1.0
    assert not factorise(panels, value, parts, threads)
