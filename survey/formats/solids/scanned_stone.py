"""Plane faces of a scanned stone, recognised among its thousands of facets.

A scan has facets of a centimetre, each in a plane of its own; the joints of a stone are between its faces. Planes are
taken one by one, the one with the largest area first, and refined by least squares; the stone is what lies behind all
of them. A stone that is not convex, or hardly plane anywhere, keeps its facets.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.conventions import FEW, LARGELY, MAX_ROUNDS, MOST, NEARLY, PER_CENT, ROUNDING, SAME, TRIALS
from survey.geometry.half_spaces import intersection
from survey.geometry.solids import Solid, volume_of

_MANY = 500  # least number of facets: nobody models a stone with as many
_SMALL = FEW  # largest facet over the whole surface: a modelled stone has some large plane faces
_BENT = MOST  # least part of the edges that are bent: flat ones only divide a modelled face
_FLAT = SAME  # one minus cosine of the angle across a flat edge
_DIRECTIONS = TRIALS  # facets whose normals are tried for each plane
_ALIGNED = NEARLY  # cosine of the angle between a facet and its plane while the plane is sought
_LEANING = MOST  # the same when facets are given to the plane found: those of a rough face lean
_MIN_FACE_SHARE = PER_CENT  # least area of a face over the whole surface
_MAX_PLANES = 30  # planes of a stone
_COVERED = LARGELY  # least part of the surface that lies in the planes
_VOLUME = FEW  # largest change of the volume: broken corners and edges are filled
_CUT = ROUNDING  # distance within which corners are on a plane while cutting [m]


@dataclass(frozen=True)
class ScannedStone:
    """A scanned stone with plane faces, or the reason why it has none.

    Attributes
    ----------
    solid : with plane faces; None if it keeps its facets
    text : the change in millimetres and volume, or the reason
    """

    solid: Solid | None
    text: str


def is_scanned(vertices: Array, polygons: Sequence[tuple[int, ...]]) -> bool:
    """Return True for many small facets, most of them bent against their neighbours."""
    if len(polygons) < _MANY or any(len(polygon) != 3 for polygon in polygons):
        return False
    triangles = np.array(polygons)
    normals, areas, _ = _facets(vertices, triangles)
    if areas.max() > _SMALL * areas.sum():
        return False
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    owner = np.tile(np.arange(len(triangles)), 3)[order]
    same = (edges[order][1:] == edges[order][:-1]).all(axis=1)
    cosines = (normals[owner[1:][same]] * normals[owner[:-1][same]]).sum(axis=1)
    return bool((1.0 - cosines > _FLAT).mean() > _BENT)


def plane_faces(
    code: str, vertices: Array, polygons: Sequence[tuple[int, ...]], tolerance: float
) -> ScannedStone:
    """Recognise the plane faces of a scan.

    Parameters
    ----------
    code : of the stone
    vertices : (nv, 3) [m]
    polygons : triangles, counter-clockwise seen from outside
    tolerance : distance of the facets of a face from its plane [m]
    """
    triangles = np.array(polygons)
    origin = vertices.mean(axis=0)
    local = vertices - origin
    normals, areas, centres = _facets(local, triangles)
    total = float(areas.sum())
    left: Bools = np.ones(len(triangles), np.bool_)
    planes: list[Array] = []
    while areas[left].sum() > _MIN_FACE_SHARE * total and len(planes) < _MAX_PLANES:
        plane, taken = _largest(normals, areas, centres, left, tolerance)
        if areas[taken].sum() < _MIN_FACE_SHARE * total:
            break
        planes.append(plane)
        left &= ~taken
    covered = 1.0 - float(areas[left].sum()) / total
    if covered < _COVERED:
        share = f"{100.0 * covered:.0f} % of its surface lie within {tolerance * 1e3:.3g} mm of plane faces"
        return ScannedStone(None, f"it keeps its {len(triangles)} facets: only {share}")
    used = local[np.unique(triangles)]
    heights = used @ np.array(planes)[:, :3].T - np.array(planes)[:, 3]
    if heights.max() > 3.0 * tolerance:
        rise = heights.max() * 1e3
        return ScannedStone(
            None,
            f"it keeps its {len(triangles)} facets: not convex, a point stands {rise:.0f} mm above a plane face",
        )
    room = np.full(3, 2.0 * float(np.ptp(used, axis=0).max()))
    solid = intersection(code, [tuple(plane.tolist()) for plane in planes], -room, room, _CUT)
    if solid is None or (np.abs(solid.vertices) >= room - _CUT).any():
        return ScannedStone(None, f"it keeps its {len(triangles)} facets: its plane faces do not enclose it")
    before = volume_of(Solid(code, local, tuple(map(tuple, triangles.tolist()))))
    change = volume_of(solid) / before - 1.0
    if abs(change) > _VOLUME:
        return ScannedStone(
            None,
            f"it keeps its {len(triangles)} facets: plane faces change its volume by {100.0 * change:+z.1f} %",
        )
    away = float(np.abs(heights).min(axis=1).max()) * 1e3
    text = (
        f"{len(solid.faces)} plane faces recognised among {len(triangles)} facets; points lie up to {away:.1f} mm "
        f"from them, the volume changes by {100.0 * change:+z.1f} %"
    )
    return ScannedStone(Solid(code, solid.vertices + origin, solid.faces), text)


def _facets(vertices: Array, triangles: Ints) -> tuple[Array, Array, Array]:
    """Return unit normals (n, 3), areas (n,) [m²] and centres (n, 3) [m]."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    twice = np.linalg.norm(across, axis=1)
    return across / np.maximum(twice, 1e-300)[:, None], 0.5 * twice, (a + b + c) / 3.0


def _largest(
    normals: Array, areas: Array, centres: Array, left: Bools, tolerance: float
) -> tuple[Array, Bools]:
    """Return the plane (4,) with the largest area of the facets left, and its facets (n,)."""
    some = np.flatnonzero(left)
    tried = normals[some[:: max(1, len(some) // _DIRECTIONS)]]
    scores = ((tried @ normals[some].T > _ALIGNED) * areas[some]).sum(axis=1)
    normal = tried[int(scores.argmax())]
    for _ in range(MAX_ROUNDS):
        aligned = some[normals[some] @ normal > _ALIGNED]
        mean = (normals[aligned] * areas[aligned, None]).sum(axis=0)
        normal = mean / np.linalg.norm(mean)
    aligned = some[normals[some] @ normal > _ALIGNED]
    offset = _densest(centres[aligned] @ normal, areas[aligned], tolerance)
    for _ in range(MAX_ROUNDS):
        heights = centres @ normal - offset
        taken = left & (np.abs(heights) <= tolerance) & (normals @ normal > _LEANING)
        if taken.sum() < 3:
            break
        weights = areas[taken]
        middle = np.average(centres[taken], axis=0, weights=weights)
        steps = centres[taken] - middle
        flattest = np.linalg.eigh((steps * weights[:, None]).T @ steps)[1][:, 0]
        normal = flattest if flattest @ normal > 0.0 else -flattest
        offset = float(normal @ middle)
    taken = left & (np.abs(centres @ normal - offset) <= tolerance) & (normals @ normal > _LEANING)
    return np.append(normal, offset), taken


def _densest(heights: Array, areas: Array, tolerance: float) -> float:
    """Return the height about which the largest area lies within the tolerance."""
    order = np.argsort(heights)
    sums = np.concatenate([[0.0], np.cumsum(areas[order])])
    ends = np.searchsorted(heights[order], heights[order] + 2.0 * tolerance, side="right")
    best = int((sums[ends] - sums[: len(order)]).argmax())
    inside = order[best : int(ends[best])]
    return float(np.average(heights[inside], weights=areas[inside]))
