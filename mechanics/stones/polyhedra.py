"""Mass, extent and planes of polyhedra with planar faces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints
from moma.errors import GeometryError

__all__ = [
    "MassProperties",
    "face_plane",
    "face_planes",
    "fan",
    "mass_properties",
    "smallest_width",
    "united",
]

Faces = Sequence[Sequence[int]]


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
    edges = [(f[i - 1], f[i]) for f in faces for i in range(len(f))]
    distinct = set(edges)
    if len(distinct) < len(edges) or any((b, a) not in distinct for a, b in edges):
        raise GeometryError(
            "the faces do not close",
            where=where,
            remedy="give each edge to exactly two faces, in opposite directions",
        )
    origin = vertices.mean(axis=0)
    corners = (vertices - origin)[fan(faces)]
    volumes = np.linalg.det(corners) / 6.0
    volume = float(volumes.sum())
    if not volume > 0:
        raise GeometryError(
            f"the faces enclose {volume:.3g} m³",
            where=where,
            remedy="order the corners of each face counter-clockwise seen from outside",
        )
    total = corners.sum(axis=1)
    mean = np.einsum("t,ti->i", volumes, total) / (4.0 * volume)
    second = np.einsum("t,tki,tkj->ij", volumes, corners, corners) + np.einsum(
        "t,ti,tj->ij", volumes, total, total
    )
    second = second / 20.0 - volume * np.outer(mean, mean)
    inertia = np.trace(second) * np.eye(3) - second
    return MassProperties(volume, origin + mean, inertia)


def united(parts: Sequence[MassProperties]) -> MassProperties:
    """Unite the mass properties of parts that do not overlap (Steiner's theorem)."""
    if len(parts) == 1:
        return parts[0]
    volume = sum(part.volume for part in parts)
    centroid = sum((part.volume * part.centroid for part in parts), np.zeros(3)) / volume
    inertia = np.zeros((3, 3))
    for part in parts:
        arm = part.centroid - centroid
        inertia += part.inertia + part.volume * (arm @ arm * np.eye(3) - np.outer(arm, arm))
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
    normals = np.array([face_plane(vertices[list(f)])[0] for f in faces])
    heights = vertices @ normals.T
    return float((heights.max(axis=0) - heights.min(axis=0)).min())
