"""Mass, extent and planes of polyhedra with planar faces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ground.errors import GeometryError
from mechanics.arrays import Array, Ints

Faces = Sequence[Sequence[int]]
Polygons = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class MassProperties:
    """Mass properties at unit density.

    Attributes
    ----------
    volume : [m³]
    centroid : (3,) [m]
    inertia : (3, 3) second-moment tensor of inertia about the centroid, world axes [m⁵]
    """

    volume: float
    centroid: Array
    inertia: Array


def fan(faces: Faces) -> Ints:
    """Return triangles (nt, 3) of all faces, each face cut from its first corner."""
    return np.array([(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)], dtype=np.int64)


def mass_properties(vertices: Array, faces: Faces, where: str | None = None) -> MassProperties:
    """Compute volume, centroid and inertia by the divergence theorem.

    Each boundary triangle and the mean of the corners span a tetrahedron; for a tetrahedron with corners
    0, a, b, c the moments are ∫x = V (a+b+c)/4 and ∫x xᵀ = V/20 (Σ a aᵀ + s sᵀ), with s = a+b+c (Tonon 2004).

    Raises
    ------
    GeometryError : if the faces are not closed, or their orientation gives no positive volume

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> tetrahedron = mass_properties(corners, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    >>> round(tetrahedron.volume, 4), tetrahedron.centroid.round(4).tolist()
    (0.1667, [0.25, 0.25, 0.25])
    """
    volume, centroid, inertia = mass_properties_alike(vertices[None], faces, [where])
    return MassProperties(float(volume[0]), centroid[0], inertia[0])


def alike(vertices: Sequence[Array], faces: Sequence[Faces]) -> list[tuple[Polygons, Ints]]:
    """Return the lists of faces of many polyhedra, each once, with the polyhedra (n,) that have it.

    The stones of a bond or of a survey share a few, so what is computed list by list is computed on whole arrays.
    """
    members: dict[tuple[int, Polygons], list[int]] = {}
    for row, (corners, group) in enumerate(zip(vertices, faces, strict=True)):
        members.setdefault((len(corners), tuple(map(tuple, group))), []).append(row)
    return [(group, np.array(rows, dtype=np.int64)) for (_, group), rows in members.items()]


def mass_properties_alike(
    vertices: Array, faces: Faces, where: Sequence[str | None]
) -> tuple[Array, Array, Array]:
    """Compute volumes (n,), centroids (n, 3) and inertias (n, 3, 3) of polyhedra with the same faces.

    Parameters
    ----------
    vertices : (n, nv, 3) [m]
    faces : of each
    where : names each in messages

    Raises
    ------
    GeometryError : as `mass_properties`, of the first that is wrong
    """
    edges = [(f[i - 1], f[i]) for f in faces for i in range(len(f))]
    distinct = set(edges)
    if len(distinct) < len(edges) or any((b, a) not in distinct for a, b in edges):
        raise GeometryError(
            "the faces do not close",
            where=where[0],
            remedy="give each edge to exactly two faces, in opposite directions",
        )
    origin = vertices.mean(axis=1)
    # in one order of memory, so that no sum depends on the number of stones
    corners = np.take(vertices - origin[:, None], fan(faces), axis=1)
    volumes = np.linalg.det(corners) / 6.0
    volume = volumes.sum(axis=1)
    if not (volume > 0).all():
        first = int(np.argmin(volume > 0))
        raise GeometryError(
            f"the faces enclose {volume[first]:.3g} m³",
            where=where[first],
            remedy="order the corners of each face counter-clockwise seen from outside",
        )
    total = corners.sum(axis=2)
    mean = np.einsum("nt,nti->ni", volumes, total) / (4.0 * volume[:, None])
    second = np.einsum("nt,ntki,ntkj->nij", volumes, corners, corners) + np.einsum(
        "nt,nti,ntj->nij", volumes, total, total
    )
    second = second / 20.0 - volume[:, None, None] * (mean[:, :, None] * mean[:, None, :])
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return volume, origin + mean, inertia


def face_planes_alike(vertices: Array, faces: Faces) -> tuple[Array, Array]:
    """Return unit normals (n, nf, 3) and areas (n, nf) [m²] of polyhedra (n, nv, 3) with the same faces."""
    number = np.array([len(face) for face in faces])
    normal = np.empty((len(vertices), len(faces), 3))
    for count in np.unique(number):
        rows = np.flatnonzero(number == count)
        polygon = np.take(vertices, np.array([faces[int(row)] for row in rows]), axis=1)
        local = polygon - polygon.mean(axis=2, keepdims=True)
        normal[:, rows] = np.cross(local, np.roll(local, -1, axis=2)).sum(axis=2)
    twice = np.linalg.norm(normal, axis=2)
    return normal / twice[..., None], 0.5 * twice


def united(parts: Sequence[MassProperties]) -> MassProperties:
    """Unite the mass properties of parts that do not overlap (Steiner's theorem)."""
    if len(parts) == 1:
        return parts[0]
    volume = sum(piece.volume for piece in parts)
    centroid = sum((piece.volume * piece.centroid for piece in parts), np.zeros(3)) / volume
    inertia = np.zeros((3, 3))
    for piece in parts:
        arm = piece.centroid - centroid
        inertia += piece.inertia + piece.volume * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return MassProperties(volume, centroid, inertia)


def face_plane(points: Array) -> tuple[Array, Array]:
    """Return the unit normal by Newell's method and the mean point of one polygon (n, 3), ordered counter-clockwise."""
    centre = points.mean(axis=0)
    local = points - centre  # far from the origin the cross products would lose the small differences
    normal = np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)
    return normal / np.linalg.norm(normal), centre


def face_planes(vertices: Array, faces: Faces) -> tuple[Array, Array]:
    """Return unit normals and mean points (nf, 3) of all faces at once, as `face_plane` does of one."""
    loops = np.concatenate([np.asarray(face, dtype=np.int64) for face in faces])
    counts = np.array([len(face) for face in faces])
    start = np.cumsum(counts) - counts
    centres = np.add.reduceat(vertices[loops], start) / counts[:, None]
    local = vertices[loops] - np.repeat(centres, counts, axis=0)
    following = np.arange(1, len(loops) + 1)
    following[start + counts - 1] = start
    (x, y, z), (u, v, w) = local.T, local[following].T
    normals = np.add.reduceat(np.column_stack([y * w - z * v, z * u - x * w, x * v - y * u]), start)
    with np.errstate(invalid="ignore"):  # a face without area has no normal
        return normals / np.linalg.norm(normals, axis=1)[:, None], centres


def smallest_width(vertices: Array, faces: Faces) -> float:
    """Return the smallest extent of a convex polyhedron along a face normal [m]."""
    normals, _ = face_planes_alike(vertices[None], faces)
    return float(smallest_widths(vertices[None], normals)[0])


def smallest_widths(vertices: Array, normals: Array) -> Array:
    """Return the smallest extents (n,) of convex polyhedra (n, nv, 3) along their face normals (n, nf, 3) [m]."""
    heights = vertices @ normals.transpose(0, 2, 1)
    width: Array = (heights.max(axis=1) - heights.min(axis=1)).min(axis=1)
    return width
