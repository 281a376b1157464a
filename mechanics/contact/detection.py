"""Contact detection between stones made of convex shapes, rigid and deformable.

Boxes that overlap (broad phase) → separating axis → the interface of each pair of shapes: two faces, or two edges.
Faces of rigid stones touch in points of their overlap; a deformable face that lies flat on another touches in one
weighted point per corner node of its mesh (mortar), and so it does on a ball that its mesh is fine enough to see;
elsewhere a deformable stone touches in single points.
All tolerances are fractions of the stones' own sizes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from ground.errors import SceneError
from mechanics.arrays import Array, Bools, Ints
from mechanics.contact._kernels.balls import ball_points
from mechanics.contact._kernels.broad_phase import boxes, close_pairs, grid_of, place, single_points
from mechanics.contact._kernels.narrow_phase import (
    EDGES,
    FACE_FIRST,
    SAME_PLANE,
    SEPARATED,
    Pairs,
    interface_points,
    separating_axes,
)
from mechanics.contact.ball_contacts import FaceCells, ball_contacts, face_cells
from mechanics.contact.contacts import PAIR_BIT, Contacts, gaps, joined, take
from mechanics.contact.mortar_contacts import mortar_contacts, surface_weights
from mechanics.contact.surfaces import Placed, Surfaces, middles
from mechanics.scene.scene import Placement
from mechanics.scene.state import State
from mechanics.scene.threads import at_once

FLAT = float(np.cos(np.radians(5.0)))  # cosine of the angle within which faces lie flat on one another
# number of pairs or boxes from which another thread pays: 0.5 ms of work
_THREAD_BATCH = 500
THIN = 1e-6  # flat faces that overlap by less than this part of the smaller one do not touch


@dataclass(frozen=True)
class _Singles:
    """Single contact points as `interface_points` gives them."""

    place: Ints
    frame: Array
    nearest: Array
    area: Array

    def without(self, rows: Ints) -> "_Singles":
        """Return all points but the excluded ones."""
        keep = np.delete(np.arange(len(self.place)), rows)
        return _Singles(self.place[keep], self.frame[keep], self.nearest[keep], self.area[keep])


@dataclass
class _Hints:
    """Separating faces of the last detection: they save time and never change a result."""

    key: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    face: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def of(self, key: Ints) -> Ints:
        """Return the face of each pair key, sorted; -1 where none is known."""
        if len(self.key) == 0:
            return np.full(len(key), -1)
        at = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
        return np.where(self.key[at] == key, self.face[at], -1)


@dataclass(frozen=True)
class Detector:
    """Contact detection in a configuration.

    Attributes
    ----------
    surfaces : the bodies' polyhedra and face meshes
    fixed : (nb,) fixed bodies; pairs of them are left out
    alert : gap below which a contact is watched, relative to the smaller stone [-]
    points, placement : minimum number of contact points of two rigid faces, and where they lie
    spacing : of points over the area of the faces [m]
    distance : gap up to which some law acts, whatever the size of the stones [m]
    threads : maximum number of concurrent threads; the result is the same to the last bit
    """

    surfaces: Surfaces
    fixed: Bools
    alert: float
    points: int = 4
    placement: Placement = Placement.CORNERS
    distance: float = 0.0
    threads: int = 1
    spacing: float | None = None
    _hints: _Hints = field(default_factory=_Hints, repr=False)
    _cells: list[FaceCells] = field(default_factory=list, repr=False)

    def __call__(self, state: State, reach: Array) -> Contacts:
        """Find the contacts at the configuration of `state`, given the `reach` (nb,) of each body in the step [m]."""
        surfaces, placed = self.surfaces, _place(self.surfaces, state)
        pairs = self._touching(placed, reach[surfaces.body])
        flat = self._flat_and_meshed(pairs, placed)
        curved, singles = self._curved(pairs, placed, state)
        points = self._points(pairs, flat, singles, placed, len(state.node))
        if not flat.any():
            return joined([points, *curved]) if curved else points
        owner = np.where(pairs.kind == FACE_FIRST, 0, 1)[flat]
        rows = np.arange(len(owner))
        contacts, limit = mortar_contacts(
            surfaces,
            placed,
            np.column_stack([pairs.shapes[flat][rows, owner], pairs.shapes[flat][rows, 1 - owner]]),
            pairs.feature[flat],
            _pair_key(pairs.shapes[flat], len(surfaces.body)),
            pairs.limit[flat],
            len(state.node),
            THIN,
        )
        return joined([points, *curved, take(contacts, np.flatnonzero(gaps(contacts, state) <= limit))])

    def face_pairs(self, state: State) -> tuple[Ints, Ints]:
        """Return the pairs of shapes that meet at faces within the alert distance, with or without contact points.

        They are named (n,) by the high bits of the keys of contacts; their bodies (n, 2) come besides.
        """
        pairs = self._touching(_place(self.surfaces, state), np.zeros(len(self.surfaces.body)))
        shapes = pairs.shapes[(pairs.kind > 0) & (pairs.kind != EDGES)]
        return _pair_key(shapes, len(self.surfaces.body)) >> PAIR_BIT, self.surfaces.body[shapes]

    def _touching(self, placed: Placed, reach: Array) -> Pairs:
        """Find the pairs of shapes nearer than their alert distance."""
        surfaces = self.surfaces
        # a thin part of a stone is watched like the whole stone
        size = surfaces.size[surfaces.body]
        margin = np.maximum(self.alert * size, self.distance) + reach
        low, high = boxes(surfaces.shapes.vptr, placed.shapes.vertex, margin)
        round_ = surfaces.radius > 0
        around = placed.centre[surfaces.body[round_]], (surfaces.radius + margin)[round_, None]
        low[round_], high[round_] = around[0] - around[1], around[0] + around[1]
        fixed, grid = self.fixed[surfaces.body], grid_of(low, high)
        (shapes,) = self._in_parts(
            len(low), lambda a, b: (close_pairs(low, high, surfaces.body, fixed, grid, a, b),)
        )
        key = _pair_key(shapes, len(surfaces.body))
        order = np.argsort(key)
        shapes, key = shapes[order], key[order]
        first, second = shapes.T
        limit = np.maximum(self.alert * np.minimum(size[first], size[second]), self.distance)
        limit = limit + (reach[first] + reach[second])
        balls = round_[first] | round_[second]
        hint = self._hints.of(key)
        nearest = np.where(balls, -np.inf, limit)

        # points over the area are kept where the two faces are equally deep, so that they keep their names
        plane = FLAT if self.placement == Placement.AREA else SAME_PLANE

        def part(a: int, b: int) -> tuple[Ints, Ints, Array]:
            """Return the separating axes of the pairs from a to b."""
            axes: tuple[Ints, Ints, Array] = separating_axes(
                shapes[a:b], nearest[a:b], hint[a:b], plane, placed.shapes
            )
            return axes

        kind, feature, axis = self._in_parts(len(shapes), part)
        self._hints.key, self._hints.face = key, hint
        return Pairs(shapes, limit, balls, kind, feature, axis)

    def _flat_and_meshed(self, pairs: Pairs, placed: Placed) -> Bools:
        """Choose the pairs of flat faces, at least one with finite elements."""
        meshed = self.surfaces.meshes.of_face >= 0
        if not meshed.any():
            return np.zeros(len(pairs.kind), dtype=bool)
        faces = (pairs.kind > 0) & (pairs.kind != EDGES)
        chosen: Bools = faces & meshed[np.where(faces[:, None], pairs.feature, 0)].any(axis=1)
        normal = placed.shapes.normal[pairs.feature[chosen]]
        chosen[chosen] = -np.einsum("pi,pi->p", normal[:, 0], normal[:, 1]) > FLAT
        return chosen

    def _points(
        self, pairs: Pairs, weighted: Bools, balls: _Singles | None, placed: Placed, nodes: int
    ) -> Contacts:
        """Make contacts in single points: those of polyhedra, except the `weighted` pairs, and those of balls."""
        surfaces = self.surfaces
        points = self._interfaces(pairs._replace(kind=np.where(weighted, SEPARATED, pairs.kind)), placed)
        count = len(points[0])
        if balls is not None:
            points = _joined([points, self._of_bodies(pairs, balls, placed)])
        index, frame, area, body, arm = points
        pair = index[:, 0]
        key = _pair_key(pairs.shapes, len(surfaces.body))[pair] + index[:, 2]
        if not nodes:
            return Contacts(body, key, frame, area, arm, csr_array((2 * len(pair), 0)))
        # the antagonist owns the reference face; edges lie on the faces that face along the axis, balls on none
        faces = (pairs.kind[pair] != EDGES) & (np.arange(len(pair)) < count)
        feature = np.where(faces[:, None], pairs.feature[pair][:, ::-1], -1)
        sides = pairs.shapes[pair[:, None], np.column_stack([index[:, 1], 1 - index[:, 1]])]
        weights, outside = surface_weights(surfaces, placed, sides, feature, frame[:, 0], arm, nodes)
        return take(Contacts(body, key, frame, area, arm, weights), np.flatnonzero(outside))

    def _interfaces(self, pairs: Pairs, placed: Placed) -> tuple[Any, ...]:
        """Return the contact points of all pairs, as `_of_bodies` does of single points.

        Raises
        ------
        SceneError : the points over the area of a face are too many to be named
        """
        inner, middle = self.placement == Placement.INERTIA, self.placement == Placement.CENTROID
        spacing = self.spacing if self.spacing and self.placement == Placement.AREA else 0.0

        def part(a: int, b: int) -> tuple[Any, ...]:
            """Return the contact points of the pairs from a to b."""
            some = Pairs._make(pair[a:b] for pair in pairs)
            try:
                index, *points = interface_points(
                    some, self.points, inner, middle, spacing, FLAT, THIN, placed.shapes
                )
            except ValueError as error:
                raise SceneError(
                    f"spacing = {spacing:g} m makes more points on one face than can be told apart",
                    where="contact",
                    remedy="give a larger spacing",
                ) from error
            index[:, 0] += a
            return self._of_bodies(pairs, _Singles(index, *points), placed)

        return self._in_parts(len(pairs.kind), part)

    def _of_bodies(self, pairs: Pairs, points: _Singles, placed: Placed) -> tuple[Any, ...]:
        """Return place, frame and area of single points, and their bodies and arms (`single_points`)."""
        body, arm = single_points(
            pairs.shapes, points.place, points.nearest, self.surfaces.body, placed.centre, placed.rotation
        )
        return points.place, points.frame, points.area, body, arm

    def _in_parts(self, count: int, work: Callable[[int, int], tuple[Any, ...]]) -> tuple[Any, ...]:
        """Return the results of `work` for all pairs or boxes, in order; each thread takes a range of them."""
        parts = min(self.threads, count // _THREAD_BATCH)
        if parts < 2:
            return work(0, count)
        end = [count * k // parts for k in range(parts + 1)]
        return _joined(at_once(self.threads)(work, end[:-1], end[1:]))

    def _balls(self, pairs: Pairs, placed: Placed) -> _Singles:
        """Find the single points of pairs with a ball."""
        surfaces, balls = self.surfaces, np.flatnonzero(pairs.balls)
        place, frame, nearest, area = ball_points(
            pairs.shapes[balls],
            pairs.limit[balls],
            surfaces.radius,
            placed.centre[surfaces.body],
            placed.rotation[surfaces.body],
            placed.shapes,
        )
        place[:, 0] = balls[place[:, 0]]
        return _Singles(place, frame, nearest, area)

    def _curved(self, pairs: Pairs, placed: Placed, state: State) -> tuple[list[Contacts], _Singles | None]:
        """Return weighted contacts of balls with meshes that see them, and single points of the other balls."""
        if not pairs.balls.any():
            return [], None
        surfaces, points = self.surfaces, self._balls(pairs, placed)
        meshed = (
            surfaces.meshes.of_face[surfaces.shapes.fptr[:-1]][pairs.shapes[points.place[:, 0]]].max(axis=1)
            >= 0
        )
        rows = np.flatnonzero(meshed)
        if len(rows) == 0:
            return [], points
        pair = points.place[rows, 0]
        shapes = pairs.shapes[pair]
        gap = np.einsum("ci,ci->c", points.frame[rows, 0], points.nearest[rows, 0] - points.nearest[rows, 1])
        key = _pair_key(shapes, len(surfaces.body))
        if not self._cells:
            self._cells.append(face_cells(surfaces, len(state.node)))
        weighted, seen = ball_contacts(
            surfaces, placed, state, self._cells[0], shapes, key, pairs.limit[pair], gap
        )
        return weighted, points.without(rows[seen])


def _place(surfaces: Surfaces, state: State) -> Placed:
    """Put all shapes where their bodies are."""
    packed, centre, turn = surfaces.shapes, state.centre[surfaces.body], state.rotation[surfaces.body]
    vertex = place(packed.vptr, packed.vertex, centre, turn)
    normal = place(packed.fptr, packed.normal, np.zeros_like(centre), turn)
    shapes = packed._replace(vertex=vertex, normal=normal, inside=middles(packed.vptr, vertex))
    return Placed(shapes, state.centre, state.rotation)


def _joined(parts: Sequence[tuple[Any, ...]]) -> tuple[Any, ...]:
    """Join the arrays of all parts, one after the other."""
    return tuple(np.concatenate(arrays) for arrays in zip(*parts, strict=True))


def _pair_key(shapes: Ints, count: int) -> Ints:
    key: Ints = (shapes[:, 0] * count + shapes[:, 1]) << PAIR_BIT
    return key
