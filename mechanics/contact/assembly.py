"""From contact points to the Delassus operator: the Jacobians of rigid sides, the compliance between elastic ones."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csc_array, csr_array, eye_array, hstack, kron

from mechanics.bodies.deformable import DynamicCompliance
from mechanics.bodies.rigid import inverse_inertia_world
from mechanics.contact.contacts import Contacts, material_points
from mechanics.model import Model
from mechanics.operators.mixed import ELASTIC, NONE, RIGID, MixedDelassus
from mechanics.operators.rigid import RigidDelassus, Schedule
from mechanics.problem import SparseForm
from mechanics.state import State

__all__ = ["local_velocity", "mixed_delassus", "rigid_delassus", "sparse_form", "world_impulse"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def rigid_delassus(model: Model, state: State, contacts: Contacts, schedule: Schedule) -> RigidDelassus:
    """W of contacts between rigid bodies, already in the order of the schedule.

    Both bodies meet in one common point, half-way between their material points, so that equal and opposite
    impulses leave the angular momentum of the scene as it is, whatever the gap.
    """
    point = material_points(contacts, state).mean(axis=1)
    arm = point[:, None] - state.centre[contacts.bodies]
    turned = inverse_inertia_world(model.inertia, state.rotation).reshape(-1, 9)
    return RigidDelassus(
        contacts.bodies,
        np.hstack([contacts.frame.reshape(-1, 9), arm.reshape(-1, 6)]),
        np.hstack([model.inertia.inverse_mass[:, None], turned[:, [0, 1, 2, 4, 5, 8]]]),
        schedule,
        model.scene.solver.threads,
    )


def mixed_delassus(
    model: Model, state: State, contacts: Contacts, compliance: Mapping[int, DynamicCompliance]
) -> MixedDelassus:
    """W of the contacts at the configuration of `state`: condense each deformable body on its contact sides."""
    body = contacts.bodies
    kind = np.where(model.fixed[body], NONE, np.where(model.elastic[body], ELASTIC, RIGID)).astype(np.int64)
    count, slot = _slots(body, kind, len(model.mass))
    yptr = np.concatenate([[0], np.cumsum(3 * count)]).astype(np.int64)
    bptr = np.concatenate([[0], np.cumsum((3 * count) ** 2)]).astype(np.int64)
    block, diagonal = np.zeros(int(bptr[-1])), np.zeros((2 * len(contacts), 3, 3))
    for b in np.flatnonzero(count):
        sides = np.flatnonzero((body.ravel() == b) & (kind.ravel() == ELASTIC))
        square = _compliance_block(model, state, contacts, int(b), sides, compliance[int(b)])
        block[bptr[b] : bptr[b + 1]] = square.ravel()
        n = np.arange(len(sides))
        diagonal[sides] = square.reshape(len(sides), 3, len(sides), 3)[n, :, n]
    jacobian, response = _rigid_sides(model, state, contacts)
    total = (diagonal.reshape(-1, 2, 3, 3) + jacobian @ response).sum(axis=1)
    return MixedDelassus(body, kind, jacobian, response, slot, yptr, bptr, block, total)


def _rigid_sides(model: Model, state: State, contacts: Contacts) -> tuple[Array, Array]:
    """Jacobians (nc, 2, 3, 6) and responses (nc, 2, 6, 3) of the rigid sides; other sides answer nothing."""
    body = contacts.bodies
    arm = np.einsum("csij,csj->csi", state.rotation[body], contacts.arm)
    frame = np.broadcast_to(contacts.frame[:, None], (len(contacts), 2, 3, 3))
    # row · (ω × arm) = (arm × row) · ω
    jacobian = np.concatenate([frame, np.cross(arm[:, :, None, :], frame)], axis=-1)
    spin = inverse_inertia_world(model.inertia, state.rotation)[body] @ jacobian[..., 3:].transpose(
        0, 1, 3, 2
    )
    push = model.inertia.inverse_mass[body][..., None, None] * jacobian[..., :3].transpose(0, 1, 3, 2)
    return np.ascontiguousarray(jacobian), np.ascontiguousarray(np.concatenate([push, spin], axis=2))


def _slots(body: Ints, kind: Ints, bodies: int) -> tuple[Ints, Ints]:
    """How many elastic sides each body has, and the place of each side among them."""
    flat_body, elastic = body.ravel(), kind.ravel() == ELASTIC
    count = np.bincount(flat_body[elastic], minlength=bodies)
    order = np.flatnonzero(elastic)[np.argsort(flat_body[elastic], kind="stable")]
    slot = np.zeros(len(flat_body), dtype=np.int64)
    starts = np.concatenate([[0], np.cumsum(count)])[:-1]
    slot[order] = np.arange(len(order)) - np.repeat(starts, count)
    return count.astype(np.int64), slot.reshape(body.shape)


def _compliance_block(
    model: Model, state: State, contacts: Contacts, b: int, sides: Ints, compliance: DynamicCompliance
) -> Array:
    """G B C Bᵀ Gᵀ of one body: C of its surface nodes, B the weights of its contact sides, G to local frames."""
    stone = model.stones[b]
    assert stone is not None
    columns = model.node_ptr[b] + stone.surface
    weights = kron(contacts.weights[sides][:, columns], csr_array(np.eye(3)), format="csr")
    half = weights @ compliance.surface
    size = len(sides)
    middle = (weights @ half.T).reshape(size, 3, size, 3)
    turn = contacts.frame[sides // 2] @ state.rotation[b]
    block = np.einsum("aik,akbl,bjl->aibj", turn, middle, turn, optimize=True).reshape(3 * size, 3 * size)
    symmetric: Array = 0.5 * (block + block.T)
    return symmetric


def sparse_form(
    model: Model,
    state: State,
    contacts: Contacts,
    operator: MixedDelassus,
    compliance: Mapping[int, DynamicCompliance],
) -> SparseForm:
    """The same W in sparse matrices: six velocities for each rigid body, then those of all nodes, world axes."""
    rigid = np.flatnonzero(model.inertia.inverse_mass > 0)
    turn = state.rotation[rigid]
    spin = turn @ model.inertia.inertia[rigid] @ turn.transpose(0, 2, 1)
    blocks: list[object] = [
        block for b, moment in zip(rigid, spin, strict=True) for block in (model.mass[b] * np.eye(3), moment)
    ]
    for b, own in compliance.items():
        axes = kron(eye_array(own.matrix.shape[0] // 3), csr_array(state.rotation[b]), format="csr")
        blocks.append(axes @ own.matrix @ axes.T)
    signed = contacts.weights[0::2] - contacts.weights[1::2]
    # scipy makes no block diagonal of nothing
    frames = block_diag(list(contacts.frame), format="csr") if len(contacts) else csr_array((0, 0))
    lift = hstack([_rigid_lift(rigid, operator), frames @ kron(signed, eye_array(3), format="csr")]).T
    return SparseForm(block_diag(blocks, format="csc"), csc_array(lift))


def _rigid_lift(rigid: Ints, operator: MixedDelassus) -> "csr_array[np.float64]":
    """Hᵀ of the rigid sides, (3 nc, 6 nr)."""
    place = np.full(operator.body.max(initial=0) + 1, -1)
    place[rigid[rigid < len(place)]] = np.flatnonzero(rigid < len(place))
    c, s = np.nonzero(operator.kind == RIGID)
    rows = 3 * c[:, None, None] + np.arange(3)[:, None] + np.zeros(6, dtype=np.int64)
    columns = 6 * place[operator.body[c, s]][:, None, None] + np.zeros((3, 1), dtype=np.int64) + np.arange(6)
    values = operator.jacobian[c, s] * np.where(s == 0, 1.0, -1.0)[:, None, None]
    shape = (3 * len(operator.body), 6 * len(rigid))
    return csr_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape)


def local_velocity(
    contacts: Contacts, operator: RigidDelassus | MixedDelassus, velocity: Array, node_velocity: Array
) -> Array:
    """Relative velocity u = Hᵀ v (nc, 3) of the contacts, local frame [m/s]."""
    if isinstance(operator, RigidDelassus):
        return operator.relative_velocity(velocity)
    rigid = np.einsum("csij,csj->csi", operator.jacobian, velocity[contacts.bodies])
    elastic = np.einsum("cij,csj->csi", contacts.frame, (contacts.weights @ node_velocity).reshape(-1, 2, 3))
    sides = np.where((operator.kind == ELASTIC)[..., None], elastic, rigid)
    relative: Array = sides[:, 0] - sides[:, 1]
    return relative


def world_impulse(contacts: Contacts, impulse: Array) -> Array:
    """Impulses (nc, 3) on the candidates, world axes [N s]."""
    world: Array = np.einsum("cij,ci->cj", contacts.frame, impulse)
    return world
