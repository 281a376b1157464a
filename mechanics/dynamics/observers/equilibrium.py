"""Equilibrium of a scene: imbalance of each body, support reaction, displacement and speed."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, material_points
from mechanics.dynamics.observers._kernels import largest_displacement, largest_speed
from mechanics.model.model import Model
from mechanics.scene.state import State


@dataclass(frozen=True)
class Support:
    """Global equilibrium.

    Attributes
    ----------
    reaction : contact force of all fixed bodies against gravity [N]
    weight : of all bodies that are not fixed [N]
    borne : their weight and what other loads press along gravity [N]
    """

    reaction: float
    weight: float
    borne: float

    @property
    def error(self) -> float:
        """|reaction - borne| / weight [-]; zero without weight."""
        return abs(self.reaction - self.borne) / self.weight if self.weight > 0 else 0.0


def imbalance(
    model: Model, state: State, contacts: Contacts, force: Array, load: Array, resting: Array | None = None
) -> Array:
    """Return the unbalanced force and moment of each body over its weight (nb,) [-]; zero for fixed bodies.

    The imbalance is the sum of the loads (nb, 6) on rigid bodies, weight included, and of the contact forces (nc, 3)
    [N], without inertia: it vanishes only in static equilibrium. The moment, about the centre of mass, is divided by
    the smallest width. Forces on elastic bodies act on their undeformed shape, in line with small strain: otherwise the
    lower stones of high walls, which carry many times their own weight, would be out of balance by their strain.
    Without gravity the largest contact force replaces the weight. `resting` (nb, 6) are forces and moments of further
    contacts, those between sleeping stones.
    """
    points = material_points(contacts, replace(state, node=_undeformed(model, state)))
    if model.rigid_only:
        # rigid stones meet half-way between their material points, as in W: a gap or an overlap gives no moment
        points = np.repeat(points.mean(axis=1, keepdims=True), 2, axis=1)
    count = len(model.mass)
    resultant = wrenches(state, contacts.bodies[:, 0], points[:, 0], force, count)
    resultant -= wrenches(state, contacts.bodies[:, 1], points[:, 1], force, count)
    weight = model.mass[:, None] * model.gravity(state.time)
    if resting is not None:
        resultant += resting
    # the load on rigid bodies holds their weight
    resultant += np.where(model.elastic[:, None], np.hstack([weight, np.zeros_like(weight)]), load)
    scale = np.linalg.norm(weight, axis=1)
    if not scale.any():
        scale = np.full(len(scale), np.linalg.norm(force, axis=1).max(initial=0.0) or 1.0)
    size = model.surfaces.size
    parts = np.linalg.norm(resultant[:, :3], axis=1), np.linalg.norm(resultant[:, 3:], axis=1) / size
    result: Array = np.where(model.fixed, 0.0, np.maximum(*parts) / scale)
    return result


def _undeformed(model: Model, state: State) -> Array:
    """Return the nodes (nn, 3) of unstrained bodies in the present configuration [m]."""
    place = np.empty_like(state.node)
    for group in model.elastic_stones.groups:
        turned = group.stone.mesh.nodes @ state.rotation[group.bodies].transpose(0, 2, 1)
        place[group.nodes] = state.centre[group.bodies, None] + turned
    return place


def wrenches(state: State, body: Ints, point: Array, force: Array, count: int) -> Array:
    """Return the sums (count, 6) of forces, and of their moments about the centres of the bodies [N], [N m]."""
    wrench = np.column_stack([force, np.cross(point - state.centre[body], force)])
    # bincount returns integers where there are no contacts
    return np.column_stack([np.bincount(body, column, count) for column in wrench.T]).astype(np.float64)


def support_reaction(model: Model, contacts: Contacts, force: Array, load: Array, time: float) -> Support:
    """Return the sum of the contact forces (nc, 3) [N] of fixed bodies, along -gravity (along z without gravity).

    `load` (nb, 6) are forces and moments on rigid bodies, weight included.
    """
    gravity = model.gravity(time)
    g = float(np.linalg.norm(gravity))
    up = -gravity / g if g > 0 else np.array([0.0, 0.0, 1.0])
    sign = model.fixed[contacts.bodies[:, 1]].astype(float) - model.fixed[contacts.bodies[:, 0]]
    weight = model.mass * g
    borne = np.where(model.elastic, weight, -load[:, :3] @ up)
    return Support(
        float(sign @ (force @ up)), *(float(vertical[~model.fixed].sum()) for vertical in (weight, borne))
    )


def settlement(model: Model, start: State, state: State) -> Array:
    """Return how far each centre of mass has sunk since `start` (nb,) [m]; along -z without gravity."""
    gravity = model.gravity(state.time)
    g = float(np.linalg.norm(gravity))
    down = gravity / g if g > 0 else np.array([0.0, 0.0, -1.0])
    sunk: Array = (state.centre - start.centre) @ down
    return sunk


def seen_from_supports(model: Model, start: State, state: State) -> State:
    """Return the state relative to the supports, by the mean of their translations.

    Where the ground shakes, rest and collapse are judged by the motion of stones against it.
    """
    if not model.motions:
        return state
    away = (state.centre - start.centre)[model.fixed].mean(axis=0)
    pace = state.velocity[model.fixed, :3].mean(axis=0)
    velocity = state.velocity.copy()
    velocity[~model.elastic, :3] -= pace
    return replace(
        state,
        centre=state.centre - away,
        velocity=velocity,
        node=state.node - away,
        node_velocity=state.node_velocity - pace,
    )


def displacement(model: Model, start: State, state: State) -> Array:
    """Return the largest displacement of a corner or node of each body since `start` (nb,) [m]."""
    surfaces = model.surfaces
    largest = largest_displacement(
        surfaces.body_vptr, surfaces.shapes.vertex, state.centre, state.rotation, start.centre, start.rotation
    )
    return _with_nodes(model, largest, np.linalg.norm(state.node - start.node, axis=1))


def tilt(model: Model, start: State, state: State) -> Array:
    """Return the angle between the vertical of each body at `start` and now (nb,) [rad]; zero without gravity."""
    gravity = model.gravity(state.time)
    g = float(np.linalg.norm(gravity))
    if g == 0:
        return np.zeros(len(model.mass))
    now, then = (
        state.rotation.transpose(0, 2, 1) @ (gravity / g),
        start.rotation.transpose(0, 2, 1) @ (gravity / g),
    )
    angle: Array = np.arctan2(np.linalg.norm(np.cross(now, then), axis=1), (now * then).sum(axis=1))
    return angle


def speed(model: Model, state: State) -> Array:
    """Return the largest speed of a corner or node of each body (nb,) [m/s]."""
    surfaces = model.surfaces
    largest = largest_speed(surfaces.body_vptr, surfaces.shapes.vertex, state.rotation, state.velocity)
    return _with_nodes(model, largest, np.linalg.norm(state.node_velocity, axis=1))


def _with_nodes(model: Model, largest: Array, of_nodes: Array) -> Array:
    for group in model.elastic_stones.groups:
        largest[group.bodies] = of_nodes[group.nodes].max(axis=1)
    return largest
