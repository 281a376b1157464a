"""Linear elasticity: patch test, rigid modes, masses, stresses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.elasticity.operators import elastic_operators
from mechanics.stones.elasticity.recovery import recovery
from mechanics.stones.elasticity.stress import sampled_stress
from mechanics.stones.elasticity.tensors import from_voigt, to_voigt, von_mises
from mechanics.stones.meshing.mesh import tet_mesh
from mechanics.stones.meshing.meshers.gmsh import mesh_with_gmsh
from tests.mechanics.shapes import LIMESTONE, TETRAHEDRON_FACES, TURN
from tests.pipelines.results_by_hand import box, box_mesh

LAME = LIMESTONE.young * LIMESTONE.poisson / ((1 + LIMESTONE.poisson) * (1 - 2 * LIMESTONE.poisson))
SHEAR = LIMESTONE.young / (2 * (1 + LIMESTONE.poisson))
GRADIENT = 1e-4 * np.array([[1.0, -2.0, 0.5], [0.3, -0.7, 1.1], [-0.4, 0.9, 2.0]])


@pytest.fixture(scope="module")
def mesh():
    return mesh_with_gmsh(box((0, 0, 0), (0.8, 0.5, 0.6)) @ TURN.T + 1.0, BOX_FACES, 0.2, "A1")


@pytest.fixture(scope="module")
def operators(mesh):
    return elastic_operators(mesh, LIMESTONE)


def hooke(gradient):
    strain = 0.5 * (gradient + gradient.T)
    return 2 * SHEAR * strain + LAME * np.trace(strain) * np.eye(3)


def rigid_modes(nodes):
    """Six columns: three translations, three rotations about the mean point."""
    x = nodes - nodes.mean(axis=0)
    turns = [np.cross(axis, x).ravel() for axis in np.eye(3)]
    return np.column_stack([*(np.tile(axis, len(x)) for axis in np.eye(3)), *turns])


def test_linear_displacement_gives_constant_stress_and_no_force_inside(mesh, operators):
    displacement = mesh.nodes @ GRADIENT.T + 0.01
    stress = hooke(GRADIENT)
    found = sampled_stress(mesh, LIMESTONE, displacement)
    np.testing.assert_allclose(found, np.tile(to_voigt(stress), (len(found), 1)), atol=1e-10 * stress.max())
    force = (operators.stiffness @ displacement.ravel()).reshape(-1, 3)
    inside = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.facets)
    assert len(inside) >= 3
    assert np.abs(force[inside]).max() < 1e-10 * np.abs(force).max()


def test_surface_forces_of_a_linear_displacement_are_the_tractions(mesh, operators):
    # each triangle passes a third of σ n A to each corner
    force = (operators.stiffness @ (mesh.nodes @ GRADIENT.T).ravel()).reshape(-1, 3)
    a, b, c = (mesh.nodes[mesh.facets[:, k]] for k in range(3))
    traction = 0.5 * np.cross(b - a, c - a) @ hooke(GRADIENT) / 3
    expected = np.zeros_like(force)
    for k in range(3):
        np.add.at(expected, mesh.facets[:, k], traction)
    np.testing.assert_allclose(force, expected, atol=1e-10 * np.abs(expected).max())


def test_stiffness_is_symmetric_and_knows_exactly_six_rigid_modes(mesh, operators):
    stiffness = operators.stiffness.toarray()
    largest = np.linalg.norm(stiffness, 2)
    assert np.abs(stiffness - stiffness.T).max() < 1e-13 * largest
    assert np.abs(stiffness @ rigid_modes(mesh.nodes)).max() < 1e-12 * largest
    eigenvalues = np.linalg.eigvalsh(stiffness)
    assert np.abs(eigenvalues[:6]).max() < 1e-8 * largest
    assert eigenvalues[6] > 1e-5 * largest


def test_mass_is_that_of_the_stone_and_positive_definite(mesh, operators):
    total = LIMESTONE.density * 0.8 * 0.5 * 0.6
    assert operators.nodal_mass.sum() == pytest.approx(total, rel=1e-12)
    assert operators.nodal_mass.min() > 0
    mass = operators.mass.toarray()
    assert np.linalg.eigvalsh(mass)[0] > 0
    # ½ vᵀ M v of a rigid rotation is ½ ω·I ω of the box
    modes = rigid_modes(mesh.nodes)
    x = mesh.nodes.mean(axis=0) - (np.array([0.4, 0.25, 0.3]) @ TURN.T + 1.0)
    sides = np.array([0.8, 0.5, 0.6])
    inertia = total / 12 * np.diag((sides**2).sum() - sides**2)
    inertia = TURN @ inertia @ TURN.T + total * (x @ x * np.eye(3) - np.outer(x, x))
    np.testing.assert_allclose(modes[:, 3:].T @ mass @ modes[:, 3:], inertia, atol=1e-11 * total)


def test_recovery_is_exact_for_stresses_that_vary_linearly(mesh):
    weights = recovery(mesh)
    centroids = mesh.nodes[mesh.cells].mean(axis=1)
    field = np.array([3.0, -1.0, 2.0])
    np.testing.assert_allclose(weights @ (centroids @ field + 5), mesh.nodes @ field + 5, rtol=1e-9)


def one_tetrahedron():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return tet_mesh(corners, np.array([[0, 1, 2, 3]]), corners, TETRAHEDRON_FACES, "A1")


def six_tetrahedra():
    """A cube cut along one diagonal; the six centroids lie on one plane."""
    nodes, tetrahedra = box_mesh((0, 0, 0), (1, 1, 1), 1.0)
    return tet_mesh(nodes, tetrahedra, box((0, 0, 0), (1, 1, 1)), BOX_FACES, "A1")


@pytest.mark.parametrize("coarse", [one_tetrahedron, six_tetrahedra])
def test_recovery_keeps_a_constant_stress_on_the_coarsest_meshes(coarse):
    np.testing.assert_allclose(recovery(coarse()).sum(axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("stress", "expected"),
    [
        ((7.0, 0, 0, 0, 0, 0), 7.0),  # uniaxial
        ((0, -7.0, 0, 0, 0, 0), 7.0),
        ((-4.0, -4.0, -4.0, 0, 0, 0), 0.0),  # hydrostatic
        ((0, 0, 0, 3.0, 0, 0), np.sqrt(3) * 3),  # pure shear
        ((0, 0, 0, 0, 3.0, 0), np.sqrt(3) * 3),
        ((0, 0, 0, 0, 0, -3.0), np.sqrt(3) * 3),
        ((5.0, 5.0, 0, 0, 0, 0), 5.0),  # equal biaxial
    ],
)
def test_von_mises_of_states_known_by_heart(stress, expected):
    assert von_mises(np.array(stress)) == pytest.approx(expected, abs=1e-12)


numbers = st.lists(st.floats(-1e7, 1e7), min_size=6, max_size=6).map(np.array)
vectors = st.lists(st.floats(-3, 3), min_size=3, max_size=3)


@settings(max_examples=50, deadline=None)
@given(numbers, vectors)
def test_von_mises_does_not_change_under_rotation_nor_pressure(stress, vector):
    turn = Rotation.from_rotvec(vector).as_matrix()
    turned = to_voigt(turn @ (from_voigt(stress) + 1e6 * np.eye(3)) @ turn.T)
    size = np.abs(stress).max() + 1e6
    assert von_mises(turned) == pytest.approx(float(von_mises(stress)), abs=1e-7 * size)


@settings(max_examples=20, deadline=None)
@given(numbers)
def test_voigt_and_back(stress):
    tensor = from_voigt(stress)
    np.testing.assert_array_equal(tensor, tensor.T)
    np.testing.assert_array_equal(to_voigt(tensor), stress)
    np.testing.assert_array_equal(np.diag(tensor), stress[:3])
    assert (tensor[0, 1], tensor[1, 2], tensor[2, 0]) == tuple(stress[3:])
