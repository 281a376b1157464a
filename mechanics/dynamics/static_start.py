"""Static equilibrium in which a run may begin, solved for directly instead of by waiting for rest."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechanics.dynamics.observers.equilibrium import displacement, imbalance
from mechanics.dynamics.outcome import StaticStart
from mechanics.dynamics.progress import Progress
from mechanics.dynamics.relaxation import halted
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import Model
from mechanics.scene.scene import TimeSettings
from mechanics.scene.state import State
from mechanics.solvers.choice import Solver
from mechanics.solvers.second_order.interior_point import InteriorPoint

__all__ = ["static_start"]

_STEP = 1.0  # time step of the search [s]: inertia leaves a structure of 1 Hz less than 1/40 of its motion to come
_STEPS = 10  # most steps of the search; few scenes need more than three
_NATURAL_MAP = (
    0.1  # of the tolerance of η asked for [-]: Newton's last steps cost little, and spare the run its first
)
_VELOCITY = 0.01  # of the tolerance of velocities asked for [-], for the same reason
_ROUNDING = 1e-7  # least η in steps as long as these, because of rounding [-]
_SETTLING = 5  # steps of the run's own length in which rigid stones close their last gaps
_FALLS = 0.2  # displacement over the smallest width beyond which a stone falls rather than settles [-]


def static_start(
    model: Model, start: State, report: Callable[[Progress], None]
) -> tuple[StaticStart, Simulation]:
    """Take steps of 1 s, each from a halt, until every body is in balance under the loads of the first instant.

    With θ = 1 such a step is the static problem (docs/theory.md §2): M/h² is negligible beside K, but determines the
    motion that nothing else holds. Driven supports stay where they are.
    """
    still, start = _still(model, _STEP), halted(start)
    asked = model.scene.solver
    solver: Solver | None = None
    if not model.rigid_only:
        solver = InteriorPoint(
            _NATURAL_MAP * max(asked.tolerance, _ROUNDING), _VELOCITY * asked.velocity_tolerance
        )
    search = Simulation(still, start, solver=solver, elastic_scale=True)
    limit = model.scene.time.balance_tolerance
    iterations, count, balance, eta, found = 0, 0, np.inf, np.inf, False
    while count < _STEPS and not found:
        made = search.step()
        # the loads stay those of the first instant
        search.halt(start.time)
        count += 1
        iterations += made.solution.iterations
        eta = made.solution.natural_map
        after = replace(made.after, time=start.time)
        balance = float(imbalance(still, after, made.contacts, made.force, made.kick.load).max())
        report(Progress("static", count, _STEPS, f"balance {balance:.1e}, η {eta:.1e}"))
        if not bool((displacement(still, start, after) < _FALLS * still.surfaces.size).all()):
            break
        found = eta <= max(asked.tolerance, _ROUNDING) and balance <= limit
    if found and model.inertia.moving.any():
        search = _set_down(model, search)
    return StaticStart(found, count, iterations, eta, balance), search


def _still(model: Model, step: float) -> Model:
    """Return the model for steps of the search: θ = 1, and supports at rest."""
    own = model.scene.time
    time = TimeSettings(step=step, theta=1.0, relaxation=True, lumped_mass=own.lumped_mass)
    return replace(model, scene=replace(model.scene, time=time), motions=())


def _set_down(model: Model, search: Simulation) -> Simulation:
    """Take a few steps of the run's own length; over 1 s small errors of velocity leave gaps between rigid stones."""
    last = Simulation(_still(model, model.scene.time.step), search.start)
    last.take_over(search)
    for _ in range(_SETTLING):
        last.step()
        last.halt(search.start.time)
    return last
