"""Tetrahedra by scipy's Delaunay triangulation, for convex stones.

Points are laid on edges, faces and inside, as far apart as the size field asks for; triangulated, moved to the middle
of their tetrahedra and triangulated again; then the nodes of badly shaped tetrahedra are moved to better places. Points
stay on the faces that they lie on, so the mesh fills the stone exactly.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, QhullError

from ground.errors import MeshError
from mechanics.arrays import Array, Bools, Ints
from mechanics.stones.meshing.mesh import SolidMesh, tet_mesh
from mechanics.stones.meshing.meshers._kernels.sampling import Polyhedron, Sizes, lay_points
from mechanics.stones.meshing.meshers._kernels.shaping import relax
from mechanics.stones.meshing.meshers.slivers import improve_cells
from mechanics.stones.meshing.sizes import SizeField, as_field
from mechanics.stones.meshing.soundness import CONVEX
from mechanics.stones.polyhedra import face_planes

Faces = tuple[tuple[int, ...], ...]

# on a regular lattice four points lie on a plane and five on a sphere, where Delaunay makes flat tetrahedra
_JITTER = 0.06  # largest shift of a point off the lattice, over the size
_RELAXATIONS = 1  # rounds in which points move to the middle of their tetrahedra and are triangulated again


@dataclass(frozen=True)
class _Cloud:
    """Points of a mesh.

    Attributes
    ----------
    points : (n, 3)
    on_plane : (n, m) True for the planes of each: three or more for corners, two for points on edges
    free : (n, 3, 3) projectors on the directions in which they may move
    """

    points: Array
    on_plane: Bools
    free: Array


def mesh_with_delaunay(vertices: Array, faces: Faces, size: SizeField | float, code: str) -> SolidMesh:
    """Mesh one convex polyhedron with linear tetrahedra of edge length about `size` [m].

    Raises
    ------
    MeshError : if it is not convex, or the mesh does not fill it
    """
    origin = vertices.mean(axis=0)
    reach = float(np.linalg.norm(vertices - origin, axis=1).max())
    corners, field = (vertices - origin) / reach, as_field(size).local(origin, reach)
    planes = _planes(corners, faces)
    if (corners @ planes[:, :3].T - planes[:, 3]).max() > CONVEX:
        raise MeshError("it is not convex", where=f"stone {code}", remedy="mesh it with gmsh")
    cloud = _cloud(corners, faces, planes, field)
    try:
        nodes, cells = _filled(cloud, planes, field, code, loose=False)
        return tet_mesh(nodes * reach + origin, cells, vertices, faces, code)
    except MeshError:
        nodes, cells = _filled(cloud, planes, field, code, loose=True)
        return tet_mesh(nodes * reach + origin, cells, vertices, faces, code)


def _filled(cloud: _Cloud, planes: Array, field: SizeField, code: str, loose: bool) -> tuple[Array, Ints]:
    """Return nodes (n, 3), and tetrahedra between them.

    Nodes on edges stay at equal parts where possible, so that neighbours meet node on node; with `loose` they move, as
    four of them on two parallel edges may make a flat tetrahedron.
    """
    free = cloud.free.copy()
    if not loose:
        free[cloud.on_plane.sum(axis=1) > 1] = 0.0
    nodes = _jittered(cloud.points, free, planes, cloud.on_plane, field)
    weight = field(nodes) ** 3
    cells = _triangulated(nodes, cloud.on_plane, code)
    for _ in range(_RELAXATIONS):
        relax(nodes, cells, free, planes, cloud.on_plane, weight)
        cells = _triangulated(nodes, cloud.on_plane, code)
    improve_cells(nodes, cells, cloud.free)
    return nodes, cells


def _planes(corners: Array, faces: Faces) -> Array:
    """Return rows (n, d) of the faces, with n·x ≤ d inside."""
    normals, origins = face_planes(corners, faces)
    return np.column_stack([normals, (normals * origins).sum(axis=1)])


def _cloud(corners: Array, faces: Faces, planes: Array, field: SizeField) -> _Cloud:
    sides: dict[tuple[int, int], list[int]] = {}
    for k, face in enumerate(faces):
        for a, b in zip(face, (*face[1:], face[0]), strict=True):
            sides.setdefault((min(a, b), max(a, b)), []).append(k)
    edges = np.array(sorted(sides), dtype=np.int64)
    loops = np.concatenate([np.array(face, dtype=np.int64) for face in faces])
    start = np.cumsum([0, *map(len, faces)]).astype(np.int64)
    stone = Polyhedron(corners, edges, loops, start, planes, _axes(planes))
    sizes = Sizes(float(field.size), float(field.fine), float(field.growth), field.normals, field.offsets)
    points, ends, owner = lay_points(stone, sizes)
    own_edge, own_face = owner[ends[0] : ends[1]], owner[ends[1] : ends[2]]
    on_plane = np.zeros((len(points), len(faces)), dtype=bool)
    on_plane[loops, np.repeat(np.arange(len(faces)), np.diff(start))] = True
    neighbours = np.array([sides[a, b] for a, b in edges.tolist()])
    rows = np.arange(ends[0], ends[1])
    on_plane[rows, neighbours[own_edge, 0]] = on_plane[rows, neighbours[own_edge, 1]] = True
    on_plane[np.arange(ends[1], ends[2]), own_face] = True
    free = np.zeros((len(points), 3, 3))
    normals = planes[own_face, :3]
    along = corners[edges[own_edge, 1]] - corners[edges[own_edge, 0]]
    along /= np.linalg.norm(along, axis=1)[:, None]
    free[ends[0] : ends[1]] = along[:, :, None] * along[:, None]
    free[ends[1] : ends[2]] = np.eye(3) - normals[:, :, None] * normals[:, None]
    free[ends[2] :] = np.eye(3)
    return _Cloud(points, on_plane, free)


def _axes(planes: Array) -> Array:
    """Return rows: directions of the lattice, along the first face and across it."""
    z = planes[0, :3]
    away = planes[1:, :3] - np.outer(planes[1:, :3] @ z, z)
    lengths = np.linalg.norm(away, axis=1)
    # the first of equal ones, independent of rounding
    first = int((lengths > (1.0 - CONVEX) * lengths.max()).argmax())
    x = away[first] / lengths[first]
    return np.array([x, np.cross(z, x), z])


def _jittered(cloud: Array, free: Array, planes: Array, on_plane: Bools, field: SizeField) -> Array:
    """Move each point a little, always in the same way; none loses more than half of its distance from a face."""
    depth = np.where(on_plane, np.inf, np.abs(planes[:, 3] - cloud @ planes[:, :3].T)).min(axis=1)
    room = _JITTER * np.minimum(field(cloud), depth)
    golden = np.array([0.8191725134, 0.6710436067, 0.5497004779])  # evenly spread, and the same everywhere
    moves = 2.0 * np.modf(np.arange(1, len(cloud) + 1)[:, None] * golden)[0] - 1.0
    jittered: Array = cloud + room[:, None] * np.einsum("nij,nj->ni", free, moves)
    return jittered


def _triangulated(nodes: Array, on_plane: Bools, code: str) -> Ints:
    try:
        tetrahedra = Delaunay(nodes).simplices.astype(np.int64)
    except QhullError as error:
        raise MeshError(
            f"Delaunay failed: {str(error).splitlines()[0]}",
            where=f"stone {code}",
            remedy="give another mesh size",
        ) from error
    flat = (on_plane[tetrahedra].sum(axis=1) == 4).any(axis=1)
    cells = tetrahedra[~flat]
    volumes = np.linalg.det(nodes[cells[:, 1:]] - nodes[cells[:, :1]])
    turned: Ints = np.where((volumes < 0)[:, None], cells[:, [0, 2, 1, 3]], cells)
    return turned
