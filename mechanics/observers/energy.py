"""Energy balance of the θ-scheme: what no term explains was made by the program.

With v_θ = θ v_{i+1} + (1-θ) v_i, the scheme gives exactly

    ΔE = W_ext + W_contact - D_scheme,   W_contact = r·u_θ,   D_scheme = (θ - ½) (‖Δv‖²_M + ‖Δq‖²_K)

for linear motion; turning bodies leave a remainder that shrinks with the step.
"""

import numpy as np
from numpy.typing import NDArray

from mechanics.model import Model
from mechanics.state import State

__all__ = ["EnergyBalance", "elastic_energy", "kinetic_energy"]

Array = NDArray[np.float64]


def kinetic_energy(model: Model, state: State) -> float:
    """½ vᵀ M v of all bodies that can move [J]."""
    return 0.5 * _mass_norm(model, state.rotation, state.velocity, state.node_velocity)


def elastic_energy(model: Model, state: State) -> float:
    """½ dᵀ K d of all deformable bodies [J]."""
    return sum(
        stone.elastic_energy(state.node[model.nodes_of(b)], state.centre[b], state.rotation[b])
        for b, stone in enumerate(model.stones)
        if stone is not None
    )


def _mass_norm(model: Model, rotation: Array, velocity: Array, node_velocity: Array) -> float:
    rigid = model.inertia.inverse_mass > 0
    local = np.einsum("bij,bi->bj", rotation[rigid], velocity[rigid, 3:])
    total = float(model.mass[rigid] @ (velocity[rigid, :3] ** 2).sum(axis=1))
    total += float(np.einsum("bi,bij,bj->", local, model.inertia.inertia[rigid], local))
    for b, stone in enumerate(model.stones):
        if stone is not None:
            v = node_velocity[model.nodes_of(b)].ravel()
            total += float(v @ (stone.operators.mass @ v))
    return total


def _stiffness_norm(model: Model, before: State, after: State) -> float:
    total = 0.0
    for b, stone in enumerate(model.stones):
        if stone is not None:
            rows = model.nodes_of(b)
            move = ((after.node[rows] - before.node[rows]) @ before.rotation[b]).ravel()
            total += float(move @ (stone.operators.stiffness @ move))
    return total


class EnergyBalance:
    """Adds up the terms of the balance over a run.

    Attributes
    ----------
    external, contact, scheme : work of the loads and of the contacts, dissipation of scheme and relaxation, so far [J]
    unexplained : ΔE - external - contact + scheme, so far [J]
    reference : the largest energy that was in play so far, at least 10⁻⁹ of weight times smallest width [J]
    """

    def __init__(self, model: Model, state: State) -> None:
        self._model = model
        self._energy = kinetic_energy(model, state) + elastic_energy(model, state)
        self.external = self.contact = self.scheme = self.unexplained = 0.0
        weight = float(model.mass[~model.fixed].sum() * np.linalg.norm(model.gravity))
        self.reference = max(self._energy, 1e-9 * weight * float(model.surfaces.size.min()))

    def __call__(
        self, before: State, after: State, contact_work: float, relaxed: float, theta: float
    ) -> None:
        """Account for one step: `contact_work` is r·u_θ, `relaxed` the kinetic energy taken out at its end [J]."""
        model = self._model
        external = self._load_work(before, after)
        jump = _mass_norm(
            model,
            before.rotation,
            after.velocity - before.velocity,
            after.node_velocity - before.node_velocity,
        )
        scheme = (theta - 0.5) * (jump + _stiffness_norm(model, before, after))
        energy = kinetic_energy(model, after) + elastic_energy(model, after)
        self.unexplained += energy - self._energy - external - contact_work + scheme
        self.external += external
        self.contact += contact_work
        self.scheme += scheme + relaxed
        self._energy = energy - relaxed
        self.reference = max(self.reference, energy, abs(self.external), abs(self.contact), self.scheme)

    def _load_work(self, before: State, after: State) -> float:
        model = self._model
        rigid = model.inertia.inverse_mass > 0
        work = float(model.mass[rigid] @ ((after.centre - before.centre)[rigid] @ model.gravity))
        for b, stone in enumerate(model.stones):
            if stone is not None:
                rows = model.nodes_of(b)
                work += float(stone.operators.nodal_mass @ ((after.node - before.node)[rows] @ model.gravity))
        return work

    @property
    def error(self) -> float:
        """|unexplained| / reference [-]."""
        return abs(self.unexplained) / self.reference if self.reference > 0 else 0.0
