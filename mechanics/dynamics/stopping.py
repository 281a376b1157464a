"""Criteria by which a run ends: equilibrium or collapse."""

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.observers.equilibrium import displacement, seen_from_supports, speed
from mechanics.dynamics.outcome import Outcome
from mechanics.model.model import Model
from mechanics.problem.problem import ContactSolution
from mechanics.scene.state import State

__all__ = ["LASTING", "Watch"]


LASTING = 5  # steps in a row that must be in balance
_REST_SPEED = 1e-4  # of √(g · size), the speed of a fall over a body's own size, below which it rests [-]
_FALL_SPEED = 0.05  # of the same speed, above which a body falls [-]
_TRUSTED = 1e-2  # natural map above which a step proves no fall, as its velocities may be errors [-]


class Watch:
    """Outcome of a run, judged after each step.

    *Equilibrium*: for five steps in a row, and after all loads have ceased to change, every body that is not fixed is
    in balance (unbalanced force and moment below the scene's tolerance) and slower than 10⁻⁴ √(g · its smallest width).
    *Collapsed*: a body has moved by more than the scene's fraction of its smallest width and is faster than
    0.05 √(g · width), in a step solved to η < 0.01. Without gravity g counts as 1 m/s². Displacements and speeds are
    relative to the supports where these are driven.

    Attributes
    ----------
    rest_time : start of the present or last period of rest [s]
    """

    def __init__(self, model: Model, start: State) -> None:
        self._model, self._start = model, start
        self._quiet = 0
        self.rest_time = 0.0

    def __call__(self, state: State, balance: Array, solution: ContactSolution) -> Outcome:
        """Return the outcome so far, from the imbalance of each body (nb,) and the solution of the step."""
        model, settings = self._model, self._model.scene.time
        fall = np.sqrt((float(np.linalg.norm(model.gravity(state.time))) or 1.0) * model.surfaces.size)
        seen = seen_from_supports(model, self._start, state)
        pace = np.where(model.fixed, 0.0, speed(model, seen) / fall)
        quiet = (
            state.time >= model.scene.loads.until
            and solution.converged
            and balance.max() <= settings.balance_tolerance
            and pace.max() <= _REST_SPEED
        )
        self._quiet = self._quiet + 1 if quiet else 0
        if self._quiet == 1:
            self.rest_time = state.time
        if self._quiet >= LASTING:
            return Outcome.EQUILIBRIUM
        far = displacement(model, self._start, seen) > settings.collapse_displacement * model.surfaces.size
        fallen = solution.natural_map < _TRUSTED and bool((far & (pace > _FALL_SPEED)).any())
        return Outcome.COLLAPSED if fallen else Outcome.MOVING
