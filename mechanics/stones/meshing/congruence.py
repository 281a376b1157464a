"""Stones of the same shape, and the rigid motion that takes one to another.

Mirror images are different shapes: a motion takes outward normals to outward normals, and turns without reflecting.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Collection, Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints

Faces = tuple[tuple[int, ...], ...]

_EQUAL = 1e-11  # distance of two corners that are the same, over the stone's size
_COORDINATE_ROUNDING = (
    16.0 * np.finfo(float).eps
)  # the same over the coordinates: far from the origin rounding exceeds _EQUAL


@dataclass(frozen=True)
class Congruence:
    """x → turn (x - origin) + target.

    Attributes
    ----------
    turn : (3, 3) rotation
    origin, target : (3,) [m]
    face : (nf,) for each face of the first stone, the face of the second that it comes to lie on
    """

    turn: Array
    origin: Array
    target: Array
    face: Ints

    def __call__(self, points: Array) -> Array:
        """Move points (n, 3) [m]."""
        moved: Array = (points - self.origin) @ self.turn.T + self.target
        return moved


def classes(keys: Sequence[Hashable], shapes: Sequence[Array], same: Callable[[int, int], bool]) -> list[int]:
    """Return for each shape the first one that is the same.

    Parameters
    ----------
    keys : shapes with different keys are never the same
    shapes : (nv, 3) corners of each [m]
    same : True for two shapes if they are the same
    """
    by_key: dict[Hashable, list[tuple[float, int]]] = {}
    labels = []
    for index, shape in enumerate(shapes):
        local = shape - shape.mean(axis=0)
        spread = float(np.linalg.norm(local, axis=1).sum())  # does not depend on rotation
        slack = len(local) * _tolerance(shape)
        candidates = by_key.setdefault(keys[index], [])
        similar = candidates[
            bisect_left(candidates, (spread - slack, -1)) : bisect_left(candidates, (spread + slack, -1))
        ]
        labels.append(next((candidate for _, candidate in similar if same(candidate, index)), index))
        if labels[index] == index:
            insort(candidates, (spread, index))
    return labels


def translation(first: Array, second: Array) -> bool:
    """Return True if corners (nv, 3) differ by a translation alone."""
    if first.shape != second.shape:
        return False
    off = (first - first.mean(axis=0)) - (second - second.mean(axis=0))
    return bool(np.abs(off).max() <= _tolerance(first, second))


def motion(
    first: Array,
    faces: Faces,
    second: Array,
    second_faces: Faces,
    marked: Collection[int] = (),
    second_marked: Collection[int] = (),
) -> Congruence | None:
    """Find the rigid motion that takes a stone to another, faces onto faces and marked faces onto marked ones.

    Of several motions a pure translation is preferred; None if there is no motion.
    """
    if first.shape != second.shape or sorted(map(len, faces)) != sorted(map(len, second_faces)):
        return None
    origin, target = first.mean(axis=0), second.mean(axis=0)
    a, b = first - origin, second - target
    tolerance = _tolerance(first, second)
    size = float(np.abs(a).max())
    start = _frame(a, faces[0], 0)
    still = np.eye(3)
    for turn in (still, _fitted(a, b), *_turns(start, faces[0], b, second_faces)):
        corner = _matched(a @ turn.T, b, 1e-6 * size)
        if corner is None:
            continue
        # a motion that is a translation to rounding keeps the exact identity; other rotations are fitted to all corners
        straight = turn is still and _off(a, b[corner], turn) <= tolerance
        fine = turn if straight else _fitted(a, b[corner])
        if _off(a, b[corner], fine) > tolerance:
            continue
        face = _faces_onto(faces, second_faces, corner)
        if face is not None and set(face[list(marked)].tolist()) == set(second_marked):
            return Congruence(fine, origin, target, face)
    return None


def _tolerance(*corners: Array) -> float:
    size = float(np.ptp(corners[0], axis=0).max())
    return _EQUAL * size + _COORDINATE_ROUNDING * max(float(np.abs(corner).max()) for corner in corners)


def _off(a: Array, b: Array, turn: Array) -> float:
    return float(np.abs(a @ turn.T - b).max())


def _fitted(a: Array, b: Array) -> Array:
    """Return the rotation that takes points a (n, 3) best to points b, both about their means (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(b.T @ a)
    u[:, 2] *= np.sign(np.linalg.det(u @ vt))
    rotation: Array = u @ vt
    return rotation


def _frame(corners: Array, face: tuple[int, ...], place: int) -> Array:
    """Return columns along an edge of a face, into the face, and out of the stone."""
    a, b = corners[face[place]], corners[face[(place + 1) % len(face)]]
    loop = corners[list(face)] - a
    out = np.cross(loop, np.roll(loop, -1, axis=0)).sum(axis=0)
    x, z = (b - a) / np.linalg.norm(b - a), out / np.linalg.norm(out)
    return np.column_stack([x, np.cross(z, x), z])


def _turns(start: Array, face: tuple[int, ...], corners: Array, faces: Faces) -> list[Array]:
    """Return the rotations that take the first edge of a face to any edge of any face with as many corners."""
    return [
        _frame(corners, target, place) @ start.T
        for target in faces
        if len(target) == len(face)
        for place in range(len(target))
    ]


def _matched(a: Array, b: Array, within: float) -> Ints | None:
    """Return the point of b (n, 3) at each point of a; None unless each has one of its own."""
    distance = np.abs(a[:, None] - b).max(axis=-1)
    corner: Ints = distance.argmin(axis=1).astype(np.int64)
    if distance[np.arange(len(a)), corner].max() > within or len(set(corner.tolist())) < len(a):
        return None
    return corner


def _faces_onto(faces: Faces, second: Faces, corner: Ints) -> Ints | None:
    number = {_cycle(face): k for k, face in enumerate(second)}
    onto = [number.get(_cycle(tuple(corner[list(face)].tolist())), -1) for face in faces]
    return None if -1 in onto else np.array(onto, dtype=np.int64)


def _cycle(face: tuple[int, ...]) -> tuple[int, ...]:
    """Return the same loop of corners, beginning at its least one."""
    first = face.index(min(face))
    return face[first:] + face[:first]
