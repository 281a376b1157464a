"""Contact detection between convex stones, rigid and deformable.

Boxes that overlap (broad phase) → separating axis → the interface of each pair: two faces, or two edges. Faces
of rigid stones touch in the corners of their overlap; a deformable face that lies flat on another touches in one
weighted point per node (mortar); elsewhere a deformable stone touches in single points of its surface.
All tolerances are fractions of the stones' own sizes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from mechanics.contact import _kernels as kernel
from mechanics.contact.contacts import Contacts, gaps
from mechanics.contact.surfaces import FaceMesh, Surfaces
from mechanics.state import State

__all__ = ["Detector"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# faces whose normals differ by less than 5° lie flat on one another
_FLAT = float(np.cos(np.radians(5.0)))
# parallel faces that overlap by less than this part of the smaller one do not touch
_THIN = 1e-6
# a node whose share of the interface is below this part of the largest share makes no contact of its own
_SLIVER = 1e-3


@dataclass(frozen=True)
class Detector:
    """Finds the contacts of a configuration.

    Attributes
    ----------
    surfaces : the bodies' polyhedra and face meshes
    fixed : (nb,) bodies that never move; pairs of them are left out
    alert : gap below which a contact is watched, relative to the smaller body [-]
    """

    surfaces: Surfaces
    fixed: NDArray[np.bool_]
    alert: float

    def __call__(self, state: State, reach: Array) -> Contacts:
        """Contacts at the configuration of `state`; `reach` (nb,) is how far each body may move in the step [m]."""
        placed = _place(self.surfaces, state)
        margin = self.alert * self.surfaces.size + reach
        pairs = _pairs(self.surfaces, placed, margin, self.fixed)
        limit = self.alert * self.surfaces.size[pairs].min(axis=1) + reach[pairs].sum(axis=1)
        kind, feature, axis = kernel.separating_axes(
            pairs,
            limit,
            self.surfaces.vptr,
            placed.vertex,
            self.surfaces.fptr,
            self.surfaces.cptr,
            self.surfaces.corner,
            placed.normal,
            self.surfaces.eptr,
            self.surfaces.edge_a,
            self.surfaces.edge_b,
            placed.centre,
            self.surfaces.size,
        )
        collected = _Collector(self.surfaces, placed, len(state.node))
        for p in np.flatnonzero(kind):
            collected.add(pairs[p], int(kind[p]), feature[p], axis[p], float(limit[p]))
        contacts, alert = collected.contacts()
        near = gaps(contacts, state) <= alert
        return contacts if near.all() else _keep(contacts, near)


@dataclass(frozen=True)
class _Placed:
    """The polyhedra in world axes, and the frames that put them there."""

    vertex: Array
    normal: Array
    centre: Array
    rotation: Array


def _place(surfaces: Surfaces, state: State) -> _Placed:
    of_vertex, of_face = surfaces.body_of_vertex, surfaces.body_of_face
    vertex = state.centre[of_vertex] + np.einsum("vij,vj->vi", state.rotation[of_vertex], surfaces.vertex)
    normal = np.einsum("fij,fj->fi", state.rotation[of_face], surfaces.normal)
    return _Placed(vertex, normal, state.centre, state.rotation)


def _pairs(surfaces: Surfaces, placed: _Placed, margin: Array, fixed: NDArray[np.bool_]) -> Ints:
    low = np.minimum.reduceat(placed.vertex, surfaces.vptr[:-1]) - margin[:, None]
    high = np.maximum.reduceat(placed.vertex, surfaces.vptr[:-1]) + margin[:, None]
    pairs = kernel.close_pairs(low, high, fixed)
    ordered: Ints = pairs[np.lexsort(pairs.T[::-1])]
    return ordered


class _Collector:
    """Gathers the contacts of one interface after another."""

    def __init__(self, surfaces: Surfaces, placed: _Placed, nodes: int) -> None:
        self.surfaces, self.placed, self.nodes = surfaces, placed, nodes
        self.bodies: list[tuple[int, int]] = []
        self.key: list[int] = []
        self.frame: list[Array] = []
        self.area: list[float] = []
        self.alert: list[float] = []
        self.arm: list[tuple[Array, Array]] = []
        self.rows: list[tuple[Ints, Array]] = []

    def add(self, pair: Ints, kind: int, feature: Ints, axis: Array, alert: float) -> None:
        """The contacts of one pair of bodies."""
        first, second = int(pair[0]), int(pair[1])
        pair_key = (first * (len(self.surfaces.vptr) - 1) + second) << 24
        if kind == kernel.EDGES:
            self._edges(first, second, feature, axis, alert, pair_key)
            return
        reference, incident = int(feature[0]), int(feature[1])
        owner, other = (first, second) if kind == kernel.FACE_FIRST else (second, first)
        meshed = any(self.surfaces.face_mesh[f] is not None for f in (reference, incident))
        facing = -float(self.placed.normal[reference] @ self.placed.normal[incident])
        if meshed and facing > _FLAT:
            self._mortar((owner, other), (reference, incident), alert, pair_key)
        else:
            self._points((owner, other), (reference, incident), facing, alert, pair_key + (kind << 21))

    def _append(
        self, bodies: tuple[int, int], key: int, frame: Array, area: float, alert: float, sides: list["_Side"]
    ) -> None:
        self.bodies.append(bodies)
        self.key.append(key)
        self.frame.append(frame)
        self.area.append(area)
        self.alert.append(alert)
        self.arm.append((sides[0].arm, sides[1].arm))
        self.rows.extend((side.node, side.weight) for side in sides)

    def _points(
        self, bodies: tuple[int, int], faces: tuple[int, int], facing: float, alert: float, key: int
    ) -> None:
        """Corners of the overlap of two faces; the reference body is the antagonist."""
        reference, incident = faces
        n = self.placed.normal[reference]
        thin = _THIN * min(self.surfaces.face_area[reference], self.surfaces.face_area[incident])
        count, polygon, gap, area, label = kernel.face_points(
            reference,
            incident,
            n,
            self.surfaces.cptr,
            self.surfaces.corner,
            self.placed.vertex,
            alert,
            facing > _FLAT,
            thin,
        )
        frame = self._frame(n, reference)
        local = (reference - self.surfaces.fptr[bodies[0]]) % 64 * 64 + (
            incident - self.surfaces.fptr[bodies[1]]
        ) % 64
        for k in range(count):
            sides = [
                self._side(bodies[1], incident, polygon[k]),
                self._side(bodies[0], reference, polygon[k] - gap[k] * n),
            ]
            self._append(
                (bodies[1], bodies[0]),
                key + (int(local) << 9) + int(label[k]),
                frame,
                float(area[k]),
                alert,
                sides,
            )

    def _edges(self, first: int, second: int, feature: Ints, axis: Array, alert: float, key: int) -> None:
        """The nearest points of two crossing edges."""
        surfaces, x = self.surfaces, self.placed.vertex
        p, q = x[surfaces.edge_a[feature[0]]], x[surfaces.edge_a[feature[1]]]
        u, v = x[surfaces.edge_b[feature[0]]] - p, x[surfaces.edge_b[feature[1]]] - q
        st, *_ = np.linalg.lstsq(np.column_stack([u, -v]), q - p, rcond=None)
        s, t = np.clip(st, 0.0, 1.0)
        along = u / np.linalg.norm(u)
        frame = np.array([-axis, along, np.cross(-axis, along)])
        faces = [self._face_at(body, direction) for body, direction in ((first, axis), (second, -axis))]
        sides = [self._side(first, faces[0], p + s * u), self._side(second, faces[1], q + t * v)]
        local = (int(feature[0] - surfaces.eptr[first]) % 512 << 9) + int(
            feature[1] - surfaces.eptr[second]
        ) % 512
        self._append((first, second), key + (kernel.EDGES << 21) + local, frame, 0.0, alert, sides)

    def _face_at(self, body: int, direction: Array) -> int:
        start, stop = self.surfaces.fptr[body], self.surfaces.fptr[body + 1]
        return int(start + np.argmax(self.placed.normal[start:stop] @ direction))

    def _mortar(self, bodies: tuple[int, int], faces: tuple[int, int], alert: float, key: int) -> None:
        """One weighted point per node of the candidate face; the candidate is deformable, the finer of two."""
        if _fineness(self.surfaces, faces[0]) > _fineness(self.surfaces, faces[1]):
            (antagonist, candidate), (face_a, face_c) = (bodies[1], bodies[0]), (faces[1], faces[0])
        else:
            (antagonist, candidate), (face_a, face_c) = bodies, faces
        mesh_c, mesh_a = self.surfaces.face_mesh[face_c], self.surfaces.face_mesh[face_a]
        assert mesh_c is not None
        n = self.placed.normal[face_a] - self.placed.normal[face_c]
        frame = self._frame(n / np.linalg.norm(n), face_a)
        corners = self.placed.vertex[self._corners(face_a)]
        origin, flat = corners[0], frame[1:].T
        outline = (corners - origin) @ flat
        x_c = (self._world(candidate, mesh_c) - origin) @ flat
        x_a = outline if mesh_a is None else (self._world(antagonist, mesh_a) - origin) @ flat
        t_a = np.zeros((0, 3), dtype=np.int64) if mesh_a is None else mesh_a.triangle
        area, own, other, centre = kernel.mortar_integrals(x_c, mesh_c.triangle, x_a, t_a, outline)
        if area.sum() < _THIN * min(self.surfaces.face_area[face_c], self.surfaces.face_area[face_a]):
            return
        for i in np.flatnonzero(area > _SLIVER * area.max()):
            place = origin + flat @ (centre[i] / area[i])
            # the point of a rigid antagonist lies on its face, straight below along n
            slope = frame[0] @ self.placed.normal[face_a]
            place = place + frame[0] * ((origin - place) @ self.placed.normal[face_a] / slope)
            side_a = (
                self._side(antagonist, face_a, place)
                if mesh_a is None
                else _Side(np.zeros(3), mesh_a.node, other[i] / area[i])
            )
            sides = [_Side(np.zeros(3), mesh_c.node, own[i] / area[i]), side_a]
            self._append(
                (candidate, antagonist),
                key + (1 << 23) + int(mesh_c.node[i]),
                frame,
                float(area[i]),
                alert,
                sides,
            )

    def _frame(self, n: Array, face: int) -> Array:
        """Rows n, t1, t2, with t1 along the face's first edge, so that the frame turns with the stones."""
        corners = self.placed.vertex[self._corners(face)]
        edge = corners[1] - corners[0]
        t1 = edge - (edge @ n) * n
        t1 = t1 / np.linalg.norm(t1)
        return np.array([n, t1, np.cross(n, t1)])

    def _corners(self, face: int) -> Ints:
        corners: Ints = self.surfaces.corner[self.surfaces.cptr[face] : self.surfaces.cptr[face + 1]]
        return corners

    def _world(self, body: int, mesh: FaceMesh) -> Array:
        placed: Array = self.placed.centre[body] + mesh.reference @ self.placed.rotation[body].T
        return placed

    def _side(self, body: int, face: int, point: Array) -> "_Side":
        """The material point of a body at a place on one of its faces."""
        arm = self.placed.rotation[body].T @ (point - self.placed.centre[body])
        mesh = self.surfaces.face_mesh[face]
        if mesh is None:
            return _Side(arm, np.zeros(0, dtype=np.int64), np.zeros(0))
        corners = mesh.reference[mesh.triangle]
        a, b, r = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], arm - corners[:, 0]
        aa, bb, ab = (np.einsum("ti,ti->t", x, y) for x, y in ((a, a), (b, b), (a, b)))
        ra, rb = np.einsum("ti,ti->t", r, a), np.einsum("ti,ti->t", r, b)
        det = aa * bb - ab**2
        w1, w2 = (bb * ra - ab * rb) / det, (aa * rb - ab * ra) / det
        inside = np.minimum(np.minimum(w1, w2), 1.0 - w1 - w2)
        t = int(inside.argmax())
        weight = np.clip([1.0 - w1[t] - w2[t], w1[t], w2[t]], 0.0, 1.0)
        return _Side(np.zeros(3), mesh.node[mesh.triangle[t]], weight / weight.sum())

    def contacts(self) -> tuple[Contacts, Array]:
        """Everything gathered, and the alert distance of each contact (nc,) [m]."""
        count = len(self.key)
        pointer = np.concatenate([[0], np.cumsum([len(node) for node, _ in self.rows])]).astype(np.int64)
        node = np.concatenate([node for node, _ in self.rows]) if self.rows else np.zeros(0, dtype=np.int64)
        weight = np.concatenate([weight for _, weight in self.rows]) if self.rows else np.zeros(0)
        weights = csr_array((weight, node, pointer), shape=(2 * count, self.nodes))
        contacts = Contacts(
            np.array(self.bodies, dtype=np.int64).reshape(-1, 2),
            np.array(self.key, dtype=np.int64),
            np.array(self.frame).reshape(-1, 3, 3),
            np.array(self.area),
            np.array(self.arm).reshape(-1, 2, 3),
            weights,
        )
        return contacts, np.array(self.alert)


@dataclass(frozen=True)
class _Side:
    """One side of a contact: a place in body axes, or weighted nodes."""

    arm: Array
    node: Ints
    weight: Array


def _fineness(surfaces: Surfaces, face: int) -> float:
    """Finite-element triangles per area of a face; zero if its body is rigid."""
    mesh = surfaces.face_mesh[face]
    return 0.0 if mesh is None else len(mesh.triangle) / float(surfaces.face_area[face])


def _keep(contacts: Contacts, rows: NDArray[np.bool_]) -> Contacts:
    sides = np.repeat(rows, 2)
    return Contacts(
        contacts.bodies[rows],
        contacts.key[rows],
        contacts.frame[rows],
        contacts.area[rows],
        contacts.arm[rows],
        contacts.weights[sides],
    )
