"""The mesh of one stone, and its boundary."""

from dataclasses import dataclass, replace

import numpy as np

from ground.errors import MeshError
from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.shape_functions import integration, jacobians
from mechanics.stones.polyhedra import face_plane, face_planes, mass_properties

Faces = tuple[tuple[int, ...], ...]

_OFF_FACE = 1e-6  # largest distance of a boundary facet from the stone's face, over the stone's size
_SAME_VOLUME = 1e-6  # largest difference of the volumes of mesh and stone, over the stone's


@dataclass(frozen=True)
class VolumeMesh:
    """The finite elements of one stone; edges are straight, with nodes at their middle.

    Attributes
    ----------
    element : kind of all cells
    nodes : (n, 3) [m]
    cells : (nc, element.cell_nodes) node indices in VTK's order, positive volume
    """

    element: Element
    nodes: Array
    cells: Ints


@dataclass(frozen=True)
class SolidMesh(VolumeMesh):
    """The finite elements of one stone, and the facets of its boundary.

    Attributes
    ----------
    facets : (ns, element.facet_nodes) boundary node indices in VTK's order, corners counter-clockwise seen from outside
    facet_face : (ns,) the stone's face that each boundary facet lies on
    """

    facets: Ints
    facet_face: Ints


def boundary_facets(element: Element, cells: Ints) -> Ints:
    """Return the facets (ns, element.facet_nodes) of a single cell, oriented outwards."""
    facets = cells[:, element.cell_facets].reshape(-1, element.facet_nodes)
    _, first, count = np.unique(_names(facets, element), return_index=True, return_counts=True)
    boundary: Ints = facets[np.sort(first[count == 1])]
    return boundary


def _names(facets: Ints, element: Element) -> Ints:
    """Return one number for each facet (ns, kf), the same for facets with the same corners."""
    corners = np.sort(facets[:, : element.facet_corners], axis=1)
    nodes = int(corners.max()) + 1
    if nodes**element.facet_corners < 2**63:  # digits in a number system whose base is the number of nodes
        powers = [nodes**k for k in range(element.facet_corners)]
        names: Ints = corners @ np.array(powers, dtype=np.int64)
        return names
    _, number = np.unique(corners, axis=0, return_inverse=True)
    return number.reshape(-1).astype(np.int64)


def tet_mesh(nodes: Array, tetrahedra: Ints, vertices: Array, faces: Faces, code: str) -> SolidMesh:
    """Orient linear tetrahedra and drop unused nodes; the rest as in `solid_mesh`."""
    volumes = np.linalg.det(nodes[tetrahedra[:, 1:]] - nodes[tetrahedra[:, :1]]) / 6.0
    tetrahedra = np.where((volumes < 0)[:, None], tetrahedra[:, [0, 2, 1, 3]], tetrahedra)
    used = np.zeros(len(nodes), dtype=bool)
    used[tetrahedra] = True
    number = np.cumsum(used) - 1
    return solid_mesh(Element.TET4, nodes[used], number[tetrahedra], vertices, faces, code)


def solid_mesh(
    element: Element, nodes: Array, cells: Ints, vertices: Array, faces: Faces, code: str
) -> SolidMesh:
    """Find the face of the stone that each boundary facet lies on, and check that the cells fill the stone.

    Parameters
    ----------
    element : linear
    nodes, cells : (n, 3) [m] and (nc, element.cell_nodes)
    vertices, faces : the stone
    code : its name

    Raises
    ------
    MeshError : if a cell is inside out, a boundary facet lies on no face, or the volumes differ
    """
    where = f"stone {code}"
    volume = _volumes(element, nodes, cells, where)
    facets = boundary_facets(element, cells)
    facet_face = _faces_of(nodes[facets], vertices, faces, where)
    whole = mass_properties(vertices, faces, where).volume
    if abs(volume - whole) > _SAME_VOLUME * whole:
        raise MeshError(
            f"the mesh fills {volume:.6g} m³ of the stone's {whole:.6g} m³",
            where=where,
            remedy="give a smaller mesh size, or check that the stone's faces close and do not cross",
        )
    return SolidMesh(element, nodes, cells, facets, facet_face)


def _volumes(element: Element, nodes: Array, cells: Ints, where: str) -> float:
    """Return the volume of all cells [m³]; the Jacobian of each must be positive everywhere."""
    determinant = jacobians(element, nodes, cells)
    worst = int(determinant.min(axis=1).argmin())
    if not determinant[worst].min() > 0:
        raise MeshError(
            f"cell {worst} is flat or turned inside out",
            where=where,
            remedy="give another mesh size, or element = tet10 for stones that are not nearly boxes",
        )
    if element.is_tetrahedron:
        return float(determinant.sum()) / 6.0
    return float(integration(element, nodes, cells, 3).volume.sum())


def _faces_of(facets: Array, vertices: Array, faces: Faces, where: str) -> Ints:
    """Return the face (ns,) that each facet (ns, kf, 3) lies on."""
    size = float(np.ptp(vertices, axis=0).max())
    normals, origins = face_planes(vertices, faces)
    about = vertices.mean(axis=0)  # far from the origin the products would lose digits
    offsets = (normals * (origins - about)).sum(axis=1)
    distance = np.abs((facets - about) @ normals.T - offsets).max(axis=1)
    facet_face: Ints = distance.argmin(axis=1).astype(np.int64)
    worst = float(distance.min(axis=1).max())
    if worst > _OFF_FACE * size:
        raise MeshError(
            f"a boundary facet lies {worst:.2e} m off the stone's faces",
            where=where,
            remedy="give a smaller mesh size, or make the stone's faces planar",
        )
    # of a stone that is not convex several faces may lie on one plane
    on_plane = distance < _OFF_FACE * size
    for n in np.flatnonzero(on_plane.sum(axis=1) > 1):
        centre = facets[n].mean(axis=0)
        candidates = np.flatnonzero(on_plane[n])
        angles = [_winding(centre, vertices[list(faces[k])]) for k in candidates]
        facet_face[n] = candidates[int(np.argmax(angles))]
    return facet_face


def _winding(point: Array, polygon: Array) -> float:
    """Return the angle [rad] by which a polygon turns round a point of its plane: 2π inside, 0 outside."""
    normal, _ = face_plane(polygon)
    rays = polygon - point
    following = np.roll(rays, -1, axis=0)
    sines, cosines = np.cross(rays, following) @ normal, np.einsum("ij,ij->i", rays, following)
    return float(np.arctan2(sines, cosines).sum())


def with_middle_nodes(mesh: SolidMesh, element: Element) -> SolidMesh:
    """Add middle nodes at the mean of their corners to a mesh of linear cells, shared by neighbouring cells.

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
