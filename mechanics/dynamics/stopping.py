"""When does a run end, and how: at rest, still moving, or collapsed."""

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.observers.equilibrium import displacement, seen_from_supports, speed
from mechanics.dynamics.outcome import Outcome
from mechanics.model.model import Model
from mechanics.problem.problem import ContactSolution
from mechanics.scene.state import State

__all__ = ["LASTING", "Watch"]


# so many steps in a row must be in balance
LASTING = 5
# a body rests below this part of the speed √(g · size) of a fall over its own size
_REST_SPEED = 1e-4
# and is falling above this part
_FALL_SPEED = 0.05
# a step that is solved worse than this natural map proves no fall
_TRUSTED = 1e-2


class Watch:
    """Tells the outcome after each step.

    *Equilibrium*: for five steps in a row, and after all loads have ceased to change, every body that is not fixed is
    in balance (unbalanced force and moment below the scene's tolerance) and slower than 10⁻⁴ √(g · its smallest width).
    *Collapsed*: a body has moved by more than the scene's fraction of its smallest width and is faster than
    0.05 √(g · width), in a step solved to η < 0.01. Without gravity g counts as 1 m/s². Displacements and speeds are
    those against the supports, where these are driven.

    Attributes
    ----------
    rest_time : when the present or last spell of rest began [s]
    """

    def __init__(self, model: Model, start: State) -> None:
        self._model, self._start = model, start
        self._quiet = 0
        self.rest_time = 0.0

    def __call__(self, state: State, balance: Array, solution: ContactSolution) -> Outcome:
        """The outcome so far, given the imbalance of each body (nb,) and how well the step was solved."""
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
