"""One elastic stone: finite elements in a frame that follows its mean motion (co-rotation).

In body axes, with d the displacement of the nodes from the undeformed stone, the θ-scheme reads

    v_free = v + ŵ [ -h K (d + h θ v) + h P ],     ŵ = (M + h² θ² K)⁻¹

(docs/theory.md §2). Only M and K of the undeformed stone are needed, so ŵ is factorised once, and a
turning stone keeps its strain small. Contacts touch the surface nodes alone: C = S ŵ Sᵀ is their compliance.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from mechanics.elasticity import (
    ElasticOperators,
    elastic_operators,
    from_voigt,
    recovery,
    sampled_stress,
    to_voigt,
)
from mechanics.materials import Material
from mechanics.meshing.mesh import SolidMesh

__all__ = ["Deformable", "DynamicCompliance", "body_frame", "deformable", "dynamic_compliance"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Deformable:
    """An elastic stone.

    Attributes
    ----------
    mesh : nodes relative to the centre of mass
    material : density and elasticity
    operators : M, K and the nodal masses
    surface : (ns,) boundary nodes
    """

    mesh: SolidMesh
    material: Material
    operators: ElasticOperators
    surface: Ints

    def stress(self, node: Array, centre: Array, rotation: Array) -> Array:
        """Recovered nodal stress (n, 6) in world axes [Pa]."""
        strained = sampled_stress(self.mesh, self.material, self.displacement(node, centre, rotation))
        local = recovery(self.mesh) @ strained
        return to_voigt(rotation @ from_voigt(local) @ rotation.T)

    def displacement(self, node: Array, centre: Array, rotation: Array) -> Array:
        """Displacement d of the nodes (n, 3) from the undeformed stone, body axes [m]."""
        return (node - centre) @ rotation - self.mesh.nodes

    def elastic_energy(self, node: Array, centre: Array, rotation: Array) -> float:
        """½ dᵀ K d [J]."""
        d = self.displacement(node, centre, rotation).ravel()
        return float(0.5 * d @ (self.operators.stiffness @ d))


def deformable(mesh: SolidMesh, material: Material) -> tuple[Deformable, Array]:
    """The elastic stone of a mesh, and its centre of mass (3,) [m]."""
    operators = elastic_operators(mesh, material)
    centre = operators.nodal_mass @ mesh.nodes / operators.nodal_mass.sum()
    local = replace(mesh, nodes=mesh.nodes - centre)
    return Deformable(local, material, operators, np.unique(mesh.facets)), centre


def body_frame(body: Deformable, node: Array) -> tuple[Array, Array]:
    """Centre (3,) and rotation (3, 3) of the rigid motion nearest to the nodes, weighted by mass (Kabsch 1976)."""
    weight = body.operators.nodal_mass
    centre = weight @ node / weight.sum()
    u, _, vt = np.linalg.svd((node - centre).T @ (weight[:, None] * body.mesh.nodes))
    flip = np.array([1.0, 1.0, np.linalg.det(u @ vt)])
    return centre, (u * flip) @ vt


@dataclass(frozen=True)
class DynamicCompliance:
    """ŵ of one stone for one time step and θ.

    Attributes
    ----------
    matrix : M + h² θ² K, (3n, 3n), body axes [kg]
    factor : its sparse LU factors
    surface : C = S ŵ Sᵀ, (3 ns, 3 ns), the compliance of the surface nodes [1/kg]
    """

    matrix: "csc_array[np.float64]"
    factor: object
    surface: Array

    def respond(self, impulse: Array) -> Array:
        """Velocity ŵ p (n, 3) that the nodal impulses p (n, 3) [N s] give, body axes [m/s]."""
        velocity: Array = self.factor.solve(impulse.ravel()).reshape(-1, 3)  # type: ignore[attr-defined]
        return velocity


def dynamic_compliance(body: Deformable, step: float, theta: float) -> DynamicCompliance:
    """Factorise M + h² θ² K once, and condense its inverse on the surface nodes."""
    matrix = csc_array(body.operators.mass + (step * theta) ** 2 * body.operators.stiffness)
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    dofs = (3 * body.surface[:, None] + np.arange(3)).ravel()
    unit = np.zeros((matrix.shape[0], len(dofs)))
    unit[dofs, np.arange(len(dofs))] = 1.0
    surface = factor.solve(unit)[dofs]
    return DynamicCompliance(matrix, factor, 0.5 * (surface + surface.T))
