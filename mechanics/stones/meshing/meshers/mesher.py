"""Meshing of one stone with its kind of element, by one mesher after the other until one succeeds."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from ground.errors import MeshError, MissingLibraryError
from mechanics.arrays import Array
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh, with_middle_nodes
from mechanics.stones.meshing.meshers.choice import Mesher
from mechanics.stones.meshing.meshers.corner_hexahedra import mesh_at_corners
from mechanics.stones.meshing.meshers.delaunay import mesh_with_delaunay
from mechanics.stones.meshing.meshers.gmsh import Algorithm, mesh_with_gmsh
from mechanics.stones.meshing.meshers.hexahedral import mesh_with_hexahedra
from mechanics.stones.meshing.quality import mesh_quality
from mechanics.stones.meshing.sizes import SizeField, as_field, graded
from mechanics.stones.meshing.soundness import check_meshable, is_convex
from mechanics.stones.polyhedra import mass_properties

# scaled Jacobian below which a tetrahedron is a sliver, and another mesher is tried
_POOR = 0.005
# size of a second attempt over that of the first
_FINER = 0.7
# cells in one stone: more can be neither solved nor held in memory
_MOST_CELLS = 1e6


class Meshable(Protocol):
    """A stone to be meshed, such as a deformable `mechanics.scene.scene.Block`; fields as there."""

    @property
    def code(self) -> str:
        """Code of the stone."""

    @property
    def vertices(self) -> Array:
        """Corners (nv, 3) [m]."""

    @property
    def faces(self) -> tuple[tuple[int, ...], ...]:
        """Corners of each face, counter-clockwise seen from outside."""

    @property
    def element(self) -> Element:
        """Finite element of its cells."""

    @property
    def mesh_size(self) -> float | None:
        """Edge of a cell; None of rigid stones [m]."""

    @property
    def contact_size(self) -> float | None:
        """Edge of a facet in joints; None: as the mesh [m]."""

    @property
    def growth(self) -> float:
        """Size of a cell over that of its neighbour towards the joints [-]."""

    @property
    def mesher(self) -> Mesher:
        """Program that makes the mesh."""


@dataclass(frozen=True)
class Meshed:
    """The mesh of a stone, and its making.

    Attributes
    ----------
    mesh : the finite elements
    how : the mesher that made it
    failures : meshers tried before, each with the reason of its failure
    """

    mesh: SolidMesh
    how: str
    failures: tuple[str, ...]


@dataclass(frozen=True)
class _Attempt:
    how: str
    make: Callable[[SizeField], SolidMesh]
    factor: float = 1.0


def mesh_block(block: Meshable, contact: tuple[int, ...] = ()) -> SolidMesh:
    """Return the mesh of `meshed_block` alone.

    >>> from mechanics.scene.shapes import box
    >>> ashlar = box("A1", (0, 0, 0), (0.6, 0.4, 0.2), mesh_size=0.1, element=Element.HEX8)
    >>> len(mesh_block(ashlar).cells)
    48
    """
    return meshed_block(block, contact).mesh


def meshed_block(block: Meshable, contact: tuple[int, ...] = ()) -> Meshed:
    """Mesh one deformable block with edges of about its mesh size.

    Hexahedra form a regular grid in boxes, and a grid at each corner in other stones. Tetrahedra are made by the mesher
    that the block asks for; if it fails or leaves slivers, by the others, then finer, and the best mesh is taken.

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


def _attempts(block: Meshable) -> tuple[_Attempt, ...]:
    """Return the meshers for a block, in the order in which they are tried."""

    def using(mesher: Callable[..., SolidMesh], **options: object) -> Callable[[SizeField], SolidMesh]:
        """Return a mesher of the block by edge length."""
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
