"""One elastic stone: its frame, its compliance."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.bodies.deformable import body_frame, deformable, dynamic_compliance
from mechanics.elasticity import from_voigt, von_mises
from mechanics.meshing.gmsh_mesher import mesh_with_gmsh
from tests.mechanics.shapes import LIMESTONE, TURN
from tests.pipelines.handmade import BOX_FACES, box

STEP, THETA = 1e-3, 0.7


@pytest.fixture(scope="module")
def mesh():
    return mesh_with_gmsh(box((0, 0, 0), (0.8, 0.5, 0.6)) @ TURN.T + 3.0, BOX_FACES, 0.35, "A1")


@pytest.fixture(scope="module")
def stone(mesh):
    return deformable(mesh, LIMESTONE)[0]


@pytest.fixture(scope="module")
def compliance(stone):
    return dynamic_compliance(stone, STEP, THETA)


def test_centre_is_that_of_the_mass(mesh):
    stone, centre = deformable(mesh, LIMESTONE)
    np.testing.assert_allclose(centre, np.array([0.4, 0.25, 0.3]) @ TURN.T + 3.0, atol=1e-12)
    np.testing.assert_allclose(stone.operators.nodal_mass @ stone.mesh.nodes, 0, atol=1e-10)
    np.testing.assert_array_equal(stone.surface, np.unique(mesh.facets))


vector = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3)


@settings(max_examples=30, deadline=None)
@given(vector, vector)
def test_body_frame_recovers_a_rigid_motion_exactly(stone, turn, shift):
    turn = Rotation.from_rotvec(turn).as_matrix()
    centre, rotation = body_frame(stone, stone.mesh.nodes @ turn.T + shift)
    np.testing.assert_allclose(centre, shift, atol=1e-13)
    np.testing.assert_allclose(rotation, turn, atol=1e-13)


def test_body_frame_of_a_mirrored_cloud_is_still_a_rotation(stone):
    _, rotation = body_frame(stone, stone.mesh.nodes * [1, 1, -1])
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-12)


def test_turning_a_stone_by_a_right_angle_stresses_nothing(stone):
    turn = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    node = stone.mesh.nodes @ turn.T + [5.0, 6.0, 7.0]
    centre, rotation = body_frame(stone, node)
    assert von_mises(stone.stress(node, centre, rotation)).max() < 1e-12 * LIMESTONE.young
    assert stone.elastic_energy(node, centre, rotation) < 1e-20 * LIMESTONE.young
    # without the frame the same turn would strain it by more than 1
    assert np.abs(stone.displacement(node, centre, np.eye(3))).max() > 0.5


def test_stress_of_a_squeezed_and_turned_stone_turns_with_it(stone):
    strain, turn = 1e-5, Rotation.from_rotvec([1.0, 2.0, 0.5]).as_matrix()
    # free sideways, σ = E ε along a side of the box, which the fixture has turned by TURN
    stretch = np.diag([1 + strain, 1 - LIMESTONE.poisson * strain, 1 - LIMESTONE.poisson * strain])
    node = stone.mesh.nodes @ (turn @ TURN @ stretch @ TURN.T).T + 1.0
    centre, rotation = body_frame(stone, node)
    np.testing.assert_allclose(rotation, turn, atol=strain)
    side = turn @ TURN[:, 0]
    expected = LIMESTONE.young * strain * np.outer(side, side)
    found = from_voigt(stone.stress(node, centre, rotation))
    # linear in a frame that may be off by a part of ε
    atol = 10 * strain * LIMESTONE.young * strain
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=atol)
    # ½ E ε² V
    energy = 0.5 * LIMESTONE.young * strain**2 * 0.8 * 0.5 * 0.6
    assert stone.elastic_energy(node, centre, rotation) == pytest.approx(energy, rel=10 * strain)


def test_response_is_the_inverse_of_m_plus_h2_theta2_k(stone, compliance):
    full = stone.operators.mass + (STEP * THETA) ** 2 * stone.operators.stiffness
    np.testing.assert_allclose(compliance.matrix.toarray(), full.toarray(), rtol=1e-14)
    size = full.shape[0]
    inverse = np.column_stack([compliance.respond(p.reshape(-1, 3)).ravel() for p in np.eye(size)])
    np.testing.assert_allclose(inverse @ full.toarray(), np.eye(size), atol=1e-10)


def test_surface_compliance_is_the_inverse_seen_from_the_surface(stone, compliance):
    inverse = np.linalg.inv(compliance.matrix.toarray())
    dofs = (3 * stone.surface[:, None] + np.arange(3)).ravel()
    expected = inverse[np.ix_(dofs, dofs)]
    np.testing.assert_allclose(compliance.surface, expected, atol=1e-11 * np.abs(expected).max())
    np.testing.assert_array_equal(compliance.surface, compliance.surface.T)
    assert np.linalg.eigvalsh(compliance.surface)[0] > 0


def test_an_even_push_moves_the_stone_as_a_whole(stone, compliance):
    # ŵ M e = e for a translation, since K e = 0
    push = np.outer(stone.operators.nodal_mass, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(compliance.respond(push), np.tile([1.0, 2.0, 3.0], (len(push), 1)), rtol=1e-10)
