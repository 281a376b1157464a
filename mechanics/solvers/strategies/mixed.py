"""Strategy for few deformable stones among many rigid ones: the central path in even units, to its end."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import Residual, residual
from mechanics.solvers.second_order.central_path import CentralPath
from mechanics.solvers.second_order.scaling import equilibrated
from moma.errors import SolverError

__all__ = ["Mixed"]

# complementarities, relative to typical impulses, at which the path begins near the impulses of the last step, and
# again near the best ones where it has stalled: a solution of the step before costs 10 iterations at 1e-4, 13 at 1e-2
# and 15 at 1e-6 [-]
_NEAR, _AGAIN = 1e-4, (1e-4, 1e-5, 1e-6)
# η from which impulses of the last step are no longer near [-]
_FAR = 1e-2
# iterations of one path
_LONGEST = 60
# part of a step below which it is short, and short steps in a row with which a path has stalled
_SHORT, _STUCK = 0.2, 4
# errors over the tolerances to which a path goes on, and iterations that it may take for that: forces that are kept
# from step to step push stones by what they lack [-]
_FURTHER, _OVER = 0.1, 3
# impulses, in even units, that only contradictions cause
_WORTHLESS = 1e30


@dataclass(frozen=True)
class Mixed:
    """Central path from near the last step, else from far inside the cones, and again from where it has stalled.

    In a step of some milliseconds a deformable stone yields by a thousandth of what it moves as a whole. Newton's
    method on the natural map, which ends the path between elastic stones, wanders between rigid ones that touch in
    more points than they need, so the path is followed until the laws hold
    (docs/design/solvers.md has measurements).

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : factorisations of all paths together
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 200

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`; return the best iterate of all paths.

        Raises
        ------
        SolverError : if W is known by its products alone
        """
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        best = self._looked(problem, start.impulse)
        if best.excess <= 1.0:
            return _solution(best, 0)
        even, unit = equilibrated(problem)
        units, count = unit[:, None], 0
        near = bool(start.impulse.any()) and best.left.natural_map <= _FAR
        for level in (_NEAR if near else None, *_AGAIN):
            path = CentralPath(even) if level is None else CentralPath(even, best.impulse / units, level)
            best, count = self._followed(problem, path, units, (best, count))
            if best.excess <= 1.0 or count >= self.max_iterations:
                break
        return _solution(best, count)

    def _followed(
        self, problem: ContactProblem, path: CentralPath, units: Array, begin: tuple["_Look", int]
    ) -> tuple["_Look", int]:
        """Return the best of earlier iterates and those of a path, which ends where it is solved or stalls."""
        (best, count), short, over = begin, 0, 0
        last = min(count + _LONGEST, self.max_iterations)
        while count < last and short < _STUCK and over < _OVER and best.excess > _FURTHER:
            try:
                with np.errstate(all="ignore"):
                    length = path.advance()
            except SolverError:
                # rounding has won
                break
            count += 1
            impulse = path.impulse
            if not (np.isfinite(path.complementarity) and np.abs(impulse).max() < _WORTHLESS):
                break
            short = short + 1 if length < _SHORT else 0
            found = self._looked(problem, impulse * units)
            best = found if found.excess < best.excess else best
            over += best.excess <= 1.0
        return best, count

    def _looked(self, problem: ContactProblem, impulse: Array) -> "_Look":
        left = residual(problem, impulse)
        excess = max(left.natural_map / self.tolerance, left.velocity / self.velocity_tolerance)
        return _Look(impulse, left, excess)


@dataclass(frozen=True)
class _Look:
    """Impulses (nc, 3), their residual, and the larger of its errors over the tolerance [-]."""

    impulse: Array
    left: Residual
    excess: float


def _solution(best: _Look, count: int) -> ContactSolution:
    return ContactSolution(best.impulse, best.left.dual, count, best.left.natural_map, best.excess <= 1.0)
