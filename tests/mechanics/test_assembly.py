"""The Delassus operator in its three forms: factored, sparse, and dense from the definitions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.contact.assembly import local_velocity, mixed_delassus, sparse_form, world_impulse
from mechanics.contact.contacts import gaps
from mechanics.contact.detection import Detector
from mechanics.laws.law import STATE
from mechanics.model import build_model
from mechanics.operators.mixed import ELASTIC, NONE, RIGID
from mechanics.problem import scale_of
from mechanics.scene import Fidelity
from mechanics.statement import state_laws
from mechanics.stepping import advance, compliances, follow_nodes, free_kick, kicked, predict
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
        turned = type(state)(
            state.time,
            state.centre @ again.T,
            again @ state.rotation,
            np.hstack([state.velocity[:, :3] @ again.T, state.velocity[:, 3:] @ again.T]),
            state.node @ again.T,
            state.node_velocity @ again.T,
        )
        self.state = follow_nodes(self.model, turned)
        self.compliance = compliances(self.model, STEP, THETA)
        find = Detector(self.model.surfaces, self.model.fixed, 0.05)
        self.contacts = find(self.state, np.zeros(len(one.blocks)))
        self.operator = mixed_delassus(self.model, self.state, self.contacts, self.compliance)
        self.sparse = sparse_form(self.model, self.state, self.contacts, self.operator, self.compliance)
        self.w_hat, self.transpose = dense_operator(self.model, self.state, self.contacts, self.compliance)
        self.dense = self.transpose @ self.w_hat @ self.transpose.T

    def free(self, predicted):
        """Velocities without contact impulses."""
        return free_kick(self.model, self.state, self.state, predicted, self.compliance, STEP, THETA)

    def kick(self, free, impulse):
        return kicked(self.model, free, self.state, self.contacts, self.operator, impulse, self.compliance)


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


def test_sparse_form_is_the_same_w(step):
    inertia, lift = step.sparse.inertia.toarray(), step.sparse.lift.toarray()
    np.testing.assert_allclose(
        lift.T @ np.linalg.solve(inertia, lift), step.dense, atol=1e-11 * np.abs(step.dense).max()
    )
    np.testing.assert_allclose(inertia, inertia.T, rtol=1e-12, atol=1e-12 * np.abs(inertia).max())


def test_factor_solves_with_the_inertia_and_the_penalty(step):
    inertia, lift = step.sparse.inertia.toarray(), step.sparse.lift.toarray()
    sigma = 0.1 * scale_of(step.operator)
    right = np.random.default_rng(0).normal(size=len(inertia))
    expected = np.linalg.solve(inertia + lift @ lift.T / sigma, right)
    found = step.sparse.factor(sigma).solve(right)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-10 * np.abs(expected).max())
    assert step.sparse.factor(sigma) is step.sparse.factor(sigma)


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
    problem = state_laws(
        step.model, state, contacts, gaps(contacts, state), step.model.laws.of(contacts.bodies),
        step.operator, step.sparse, free, np.zeros((len(contacts), STATE)), True,
    ).problem  # fmt: skip
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
    # (M + h²θ²K) (v_free - v) = h P - h K (d + hθ v), here in world axes
    model, state, b = step.model, step.state, 1
    free = step.free(state)
    stone, rows = model.stones[b], model.nodes_of(b)
    axes = np.kron(np.eye(len(stone.mesh.nodes)), state.rotation[b])
    stiffness = axes @ stone.operators.stiffness.toarray() @ axes.T
    mass = stone.operators.mass.toarray()
    d = (state.node[rows] - state.centre[b] - stone.mesh.nodes @ state.rotation[b].T).ravel()
    v = state.node_velocity[rows].ravel()
    load = np.outer(stone.operators.nodal_mass, model.gravity(0.0)).ravel()
    right = STEP * (load - stiffness @ (d + STEP * THETA * v))
    jump = np.linalg.solve(mass + (STEP * THETA) ** 2 * stiffness, right)
    found = (free.node_velocity[rows] - state.node_velocity[rows]).ravel()
    np.testing.assert_allclose(found, jump, atol=1e-9 * np.abs(jump).max())


def test_world_impulse_of_a_normal_impulse_points_along_n(step):
    r = np.zeros((len(step.contacts), 3))
    r[:, 0] = 2.0
    np.testing.assert_allclose(world_impulse(step.contacts, r), 2.0 * step.contacts.frame[:, 0])
