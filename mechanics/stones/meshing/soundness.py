"""Checks of a stone before it is meshed."""

import numpy as np

from ground.errors import GeometryError, MeshError
from mechanics.arrays import Array, Bools
from mechanics.stones.polyhedra import face_plane, face_planes, fan, mass_properties

Faces = tuple[tuple[int, ...], ...]

# fractions of a stone's size
_PLANAR = 1e-6  # largest distance of a corner from its face's plane
_DISTINCT = 1e-8  # distance of two corners in one place
_THIN = 1e-5  # thickness of a flat stone
CONVEX = 1e-9  # largest distance of a corner of a convex stone in front of a face


def check_meshable(vertices: Array, faces: Faces, code: str) -> None:
    """Refuse a stone that no mesher can fill.

    Raises
    ------
    MeshError
        with the reason: corners that are no numbers or lie in one place, a face that is not planar or crosses itself,
        faces that do not close or cross one another, a stone as thin as a sheet or a needle
    """
    where = f"stone {code}"
    if not np.isfinite(vertices).all():
        raise MeshError("a corner is no number", where=where, remedy="measure it again")
    size = float(np.ptp(vertices, axis=0).max())
    _check_corners(vertices, faces, size, where)
    try:
        mass_properties(vertices, faces, where)
    except GeometryError as error:
        raise MeshError(error.what, where=where, remedy=error.remedy) from error
    _check_thickness(vertices, size, where)
    _check_planar(vertices, faces, size, where)
    if not is_convex(vertices, faces):
        _check_crossings(vertices, faces, where)


def is_convex(vertices: Array, faces: Faces) -> bool:
    """Return True if all corners lie behind the planes of all faces."""
    size = float(np.ptp(vertices, axis=0).max())
    normals, origins = face_planes(vertices, faces)
    about = vertices.mean(axis=0)
    ahead = (vertices - about) @ normals.T - (normals * (origins - about)).sum(axis=1)
    return bool(ahead.max() < CONVEX * size)


def _check_corners(vertices: Array, faces: Faces, size: float, where: str) -> None:
    used = sorted({corner for face in faces for corner in face})
    distance = np.linalg.norm(vertices[used][:, None] - vertices[used], axis=-1)
    close = np.argwhere(np.triu(distance <= _DISTINCT * size, 1))
    if len(close):
        a, b = (used[k] for k in close[0])
        raise MeshError(
            f"corners {a} and {b} lie in one place",
            where=where,
            remedy="make them one, or give the stone its true shape",
        )


def _check_thickness(vertices: Array, size: float, where: str) -> None:
    local = vertices - vertices.mean(axis=0)
    extents = np.ptp(local @ np.linalg.svd(local, full_matrices=False)[2].T, axis=0)
    thin = float(extents.min())
    if thin < _THIN * size:
        shape = "a needle" if extents[1] < 10.0 * _THIN * size else "flat"
        raise MeshError(
            f"it is {shape}: {thin:.2g} m thick and {size:.3g} m long",
            where=where,
            remedy="give it its true depth, make it rigid, or leave it out of the scene",
        )


def _check_planar(vertices: Array, faces: Faces, size: float, where: str) -> None:
    normals, origins = face_planes(vertices, faces)
    owner = np.repeat(np.arange(len(faces)), [len(face) for face in faces])
    corners = np.array([corner for face in faces for corner in face])
    off = np.abs(((vertices[corners] - origins[owner]) * normals[owner]).sum(axis=1))
    worst = int(np.where(np.isnan(off), np.inf, off).argmax())
    if not off[worst] <= _PLANAR * size:  # also where a face has no area and so no normal
        raise MeshError(
            f"face {owner[worst]} is not planar: its corner {corners[worst]} lies {off[worst]:.2g} m off",
            where=where,
            remedy="make it planar (simplify the stone or close its joints), or cut the face into triangles",
        )


def _check_crossings(vertices: Array, faces: Faces, where: str) -> None:
    """Refuse an edge that passes through a face, and a face whose edges cross."""
    triangles = vertices[fan(faces)]
    owner = np.repeat(np.arange(len(faces)), [len(face) - 2 for face in faces])
    edges = sorted({(min(a, b), max(a, b)) for f in faces for a, b in zip(f, (*f[1:], f[0]), strict=True)})
    for k, face in enumerate(faces):
        if _polygon_crosses_itself(vertices[list(face)]):
            raise MeshError(
                f"face {k} crosses itself", where=where, remedy="order its corners along its outline"
            )
    for a, b in edges:
        for k in set(owner[_pierced(vertices[a], vertices[b], triangles)].tolist()):
            if (
                a not in faces[k]
                and b not in faces[k]
                and _pierces(vertices[a], vertices[b], vertices[list(faces[k])])
            ):
                raise MeshError(
                    f"the edge from corner {a} to {b} passes through face {k}",
                    where=where,
                    remedy="the stone crosses itself: check its corners, or split it into convex parts",
                )


def _pierced(a: Array, b: Array, triangles: Array) -> Bools:
    """Return a mask of the triangles whose plane a line from a to b crosses."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    start, end = (((point - triangles[:, 0]) * normal).sum(axis=1) for point in (a, b))
    crossed: Bools = start * end < 0
    return crossed


def _pierces(a: Array, b: Array, polygon: Array) -> bool:
    normal, origin = face_plane(polygon)
    start, end = (a - origin) @ normal, (b - origin) @ normal
    size = np.ptp(polygon, axis=0).max()
    if start * end >= 0 or min(abs(start), abs(end)) < CONVEX * size:
        return False
    place = a + (b - a) * start / (start - end)
    return _inside(place, polygon, normal)


def _inside(place: Array, polygon: Array, normal: Array) -> bool:
    """Return True if a point of its plane lies in the polygon, which then turns once round it."""
    rays = polygon - place
    after = np.roll(rays, -1, axis=0)
    turn = np.arctan2(np.cross(rays, after) @ normal, (rays * after).sum(axis=1)).sum()
    return bool(abs(turn) > np.pi)


def _polygon_crosses_itself(polygon: Array) -> bool:
    normal, origin = face_plane(polygon)
    local = polygon - origin
    u = local[np.abs(local).sum(axis=1).argmax()]
    flat = np.column_stack([local @ u, local @ np.cross(normal, u)])
    count = len(flat)
    for i in range(count):
        for j in range(i + 2, count - (i == 0)):
            a, b, c, d = flat[i], flat[i + 1], flat[j], flat[(j + 1) % count]
            if _side(a, b, c) * _side(a, b, d) < 0 and _side(c, d, a) * _side(c, d, b) < 0:
                return True
    return False


def _side(a: Array, b: Array, point: Array) -> float:
    return float((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]))
