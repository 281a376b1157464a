"""One elastic stone: its frame, its compliance."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.model.deformable import Compliance, deformable, dissection
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.elasticity.tensors import from_voigt, von_mises
from mechanics.stones.meshing.meshers.gmsh import mesh_with_gmsh
from tests.mechanics.shapes import LIMESTONE, TURN
from tests.pipelines.results_by_hand import box

STEP, THETA = 1e-3, 0.7


@pytest.fixture(scope="module")
def mesh():
    return mesh_with_gmsh(box((0, 0, 0), (0.8, 0.5, 0.6)) @ TURN.T + 3.0, BOX_FACES, 0.35, "A1")


@pytest.fixture(scope="module")
def stone(mesh):
    return deformable(mesh, LIMESTONE)[0]


@pytest.fixture(scope="module")
def response(stone):
    return Compliance(stone, STEP, THETA)


def test_centre_is_that_of_the_mass(mesh):
    stone, centre = deformable(mesh, LIMESTONE)
    np.testing.assert_allclose(centre, np.array([0.4, 0.25, 0.3]) @ TURN.T + 3.0, atol=1e-12)
    np.testing.assert_allclose(stone.weight @ stone.mesh.nodes, 0, atol=1e-10)


vector = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3)


@settings(max_examples=30, deadline=None)
@given(vector, vector)
def test_projector_reads_a_rigid_motion_off_the_nodes(stone, spin, pace):
    velocity = np.array(pace) + np.cross(spin, stone.mesh.nodes)
    np.testing.assert_allclose(stone.projector @ velocity.ravel(), [*pace, *spin], atol=1e-12)


def test_projector_sees_momentum_and_nothing_else(stone):
    velocity = np.random.default_rng(0).normal(size=(len(stone.mesh.nodes), 3))
    motion = stone.projector @ velocity.ravel()
    momentum = stone.operators.mass @ velocity.ravel()
    np.testing.assert_allclose(motion[:3] * stone.mass, momentum.reshape(-1, 3).sum(axis=0), rtol=1e-10)
    moment = np.cross(stone.mesh.nodes, momentum.reshape(-1, 3)).sum(axis=0)
    np.testing.assert_allclose(stone.inertia @ motion[3:], moment, rtol=1e-10)


def test_turning_a_stone_by_a_right_angle_stresses_nothing(stone):
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    node = stone.mesh.nodes @ turn.T + [5.0, 6.0, 7.0]
    centre, rotation = np.array([5.0, 6.0, 7.0]), turn
    assert von_mises(stone.stress(node, centre, rotation)).max() < 1e-12 * LIMESTONE.young
    assert stone.elastic_energy(node, centre, rotation) < 1e-20 * LIMESTONE.young
    # without the frame the same turn would strain it by more than 1
    assert np.abs(stone.displacement(node, centre, np.eye(3))).max() > 0.5


def test_stress_of_a_squeezed_and_turned_stone_turns_with_it(stone):
    strain, turn = 1e-5, Rotation.from_rotvec([1.0, 2.0, 0.5]).as_matrix()
    # free sideways, σ = E ε along a side of the box, which the fixture has turned by TURN
    stretch = np.diag([1 + strain, 1 - LIMESTONE.poisson * strain, 1 - LIMESTONE.poisson * strain])
    node = stone.mesh.nodes @ (turn @ TURN @ stretch @ TURN.T).T + 1.0
    centre, rotation = np.ones(3), turn
    side = turn @ TURN[:, 0]
    expected = LIMESTONE.young * strain * np.outer(side, side)
    found = from_voigt(stone.stress(node, centre, rotation))
    # linear in a frame that may be off by a part of ε
    atol = 10 * strain * LIMESTONE.young * strain
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=atol)
    # ½ E ε² V
    energy = 0.5 * LIMESTONE.young * strain**2 * 0.8 * 0.5 * 0.6
    assert stone.elastic_energy(node, centre, rotation) == pytest.approx(energy, rel=10 * strain)


def test_response_is_the_inverse_of_m_plus_h2_theta2_k(stone, response):
    full = stone.operators.mass + (STEP * THETA) ** 2 * stone.operators.stiffness
    np.testing.assert_allclose(response.matrix.toarray(), full.toarray(), rtol=1e-14)
    size = full.shape[0]
    inverse = np.column_stack([response.respond(p.reshape(-1, 3)).ravel() for p in np.eye(size)])
    np.testing.assert_allclose(inverse @ full.toarray(), np.eye(size), atol=1e-10)


def test_condensed_compliance_is_the_inverse_seen_from_some_nodes(stone):
    response = Compliance(stone, STEP, THETA)
    inverse = np.linalg.inv(response.matrix.toarray())
    rng, count = np.random.default_rng(1), len(stone.mesh.nodes)
    # asked for bit by bit, what is kept grows
    for size in (3, count // 3, 5, count):
        nodes = np.sort(rng.choice(count, size, replace=False))
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        found, expected = response.between(nodes), inverse[np.ix_(dofs, dofs)]
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())
        np.testing.assert_array_equal(found, found.T)
        assert np.linalg.eigvalsh(found)[0] > 0


def test_responses_of_equal_stones_come_at_once(stone, response):
    push = np.random.default_rng(2).normal(size=(4, len(stone.mesh.nodes), 3))
    together = response.respond(push)
    for k in range(4):
        alone = response.respond(push[k])
        np.testing.assert_allclose(together[k], alone, atol=1e-12 * np.abs(alone).max())


def test_rayleigh_damping_is_part_of_the_compliance(mesh):
    alpha, beta = 3.0, 2e-4
    damped = replace(LIMESTONE, mass_damping=alpha, stiffness_damping=beta)
    stone = deformable(mesh, damped)[0]
    m, k, h = stone.operators.mass, stone.operators.stiffness, STEP * THETA
    np.testing.assert_allclose(stone.damping.toarray(), (alpha * m + beta * k).toarray(), rtol=1e-13)
    expected = (m + h * (alpha * m + beta * k) + h**2 * k).toarray()
    found = Compliance(stone, STEP, THETA).matrix.toarray()
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_an_even_push_moves_the_stone_as_a_whole(stone, response):
    # ŵ M e = e for a translation, since K e = 0
    push = np.outer(stone.weight, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(response.respond(push), np.tile([1.0, 2.0, 3.0], (len(push), 1)), rtol=1e-10)


def test_large_stones_are_factorised_by_dissection_with_the_same_answer(mesh, stone, response, monkeypatch):
    monkeypatch.setattr("mechanics.model.deformable._LARGE", 10)
    push = np.random.default_rng(3).normal(size=(len(mesh.nodes), 3))
    expected = response.respond(push)
    found = Compliance(stone, STEP, THETA).respond(push)
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def test_dissection_leaves_nothing_between_the_halves():
    """The nodes that part two halves come last, and no cell has nodes in both."""
    mesh = mesh_with_gmsh(box((0, 0, 0), (2.0, 0.6, 0.5)), BOX_FACES, 0.12, "A1")
    order = dissection(mesh)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(order)))
    along = mesh.nodes[:, 0]
    half = np.median(along)
    low = along < half
    cut = mesh.cells[low[mesh.cells].any(axis=1) & ~low[mesh.cells].all(axis=1)]
    parting = np.unique(cut[~low[cut]])
    np.testing.assert_array_equal(np.sort(order[-len(parting) :]), parting)
