"""The driver of chains: order, budgets, starts, the best iterate of all, and its reasons."""

import numpy as np
import pytest

from ground.errors import SolverError
from mechanics.problem.problem import ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.chain import KEPT, Begin, Link, follow
from tests.mechanics.solvers.problems import alone, cold

LIMITS = 1e-6, 1e-5
PROBLEM = alone(100)
# r_N = 1 stops the normal velocity, and μ r_N = 0.1 opposes (1, 3)/√10 without stopping it
EXACT = np.tile([1.0, -0.1 / np.sqrt(10), -0.3 / np.sqrt(10)], (100, 1))


class Method:
    """A method with a known answer, which it claims to be exact; it remembers what it was given."""

    def __init__(self, answer, cost=3):
        self.answer, self.cost, self.given, self.starts = answer, cost, [], []

    def __call__(self, tolerance, velocity_tolerance, most):
        self.given.append((tolerance, velocity_tolerance, most))
        return self.solve

    def solve(self, problem, start):
        self.starts.append(start)
        if isinstance(self.answer, Exception):
            raise self.answer
        return ContactSolution(self.answer, 2.0 * self.answer, min(self.cost, self.given[-1][2]), 0.0, True)


def off(share):
    """The solution, wrong by a share of itself; η is about as large."""
    return Method((1.0 + share) * EXACT)


def link(name, method, iterations=10, begin=Begin.BEST, **more):
    return Link(name, method, iterations, begin, **more)


def followed(*links, start=None, limits=LIMITS, most=1000):
    return follow(links, PROBLEM, start or cold(PROBLEM), limits, most)


def test_the_first_method_that_solves_the_problem_is_the_last_one_tried():
    one, two, three = off(0.1), off(0.0), off(0.0)
    found = followed(link("one", one), link("two", two), link("three", three))
    assert found.converged
    assert (len(one.starts), len(two.starts), len(three.starts)) == (1, 1, 0)
    np.testing.assert_array_equal(found.impulse, EXACT)


def test_iterations_of_all_methods_count_those_that_failed_too():
    found = followed(
        link("one", Method(1.1 * EXACT, 3)),
        link("two", Method(1.2 * EXACT, 4)),
        link("three", Method(EXACT, 5)),
    )
    assert found.iterations == 12


@pytest.mark.parametrize("shares", [(0.1, 0.01, 0.2), (0.01, 0.1, 0.2), (0.2, 0.1, 0.01)])
def test_of_failures_the_best_is_kept_and_judged_from_outside(shares):
    """Whatever a method says of itself: each claims η = 0, and to have solved the problem."""
    found = followed(*(link(f"{share}", off(share)) for share in shares))
    assert not found.converged
    np.testing.assert_array_equal(found.impulse, 1.01 * EXACT)
    assert found.natural_map == residual(PROBLEM, found.impulse).natural_map > 1e-3
    assert found.why.startswith("0.01: ")


def test_no_method_worsens_what_is_known():
    start = ContactStart(1.001 * EXACT, np.zeros_like(EXACT))
    found = followed(link("one", off(0.1)), start=start)
    np.testing.assert_array_equal(found.impulse, start.impulse)
    assert found.why == KEPT
    assert found.iterations == 3
    assert not found.converged


def test_a_solution_goes_before_an_iterate_with_the_smaller_natural_map():
    """η is a mean over contacts; a single one may break its law by far more than velocities may be wrong."""
    lone = EXACT.copy()
    lone[0] *= 1.5
    even = 1.1 * EXACT
    limits = 0.2, 0.11
    errors = [residual(PROBLEM, impulse) for impulse in (lone, even)]
    assert errors[0].natural_map < errors[1].natural_map < 0.2
    assert errors[1].velocity < 0.11 < errors[0].velocity
    found = followed(link("lone", Method(lone)), link("even", Method(even)), limits=limits)
    assert found.converged
    np.testing.assert_array_equal(found.impulse, even)


def test_it_says_which_method_solved_the_problem_and_what_the_one_before_left():
    assert followed(link("one", off(0.0))).why == "one: cold start"
    warm = ContactStart(1.5 * EXACT, np.zeros_like(EXACT))
    assert followed(link("one", off(0.0)), start=warm).why == "one: warm start"
    found = followed(link("one", off(0.1)), link("two", off(0.0)))
    assert found.why == f"two: one stood at η {residual(PROBLEM, 1.1 * EXACT).natural_map:.0e}"


def test_a_method_that_cannot_state_the_problem_is_passed_over_and_named():
    failing = Method(SolverError("W is singular"))
    found = followed(link("one", failing), link("two", off(0.0)))
    assert found.converged
    assert found.why == "two: one failed: W is singular"
    assert found.iterations == 3
    alone_ = followed(link("one", failing))
    assert (alone_.converged, alone_.iterations, alone_.why) == (False, 0, KEPT)


def test_other_errors_are_not_hidden():
    with pytest.raises(ZeroDivisionError):
        followed(link("one", Method(ZeroDivisionError())), link("two", off(0.0)))


def test_a_method_too_far_from_its_start_is_skipped():
    """η without impulses is 1."""
    near, other = off(0.0), off(0.1)
    found = followed(link("near", near, near=0.5), link("other", other))
    assert not near.starts
    assert not found.converged
    found = followed(link("other", other), link("near", near, near=0.5))
    assert len(near.starts) == 1
    assert found.converged


def test_each_method_has_its_own_limit_and_all_together_have_one():
    methods = [Method(1.1 * EXACT, 100) for _ in range(4)]
    found = followed(*(link("one", method, 10) for method in methods), most=25)
    assert [method.given[0][2] for method in methods[:3]] == [10, 10, 5]
    assert not methods[3].given
    assert found.iterations == 25


@pytest.mark.parametrize(
    ("begin", "expected"), [(Begin.WARM, 0.5), (Begin.AHEAD, 0.6), (Begin.NOTHING, 0.0), (Begin.BEST, 1.1)]
)
def test_a_method_begins_where_it_is_told_to(begin, expected):
    ahead = ContactStart(0.6 * EXACT, 0.6 * EXACT)
    start = ContactStart(0.5 * EXACT, 0.5 * EXACT, ahead=ahead)
    last = off(0.0)
    followed(link("one", off(0.1)), link("worse", off(0.9)), link("last", last, begin=begin), start=start)
    np.testing.assert_array_equal(last.starts[0].impulse, expected * EXACT)
    if begin is not Begin.BEST:
        np.testing.assert_array_equal(last.starts[0].velocity, expected * EXACT)


def test_where_nothing_is_extrapolated_the_forces_of_the_last_step_lead():
    method, start = off(0.0), ContactStart(0.5 * EXACT, 0.5 * EXACT)
    followed(link("one", method, begin=Begin.AHEAD), start=start)
    np.testing.assert_array_equal(method.starts[0].impulse, 0.5 * EXACT)


def test_a_method_may_go_further_than_the_problem_asks_for():
    method = off(1e-7)
    found = followed(link("one", method, further=1e-3))
    assert method.given[0][:2] == pytest.approx((1e-9, 1e-8))
    # it is solved all the same where the tolerances asked for are met
    assert found.converged


def test_forces_that_are_given_back_are_a_copy():
    start = ContactStart(1.001 * EXACT, np.zeros_like(EXACT))
    found = followed(link("one", off(0.9)), start=start)
    assert found.why == KEPT
    found.impulse[:] = 7.0
    np.testing.assert_array_equal(start.impulse, 1.001 * EXACT)
