"""One time step in the order of docs/theory.md §2: flight, kick, flight."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from mechanics.bodies.deformable import DynamicCompliance, body_frame, dynamic_compliance
from mechanics.bodies.rigid import free_flight, inverse_inertia_world
from mechanics.contact.assembly import world_impulse
from mechanics.contact.contacts import Contacts
from mechanics.loads.load import Pose
from mechanics.model import Model
from mechanics.operators.mixed import MixedDelassus
from mechanics.operators.rigid import RigidDelassus
from mechanics.state import State

__all__ = [
    "Kick",
    "advance",
    "compliances",
    "follow_nodes",
    "free_kick",
    "kicked",
    "predict",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Kick:
    """Velocities just after the loads, and maybe the contacts, have acted.

    Attributes
    ----------
    velocity : (nb, 6) of the rigid bodies; of driven ones, the velocity that takes them to the next kick
    node_velocity : (nn, 3) of the deformable ones [m/s]
    load : (nb, 6) forces [N] and moments [N m] that acted on the rigid bodies, weight included
    """

    velocity: Array
    node_velocity: Array
    load: Array


def compliances(model: Model, step: float, theta: float) -> dict[int, DynamicCompliance]:
    """ŵ of every deformable body, for this step and θ."""
    return {b: dynamic_compliance(s, step, theta) for b, s in enumerate(model.stones) if s is not None}


def predict(model: Model, start: State, state: State, duration: float) -> State:
    """Fly for `duration` [s]: no forces act, driven bodies follow their motion, frames of deformable bodies stay.

    `start` is the state in which the run began, to which imposed motions refer.
    """
    time = state.time + duration
    centre, rotation, velocity = free_flight(
        model.inertia, state.centre, state.rotation, state.velocity, duration
    )
    for motion, bodies in model.motions:
        pose = motion.pose(time)
        centre[bodies], rotation[bodies] = _driven(pose, start, bodies)
    return State(
        time, centre, rotation, velocity, state.node + duration * state.node_velocity, state.node_velocity
    )


def _driven(pose: Pose, start: State, bodies: Ints) -> tuple[Array, Array]:
    centre = pose.pivot + (start.centre[bodies] - pose.pivot) @ pose.rotation.T + pose.displacement
    return centre, pose.rotation @ start.rotation[bodies]


def follow_nodes(model: Model, state: State) -> State:
    """Let the frames of the deformable bodies follow their nodes."""
    centre, rotation = state.centre.copy(), state.rotation.copy()
    for b, stone in enumerate(model.stones):
        if stone is not None:
            centre[b], rotation[b] = body_frame(stone, state.node[model.nodes_of(b)])
    return replace(state, centre=centre, rotation=rotation)


def free_kick(
    model: Model,
    start: State,
    before: State,
    predicted: State,
    compliance: dict[int, DynamicCompliance],
    step: float,
    theta: float,
) -> Kick:
    """v_free = v + ŵ [ -h K (d + hθ v) + h P ] with P the weight and the loads; rigid: ŵ = M⁻¹, K = 0.

    Loads are taken at the instant of the kick. `before` is the state at the start of the step, in the frames of the
    step; `predicted` that at the kick.
    """
    gravity = model.gravity(predicted.time)
    load = _loads(model, predicted, gravity)
    velocity = predicted.velocity.copy()
    moving = model.inertia.moving
    velocity[moving, :3] += step * load[moving, :3] * model.inertia.inverse_mass[moving, None]
    if load[:, 3:].any():
        answer = inverse_inertia_world(model.inertia, predicted.rotation) @ load[:, 3:, None]
        velocity[:, 3:] += step * answer[..., 0]
    for motion, bodies in model.motions:
        # with one velocity from kick to kick, as free bodies have
        end, turn = _driven(motion.pose(predicted.time + step), start, bodies)
        velocity[bodies, :3] = (end - predicted.centre[bodies]) / step
        vector = Rotation.from_matrix(turn @ predicted.rotation[bodies].transpose(0, 2, 1)).as_rotvec()
        velocity[bodies, 3:] = vector / step
    node_velocity = before.node_velocity.copy()
    for b, own in compliance.items():
        stone = model.stones[b]
        assert stone is not None
        rows, turned = model.nodes_of(b), before.rotation[b]
        local = before.node_velocity[rows] @ turned
        stretched = stone.displacement(before.node[rows], before.centre[b], turned) + step * theta * local
        force = np.outer(stone.operators.nodal_mass, gravity @ turned)
        force -= (stone.operators.stiffness @ stretched.ravel()).reshape(-1, 3)
        node_velocity[rows] += own.respond(step * force) @ turned.T
    return Kick(velocity, node_velocity, load)


def _loads(model: Model, state: State, gravity: Array) -> Array:
    """Forces and moments (nb, 6) on the rigid bodies, weight included."""
    load = np.zeros((len(model.mass), 6))
    moving = model.inertia.moving
    load[moving, :3] = model.mass[moving, None] * gravity
    for force, bodies in model.forces:
        push, moment = force(state.time, state.centre[bodies], state.rotation[bodies])
        load[bodies, :3] += push
        load[bodies, 3:] += moment
    return load


def kicked(
    model: Model,
    free: Kick,
    frames: State,
    contacts: Contacts,
    operator: RigidDelassus | MixedDelassus,
    impulse: Array,
    compliance: dict[int, DynamicCompliance],
) -> Kick:
    """v_{i+1} = v_free + ŵ H r."""
    velocity = free.velocity + operator.rigid_change(impulse)
    node_velocity = free.node_velocity.copy()
    if compliance:
        world = world_impulse(contacts, impulse)
        nodal = contacts.weights.T @ np.stack([world, -world], axis=1).reshape(-1, 3)
        for b, own in compliance.items():
            rows, turn = model.nodes_of(b), frames.rotation[b]
            if nodal[rows].any():
                node_velocity[rows] += own.respond(nodal[rows] @ turn) @ turn.T
    return Kick(velocity, node_velocity, free.load)


def advance(model: Model, start: State, predicted: State, kick: Kick, duration: float) -> State:
    """q_{i+1} = q_i + h [θ v_{i+1} + (1-θ) v_i]: fly from the kick to the end of the step, for hθ = `duration`."""
    state = replace(predicted, velocity=kick.velocity, node_velocity=kick.node_velocity)
    return predict(model, start, state, duration)
