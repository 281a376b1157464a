"""Recovery of nodal stress from the stress at the sampling points (superconvergent patch recovery)."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array

from mechanics.arrays import Array, Bools, Ints
from mechanics.stones.elasticity.stress import SAMPLE_ORDER
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.meshing.shape_functions import integration

_UNSEEN = (
    0.03  # variance of a direction or quadratic term, over the largest, below which a patch leaves it out
)
_AMPLIFIED = 6.0  # sum of the absolute weights of a value above which a quadratic fit is not trusted
# weights (_FLAT + d²/d̄²)^-power fall with the distance d from the patch's corner, d̄² its mean square
_FLAT = 0.1
_POWER = {1: 1.0, 2: 1.5}  # by the order of the element
# corners that a cell shares with one of a surface patch to join it; one for elements that are not listed
_SHARED = {Element.HEX20: 4, Element.HEX27: 4}
_AT_ONCE = 64  # patches fitted at once


def recovery(mesh: SolidMesh) -> "csr_array[np.float64]":
    """Return weights (n, nq) that take the values of `sampled_stress` to the nodes (Zienkiewicz & Zhu 1992).

    Around each corner of the cells a polynomial of the element's order is fitted by weighted least squares to the
    values at the sampling points of the cells that touch it; around a corner on the surface, also to those of the cells
    beside these, as a patch on one side of a point determines its value poorly. Terms that a patch does not determine
    are left out, the quadratic ones first: constants are always exact. A middle node has the mean of the values of the
    polynomials of its corners.
    """
    patches = _patches(mesh)
    rule = integration(mesh.element, mesh.nodes, mesh.cells, SAMPLE_ORDER[mesh.element])
    spread = _spread(mesh)
    outside = np.isin(patches.corner, mesh.facets)
    wider = _widened(patches.cells, _SHARED.get(mesh.element, 1))
    parts = []
    for chosen, cells in ((np.flatnonzero(~outside), patches.cells), (np.flatnonzero(outside), wider)):
        # patches of about the same size together
        chosen = chosen[np.argsort(np.diff(cells.indptr)[chosen], kind="stable")]
        parts += [
            _weights(mesh, rule.point, spread, patches, cells, chosen[start : start + _AT_ONCE])
            for start in range(0, len(chosen), _AT_ONCE)
        ]
    row, column, weight = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    whole = coo_array((weight, (row, column)), shape=(len(mesh.nodes), rule.volume.size)).tocsr()
    count = np.bincount(patches.target, minlength=len(mesh.nodes))
    whole.data /= np.repeat(count, np.diff(whole.indptr))
    return csr_array(whole)


@dataclass(frozen=True)
class _Patches:
    """Patches around the corners.

    Attributes
    ----------
    corner : (np,) node of each patch
    cells : a row per patch, a column per cell that touches the corner
    target : (nt,) nodes that get a value from a patch
    targets : a row per patch, a column per target
    """

    corner: Ints
    cells: "csr_array[np.float64]"
    target: Ints
    targets: "csr_array[np.float64]"


def _patches(mesh: SolidMesh) -> _Patches:
    corners, cells = mesh.element.corners, len(mesh.cells)
    distinct, number = np.unique(mesh.cells[:, :corners], return_inverse=True)
    number = number.reshape(cells, corners)
    touches = csr_array(
        (np.ones(number.size), (number.ravel(), np.repeat(np.arange(cells), corners))),
        shape=(len(distinct), cells),
    )
    ends = [(corner, node) for node, of in enumerate(mesh.element.node_corners) for corner in of]
    first, second = np.array(ends).T
    pairs = np.unique(number[:, first].ravel() * len(mesh.nodes) + mesh.cells[:, second].ravel())
    counts = np.bincount(pairs // len(mesh.nodes), minlength=len(distinct))
    pointer = np.concatenate([[0], np.cumsum(counts)])
    targets = csr_array(
        (np.ones(len(pairs)), np.arange(len(pairs)), pointer), shape=(len(distinct), len(pairs))
    )
    return _Patches(distinct, touches, pairs % len(mesh.nodes), targets)


def _widened(cells: "csr_array[np.float64]", shared: int) -> "csr_array[np.float64]":
    """Extend the patches by all cells that share a number of corners with one of theirs."""
    neighbours = csr_array(cells.T @ cells)
    neighbours.data = (neighbours.data > shared - 0.5).astype(float)
    neighbours.eliminate_zeros()
    wider = csr_array(cells @ neighbours)
    wider.data[:] = 1.0
    return wider


def _weights(
    mesh: SolidMesh,
    points: Array,
    spread: Array,
    patches: _Patches,
    cells: "csr_array[np.float64]",
    chosen: Ints,
) -> tuple[Ints, Ints, Array]:
    """Return node, sampling point and weight of some patches, fitted to the points (nc, s, 3) of their cells."""
    samples = points.shape[1]
    cell, used = _rows(cells, chosen)
    number = (samples * cell[:, :, None] + np.arange(samples)).reshape(len(chosen), -1)
    used = np.repeat(used, samples, axis=1)
    place, wanted = _rows(patches.targets, chosen)
    node = patches.target[place]
    size = (cells[chosen] @ spread).reshape(-1, 3, 3) / np.diff(cells.indptr)[chosen][:, None, None]
    corner = mesh.nodes[patches.corner[chosen]]
    fitted = _fit(points.reshape(-1, 3)[number], used, size, corner, mesh.nodes[node], mesh.element.order)
    used_pairs = wanted[:, :, None] & used[:, None, :]
    row, column = (
        np.broadcast_to(node[:, :, None], used_pairs.shape),
        np.broadcast_to(number[:, None, :], used_pairs.shape),
    )
    return row[used_pairs], column[used_pairs], fitted[used_pairs]


def _spread(mesh: SolidMesh) -> Array:
    """Return the mean square distances (nc, 9) of the corners of each cell from their mean."""
    corners = mesh.nodes[mesh.cells[:, : mesh.element.corners]]
    local = corners - corners.mean(axis=1, keepdims=True)
    spread: Array = (local.transpose(0, 2, 1) @ local).reshape(-1, 9) / mesh.element.corners
    return spread


def _rows(matrix: "csr_array[np.float64]", rows: Ints) -> tuple[Ints, Bools]:
    """Return the columns (nr, m) of some rows, padded with the first of each, and a mask of the row's own."""
    start, count = matrix.indptr[rows], np.diff(matrix.indptr)[rows]
    place = np.arange(count.max())
    used = place < count[:, None]
    return matrix.indices[start[:, None] + np.where(used, place, 0)].astype(np.int64), used


def _fit(points: Array, used: Bools, size: Array, corner: Array, target: Array, order: int) -> Array:
    """Return weights (np, nt, m) of the values at points (np, m, 3) of patches for targets (np, nt, 3).

    Coordinates are turned and stretched so that the points of each patch have unit variance along each axis: the
    fit does not depend on the slenderness of the cells. An axis is left out where the points vary little beside the
    size of the cells, its mean square (np, 3, 3), as in a single layer of cells with one point each.
    """
    distance = ((points - corner[:, None]) ** 2).sum(axis=2)
    mean_square = (distance * used).sum(axis=1, keepdims=True) / used.sum(axis=1, keepdims=True)
    weight = used * (_FLAT + distance / mean_square) ** -_POWER[order]
    weight = (weight / weight.sum(axis=1, keepdims=True))[:, :, None]
    mean = (weight * points).sum(axis=1, keepdims=True)
    local = points - mean
    variance = local.transpose(0, 2, 1) @ (weight * local)
    stretch = _inverse_root(variance + size, 0.0)
    stretch = stretch @ _inverse_root(stretch.transpose(0, 2, 1) @ variance @ stretch, _UNSEEN)
    y, z = local @ stretch, (target - mean) @ stretch
    fitted, wanted = [weight, weight * y], [np.ones((*z.shape[:2], 1)), z]
    if order == 2:
        # the part of squares and products that constant and linear polynomials do not span
        squares, aim = _squares(y), _squares(z)
        level, slope = (weight * squares).sum(axis=1, keepdims=True), fitted[1].transpose(0, 2, 1) @ squares
        rest, aim = squares - level - y @ slope, aim - level - z @ slope
        root = _inverse_root(rest.transpose(0, 2, 1) @ (weight * rest), _UNSEEN)
        fitted.append((weight * rest) @ root)
        wanted.append(aim @ root)
    columns, rows = np.concatenate(fitted, axis=2).transpose(0, 2, 1), np.concatenate(wanted, axis=2)
    weights: Array = rows @ columns
    amplified = np.abs(weights).sum(axis=2) > _AMPLIFIED
    if order == 2 and amplified.any():
        rows[amplified, 4:] = 0.0
        weights = rows @ columns
    return weights


def _squares(y: Array) -> Array:
    """Return the six squares and products of coordinates (…, 3)."""
    return y[..., [0, 1, 2, 0, 1, 2]] * y[..., [0, 1, 2, 1, 2, 0]]


def _inverse_root(variance: Array, unseen: float) -> Array:
    """Return columns that bring (np, k, k) to the unit matrix; zero for directions of hardly any variance."""
    values, vectors = np.linalg.eigh(variance)
    seen = values > unseen * np.maximum(values[:, -1:], np.finfo(float).tiny)
    scale = np.where(seen, 1.0 / np.sqrt(np.where(seen, values, 1.0)), 0.0)
    result: Array = vectors * scale[:, None, :]
    return result
