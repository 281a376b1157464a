"""Mesh a block with its kind of element: one mesher after the other, until one succeeds."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

from mechanics.scene.scene import Block
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.meshing.meshers.choice import Mesher
from mechanics.stones.meshing.meshers.corner_hexahedra import mesh_at_corners
from mechanics.stones.meshing.meshers.delaunay import mesh_with_delaunay
from mechanics.stones.meshing.meshers.gmsh import Algorithm, mesh_with_gmsh
from mechanics.stones.meshing.meshers.hexahedral import mesh_with_hexahedra
from mechanics.stones.meshing.quadratic import with_middle_nodes
from mechanics.stones.meshing.quality import mesh_quality
from mechanics.stones.meshing.sizes import SizeField, as_field, graded
from mechanics.stones.meshing.soundness import check_meshable, is_convex
from mechanics.stones.polyhedra import mass_properties
from moma.errors import MeshError, MissingLibraryError

__all__ = ["Meshed", "mesh_block", "meshed_block"]

# tetrahedra with a smaller scaled Jacobian are slivers: another mesher may do better
_POOR = 0.005
# a second attempt is that much finer
_FINER = 0.7
# cells in one stone: more than can be solved, and more than memory holds
_MOST_CELLS = 1e6


@dataclass(frozen=True)
class Meshed:
    """The mesh of a stone, and how it was made.

    Attributes
    ----------
    mesh : the finite elements
    how : the mesher that made it
    failures : the meshers that were tried before, each with its reason
    """

    mesh: SolidMesh
    how: str
    failures: tuple[str, ...]


@dataclass(frozen=True)
class _Attempt:
    how: str
    make: Callable[[SizeField], SolidMesh]
    factor: float = 1.0


def mesh_block(block: Block, contact: tuple[int, ...] = ()) -> SolidMesh:
    """The mesh of `meshed_block` alone."""
    return meshed_block(block, contact).mesh


def meshed_block(block: Block, contact: tuple[int, ...] = ()) -> Meshed:
    """Finite elements of one deformable block, of edge length about its mesh size.

    Hexahedra in a regular grid, or at each corner in stones that are no boxes. Tetrahedra by the mesher that the block
    asks for; if it fails, or leaves slivers, by the others, and finer: the best of them is taken.

    Parameters
    ----------
    block : with a mesh size
    contact : faces at which its contact size holds

    Raises
    ------
    MeshError : if the block cannot be meshed, with the reason
    """
    assert block.mesh_size is not None
    if not block.mesh_size > 0:
        raise MeshError(
            f"mesh_size = {block.mesh_size!r}",
            where=f"stone {block.code}",
            remedy="give metres greater than 0",
        )
    check_meshable(block.vertices, block.faces, block.code)
    cells = mass_properties(block.vertices, block.faces, f"stone {block.code}").volume / block.mesh_size**3
    if cells > _MOST_CELLS:
        raise MeshError(
            f"edges of {block.mesh_size:g} m would make some {cells:.1g} cells of it",
            where=f"stone {block.code}",
            remedy="give a larger mesh size, or make the stone rigid",
        )
    size = as_field(block.mesh_size)
    if block.contact_size is not None:
        size = graded(block.mesh_size, block.contact_size, block.growth, block.vertices, block.faces, contact)
    made = _first_good(_attempts(block), size, block.code)
    if block.element.order == 1:
        return made
    return replace(made, mesh=with_middle_nodes(made.mesh, block.element))


def _attempts(block: Block) -> tuple[_Attempt, ...]:
    """The meshers that may mesh a block, in the order in which they are tried."""

    def using(mesher: Callable[..., SolidMesh], **options: object) -> Callable[[SizeField], SolidMesh]:
        return lambda size: mesher(block.vertices, block.faces, size, block.code, **options)

    if not block.element.is_tetrahedron:
        grid, corners = using(mesh_with_hexahedra), using(mesh_at_corners)
        cubic = len(block.vertices) == 8 and all(len(face) == 4 for face in block.faces)
        return (_Attempt("grid", grid),) if cubic else (_Attempt("hexahedra at corners", corners),)
    delaunay = using(mesh_with_delaunay)
    gmsh = (
        _Attempt("gmsh", using(mesh_with_gmsh)),
        _Attempt("gmsh, finer and by HXT", using(mesh_with_gmsh, algorithm=Algorithm.HXT), _FINER),
    )
    convex = (_Attempt("delaunay", delaunay),)
    finer = (_Attempt("delaunay, finer", delaunay, _FINER),)
    if not is_convex(block.vertices, block.faces):
        return convex if block.mesher is Mesher.DELAUNAY else gmsh
    if block.mesher is Mesher.DELAUNAY:
        return convex + finer
    return gmsh + convex if block.mesher is Mesher.GMSH else convex + gmsh + finer


def _first_good(attempts: tuple[_Attempt, ...], size: SizeField, code: str) -> Meshed:
    failures: list[str] = []
    best: Meshed | None = None
    least, remedy = -1.0, None
    for attempt in attempts:
        try:
            mesh = attempt.make(size if attempt.factor == 1.0 else size.scaled(attempt.factor))
        except MissingLibraryError as error:
            warnings.warn(f"meshing without gmsh: {error}", stacklevel=3)
            failures.append(f"{attempt.how}: {error.what}")
            remedy = error.remedy
            continue
        except MeshError as error:
            failures.append(f"{attempt.how}: {error.what}")
            remedy = remedy or error.remedy
            continue
        shape = mesh_quality([mesh])[0].min_scaled_jacobian
        if shape > least:
            best, least = Meshed(mesh, attempt.how, tuple(failures)), shape
        if shape >= _POOR or not mesh.element.is_tetrahedron:
            break
        failures.append(f"{attempt.how}: slivers, scaled Jacobian {shape:.2g}")
    if best is None:
        what = "; ".join(failures) if len(failures) > 1 else failures[0].partition(": ")[2]
        raise MeshError(what, where=f"stone {code}", remedy=remedy)
    return best
