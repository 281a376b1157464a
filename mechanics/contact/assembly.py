"""From contact points to the Delassus operator: the Jacobians of rigid sides, the compliance between elastic ones."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, kron

from mechanics.bodies.deformable import DynamicCompliance
from mechanics.bodies.rigid import inverse_inertia_world
from mechanics.contact.contacts import Contacts
from mechanics.model import Model
from mechanics.problem import ELASTIC, NONE, RIGID, Delassus
from mechanics.state import State

__all__ = ["ElasticSides", "delassus", "elastic_sides", "local_velocity", "world_impulse"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class ElasticSides:
    """The part of W that lives on deformable bodies; it changes only when the contacts do.

    Attributes
    ----------
    kind, slot, yptr, bptr, block : as in mechanics.problem.Delassus
    diagonal : (nc, 2, 3, 3) share of each elastic side in W_αα [1/kg]
    """

    kind: Ints
    slot: Ints
    yptr: Ints
    bptr: Ints
    block: Array
    diagonal: Array


def elastic_sides(
    model: Model, state: State, contacts: Contacts, compliance: Mapping[int, DynamicCompliance]
) -> ElasticSides:
    """Condense the compliance of each deformable body on its contact sides."""
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
    return ElasticSides(kind, slot, yptr, bptr, block, diagonal.reshape(-1, 2, 3, 3))


def delassus(model: Model, state: State, contacts: Contacts, elastic: ElasticSides) -> Delassus:
    """W of the contacts at the configuration of `state`."""
    jacobian, response = _rigid_sides(model, state, contacts)
    diagonal = (elastic.diagonal + jacobian @ response).sum(axis=1)
    return Delassus(
        contacts.bodies,
        elastic.kind,
        jacobian,
        response,
        elastic.slot,
        elastic.yptr,
        elastic.bptr,
        elastic.block,
        diagonal,
    )


def _rigid_sides(model: Model, state: State, contacts: Contacts) -> tuple[Array, Array]:
    """Jacobians (nc, 2, 3, 6) and responses (nc, 2, 6, 3) of the rigid sides; other sides answer nothing."""
    body = contacts.bodies
    arm = np.einsum("csij,csj->csi", state.rotation[body], contacts.arm)
    frame = np.broadcast_to(contacts.frame[:, None], (len(contacts), 2, 3, 3))
    # row · (ω × arm) = (arm × row) · ω
    jacobian = np.concatenate([frame, np.cross(arm[:, :, None, :], frame)], axis=-1)
    spin = inverse_inertia_world(model.inertia, state.rotation)[body] @ jacobian[..., 3:].transpose(0, 1, 3, 2)
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


def local_velocity(contacts: Contacts, state: State, velocity: Array, node_velocity: Array) -> Array:
    """Relative velocity u = Hᵀ v (nc, 3) of the contacts, local frame [m/s]."""
    body = contacts.bodies
    arm = np.einsum("csij,csj->csi", state.rotation[body], contacts.arm)
    rigid = velocity[body][..., :3] + np.cross(velocity[body][..., 3:], arm)
    elastic = (contacts.weights @ node_velocity).reshape(-1, 2, 3)
    on_nodes = (np.diff(contacts.weights.indptr) > 0).reshape(-1, 2, 1)
    sides = np.where(on_nodes, elastic, rigid)
    relative: Array = np.einsum("cij,cj->ci", contacts.frame, sides[:, 0] - sides[:, 1])
    return relative


def world_impulse(contacts: Contacts, impulse: Array) -> Array:
    """Impulses (nc, 3) on the candidates, world axes [N s]."""
    world: Array = np.einsum("cij,ci->cj", contacts.frame, impulse)
    return world
