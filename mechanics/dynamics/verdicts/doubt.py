"""Steps of a run that were not solved: their errors, and the stones whose contacts they leave open."""

import numpy as np

from mechanics.carried import Carrier
from mechanics.dynamics.step import Step
from mechanics.model.model import Model
from mechanics.problem.residual import residual

_DOUBT = 0.5  # velocity that unsolved steps may have added, over that of a proven motion [-]
_HOPELESS = 20  # steps without a solution from which a run is given up: overlaps are pushed out in fewer
_NAMED = 4  # most stones that are named


class UnsolvedSteps(Carrier):
    """Errors of the steps that were not solved.

    Parameters
    ----------
    model : of the run

    Attributes
    ----------
    count, steps : unsolved steps, and all
    total, worst : sum of the largest velocities by which contacts of these steps break their laws, and the largest of
        them [m/s]
    """

    CARRIED = ("_stones", "count", "steps", "total", "worst")
    REBUILT = ("_model",)

    def __init__(self, model: Model) -> None:
        self._model = model
        self.count = self.steps = 0
        self.total = self.worst = 0.0
        self._stones = np.zeros(len(model.mass))

    def __call__(self, step: Step) -> None:
        """Account for one step."""
        self.steps += 1
        if step.solution.converged:
            return
        problem = step.problem
        fastest = float(np.abs(problem.u_free).max(initial=0.0)) or float(
            np.abs(problem.bias).max(initial=0.0)
        )
        residuals = residual(problem, step.solution.impulse)
        broken = np.nan_to_num(residuals.error * problem.delassus.scale)
        np.maximum.at(self._stones, step.found.contacts.bodies, broken[:, None])
        error = residuals.velocity * fastest
        self.count += 1
        self.total += error
        self.worst = max(self.worst, error)

    def may_cause(self, speed: float) -> bool:
        """Return whether the errors may have caused a motion [m/s]."""
        return self.total > _DOUBT * speed

    def hopeless(self, fastest: float) -> bool:
        """Return whether no step was solved, and the errors may have caused the fastest motion so far [m/s]."""
        return self.count == self.steps >= _HOPELESS and self.may_cause(fastest)

    def text(self) -> str:
        """Return how many steps were not solved, and by what velocity."""
        return (
            f"{self.count} of {self.steps} steps were not solved, with errors of up to {length(self.worst)}/s"
        )

    def surrender(self) -> str:
        """Return the reason why a run was given up, with the stones whose contacts break their laws most."""
        order = np.argsort(-self._stones, kind="stable")[:_NAMED]
        named = [self._model.scene.blocks[body].code for body in order if self._stones[body] > 0]
        return (
            f"the run was given up, as {self.text()}; contacts of the stones {', '.join(named)} break their laws most: "
            "look for overlaps and gaps there with moma check"
        )


def length(length: float) -> str:
    """Return a length in a unit that suits it."""
    return f"{length:.3g} m" if length >= 1.0 else f"{1e3 * length:.3g} mm"
