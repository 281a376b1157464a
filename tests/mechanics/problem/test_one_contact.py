"""The exact solution of one contact, the projection on its cone and the natural map, against conditions and twins."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from mechanics.delassus._kernels.rigid import factors_of
from mechanics.problem._kernels import (
    LocalCompliance,
    local_factors,
    natural_errors,
    onto_cone,
    plane_axes,
    slip,
    solve_contact,
)
from mechanics.problem.residual import project_on_cone

number = st.integers(-1000, 1000).map(lambda i: i / 500)
frictions = st.sampled_from([0.0, 1e-3, 0.3, 0.6, 1.0, 3.0])
cohesions = st.sampled_from([0.0, 1e-6, 0.1, 1.0, 30.0])


def solve_one(w, b, mu, k=0.0):
    r = np.full(3, np.nan)
    solve_contact(local_factors(w[None])[0], b, mu, k, r)
    return r, w @ r + b


def assert_law(w, b, mu, k, r, u):
    """0 ≤ u_N ⊥ r_N ≥ 0, ‖r_T‖ ≤ μ r_N + k, and r_T opposes u_T at the limit while sliding."""
    speed = np.linalg.norm(b)
    force = speed / np.linalg.norm(w, 2) + k
    ease = 1e-10 * np.linalg.cond(w)
    pace = speed + k * np.linalg.norm(w, 2)
    assert np.isfinite(r).all()
    assert r[0] >= 0
    assert u[0] >= -ease * pace
    assert r[0] * u[0] <= ease * force * pace
    limit, slide = mu * r[0] + k, np.linalg.norm(u[1:])
    assert np.linalg.norm(r[1:]) <= limit + ease * force
    # what slides is opposed by the whole friction, what does not slide satisfies it
    np.testing.assert_allclose(r[1:] * slide, -limit * u[1:], atol=ease * force * pace * (1 + mu))


@st.composite
def contacts(draw):
    """W, b and μ of a contact; without friction that wedges (μ W_NT over W_NN): it may have no solution, or several."""
    root = np.array(draw(st.lists(number, min_size=9, max_size=9))).reshape(3, 3)
    scale = draw(st.sampled_from([1e-6, 1.0, 1e6]))
    w = scale * (root @ root.T + 0.05 * np.trace(root @ root.T) * np.eye(3))
    mu = draw(frictions)
    assume(np.linalg.norm(w) > 1e-3 * scale)
    assume(mu * np.linalg.norm(w[0, 1:]) < w[0, 0])
    return w, np.array(draw(st.lists(number, min_size=3, max_size=3))), mu


@settings(max_examples=300, deadline=None)
@given(contacts())
def test_one_contact_obeys_signorini_and_coulomb(contact):
    w, b, mu = contact
    assert_law(w, b, mu, 0.0, *solve_one(w, b, mu))


@settings(max_examples=400, deadline=None)
@given(contacts(), cohesions)
def test_one_contact_with_cohesion_obeys_its_law(contact, cohesion):
    w, b, mu = contact
    # in the unit of the impulses that b asks for
    k = cohesion * np.linalg.norm(b) / np.linalg.norm(w, 2)
    assert_law(w, b, mu, k, *solve_one(w, b, mu, k))


W = np.array([[2.0, 0.3, -0.2], [0.3, 1.5, 0.1], [-0.2, 0.1, 1.0]])


def test_a_contact_that_separates_is_open():
    r, u = solve_one(W, np.array([0.1, 5.0, 5.0]), 0.6)
    np.testing.assert_array_equal(r, 0)
    np.testing.assert_array_equal(u, [0.1, 5, 5])


def test_a_contact_pressed_straight_sticks():
    r, u = solve_one(W, -W @ [1.0, 0.3, 0.4], 0.6)
    np.testing.assert_allclose(r, [1.0, 0.3, 0.4], rtol=1e-12)
    np.testing.assert_allclose(u, 0, atol=1e-14)


def test_a_contact_pushed_sideways_slides_against_the_whole_friction():
    r, u = solve_one(W, np.array([-1.0, 2.0, -1.0]), 0.6)
    assert np.linalg.norm(r[1:]) == pytest.approx(0.6 * r[0], rel=1e-12)
    assert u[0] == pytest.approx(0, abs=1e-13)
    np.testing.assert_allclose(u[1:] / np.linalg.norm(u[1:]), -r[1:] / np.linalg.norm(r[1:]), rtol=1e-11)


def test_without_friction_the_impulse_is_normal():
    r, u = solve_one(W, np.array([-1.0, 2.0, -1.0]), 0.0)
    np.testing.assert_allclose(r, [0.5, 0, 0])
    assert u[0] == pytest.approx(0, abs=1e-15)


def test_cohesion_holds_a_contact_that_nothing_presses():
    """b_N > 0: it opens, and what it slides is held by k alone, here by less than k."""
    r, u = solve_one(np.eye(3), np.array([0.5, 0.3, -0.4]), 0.6, 1.0)
    np.testing.assert_allclose(r, [0, -0.3, 0.4], atol=1e-15)
    np.testing.assert_allclose(u, [0.5, 0, 0], atol=1e-15)
    # and here by all of k
    r, u = solve_one(np.eye(3), np.array([0.5, 3.0, -4.0]), 0.6, 1.0)
    np.testing.assert_allclose(r, [0, -0.6, 0.8], rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(u, [0.5, 2.4, -3.2], rtol=1e-13)


def test_cohesion_adds_to_friction():
    r, u = solve_one(np.eye(3), np.array([-2.0, 6.0, 0.0]), 0.5, 1.5)
    np.testing.assert_allclose(r, [2.0, -2.5, 0.0], rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(u, [0.0, 3.5, 0.0], rtol=1e-13, atol=1e-15)


def test_cohesion_that_pulls_a_contact_shut_presses_it():
    """W_NT: the tangential impulse of k drives u_N below zero, though b_N ≥ 0; so r_N > 0."""
    w = np.array([[1.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]])
    b = np.array([0.1, 3.0, 0.0])
    r, u = solve_one(w, b, 0.2, 1.0)
    # u_N = 0 = 0.1 + r_N - (0.2 r_N + 1)/2
    assert r[0] == pytest.approx(0.4 / 0.9, rel=1e-12)
    assert_law(w, b, 0.2, 1.0, r, u)


@settings(max_examples=200, deadline=None)
@given(
    st.lists(number, min_size=9, max_size=9),
    st.tuples(number, number, number),
    st.sampled_from([1.0, 10.0]),
    cohesions,
)
def test_where_friction_wedges_the_impulse_is_still_finite_and_in_its_cone(root, b, mu, k):
    root = np.array(root).reshape(3, 3)
    w = root @ root.T + 0.05 * np.trace(root @ root.T) * np.eye(3)
    assume(np.linalg.norm(w) > 1e-3)
    r, _ = solve_one(w, np.array(b), mu, k)
    assert np.isfinite(r).all()
    assert r[0] >= 0
    assert np.linalg.norm(r[1:]) <= (mu * r[0] + k) * (1 + 1e-12)


# --- factors ---


@settings(max_examples=100, deadline=None)
@given(contacts())
def test_factors_are_the_inverse_and_the_axes_of_the_schur_complement(contact):
    w = contact[0]
    long, short = local_factors(w[None])[0], factors_of(w[None])[0]
    ease = 1e-12 * np.linalg.cond(w)
    inverse = np.linalg.inv(w)
    np.testing.assert_allclose(long[:9].reshape(3, 3), inverse, atol=ease * np.abs(inverse).max())
    upper = inverse[np.triu_indices(3)]
    np.testing.assert_allclose(short[:6], upper, atol=ease * np.abs(inverse).max())
    schur = w[1:, 1:] - np.outer(w[1:, 0], w[0, 1:]) / w[0, 0]
    for row in (w[0, 0], w[0, 1], w[0, 2]), long[9:12], short[6:9]:
        np.testing.assert_allclose(row, w[0])
    for co, si, one, two in (long[12:], short[9:]):
        axes = np.array([[co, si], [-si, co]])
        np.testing.assert_allclose(axes.T @ np.diag([one, two]) @ axes, schur, atol=1e-13 * np.abs(w).max())
        assert one > 0
        assert two > 0


def test_axes_of_a_round_schur_complement_are_any_axes():
    co, si, one, two = plane_axes(2.0, 0.0, 2.0)
    assert co**2 + si**2 == pytest.approx(1.0, rel=1e-15)
    assert (one, two) == (2.0, 2.0)


@settings(max_examples=200, deadline=None)
@given(contacts())
def test_an_impulse_that_slips_lies_on_its_cone(contact):
    w, b, mu = contact
    assume(b[0] < 0)
    f = local_factors(w[None])[0]
    stick = -np.linalg.solve(w, b)
    assume(stick[0] < 0 or np.linalg.norm(stick[1:]) > mu * stick[0] * (1 + 1e-9))
    r = slip(LocalCompliance(*f[9:]), tuple(b), mu, 0.0, 0.0)
    assert np.hypot(*r[1:]) == pytest.approx(mu * r[0], rel=1e-12, abs=1e-300)
    assert abs(w[0] @ r + b[0]) < 1e-11 * np.linalg.norm(b) * np.linalg.cond(w)


# --- the cone ---


@settings(max_examples=300, deadline=None)
@given(number, number, number, frictions, st.sampled_from([0.0, 0.2, 1.0]))
@example(0.0, 0.0, 0.0, 0.6, 0.0)
@example(-1.0, 0.0, 0.0, 0.6, 0.0)
@example(-1.0, 0.5, 0.0, 0.6, 0.5)
@example(-1.0, 2.0, 0.0, 0.0, 0.5)
def test_projection_on_the_cone_is_the_nearest_point(n, t1, t2, mu, k):
    """The projection p of x on a convex set is where (x - p)·(z - p) ≤ 0 for all z of the set; here on its rim."""
    x = np.array([n, t1, t2])
    p = project_on_cone(x[None], np.array([mu]), np.array([k]))[0]
    assert p[0] >= 0
    assert np.linalg.norm(p[1:]) <= mu * p[0] + k + 1e-12
    angle = np.linspace(0, 2 * np.pi, 60)
    height = np.concatenate([np.linspace(0, 4, 15), [p[0]]])
    rim = [(h, (mu * h + k) * np.cos(a), (mu * h + k) * np.sin(a)) for h in height for a in angle]
    along = np.array([*rim, *((h, 0.0, 0.0) for h in height)]) - p
    assert (along @ (x - p)).max() < 1e-12 * 40
    # and the kernel's in the plane of n and t
    size = np.hypot(t1, t2)
    np.testing.assert_allclose(onto_cone(n, size, mu, k), [p[0], np.linalg.norm(p[1:])], atol=1e-14)


@pytest.mark.parametrize("dimension", [2, 3])
def test_natural_errors_are_those_of_the_projection(dimension):
    rng = np.random.default_rng(dimension)
    r, u = rng.normal(size=(2, 200, dimension))
    bias, mu, k = (
        rng.normal(size=200),
        rng.uniform(0, 1, 200),
        rng.uniform(0, 0.5, 200) * rng.integers(0, 2, 200),
    )
    dual = u.copy()
    dual[:, 0] += bias + mu * np.linalg.norm(u[:, 1:], axis=1)
    projected = project_on_cone(r - 0.7 * dual, mu, k)
    error = np.linalg.norm(r - projected, axis=1)
    written = u.copy()
    found, whole, largest, size, target = natural_errors(r, written, bias, mu, k, 0.7)
    np.testing.assert_allclose(found, error, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(written, dual, rtol=1e-14)
    assert whole == pytest.approx(np.linalg.norm(error), rel=1e-12)
    assert largest == pytest.approx(error.max(), rel=1e-12)
    assert size == pytest.approx(np.linalg.norm(r), rel=1e-12)
    assert target == pytest.approx(np.linalg.norm(projected), rel=1e-12)


@settings(max_examples=100, deadline=None)
@given(contacts(), st.sampled_from([0.0, 0.5]))
def test_the_natural_map_of_one_contact_vanishes_at_its_solution_and_only_there(contact, cohesion):
    w, b, mu = contact
    assume(np.linalg.norm(b) > 0.01)
    k = cohesion * np.linalg.norm(b) / np.linalg.norm(w, 2)
    r, _ = solve_one(w, b, mu, k)
    rho, zero = 3.0 / np.trace(w), np.zeros(1)
    scale = np.linalg.norm(b) / np.linalg.norm(w, 2) + k

    def error(r):
        return natural_errors(r[None], (w @ r + b)[None], zero, np.array([mu]), np.array([k]), rho)[1]

    assert error(r) < 1e-9 * scale * np.linalg.cond(w)
    for nudge in 0.1 * scale * np.vstack([np.eye(3), -np.eye(3)]):
        assert error(r + nudge) > 1e-4 * scale / (1 + mu)
