"""One repair pass for surfaces that are nearly closed, within a stated tolerance.

In this order: corners of open edges that lie within the tolerance of each other become one; faces that lose their
area are dropped; corners that lie on an open edge of another face divide it (T-junctions); open edges that bound a
hole no larger than a small part of the surface are covered, or, where faces would cross then, brought together if the
hole is a slit. Closed parts of the surface stay as they are. What was done is counted, with the largest distance.
"""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from survey.arrays import Array
from survey.conventions import FLAT, ROUNDS
from survey.geometry.folds import warp
from survey.geometry.repair.polygons import Polygon, is_flat_line, simple_polygons, without_repeats
from survey.geometry.solids import Solid, area_vector
from survey.geometry.watertight import triangulate

Edge = tuple[int, int]

_SMALL = 0.03  # largest hole that is covered, over the area of the surface
_CORNERS = 400  # most corners of such a hole
_SLIT = 0.005  # widest slit that is brought together, over the size of the surface
_REACH = 4.0  # distance across which a slit is brought together, over its mean width


@dataclass(frozen=True)
class Hole:
    """A hole in a surface.

    Attributes
    ----------
    edges : number of open edges around it
    centre : (3,) mean of its corners [m]
    width : largest extent [m]
    share : its area over that of the surface
    slit : mean distance across it [m]
    """

    edges: int
    centre: tuple[float, float, float]
    width: float
    share: float
    slit: float

    @property
    def text(self) -> str:
        """Place and size in words."""
        x, y, z = self.centre
        return f"a hole {self.width:.3g} m wide with {self.edges} edges about ({x:.3f}, {y:.3f}, {z:.3f})"


@dataclass(frozen=True)
class Repaired:
    """A surface after the pass.

    Attributes
    ----------
    vertices : (nv, 3) [m]
    polygons : vertex indices of each
    deeds : what was done, how often and how far, in words
    left : holes that remain
    """

    vertices: Array
    polygons: list[Polygon]
    deeds: tuple[str, ...]
    left: tuple[Hole, ...]


def open_edges(polygons: Sequence[Polygon]) -> list[Edge]:
    """List the directed edges of faces that no other face shares in either direction."""
    count: Counter[Edge] = Counter()
    for polygon in polygons:
        for a, b in _edges(polygon):
            count[min(a, b), max(a, b)] += 1
    return [(a, b) for polygon in polygons for a, b in _edges(polygon) if count[min(a, b), max(a, b)] == 1]


def repair(vertices: Array, polygons: Sequence[Polygon], tolerance: float) -> Repaired:
    """Close a surface that is nearly closed.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    polygons : simple, vertex indices of each
    tolerance : distance of corners that are the same, and of corners from an edge that they divide [m]
    """
    joined, deeds = _joined(vertices, list(polygons), tolerance)
    covers, uncovered, largest = _covers(vertices, joined)
    if covers and not uncovered and largest is not None:
        covered = joined + [polygon for cover in covers for polygon in cover]
        if _crossings(covered) <= _crossings(polygons):
            holes = "1 hole" if len(covers) == 1 else f"{len(covers)} holes"
            text = f"{holes} covered, the largest {largest.text.removeprefix('a hole ')}"
            return Repaired(vertices, covered, (*deeds, text), ())
    if uncovered or covers:
        size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        slits = holes_of(vertices, joined)
        widest = max(slit.slit for slit in slits)
        if 0.0 < widest <= _SLIT * size:
            zipped, more = _joined(vertices, joined, _REACH * widest)
            if not open_edges(zipped) and _crossings(zipped) == 0:
                return Repaired(vertices, zipped, (*deeds, *more), ())
        uncovered = slits
    return Repaired(vertices, joined, deeds, tuple(sorted(uncovered, key=lambda hole: -hole.width)))


def _joined(
    vertices: Array, polygons: list[Polygon], tolerance: float
) -> tuple[list[Polygon], tuple[str, ...]]:
    """Weld and divide open edges within the tolerance; return the polygons, and what was done."""
    welded, dropped, divided, farthest = 0, 0, 0, [0.0, 0.0]
    for _ in range(ROUNDS):
        edges = open_edges(polygons)
        if not edges:
            break
        same, moved = _welds(vertices, edges, tolerance)
        if same:
            polygons, gone = _renumbered(vertices, polygons, same)
            welded, dropped = welded + len(same), dropped + gone
            farthest[0] = max(farthest[0], moved)
        cuts, away = _divisions(vertices, open_edges(polygons), tolerance)
        if cuts:
            polygons = [_divided(polygon, cuts) for polygon in polygons]
            divided += sum(map(len, cuts.values()))
            farthest[1] = max(farthest[1], away)
        if not same and not cuts:
            break
    deeds = []
    if welded:
        deeds.append(f"{welded} corners of open edges welded, up to {farthest[0] * 1e3:.2g} mm apart")
    if dropped:
        deeds.append(f"{dropped} faces without area dropped")
    if divided:
        deeds.append(f"{divided} corners divide edges of other faces, up to {farthest[1] * 1e3:.2g} mm away")
    return polygons, tuple(deeds)


def _crossings(polygons: Sequence[Polygon]) -> int:
    """Count the edges with more than two faces, and those at which the sides of faces cannot be made to agree."""
    owners: dict[Edge, list[int]] = defaultdict(list)
    for k, polygon in enumerate(polygons):
        for a, b in _edges(polygon):
            owners[min(a, b), max(a, b)].append(k)
    wrong = {edge for edge, faces in owners.items() if len(faces) > 2}
    turned: dict[int, bool] = {}
    for seed in range(len(polygons)):
        if seed in turned:
            continue
        turned[seed] = False
        members = [seed]
        for k in members:
            for a, b in _edges(polygons[k]):
                edge = min(a, b), max(a, b)
                faces = owners[edge]
                if len(faces) != 2:
                    continue
                neighbour = faces[k == faces[0]]
                wanted = turned[k] ^ ((a, b) in set(_edges(polygons[neighbour])))
                if neighbour not in turned:
                    turned[neighbour] = wanted
                    members.append(neighbour)
                elif turned[neighbour] != wanted:
                    wrong.add(edge)
    return len(wrong)


def _edges(polygon: Polygon) -> list[Edge]:
    return [(polygon[k - 1], polygon[k]) for k in range(len(polygon))]


def _welds(vertices: Array, edges: Sequence[Edge], tolerance: float) -> tuple[dict[int, int], float]:
    """Return which corner of open edges becomes which other, and the largest distance [m]."""
    corners = sorted({i for edge in edges for i in edge})
    tree = cKDTree(vertices[corners])
    pairs = tree.query_pairs(tolerance, output_type="ndarray")
    if not len(pairs):
        return {}, 0.0
    distance = np.linalg.norm(
        vertices[np.array(corners)[pairs[:, 0]]] - vertices[np.array(corners)[pairs[:, 1]]], axis=1
    )
    root = {i: i for i in corners}
    members = {i: [i] for i in corners}
    for k in np.argsort(distance, kind="stable").tolist():
        a, b = sorted((_root(root, corners[pairs[k, 0]]), _root(root, corners[pairs[k, 1]])))
        if a == b:
            continue
        both = members[a] + members[b]
        if float(np.linalg.norm(np.ptp(vertices[both], axis=0))) <= 2.0 * tolerance:  # no chains
            root[b], members[a] = a, both
    same = {i: _root(root, i) for i in corners if _root(root, i) != i}
    moved = max((float(np.linalg.norm(vertices[i] - vertices[j])) for i, j in same.items()), default=0.0)
    return same, moved


def _root(root: dict[int, int], i: int) -> int:
    while root[i] != i:
        i = root[i]
    return i


def _renumbered(
    vertices: Array, polygons: Sequence[Polygon], same: dict[int, int]
) -> tuple[list[Polygon], int]:
    """Return the polygons with welded corners, and the number that lost their area."""
    out: list[Polygon] = []
    gone = 0
    for polygon in polygons:
        if same.keys().isdisjoint(polygon):
            out.append(polygon)
            continue
        ring = without_repeats([same.get(i, i) for i in polygon])
        if len(ring) < 3 or is_flat_line(vertices, ring):
            gone += 1
        else:
            out += simple_polygons(vertices, ring)
    return out, gone


def _divisions(
    vertices: Array, edges: Sequence[Edge], tolerance: float
) -> tuple[dict[Edge, list[int]], float]:
    """Return the corners that divide open edges, by edge and in order, and their largest distance from it [m]."""
    if not edges:
        return {}, 0.0
    corners = np.array(sorted({i for edge in edges for i in edge}))
    places = vertices[corners]
    cuts: dict[Edge, list[int]] = {}
    farthest = 0.0
    for a, b in edges:
        along = vertices[b] - vertices[a]
        length = float(np.linalg.norm(along))
        if not length > 2.0 * tolerance:
            continue
        offsets = places - vertices[a]
        at = offsets @ along / length
        away = np.linalg.norm(offsets - at[:, None] * (along / length), axis=1)
        inside = np.flatnonzero((away <= tolerance) & (at > tolerance) & (at < length - tolerance))
        if len(inside):
            order = inside[np.argsort(at[inside], kind="stable")]
            cuts[a, b] = corners[order].tolist()
            farthest = max(farthest, float(away[inside].max()))
    return cuts, farthest


def _divided(polygon: Polygon, cuts: dict[Edge, list[int]]) -> Polygon:
    """Return a polygon with the corners that divide its edges."""
    ring: list[int] = []
    corners = set(polygon)
    for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        ring.append(a)
        ring += [i for i in cuts.get((a, b), ()) if i not in corners]
    return tuple(ring)


def _loops(polygons: Sequence[Polygon]) -> list[list[int]] | None:
    """Return the rings of open edges, in the direction that covers them; None if they are not rings."""
    after: dict[int, list[int]] = defaultdict(list)
    for a, b in open_edges(polygons):
        after[a].append(b)
        after[b].append(a)
    if any(len(others) != 2 for others in after.values()):
        return None
    loops, taken = [], set[int]()
    for start in sorted(after):
        if start in taken:
            continue
        loop, before = [start], start
        here = after[start][0]
        while here != start:
            loop.append(here)
            first, second = after[here]
            before, here = here, second if first == before else first
        taken.update(loop)
        loops.append(loop)
    return loops


def holes_of(vertices: Array, polygons: Sequence[Polygon]) -> list[Hole]:
    """Describe the holes of a surface; open edges that make no rings are one."""
    loops = _loops(polygons)
    if loops is None:
        loops = [sorted({i for edge in open_edges(polygons) for i in edge})]
    total = sum(float(np.linalg.norm(area_vector(vertices[list(polygon)]))) for polygon in polygons)
    holes = []
    for loop in loops:
        places = vertices[loop]
        x, y, z = places.mean(axis=0).tolist()
        area = float(np.linalg.norm(area_vector(places)))
        width = float(np.linalg.norm(np.ptp(places, axis=0)))
        around = float(np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1).sum())
        slit = 2.0 * area / around if around > 0.0 else 0.0
        holes.append(Hole(len(loop), (x, y, z), width, area / total if total > 0.0 else 1.0, slit))
    return holes


def _covers(
    vertices: Array, polygons: Sequence[Polygon]
) -> tuple[list[list[Polygon]], list[Hole], Hole | None]:
    """Return triangles over each small hole, the holes that are not small, and the largest that is covered."""
    if not open_edges(polygons):
        return [], [], None
    loops, holes = _loops(polygons), holes_of(vertices, polygons)
    if loops is None:
        return [], holes, None
    covers, uncovered, largest = [], [], None
    directed = set(open_edges(polygons))
    taken = {(min(edge), max(edge)) for polygon in polygons for edge in _edges(polygon)}
    for loop, hole in zip(loops, holes, strict=True):
        if hole.share > _SMALL or len(loop) > _CORNERS or len(loop) < 3:
            uncovered.append(hole)
            continue
        ring = loop if (loop[1], loop[0]) in directed else loop[::-1]
        cover = _cover(vertices, ring, taken)
        if cover is None:
            uncovered.append(hole)
            continue
        covers.append(cover)
        if largest is None or hole.width > largest.width:
            largest = hole
    return covers, uncovered, largest


def _cover(vertices: Array, ring: list[int], taken: set[Edge]) -> list[Polygon] | None:
    """Return faces over a ring, without an edge that others have; None if there are none."""
    size = float(np.linalg.norm(np.ptp(vertices[ring], axis=0)))
    if warp(vertices[ring]) <= FLAT * size:
        return [tuple(ring)]
    border = {(min(edge), max(edge)) for edge in _edges(tuple(ring))}
    for start in range(len(ring)):
        turned = tuple(ring[start:] + ring[:start])
        triangles = [tuple(triangle) for triangle in triangulate(Solid("", vertices, (turned,))).tolist()]
        inner = {(min(edge), max(edge)) for triangle in triangles for edge in _edges(triangle)} - border
        if inner.isdisjoint(taken):
            return triangles
    return None
