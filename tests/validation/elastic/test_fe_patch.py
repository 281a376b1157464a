"""Elements without contact: patch tests on distorted meshes, rigid motions, masses.

Patch test of MacNeal & Harder, Finite Elements in Analysis and Design 1 (1985) 3–20, for solids: a unit cube of seven
irregular hexahedra, E = 10⁶, ν = 0.25, u = 10⁻³ (2x + y + z)/2 and cyclic: normal stresses 2000, shear stresses 400.
Tolerance 1e-10, relative: linear displacements are among the shape functions of every element.
"""

import numpy as np
import pytest
from scipy.linalg import eigh

from mechanics.stones.elasticity.operators import elastic_operators
from mechanics.stones.elasticity.recovery import recovery
from mechanics.stones.elasticity.stress import sampled_stress, stress_error
from mechanics.stones.elasticity.tensors import von_mises
from mechanics.stones.materials import Material
from mechanics.stones.meshing.shape_functions import integration
from tests.validation.elastic.solids import ELEMENTS, facets_at, grid, shaken, solid, solve, traction_forces

MATERIAL = Material("patch", density=2.0, young=1e6, poisson=0.25)
GRADIENT = 0.5e-3 * (np.ones((3, 3)) + np.eye(3))
STRESS = np.array([2000.0, 2000, 2000, 400, 400, 400])
OUTER = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=float
)
INNER = np.array(
    [
        (0.249, 0.342, 0.192),
        (0.826, 0.288, 0.288),
        (0.850, 0.649, 0.263),
        (0.273, 0.750, 0.230),
        (0.320, 0.186, 0.643),
        (0.677, 0.305, 0.683),
        (0.788, 0.693, 0.644),
        (0.165, 0.745, 0.702),
    ]
)
SIDES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
BOTH = pytest.mark.parametrize("element", ELEMENTS)


def patch(element):
    """The seven hexahedra, or each of them cut into 24 tetrahedra about its centre."""
    nodes = np.vstack([OUTER, INNER])
    # between each side of the cube, seen from inside, and that of the inner cell
    cells = np.array([tuple(range(8, 16)), *((*side[::-1], *(8 + s for s in side[::-1])) for side in SIDES)])
    if not element.is_tetrahedron:
        return solid(element, nodes, cells)
    places, number, tetrahedra = [*nodes], {}, []

    def middle(corners):
        key = tuple(sorted(corners))
        if key not in number:
            number[key] = len(places)
            places.append(nodes[list(corners)].mean(axis=0))
        return number[key]

    for cell in cells.tolist():
        for side in SIDES:
            ring = [cell[s] for s in side]
            for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
                tetrahedra.append((a, middle(ring), b, middle(cell)))
    return solid(element, np.array(places), np.array(tetrahedra))


def assert_uniform(mesh, displacement):
    exact = mesh.nodes @ GRADIENT.T
    np.testing.assert_allclose(displacement, exact, atol=1e-10 * np.abs(exact).max())
    stress = sampled_stress(mesh, MATERIAL, displacement)
    np.testing.assert_allclose(stress, np.tile(STRESS, (len(stress), 1)), rtol=1e-10)
    nodal = recovery(mesh) @ stress
    np.testing.assert_allclose(nodal, np.tile(STRESS, (len(nodal), 1)), rtol=1e-10)
    assert stress_error(mesh, MATERIAL, displacement, nodal) < 1e-10


@BOTH
def test_displacements_of_the_boundary_give_a_uniform_stress(element):
    mesh = patch(element)
    # one corner of one of these hexahedra is turned inside out, but no point of integration
    assert integration(mesh.element, mesh.nodes, mesh.cells, 5).volume.min() > 0
    on = np.isin(np.arange(len(mesh.nodes)), mesh.facets)
    assert (~on).sum() >= 8
    held = np.repeat(on[:, None], 3, axis=1)
    assert_uniform(mesh, solve(mesh, MATERIAL, np.zeros(mesh.nodes.shape), held, mesh.nodes @ GRADIENT.T))


@BOTH
@pytest.mark.parametrize("make", [patch, lambda element: grid(element, (3, 2, 2), shaken((3, 2, 2), 0.25))])
def test_tractions_on_the_boundary_give_a_uniform_stress(element, make):
    mesh = make(element)
    tensor = STRESS[[[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
    force = traction_forces(mesh, mesh.facets, lambda x, normal: normal @ tensor)
    # six displacements hold the cube: of one corner all, of a second two, of a third one
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    for place, directions in (((0, 0, 0), (0, 1, 2)), ((1, 0, 0), (1, 2)), ((0, 1, 0), (2,))):
        node = np.flatnonzero((np.abs(mesh.nodes - place) < 1e-9).all(axis=1))[0]
        held[node, list(directions)] = True
    assert_uniform(mesh, solve(mesh, MATERIAL, force, held, mesh.nodes @ GRADIENT.T))


@BOTH
@pytest.mark.parametrize("lumped", [False, True])
def test_a_free_stone_has_six_motions_without_stress(element, lumped):
    # VALIDATION F03: the first six eigenvalues below 1e-8 of the seventh
    mesh = patch(element)
    operators = elastic_operators(mesh, MATERIAL, lumped)
    values = eigh(operators.stiffness.toarray(), operators.mass.toarray(), eigvals_only=True)
    assert np.abs(values[:6]).max() < 1e-8 * values[6]


@BOTH
def test_the_stress_of_small_strains_under_a_turn_is_what_the_engine_has_to_avoid(element):
    # VALIDATION F03: E (1 - cos θ)/(1 + ν) by a turn of 1°, E = 10¹⁰, ν = 0.2: 1.2692e6 Pa
    material = Material("turned", 2000.0, 1e10, 0.2)
    mesh = grid(element, (1, 1, 1))
    angle = np.radians(1.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    stress = sampled_stress(mesh, material, mesh.nodes @ turn.T - mesh.nodes)
    np.testing.assert_allclose(von_mises(stress), 1.2692e6, rtol=1e-4)


@BOTH
def test_a_uniform_pressure_pushes_each_face_with_its_area(element):
    mesh = patch(element)
    facets = facets_at(mesh, lambda x: x[:, 2] > 1 - 1e-9)
    force = traction_forces(mesh, facets, lambda x, normal: -3.0 * normal)
    np.testing.assert_allclose(force.sum(axis=0), (0, 0, -3.0), atol=1e-13)
