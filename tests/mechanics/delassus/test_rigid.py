"""W between rigid bodies, matrix-free: products, schedule and sweeps against dense matrices and slow twins."""

import itertools
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.delassus.rigid import RigidDelassus, schedule
from tests.mechanics.shapes import brick, dense_operator, ground, pile, posed, scene, slow_pass
from tests.paths import ROOT


def falling(seed=5, stones=12):
    """A pile of random stones, all turning, with gaps and overlaps; and its dense W."""
    one = posed(pile(seed, stones, near=0.25, alert=0.5))
    assert len(one.contacts) > 20
    w_hat, transpose = dense_operator(one.model, one.state, one.contacts, {}, common=True)
    return one, w_hat, transpose


@pytest.fixture(scope="module")
def case():
    return falling()


def test_products_are_those_of_the_dense_matrices(case):
    one, w_hat, transpose = case
    dense, rng = transpose @ w_hat @ transpose.T, np.random.default_rng(0)
    for _ in range(5):
        r, v = rng.normal(size=(len(one.contacts), 3)), rng.normal(size=(len(one.model.mass), 6))
        np.testing.assert_allclose(
            one.operator.apply(r).ravel(), dense @ r.ravel(), atol=1e-12 * np.abs(dense).max() * 100
        )
        change = w_hat @ transpose.T @ r.ravel()
        np.testing.assert_allclose(
            one.operator.rigid_change(r).ravel(), change, atol=1e-12 * np.abs(change).max()
        )
        np.testing.assert_allclose(
            one.operator.relative_velocity(v).ravel(), transpose @ v.ravel(), atol=1e-12
        )


def test_diagonal_blocks_are_those_of_the_dense_matrix(case):
    one, w_hat, transpose = case
    dense, n = transpose @ w_hat @ transpose.T, np.arange(len(one.contacts))
    blocks = dense.reshape(len(n), 3, len(n), 3)[n, :, n]
    np.testing.assert_allclose(one.operator.diagonal, blocks, atol=1e-13 * np.abs(blocks).max())


def test_the_sparse_form_is_the_same_w(case):
    one, w_hat, transpose = case
    dense = transpose @ w_hat @ transpose.T
    inertia, lift = one.operator.form.inertia.toarray(), one.operator.form.lift.toarray()
    np.testing.assert_allclose(
        lift.T @ np.linalg.solve(inertia, lift), dense, atol=1e-11 * np.abs(dense).max()
    )


def test_fixed_bodies_answer_nothing(case):
    one, _, _ = case
    change = one.operator.rigid_change(np.ones((len(one.contacts), 3)))
    np.testing.assert_array_equal(change[one.model.fixed], 0.0)
    assert np.abs(change[~one.model.fixed]).min(axis=1).max() > 0


# --- the order of the sweeps ---


def random_bodies(seed, contacts, bodies=40):
    """Pairs of bodies with one to four contacts each, in any order; every fifth body does not move."""
    rng = np.random.default_rng(seed)
    pairs = rng.integers(0, bodies, (contacts, 2))
    pairs = np.repeat(pairs[pairs[:, 0] != pairs[:, 1]], 4, axis=0)
    pairs = pairs[rng.permutation(len(pairs))[:contacts]]
    moving = np.arange(bodies) % 5 > 0
    return pairs[moving[pairs].any(axis=1)], moving


def assert_schedule(bodies, moving, plan):
    """Every contact once; groups hold the contacts of one candidate and antagonist; no moving body in two parts."""
    np.testing.assert_array_equal(np.sort(plan.order), np.arange(len(bodies)))
    ordered = bodies[plan.order]
    assert plan.group[0] == 0
    assert plan.group[-1] == len(bodies)
    assert (np.diff(plan.group) > 0).all()
    pairs = []
    for start, stop in itertools.pairwise(plan.group):
        assert (ordered[start:stop] == ordered[start]).all()
        pairs.append(tuple(ordered[start].tolist()))
    assert len(set(pairs)) == len(pairs)
    assert plan.part[0] == 0
    assert plan.part[-1] == len(plan.group) - 1
    if len(plan.part) > 2:
        touched = [
            {b for pair in pairs[start:stop] for b in pair if moving[b]}
            for start, stop in itertools.pairwise(plan.part[:-1])
        ]
        assert len(set().union(*touched)) == sum(map(len, touched))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.sampled_from([1, 50, 2600]))
def test_the_schedule_holds_every_contact_once_and_no_body_in_two_parts(seed, contacts):
    bodies, moving = random_bodies(seed, contacts)
    plan = schedule(bodies, moving)
    assert_schedule(bodies, moving, plan)
    assert (len(plan.part) > 2) == (len(bodies) >= 2000)


def test_contacts_of_one_pair_keep_their_order():
    bodies = np.array([[3, 1], [0, 2], [1, 3], [3, 1], [0, 2]])
    plan = schedule(bodies, np.ones(4, dtype=bool))
    groups = [plan.order[a:b].tolist() for a, b in itertools.pairwise(plan.group)]
    assert sorted(groups) == [[0, 3], [1, 4], [2]]


def test_nothing_needs_no_schedule():
    plan = schedule(np.zeros((0, 2), dtype=np.int64), np.ones(3, dtype=bool))
    assert (len(plan.order), plan.group.tolist(), plan.part.tolist()) == (0, [0], [0])


# --- sweeps ---


def random_start(one, seed=1):
    """Impulses, and a shift, friction and cohesion under which some contacts open, stick and slide."""
    rng, count = np.random.default_rng(seed), len(one.contacts)
    shift = rng.normal(size=(count, 3)) - [0.5, 0.0, 0.0]
    size = 1.0 / np.abs(one.operator.diagonal).mean()
    cohesion = size * rng.uniform(0, 0.5, count) * rng.integers(0, 2, count)
    return size * rng.normal(size=(count, 3)), shift, rng.uniform(0, 1, count), cohesion


@pytest.mark.parametrize("count", [1, 2, 5])
def test_sweeps_are_those_of_the_slow_twin(case, count):
    one, w_hat, transpose = case
    dense = transpose @ w_hat @ transpose.T
    start, shift, mu, cohesion = random_start(one)
    fast, slow = start.copy(), start.copy()
    one.operator.gauss_seidel(shift, mu, cohesion)(fast, count)
    for _ in range(count):
        slow_pass(dense, slow, shift, mu, cohesion, range(len(slow)))
    np.testing.assert_allclose(fast, slow, atol=1e-7 * np.abs(slow).max())
    is_open, sticks = (
        slow[:, 0] == 0,
        np.linalg.norm(slow[:, 1:], axis=1) < 0.99 * (mu * slow[:, 0] + cohesion),
    )
    assert 0.1 < is_open.mean() < 0.9
    assert 0.0 < sticks.mean() < 0.9


def test_a_pair_of_stones_may_be_candidate_and_antagonist_both_ways():
    """Stones of several parts: one part's face carries here, the other stone's there."""
    rng = np.random.default_rng(2)
    body = np.array([[0, 1], [1, 0], [0, 1], [1, 2], [2, 1], [0, 2]])
    plan = schedule(body, np.array([True, True, False]))
    body = body[plan.order]
    frame = Rotation.random(len(body), random_state=1).as_matrix().reshape(-1, 9)
    inertia = np.array([[1.0, 2, 0.1, 0, 3, 0.2, 4], [0.5, 1, 0, 0.1, 1.5, 0, 2], [0.0] * 7])
    operator = RigidDelassus(body, np.hstack([frame, 0.3 * rng.normal(size=(len(body), 6))]), inertia, plan)
    dense = np.column_stack([operator.apply(e.reshape(-1, 3)).ravel() for e in np.eye(3 * len(body))])
    np.testing.assert_allclose(dense, dense.T, atol=1e-13)
    shift = rng.normal(size=(len(body), 3)) - [1.0, 0, 0]
    mu, cohesion = np.full(len(body), 0.3), np.zeros(len(body))
    fast, slow = np.zeros_like(shift), np.zeros_like(shift)
    operator.gauss_seidel(shift, mu, cohesion)(fast, 3)
    for _ in range(3):
        slow_pass(dense, slow, shift, mu, cohesion, range(len(body)))
    assert (slow[:, 0] > 0).sum() >= 3
    np.testing.assert_allclose(fast, slow, atol=1e-12)


def test_contacts_that_sleep_change_the_solution_by_less_than_their_tolerance(case):
    """Many sweeps in one call, in which contacts sleep, and in calls of one, in which none does."""
    one, _, _ = case
    start, shift, mu, cohesion = random_start(one)
    together, single = start.copy(), start.copy()
    sweep = one.operator.gauss_seidel(shift, mu, cohesion)
    sweep(together, 300)
    for _ in range(300):
        sweep(single, 1)
    fast, slow = (one.operator.apply(r) + shift for r in (together, single))
    np.testing.assert_allclose(fast, slow, atol=1e-7 * np.abs(shift).max())


def wall(courses=12, width=17):
    """A dry wall of more than 2,000 contacts, pushed sideways."""
    stones = [ground((-1, -1, -1), (width + 1, 2, 0))]
    for z, x in itertools.product(range(courses), range(width)):
        low = np.array([x + 0.5 * (z % 2), 0.0, 0.5 * z])
        stones.append(
            brick(f"{z}.{x}", low, low + np.array([1, 0.5, 0.5]), velocity=(0.05 * z, 0.02 * x, 0, 0, 0, 0))
        )
    return scene(*stones)


def test_any_number_of_threads_gives_the_same_bits():
    """In a process of its own, with two threads, as this one may have been given only one."""
    script = (
        "import numpy as np\n"
        "from dataclasses import replace\n"
        "from tests.mechanics.delassus.test_rigid import posed, random_start, wall\n"
        "one = posed(wall())\n"
        "assert len(one.contacts) > 2000 and len(one.operator.schedule.part) > 3\n"
        "start, shift, mu, cohesion = random_start(one)\n"
        "runs = []\n"
        "for threads in (1, 2, 2):\n"
        "    r = start.copy()\n"
        "    sweep = replace(one.operator, threads=threads).gauss_seidel(shift, mu, cohesion)\n"
        "    sweep(r, 7); sweep(r, 4)\n"
        "    runs.append(r.tobytes())\n"
        "assert runs[0] == runs[1] == runs[2]\n"
        "assert np.isfinite(r).all() and np.abs(r - start).max() > 0\n"
        "print('same bits')\n"
    )
    answer = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], cwd=ROOT, env={**os.environ, "NUMBA_NUM_THREADS": "2"},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert answer.stdout == "same bits\n", answer.stderr[-2000:]


def test_a_wall_of_few_contacts_is_swept_in_the_order_of_its_bodies():
    """Its sweeps agree with the slow twin in the same order."""
    one = posed(wall(4, 3))
    plan = one.operator.schedule
    assert len(plan.part) == 2
    np.testing.assert_array_equal(plan.order, np.arange(len(one.contacts)))
    w_hat, transpose = dense_operator(one.model, one.state, one.contacts, {}, common=True)
    start, shift, mu, cohesion = random_start(one)
    fast, slow = start.copy(), start.copy()
    one.operator.gauss_seidel(shift, mu, cohesion)(fast, 1)
    slow_pass(transpose @ w_hat @ transpose.T, slow, shift, mu, cohesion, range(len(slow)))
    np.testing.assert_allclose(fast, slow, atol=1e-9 * np.abs(slow).max())
