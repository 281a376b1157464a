"""Interior-point method for contact with friction: the central path, followed until the laws hold."""

from dataclasses import dataclass

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import Residual, residual
from mechanics.solvers.second_order.central_path import NAME, CentralPath
from mechanics.solvers.second_order.scaling import equilibrated

# complementarity, relative to typical impulses, at which a path begins near the impulses of a start: those of the step
# before cost 10 iterations at 1e-4, 13 at 1e-2 and 15 at 1e-6 [-]
_START_COMPLEMENTARITY = 1e-4
# η over the least so far below which an iteration is progress [-]
_PROGRESS = 0.9
# iterations without progress after which the path has stalled: masses 10⁶ apart take a few short steps on the way
_STALLED = 8


@dataclass(frozen=True)
class InteriorPoint:
    """Central path, from near the impulses of the start, or from far inside the cones where there are none.

    Each iteration factorises W + Θ in units in which all contacts yield alike (`equilibrated`): masses may differ by
    any factor. W may be singular, as between rigid stones that touch in more points than they need.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : limit of the factorisations
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 100

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve; return the best iterate.

        Raises
        ------
        SolverError : if W is known by its products alone
        """
        problem.form(NAME)
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        # also without impulses: where no load acts, none are needed
        best = self._looked(problem, start.impulse)
        if best.excess <= 1.0:
            return _solution(best, 0)
        even, unit = equilibrated(problem)
        units = unit[:, None]
        path = (
            CentralPath(even, start.impulse / units, _START_COMPLEMENTARITY)
            if start.impulse.any()
            else CentralPath(even)
        )
        count = idle = 0
        least = np.inf
        while count < self.max_iterations and idle < _STALLED and best.excess > 1.0:
            try:
                # where the laws contradict each other impulses grow until they overflow
                with np.errstate(all="ignore"):
                    path.advance()
            except SolverError:
                # rounding has won
                break
            count += 1
            impulse = path.impulse
            if not (np.isfinite(path.complementarity) and np.isfinite(impulse).all()):
                break
            solution = self._looked(problem, impulse * units)
            idle = 0 if solution.left.natural_map < _PROGRESS * least else idle + 1
            least = min(least, solution.left.natural_map)
            best = solution if solution.excess < best.excess else best
        return _solution(best, count)

    def _looked(self, problem: ContactProblem, impulse: Array) -> "_Look":
        remaining = residual(problem, impulse)
        excess = max(remaining.natural_map / self.tolerance, remaining.velocity / self.velocity_tolerance)
        return _Look(impulse, remaining, excess)


@dataclass(frozen=True)
class _Look:
    """Impulses (nc, 3), their residual, and the larger of its errors over the tolerance [-]."""

    impulse: Array
    left: Residual
    excess: float


def _solution(best: _Look, count: int) -> ContactSolution:
    return ContactSolution(best.impulse, best.left.dual, count, best.left.natural_map, best.excess <= 1.0)
