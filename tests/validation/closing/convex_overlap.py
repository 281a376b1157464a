"""Volume that two convex solids share, by cutting one with the planes of the other; slow, exact, on its own."""

from collections.abc import Iterator, Sequence

import numpy as np

from mechanics.arrays import Array
from survey.geometry.solids import Solid, area_vector


def planes_of(solid: Solid) -> Array:
    """(nf, 4) outward unit normals, and offsets by the highest corner of each face."""
    rows = []
    for face in solid.faces:
        corners = solid.vertices[list(face)]
        normal = area_vector(corners)
        normal /= np.linalg.norm(normal)
        rows.append([*normal, float((corners @ normal).max())])
    return np.array(rows)


def near_boxes(solids: Sequence[Solid], reach: float = 0.0) -> Iterator[tuple[int, int]]:
    """Pairs i < j whose boxes are no farther apart than `reach`, by a sweep along x."""
    low = np.array([s.vertices.min(axis=0) for s in solids]) - 0.5 * reach
    high = np.array([s.vertices.max(axis=0) for s in solids]) + 0.5 * reach
    axis = int(np.argmax(high.max(axis=0) - low.min(axis=0)))
    order = np.argsort(low[:, axis], kind="stable")
    starts = low[order, axis]
    for place, i in enumerate(order):
        others = order[place + 1 : np.searchsorted(starts, high[i, axis], side="right")]
        for j in others[(low[others] <= high[i]).all(1) & (low[i] <= high[others]).all(1)]:
            yield min(int(i), int(j)), max(int(i), int(j))


def depth_apart(a: Solid, b: Solid, planes_a: Array, planes_b: Array) -> float:
    """Largest height by which a plane of one has all corners of the other above it; negative: none has [m]."""
    over_a = (b.vertices @ planes_a[:, :3].T - planes_a[:, 3]).min(axis=0).max()
    over_b = (a.vertices @ planes_b[:, :3].T - planes_b[:, 3]).min(axis=0).max()
    return float(max(over_a, over_b))


def common_volume(a: Solid, b: Solid) -> float:
    """Volume of the intersection of two convex solids [m³]."""
    origin = a.vertices.mean(axis=0)
    polygons = [a.vertices[list(face)] - origin for face in a.faces]
    for *normal, offset in planes_of(b):
        polygons = _cut(polygons, np.array(normal), offset - float(np.dot(normal, origin)))
        if not polygons:
            return 0.0
    return sum(float(p[0] @ np.cross(p[k], p[k + 1])) / 6.0 for p in polygons for k in range(1, len(p) - 1))


def _cut(polygons: list[Array], normal: Array, offset: float) -> list[Array]:
    """Keep what is below a plane of a convex solid's faces, and close it by the face that the cut makes."""
    kept, rim = [], []
    for polygon in polygons:
        heights = polygon @ normal - offset
        if (heights <= 0.0).all():
            kept.append(polygon)
            continue
        out: list[Array] = []
        for k, (here, h) in enumerate(zip(polygon, heights, strict=True)):
            g, before = heights[k - 1], polygon[k - 1]
            if (h > 0.0) != (g > 0.0):
                crossing = before + g / (g - h) * (here - before)
                out.append(crossing)
                rim.append(crossing)
            if h <= 0.0:
                out.append(here)
        if len(out) >= 3:
            kept.append(np.array(out))
    if len(rim) >= 3:
        corners = np.array(rim)
        u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        flat = (corners - corners.mean(axis=0)) @ np.array([u, np.cross(normal, u)]).T
        kept.append(corners[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]), kind="stable")])
    return kept


def overlaps(solids: Sequence[Solid]) -> dict[tuple[str, str], float]:
    """Volumes that pairs of convex solids share, where it is not certain that they share less than 10⁻¹⁰ m³.

    Where a face plane of one has all of the other above -δ, they share at most δ times the other's extent squared.
    Parts of one stone bear one code, and are not compared.
    """
    planes = [planes_of(solid) for solid in solids]
    out: dict[tuple[str, str], float] = {}
    for i, j in near_boxes(solids):
        a, b = solids[i], solids[j]
        if a.code == b.code:
            continue
        width = min(np.ptp(a.vertices, axis=0).max(), np.ptp(b.vertices, axis=0).max())
        if -depth_apart(a, b, planes[i], planes[j]) * 3.0 * width**2 > 1e-10:
            out[a.code, b.code] = out.get((a.code, b.code), 0.0) + common_volume(a, b)
    return out
