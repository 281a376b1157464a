"""Hexahedra for convex stones of any shape whose corners each join three faces: wedges, prisms, cut-off blocks.

A stone is cut into one hexahedron for each of its corners, between the corner, the middles of its three edges, the
centres of its three faces and the centre of the stone; each of these into n × n × n.
"""

import numpy as np

from ground.errors import MeshError
from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh, solid_mesh
from mechanics.stones.meshing.sizes import SizeField, as_field

Faces = tuple[tuple[int, ...], ...]

_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])


def mesh_at_corners(vertices: Array, faces: Faces, size: SizeField | float, code: str) -> SolidMesh:
    """Mesh a stone with linear hexahedra of edge length about `size` [m], the same number n along all edges.

    Raises
    ------
    MeshError : if a corner joins more than three faces, or cells would be inside out
    """
    blocks, members = _blocks(faces, code)
    # every point is a mean of corners: of one, of an edge, of a face, or of all
    base = np.array([vertices[list(member)].mean(axis=0) for member in members])
    lengths = np.linalg.norm(base[blocks[:, [1, 3, 4]]] - base[blocks[:, :1]], axis=-1)
    n = max(1, round(float((lengths / as_field(size)(base[blocks[:, 0]])[:, None]).mean())))
    cells, weights = _refined(blocks, len(base), n)
    return solid_mesh(Element.HEX8, weights @ base / n**3, cells, vertices, faces, code)


def _blocks(faces: Faces, code: str) -> tuple[Ints, list[tuple[int, ...]]]:
    """Return one hexahedron for each corner (nv, 8), between points that are means of the stone's corners."""
    used = sorted({corner for face in faces for corner in face})
    members: list[tuple[int, ...]] = [(corner,) for corner in used]
    number: dict[tuple[int, ...], int] = {member: k for k, member in enumerate(members)}

    def point(*corners: int) -> int:
        """Return the number of the mean of some corners, new where there is none yet."""
        key = tuple(sorted(corners))
        if key not in number:
            number[key] = len(members)
            members.append(key)
        return number[key]

    # the face that a corner has between the edges to the corners before and after it
    between: dict[int, list[tuple[int, int, int]]] = {corner: [] for corner in used}
    for k, face in enumerate(faces):
        for before, corner, after in zip((face[-1], *face[:-1]), face, (*face[1:], face[0]), strict=True):
            between[corner].append((before, after, k))
    crowded = [corner for corner in used if len(between[corner]) != 3]
    if crowded:
        raise MeshError(
            f"hexahedra need three faces at each corner, found {len(between[crowded[0]])} at corner {crowded[0]}",
            where=f"stone {code}",
            remedy="use element = tet10",
        )
    rows = []
    for corner in used:
        face_of = {frozenset((before, after)): k for before, after, k in between[corner]}
        # edges to the corners before and after in a face and to the third form a right-handed triple
        a, b, _ = between[corner][0]
        (c,) = {neighbour for before, after, _ in between[corner] for neighbour in (before, after)} - {a, b}
        ab, bc, ca = (faces[face_of[frozenset(two)]] for two in ((a, b), (b, c), (c, a)))
        rows.append(
            (
                *(point(corner), point(corner, a), point(*ab), point(corner, b)),
                *(point(corner, c), point(*ca), point(*used), point(*bc)),
            )
        )
    return np.array(rows), members


def _refined(blocks: Ints, points: int, n: int) -> tuple[Ints, Ints]:
    """Return cells (nc, 8), and whole-numbered weights (nodes, points) of the points that make n³ times each node."""
    lattice = np.stack(np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    share = np.where(_CORNERS, lattice[:, None], n - lattice[:, None]).prod(
        axis=-1
    )  # (n+1)³ places, 8 corners
    rows = np.zeros((len(blocks), len(lattice), points), dtype=np.int64)
    rows[np.arange(len(blocks))[:, None, None], np.arange(len(lattice))[:, None], blocks[:, None]] = share
    # a node that two blocks share has the same weights in both
    weights, node = np.unique(rows.reshape(-1, points), axis=0, return_inverse=True)
    stride = np.array([(n + 1) ** 2, n + 1, 1])
    first = lattice[(lattice < n).all(axis=1)] @ stride
    local = first[:, None] + _CORNERS @ stride
    return node.reshape(len(blocks), -1)[:, local].reshape(-1, 8).astype(np.int64), weights
