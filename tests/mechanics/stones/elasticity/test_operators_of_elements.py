"""Mass, stiffness, stress and error estimate of all elements, against the weak forms in scikit-fem and closed forms."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.spatial.transform import Rotation
from skfem.helpers import ddot, dot, sym_grad

from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.elasticity.operators import elastic_operators, node_volumes
from mechanics.stones.elasticity.recovery import recovery
from mechanics.stones.elasticity.stress import sampled_stress, stress_error
from mechanics.stones.elasticity.tensors import to_voigt
from mechanics.stones.materials import Material, Orthotropy, fourth_order
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import boundary_facets
from mechanics.stones.meshing.meshers.mesher import mesh_block
from mechanics.stones.polyhedra import mass_properties
from tests.mechanics.shapes import LIMESTONE
from tests.pipelines.results_by_hand import box

EACH = pytest.mark.parametrize("element", list(Element))
SKFEM = {
    Element.TET4: (skfem.MeshTet, skfem.ElementTetP1, 2),
    Element.TET10: (skfem.MeshTet, skfem.ElementTetP2, 4),
    Element.HEX8: (skfem.MeshHex, skfem.ElementHex1, 5),
    Element.HEX20: (skfem.MeshHex, skfem.ElementHexS2, 7),
    Element.HEX27: (skfem.MeshHex, skfem.ElementHex2, 7),
}
_AXES = tuple(map(tuple, Rotation.from_rotvec([0.3, -1.0, 0.6]).as_matrix().tolist()))
BEDDED = Material(
    "bedded",
    1900.0,
    1e9,
    0.2,
    orthotropy=Orthotropy((12e9, 10e9, 6e9), (4e9, 2.5e9, 3e9), (0.2, 0.25, 0.1), _AXES),
)
# a box seen through a projective map: planar faces, no two edges alike
CORNERS = box((-0.4, -0.3, -0.2), (0.4, 0.3, 0.2))
CORNERS = CORNERS / (1.0 + CORNERS @ [0.3, -0.2, 0.4])[:, None]


def leaning(element, size=0.3):
    return mesh_block(Block("L1", CORNERS, BOX_FACES, LIMESTONE, Fidelity.DEFORMABLE, size, element))


def basis_of(mesh, order):
    """scikit-fem's own basis on the mesh, and for each of its unknowns the number that it has here."""
    kind, element, _ = SKFEM[mesh.element]
    corners = mesh.cells[:, : mesh.element.corners]
    if not mesh.element.is_tetrahedron:
        local = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        places = skfem.ElementHex1().doflocs.astype(int).tolist()
        corners = corners[:, [local.index(tuple(place)) for place in places]]
    used, number = np.unique(corners, return_inverse=True)
    own = kind(mesh.nodes[used].T.copy(), number.reshape(corners.shape).T.astype(np.int64).copy())
    basis = skfem.Basis(own, skfem.ElementVector(element()), intorder=order)
    distance = np.linalg.norm(basis.doflocs.T[:, None] - mesh.nodes, axis=2)
    assert distance.min(axis=1).max() < 1e-12
    direction = np.zeros(basis.N, dtype=int)
    for k, name in enumerate(("u^1", "u^2", "u^3")):
        direction[basis.get_dofs(elements=True).all(name)] = k
    return basis, 3 * distance.argmin(axis=1) + direction


def weak_forms(material, gravity):
    """∫ ρ u·v, ∫ (c : ε(u)) : ε(v) and ∫ ρ g·v."""
    elasticity = fourth_order(material.stiffness)

    @skfem.BilinearForm
    def mass(u, v, _):
        return material.density * dot(u, v)

    @skfem.BilinearForm
    def stiffness(u, v, _):
        stress = np.einsum("ijkl,kl...->ij...", elasticity, sym_grad(u))
        return ddot(stress, sym_grad(v))

    @skfem.LinearForm
    def weight(v, _):
        return material.density * np.einsum("i,i...->...", gravity, v)

    return mass, stiffness, weight


def assembled(form, mesh, order):
    """A form that scikit-fem assembles by a rule of an order, rows and columns in our order of the unknowns."""
    basis, number = basis_of(mesh, order)
    back, found = np.argsort(number), form.assemble(basis)
    return found[back][:, back] if found.ndim == 2 else found[back]


def single_cells(mesh):
    """Each cell of a mesh as a mesh of its own."""
    own = np.arange(mesh.element.cell_nodes)[None]
    facets = boundary_facets(mesh.element, own)
    for cell in mesh.cells:
        yield replace(
            mesh, nodes=mesh.nodes[cell], cells=own, facets=facets, facet_face=np.arange(len(facets))
        )


@EACH
@pytest.mark.parametrize("material", [LIMESTONE, BEDDED], ids=lambda m: m.name)
def test_operators_are_the_weak_forms_that_scikit_fem_assembles(element, material):
    whole = leaning(element)
    mass_order = SKFEM[element][2]
    stiffness_order = {Element.TET10: 2, Element.HEX8: 3, Element.HEX20: 5, Element.HEX27: 5}.get(element, 1)
    gravity = np.array([1.0, -2.0, -9.81])
    mass, stiffness, weight = weak_forms(material, gravity)
    for mesh in (whole, *itertools.islice(single_cells(whole), 2)):
        operators = elastic_operators(mesh, material)
        for found, expected in (
            (operators.mass, assembled(mass, mesh, mass_order)),
            (operators.stiffness, assembled(stiffness, mesh, stiffness_order)),
            (np.outer(operators.nodal_mass, gravity).ravel(), assembled(weight, mesh, mass_order)),
        ):
            assert abs(found - expected).max() < 1e-12 * abs(expected).max()


@EACH
def test_masses_are_those_of_the_stone(element):
    mesh = leaning(element)
    consistent, lumped = (elastic_operators(mesh, LIMESTONE, lumped=flag) for flag in (False, True))
    volumes = node_volumes(mesh)
    stone = mass_properties(CORNERS, BOX_FACES)
    mass = LIMESTONE.density * stone.volume
    ones = np.tile(np.eye(3), (len(mesh.nodes), 1))
    for operators in (consistent, lumped):
        np.testing.assert_allclose(ones.T @ operators.mass @ ones, mass * np.eye(3), atol=1e-11 * mass)
        assert operators.nodal_mass.sum() == pytest.approx(mass, rel=1e-12)
        # the body force acts at the centre of mass
        np.testing.assert_allclose(operators.nodal_mass @ mesh.nodes / mass, stone.centroid, atol=1e-12)
    assert np.linalg.eigvalsh(consistent.mass.toarray())[0] > 0
    assert lumped.mass.nnz == 3 * len(mesh.nodes)
    diagonal = lumped.mass.diagonal().reshape(-1, 3)
    assert diagonal.min() > 0
    np.testing.assert_allclose(diagonal, LIMESTONE.density * volumes[:, None] * np.ones(3), rtol=1e-12)
    assert volumes.sum() == pytest.approx(stone.volume, rel=1e-12)


@pytest.mark.parametrize("element", [Element.TET10, Element.HEX20])
def test_weight_of_the_corners_of_quadratic_elements_points_upwards(element):
    # Hughes 1987, §7.3: ∫N of a corner is nothing for a tetrahedron's inside, negative for a brick's
    assert elastic_operators(leaning(element), LIMESTONE).nodal_mass.min() < 1e-12


@EACH
@pytest.mark.parametrize("material", [LIMESTONE, BEDDED], ids=lambda m: m.name)
def test_energy_of_a_uniform_strain(element, material):
    mesh = leaning(element)
    operators = elastic_operators(mesh, material)
    gradient = 1e-4 * np.array([[1.0, -2.0, 0.5], [0.3, -0.7, 1.1], [-0.4, 0.9, 2.0]])
    displacement = mesh.nodes @ gradient.T
    strain = to_voigt(gradient + gradient.T) * [0.5, 0.5, 0.5, 1, 1, 1]
    stress = material.stiffness @ strain
    volume = node_volumes(mesh).sum()
    energy = displacement.ravel() @ operators.stiffness @ displacement.ravel()
    assert energy == pytest.approx(strain @ stress * volume, rel=1e-12)
    found = sampled_stress(mesh, material, displacement)
    np.testing.assert_allclose(found, np.tile(stress, (len(found), 1)), atol=1e-10 * np.abs(stress).max())


@EACH
def test_far_from_the_origin_nothing_is_lost(element):
    mesh = leaning(element)
    far = replace(mesh, nodes=mesh.nodes + 1e4)
    near, away = (elastic_operators(one, LIMESTONE).stiffness for one in (mesh, far))
    assert abs(near - away).max() < 1e-9 * abs(near).max()


@EACH
def test_estimate_of_the_error_is_the_distance_of_two_stresses_in_the_energy_norm(element):
    # a uniform stress s of the elements, nodal stress (1 + a) s: η² = a²/(1 + a²)
    mesh = leaning(element)
    displacement = mesh.nodes @ np.diag([1e-4, -0.5e-4, 2e-4])
    nodal = recovery(mesh) @ sampled_stress(mesh, BEDDED, displacement)
    assert stress_error(mesh, BEDDED, displacement, nodal) < 1e-12
    assert stress_error(mesh, BEDDED, displacement, 1.3 * nodal) == pytest.approx(
        0.3 / np.sqrt(1.09), rel=1e-10
    )
    nothing = np.zeros_like(displacement)
    assert stress_error(mesh, BEDDED, nothing, np.zeros((len(nothing), 6))) == 0.0


@EACH
def test_large_stones_are_assembled_in_parts(element, monkeypatch):
    mesh = leaning(element)
    whole = elastic_operators(mesh, BEDDED).stiffness
    assert len(mesh.cells) >= 4
    monkeypatch.setattr("mechanics.stones.elasticity.operators._PAIRS_AT_ONCE", 3 * element.cell_nodes**2)
    parts = elastic_operators(mesh, BEDDED).stiffness
    assert abs(whole - parts).max() < 1e-14 * abs(whole).max()
    for matrix in (whole, parts):
        assert abs(matrix - matrix.T).max() == 0.0
