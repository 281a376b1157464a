"""The judge of the matrix finds every law that is broken, and none that is kept."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.extremes.contacts import grid, patch, squeezed, stored
from benchmarks.extremes.laws import broken, judge, velocity_of
from benchmarks.extremes.stones import standing, wall
from benchmarks.scenes import problem_of

TOLERANCE, VELOCITY_TOLERANCE = 1e-8, 1e-5


def verdict(problem, *impulse):
    return judge(problem, np.array(impulse, dtype=float).reshape(-1, 3), TOLERANCE, VELOCITY_TOLERANCE)


def single(u_free, friction=0.5, cohesion=0.0):
    """One contact with W = 1."""
    return stored(np.eye(3), u_free, friction, cohesion)


@pytest.mark.parametrize(
    ("u_free", "friction", "cohesion", "right"),
    [
        ((1, 2, 0), 0.5, 0.0, (0, 0, 0)),  # open
        ((-1, 0.3, 0), 0.5, 0.0, (1, -0.3, 0)),  # sticks
        ((-1, 3, 4), 0.5, 0.0, (1, -0.3, -0.4)),  # slides
        ((1, 3, 4), 0.5, 1.0, (0, -0.6, -0.8)),  # open, slides against cohesion
        ((-1, 0.3, 0.4), 0.0, 0.0, (1, 0, 0)),  # no friction
    ],
)
@pytest.mark.parametrize("scale", [1e-20, 1.0, 1e20])
def test_right_impulses_pass_and_wrong_ones_do_not(u_free, friction, cohesion, right, scale):
    """The closed forms of one contact; each component off by 1e-5, alone, is found."""
    problem = single(scale * np.array(u_free), friction, scale * cohesion)
    right = scale * np.array(right, dtype=float)
    assert verdict(problem, right) <= 1.0
    for axis in range(3):
        for sign in (-1.0, 1.0):
            wrong = right.copy()
            wrong[axis] += sign * 1e-5 * scale
            assert verdict(problem, wrong) > 1.0, (axis, sign)


@pytest.mark.parametrize(
    ("u_free", "wrong"),
    [
        ((-1, 3, 4), (1, 0.3, 0.4)),  # friction along the velocity
        ((-1, 3, 4), (1, -0.4, 0.3)),  # across it
        ((-1, 3, 4), (1, -0.27, -0.36)),  # below its limit while it slides
        ((-1, 3, 4), (1, -3, -4)),  # beyond its limit
        ((-1, 3, 4), (0, 0, 0)),  # goes through
        ((1, 0, 0), (-1, 0, 0)),  # pulls
        ((1, 0, 0), (0.1, 0, 0)),  # pushes what opens
        ((-1, 0, 0), (2, 0, 0)),  # throws back
        ((-1, 0, 0), (np.nan, 0, 0)),
        ((-1, 0, 0), (np.inf, 0, 0)),
    ],
)
def test_what_breaks_a_law_is_found(u_free, wrong):
    assert verdict(single(u_free), wrong) > 1e3


# few enough values that states and limits of the laws are hit exactly now and then
VALUES = st.lists(st.integers(-5, 5).map(lambda number: number / 4), min_size=3, max_size=3)


@settings(max_examples=200, deadline=None)
@given(VALUES, st.sampled_from([0.0, 0.5, 1.0, 10.0]), VALUES)
def test_it_is_zero_only_where_all_laws_hold(u_free, friction, impulse):
    """Against the laws as they are written, for any impulse of one contact with W = 1."""
    problem = single(u_free, friction)
    r = np.array(impulse)
    u = r + np.array(u_free)
    left = broken(problem, r[None], u[None], 1.0)[0]
    signorini = min(abs(min(r[0], 0)), 0) == 0 and r[0] >= 0 and u[0] >= 0 and r[0] * u[0] == 0
    cone = np.linalg.norm(r[1:]) <= friction * max(r[0], 0)
    slip = np.linalg.norm(u[1:])
    opposed = slip == 0 or np.allclose(r[1:], -friction * r[0] * u[1:] / slip, rtol=0, atol=1e-12)
    if signorini and cone and opposed:
        assert left <= 1e-12
    elif left <= 1e-12:
        # within rounding of a right one
        assert min(abs(r[0]), abs(u[0])) <= 1e-12
        assert np.linalg.norm(r[1:]) <= friction * max(r[0], 0) + 1e-11


def test_its_w_is_that_of_the_engine_written_anew():
    """u of stones through their bodies in numpy, against the operators' kernels, to rounding."""
    for problem in (problem_of(standing(wall(3, 3))), squeezed(0.5), patch(grid(4), (-1, 2, 3))):
        impulse = np.random.default_rng(5).normal(size=problem.u_free.shape)
        u, terms = velocity_of(problem, impulse)
        expected = problem.delassus.apply(impulse) + problem.u_free
        assert np.abs(u - expected).max() <= 1e-13 * terms.max()


def test_adhesion_does_not_loosen_it():
    """A bond a million times stronger than what it carries: what is carried counts."""
    problem = single((-1, 0, 0), 0.0, 0.0)
    strong = replace(problem, u_free=problem.u_free - [1e6, 0, 0], adhesion=np.full(1, 1e6))
    assert verdict(strong, (1e6 + 1.0, 0, 0)) <= 1.0
    assert verdict(strong, (1e6 + 1.1, 0, 0)) > 1.0
