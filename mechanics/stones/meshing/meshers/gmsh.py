"""Tetrahedra by gmsh. The only module that imports it."""

from enum import IntEnum
from typing import Any

import numpy as np

from ground.errors import MeshError, MissingLibraryError
from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.mesh import SolidMesh, tet_mesh
from mechanics.stones.meshing.meshers.slivers import improved
from mechanics.stones.meshing.sizes import SizeField, as_field

Faces = tuple[tuple[int, ...], ...]

# needed by gmsh's wheel on a bare Debian or Ubuntu
_SYSTEM_PACKAGES = "libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1"
# options are global, so all that matter are set before every mesh. Gmsh improves tetrahedra whose shape is below a
# threshold; its default of 0.3 leaves dihedral angles of 12 degrees where 0.5 leaves 16
_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.Optimize": 1,
    "Mesh.OptimizeThreshold": 0.5,
}


class Algorithm(IntEnum):
    """Algorithms in space; the numbers are gmsh's."""

    DELAUNAY = 1
    HXT = 10


def mesh_with_gmsh(
    vertices: Array,
    faces: Faces,
    size: SizeField | float,
    code: str,
    algorithm: Algorithm = Algorithm.DELAUNAY,
) -> SolidMesh:
    """Mesh one polyhedron with linear tetrahedra of edge length about `size` [m].

    The model is built at unit size, so that gmsh's absolute tolerances mean the same for every stone, and in
    one thread, so that the mesh of a stone is always the same. Slivers that gmsh leaves are improved.

    Raises
    ------
    MissingLibraryError : if gmsh or its shared libraries are absent
    MeshError : if gmsh cannot mesh the stone
    """
    try:
        import gmsh
    except ImportError as error:
        what = "its mesh is one of gmsh, and that package is not installed"
        remedy = "pip install gmsh, or model the stone as rigid"
        raise MissingLibraryError(what, where=f"stone {code}", remedy=remedy) from error
    except OSError as error:
        raise MissingLibraryError(
            f"gmsh cannot be loaded: {error}", remedy=f"install the system packages {_SYSTEM_PACKAGES}"
        ) from error
    if not gmsh.isInitialized():
        gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    origin, scale = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max())
    field = as_field(size).local(origin, scale)
    for option, value in (*_OPTIONS.items(), ("Mesh.Algorithm3D", algorithm)):
        gmsh.option.setNumber(option, value)
    gmsh.model.add("stone")
    try:
        _build(gmsh.model.geo, (vertices - origin) / scale, faces, field.size)
        _set_sizes(gmsh, field)
        nodes, tetrahedra = _generate(gmsh.model.mesh)
    except Exception as error:  # gmsh raises bare exceptions
        raise MeshError(
            f"gmsh failed: {error}",
            where=f"stone {code}",
            remedy="check that the stone's faces are planar and closed",
        ) from error
    finally:
        gmsh.model.remove()
    mesh = tet_mesh(nodes * scale + origin, tetrahedra, vertices, faces, code)
    return improved(mesh, vertices, faces)


def _build(geo: Any, vertices: Array, faces: Faces, size: float) -> None:
    points = [geo.addPoint(*x, size) for x in vertices.tolist()]
    lines: dict[tuple[int, int], int] = {}
    surfaces = []
    for face in faces:
        loop = []
        for a, b in zip(face, (*face[1:], face[0]), strict=True):
            if (b, a) in lines:
                loop.append(-lines[b, a])
            else:
                lines[a, b] = geo.addLine(points[a], points[b])
                loop.append(lines[a, b])
        surfaces.append(geo.addPlaneSurface([geo.addCurveLoop(loop)]))
    geo.addVolume([geo.addSurfaceLoop(surfaces)])
    geo.synchronize()


def _set_sizes(gmsh: Any, field: SizeField) -> None:
    """Set a background field for sizes that vary; uniform sizes are those of the corners."""
    by_points = 1 if field.uniform else 0
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", by_points)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", by_points)
    if field.uniform:
        return
    fields = gmsh.model.mesh.field
    distances = [
        f"Abs({a!r}*x + {b!r}*y + {c!r}*z - {d!r})".replace("+ -", "- ").replace("- -", "+ ")
        for (a, b, c), d in zip(field.normals.tolist(), field.offsets.tolist(), strict=True)
    ]
    parts = [f"{field.size!r}", *(f"{field.fine!r} + {field.growth!r}*{distance}" for distance in distances)]
    tags = []
    for tag in parts:
        tags.append(fields.add("MathEval"))
        fields.setString(tags[-1], "F", tag)
    least = fields.add("Min")
    fields.setNumbers(least, "FieldsList", tags)
    fields.setAsBackgroundMesh(least)


def _generate(mesh: Any) -> tuple[Array, Ints]:
    mesh.generate(3)
    tags, coordinates, _ = mesh.getNodes()
    kinds, _, node_tags = mesh.getElements(3)
    (tetrahedra,) = (np.asarray(t) for kind, t in zip(kinds, node_tags, strict=True) if kind == 4)
    position = np.zeros(int(max(tags)) + 1, dtype=np.int64)
    position[np.asarray(tags, dtype=np.int64)] = np.arange(len(tags))
    return np.asarray(coordinates).reshape(-1, 3), position[tetrahedra.astype(np.int64)].reshape(-1, 4)
