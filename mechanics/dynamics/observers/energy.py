"""Kinetic and elastic energy of a state."""

import numpy as np

from mechanics.arrays import Array
from mechanics.model.model import Model
from mechanics.scene.state import State


def kinetic_energy(model: Model, state: State) -> float:
    """Return ½ vᵀ M v of all bodies that can move [J]."""
    return 0.5 * mass_norm(model, state.rotation, state.velocity, state.node_velocity)


def elastic_energy(model: Model, state: State) -> float:
    """Return ½ dᵀ K d of all deformable bodies [J]."""
    return sum(
        stone.elastic_energy(state.node[model.nodes_of(b)], state.centre[b], state.rotation[b])
        for b, stone in enumerate(model.stones)
        if stone is not None
    )


def mass_norm(model: Model, rotation: Array, velocity: Array, node_velocity: Array) -> float:
    """Return vᵀ M v of velocities of all bodies that can move [J]."""
    rigid = model.inertia.inverse_mass > 0
    local = np.einsum("bij,bi->bj", rotation[rigid], velocity[rigid, 3:])
    total = float(model.mass[rigid] @ (velocity[rigid, :3] ** 2).sum(axis=1))
    total += float(np.einsum("bi,bij,bj->", local, model.inertia.inertia[rigid], local))
    for b, stone in enumerate(model.stones):
        if stone is not None:
            v = node_velocity[model.nodes_of(b)].ravel()
            total += float(v @ (stone.operators.mass @ v))
    return total
