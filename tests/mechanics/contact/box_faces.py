"""Meshed faces of two boxes that lie on one another, for the tests of weighted contacts."""

import itertools

import numpy as np

from mechanics.contact.face_meshes import FaceMesh
from mechanics.contact.surfaces import Placed, middles, surfaces
from mechanics.scene.shapes import BOX_FACES
from tests.pipelines.results_by_hand import box

KINDS = (3, 4, 6, 8, 9)
# the faces z = low and z = high of a box
BOTTOM, TOP = (
    next(i for i, f in enumerate(BOX_FACES) if np.ptp(box((0, 0, 0), (1, 1, 1))[list(f), 2]) == 0
         and box((0, 0, 0), (1, 1, 1))[f[0], 2] == z)
    for z in (0, 1)
)  # fmt: skip

_SQUARE = [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0), (0, 0)]
_TRIANGLE = [(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)]


def nodes_of(kind):
    """Reference coordinates of the nodes of a facet."""
    return np.array((_TRIANGLE if kind in (3, 6) else _SQUARE)[:kind], dtype=float)


def grid_mesh(kind, corners, nx, ny, start=0, uneven=0.0, seed=0):
    """A face mesh on the parallelogram o, o + u, ·, o + v given by its corners (4, 3), counter-clockwise from outside.

    With `uneven` the inner corners are moved by up to that part of a facet.
    """
    rng = np.random.default_rng(seed)
    o, u, v = corners[0], corners[1] - corners[0], corners[3] - corners[0]
    x = []
    for j, i in itertools.product(range(ny + 1), range(nx + 1)):
        inner = 0 < i < nx and 0 < j < ny
        move = rng.uniform(-uneven, uneven, 2) if inner else np.zeros(2)
        x.append(o + (i + move[0]) / nx * u + (j + move[1]) / ny * v)
    number = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    quads = np.column_stack([a, b, c, d])
    cells = np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]) if kind in (3, 6) else quads
    rows, middle = [], {}
    for cell in cells.tolist():
        edges = [tuple(sorted(pair)) for pair in zip(cell, [*cell[1:], cell[0]], strict=True)]
        for one, other in edges if kind in (6, 8, 9) else ():
            if (one, other) not in middle:
                middle[one, other] = len(x)
                x.append((x[one] + x[other]) / 2)
        row = cell + [middle[edge] for edge in edges if kind in (6, 8, 9)]
        if kind == 9:
            row.append(len(x))
            x.append(np.mean([x[k] for k in cell], axis=0))
        rows.append(row)
    return FaceMesh(start + np.arange(len(x)), np.array(x), np.array(rows))


def two_boxes(lower, upper, mesh_lower, mesh_upper, turn=None):
    """Surfaces and places of two boxes (low, high), the upper one turned about z by `turn` [rad] in place.

    A mesh is (kind, nx, ny, uneven) of the lower's top, or of the upper's bottom face; None: the box is rigid. Node
    places (nn, 3) are returned too.
    """
    vertices, meshes, start = [box(*lower), box(*upper)], [], 0
    for b, (own, wanted) in enumerate(((TOP, mesh_lower), (BOTTOM, mesh_upper))):
        for f, face in enumerate(BOX_FACES):
            if wanted is None:
                meshes.append(None)
                continue
            kind, nx, ny, uneven = wanted
            if f == own:
                meshes.append(grid_mesh(kind, vertices[b][list(face)], nx, ny, start, uneven, seed=b))
            else:
                meshes.append(FaceMesh(np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, kind), int)))
            start += len(meshes[-1].node)
    shapes = surfaces(vertices, [BOX_FACES, BOX_FACES], meshes, [0, 1])
    c, s = np.cos(turn or 0.0), np.sin(turn or 0.0)
    rotation = np.array([np.eye(3), [[c, -s, 0], [s, c, 0], [0, 0, 1]]])
    centre = np.zeros((2, 3))
    vertex = np.vstack([vertices[0], vertices[1] @ rotation[1].T])
    normal = np.vstack([shapes.shapes.normal[:6], shapes.shapes.normal[6:] @ rotation[1].T])
    nodes = [mesh.reference @ rotation[f // 6].T for f, mesh in enumerate(meshes) if mesh is not None]
    return (
        shapes,
        Placed(
            shapes.shapes._replace(vertex=vertex, normal=normal, inside=middles(shapes.shapes.vptr, vertex)),
            centre,
            rotation,
        ),
        np.vstack([*nodes, np.zeros((0, 3))]),
    )
