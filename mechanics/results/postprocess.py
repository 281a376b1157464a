"""Postprocessing of states and steps: positions, stresses, contact forces, joints."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from mechanics.arrays import Array
from mechanics.carried import Carried, Carrier
from mechanics.contact.contacts import Contacts, material_points
from mechanics.dynamics.step import Step
from mechanics.model.deformable import Deformable
from mechanics.model.model import Model
from mechanics.results._kernels import Faces
from mechanics.results.contact_result import ContactResult, JointResult
from mechanics.results.interfaces import Interfaces, find_interfaces, placed_faces
from mechanics.results.joints import StartingJoints, joint_results, parting, starting_joints
from mechanics.results.result import BodyResult, Frame
from mechanics.results.stress_values import stress_values
from mechanics.scene.laws.status import contact_status
from mechanics.scene.state import State
from mechanics.stones.elasticity.operators import node_volumes
from mechanics.stones.elasticity.stress import stress_error
from mechanics.stones.elasticity.tensors import from_voigt, principal, to_voigt, von_mises
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh

# polygons that divide a facet, with all its nodes as corners, counter-clockwise seen from outside
_FACET_PARTS: Mapping[Element, tuple[tuple[int, ...], ...]] = {
    Element.TET4: ((0, 1, 2),),
    Element.TET10: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    Element.HEX8: ((0, 1, 2, 3),),
    Element.HEX20: ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6, 7)),
    Element.HEX27: ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)),
}


_NO_CELLS = np.zeros((0, 4), dtype=np.int64)  # of all rigid stones together


def surface_polygons(mesh: SolidMesh) -> tuple[tuple[int, ...], ...]:
    """Return outward polygons that cover the boundary, with a corner at each of its nodes."""
    parts = [mesh.facets[:, part] for part in _FACET_PARTS[mesh.element]]
    return tuple(tuple(polygon) for part in parts for polygon in part.tolist())


def positions(model: Model, state: State) -> tuple[Array, ...]:
    """Return the points of each body: corners of rigid ones, nodes of deformable ones [m]."""
    corner = np.repeat(state.centre, np.diff(model.outline.first), axis=0) + _arms(model, state)
    return _by_body(model, corner, state.node)


def velocities(model: Model, state: State) -> tuple[Array, ...]:
    """Return the velocities of the same points [m/s]."""
    corner_velocity = np.repeat(state.velocity, np.diff(model.outline.first), axis=0)
    return _by_body(
        model,
        corner_velocity[:, :3] + np.cross(corner_velocity[:, 3:], _arms(model, state)),
        state.node_velocity,
    )


def _arms(model: Model, state: State) -> Array:
    """Return the corners (n, 3) of all bodies from their centres of mass, world axes [m]."""
    turn = np.repeat(state.rotation, np.diff(model.outline.first), axis=0)
    arms: Array = np.einsum("vij,vj->vi", turn, model.outline.corner)
    return arms


def _by_body(model: Model, corner: Array, node: Array) -> tuple[Array, ...]:
    """Return the rows of each body: of its corners, or of its nodes if it is deformable."""
    by_body = [corner[a:b] for a, b in pairwise(model.outline.first.tolist())]
    for b in np.flatnonzero(model.elastic).tolist():
        by_body[b] = node[model.nodes_of(b)]
    return tuple(by_body)


class Observer(Carrier):
    """Observer of a run: frames during it; bodies, contacts and joints at its end.

    Parameters
    ----------
    model, start : the scene, and its stones before they carry load, from where displacements count
    """

    CARRIED = ("_touching",)
    REBUILT = ("_joints", "_model", "_start")

    def __init__(self, model: Model, start: State) -> None:
        self._model, self._start = model, start
        self._touching: Contacts | None = None
        self._joints: StartingJoints | None = None

    def first_frame(self, state: State) -> Frame:
        """Return the frame of the start, before the first contact forces are known."""
        return self._frame(state, _no_contacts(), np.zeros_like(state.node))

    def begin(self, step: Step) -> StartingJoints:
        """Take the contacts of the first step as the joints of the start, and return these."""
        return self._begin(step.contacts)

    def restore(self, carried: Carried) -> None:
        """Take over the contacts of the first step."""
        super().restore(carried)
        if self._touching is not None:
            self._begin(self._touching)

    @property
    def joints(self) -> StartingJoints | None:
        """The joints of the start; None before the first step."""
        return self._joints

    def _begin(self, contacts: Contacts) -> StartingJoints:
        self._touching, self._joints = contacts, starting_joints(self._model, self._start, contacts)
        return self._joints

    def frame(self, step: Step) -> Frame:
        """Return the frame of the end of a step."""
        _, interfaces = self._interfaces(step)
        return self._frame(step.after, self._contacts(step, interfaces), _on_nodes(step))

    def contacts_and_joints(self, step: Step) -> tuple[ContactResult, JointResult]:
        """Return the contact points of a step with their mean forces, and their sums over each joint."""
        faces, interfaces = self._interfaces(step)
        contacts = self._contacts(step, interfaces)
        assert self._joints is not None
        return contacts, joint_results(self._model, self._joints, faces, interfaces.face, step, contacts)

    def bodies(self, frame: Frame, balance: Array) -> tuple[BodyResult, ...]:
        """Return the result of each body at the time of a frame; `balance` (nb,) as `imbalance` gives it."""
        before = positions(self._model, self._start)
        return tuple(self._body(b, before[b], frame, float(balance[b])) for b in range(len(before)))

    def _frame(self, state: State, contacts: ContactResult, on_nodes: Array) -> Frame:
        seen: list[tuple[Array | None, float | None]] = [(None, None)] * len(self._model.mass)
        for b in np.flatnonzero(self._model.elastic).tolist():
            stone = self._model.stones[b]
            if stone is not None and self._model.scene.blocks[b].stress:
                seen[b] = self._stress(b, stone, state)
        return Frame(
            time=state.time,
            positions=positions(self._model, state),
            velocities=velocities(self._model, state),
            stresses=tuple(stress for stress, _ in seen),
            stress_errors=tuple(error for _, error in seen),
            contacts=contacts,
            nodal_forces=tuple(
                on_nodes[self._model.nodes_of(b)] if elastic else None
                for b, elastic in enumerate(self._model.elastic.tolist())
            ),
        )

    def _interfaces(self, step: Step) -> tuple[Faces, Interfaces]:
        assert self._joints is not None
        faces = placed_faces(self._model, step.after)
        return faces, find_interfaces(faces, step.contacts, step.after, self._joints.face)

    def _contacts(self, step: Step, interfaces: Interfaces) -> ContactResult:
        contacts, normal = step.contacts, step.contacts.frame[:, 0]
        opening, slide = parting(contacts, self._start, step.after)
        pressing = np.einsum("ci,ci->c", step.force, normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            pressure = np.where(contacts.area > 0, pressing / contacts.area, np.nan)
        return ContactResult(
            bodies=contacts.bodies,
            point=material_points(contacts, step.after).mean(axis=1),
            normal=normal,
            force=step.force,
            gap=step.gap,
            area=contacts.area,
            pressure=pressure,
            opening=opening,
            slide=np.linalg.norm(slide, axis=1),
            status=contact_status(step.internal, step.terms, step.shifted),
            joint=interfaces.joint,
        )

    def _stress(self, body: int, stone: Deformable, state: State) -> tuple[Array, float]:
        """Return the recovered stress of the nodes (n, 6), world axes [Pa], and its estimated relative error [-]."""
        node, turn = state.node[self._model.nodes_of(body)], state.rotation[body]
        displacement = stone.displacement(node, state.centre[body], turn)
        local = stone.recovered(displacement)
        error = stress_error(stone.mesh, stone.material, displacement, local)
        return to_voigt(turn @ from_voigt(local) @ turn.T), error

    def _body(self, body: int, before: Array, frame: Frame, balance: float) -> BodyResult:
        block, stone, now = self._model.scene.blocks[body], self._model.stones[body], frame.positions[body]
        rigid = BodyResult(
            code=block.code,
            fidelity=block.fidelity,
            reference=before,
            position=now,
            faces=block.faces,
            element=None,
            cells=_NO_CELLS,
            stress=None,
            von_mises=None,
            principal=None,
            node_volume=None,
            values=None,
            volume=float(self._model.volume[body]),
            mass=float(self._model.mass[body]),
            balance=balance,
        )
        if stone is None:
            return rigid
        mesh, volume = stone.mesh, node_volumes(stone.mesh)
        elastic = replace(
            rigid, faces=surface_polygons(mesh), element=mesh.element, cells=mesh.cells, node_volume=volume
        )
        stress, error = frame.stresses[body], frame.stress_errors[body]
        if stress is None or error is None:
            return elastic
        return replace(
            elastic,
            stress=stress,
            von_mises=von_mises(stress),
            principal=principal(stress)[0],
            values=stress_values(stress, now, volume, stone.material, error),
        )


def _on_nodes(step: Step) -> Array:
    """Return the forces (nn, 3) of all contacts on the nodes of deformable stones [N]."""
    both = np.stack([step.force, -step.force], axis=1).reshape(-1, 3)
    forces: Array = (
        step.contacts.weights.T @ both if step.contacts.weights.nnz else np.zeros_like(step.after.node)
    )
    return forces


def _no_contacts() -> ContactResult:
    none, vectors = np.zeros(0), np.zeros((0, 3))
    return ContactResult(
        bodies=np.zeros((0, 2), dtype=np.int64),
        point=vectors,
        normal=vectors,
        force=vectors,
        gap=none,
        area=none,
        pressure=none,
        opening=none,
        slide=none,
        status=np.zeros(0, dtype=np.str_),
        joint=np.zeros(0, dtype=np.int64),
    )
