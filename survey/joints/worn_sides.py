"""Sides that touch no stone and have a worn corner: the foot of a wall, its end, a reveal, an intrados.

The measured corner lies back from the original one, so the plane through it is not the stone's. If three sound corners
are left they define the plane. Otherwise the side is extended to the nearest corner of a neighbour, as at the foot of
an arch; if there is none, neighbours that continue the side define its plane; and failing these, it is made parallel to
the opposite side if it is nearly so.
"""

import math
from collections.abc import Sequence

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.conventions import PARALLEL, WEAR
from survey.geometry.solids import Solid
from survey.joints.contact_planes import StoneFaces

_ALIKE = math.cos(PARALLEL)  # largest angle between sides that continue each other or are parallel


def mended_planes(
    faces: StoneFaces,
    rows: Array,
    free: Bools,
    neighbours: Ints,
    solids: Sequence[Solid],
    reach: float,
) -> Array:
    """Return the planes of all faces, with those of free sides with worn corners restored.

    Parameters
    ----------
    faces : of all stones
    rows : (nf, 4) their planes as measured
    free : (nf,) faces that belong to no joint
    neighbours : (n, 2) pairs of stones that share a joint
    solids : all stones, their joints closed as far as known
    reach : largest distance of a worn corner from a neighbour's corner [m]
    """
    worn = np.add.reduceat(~faces.sound[faces.solids.corners], faces.solids.face_starts[:-1]) > 0
    beside: dict[int, list[int]] = {}
    for first, two in neighbours.tolist():
        beside.setdefault(first, []).append(two)
        beside.setdefault(two, []).append(first)
    out = rows.copy()
    for face in np.flatnonzero(worn & free & ~faces.kept).tolist():
        around = sorted(set(beside.get(int(faces.planes.owner[face]), [])))
        points = _sound(faces, face)
        if len(points) not in (1, 2):  # three define the plane as it was measured, and none leaves it unknown
            continue
        points = np.vstack([points, _nearest(faces, face, [solids[i].vertices for i in around], reach)])
        if _through(points, rows[face]) is None:
            points = np.vstack([points, _continuing(faces, rows, free, face, around)])
        mended = _through(points, rows[face])
        if mended is None:
            mended = _parallel(faces, rows, face, points)
        if mended is not None:
            out[face] = mended
    return out


def _continuing(faces: StoneFaces, rows: Array, free: Bools, face: int, beside: list[int]) -> Array:
    """Return sound corners (n, 3) of neighbours' free sides in the plane of a side's own sound corners."""
    sound, starts = _sound(faces, face), faces.solids.solid_starts
    points = [np.zeros((0, 3))]
    for stone in beside:
        for candidate in range(int(starts[stone]), int(starts[stone + 1])):
            alike = free[candidate] and rows[candidate, :3] @ rows[face, :3] > _ALIKE
            if alike and np.abs(sound @ rows[candidate, :3] - rows[candidate, 3]).max() <= WEAR:
                points.append(_sound(faces, candidate))
    return np.concatenate(points)


def _nearest(faces: StoneFaces, face: int, beside: list[Array], reach: float) -> Array:
    """Return the neighbour's corner (n, 3) nearest to each worn corner of a side."""
    corners = faces.corners(face)
    worn = faces.solids.vertices[corners[~faces.sound[corners]]]
    points = np.concatenate([np.zeros((0, 3)), *beside])
    if not len(points):
        return points
    apart = np.linalg.norm(worn[:, None] - points[None], axis=2)
    out: Array = points[apart.argmin(axis=1)][apart.min(axis=1) <= reach]
    return out


def _parallel(faces: StoneFaces, rows: Array, face: int, points: Array) -> Array | None:
    """Return the plane through points parallel to the opposite side, if it is nearly so."""
    stone, starts = int(faces.planes.owner[face]), faces.solids.solid_starts
    mine = rows[int(starts[stone]) : int(starts[stone + 1])]
    opposite = mine[int((mine[:, :3] @ rows[face, :3]).argmin()), :3]
    if -(opposite @ rows[face, :3]) < _ALIKE:
        return None
    return np.array([*-opposite, float(-(points @ opposite).mean())])


def _sound(faces: StoneFaces, face: int) -> Array:
    """Return the sound corners (n, 3) of a face."""
    corners = faces.corners(face)
    out: Array = faces.solids.vertices[corners[faces.sound[corners]]]
    return out


def _through(points: Array, like: Array) -> Array | None:
    """Return the least-squares plane of points that spread in two directions, facing like another plane, or None."""
    if len(points) < 3:
        return None
    centre = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - centre, full_matrices=False)
    if spread[1] < 0.2 * spread[0]:
        return None
    normal = axes[2] if axes[2] @ like[:3] > 0.0 else -axes[2]
    return np.array([*normal, float(normal @ centre)])
