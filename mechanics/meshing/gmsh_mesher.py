"""Tetrahedra by gmsh. The only module that imports it."""

import numpy as np
from numpy.typing import NDArray

from mechanics.meshing.mesh import SolidMesh, tet_mesh
from moma.errors import MeshError, MissingLibraryError

__all__ = ["mesh_with_gmsh"]

# what gmsh's wheel needs from a bare Debian or Ubuntu
_SYSTEM_PACKAGES = "libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1"


def mesh_with_gmsh(
    vertices: NDArray[np.float64], faces: tuple[tuple[int, ...], ...], size: float, code: str
) -> SolidMesh:
    """Mesh one polyhedron with linear tetrahedra of edge length about `size` [m].

    The model is built at unit size, so that gmsh's absolute tolerances mean the same for every stone, and in
    one thread, so that the mesh of a stone is always the same.

    Raises
    ------
    MissingLibraryError : if gmsh's shared libraries are absent
    MeshError : if gmsh cannot mesh the stone
    """
    try:
        import gmsh
    except OSError as error:
        raise MissingLibraryError(
            f"gmsh cannot be loaded: {error}", remedy=f"install the system packages {_SYSTEM_PACKAGES}"
        ) from error
    if not gmsh.isInitialized():
        gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    origin, scale = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max())
    for option, value in (("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.RandomSeed", 1)):
        gmsh.option.setNumber(option, value)
    gmsh.model.add(code)
    try:
        nodes, tetrahedra = _generate(gmsh, (vertices - origin) / scale, faces, size / scale)
    except Exception as error:  # gmsh raises bare exceptions
        raise MeshError(
            f"gmsh failed: {error}",
            where=f"stone {code}",
            remedy="check that the stone's faces are planar and closed",
        ) from error
    finally:
        gmsh.model.remove()
    return tet_mesh(nodes * scale + origin, tetrahedra, vertices, faces, code)


def _generate(
    gmsh: object, vertices: NDArray[np.float64], faces: tuple[tuple[int, ...], ...], size: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    geo, mesh = gmsh.model.geo, gmsh.model.mesh  # type: ignore[attr-defined]
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
    mesh.generate(3)
    tags, coordinates, _ = mesh.getNodes()
    kinds, _, node_tags = mesh.getElements(3)
    (tetrahedra,) = (np.asarray(t) for kind, t in zip(kinds, node_tags, strict=True) if kind == 4)
    position = np.zeros(int(max(tags)) + 1, dtype=np.int64)
    position[np.asarray(tags, dtype=np.int64)] = np.arange(len(tags))
    return np.asarray(coordinates).reshape(-1, 3), position[tetrahedra.astype(np.int64)].reshape(-1, 4)
