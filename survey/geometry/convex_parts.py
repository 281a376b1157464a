"""Decomposition of a non-convex stone into convex parts.

Along each reflex edge the stone is cut by a plane through the edge that leaves less than 180° on either side. The
boundary of the stone is carried along in pieces: a region between cuts is convex as soon as no piece of the
boundary lies in front of the plane of another; it is then the intersection of the half-spaces of its pieces and
cuts. Regions are never represented in any other way, so no cut faces with holes arise.

A stone that no such cuts divide, as with many facets that fold this way and that, is divided into pyramids on its
faces, with their common apex at the place from which all faces are seen best, if there is one.

A cut is better the fewer reflex edges it leaves: planes through two of them come before the continuation of a face,
and this before the bisector. Of the possible first cuts, the one is taken that ends in the fewest parts, and of
these the one whose thinnest part is thickest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import SAME
from survey.geometry.convexity import ReflexEdge, flatness, is_convex, reflex_edges
from survey.geometry.half_spaces import intersection
from survey.geometry.solids import Solid, planes_of_solid, volume_of
from survey.geometry.watertight import triangulate

Place = tuple[float, float, float]
Plane = tuple[float, float, float, float]

_BEGINNINGS = 8  # first cuts that are followed to the end


@dataclass(frozen=True)
class _Region:
    """Region between cuts: half-spaces of the cuts, pieces (face, polygon) of the boundary, reflex edges."""

    cuts: tuple[Plane, ...]
    pieces: tuple[tuple[int, tuple[Place, ...]], ...]
    edges: tuple[ReflexEdge, ...]


def convex_parts(solid: Solid, most: int = 32) -> tuple[Solid, ...]:
    """Cut a solid into convex parts that fill it without overlap.

    Parameters
    ----------
    solid : closed, with planar faces
    most : largest number of parts

    Returns
    -------
    The parts, all under the solid's code; the solid itself if it is convex. The same solid always gives the same
    parts

    Raises
    ------
    GeometryError
        if it would take more parts, or its faces are not planes
    """
    if is_convex(solid):
        return (solid,)
    cutter = _Cutter(solid, most)
    return cutter.parts()


class _Cutter:
    """One solid being cut; coordinates are relative to its middle."""

    def __init__(self, solid: Solid, most: int) -> None:
        self._solid, self._most = solid, most
        self._low, self._high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
        self._origin = 0.5 * (self._low + self._high)
        self._local = replace(solid, vertices=solid.vertices - self._origin)
        self._size = float(np.linalg.norm(self._high - self._low))
        self._flat = flatness(solid)  # distance within which two places are the same
        self._on = 0.1 * self._flat
        self._planes = [_plane(row) for row in planes_of_solid(self._local).tolist()]

    def parts(self) -> tuple[Solid, ...]:
        """Return the best of several decompositions."""
        whole = _Region((), tuple(self._pieces()), reflex_edges(self._local))
        ranked = sorted(self._ranked(whole), key=lambda candidate: candidate[0])
        beginnings = [cut for rank, cut in ranked if rank[0] == ranked[0][0][0]][:_BEGINNINGS]
        starts: list[Plane | None] = [*beginnings] or [None]
        candidates = [
            parts for parts in (self._follow(whole, first) for first in starts) if parts is not None
        ]
        filling = [parts for parts in candidates if self._is_filled(parts)]
        if not filling:
            pyramids = self._pyramids()
            filling = [pyramids] if pyramids is not None and self._is_filled(pyramids) else []
        if not filling and candidates:
            raise GeometryError(
                "its convex parts do not fill it: its faces are not quite planar, or cross each other",
                where=f"stone {self._solid.code}",
                remedy="divide it into several stones, or export its faces as triangles",
            )
        if not filling:
            raise GeometryError(
                f"it is not convex, and would take more than {self._most} convex parts",
                where=f"stone {self._solid.code}",
                remedy="simplify it, or divide it into several stones",
            )
        best = max(filling, key=self._worth)
        return tuple(replace(piece, vertices=self._placed(piece.vertices)) for piece in best)

    def _worth(self, parts: Sequence[Solid]) -> tuple[int, float]:
        """Return a key that is greater for fewer parts, then for a thicker thinnest part."""
        return -len(parts), round(min(map(_width, parts)) / self._size, 9)

    def _pieces(self) -> Iterator[tuple[int, tuple[Place, ...]]]:
        """Yield the faces as convex polygons."""
        corners = [_place(row) for row in self._local.vertices.tolist()]
        for k, face in enumerate(self._local.faces):
            if _turns_left(self._local.vertices[list(face)], np.array(self._planes[k][:3])):
                yield k, tuple(corners[i] for i in face)
            else:
                for triangle in triangulate(replace(self._local, faces=(face,))).tolist():
                    a, b, c = self._local.vertices[triangle]
                    longest = max(float(np.linalg.norm(side)) for side in (b - a, c - b, a - c))
                    if float(np.linalg.norm(np.cross(b - a, c - a))) > self._flat * longest:
                        yield k, tuple(corners[i] for i in triangle)

    def _pyramids(self) -> list[Solid] | None:
        """Return pyramids on all faces; None if there are too many, or no place from which all faces are seen."""
        pieces = list(self._pieces())
        planes = np.array([self._planes[k] for k, _ in pieces])
        apex = _farthest_behind(planes)
        if (
            len(pieces) > self._most
            or apex is None
            or (planes[:, 3] - planes[:, :3] @ apex).min() <= self._flat
        ):
            return None
        parts = []
        for _, polygon in pieces:
            n = len(polygon)
            sides = [(n, (i + 1) % n, i) for i in range(n)]
            vertices = np.array([*polygon, apex])
            parts.append(Solid(self._solid.code, vertices, (tuple(range(n)), *sides)))
        return parts

    def _follow(self, whole: _Region, first: Plane | None) -> list[Solid] | None:
        """Cut until all regions are convex; return None if that takes too many parts."""
        waiting = list(self._halves(whole, first)) if first is not None else [whole]
        done: list[Solid] = []
        while waiting:
            region = waiting.pop()
            if len(waiting) + len(done) >= self._most:
                return None
            if not region.pieces or self._is_convex(region):
                piece = self._part(region)
                if piece is not None:
                    done.append(piece)
                continue
            ranked = list(self._ranked(region))
            if not ranked:
                return None
            waiting += self._halves(region, min(ranked, key=lambda candidate: candidate[0])[1])
        return done

    def _is_convex(self, region: _Region) -> bool:
        places = np.array([place for _, polygon in region.pieces for place in polygon])
        planes = np.array([self._planes[k] for k in dict(region.pieces)])
        return bool((places @ planes[:, :3].T - planes[:, 3]).max() <= self._flat)

    def _part(self, region: _Region) -> Solid | None:
        planes = [*dict.fromkeys(self._planes[k] for k, _ in region.pieces), *region.cuts]
        margin = 0.01 * self._size
        low, high = self._low - self._origin - margin, self._high - self._origin + margin
        solid = intersection(self._solid.code, planes, low, high, self._on)
        if solid is None or (not region.pieces and not self._holds(solid.vertices.mean(axis=0))):
            return None
        return solid

    def _holds(self, place: Array) -> bool:
        """Return whether a place is in the stone, by the solid angle of its faces (van Oosterom & Strackee 1983)."""
        a, b, c = (self._local.vertices[triangulate(self._local)[:, k]] - place for k in range(3))
        p, q, r = (np.linalg.norm(arm, axis=1) for arm in (a, b, c))
        over = (a * np.cross(b, c)).sum(axis=1)
        under = p * q * r + (a * b).sum(axis=1) * r + (b * c).sum(axis=1) * p + (c * a).sum(axis=1) * q
        return bool(np.arctan2(over, under).sum() > np.pi)

    def _ranked(self, region: _Region) -> Iterator[tuple[tuple[int, int, int], Plane]]:
        """Yield cuts that divide a region, fewest remaining reflex edges and pieces first."""
        for order, cut in enumerate(self._cuts(region)):
            halves = self._halves(region, cut)
            if all(half.pieces for half in halves):
                edges = sum(len(half.edges) for half in halves)
                pieces = sum(len(half.pieces) for half in halves)
                if edges < len(region.edges) or not region.edges:
                    yield (edges, pieces, order), cut

    def _cuts(self, region: _Region) -> Iterator[Plane]:
        """Yield planes through two reflex edges, continuations of faces, and bisectors."""
        edges = region.edges
        for k, edge in enumerate(edges):
            for second in edges[k + 1 :]:
                plane = self._through(edge, second)
                if plane is not None and self._divides(plane, edge) and self._divides(plane, second):
                    yield plane
        if edges:
            yield from dict.fromkeys(self._planes[k] for edge in edges for k in (edge.first, edge.second))
            for edge in edges:
                normal = np.array(self._planes[edge.first][:3]) - self._planes[edge.second][:3]
                yield _plane_through(normal, edge.start)
        else:  # pieces that are not connected
            yield from (self._planes[k] for k in dict(region.pieces))

    def _through(self, first: ReflexEdge, second: ReflexEdge) -> Plane | None:
        """Return the plane of two edges if they are coplanar."""
        places = np.array([first.start, first.stop, second.start, second.stop])
        centred = places - places.mean(axis=0)
        _, extents, axes = np.linalg.svd(centred)
        if extents[2] > self._on or extents[1] < self._flat:
            return None
        return _plane_through(axes[2], first.start)

    def _divides(self, plane: Plane, edge: ReflexEdge) -> bool:
        """Return whether a plane through an edge leaves at most 180° on either side."""
        along = np.cross(np.subtract(edge.stop, edge.start), plane[:3])
        first = float(np.dot(self._planes[edge.first][:3], along))
        second = float(np.dot(self._planes[edge.second][:3], along))
        slack = 1e-9 * float(np.linalg.norm(along))
        return min(first, second) >= -slack or max(first, second) <= slack

    def _halves(self, region: _Region, cut: Plane) -> tuple[_Region, _Region]:
        """Return the parts of a region behind and in front of a plane."""
        reverse = (-cut[0], -cut[1], -cut[2], -cut[3])
        return self._behind(region, cut), self._behind(region, reverse)

    def _behind(self, region: _Region, cut: Plane) -> _Region:
        pieces = []
        for k, polygon in region.pieces:
            behind = _clipped(polygon, cut, self._on)
            if behind is None:  # it lies in the cut, and belongs to the side whose boundary it is
                plane = self._planes[k]
                if plane[0] * cut[0] + plane[1] * cut[1] + plane[2] * cut[2] > 0.0:
                    pieces.append((k, polygon))
            elif len(behind) > 2:
                pieces.append((k, behind))
        edges = []
        for edge in region.edges:
            behind = _clipped((edge.start, edge.stop), cut, self._on)
            if behind is not None and len(behind) == 2:
                edges.append(replace(edge, start=behind[0], stop=behind[1]))
        return _Region((*region.cuts, cut), tuple(pieces), tuple(edges))

    def _placed(self, vertices: Array) -> Array:
        """Return corners in the frame of the stone; its own corners keep their last digit."""
        away = np.linalg.norm(vertices[:, None] - self._local.vertices, axis=2)
        nearest = away.argmin(axis=1)
        nearby = away[np.arange(len(vertices)), nearest] <= self._flat
        out: Array = np.where(nearby[:, None], self._solid.vertices[nearest], vertices + self._origin)
        return out

    def _is_filled(self, parts: Sequence[Solid]) -> bool:
        whole = volume_of(self._local)
        return abs(sum(map(volume_of, parts)) - whole) <= SAME * whole


def _farthest_behind(planes: Array) -> Array | None:
    """Return the place (3,) whose least distance behind planes (n, 4) is the largest; None if there is none."""
    rows = np.column_stack([planes[:, :3], np.ones(len(planes))])
    optimum = linprog(
        [0.0, 0.0, 0.0, -1.0], A_ub=rows, b_ub=planes[:, 3], bounds=[(None, None)] * 3 + [(0.0, None)]
    )
    return None if optimum.x is None else np.asarray(optimum.x[:3], dtype=np.float64)


def _place(row: Sequence[float]) -> Place:
    return row[0], row[1], row[2]


def _plane(row: Sequence[float]) -> Plane:
    return row[0], row[1], row[2], row[3]


def _plane_through(normal: Array, place: Place) -> Plane:
    n = normal / np.linalg.norm(normal)
    a, b, c = n.tolist()
    return a, b, c, a * place[0] + b * place[1] + c * place[2]


def _turns_left(polygon: Array, normal: Array) -> bool:
    edges = np.roll(polygon, -1, axis=0) - polygon
    turns = np.cross(edges, np.roll(edges, -1, axis=0)) @ normal
    return bool(turns.min() >= -1e-12 * float((edges**2).sum()))


def _clipped(polygon: tuple[Place, ...], cut: Plane, on: float) -> tuple[Place, ...] | None:
    """Return the part of a convex polygon or edge behind a plane; None if all of it lies in the plane."""
    a, b, c, d = cut
    heights = [a * x + b * y + c * z - d for x, y, z in polygon]
    if max(heights) <= on:
        return polygon if min(heights) < -on else None
    if min(heights) >= -on:
        return ()
    behind = []
    for i, place in enumerate(polygon):
        k = (i + 1) % len(polygon)
        h, g = heights[i], heights[k]
        if h <= on:
            behind.append(place)
        if (h < -on and g > on) or (h > on and g < -on):
            t, following = h / (h - g), polygon[k]
            x, y, z = (p + t * (q - p) for p, q in zip(place, following, strict=True))
            behind.append((x, y, z))
    return tuple(behind[:2]) if len(polygon) == 2 else tuple(behind)


def _width(solid: Solid) -> float:
    """Return the smallest extent along the normal of a face [m]."""
    heights = solid.vertices @ planes_of_solid(solid)[:, :3].T
    return float(np.ptp(heights, axis=0).min())
