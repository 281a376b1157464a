"""The portfolio for stored problems: solved, and for a reason that it gives."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.stored.operator import StoredDelassus
from benchmarks.stored.portfolio import StoredAuto
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import residual


def problem_of(seed, bodies, contacts, friction=0.6, cohesion=0.0, bias=0.0):
    """Random rigid bodies, contacts with random frames and arms between them: W = Hᵀ M⁻¹ H in blocks."""
    rng = np.random.default_rng(seed)
    pairs = rng.integers(0, bodies, (contacts, 2))
    # no body touches itself; body 0 does not move
    pairs[:, 1] = np.where(pairs[:, 0] == pairs[:, 1], (pairs[:, 1] + 1) % bodies, pairs[:, 1])
    inverse = np.concatenate(
        [rng.uniform(0.5, 2.0, (bodies, 1)).repeat(3, 1), rng.uniform(5, 20, (bodies, 3))], 1
    )
    inverse[0] = 0.0
    lift = np.zeros((contacts, 3, bodies, 6))
    for c, (i, j) in enumerate(pairs):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        for body, sign in ((i, 1.0), (j, -1.0)):
            arm = rng.normal(size=3) * 0.2
            lift[c, :, body] = sign * np.hstack([frame, np.cross(arm, frame)])
    matrix = np.einsum("cibk,bk,djbk->cidj", lift, inverse, lift)
    couple = np.abs(matrix).max(axis=(1, 3)) > 0
    indptr = np.concatenate([[0], np.cumsum(couple.sum(axis=1))]).astype(np.int64)
    rows, columns = np.nonzero(couple)
    operator = StoredDelassus(
        np.ascontiguousarray(matrix[rows, :, columns]), columns.astype(np.int64), indptr
    )
    # what bodies that are pressed together would do: u_free is in the image of Hᵀ
    velocity = rng.normal(size=(bodies, 6))
    velocity[0] = 0.0
    u_free = np.einsum("cibk,bk->ci", lift, velocity)
    every = np.ones(contacts)
    return ContactProblem(operator, u_free, bias * rng.random(contacts), friction * every, cohesion * every)


def nothing(problem):
    """A cold start."""
    return ContactStart(np.zeros_like(problem.u_free), np.zeros_like(problem.u_free))


def assert_laws_hold(problem, impulse, tolerance):
    """Signorini and Coulomb, contact by contact, without the natural map."""
    u = problem.delassus.apply(impulse) + problem.u_free
    n, size = impulse[:, 0], np.linalg.norm(impulse[:, 1:], axis=1)
    slide, gap = np.linalg.norm(u[:, 1:], axis=1), u[:, 0] + problem.bias
    pace, much = np.abs(problem.u_free).max(), np.abs(impulse).max()
    limit = problem.friction * n + problem.cohesion
    assert n.min() >= -tolerance * much
    assert gap.min() >= -tolerance * pace
    assert np.abs(n * gap).max() <= tolerance * much * pace
    assert (size - limit).max() <= tolerance * much
    # what slides is at its limit, and friction against it
    assert ((limit - size) * slide).max() <= tolerance * much * pace
    against = np.einsum("ci,ci->c", impulse[:, 1:], u[:, 1:]) + size * slide
    assert against.max() <= tolerance * much * pace


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 12),
    st.integers(1, 40),
    st.sampled_from([0.0, 0.05, 0.6, 2.0]),
    st.sampled_from([0.0, 0.3]),
    st.sampled_from([0.0, 0.5]),
)
def test_what_it_calls_solved_is(seed, bodies, contacts, friction, cohesion, bias):
    problem = problem_of(seed, bodies, contacts, friction, cohesion, bias)
    solution = StoredAuto(1e-10, 1e-8, 20_000)(problem, nothing(problem))
    if solution.converged:
        assert_laws_hold(problem, solution.impulse, 1e-6)
        assert residual(problem, solution.impulse).within(1e-10, 1e-8)
    assert solution.natural_map == pytest.approx(residual(problem, solution.impulse).natural_map, rel=1e-6)


def test_most_random_problems_are_solved():
    # contacts with random arms and normals may contradict each other; most do not
    solved = 0
    for seed in range(60):
        problem = problem_of(seed, 6, 12)
        solved += StoredAuto(1e-9, 1e-7, 5_000)(problem, nothing(problem)).converged
    assert solved >= 54


def test_three_spheres_of_the_examples():
    # Siconos' FC3D_Example1, closed form: r = (1, -0.0316227766, -0.0948683298) at each contact
    operator = StoredDelassus(np.tile(np.eye(3), (3, 1, 1)), np.arange(3), np.arange(4))
    u_free, mu = np.tile([-1.0, 1.0, 3.0], (3, 1)), np.full(3, 0.1)
    problem = ContactProblem(operator, u_free, np.zeros(3), mu, np.zeros(3))
    solution = StoredAuto(1e-12, 1e-9)(problem, nothing(problem))
    assert solution.converged
    assert solution.impulse == pytest.approx(
        np.tile([1.0, -0.1 / 10**0.5, -0.3 / 10**0.5], (3, 1)), abs=1e-12
    )
    assert solution.why.startswith("sweeps")


def stack(count, sides=4):
    """A stack of cubes of 1 kg on the ground, four contacts in each joint, at rest before a step of 1 ms."""
    rows = sides * count
    lift = np.zeros((rows, 3, count + 1, 6))
    corner = [(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)]
    frame = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for joint in range(count):
        for k, (x, y) in enumerate(corner):
            for body, sign, z in ((joint + 1, 1.0, -0.5), (joint, -1.0, 0.5)):
                arm = np.array([x, y, z])
                lift[sides * joint + k, :, body] = sign * np.hstack([frame, np.cross(arm, frame)])
    inverse = np.tile([1.0, 1.0, 1.0, 6.0, 6.0, 6.0], (count + 1, 1))
    inverse[0] = 0.0
    matrix = np.einsum("cibk,bk,djbk->cidj", lift, inverse, lift)
    couple = np.abs(matrix).max(axis=(1, 3)) > 0
    indptr = np.concatenate([[0], np.cumsum(couple.sum(axis=1))]).astype(np.int64)
    rows, columns = np.nonzero(couple)
    operator = StoredDelassus(
        np.ascontiguousarray(matrix[rows, :, columns]), columns.astype(np.int64), indptr
    )
    velocity = np.zeros((count + 1, 6))
    velocity[1:, 2] = -9.81e-3
    u_free = np.einsum("cibk,bk->ci", lift, velocity)
    none = np.zeros(len(u_free))
    return ContactProblem(operator, u_free, none, none + 0.5, none)


def test_a_tall_stack_at_rest_needs_a_few_iterations():
    # plain sweeps would take (2n/π)² ln(1/ε), some 25,000
    problem = stack(40)
    solution = StoredAuto(1e-9, 1e-7)(problem, nothing(problem))
    assert solution.converged
    assert solution.iterations <= 60
    assert solution.why.startswith("static ADMM")
    # each joint bears what lies above it
    joints = solution.impulse[:, 0].reshape(40, 4).sum(axis=1)
    assert joints == pytest.approx(9.81e-3 * np.arange(40, 0, -1), rel=1e-7)


def test_a_start_that_is_a_solution_costs_a_look():
    problem = stack(5)
    first = StoredAuto(1e-10, 1e-8)(problem, nothing(problem))
    again = StoredAuto(1e-9, 1e-7)(problem, ContactStart(first.impulse, first.velocity))
    assert again.iterations == 0
    assert again.why.startswith("nothing")
    assert again.impulse == pytest.approx(first.impulse)


def test_no_contacts_are_solved():
    operator = StoredDelassus(np.zeros((0, 3, 3)), np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64))
    none = np.zeros(0)
    problem = ContactProblem(operator, np.zeros((0, 3)), none, none, none)
    assert StoredAuto()(problem, nothing(problem)).converged


def test_iterations_are_no_more_than_allowed():
    problem = problem_of(5, 8, 30)
    for most in (1, 7, 12, 31):
        assert StoredAuto(1e-14, 1e-12, most)(problem, nothing(problem)).iterations <= most
