"""Elastic bars and beams without contact: closed forms of columns and cantilevers, Cook's membrane.

Columns: VALIDATION F01 and F02. Cantilevers: F05, deflection P L³/3EI + P L/κGA with κ = 5/6 (Timoshenko), and F19, the
straight beam of MacNeal & Harder, Finite Elements in Analysis and Design 1 (1985) 3–20. Membrane of Cook: F06, 23.965
in the middle of the loaded edge in plane stress.
"""

import numpy as np
import pytest

from mechanics.stones.elasticity.recovery import recovery
from mechanics.stones.elasticity.stress import sampled_stress
from mechanics.stones.materials import Material, Orthotropy
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.solids import body_forces, facets_at, grid, norm, solve, strain, traction_forces

QUADRATIC = (Element.TET10, Element.HEX20, Element.HEX27)


def column(element, counts, poisson, sides):
    """Mesh, displacement and nodal stress of a cube of side 1 on rollers under its weight; sides free or on rollers."""
    material = Material("column", 2000.0, 1e9, poisson)
    mesh = grid(element, counts)
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[:, 2] = mesh.nodes[:, 2] < 1e-9
    for k in range(2):
        at = np.abs(mesh.nodes[:, k] - 0.5) > 0.5 - 1e-9 if sides else mesh.nodes[:, k] < 1e-9
        held[at, k] = True
    weight = np.array([0.0, 0.0, -2000.0 * 9.81])
    displacement = solve(mesh, material, body_forces(mesh, lambda x: np.broadcast_to(weight, x.shape)), held)
    return mesh, displacement, recovery(mesh) @ sampled_stress(mesh, material, displacement)


@pytest.mark.parametrize("element", [Element.HEX8, *QUADRATIC])
def test_column_under_its_weight_sinks_by_the_closed_form(element):
    mesh, displacement, _ = column(element, (1, 1, 4), 0.0, sides=False)
    z = mesh.nodes[:, 2]
    # u = -(ρg/2E)(2Lz - z²): at nodes exact for hexahedra of the first order, everywhere for the second
    np.testing.assert_allclose(displacement[:, 2], -9.81e-6 * (2 * z - z**2), rtol=1e-6, atol=1e-15)
    assert displacement[z > 1 - 1e-9, 2] == pytest.approx(-9.81e-6, rel=1e-6)


@pytest.mark.parametrize("element", [Element.HEX8, *QUADRATIC])
def test_stress_of_a_column_is_linear_up_to_its_base(element):
    mesh, _, stress = column(element, (1, 1, 4), 0.0, sides=False)
    np.testing.assert_allclose(stress[:, 2], -19620.0 * (1 - mesh.nodes[:, 2]), atol=1e-6 * 19620)
    np.testing.assert_allclose(stress[:, [0, 1, 3, 4, 5]], 0.0, atol=1e-6 * 19620)


def test_column_of_tetrahedra_of_the_first_order_converges_with_the_second_power():
    errors = []
    for n in (4, 8, 16):
        mesh, displacement, stress = column(Element.TET4, (n, n, n), 0.0, sides=False)

        def off(rule, mesh=mesh, displacement=displacement):
            z = rule.point[..., 2]
            return rule.value @ displacement[mesh.cells][..., 2:] + 9.81e-6 * (2 * z - z**2)[..., None]

        errors.append(norm(mesh, off, order=4) / 9.81e-6)
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(2.0, abs=0.1)
    # where a single tetrahedron makes the corner, the first power is left
    assert np.abs(stress[:, 2] / 19620 + 1 - mesh.nodes[:, 2]).max() < 0.02


@pytest.mark.parametrize("element", [Element.HEX8, *QUADRATIC])
def test_column_between_smooth_walls_sinks_and_pushes_by_the_closed_form(element):
    mesh, displacement, stress = column(element, (1, 1, 4), 0.2, sides=True)
    top = mesh.nodes[:, 2] > 1 - 1e-9
    assert displacement[top, 2] == pytest.approx(-8.829e-6, rel=1e-6)
    # K₀ = ν/(1 - ν)
    inside = mesh.nodes[:, 2] < 0.9
    np.testing.assert_allclose(stress[inside, 0] / stress[inside, 2], 0.25, rtol=1e-6)


def cantilever(element, counts, sides, young, poisson, force):
    """Mean displacement (3,) of the tip of a clamped beam, its mesh and nodal stress."""
    material, sides = Material("beam", 1.0, young, poisson), np.array(sides)
    mesh = grid(element, counts, lambda x: x * sides)
    root, tip = np.abs(mesh.nodes[:, 0]) < 1e-9, mesh.nodes[:, 0] > sides[0] * (1 - 1e-9)
    held = np.repeat(root[:, None], 3, axis=1)
    load = np.array(force) / (sides[1] * sides[2])
    facets = facets_at(mesh, lambda x: x[:, 0] > sides[0] * (1 - 1e-9))
    pull = traction_forces(mesh, facets, lambda x, normal: np.broadcast_to(load, x.shape))
    displacement = solve(mesh, material, pull, held)
    stress = recovery(mesh) @ sampled_stress(mesh, material, displacement)
    return displacement[tip].mean(axis=0), mesh, stress


def bent(element, counts):
    """VALIDATION F05, 10 × 1 × 1: deflection of the tip, stress on the surface at the root and half-way."""
    moved, mesh, stress = cantilever(element, counts, (10.0, 1, 1), 1e9, 0.0, (0, 0, 1e3))
    top = mesh.nodes[:, 2] > 1 - 1e-9
    root, half = (np.abs(stress[top & (np.abs(mesh.nodes[:, 0] - x) < 1e-6), 0]).mean() for x in (0.0, 5.0))
    return moved[2], root, half


COUNTS = {Element.TET10: (20, 2, 2), Element.HEX20: (8, 2, 2), Element.HEX27: (8, 2, 2)}


@pytest.mark.parametrize("element", QUADRATIC)
def test_cantilever_of_square_section_bends_as_timoshenko_says(element):
    deflection, root, half = bent(element, COUNTS[element])
    assert deflection == pytest.approx(0.004024, rel=0.02)
    assert half == pytest.approx(30000.0, rel=0.02)
    assert root == pytest.approx(60000.0, rel=0.02)


def test_four_quadratic_bricks_suffice_for_the_deflection_of_a_cantilever():
    for element in (Element.HEX20, Element.HEX27):
        assert bent(element, (4, 1, 1))[0] == pytest.approx(0.004024, rel=0.02)


@pytest.mark.parametrize("element", QUADRATIC)
def test_short_stiff_cantilever_bends_as_timoshenko_says(element):
    sides = (1.0, 0.1, 0.1)
    moved, mesh, stress = cantilever(element, COUNTS[element], sides, 30e9, 0.2, (0, 0, 1e3))
    assert moved[2] == pytest.approx(0.0013428, rel=0.02)
    half = (np.abs(mesh.nodes[:, 0] - 0.5) < 1e-9) & (mesh.nodes[:, 2] > 0.1 - 1e-9)
    assert np.abs(stress[half, 0]).mean() == pytest.approx(3.0e6, rel=0.02)


def test_bricks_of_the_first_order_are_too_stiff_in_bending_and_converge_with_the_second_power():
    # locked by shear: with one brick through the depth some tens of percent are lost
    errors = [1 - bent(Element.HEX8, (10 * n, n, n))[0] / 0.004024 for n in (1, 2, 4)]
    assert 0.1 < errors[0] < 0.5
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize("element", QUADRATIC)
@pytest.mark.parametrize(
    ("force", "expected"), [((0, 1, 0), 0.108094), ((0, 0, 1), 0.432094), ((1, 0, 0), 3.0e-5)], ids=str
)
def test_straight_beam_of_macneal_and_harder(element, force, expected):
    # 6 × 0.2 × 0.1, six bricks as in the paper
    counts = (12, 2, 1) if element.is_tetrahedron else (6, 1, 1)
    moved, _, _ = cantilever(element, counts, (6.0, 0.2, 0.1), 1e7, 0.3, force)
    assert moved[np.argmax(force)] == pytest.approx(expected, rel=0.05)


MEMBRANE = Material("membrane", 1.0, 1.0, 1 / 3)
# nothing across the plane: plane stress without a slab's narrowing, exact in three dimensions
PLANE = Material(
    "plane", 1.0, 1.0, 1 / 3, orthotropy=Orthotropy((1.0, 1.0, 1.0), (0.375, 0.5, 0.5), (1 / 3, 0.0, 0.0))
)


def cook(element, n, material=MEMBRANE, thickness=1.0):
    """Mean vertical displacement through the thickness in the middle of the loaded edge, for n × n elements."""
    corners = np.array([(0, 0), (48, 44), (48, 60), (0, 44)], dtype=float)

    def shape(x):
        a, b = x[:, :1], x[:, 1:2]
        plane = (
            (1 - a) * (1 - b) * corners[0]
            + a * (1 - b) * corners[1]
            + a * b * corners[2]
            + (1 - a) * b * corners[3]
        )
        return np.column_stack([plane, thickness * x[:, 2]])

    mesh = grid(element, (n, n, 1), shape)
    x, y, z = mesh.nodes.T
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[np.abs(x) < 1e-9, :2] = True
    held[np.abs(z) < 1e-9, 2] = True  # one of the two free sides of the slab is a plane of symmetry
    facets = facets_at(mesh, lambda p: p[:, 0] > 48 - 1e-9)
    load = traction_forces(mesh, facets, lambda p, normal: np.broadcast_to([0, 1 / 16, 0], p.shape))
    displacement = solve(mesh, material, load, held)
    return displacement[(x > 48 - 1e-9) & (np.abs(y - 52) < 1e-6), 1].mean()


@pytest.mark.parametrize("element", QUADRATIC)
def test_membrane_of_cook(element):
    assert cook(element, 8) == pytest.approx(23.965, rel=0.01)


def test_membrane_of_cook_with_bricks_of_the_first_order_converges_from_below():
    found = [cook(Element.HEX8, n) for n in (8, 16, 32)]
    assert found == sorted(found)
    assert found[-1] == pytest.approx(23.965, rel=0.01)


@pytest.mark.parametrize("element", QUADRATIC)
def test_membrane_of_cook_in_exact_plane_stress_converges_from_below(element):
    # no faster than h^1.35, whatever the order: the obtuse clamped corner is singular (Williams 1952, λ = 0.677)
    found = [cook(element, n, PLANE) for n in (8, 16, 32)]
    assert found == sorted(found)
    assert found[-1] == pytest.approx(23.965, rel=1e-3)


def clamped_end(x):
    """Cantilever 4 × 1 × 1, E = 1, ν = 0, clamped at x = 0, sheared at its end: displacement and stress (…, 6).

    Timoshenko & Goodier, Theory of Elasticity, §21, without Poisson's effect, exact in three dimensions.
    """
    length, depth = 4.0, 0.5
    a, y = x[..., 0], x[..., 1] - depth
    zero = np.zeros_like(a)
    moved = np.stack(
        [
            -y * (length * a - a**2 / 2) + depth**2 * y - y**3 / 3,
            length * a**2 / 2 - a**3 / 6,
            zero,
        ],
        axis=-1,
    )
    stress = np.stack([-(length - a) * y, zero, zero, (depth**2 - y**2) / 2, zero, zero], axis=-1)
    return moved, stress


@pytest.mark.parametrize("element", [Element.TET4, Element.HEX8, *QUADRATIC])
def test_cantilever_converges_at_the_theoretical_rates(element):
    material = Material("beam", 1.0, 1.0, 0.0)
    errors = []
    for n in (6, 12) if element.order == 1 else (2, 4):
        mesh = grid(element, (4 * n, n, n), lambda x: x * [4.0, 1, 1])
        held = np.repeat((mesh.nodes[:, 0] < 1e-9)[:, None], 3, axis=1)
        end = facets_at(mesh, lambda x: x[:, 0] > 4.0 - 1e-9)
        load = traction_forces(mesh, end, lambda x, _: clamped_end(x)[1][..., [0, 3, 5]])
        found = solve(mesh, material, load, held, clamped_end(mesh.nodes)[0])

        def off(rule, mesh=mesh, found=found):
            return rule.value @ found[mesh.cells] - clamped_end(rule.point)[0]

        def stress_off(rule, mesh=mesh, found=found):
            return strain(rule, mesh, found) @ material.stiffness - clamped_end(rule.point)[1]

        errors.append((norm(mesh, off), norm(mesh, stress_off, matrix=np.linalg.inv(material.stiffness))))
    displacement, stress = np.log2(np.array(errors[0]) / errors[1])
    # the solution is of the third order only, and what is beyond the element's is small: faster is no surprise
    assert displacement > element.order + 1 - 0.15
    assert stress == pytest.approx(element.order, abs=0.15)
