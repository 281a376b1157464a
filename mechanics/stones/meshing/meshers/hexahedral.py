"""Structured hexahedra for stones with six faces and eight corners."""

import numpy as np

from ground.errors import MeshError
from mechanics.arrays import Array
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh, solid_mesh
from mechanics.stones.meshing.sizes import SizeField, as_field

Faces = tuple[tuple[int, ...], ...]

_STATIONS = 64  # parts in which a direction is measured where the size changes
# the corners at the start and at the end of the four edges along each direction of a hexahedron, VTK's order
_EDGES = (((0, 3, 4, 7), (1, 2, 5, 6)), ((0, 1, 4, 5), (3, 2, 7, 6)), ((0, 1, 2, 3), (4, 5, 6, 7)))


def mesh_with_hexahedra(vertices: Array, faces: Faces, size: SizeField | float, code: str) -> SolidMesh:
    """Mesh a stone with linear hexahedra: the trilinear map of a cube that is cut into parts.

    In each direction there are as many parts as the mean edge holds `size` [m], at least one; equal parts, or
    in the proportion of the sizes between the middles of opposite sides.

    Raises
    ------
    MeshError : if the stone lacks the corners, edges and faces of a cube, or its cells would be inside out
    """
    corners = vertices[_corners(faces, len(vertices), code)]
    cuts = [_cuts(corners[list(a)], corners[list(b)], as_field(size)) for a, b in _EDGES]
    counts = np.array([len(cut) - 1 for cut in cuts])
    x, y, z = np.meshgrid(*cuts, indexing="ij")
    grid = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    nodes = _trilinear(grid) @ corners
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    first = (
        np.stack(np.meshgrid(*(np.arange(n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 3)
        @ strides
    )
    steps = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    return solid_mesh(Element.HEX8, nodes, first[:, None] + steps @ strides, vertices, faces, code)


def _corners(faces: Faces, count: int, code: str) -> list[int]:
    """Return the stone's corners in VTK's order of a hexahedron whose bottom is the first face."""
    neighbours: dict[int, set[int]] = {corner: set() for corner in range(count)}
    for face in faces:
        for a, b in zip(face, (*face[1:], face[0]), strict=True):
            neighbours[a].add(b)
            neighbours[b].add(a)
    like_a_cube = count == 8 and sorted(map(len, faces)) == [4] * 6
    if not like_a_cube or any(len(around) != 3 for around in neighbours.values()):
        raise MeshError(
            f"hexahedra need six faces with four corners each, found {count} corners and faces with "
            f"{', '.join(str(len(face)) for face in faces)}",
            where=f"stone {code}",
            remedy="use element = tet10",
        )
    bottom = list(faces[0][::-1])  # counter-clockwise seen from above
    top = [next(iter(neighbours[corner] - set(bottom))) for corner in bottom]
    return bottom + top


def _cuts(start: Array, end: Array, size: SizeField) -> Array:
    """Return places (n + 1,) from 0 to 1 between opposite sides, given the ends (4, 3) of the edges that join them."""
    length = float(np.linalg.norm(end - start, axis=1).mean())
    if size.uniform:
        n = max(1, round(length / size.size))
        return np.arange(n + 1) / n
    middle = (np.arange(_STATIONS) + 0.5)[:, None] / _STATIONS
    parts = length / _STATIONS / size((1.0 - middle) * start.mean(axis=0) + middle * end.mean(axis=0))
    total = np.concatenate([[0.0], np.cumsum(parts)])
    n = max(1, round(float(total[-1])))
    places: Array = np.interp(total[-1] * np.arange(n + 1) / n, total, np.arange(_STATIONS + 1) / _STATIONS)
    return places


def _trilinear(grid: Array) -> Array:
    """Return weights (n, 8) of the corners at places (n, 3) of the unit cube."""
    (x, y, z), (u, v, w) = grid.T, 1.0 - grid.T
    return np.column_stack(
        [u * v * w, x * v * w, x * y * w, u * y * w, u * v * z, x * v * z, x * y * z, u * y * z]
    )
