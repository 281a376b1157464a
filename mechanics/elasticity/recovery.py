"""Stress at the nodes from that at the sampling points."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from mechanics.meshing.mesh import SolidMesh

__all__ = ["recovery"]

Array = NDArray[np.float64]

# a linear fit has four unknowns; so many values make it a mean, not an interpolation
_PATCH = 10


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
