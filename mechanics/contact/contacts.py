"""Contact points as a structure of arrays, and the material points that they couple."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, vstack

from mechanics.arrays import Array, Ints
from mechanics.contact._kernels.broad_phase import points_of
from mechanics.contact._kernels.narrow_phase import NAME_BITS
from mechanics.scene.state import State

# The high bits of a key name the pair of shapes; the low bits the node that carries the contact, or a single point
# within the pair.
NODE = 1 << NAME_BITS
PAIR_BIT = NAME_BITS + 1


@dataclass(frozen=True)
class Contacts:
    """Contact points; side 0 is the candidate, side 1 the antagonist.

    A side is a material point of its body: for a rigid body a fixed place in its axes (`arm`), for a deformable
    one a weighted mean of nodes (`weights`). Where a deformable face meets a parallel face, the weights are those
    of the mortar method: contact α stands for a linear test function ψ_α of one corner node of the candidate's facets,
    both sides are means over the overlap weighted by ψ_α, and a uniform pressure is transmitted exactly (Puso &
    Laursen 2004; for quadratic elements Puso, Laursen & Solberg 2008; dual functions: Wohlmuth 2000).

    Attributes
    ----------
    bodies : (nc, 2) candidate and antagonist
    key : (nc,) identifies the contact from step to step
    frame : (nc, 3, 3) rows n, t1, t2; n points from antagonist to candidate
    area : (nc,) tributary area; the areas of an interface add up to its own; zero between edges [m²]
    arm : (nc, 2, 3) place of a rigid body's material point, body axes [m]
    weights : (2 nc, nn) of the nodes of deformable bodies; row 2α + side, empty for rigid sides
    """

    bodies: Ints
    key: Ints
    frame: Array
    area: Array
    arm: Array
    weights: "csr_array[np.float64]"

    def __len__(self) -> int:
        return len(self.key)


def take(contacts: Contacts, rows: Ints) -> Contacts:
    """Return the selected contacts, in the order of `rows` (n,)."""
    weights = contacts.weights
    if weights.nnz:
        weights = weights[(2 * rows[:, None] + np.arange(2)).ravel()]
    elif len(rows) != len(contacts):
        weights = csr_array((2 * len(rows), weights.shape[1]))
    return Contacts(
        contacts.bodies[rows],
        contacts.key[rows],
        contacts.frame[rows],
        contacts.area[rows],
        contacts.arm[rows],
        weights,
    )


def joined(parts: Sequence[Contacts]) -> Contacts:
    """Concatenate the contacts of all parts."""
    return Contacts(
        np.concatenate([contacts.bodies for contacts in parts]),
        np.concatenate([contacts.key for contacts in parts]),
        np.concatenate([contacts.frame for contacts in parts]),
        np.concatenate([contacts.area for contacts in parts]),
        np.concatenate([contacts.arm for contacts in parts]),
        csr_array(vstack([contacts.weights for contacts in parts], format="csr")),
    )


def material_points(contacts: Contacts, state: State) -> Array:
    """Return the places of the two material points of each contact (nc, 2, 3) [m]."""
    points: Array = points_of(contacts.bodies, contacts.arm, state.centre, state.rotation)
    if contacts.weights.nnz:
        elastic = (contacts.weights @ state.node).reshape(-1, 2, 3)
        on_nodes = (np.diff(contacts.weights.indptr) > 0).reshape(-1, 2, 1)
        points = np.where(on_nodes, elastic, points)
    return points


def gaps(contacts: Contacts, state: State) -> Array:
    """Compute the gap g = n·(x_candidate - x_antagonist) of each contact (nc,), negative when overlapping [m]."""
    points = material_points(contacts, state)
    gap: Array = np.einsum("ci,ci->c", contacts.frame[:, 0], points[:, 0] - points[:, 1])
    return gap
