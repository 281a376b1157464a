"""Quadratic elements from linear ones: nodes at the middle of edges, sides and cells."""

from dataclasses import replace

import numpy as np

from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh, boundary_facets

__all__ = ["with_middle_nodes"]


def with_middle_nodes(mesh: SolidMesh, element: Element) -> SolidMesh:
    """The mesh of linear cells with nodes added at the mean of their corners, shared by neighbouring cells.

    The corners keep their numbers, the middle nodes follow: of the edges, of the sides, of the cells.
    """
    nodes, columns = [mesh.nodes], [mesh.cells]
    count = len(mesh.nodes)
    for size in (2, 4, 8):
        groups = [list(corners) for corners in element.node_corners if len(corners) == size]
        if not groups:
            continue
        ends = np.sort(mesh.cells[:, groups], axis=-1).reshape(-1, size)
        distinct, number = np.unique(ends, axis=0, return_inverse=True)
        nodes.append(mesh.nodes[distinct].mean(axis=1))
        columns.append(count + number.reshape(len(mesh.cells), -1))
        count += len(distinct)
    cells = np.hstack(columns)
    # boundary facets come in the order of the cells, so they keep their order and their faces
    return replace(
        mesh,
        element=element,
        nodes=np.vstack(nodes),
        cells=cells,
        facets=boundary_facets(element, cells),
    )
