"""Cutting of stones by planes: those of their own free faces, and those of the joints that they share."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.conventions import ROUNDING, THINNEST, TOUCHING
from survey.geometry._kernels.cutting import FULL, MAX_CORNERS, CutSolid, cut_out
from survey.geometry.solids import Solid, area_vector

Faces = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class CutStone:
    """A convex stone, with the plane of each face.

    Attributes
    ----------
    solid : closed, convex
    of_face : (nf,) index into the planes
    """

    solid: Solid
    of_face: tuple[int, ...]


def cut_stones(
    solids: Sequence[Solid], planes: Mapping[int, Array], notched: Container[int] = ()
) -> dict[int, CutStone | None]:
    """Cut some stones by new planes.

    Parameters
    ----------
    solids : as they were
    planes : for each stone that changes, (n, 4) outward unit normals and offsets n·x ≤ d; the first planes belong to
        the faces of the solid, in their order, and further ones may follow
    notched : stones that are not convex, each corner of which joins three faces: their faces are moved, not cut, and
        further planes are ignored

    Returns
    -------
    stones by index; with the corners and faces of the old one, in their order, where all its faces are left and no
    others were added; None where the planes leave nothing or do not close
    """
    out: dict[int, CutStone | None] = {}
    cut = {i: stone_planes for i, stone_planes in planes.items() if i not in notched}
    for i in (i for i in planes if i not in cut):
        out[i] = _with_faces_moved(solids[i], planes[i][: len(solids[i].faces)])
    for faces, members in _alike(solids, cut).items():
        moved, same = _moved(faces, np.array([planes[i] for i in members]))
        for k, i in enumerate(members):
            if same[k]:
                solid = Solid(solids[i].code, moved[k], faces)
                out[i] = CutStone(solid, tuple(range(len(faces))))
    for i, cuts in cut.items():
        if i not in out:
            out[i] = _cut(solids[i], cuts)
    return out


def joins_three(faces: Faces) -> bool:
    """Return whether each corner joins three faces, so that the solid stays closed when its planes move."""
    return _meeting(faces) is not None


def _with_faces_moved(solid: Solid, planes: Array) -> CutStone | None:
    """Return a stone with the same topology on new planes (nf, 4); None if an edge or a face would reverse."""
    corners, wide = _crossings(solid.faces, planes[None])
    if not wide[0].all():
        return None
    for face in solid.faces:
        old, new = solid.vertices[list(face)], corners[0, list(face)]
        along = ((np.roll(old, -1, axis=0) - old) * (np.roll(new, -1, axis=0) - new)).sum(axis=1)
        if not (along > 0.0).all() or not area_vector(old) @ area_vector(new) > 0.0:
            return None
    return CutStone(Solid(solid.code, corners[0], solid.faces), tuple(range(len(solid.faces))))


def moves(old: Solid, new: Solid) -> Array:
    """Return the displacement of each corner (nv,) [m]; if faces changed, to the nearest new corner."""
    if old.faces == new.faces:
        out: Array = np.linalg.norm(new.vertices - old.vertices, axis=1)
        return out
    apart = np.linalg.norm(old.vertices[:, None] - new.vertices[None], axis=2)
    nearest: Array = apart.min(axis=1)
    return nearest


def common_part(first: Array, second: Array, centre: Array, reach: float) -> Solid | None:
    """Return the intersection of two convex solids, given by their planes (n, 4); None if it is empty.

    Parameters
    ----------
    first, second : planes
    centre, reach : of a box that holds both [m]
    """
    common = _intersect(np.vstack([first, second]), centre, reach, "")
    return None if common is None else common.solid


def _alike(solids: Sequence[Solid], planes: Mapping[int, Array]) -> dict[Faces, list[int]]:
    """Group stones that may keep their faces by these: one plane for each face, three faces at each corner."""
    groups: dict[Faces, list[int]] = {}
    for i, stone_planes in planes.items():
        faces = solids[i].faces
        if len(stone_planes) == len(faces):
            groups.setdefault(faces, []).append(i)
    return {faces: members for faces, members in groups.items() if _meeting(faces) is not None}


@lru_cache(maxsize=1024)
def _meeting(faces: Faces) -> Ints | None:
    """Return the three faces (nv, 3) that meet at each corner; None if another number meets anywhere."""
    count = max(max(face) for face in faces) + 1
    at: list[list[int]] = [[] for _ in range(count)]
    for number, face in enumerate(faces):
        for corner in face:
            at[corner].append(number)
    return np.array(at) if all(len(meeting) == 3 for meeting in at) else None


def _moved(faces: Faces, planes: Array) -> tuple[Array, Bools]:
    """Return corners (n, nv, 3) where the planes (n, nf, 4) cross, and (n,) whether the stones keep their faces."""
    corners, wide = _crossings(faces, planes)
    meeting = _meeting(faces)
    assert meeting is not None
    height = np.einsum("nfk,nvk->nvf", planes[:, :, :3], corners) - planes[:, None, :, 3]
    incidence = np.zeros((len(meeting), len(faces)), np.bool_)
    incidence[np.arange(len(meeting))[:, None], meeting] = True
    below = np.where(incidence, -np.inf, height).max(axis=(1, 2)) < -TOUCHING
    return corners, below & wide.all(axis=1)


def _crossings(faces: Faces, planes: Array) -> tuple[Array, Bools]:
    """Return corners (n, nv, 3) where the planes (n, nf, 4) cross, and (n, nv) whether they do so at wide angles."""
    meeting = _meeting(faces)
    assert meeting is not None
    origin = _middle(planes)
    local = planes[:, :, 3] - np.einsum("nfk,nk->nf", planes[:, :, :3], origin)
    normals, offsets = planes[:, meeting, :3], local[:, meeting]
    wide = np.abs(np.linalg.det(normals)) > 1e-3
    normals[~wide] = np.eye(3)
    corners = np.linalg.solve(normals, offsets[..., None])[..., 0]
    return corners + origin[:, None, :], wide


def _middle(planes: Array) -> Array:
    """Return a place near each stone (n, 3): least squares of the distances from its planes."""
    normals = planes[:, :, :3]
    matrix = np.einsum("nfi,nfj->nij", normals, normals) + 1e-9 * np.eye(3)
    right = np.einsum("nfi,nf->ni", normals, planes[:, :, 3])
    out: Array = np.linalg.solve(matrix, right[..., None])[..., 0]
    return out


def _cut(solid: Solid, planes: Array) -> CutStone | None:
    """Cut one stone in the general way, without faces so thin that they are due to rounding."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    centre, reach = 0.5 * (low + high), 4.0 * float((high - low).max())
    wanted = np.arange(len(planes))
    while True:
        cut = _intersect(planes[wanted], centre, reach, solid.code)
        if cut is None:
            return None
        of_face = tuple(int(wanted[p]) for p in cut.of_face)
        thin = {
            of_face[f] for f, face in enumerate(cut.solid.faces) if _is_thin(cut.solid.vertices[list(face)])
        }
        if not thin:
            return CutStone(cut.solid, of_face)
        if len(wanted) - len(thin) < 4:
            return None  # a splinter of rounding
        wanted = np.array([p for p in wanted if p not in thin])


def _is_thin(polygon: Array) -> bool:
    edges = np.roll(polygon, -1, axis=0) - polygon
    area = 0.5 * float(np.linalg.norm(np.cross(polygon - polygon[0], edges).sum(axis=0)))
    return area < THINNEST * float(np.linalg.norm(edges, axis=1).max())


def _intersect(planes: Array, centre: Array, reach: float, code: str) -> CutStone | None:
    local = np.ascontiguousarray(planes.copy())
    local[:, 3] -= planes[:, :3] @ centre
    room = len(planes) + 6
    vertices = np.empty((16 * room, 3))
    loops, sizes = np.empty((room + 1, MAX_CORNERS), np.int64), np.empty(room + 1, np.int64)
    of_face, meeting = np.empty(room + 1, np.int64), np.empty((16 * room, 3), np.int64)
    status, corners, faces = cut_out(
        local, np.zeros(3), reach, ROUNDING, CutSolid(vertices, loops, sizes, of_face, meeting)
    )
    if status != FULL:
        return None
    sharp = np.flatnonzero(meeting[:corners, 0] >= 0)
    crossing = local[meeting[sharp]]
    vertices[sharp] = np.linalg.solve(crossing[:, :, :3], crossing[:, :, 3:])[..., 0]
    named = tuple(tuple(loops[f, : sizes[f]].tolist()) for f in range(faces))
    return CutStone(Solid(code, vertices[:corners] + centre, named), tuple(of_face[:faces].tolist()))
