"""The Delassus operator in its three forms: factored, sparse, and dense from the definitions."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.contact.contacts import gaps
from mechanics.contact.detection import Detector
from mechanics.delassus._kernels.mixed import ELASTIC, NONE, RIGID
from mechanics.delassus.assembly import local_velocity, world_impulse
from mechanics.dynamics.contact_problem import contact_problem
from mechanics.dynamics.contact_search import detection
from mechanics.dynamics.handover import of_run
from mechanics.dynamics.stepping import advance, compliances, free_kick, kicked, predict
from mechanics.model.model import build_model
from mechanics.scene.laws.law import STATE
from mechanics.scene.scene import Fidelity
from tests.mechanics.shapes import TURN, brick, dense_operator, ground, moved, scene

STEP, THETA = 2e-3, 0.75
SPIN = (0.1, -0.2, 0.05, 0.3, 0.2, -0.4)


def mixed():
    """Fixed, rigid and elastic stones in contact with one another, turned all together."""
    soft, size = Fidelity.DEFORMABLE, 0.5
    stones = (
        ground((-1, -1, -0.4), (2, 2, 0)),
        brick("soft", (0, 0, 0), (0.7, 0.5, 0.4), soft, mesh_size=size, velocity=SPIN),
        brick("hard", (0.2, 0.1, 0.4), (0.9, 0.5, 0.7), velocity=SPIN),
        brick("upper", (0.1, 0, 0.7), (0.7, 0.4, 1.0), soft, mesh_size=size),
        brick("beside", (0.7, 0, 0), (1.0, 0.5, 0.4)),
    )
    return scene(*(moved(s, TURN, (3, 4, 5)) for s in stones), step=STEP, theta=THETA)


class Assembled:
    """A step of the mixed scene, in which the stones have turned once more since they were meshed."""

    def __init__(self, one):
        self.model, state = build_model(one)
        again = Rotation.from_rotvec([0.2, 0.1, -0.3]).as_matrix()
        self.state = type(state)(
            state.time,
            state.centre @ again.T,
            again @ state.rotation,
            np.hstack([state.velocity[:, :3] @ again.T, state.velocity[:, 3:] @ again.T]),
            state.node @ again.T,
            state.node_velocity @ again.T,
        )
        self.compliance = compliances(self.model, STEP, THETA)
        find = Detector(self.model.surfaces, self.model.fixed, 0.05)
        contacts = find(self.state, np.zeros(len(one.blocks)))
        self.found = detection(self.model, self.state, contacts, self.compliance)
        self.contacts = self.found.contacts
        self.operator = self.found.operator
        self.form = self.operator.form
        self.w_hat, self.transpose = dense_operator(self.model, self.state, self.contacts, self.compliance)
        self.dense = self.transpose @ self.w_hat @ self.transpose.T

    def free(self, predicted):
        """Velocities without contact impulses."""
        return free_kick(self.model, self.state, predicted, self.compliance, STEP, THETA)

    def kick(self, free, impulse):
        return kicked(self.model, free, self.found, impulse, self.compliance)


@pytest.fixture(scope="module")
def step():
    return Assembled(mixed())


def columns(step):
    """W, column by column."""
    size = 3 * len(step.contacts)
    return np.column_stack([step.operator.apply(e.reshape(-1, 3)).ravel() for e in np.eye(size)])


def test_all_kinds_of_sides_meet_in_the_scene(step):
    kinds = {tuple(sorted(pair)) for pair in step.operator.kind.tolist()}
    assert kinds >= {(NONE, ELASTIC), (RIGID, ELASTIC), (NONE, RIGID)}


def test_factored_delassus_is_the_dense_one(step):
    found = columns(step)
    np.testing.assert_allclose(found, step.dense, atol=1e-11 * np.abs(step.dense).max())
    np.testing.assert_allclose(found, found.T, atol=1e-13 * np.abs(step.dense).max())
    assert np.linalg.eigvalsh(step.dense)[0] > -1e-12 * np.abs(step.dense).max()


def test_diagonal_blocks_are_those_of_w(step):
    n = np.arange(len(step.contacts))
    blocks = step.dense.reshape(len(n), 3, len(n), 3)[n, :, n]
    np.testing.assert_allclose(step.operator.diagonal, blocks, atol=1e-11 * np.abs(blocks).max())


@pytest.fixture(scope="module")
def damped():
    one = mixed()
    slow = [replace(b, material=replace(b.material, mass_damping=30.0)) for b in one.blocks]
    return Assembled(replace(one, blocks=tuple(slow)))


@pytest.mark.parametrize("name", ["step", "damped"])
def test_what_stones_yield_is_w_less_that_of_rigid_ones(name, request):
    step = request.getfixturevalue(name)
    size = 3 * len(step.contacts)
    operator = step.operator.as_rigid
    rigid = np.column_stack([operator.apply(e.reshape(-1, 3)).ravel() for e in np.eye(size)])
    yielded, most = step.dense - rigid, np.abs(step.dense).max()
    assert np.linalg.eigvalsh(yielded)[0] > -1e-9 * most
    stiff = np.repeat((step.operator.kind != ELASTIC).all(axis=1), 3)
    assert stiff.any()
    assert np.abs(yielded[stiff]).max() <= 1e-12 * most
    # no stone yields by as much as it moves, and those that deform yield
    own = np.diag(yielded)[~stiff]
    assert (own > 1e-6 * most).all()
    unit = np.random.default_rng(3).uniform(0.5, 2.0, len(step.contacts))
    scaled = step.operator.scaled(unit).as_rigid
    each = np.repeat(unit, 3)
    np.testing.assert_allclose(
        scaled.apply(np.ones((len(unit), 3))).ravel(), each * (rigid @ each), atol=1e-10 * most
    )


@pytest.mark.parametrize("penalty", [1e-3, 0.1, 10.0])
def test_condensed_form_solves_with_w_and_a_penalty(step, penalty):
    sigma = penalty * step.operator.scale
    right = np.random.default_rng(0).normal(size=len(step.dense))
    expected = np.linalg.solve(step.dense + sigma * np.eye(len(step.dense)), right)
    found = step.form.shifted(np.tile(sigma * np.eye(3), (len(step.contacts), 1, 1)))(right)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())


def test_local_velocity_is_the_transpose_of_the_lift(step):
    rng = np.random.default_rng(1)
    velocity = rng.normal(size=step.state.velocity.shape) * ~(step.model.fixed | step.model.elastic)[:, None]
    node_velocity = rng.normal(size=step.state.node.shape)
    found = local_velocity(step.contacts, step.operator, velocity, node_velocity)
    expected = step.transpose @ np.concatenate([velocity.ravel(), node_velocity.ravel()])
    np.testing.assert_allclose(found.ravel(), expected, atol=1e-12)


def test_velocity_after_a_step_is_w_r_plus_u_free(step):
    contacts, state = step.contacts, step.state
    free = step.free(state)
    internal = np.zeros((len(contacts), STATE))
    problem, _ = contact_problem(step.model, state, step.found, free, internal, of_run(state))
    r = np.random.default_rng(2).normal(size=(len(contacts), 3))
    kick = step.kick(free, r)
    found = local_velocity(contacts, step.operator, kick.velocity, kick.node_velocity)
    expected = step.dense @ r.ravel() + problem.u_free.ravel()
    np.testing.assert_allclose(found.ravel(), expected, atol=1e-11 * np.abs(expected).max())


def test_gap_at_the_end_of_a_step_is_g_plus_h_theta_u(step):
    """Detected at q + h(1-θ)v; to first order in the turn of the stones over the step."""
    model, state = step.model, step.state
    predicted = predict(model, state, state, STEP * (1 - THETA))
    kick = step.kick(step.free(predicted), np.zeros((len(step.contacts), 3)))
    after = advance(model, state, predicted, kick, STEP * THETA)
    u = local_velocity(step.contacts, step.operator, kick.velocity, kick.node_velocity)
    expected = gaps(step.contacts, predicted) + STEP * THETA * u[:, 0]
    turned = STEP * np.abs(state.velocity[:, 3:]).max()
    np.testing.assert_allclose(gaps(step.contacts, after), expected, atol=2 * turned**2)


def test_free_motion_of_an_elastic_stone_solves_the_theta_scheme(step):
    # (M + h²θ²K) (v_free - v) = h P - h K (d + hθ v) with d at the start of the step, here in world axes
    model, b = step.model, 1
    stone, rows, turn = model.stones[b], model.nodes_of(b), step.state.rotation[b]
    v = np.random.default_rng(4).normal(size=(len(stone.mesh.nodes), 3))
    # spin would bring centrifugal forces
    v -= np.cross((stone.projector @ v.ravel())[3:], stone.mesh.nodes)
    strained = 1e-6 * np.random.default_rng(5).normal(size=v.shape)
    node, node_velocity = step.state.node.copy(), step.state.node_velocity.copy()
    node[rows] = step.state.centre[b] + (stone.mesh.nodes + strained + STEP * (1 - THETA) * v) @ turn.T
    node_velocity[rows] = v @ turn.T
    state = replace(step.state, node=node, node_velocity=node_velocity)
    free = step.free(state)
    axes = np.kron(np.eye(len(v)), turn)
    stiffness = axes @ stone.operators.stiffness.toarray() @ axes.T
    mass = stone.operators.mass.toarray()
    load = mass @ np.tile(model.gravity(0.0), len(v))
    right = STEP * (load - stiffness @ (axes @ (strained + STEP * THETA * v).ravel()))
    jump = np.linalg.solve(mass + (STEP * THETA) ** 2 * stiffness, right)
    found = (free.node_velocity[rows] - state.node_velocity[rows]).ravel()
    np.testing.assert_allclose(found, jump, atol=1e-9 * np.abs(jump).max())


def test_a_spinning_bar_is_stretched_by_centrifugal_forces():
    """u = ρω²/(2E) (L² x - x³/3) from the middle, u(L) = ρω²L³/(3E) (Timoshenko & Goodier §32, thin bar)."""
    half, spin = 1.0, 30.0
    bar = brick(
        "bar", (-half, -0.05, -0.05), (half, 0.05, 0.05), Fidelity.DEFORMABLE, mesh_size=0.05,
        velocity=(0, 0, 0, 0, 0, spin),
    )  # fmt: skip
    one = scene(bar, gravity=(0, 0, 0), step=1e-2)
    model, state = build_model(one)
    free = free_kick(model, state, state, compliances(model, 1e-2, 1.0), 1e-2, 1.0)
    stretch = 1e-2 * (free.node_velocity - state.node_velocity)
    tip = state.node[:, 0] > half - 1e-9
    expected = bar.material.density * spin**2 * half**3 / (3 * bar.material.young)
    assert stretch[tip, 0].mean() == pytest.approx(expected, rel=0.02)


def test_world_impulse_of_a_normal_impulse_points_along_n(step):
    r = np.zeros((len(step.contacts), 3))
    r[:, 0] = 2.0
    np.testing.assert_allclose(world_impulse(step.contacts, r), 2.0 * step.contacts.frame[:, 0])
