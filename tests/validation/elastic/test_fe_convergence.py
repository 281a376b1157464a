"""Rates of convergence to a smooth manufactured solution, and of the estimate of the error.

For elements of order p the displacement converges as h^(p+1) in the L2 norm, the stress as h^p in the energy norm
(Strang & Fix 1973); the recovered stress converges faster, so that the estimate over the true error, its effectivity,
tends to one (Zienkiewicz & Zhu 1992; Ainsworth & Oden 2000, §4). The cells of the hexahedra are distorted by a smooth
map, and tend to parallelepipeds as they shrink. Tetrahedra of the second order have no superconvergent points: their
estimate stays some percent low.
"""

import functools

import numpy as np
import pytest

from mechanics.stones.elasticity.recovery import recovery
from mechanics.stones.elasticity.stress import sampled_stress, stress_error
from mechanics.stones.materials import Material, Orthotropy
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.solids import ELEMENTS, Waves, body_forces, distorted, grid, norm, solve, strain

ISOTROPIC = Material("waves", 1.0, 1.0, 0.3)
_AXES = ((0.8, 0.6, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0))
BEDDED = Material(
    "bedded", 1.0, 1.0, 0.3, orthotropy=Orthotropy((3, 1, 2), (0.5, 0.8, 0.4), (0.3, 0.1, 0.2), _AXES)
)
SIZES = {
    Element.TET4: (6, 12),
    Element.TET10: (3, 6),
    Element.HEX8: (6, 12),
    Element.HEX20: (4, 8),
    Element.HEX27: (3, 6),
}


@functools.cache
def errors(element, n, material):
    """Relative errors of displacement (L2), stress and recovered stress (energy); the estimate; the worst node."""
    waves = Waves(material)
    mesh = grid(element, (n, n, n), distorted(0.04))
    on = np.isin(np.arange(len(mesh.nodes)), mesh.facets)
    held = np.repeat(on[:, None], 3, axis=1)
    found = solve(mesh, material, body_forces(mesh, waves.body_force), held, waves.displacement(mesh.nodes))
    nodal = recovery(mesh) @ sampled_stress(mesh, material, found)
    compliance = np.linalg.inv(material.stiffness)
    whole = norm(mesh, lambda rule: waves.stress(rule.point), matrix=compliance)
    return np.array(
        [
            norm(mesh, lambda rule: rule.value @ found[mesh.cells] - waves.displacement(rule.point))
            / norm(mesh, lambda rule: waves.displacement(rule.point)),
            norm(
                mesh,
                lambda rule: strain(rule, mesh, found) @ material.stiffness - waves.stress(rule.point),
                matrix=compliance,
            )
            / whole,
            norm(
                mesh,
                lambda rule: rule.value @ nodal[mesh.cells] - waves.stress(rule.point),
                matrix=compliance,
            )
            / whole,
            stress_error(mesh, material, found, nodal),
            np.abs(nodal - waves.stress(mesh.nodes)).max() / np.abs(waves.stress(mesh.nodes)).max(),
        ]
    )


def slopes(element, material=ISOTROPIC):
    coarse, fine = SIZES[element]
    return np.log(errors(element, coarse, material) / errors(element, fine, material)) / np.log(fine / coarse)


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("material", [ISOTROPIC, BEDDED], ids=lambda m: m.name)
def test_displacement_and_stress_converge_at_the_theoretical_rates(element, material):
    displacement, stress, *_ = slopes(element, material)
    assert displacement == pytest.approx(element.order + 1, abs=0.15)
    assert stress == pytest.approx(element.order, abs=0.15)


@pytest.mark.parametrize("element", ELEMENTS)
def test_recovered_stress_converges_faster_than_that_of_the_elements(element):
    assert slopes(element)[2] > element.order + 0.4
    raw, recovered = errors(element, SIZES[element][1], ISOTROPIC)[1:3]
    assert recovered < 0.6 * raw


@pytest.mark.parametrize("element", ELEMENTS)
def test_the_estimated_error_is_the_true_one(element):
    _, true, _, estimate, _ = errors(element, SIZES[element][1], ISOTROPIC)
    assert estimate / true == pytest.approx(1.0, abs=0.08 if element is Element.TET10 else 0.05)
