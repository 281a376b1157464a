"""Mesh a block with its kind of element."""

import warnings

import numpy as np
from numpy.typing import NDArray

from mechanics.meshing.delaunay_mesher import mesh_with_delaunay
from mechanics.meshing.gmsh_mesher import mesh_with_gmsh
from mechanics.meshing.hexahedral_mesher import mesh_with_hexahedra
from mechanics.meshing.mesh import SolidMesh
from mechanics.meshing.quadratic import with_middle_nodes
from mechanics.scene import Block
from moma.errors import MeshError, MissingLibraryError

__all__ = ["mesh_block"]


def mesh_block(block: Block) -> SolidMesh:
    """Finite elements of one deformable block, of edge length about its mesh size.

    Tetrahedra by gmsh, or by scipy's Delaunay where gmsh's shared libraries are missing; hexahedra in a regular grid.

    Raises
    ------
    MeshError : if the block cannot be meshed
    """
    assert block.mesh_size is not None
    if not block.mesh_size > 0:
        raise MeshError(
            f"mesh_size = {block.mesh_size!r}",
            where=f"stone {block.code}",
            remedy="give metres greater than 0",
        )
    arguments = block.vertices, block.faces, block.mesh_size, block.code
    mesh = _tetrahedra(*arguments) if block.element.is_tetrahedron else mesh_with_hexahedra(*arguments)
    return mesh if block.element.order == 1 else with_middle_nodes(mesh, block.element)


def _tetrahedra(
    vertices: NDArray[np.float64], faces: tuple[tuple[int, ...], ...], size: float, code: str
) -> SolidMesh:
    try:
        return mesh_with_gmsh(vertices, faces, size, code)
    except MissingLibraryError as error:
        warnings.warn(f"meshing with scipy's Delaunay instead of gmsh: {error}", stacklevel=3)
        return mesh_with_delaunay(vertices, faces, size, code)
