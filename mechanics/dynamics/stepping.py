"""One time step in the order of docs/theory.md §2: flight, kick, flight."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from mechanics.arrays import Array, Ints
from mechanics.delassus.assembly import world_impulse
from mechanics.dynamics.contact_search import Detection
from mechanics.model._kernels import Frames, deform, rigid_part
from mechanics.model.deformable import Compliance
from mechanics.model.model import Model
from mechanics.model.rigid import free_flight, inverse_inertia_world
from mechanics.model.stone_groups import ElasticGroup
from mechanics.scene.loads.load import Pose
from mechanics.scene.state import State


@dataclass(frozen=True)
class Kick:
    """Velocities just after the loads, and possibly the contacts, have acted.

    Attributes
    ----------
    velocity : (nb, 6) of the rigid bodies; of driven ones, the velocity that takes them to the next kick
    node_velocity : (nn, 3) of the deformable ones [m/s]
    load : (nb, 6) forces [N] and moments [N m] that acted on the rigid bodies, weight included
    """

    velocity: Array
    node_velocity: Array
    load: Array


def compliances(model: Model, step: float, theta: float) -> tuple[Compliance, ...]:
    """Return ŵ of every group of equal elastic stones, for this step and θ."""
    return tuple(Compliance(group.stone, step, theta) for group in model.elastic_stones.groups)


def predict(model: Model, start: State, state: State, duration: float) -> State:
    """Return the state after a flight of `duration` [s]: no forces act, and driven bodies follow their motion.

    An elastic stone flies as a rigid one, and in its axes its deformation grows at a constant rate. `start` is the
    state in which the run began, to which imposed motions refer.
    """
    time, elastic = state.time + duration, model.elastic_stones
    velocity, rate = state.velocity, np.zeros((0, 3))
    if elastic.groups:
        motion, rate = rigid_part(
            elastic.start, elastic.reference, elastic.projector, state.rotation, state.node_velocity
        )
        velocity = np.where(model.elastic[:, None], motion, velocity)
    centre, rotation, velocity = free_flight(model.flight, state.centre, state.rotation, velocity, duration)
    for motion_, bodies in model.motions:
        pose = motion_.pose(time)
        centre[bodies], rotation[bodies] = _driven(pose, start, bodies)
    node, node_velocity = state.node, state.node_velocity
    if elastic.groups:
        node, node_velocity = deform(
            elastic.start, elastic.reference, Frames(state.centre, state.rotation), Frames(centre, rotation), velocity,
            state.node, rate, duration,
        )  # fmt: skip
        velocity = np.where(model.elastic[:, None], 0.0, velocity)
    return State(time, centre, rotation, velocity, node, node_velocity)


def _driven(pose: Pose, start: State, bodies: Ints) -> tuple[Array, Array]:
    centre = pose.pivot + (start.centre[bodies] - pose.pivot) @ pose.rotation.T + pose.displacement
    return centre, pose.rotation @ start.rotation[bodies]


def free_kick(
    model: Model, start: State, predicted: State, compliance: Sequence[Compliance], step: float, theta: float
) -> Kick:
    """Return v_free = v + ŵ [ -h V v - h K (d + hθ v) + h P ], P the weight and the loads; rigid: ŵ = M⁻¹, K = V = 0.

    Loads are taken at the instant of the kick; `predicted` is the state there, d that at the start of the step.
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
        # one velocity from kick to kick, like free bodies
        end, turn = _driven(motion.pose(predicted.time + step), start, bodies)
        velocity[bodies, :3] = (end - predicted.centre[bodies]) / step
        vector = Rotation.from_matrix(turn @ predicted.rotation[bodies].transpose(0, 2, 1)).as_rotvec()
        velocity[bodies, 3:] = vector / step
    node_velocity = predicted.node_velocity.copy()
    for group, elastic in zip(model.elastic_stones.groups, compliance, strict=True):
        turn = predicted.rotation[group.bodies]
        inner, outer = _elastic_forces(group, predicted, gravity, step, theta)
        # inner forces must not move a stone as a whole, not even by their rounding
        answer = elastic.deform(step * (inner + outer)) + elastic.shift(step * outer)
        node_velocity[group.nodes] += answer @ turn.transpose(0, 2, 1)
    return Kick(velocity, node_velocity, load)


def _elastic_forces(
    group: ElasticGroup, predicted: State, gravity: Array, step: float, theta: float
) -> tuple[Array, Array]:
    """Return the nodal forces of equal stones (k, n, 3), body axes [N]: inner and outer ones.

    The inner ones are -K (d + (hθ + β) v) and the centrifugal forces; the outer ones are the weight and -α M v.
    """
    stone, turn, count = group.stone, predicted.rotation[group.bodies], len(group.bodies)
    material = stone.material
    velocity = predicted.node_velocity[group.nodes] @ turn
    # d at the kick is that of the start of the step plus h(1-θ) v; the rigid part of v vanishes under K
    strained = (predicted.node[group.nodes] - predicted.centre[group.bodies, None]) @ turn - stone.mesh.nodes
    strained += (step * (2.0 * theta - 1.0) + material.stiffness_damping) * velocity
    rate = velocity.reshape(count, -1).T
    spin = (stone.projector[3:] @ rate).T[:, None]
    outward = -np.cross(spin, np.cross(spin, stone.mesh.nodes)).reshape(count, -1).T
    # what turns the stone as a whole is part of its flight
    outward -= stone.modes @ (stone.projector @ outward)
    mass = stone.operators.mass
    inner = mass @ outward - stone.operators.stiffness @ strained.reshape(count, -1).T
    outer = stone.weight[:, None] * (gravity @ turn)[:, None]
    if material.mass_damping:
        outer = outer - material.mass_damping * (mass @ rate).T.reshape(count, -1, 3)
    return inner.T.reshape(count, -1, 3), outer


def _loads(model: Model, state: State, gravity: Array) -> Array:
    """Return forces and moments (nb, 6) on the rigid bodies, weight included [N], [N m]."""
    load = np.zeros((len(model.mass), 6))
    moving = model.inertia.moving
    load[moving, :3] = model.mass[moving, None] * gravity
    for force, bodies in model.forces:
        push, moment = force(state.time, state.centre[bodies], state.rotation[bodies])
        load[bodies, :3] += push
        load[bodies, 3:] += moment
    return load


def kicked(
    model: Model, free: Kick, detection: Detection, impulse: Array, compliance: Sequence[Compliance]
) -> Kick:
    """Return v_{i+1} = v_free + ŵ H r, with ŵ and H of the configuration in which the contacts were found."""
    velocity = free.velocity + detection.operator.rigid_change(impulse)
    node_velocity = free.node_velocity
    if compliance:
        world = world_impulse(detection.contacts, impulse)
        nodal = detection.contacts.weights.T @ np.stack([world, -world], axis=1).reshape(-1, 3)
        node_velocity = node_velocity.copy()
        for group, response in zip(model.elastic_stones.groups, compliance, strict=True):
            turn = detection.configuration.rotation[group.bodies]
            node_velocity[group.nodes] += response.respond(nodal[group.nodes] @ turn) @ turn.transpose(
                0, 2, 1
            )
    return Kick(velocity, node_velocity, free.load)


def advance(model: Model, start: State, predicted: State, kick: Kick, duration: float) -> State:
    """Return q_{i+1} = q_m + hθ v_{i+1}: fly from the kick to the end of the step, for hθ = `duration` [s]."""
    state = replace(predicted, velocity=kick.velocity, node_velocity=kick.node_velocity)
    return predict(model, start, state, duration)
