"""Mass and stiffness of one stone."""

from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
from scipy.sparse import bsr_array, coo_array, csc_array, dia_array

from mechanics.arrays import Array, Ints
from mechanics.stones.materials import Material, fourth_order
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.meshing.shape_functions import Integration, integration

# Polynomial order of the integrand. The Jacobian is constant in a tetrahedron, of order 2 in each direction in a
# hexahedron. M and the forces of the patch test, Jacobian times shape function gradients, are exact.
STIFFNESS_ORDER = {
    Element.TET4: 1,
    Element.TET10: 2,
    Element.HEX8: 3,
    Element.HEX20: 5,
    Element.HEX27: 5,
}
MASS_ORDER = {Element.TET4: 2, Element.TET10: 4, Element.HEX8: 5, Element.HEX20: 7, Element.HEX27: 7}
_PAIRS_AT_ONCE = 1_000_000  # pairs of nodes whose blocks are computed at once, some hundred megabytes


@dataclass(frozen=True)
class ElasticOperators:
    """Matrices of one deformable stone; the degrees of freedom are x, y, z of node 0, of node 1, …

    Attributes
    ----------
    mass : M, (3n, 3n), consistent or diagonal [kg]
    stiffness : K, (3n, 3n) [N/m]
    nodal_mass : (n,) ∫ρ N_i, the share of each node in a uniform body force [kg]; negative at some corners of quadratic
        elements
    """

    mass: "csc_array[np.float64]"
    stiffness: "csc_array[np.float64]"
    nodal_mass: Array


def elastic_operators(mesh: SolidMesh, material: Material, lumped: bool = False) -> ElasticOperators:
    """Assemble M and K of the weak form ∫ρ v̇·w + ∫σ(u):ε(w) (Zienkiewicz & Taylor, vol. 1).

    docs/design/deformable-stones.md compares with assembly by scikit-fem.

    Parameters
    ----------
    lumped : put the mass on the diagonal, in proportion to that of the consistent matrix (Hinton, Rock & Zienkiewicz
        1976): all positive, and each element keeps its mass
    """
    rule = integration(mesh.element, mesh.nodes, mesh.cells, MASS_ORDER[mesh.element])
    consistent = material.density * (rule.volume @ _products(rule.value)).reshape(len(mesh.cells), -1)
    size, k = len(mesh.nodes), mesh.element.cell_nodes
    nodal_mass = _gather(mesh, material.density * rule.volume @ rule.value)
    if lumped:
        diagonal = np.repeat(_gather(mesh, _on_diagonal(consistent.reshape(-1, k, k))), 3)
        mass = csc_array(dia_array((diagonal[None], [0]), shape=(3 * size, 3 * size)))
    else:
        mass = _in_three_directions(_assembled(mesh.cells, size, consistent.reshape(-1, k, k, 1, 1)))
    return ElasticOperators(mass, _stiffness(mesh, material), nodal_mass)


def node_volumes(mesh: SolidMesh) -> Array:
    """Return the part of the stone that belongs to each node (n,) [m³].

    All parts are positive, in the proportions of the lumped mass; their sum is the volume of the stone.
    """
    rule = integration(mesh.element, mesh.nodes, mesh.cells, MASS_ORDER[mesh.element])
    k = mesh.element.cell_nodes
    return _gather(mesh, _on_diagonal((rule.volume @ _products(rule.value)).reshape(-1, k, k)))


def _stiffness(mesh: SolidMesh, material: Material) -> "csc_array[np.float64]":
    """Assemble K_{ai,bj} = c_{ikjl} ∫ ∂_k N_a ∂_l N_b."""
    tensor = fourth_order(material.stiffness).transpose(1, 3, 0, 2).reshape(9, 9)  # as [k, l, i, j]
    k, parts = mesh.element.cell_nodes, []
    at_once = _PAIRS_AT_ONCE // k**2
    for start in range(0, len(mesh.cells), at_once):
        cells = mesh.cells[start : start + at_once]
        rule = integration(mesh.element, mesh.nodes, cells, STIFFNESS_ORDER[mesh.element])
        pairs = _gradient_products(rule).reshape(-1, k, 3, k, 3).transpose(0, 1, 3, 2, 4)
        blocks = (pairs.reshape(-1, 9) @ tensor).reshape(-1, k, k, 3, 3)
        blocks = 0.5 * (blocks + blocks.transpose(0, 2, 1, 4, 3))
        parts.append(_assembled(cells, len(mesh.nodes), blocks))
    return csc_array(reduce(add, parts))


def _gradient_products(rule: Integration) -> Array:
    """Return ∫ ∂_k N_a ∂_l N_b over each cell (nc, 3k, 3k)."""
    gradient = rule.gradient.reshape(*rule.volume.shape, -1)
    products: Array = gradient.transpose(0, 2, 1) @ (rule.volume[:, :, None] * gradient)
    return products


def _products(value: Array) -> Array:
    """Return the products N_a N_b (nq, k²) at the points."""
    return (value[:, :, None] * value[:, None, :]).reshape(len(value), -1)


def _on_diagonal(consistent: Array) -> Array:
    """Share the sum of each element matrix between its nodes (nc, k), in proportion to the diagonal."""
    diagonal = np.einsum("caa->ca", consistent)
    shares: Array = diagonal * (consistent.sum(axis=(1, 2)) / diagonal.sum(axis=1))[:, None]
    return shares


def _gather(mesh: SolidMesh, values: Array) -> Array:
    """Sum the values (nc, k) of the nodes of the cells at each node (n,)."""
    sums: Array = np.bincount(mesh.cells.ravel(), weights=values.ravel(), minlength=len(mesh.nodes)).astype(
        float
    )
    return sums


def _assembled(cells: Ints, size: int, blocks: Array) -> "csc_array[np.float64]":
    """Sum the blocks (nc, k, k, b, b) of pairs of nodes; symmetric to the last bit if the blocks of the cells are."""
    k, width = cells.shape[1], blocks.shape[-1]
    pair = (np.repeat(cells, k, axis=1) * size + np.tile(cells, (1, k))).ravel()
    order = np.argsort(
        pair, kind="stable"
    )  # stable: both sums of a symmetric pair have the order of the cells
    pair = pair[order]
    first = np.flatnonzero(np.concatenate([[True], pair[1:] != pair[:-1]]))
    sums = np.add.reduceat(blocks.reshape(-1, width, width)[order], first, axis=0)
    pointer = np.searchsorted(pair[first], np.arange(size + 1) * size)
    rows = bsr_array((sums, pair[first] % size, pointer), shape=(size * width, size * width)).tocsr()
    # rows of a symmetric matrix are its columns
    return csc_array((rows.data, rows.indices, rows.indptr), shape=rows.shape)


def _in_three_directions(scalar: "csc_array[np.float64]") -> "csc_array[np.float64]":
    """Return the Kronecker product with the unit matrix of three rows."""
    whole = scalar.tocoo()
    axis = np.arange(3)
    rows, columns = (3 * whole.coords[k][:, None] + axis for k in (0, 1))
    values = np.repeat(whole.data, 3)
    return coo_array(
        (values, (rows.ravel(), columns.ravel())), shape=tuple(3 * n for n in scalar.shape)
    ).tocsc()
