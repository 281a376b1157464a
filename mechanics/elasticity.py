"""Linear elasticity of one stone on linear tetrahedra, assembled with scikit-fem."""

from dataclasses import dataclass

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array
from skfem.models.elasticity import lame_parameters, linear_elasticity

from mechanics.materials import Material
from mechanics.meshing.mesh import SolidMesh

__all__ = [
    "ElasticOperators",
    "elastic_operators",
    "element_stress",
    "from_voigt",
    "recovery",
    "to_voigt",
    "von_mises",
]

Array = NDArray[np.float64]

# a linear fit has four unknowns; so many values make it a mean, not an interpolation
_PATCH = 10


@dataclass(frozen=True)
class ElasticOperators:
    """Matrices of one deformable stone; the degrees of freedom are x, y, z of node 0, of node 1, …

    Attributes
    ----------
    mass : M, (3n, 3n) consistent mass [kg]
    stiffness : K, (3n, 3n) [N/m]
    nodal_mass : (n,) mass of each node, ∫ρ N_i, also the weight of its body force [kg]
    """

    mass: "csc_array[np.float64]"
    stiffness: "csc_array[np.float64]"
    nodal_mass: Array


def elastic_operators(mesh: SolidMesh, material: Material) -> ElasticOperators:
    """Assemble M and K of the weak form ∫ρ v̇·w + ∫σ(u):ε(w) (Zienkiewicz & Taylor, vol. 1)."""
    basis = _basis(mesh)
    stiffness = linear_elasticity(*lame_parameters(material.young, material.poisson)).assemble(basis)
    mass = material.density * skfem.BilinearForm(lambda u, v, w: skfem.helpers.dot(u, v)).assemble(basis)
    nodal_mass = np.asarray(mass.sum(axis=1)).reshape(-1, 3)[:, 0]
    return ElasticOperators(csc_array(mass), csc_array(stiffness), nodal_mass)


def _basis(mesh: SolidMesh) -> "skfem.Basis":
    return skfem.Basis(
        skfem.MeshTet(np.ascontiguousarray(mesh.nodes.T), np.ascontiguousarray(mesh.cells.T)),
        skfem.ElementVector(skfem.ElementTetP1()),
        intorder=2,
    )


def element_stress(mesh: SolidMesh, material: Material, displacement: Array) -> Array:
    """Stress of each tetrahedron (nt, 6), order xx, yy, zz, xy, yz, zx [Pa], from nodal displacement (n, 3) [m]."""
    corners = mesh.nodes[mesh.cells]
    edges = corners[:, 1:] - corners[:, :1]
    jumps = displacement[mesh.cells][:, 1:] - displacement[mesh.cells][:, :1]
    gradient = np.linalg.solve(edges, jumps)  # rows: derivative along x, y, z of the displacement
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
    lam, mu = lame_parameters(material.young, material.poisson)
    stress = 2.0 * mu * strain + lam * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    return to_voigt(stress)


def recovery(mesh: SolidMesh) -> "csr_array[np.float64]":
    """Weights (n, nt) that give nodal values from those of the tetrahedra (superconvergent patch recovery).

    Around each node a linear polynomial is fitted by least squares to the values at the tetrahedra's centroids
    (Zienkiewicz & Zhu 1992). A patch that cannot carry the fit, as at a corner, is widened by its neighbours.
    """
    nodes, count = len(mesh.nodes), len(mesh.cells)
    centroid = mesh.nodes[mesh.cells].mean(axis=1)
    touches = csr_array(
        (np.ones(4 * count), (mesh.cells.ravel(), np.repeat(np.arange(count), 4))), shape=(nodes, count)
    )
    wider = (touches @ touches.T) @ touches
    columns, weights = [], []
    for node in range(nodes):
        patch = touches.indices[touches.indptr[node] : touches.indptr[node + 1]]
        if len(patch) < _PATCH:
            patch = wider.indices[wider.indptr[node] : wider.indptr[node + 1]]
        # fitted about the patch's mean point: where the centroids lie on one plane, a constant stays exact
        mean = centroid[patch].mean(axis=0)
        slope = np.linalg.pinv(centroid[patch] - mean)
        columns.append(patch)
        weights.append(1.0 / len(patch) + (mesh.nodes[node] - mean) @ slope)
    pointer = np.concatenate([[0], np.cumsum([len(c) for c in columns])])
    return csr_array((np.concatenate(weights), np.concatenate(columns), pointer), shape=(nodes, count))


def von_mises(stress: Array) -> Array:
    """σ_vm = sqrt(½[(σxx-σyy)²+(σyy-σzz)²+(σzz-σxx)²] + 3(σxy²+σyz²+σzx²)) of stress (…, 6) [Pa]."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(stress, -1, 0)
    result: Array = np.sqrt(
        0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + zx**2)
    )
    return result


def to_voigt(tensor: Array) -> Array:
    """(…, 3, 3) symmetric → (…, 6) in the order xx, yy, zz, xy, yz, zx."""
    voigt: Array = tensor[..., [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    return voigt


def from_voigt(voigt: Array) -> Array:
    """(…, 6) → (…, 3, 3)."""
    tensor: Array = voigt[..., [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
    return tensor
