"""Choose the mesher: gmsh, or scipy's Delaunay where gmsh's shared libraries are missing."""

import warnings

from mechanics.meshing.delaunay_mesher import mesh_with_delaunay
from mechanics.meshing.gmsh_mesher import mesh_with_gmsh
from mechanics.meshing.mesh import SolidMesh
from mechanics.scene import Block
from moma.errors import MissingLibraryError

__all__ = ["mesh_block"]


def mesh_block(block: Block) -> SolidMesh:
    """Linear tetrahedra of one deformable block, of edge length about its mesh size.

    Raises
    ------
    MeshError : if the block cannot be meshed
    """
    assert block.mesh_size is not None
    arguments = block.vertices, block.faces, block.mesh_size, block.code
    try:
        return mesh_with_gmsh(*arguments)
    except MissingLibraryError as error:
        warnings.warn(f"meshing with scipy's Delaunay instead of gmsh: {error}", stacklevel=2)
        return mesh_with_delaunay(*arguments)
