"""Closedness checks of solids with trimesh, which repairs nothing."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import ON_PLANE, VANISHING
from survey.geometry.solids import (
    Solid,
    area_vector,
    highest_corner,
    highest_corners,
    volume_of,
    volumes_alike,
)


def check_watertight(solid: Solid, *, convex: bool = False) -> None:
    """Check that a solid is closed, consistently wound and of positive volume.

    Parameters
    ----------
    solid : solid to check
    convex : check convexity as well, within 1e-9 m and the rounding of its coordinates

    Raises
    ------
    GeometryError
        naming the stone and its defect
    """
    where, remedy = f"stone {solid.code}", "check its corners in the survey"
    if not np.isfinite(solid.vertices).all():
        raise GeometryError("a corner is not finite", where=where, remedy=remedy)
    if not _closes(solid.faces):
        from trimesh import Trimesh  # a quarter of a second, which sound solids do not need

        mesh = Trimesh(solid.vertices, triangulate(solid), process=False)
        if not mesh.is_watertight:
            raise GeometryError("the solid is not closed", where=where, remedy=remedy)
        if not mesh.is_winding_consistent:
            raise GeometryError(
                "its faces are not all counter-clockwise seen from outside", where=where, remedy=remedy
            )
    if not (volume := volume_of(solid)) > 0.0:
        raise GeometryError(f"its volume is {volume:.3g} m³: inside out or flat", where=where, remedy=remedy)
    tolerance = ON_PLANE + 4.0 * np.spacing(np.abs(solid.vertices).max())
    if convex and (height := highest_corner(solid)) > tolerance:
        raise GeometryError(f"it is not convex: a corner is {height:.3g} m out", where=where, remedy=remedy)


def doubtful_solids(solids: Sequence[Solid], convex: Sequence[bool]) -> list[int]:
    """Return the solids that `check_watertight` may refuse, found at once among many that it does not.

    Parameters
    ----------
    solids : to be checked
    convex : whether convexity is checked as well, of each
    """
    alike: dict[tuple[int, tuple[tuple[int, ...], ...], bool], list[int]] = {}
    for number, (solid, also) in enumerate(zip(solids, convex, strict=True)):
        alike.setdefault((len(solid.vertices), solid.faces, also), []).append(number)
    doubtful: list[int] = []
    for (_, faces, also), members in alike.items():
        rows, vertices = np.array(members), np.stack([solids[number].vertices for number in members])
        sound = np.isfinite(vertices).all(axis=(1, 2)) & _closes(faces)
        with np.errstate(invalid="ignore"):
            sound &= volumes_alike(vertices, faces) > 0.0
            if also:
                tolerance = ON_PLANE + 4.0 * np.spacing(np.abs(vertices).max(axis=(1, 2)))
                sound &= highest_corners(vertices, faces) <= tolerance
        doubtful += rows[~sound].tolist()
    return sorted(doubtful)


@lru_cache(maxsize=1024)
def _closes(faces: tuple[tuple[int, ...], ...]) -> bool:
    """Return whether every side of a face is the side of one other face, passed the other way.

    The stones of a building share a few lists of faces. Where more faces share a side, it takes trimesh to tell.
    """
    sides = [(a, b) for face in faces for a, b in zip(face, (*face[1:], face[0]), strict=True)]
    distinct = set(sides)
    return len(distinct) == len(sides) and all((b, a) in distinct for a, b in sides)


def triangulate(solid: Solid) -> NDArray[np.intp]:
    """Split the faces into triangles, wound like them, by cutting ears.

    Returns
    -------
    (nt, 3) vertex indices
    """
    triangles = [triangle for face in solid.faces for triangle in _ears(solid.vertices, face)]
    return np.array(triangles, dtype=np.intp)


def _ears(vertices: Array, face: tuple[int, ...]) -> list[tuple[int, int, int]]:
    if len(face) == 3:
        return [(face[0], face[1], face[2])]
    rest, triangles = list(face), []
    polygon = vertices[rest]
    normal = area_vector(polygon)
    while len(rest) > 3:
        ear = next((k for k in range(len(rest)) if _is_ear(vertices, rest, k, normal)), 0)
        triangles.append((rest[ear - 1], rest[ear], rest[(ear + 1) % len(rest)]))
        del rest[ear]
    triangles.append((rest[0], rest[1], rest[2]))
    return triangles


def _is_ear(vertices: Array, rest: list[int], k: int, normal: Array) -> bool:
    ids = (rest[k - 1], rest[k], rest[(k + 1) % len(rest)])
    corners = vertices[list(ids)]
    inward = np.cross(normal, np.roll(corners, -1, axis=0) - corners)
    if inward[0] @ (corners[2] - corners[0]) <= 0.0:
        return False
    others = vertices[[i for i in rest if i not in ids]]
    # a corner on the side to be cut is in the way, also where rounding puts it just outside
    slack = VANISHING * np.linalg.norm(inward, axis=1) * float(np.abs(corners - corners[0]).max())
    inside = ((others[:, None, :] - corners) * inward).sum(axis=2) >= -slack
    return not inside.all(axis=1).any()
