"""One time step of the Moreau–Jean θ-scheme, in the order of docs/theory.md §2."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechanics.bodies.deformable import DynamicCompliance, body_frame, dynamic_compliance
from mechanics.bodies.rigid import rigid_free_velocity, rotation_exp
from mechanics.contact.assembly import local_velocity, world_impulse
from mechanics.contact.contacts import Contacts, gaps
from mechanics.model import Model
from mechanics.problem import ContactProblem, Delassus, SparseForm
from mechanics.state import State

__all__ = [
    "FreeMotion",
    "advance",
    "compliances",
    "contact_problem",
    "follow_nodes",
    "free_motion",
    "predict",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FreeMotion:
    """Velocities at the end of the step without contact impulses.

    Attributes
    ----------
    velocity : (nb, 6) of the rigid bodies
    node_velocity : (nn, 3) of the deformable ones [m/s]
    """

    velocity: Array
    node_velocity: Array


def compliances(model: Model, step: float, theta: float) -> dict[int, DynamicCompliance]:
    """ŵ of every deformable body, for this step and θ."""
    return {b: dynamic_compliance(s, step, theta) for b, s in enumerate(model.stones) if s is not None}


def predict(state: State, duration: float) -> State:
    """Move every body by its present velocity for `duration` [s]; frames of deformable bodies stay."""
    return replace(
        state,
        time=state.time + duration,
        centre=state.centre + duration * state.velocity[:, :3],
        rotation=rotation_exp(duration * state.velocity[:, 3:]) @ state.rotation,
        node=state.node + duration * state.node_velocity,
    )


def follow_nodes(model: Model, state: State) -> State:
    """Let the frames of the deformable bodies follow their nodes."""
    centre, rotation = state.centre.copy(), state.rotation.copy()
    for b, stone in enumerate(model.stones):
        if stone is not None:
            centre[b], rotation[b] = body_frame(stone, state.node[model.nodes_of(b)])
    return replace(state, centre=centre, rotation=rotation)


def free_motion(
    model: Model, state: State, compliance: dict[int, DynamicCompliance], step: float, theta: float
) -> FreeMotion:
    """v_free = v + ŵ [ -h K (d + hθ v) + h P ] with P the weight; rigid: ŵ = M⁻¹, K = 0, gyroscopic moment."""
    velocity = rigid_free_velocity(model.inertia, state.rotation, state.velocity, model.gravity, step)
    node_velocity = state.node_velocity.copy()
    for b, own in compliance.items():
        stone = model.stones[b]
        assert stone is not None
        rows, turn = model.nodes_of(b), state.rotation[b]
        local = state.node_velocity[rows] @ turn
        stretched = stone.displacement(state.node[rows], state.centre[b], turn) + step * theta * local
        force = np.outer(stone.operators.nodal_mass, model.gravity @ turn)
        force -= (stone.operators.stiffness @ stretched.ravel()).reshape(-1, 3)
        node_velocity[rows] += own.respond(step * force) @ turn.T
    return FreeMotion(velocity, node_velocity)


def contact_problem(
    model: Model,
    configuration: State,
    contacts: Contacts,
    operator: Delassus,
    sparse: SparseForm | None,
    free: FreeMotion,
    step: float,
    theta: float,
) -> ContactProblem:
    """Signorini with gap and Coulomb friction, as a shift of u_N and a cone.

    Detected at q + h(1-θ)v, the gap at the end of the step is g + hθ u_N; so the shift g/(hθ) lets a closing
    contact land exactly. An overlap is not pushed out (max(g, 0)), which would create energy; only relaxation, which
    asks for the place of rest and not for the motion, pushes it out, so that no early error stays as self-stress.
    """
    u_free = local_velocity(contacts, operator, free.velocity, free.node_velocity)
    gap = gaps(contacts, configuration)
    bias = (gap if model.scene.time.relaxation else np.maximum(gap, 0.0)) / (step * theta)
    friction = np.full(len(contacts), model.scene.contact.law.friction)
    return ContactProblem(operator, u_free, bias, friction, sparse)


def advance(
    model: Model,
    state: State,
    contacts: Contacts,
    operator: Delassus,
    impulse: Array,
    free: FreeMotion,
    compliance: dict[int, DynamicCompliance],
    step: float,
    theta: float,
) -> State:
    """v_{i+1} = v_free + ŵ H r, q_{i+1} = q_i + h [θ v_{i+1} + (1-θ) v_i]; rotations by the exponential map."""
    velocity = free.velocity.copy()
    answer = np.einsum("csij,cj->csi", operator.response, impulse)
    np.add.at(velocity, contacts.bodies[:, 0], answer[:, 0])
    np.subtract.at(velocity, contacts.bodies[:, 1], answer[:, 1])
    node_velocity = free.node_velocity.copy()
    world = world_impulse(contacts, impulse)
    nodal = contacts.weights.T @ np.stack([world, -world], axis=1).reshape(-1, 3)
    for b, own in compliance.items():
        rows, turn = model.nodes_of(b), state.rotation[b]
        if nodal[rows].any():
            node_velocity[rows] += own.respond(nodal[rows] @ turn) @ turn.T
    mean = theta * velocity + (1 - theta) * state.velocity
    return State(
        state.time + step,
        state.centre + step * mean[:, :3],
        rotation_exp(step * mean[:, 3:]) @ state.rotation,
        velocity,
        state.node + step * (theta * node_velocity + (1 - theta) * state.node_velocity),
        node_velocity,
    )
