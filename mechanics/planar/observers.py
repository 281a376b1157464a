"""Measurements while a scene of the plane runs: energy, balance, rest, reactions."""

import numpy as np

from mechanics.arrays import Array
from mechanics.carried import Carrier
from mechanics.dynamics.energy_balance import EnergyTerms
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.verdicts.lasting import LASTING
from mechanics.planar.contacts import PlanarContacts
from mechanics.planar.model import PlanarModel, PlanarState
from mechanics.planar.simulation import PlanarStep
from mechanics.planar.stepping import load_work

_REST_SPEED = 1e-4  # of √(g · width), the speed of a fall over a disk's own width: below it the disk rests
_STEADY = 1e-9  # relative change of the loads in a step below which they are steady


def world_force(contacts: PlanarContacts, impulse: Array, step: float) -> Array:
    """Compute the mean forces r/h (nc, 2) on the candidates, in x and y [N]."""
    n, r = contacts.normal, impulse / step
    return np.column_stack([n[:, 0] * r[:, 0] - n[:, 1] * r[:, 1], n[:, 1] * r[:, 0] + n[:, 0] * r[:, 1]])


def kinetic_energy(model: PlanarModel, velocity: Array) -> float:
    """Compute ½ vᵀ M v of the disks that can move [J]."""
    free = ~model.fixed
    v = velocity[free]
    # sums of numpy's, not products of BLAS: those may depend on the number of threads
    twice = model.mass[free] * (v[:, 0] ** 2 + v[:, 1] ** 2) + model.moment[free] * v[:, 2] ** 2
    return 0.5 * float(twice.sum())


def disk_speed(model: PlanarModel, velocity: Array) -> Array:
    """Compute the largest speed of a point of each disk that can move [m/s]; zero for the others (nd,)."""
    nd = len(model.radius)
    v = velocity[:nd]
    speed: Array = np.hypot(v[:, 0], v[:, 1]) + np.abs(v[:, 2]) * model.radius
    return np.where(model.fixed[:nd], 0.0, speed)


def imbalance(model: PlanarModel, step: PlanarStep) -> Array:
    """Compute the unbalanced force of each body over its weight, or unbalanced moment over weight × radius (nb,) [-].

    Unbalanced forces change the velocity, so M Δv/h is the unbalanced force. Without gravity the largest contact
    force replaces the weight. Zero for fixed bodies.
    """
    nd, h = len(model.radius), model.scene.time.step
    change = step.after.velocity - step.kick.velocity
    force = model.mass * np.hypot(change[:, 0], change[:, 1]) / h
    force[:nd] = np.maximum(force[:nd], model.moment[:nd] * np.abs(change[:nd, 2]) / h / model.radius)
    pull = model.mass * np.hypot(*model.scene.gravity)
    if not pull.any():
        pull = np.full(len(force), np.abs(step.impulse).max(initial=0.0) / h or 1.0)
    unbalanced = np.zeros(len(force))
    np.divide(force, pull, out=unbalanced, where=~model.fixed)
    return unbalanced


class PlanarEnergy(EnergyTerms):
    """Energy balance of disks.

    ΔE = W_ext + W_contact - D_scheme with W_contact = r·u_θ and D_scheme = (θ - ½) ‖Δv‖²_M holds exactly in the plane.
    """

    REBUILT = ("_model",)

    def __init__(self, model: PlanarModel, start: PlanarState) -> None:
        self._model = model
        weight = float(model.mass[~model.fixed].sum() * np.hypot(*model.scene.gravity))
        super().__init__(kinetic_energy(model, start.velocity), weight * float(model.radius.min()))

    def __call__(self, step: PlanarStep) -> None:
        """Account for one step."""
        model, theta = self._model, self._model.scene.time.theta
        before, after = step.kick.velocity, step.after.velocity
        mean = theta * after + (1 - theta) * before
        external = load_work(model, step.loads, mean) + step.driven
        scheme = (theta - 0.5) * 2.0 * kinetic_energy(model, after - before)
        self.add(kinetic_energy(model, after), external, step.work, scheme)


class PlanarWatch(Carrier):
    """Watch of the outcome after each step.

    *Equilibrium*: for five steps in a row, each solved to its tolerance, every body that is not fixed is in balance
    (unbalanced force and moment below the scene's tolerance) and slower than 10⁻⁴ √(g · its width), as are walls with a
    mass. Without gravity g counts as 1 m/s². Nothing rests while walls are driven, or loads change.
    """

    CARRIED = ("_loads", "_quiet")
    REBUILT = ("_model", "_slow")

    def __init__(self, model: PlanarModel) -> None:
        self._model = model
        g = float(np.hypot(*model.scene.gravity)) or 1.0
        self._slow = _REST_SPEED * np.sqrt(g * 2.0 * model.radius)
        self._quiet = 0
        self._loads: Array | None = None

    def __call__(self, step: PlanarStep, balance: Array) -> Outcome:
        """Return the outcome so far, given the imbalance of each body (nb,)."""
        model, velocity = self._model, step.after.velocity
        last, self._loads = self._loads, step.loads
        change = np.inf if last is None else np.abs(step.loads - last).max()
        quiet = (
            step.solution.converged
            and change <= _STEADY * np.abs(step.loads).max()
            and balance.max() <= model.scene.time.balance_tolerance
            and bool((disk_speed(model, velocity) <= self._slow).all())
            and not velocity[model.fixed].any()
            and bool((np.abs(velocity[len(model.radius) :]) <= self._slow.min()).all())
        )
        self._quiet = self._quiet + 1 if quiet else 0
        return self.outcome

    @property
    def outcome(self) -> Outcome:
        """Outcome so far."""
        return Outcome.EQUILIBRIUM if self._quiet >= LASTING else Outcome.MOVING
