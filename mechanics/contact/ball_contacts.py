"""A ball on a meshed face: one weighted point per corner node of the face mesh, so that pressures follow the curve."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, vstack

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact._kernels.mortar import Bodies, FacePairs, mortar_rows
from mechanics.contact.contacts import NODE, Contacts
from mechanics.contact.surfaces import Placed, Surfaces
from mechanics.scene.state import State

# share of the radius: where a ball would penetrate deeper before a node sees it, or its surface rises by more over the
# area of a node, the mesh is too coarse
_UNSEEN = 1e-3
_WIDEST = 0.1  # cosine of the widest angle between the normals of ball and face


@dataclass(frozen=True)
class FaceCells:
    """Test functions ψ of the corner nodes of the meshed faces, integrated over whole faces.

    Attributes
    ----------
    pointer : (nf+1,) rows of each face
    node : (n,) numbered over all deformable bodies
    area : (n,) ∫ψ [m²]
    middle : (n, 3) ∫ψ x / ∫ψ, body axes [m]
    spread : (n,) ∫ψ |x - middle|² / ∫ψ [m²]
    weights : (n, nn) csr of ∫ψ N / ∫ψ
    """

    pointer: Ints
    node: Ints
    area: Array
    middle: Array
    spread: Array
    weights: "csr_array[np.float64]"


def face_cells(surfaces: Surfaces, nodes: int) -> FaceCells:
    """Integrate the test functions of all meshed faces, over each face as a whole, as the mortar method does."""
    meshes = surfaces.meshes
    face = np.flatnonzero(meshes.of_face >= 0)
    origin = surfaces.shapes.vertex[surfaces.shapes.corner[surfaces.shapes.cptr[face]]]
    edge = surfaces.shapes.vertex[surfaces.shapes.corner[surfaces.shapes.cptr[face] + 1]] - origin
    n = surfaces.shapes.normal[face]
    t1 = edge - np.einsum("fi,fi->f", edge, n)[:, None] * n
    t1 = t1 / np.linalg.norm(t1, axis=1)[:, None]
    frame = np.stack([n, t1, np.cross(n, t1)], axis=1)
    size = np.diff(meshes.node_ptr)[meshes.of_face[face]]
    still = FacePairs(
        np.column_stack([meshes.of_face[face], np.full(len(face), -1)]),
        np.column_stack([face, face]),
        np.zeros((len(face), 2), dtype=np.int64),
        frame,
        origin,
        np.zeros(len(face)),
    )
    row, node, area, middle, pointer, column, value = mortar_rows(
        np.concatenate([[0], np.cumsum(size)]),
        np.ones(int(size.sum()), dtype=bool),
        still,
        Bodies(np.zeros((1, 3)), np.eye(3)[None]),
        meshes,
        surfaces.shapes,
        np.empty(int(size.sum())),
    )
    count = np.bincount(face[row], minlength=len(meshes.of_face))
    return FaceCells(
        np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        node,
        area,
        origin[row] + np.einsum("cd,cdi->ci", middle[:, :2], frame[row, 1:]),
        middle[:, 2] - (middle[:, :2] ** 2).sum(axis=1),
        csr_array((value, column, pointer[::2]), shape=(len(node), nodes)),
    )


def ball_contacts(
    surfaces: Surfaces,
    placed: Placed,
    state: State,
    cells: FaceCells,
    shapes: Ints,
    key: Ints,
    limit: Array,
    gap: Array,
) -> tuple[list[Contacts], Bools]:
    """Make weighted contacts of pairs (np, 2) of a ball and a deformable shape; return their pairs too.

    Of the face that lies farthest under the ball, every node within reach makes a contact; the meshed face is the
    candidate. Over its ψ the distance to the ball's centre has the mean |x̄ - c| + s²/2|x̄ - c| with s² the spread of
    ψ, so the gap is that mean less the radius, and the ball's material point lies this far below x̄.

    Parameters
    ----------
    shapes, key, limit : pairs, their first key and alert distance
    gap : (np,) between ball and undeformed shape [m]
    """
    seen, ball_pairs = np.zeros(len(shapes), dtype=bool), []
    for p, pair in enumerate(shapes):
        ball, antagonist = pair if surfaces.radius[pair[0]] > 0 else pair[::-1]
        rows = _face_rows(surfaces, placed, cells, ball, antagonist)
        radius, centre = surfaces.radius[ball], placed.centre[surfaces.body[ball]]
        body = surfaces.body[antagonist]
        at = (centre - placed.centre[body]) @ placed.rotation[body]
        before, _ = _gaps(cells.middle[rows], cells.spread[rows], at, radius)
        if len(before) == 0:
            continue
        nearest = before.argmin()
        curved = abs(cells.spread[rows][nearest]) / (2.0 * radius)
        seen[p] = max(before[nearest] - gap[p], curved) <= _UNSEEN * radius
        if seen[p]:
            ball_pairs.append(
                _pair(surfaces, placed, state, cells, rows, (ball, antagonist), key[p], limit[p])
            )
    return ball_pairs, seen


def _face_rows(surfaces: Surfaces, placed: Placed, cells: FaceCells, ball: int, shape: int) -> slice:
    """Return the cells of the face over which the centre of a ball lies highest."""
    faces = slice(surfaces.shapes.fptr[shape], surfaces.shapes.fptr[shape + 1])
    corner = placed.shapes.vertex[surfaces.shapes.corner[surfaces.shapes.cptr[faces]]]
    height = np.einsum("fi,fi->f", placed.centre[surfaces.body[ball]] - corner, placed.shapes.normal[faces])
    face = int(faces.start + height.argmax())
    return slice(int(cells.pointer[face]), int(cells.pointer[face + 1]))


def _gaps(middle: Array, spread: Array, centre: Array, radius: float) -> tuple[Array, Array]:
    """Return mean gaps (n,) of cells to a ball, and unit vectors (n, 3) from its centre to them."""
    away = middle - centre
    distance = np.linalg.norm(away, axis=1)
    return distance + spread / (2.0 * distance) - radius, away / distance[:, None]


def _pair(
    surfaces: Surfaces,
    placed: Placed,
    state: State,
    cells: FaceCells,
    rows: slice,
    pair: tuple[int, int],
    key: int,
    limit: float,
) -> Contacts:
    """Make the contacts of one ball and one shape."""
    ball, block = surfaces.body[pair[0]], surfaces.body[pair[1]]
    centre, radius = placed.centre[ball], surfaces.radius[pair[0]]
    weights = cells.weights[rows]
    middle = weights @ state.node
    gap, n = _gaps(middle, cells.spread[rows], centre, radius)
    # t1 along a block axis within the face, so that the frame turns with the block
    face = int(np.searchsorted(cells.pointer, rows.start, side="right") - 1)
    corners = placed.shapes.vertex[
        surfaces.shapes.corner[surfaces.shapes.cptr[face] : surfaces.shapes.cptr[face] + 2]
    ]
    edge = corners[1] - corners[0]
    t1 = edge - (n @ edge)[:, None] * n
    keep = np.flatnonzero((gap <= limit) & (n @ placed.shapes.normal[face] < -_WIDEST))
    t1 = t1[keep] / np.linalg.norm(t1[keep], axis=1)[:, None]
    n, gap = n[keep], gap[keep]
    frame = np.stack([n, t1, np.cross(n, t1)], axis=1)
    arm = np.zeros((len(keep), 2, 3))
    arm[:, 1] = (middle[keep] - gap[:, None] * n - centre) @ placed.rotation[ball]
    empty = csr_array((len(keep), weights.shape[1]))
    mixed = csr_array(vstack([weights[keep], empty], format="csr"))
    order = np.column_stack([np.arange(len(keep)), np.arange(len(keep)) + len(keep)]).ravel()
    return Contacts(
        np.tile([block, ball], (len(keep), 1)),
        key + NODE + cells.node[rows][keep],
        frame,
        cells.area[rows][keep],
        arm,
        mixed[order],
    )
