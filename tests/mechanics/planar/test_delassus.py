"""W in the plane and its sweeps against dense matrices and a solver that tries all cases."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.planar import delassus
from mechanics.planar._kernels.sweep import solve_local
from mechanics.planar.delassus import PlanarDelassus
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import natural_map
from mechanics.solvers.first_order.nsgs import NSGS
from tests.mechanics.planar.shapes import dense, random_problem
from tests.paths import ROOT


@pytest.mark.parametrize("seed", range(5))
def test_products_are_those_of_the_dense_matrices(seed):
    arrays = random_problem(seed)
    operator = PlanarDelassus(*arrays)
    ht, compliance = dense(*arrays)
    w = ht @ compliance @ ht.T
    r = np.random.default_rng(seed).normal(size=(len(arrays[0]), 2))
    v = np.random.default_rng(seed).normal(size=(len(arrays[3]), 3))
    np.testing.assert_allclose(operator.apply(r).ravel(), w @ r.ravel(), atol=1e-12)
    np.testing.assert_allclose(operator.velocity_change(r).ravel(), compliance @ ht.T @ r.ravel(), atol=1e-12)
    np.testing.assert_allclose(operator.relative_velocity(v).ravel(), ht @ v.ravel(), atol=1e-12)
    blocks = w.reshape(len(r), 2, len(r), 2)
    np.testing.assert_allclose(
        operator.diagonal, np.einsum("ciCj->cCij", blocks)[np.arange(len(r)), np.arange(len(r))], atol=1e-12
    )


@pytest.mark.parametrize("seed", range(5))
def test_the_sparse_form_is_the_same_w(seed):
    arrays = random_problem(seed)
    ht, compliance = dense(*arrays)
    form = PlanarDelassus(*arrays).form
    inertia, lift = form.inertia.toarray(), form.lift.toarray()
    np.testing.assert_allclose(lift.T @ np.linalg.inv(inertia) @ lift, ht @ compliance @ ht.T, atol=1e-12)
    np.testing.assert_array_equal(form.across.toarray(), lift.T)


def all_solutions(w, b, mu, k):
    """Every (r_N, r_T) with u = W r + b, 0 ≤ u_N ⊥ r_N ≥ 0 and Coulomb's law, by trying open, stick and both slips."""
    found = []
    tiny = 1e-9 * (np.abs(b).max() + k * np.abs(w).max()) + 1e-300

    def holds(r):
        u = w @ r + b
        limit = mu * r[0] + k
        normal = r[0] >= 0 and u[0] >= -tiny and (r[0] == 0 or abs(u[0]) <= tiny * 10)
        sticks = abs(u[1]) <= tiny * 10 and abs(r[1]) <= limit * (1 + 1e-9)
        slips = abs(abs(r[1]) - limit) <= 1e-9 * limit and r[1] * u[1] <= tiny * abs(r[1])
        return normal and (sticks or slips)

    sticking = -b[1] / w[1, 1]
    found.append(("open", np.array([0.0, np.clip(sticking, -k, k)])))
    found.append(("stick", -np.linalg.solve(w, b)))
    for s in (1.0, -1.0):
        slope = w[0, 0] + s * mu * w[0, 1]
        if slope != 0:
            n = -(b[0] + s * k * w[0, 1]) / slope
            found.append(("slip", np.array([n, s * (mu * n + k)])))
    return [(name, r) for name, r in found if holds(r)]


numbers = st.floats(-10, 10).filter(lambda x: x == 0 or abs(x) > 1e-3)


@settings(deadline=None, max_examples=500)
@given(
    st.floats(0.1, 10),
    st.floats(0.1, 10),
    st.floats(-0.99, 0.99),
    numbers,
    numbers,
    st.one_of(st.just(0.0), st.floats(0.01, 10)),
    st.one_of(st.just(0.0), st.floats(0.01, 10)),
)
def test_a_local_solution_is_one_of_all_and_the_first_in_order(nn, tt, coupling, bn, bt, mu, k):
    nt = coupling * np.sqrt(nn * tt)
    w, b = np.array([[nn, nt], [nt, tt]]), np.array([bn, bt])
    r = np.array(solve_local(nn, nt, tt, bn, bt, mu, k))
    solutions = all_solutions(w, b, mu, k)
    assert solutions
    # at the border between two cases both say the same
    distance = [np.abs(r - one).max() for _, one in solutions]
    assert min(distance) <= 1e-7 * (1 + np.abs(r).max())
    if mu * abs(nt) < 0.99 * nn:
        # one solution only, so all that hold are the same
        assert max(distance) <= 1e-5 * (1 + np.abs(r).max())


@pytest.mark.parametrize(("bn", "bt"), [(0.1, 0.2), (0.2, 0.5), (0.1, 1.0)])
def test_where_a_contact_may_stay_open_or_jam_it_stays_open(bn, bt):
    # friction lifts a rod that is pushed ahead of its lower end (Painlevé): pressed, it would need the pressure
    w, b = np.array([[1.0, 0.8], [0.8, 1.0]]), np.array([bn, bt])
    assert {name for name, _ in all_solutions(w, b, 3.0, 0.0)} == {"open", "stick", "slip"}
    assert solve_local(1.0, 0.8, 1.0, bn, bt, 3.0, 0.0) == (0.0, 0.0)


def gauss_seidel_twin(arrays, shift, friction, cohesion, order, sweeps):
    """Sweeps with the dense matrix, always forwards."""
    ht, compliance = dense(*arrays)
    w = ht @ compliance @ ht.T
    r = np.zeros(2 * len(shift))
    for _ in range(sweeps):
        for c in order:
            own = slice(2 * c, 2 * c + 2)
            block = w[own, own]
            b = w[own] @ r + shift[c] - block @ r[own]
            r[own] = all_solutions(block, b, friction[c], cohesion[c])[0][1]
    return r.reshape(-1, 2)


def with_loads(seed, count):
    rng = np.random.default_rng(seed)
    shift = rng.normal(size=(count, 2)) - [0.5, 0.0]
    return shift, rng.uniform(0, 0.6, count), rng.uniform(0, 0.2, count) * (rng.random(count) < 0.5)


def in_order(operator):
    """Contacts in the order of the sweeps."""
    place = operator.layout.place.ravel()
    return place[place >= 0]


@pytest.mark.parametrize("levers", [True, False])
def test_sweeps_are_those_of_the_dense_twin(levers):
    arrays = random_problem(3, bodies=20, contacts=25, levers=levers)
    # with μ |W_NT| < W_NN no local problem has two solutions, between which rounding might choose
    shift, friction, cohesion = with_loads(3, 25)
    operator = PlanarDelassus(*arrays)
    coupling = np.abs(operator.diagonal[:, 0, 1]) / operator.diagonal[:, 0, 0]
    friction = np.minimum(friction, 0.9 / np.maximum(coupling, 1e-3))
    r = np.zeros((25, 2))
    operator.gauss_seidel(shift, friction, cohesion)(r, 7)
    twin = gauss_seidel_twin(arrays, shift, friction, cohesion, in_order(operator), 7)
    np.testing.assert_allclose(r, twin, atol=1e-9)
    assert (r[:, 0] > 0).any()
    assert (r[:, 0] == 0).any()


def test_sweeps_lead_to_a_solution_of_the_whole_problem():
    arrays = random_problem(5, bodies=40, contacts=45, levers=False)
    shift, friction, cohesion = with_loads(5, 45)
    problem = ContactProblem(PlanarDelassus(*arrays), shift, np.zeros(45), friction, cohesion)
    none = np.zeros((45, 2))
    solution = NSGS(1e-12, max_iterations=20000)(problem, ContactStart(none, none))
    assert solution.converged
    assert natural_map(problem, solution.impulse) <= 1e-12


def test_swept_in_two_calls_it_is_swept_the_same_to_rounding():
    arrays = random_problem(6, bodies=30, contacts=40)
    shift, friction, cohesion = with_loads(6, 40)
    run = PlanarDelassus(*arrays).gauss_seidel(shift, 0.1 * friction, cohesion)
    once, twice = np.zeros((40, 2)), np.zeros((40, 2))
    run(once, 8)
    run(twice, 4)
    run(twice, 4)
    np.testing.assert_allclose(once, twice, atol=1e-12)


def lattice(side):
    """Contacts of a square lattice of disks, with loads."""
    place = np.arange(side * side).reshape(side, side)
    pairs = [(place[:, :-1], place[:, 1:]), (place[:-1], place[1:])]
    bodies = np.concatenate([np.column_stack([a.ravel(), b.ravel()]) for a, b in pairs])
    rng = np.random.default_rng(0)
    angle = rng.uniform(0, 2 * np.pi, len(bodies))
    normal = np.column_stack([np.cos(angle), np.sin(angle)])
    lever = np.tile([0.0, -1.0, 0.0, 1.0], (len(bodies), 1))
    inertia = np.tile([1.0, 2.0], (side * side, 1))
    inertia[::7] = 0.0
    moves = (inertia[bodies, 0] > 0).any(axis=1)
    return PlanarDelassus(bodies[moves], normal[moves], lever[moves], inertia)


@pytest.mark.parametrize("side", [3, 12, 40])
def test_groups_hold_every_contact_once_and_share_no_body_that_moves(monkeypatch, side):
    monkeypatch.setattr(delassus, "_THREAD_BATCH", 500)
    operator = lattice(side)
    layout, moves = operator.layout, operator.inertia[:, 0] > 0
    np.testing.assert_array_equal(np.sort(in_order(operator)), np.arange(len(operator.bodies)))
    for number, group in enumerate(layout.place):
        bodies = operator.bodies[group[group >= 0]]
        moving = bodies[moves[bodies]]
        assert len(set(moving.tolist())) == len(moving)
        # rows are those of the bodies, and of nothing that moves where a lane stays empty
        rows = layout.inertia[layout.body[number]]
        np.testing.assert_array_equal(rows[:, group >= 0], operator.inertia[bodies.T])
        assert not rows[:, group < 0].any()
    if side == 40:
        # few lanes stay empty
        assert len(layout.place) < 1.1 * len(operator.bodies) / 8


def test_a_body_that_all_contacts_share_is_in_a_group_once():
    # a plate on nine disks: nine groups of one contact
    below = np.arange(9)
    bodies = np.column_stack([below, np.full(9, 9)])
    normal, lever = np.tile([0.0, -1.0], (9, 1)), np.tile([0.0, -1.0, 0.0, 0.0], (9, 1))
    operator = PlanarDelassus(bodies, normal, lever, np.tile([1.0, 2.0], (10, 1)))
    assert ((operator.layout.place >= 0).sum(axis=1) == 1).all()
    assert len(operator.layout.place) == 9


def test_any_number_of_threads_gives_the_same_bits():
    """In a process of its own, with three threads, as this one may have been given only one."""
    script = (
        "import numba, numpy as np\n"
        "from dataclasses import replace\n"
        "from mechanics.planar import delassus\n"
        "from tests.mechanics.planar.test_delassus import lattice, with_loads\n"
        "delassus._THREAD_BATCH = 1000\n"
        "operator = lattice(60)\n"
        "count = len(operator.bodies)\n"
        "assert len(operator.layout.start) == 6  # four parts\n"
        "loads, runs = with_loads(1, count), []\n"
        "for threads in (1, 2, 3):\n"
        "    r = np.zeros((count, 2))\n"
        "    replace(operator, threads=threads).gauss_seidel(*loads)(r, 11)\n"
        "    runs.append(r.tobytes())\n"
        "assert runs[0] == runs[1] == runs[2]\n"
        "assert (r[:, 0] > 0).sum() > 100 and numba.get_num_threads() == 3\n"
        "print('same bits')\n"
    )
    answer = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], cwd=ROOT, env={**os.environ, "NUMBA_NUM_THREADS": "3"},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert answer.stdout == "same bits\n", answer.stderr[-2000:]


def column(count):
    """Disks of 1 kg on top of each other, the lowest on what does not move."""
    above = np.arange(1, count + 1)
    inertia = np.tile([1.0, 2.0], (count + 1, 1))
    inertia[0] = 0.0
    levers = np.tile([0.0, -1.0, 0.0, 1.0], (count, 1))
    return PlanarDelassus(
        np.column_stack([above, above - 1]), np.tile([0.0, 1.0], (count, 1)), levers, inertia
    )


def settling(operator, weight, sweeps):
    """Largest error of the normal impulses after each sweep, from none, where only the lowest contact is pressed."""
    count = len(operator.bodies)
    shift, none = np.zeros((count, 2)), np.zeros(count)
    shift[0, 0] = -weight
    run, r, errors = operator.gauss_seidel(shift, none, none), np.zeros((count, 2)), []
    for _ in range(sweeps):
        run(r, 1)
        errors.append(np.abs(r[:, 0] - weight * np.arange(count, 0, -1.0)).max())
    return np.array(errors)


@pytest.mark.parametrize("count", [2, 5, 10, 40])
def test_the_rate_of_a_column_is_that_of_theory(count):
    # W is tridiagonal, so Gauss–Seidel has the square of Jacobi's spectral radius cos(π/2n), in any order (Varga 1962)
    errors = settling(column(count), 1.0, 60 * count)
    last = np.flatnonzero(errors > 1e-9 * count)[-1]
    rate = (errors[last] / errors[last // 2]) ** (1 / (last - last // 2))
    assert rate == pytest.approx(np.cos(np.pi / (2 * count)) ** 2, rel=1e-4)


def test_the_rate_is_the_same_in_parts(monkeypatch):
    monkeypatch.setattr(delassus, "_THREAD_BATCH", 10)
    operator = column(40)
    assert len(operator.layout.start) == 6
    errors = settling(operator, 1.0, 2400)
    rate = (errors[-1] / errors[-501]) ** (1 / 500)
    assert rate == pytest.approx(np.cos(np.pi / 80) ** 2, rel=1e-4)
