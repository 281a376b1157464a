"""Stress of one stone from the displacement of its nodes, and its estimated error."""

import numpy as np

from mechanics.arrays import Array
from mechanics.stones.elasticity.operators import MASS_ORDER
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.meshing.shape_functions import Integration, integration

# order of the rule with the best stress at its points: centroid, four points of a tetrahedron, 2 × 2 × 2 (Barlow 1976)
SAMPLE_ORDER = {Element.TET4: 1, Element.TET10: 2, Element.HEX8: 1, Element.HEX20: 3, Element.HEX27: 3}


def sampled_stress(mesh: SolidMesh, material: Material, displacement: Array) -> Array:
    """Return the stress (nq, 6) at the superconvergent points of all cells, one cell after the other [Pa].

    Order xx, yy, zz, xy, yz, zx; from nodal displacement (n, 3) [m]. Linear and quadratic tetrahedra have 1 and 4
    points, linear and quadratic hexahedra 1 and 8.
    """
    rule = integration(mesh.element, mesh.nodes, mesh.cells, SAMPLE_ORDER[mesh.element])
    return _stress(rule, mesh, material, displacement).reshape(-1, 6)


def stress_error(mesh: SolidMesh, material: Material, displacement: Array, nodal_stress: Array) -> float:
    """Estimate the relative error of the stress in the energy norm (Zienkiewicz & Zhu 1987) [-].

    η = ‖e‖ / √(‖u‖² + ‖e‖²), ‖e‖² = ∫ (σ* - σ):C⁻¹(σ* - σ), ‖u‖² = ∫ σ:C⁻¹σ, with σ the stress of the elements and
    σ* the one interpolated from the recovered stress of the nodes (n, 6), both in the axes of the mesh. Zero without
    stress.
    """
    rule = integration(mesh.element, mesh.nodes, mesh.cells, MASS_ORDER[mesh.element])
    raw = _stress(rule, mesh, material, displacement)
    smooth = rule.value @ nodal_stress[mesh.cells]
    compliance = np.linalg.inv(material.stiffness)
    error, energy = (
        float(rule.volume.ravel() @ ((s @ compliance) * s).sum(axis=-1).ravel()) for s in (smooth - raw, raw)
    )
    return float(np.sqrt(error / (energy + error))) if energy + error > 0 else 0.0


def _stress(rule: Integration, mesh: SolidMesh, material: Material, displacement: Array) -> Array:
    """Return the stress (nc, nq, 6) at the points of a rule [Pa]."""
    cell = displacement[mesh.cells]
    # (cell, point, ∂_k, u_i); relative to the first node, because a far shift would lose digits
    slope = rule.gradient.transpose(0, 1, 3, 2) @ (cell - cell[:, :1])[:, None]
    sheared = slope + slope.transpose(0, 1, 3, 2)
    strain = np.stack(
        [*(slope[..., i, i] for i in range(3)), sheared[..., 0, 1], sheared[..., 1, 2], sheared[..., 2, 0]],
        axis=-1,
    )
    stress: Array = strain @ material.stiffness
    return stress
