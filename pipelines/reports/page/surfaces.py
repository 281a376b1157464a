"""Surfaces of stones as one mesh, and their motion as rigid bodies."""

from collections.abc import Sequence

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from pipelines.reports.page.model import Stones
from survey.conventions import ALIKE
from survey.geometry.solids import Solid
from survey.geometry.watertight import triangulate

Faces = Sequence[Sequence[int]]
Shape = tuple[Array, Faces]
"""Points (n, 3) of one stone [m], and its faces, counter-clockwise seen from outside."""

_CREASE = np.cos(ALIKE)  # of the angle between facets from which their edge is drawn [-]


def stones_of(
    codes: Sequence[str], shapes: Sequence[Shape], meshed: Sequence[bool] = ()
) -> tuple[Stones, Ints]:
    """Return the mesh of all surfaces, and the row of each vertex among the points of all stones.

    Parameters
    ----------
    codes, shapes : of the stones
    meshed : stones whose faces are facets of a finite-element mesh: only creases are drawn as edges
    """
    counts = [len(points) for points, _ in shapes]
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    points = np.concatenate([np.zeros((0, 3)), *(points for points, _ in shapes)])
    body = np.repeat(np.arange(len(shapes)), counts)
    soft = np.zeros(len(shapes), dtype=bool)
    soft[: len(meshed)] = meshed
    triangles, edges, owners = [], [], []
    for polygons in _by_size(shapes, starts):
        triangles.append(_triangles(points, polygons))
        sides = np.stack([polygons, np.roll(polygons, -1, axis=1)], axis=2).reshape(-1, 2)
        edges.append(sides)
        owners.append(np.repeat(body[polygons[:, 0]], polygons.shape[1]))
    flat = np.concatenate([np.zeros((0, 3), np.int64), *triangles])
    sides = np.concatenate([np.zeros((0, 2), np.int64), *edges])
    owner = np.concatenate([np.zeros(0, np.int64), *owners])
    drawn = np.concatenate([sides[~soft[owner]], _creases(points, flat[soft[body[flat[:, 0]]]])])
    drawn = np.unique(np.sort(drawn, axis=1), axis=0)
    flat = flat[np.argsort(body[flat[:, 0]], kind="stable")]
    rows = np.unique(np.concatenate([flat.ravel(), drawn.ravel()]))
    number = np.zeros(len(points), dtype=np.int64)
    number[rows] = np.arange(len(rows))
    return Stones(codes, points[rows], body[rows], number[flat], number[drawn]), rows


def _by_size(shapes: Sequence[Shape], starts: Ints) -> list[Ints]:
    """Return the faces of all stones as rows of points, together those of one number of corners."""
    rows: dict[int, list[Sequence[int]]] = {}
    first: dict[int, list[int]] = {}
    for (_, faces), start in zip(shapes, starts[:-1].tolist(), strict=True):
        for face in faces:
            rows.setdefault(len(face), []).append(face)
            first.setdefault(len(face), []).append(start)
    return [np.array(rows[size]) + np.array(first[size])[:, None] for size in sorted(rows)]


def _triangles(points: Array, polygons: Ints) -> Ints:
    """Return the triangles (m, 3) of flat polygons (n, k): fans, or what the triangulation of solids finds."""
    size = polygons.shape[1]
    if size == 3:
        return polygons
    fan = np.stack(
        [np.column_stack([polygons[:, 0], polygons[:, i], polygons[:, i + 1]]) for i in range(1, size - 1)],
        axis=1,
    )
    corners = points[fan]
    areas = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    whole = areas.sum(axis=1, keepdims=True)
    turned = (np.sum(areas * whole, axis=2) < 0).any(axis=1)
    parts = [fan[~turned].reshape(-1, 3)]
    for polygon in polygons[turned]:
        alone = triangulate(Solid("", points[polygon], (tuple(range(size)),)))
        parts.append(polygon[np.asarray(alone, dtype=np.int64)])
    return np.concatenate(parts)


def _creases(points: Array, triangles: Ints) -> Ints:
    """Return the edges (m, 2) at which facets meet at an angle, or that bound a surface."""
    if not len(triangles):
        return np.zeros((0, 2), np.int64)
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    sides = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    facet = np.tile(np.arange(len(triangles)), 3)
    edges, place, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(place.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    a, b = facet[order[first]], facet[order[first + np.minimum(count, 2) - 1]]
    folded = np.sum(normal[a] * normal[b], axis=1) < _CREASE
    return np.asarray(edges[folded | (count != 2)], dtype=np.int64)


def rigid_motion(
    references: Sequence[Array], frames: Sequence[Sequence[Array]], soft: Bools
) -> tuple[Array, Array, Array]:
    """Return centres (n, 3), their displacements and the rotation vectors (nf, n, 3) of stones.

    Exact for rigid stones, from three of their points; the best fit for deformable ones.

    Parameters
    ----------
    references : points of each stone at the start [m]
    frames : the same points in each instant
    soft : (n,) deformable stones
    """
    starts = np.concatenate([[0], np.cumsum([len(points) for points in references])]).astype(np.int64)
    chosen = starts[:-1, None] + _three(references)
    centres = np.array([points.mean(axis=0) for points in references]).reshape(-1, 3)
    start = np.concatenate([np.zeros((0, 3)), *references])
    then = _axes(start[chosen])
    shift = np.zeros((len(frames), len(references), 3))
    turn = np.zeros_like(shift)
    for number, places in enumerate(frames):
        three = np.concatenate([np.zeros((0, 3)), *places])[chosen]
        matrix = _axes(three) @ then.transpose(0, 2, 1)
        centre = three[:, 0] + np.einsum("nij,nj->ni", matrix, centres - start[chosen[:, 0]])
        for body in np.flatnonzero(soft).tolist():
            matrix[body], centre[body] = _fit(references[body] - centres[body], places[body])
        shift[number], turn[number] = centre - centres, _rotation_vectors(matrix)
    return centres, shift, turn


def _three(stones: Sequence[Array]) -> Ints:
    """Return three points (n, 3) of each stone that span a wide triangle."""
    chosen = np.zeros((len(stones), 3), dtype=np.int64)
    counts = np.array([len(points) for points in stones])
    for count in np.unique(counts).tolist():
        rows = np.flatnonzero(counts == count)
        arms = np.array([stones[row] for row in rows.tolist()])
        arms -= arms[:, :1]
        farthest = np.argmax(np.sum(arms**2, axis=2), axis=1)
        away = np.cross(arms, arms[np.arange(len(rows)), farthest][:, None])
        chosen[rows, 1], chosen[rows, 2] = farthest, np.argmax(np.sum(away**2, axis=2), axis=1)
    return chosen


def _axes(three: Array) -> Array:
    """Return right-handed orthonormal columns (n, 3, 3) from triangles (n, 3, 3)."""
    along = three[:, 1] - three[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, three[:, 2] - three[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.stack([along, across, np.cross(along, across)], axis=2)


def _fit(arms: Array, places: Array) -> tuple[Array, Array]:
    """Return the rotation nearest to that of arms (n, 3) about their mean to places (Kabsch 1976), and the mean."""
    mean = places.mean(axis=0)
    u, _, vt = np.linalg.svd((places - mean).T @ arms)
    u[:, 2] *= np.sign(np.linalg.det(u @ vt))
    return u @ vt, mean


def _rotation_vectors(matrices: Array) -> Array:
    """Return the rotation vectors (n, 3) of rotation matrices."""
    from scipy.spatial.transform import Rotation

    sine = 0.5 * np.stack(
        [
            matrices[:, 2, 1] - matrices[:, 1, 2],
            matrices[:, 0, 2] - matrices[:, 2, 0],
            matrices[:, 1, 0] - matrices[:, 0, 1],
        ],
        axis=1,
    )
    size, cosine = np.linalg.norm(sine, axis=1), 0.5 * (np.trace(matrices, axis1=1, axis2=2) - 1.0)
    # sin φ over φ is 1 to the last digit where sin φ is this small
    turn: Array = (
        np.where(size > 1e-9, np.arctan2(size, cosine) / np.maximum(size, 1e-9), 1.0)[:, None] * sine
    )
    # half a turn has no sine that gives its axis
    if (half := cosine < -0.5).any():
        turn[half] = Rotation.from_matrix(matrices[half]).as_rotvec()
    return turn
