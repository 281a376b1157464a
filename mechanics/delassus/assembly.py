"""Assembly of Delassus operators: Jacobians of rigid sides, compliance between elastic ones."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, material_points
from mechanics.delassus._kernels.mixed import ELASTIC, NONE, RIGID
from mechanics.delassus.mixed import MixedDelassus
from mechanics.delassus.rigid import RigidDelassus, Schedule
from mechanics.model.deformable import Compliance
from mechanics.model.model import Model
from mechanics.model.rigid import RigidInertia, inverse_inertia_world
from mechanics.scene.state import State


def rigid_delassus(model: Model, state: State, contacts: Contacts, schedule: Schedule) -> RigidDelassus:
    """Return W of contacts between rigid bodies, already in the order of the schedule.

    Both bodies meet in one common point, half-way between their material points, so that equal and opposite
    impulses leave the angular momentum of the scene as it is, whatever the gap.
    """
    points = material_points(contacts, state)
    point = 0.5 * (points[:, 0] + points[:, 1])
    arm = point[:, None] - state.centre[contacts.bodies]
    return _rigid_delassus(model, model.inertia, state, contacts, arm, schedule)


def _rigid_delassus(
    model: Model, inertia: RigidInertia, state: State, contacts: Contacts, arm: Array, schedule: Schedule
) -> RigidDelassus:
    turned = inverse_inertia_world(inertia, state.rotation).reshape(-1, 9)
    return RigidDelassus(
        contacts.bodies,
        np.hstack([contacts.frame.reshape(-1, 9), arm.reshape(-1, 6)]),
        np.hstack([inertia.inverse_mass[:, None], turned[:, [0, 1, 2, 4, 5, 8]]]),
        schedule,
        model.scene.solver.threads,
        state.centre,
    )


def side_kinds(model: Model, bodies: Ints) -> Ints:
    """Return NONE (fixed), RIGID or ELASTIC (nc, 2) of the sides of contacts between `bodies` (nc, 2)."""
    kind = np.where(model.fixed[bodies], NONE, np.where(model.elastic[bodies], ELASTIC, RIGID))
    return kind.astype(np.int64)


def mixed_delassus(
    model: Model,
    state: State,
    contacts: Contacts,
    compliance: Sequence[Compliance],
    schedule: Schedule,
    elastic_scale: bool = False,
) -> MixedDelassus:
    """Return W of contacts, already in the order of the schedule; condense each deformable body on its contact sides.

    With `elastic_scale`, r and u are measured against the elastic part of W alone. In steps so long that only
    friction resists, W is dominated by rigid motion, and forces within joints would not count.
    """
    body = contacts.bodies
    kind = side_kinds(model, body)
    count, slot, sides = _slots(body, kind, len(model.mass))
    yptr = np.concatenate([[0], np.cumsum(3 * count)]).astype(np.int64)
    bptr = np.concatenate([[0], np.cumsum((3 * count) ** 2)]).astype(np.int64)
    block, diagonal = np.zeros(int(bptr[-1])), np.zeros((2 * len(contacts), 3, 3))
    first = np.concatenate([[0], np.cumsum(count)])
    # all at once: slicing the rows of a stone costs SciPy more than its block does
    weights = contacts.weights[sides]
    drag = np.ones(len(model.mass))
    for group, elastic in zip(model.elastic_stones.groups, compliance, strict=True):
        drag[group.bodies] = elastic.drag
        for b in group.bodies[count[group.bodies] > 0]:
            rows, pointer = sides[first[b] : first[b + 1]], weights.indptr[first[b] : first[b + 1] + 1]
            entries = slice(pointer[0], pointer[-1])
            touched = _Touched(weights.indices[entries], weights.data[entries], np.diff(pointer))
            turn = contacts.frame[rows // 2] @ state.rotation[b]
            square = _compliance_block(touched, turn, elastic, int(model.elastic_stones.start[b]))
            block[bptr[b] : bptr[b + 1]] = square.ravel()
            n = np.arange(len(rows))
            diagonal[rows] = square.reshape(len(rows), 3, len(rows), 3)[n, :, n]
    point = (contacts.weights @ state.node).reshape(-1, 2, 3)
    arm = np.einsum("csij,csj->csi", state.rotation[body], contacts.arm)
    arm = np.where((kind == ELASTIC)[..., None], point - state.centre[body], arm)
    jacobian, response = _rigid_sides(model.inertia, state, contacts, arm)
    total = (diagonal.reshape(-1, 2, 3, 3) + jacobian @ response).sum(axis=1)
    awake = _awake(model, drag)
    as_rigid = _rigid_delassus(model, awake, state, contacts, arm, schedule)
    own_part = total - _rigid_share(awake, state, contacts, kind, arm) if elastic_scale else total
    scale = float(np.einsum("cii->", own_part) / max(3 * len(contacts), 1))
    threads = model.scene.solver.threads
    mass = _masses(model.inertia, state)
    return MixedDelassus(
        body,
        kind,
        jacobian,
        response,
        slot,
        yptr,
        bptr,
        block,
        mass,
        state.centre,
        total,
        scale,
        as_rigid,
        threads,
    )


def _awake(model: Model, drag: Array) -> RigidInertia:
    """Return the inertia of all bodies that move, as if rigid; `drag` (nb,) as in `Compliance` [-]."""
    flight, share = model.flight, np.where(model.fixed, 0.0, 1.0 / drag)
    return replace(
        flight,
        inverse_mass=share * flight.inverse_mass,
        inverse_inertia=share[:, None, None] * flight.inverse_inertia,
    )


def _masses(inertia: RigidInertia, state: State) -> Array:
    """Return masses and inertias (nb, 6, 6) of the rigid bodies that move, world axes; zero for others."""
    mass = np.zeros((len(inertia.mass), 6, 6))
    mass[:, [0, 1, 2], [0, 1, 2]] = inertia.mass[:, None]
    mass[:, 3:, 3:] = state.rotation @ inertia.inertia @ state.rotation.transpose(0, 2, 1)
    mass[~inertia.moving] = 0.0
    return mass


def _rigid_share(inertia: RigidInertia, state: State, contacts: Contacts, kind: Ints, arm: Array) -> Array:
    """Return the rigid-body part of W_αα (nc, 3, 3) of elastic sides."""
    jacobian, response = _rigid_sides(inertia, state, contacts, arm)
    share: Array = np.where((kind == ELASTIC)[..., None, None], jacobian @ response, 0.0).sum(axis=1)
    return share


def _rigid_sides(inertia: RigidInertia, state: State, contacts: Contacts, arm: Array) -> tuple[Array, Array]:
    """Return Jacobians (nc, 2, 3, 6) and responses (nc, 2, 6, 3) of rigid sides; zero responses without inverse mass.

    `arm` (nc, 2, 3) from the centres of mass, world axes [m].
    """
    body = contacts.bodies
    frame = np.broadcast_to(contacts.frame[:, None], (len(contacts), 2, 3, 3))
    # row · (ω × arm) = (arm × row) · ω
    jacobian = np.concatenate([frame, np.cross(arm[:, :, None, :], frame)], axis=-1)
    spin = inverse_inertia_world(inertia, state.rotation)[body] @ jacobian[..., 3:].transpose(0, 1, 3, 2)
    push = inertia.inverse_mass[body][..., None, None] * jacobian[..., :3].transpose(0, 1, 3, 2)
    return np.ascontiguousarray(jacobian), np.ascontiguousarray(np.concatenate([push, spin], axis=2))


def _slots(body: Ints, kind: Ints, bodies: int) -> tuple[Ints, Ints, Ints]:
    """Return the number of elastic sides of each body, the index of each side among them, and the sides by body."""
    flat_body, elastic = body.ravel(), kind.ravel() == ELASTIC
    count = np.bincount(flat_body[elastic], minlength=bodies)
    order = np.flatnonzero(elastic)[np.argsort(flat_body[elastic], kind="stable")]
    slot = np.zeros(len(flat_body), dtype=np.int64)
    starts = np.concatenate([[0], np.cumsum(count)])[:-1]
    slot[order] = np.arange(len(order)) - np.repeat(starts, count)
    return count.astype(np.int64), slot.reshape(body.shape), order


class _Touched(NamedTuple):
    """Nodes that carry the contact sides of a body, side by side.

    Attributes
    ----------
    node, weight : of each entry
    number : entries of each side
    """

    node: Ints
    weight: Array
    number: Ints


def _compliance_block(touched: _Touched, turn: Array, compliance: Compliance, first: int) -> Array:
    """Return T C Tᵀ of one body: C between the nodes of its contact sides, T their weights in local frames.

    `turn` (s, 3, 3) has the frames in body axes; node `first` is node 0 of the compliance.
    """
    nodes, column = np.unique(touched.node, return_inverse=True)
    # stones have few other nodes: dense products are faster than sparse ones
    weight = np.zeros((len(turn), len(nodes)))
    weight[np.repeat(np.arange(len(turn)), touched.number), column] = touched.weight
    half = _condensed(weight, turn, compliance.between(nodes - first))
    block = _condensed(weight, turn, np.ascontiguousarray(half.T))
    symmetric: Array = 0.5 * (block + block.T)
    return symmetric


def _condensed(weights: Array, turn: Array, values: Array) -> Array:
    """Return T X (3s, m): X (3k, m) of k nodes, `weights` (s, k) and frames `turn` (s, 3, 3) of s sides."""
    sides, nodes = weights.shape
    spread = (weights @ values.reshape(nodes, -1)).reshape(sides, 3, -1)
    result: Array = (turn @ spread).reshape(3 * sides, -1)
    return result


def local_velocity(
    contacts: Contacts, operator: RigidDelassus | MixedDelassus, velocity: Array, node_velocity: Array
) -> Array:
    """Return the relative velocity u = Hᵀ v (nc, 3) of the contacts, local frame [m/s]."""
    if isinstance(operator, RigidDelassus):
        return operator.relative_velocity(velocity)
    rigid = np.einsum("csij,csj->csi", operator.jacobian, velocity[contacts.bodies])
    elastic = np.einsum("cij,csj->csi", contacts.frame, (contacts.weights @ node_velocity).reshape(-1, 2, 3))
    sides = np.where((operator.kind == ELASTIC)[..., None], elastic, rigid)
    relative: Array = sides[:, 0] - sides[:, 1]
    return relative


def world_impulse(contacts: Contacts, impulse: Array) -> Array:
    """Return impulses (nc, 3) on the candidates, world axes [N s]."""
    world: Array = np.einsum("cij,ci->cj", contacts.frame, impulse)
    return world
