"""Energy balance of the θ-scheme; energy that no term explains is an error of the program.

With v_θ = θ v_{i+1} + (1-θ) v_i, the scheme gives exactly

    ΔE = W_ext + W_contact - D_scheme,   W_contact = r·u_θ,   D_scheme = (θ - ½) (‖Δv‖²_M + ‖Δq‖²_K)

where Δv is the jump at the kick, and Δq the change of the deformation of an elastic body in its own axes; its damping,
h v_θᵀ V v_θ, counts with the scheme. The flights before and after the kick keep the energy of a body as it is. Elastic
bodies that turn leave a remainder of the order of their strain. W_ext holds the loads and what driven bodies put in.
"""

import numpy as np

from mechanics.arrays import Array
from mechanics.carried import Carrier
from mechanics.delassus.assembly import local_velocity
from mechanics.dynamics.observers.energy import elastic_energy, kinetic_energy, mass_norm
from mechanics.dynamics.step import Step
from mechanics.model.model import Model
from mechanics.model.stone_groups import ElasticGroup
from mechanics.scene.state import State


class EnergyTerms(Carrier):
    """Terms of the energy balance, summed over a run of stones or of disks.

    Parameters
    ----------
    energy : at the start [J]
    scale : weight times smallest width [J]

    Attributes
    ----------
    external, contact, scheme : work of loads and driven bodies, work of the contacts, dissipation of scheme, damping
        and relaxation, so far [J]
    unexplained : ΔE - external - contact + scheme, so far [J]
    reference : largest energy in any term so far, at least 10⁻⁹ of weight times smallest width [J]
    """

    CARRIED = ("_energy", "contact", "external", "reference", "scheme", "unexplained")

    def __init__(self, energy: float, scale: float) -> None:
        self._energy = energy
        self.external = self.contact = self.scheme = self.unexplained = 0.0
        self.reference = max(energy, 1e-9 * scale)

    def add(
        self, energy: float, external: float, contact: float, scheme: float, relaxed: float = 0.0
    ) -> None:
        """Account for one step: its energy at the end, its works, and what a relaxation takes after it [J]."""
        self.unexplained += energy - self._energy - external - contact + scheme
        self.external += external
        self.contact += contact
        self.scheme += scheme + relaxed
        self._energy = energy - relaxed
        self.reference = max(self.reference, energy, abs(self.external), abs(self.contact), self.scheme)

    @property
    def error(self) -> float:
        """|unexplained| / reference [-]."""
        return abs(self.unexplained) / self.reference if self.reference > 0 else 0.0


class EnergyBalance(EnergyTerms):
    """Energy balance of stones."""

    REBUILT = ("_model",)

    def __init__(self, model: Model, state: State) -> None:
        self._model = model
        weight = float(model.mass[~model.fixed].sum() * np.linalg.norm(model.gravity(state.time)))
        energy = kinetic_energy(model, state) + elastic_energy(model, state)
        super().__init__(energy, weight * float(model.surfaces.size.min()))

    def __call__(self, step: Step) -> None:
        """Account for one step."""
        model, theta = self._model, self._model.scene.time.theta
        before, kick = step.predicted, step.kick
        contact, driven = _contact_work(model, step, theta)
        external = self._load_work(step, theta) + driven
        jump = mass_norm(
            model,
            before.rotation,
            kick.velocity - before.velocity,
            kick.node_velocity - before.node_velocity,
        )
        scheme = (theta - 0.5) * jump + _elastic_dissipation(model, step, theta, model.scene.time.step)
        energy = kinetic_energy(model, step.after) + elastic_energy(model, step.after)
        self.add(energy, external, contact, scheme, step.relaxed)

    def halted(self, state: State) -> None:
        """Account for a halt between two steps, which the scheme makes."""
        kinetic = kinetic_energy(self._model, state)
        self.scheme += kinetic
        self._energy -= kinetic

    def _load_work(self, step: Step, theta: float) -> float:
        """Return h P·v_θ: loads at the kick times the mean of the velocities before and after it [J]."""
        model = self._model
        moving, h = model.inertia.moving, model.scene.time.step
        mean = theta * step.kick.velocity + (1 - theta) * step.predicted.velocity
        work = h * float(np.sum(step.kick.load[moving] * mean[moving]))
        gravity = model.gravity(step.predicted.time)
        for b, stone in enumerate(model.stones):
            if stone is not None:
                rows = model.nodes_of(b)
                move = (step.after.node - step.before.node)[rows]
                work += float(stone.weight @ (move @ gravity))
        return work


def _contact_work(model: Model, step: Step, theta: float) -> tuple[float, float]:
    """Return r·u_θ, the work of the contacts, and the work that driven bodies put in through them [J]."""
    contacts, operator, impulse = step.found.contacts, step.found.operator, step.active.impulse
    before, after = step.predicted.velocity, step.kick.velocity
    u_before = local_velocity(contacts, operator, before, step.predicted.node_velocity)
    work = float(np.sum(impulse * (theta * step.relative + (1 - theta) * u_before)))
    driven = np.where(model.fixed[:, None], theta * after + (1 - theta) * before, 0.0)
    u_driven = local_velocity(contacts, operator, driven, np.zeros_like(step.after.node))
    return work, -float(np.sum(impulse * u_driven))


def _elastic_dissipation(model: Model, step: Step, theta: float, duration: float) -> float:
    """Return (θ - ½) ‖Δq‖²_K + h v_θᵀ V v_θ of all deformable bodies [J]."""
    total = 0.0
    for group in model.elastic_stones.groups:
        stone, count = group.stone, len(group.bodies)
        before, after = (
            _in_axes(group, state, state.node, state.centre) for state in (step.before, step.after)
        )
        change = (after - before).reshape(count, -1)
        total += (theta - 0.5) * float(np.sum(change.T * (stone.operators.stiffness @ change.T)))
        if stone.damping.nnz:
            mean = theta * step.kick.node_velocity + (1 - theta) * step.predicted.node_velocity
            mean = _in_axes(group, step.predicted, mean).reshape(count, -1)
            total += duration * float(np.sum(mean.T * (stone.damping @ mean.T)))
    return total


def _in_axes(group: ElasticGroup, state: State, nodal: Array, origin: Array | None = None) -> Array:
    """Return nodal vectors (k, n, 3) of equal stones in their own axes."""
    local = nodal[group.nodes]
    if origin is not None:
        local = local - origin[group.bodies, None]
    turned: Array = local @ state.rotation[group.bodies]
    return turned
