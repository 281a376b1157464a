"""Strategy for scenes with deformable stones: ADMM, where that is slow the interior point, at last cone programmes."""

from dataclasses import dataclass, replace

from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.second_order.cone_program import ConeProgram
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.strategies.mixed import Mixed

__all__ = ["Elastic"]

# iterations of ADMM that cost as much as the interior-point method takes in all
_ADMM = 400
# the same from a start that is nearly a solution, which Newton's method ends by a handful of factorisations
_NEARLY_ADMM = 60
# η of such a start [-]
_NEARLY = 1e-4
# iterations of the central path where most stones are rigid, a factorisation each
_PATH = 200
# most contacts of a step that cone programmes may solve: they take 2 to 5 s of 300 contacts
_FEW = 1000


@dataclass(frozen=True)
class Elastic:
    """ADMM from where the last step ended, and the interior-point method where it does not converge soon.

    ADMM factorises once for as long as contacts persist, so where little changes from step to step a few of its cheap
    iterations suffice, and where they do not, Newton's method, with which the interior point begins, ends it. The
    interior point factorises in each of some 30 iterations, whatever the state (docs/design/solvers.md has
    measurements). Warped stones that settle ask for more now and then: cone
    programmes, slow and sure, solve what neither did. Where most stones are rigid, `Mixed` comes before all of them.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : of both together
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; `why` names the method of the two that solved it."""
        limits = self.tolerance, self.velocity_tolerance
        if problem.delassus.mostly_rigid:
            found = Mixed(*limits, min(_PATH, self.max_iterations))(problem, start)
            if found.converged:
                return replace(found, why="central path: most stones are rigid")
        warm = "warm start" if start.impulse.any() else f"cold start, {len(start.impulse):,} contacts"
        near = start.impulse.any() and residual(problem, start.impulse).natural_map <= _NEARLY
        most = min(_NEARLY_ADMM if near else _ADMM, self.max_iterations)
        first = ADMM(*limits, most)(problem, start)
        first = replace(first, why=f"admm: {warm}")
        if first.converged or self.max_iterations <= first.iterations:
            return first
        other = InteriorPoint(*limits, min(100, self.max_iterations - first.iterations))
        second = other(problem, ContactStart(first.impulse, first.velocity))
        second = replace(second, why=f"interior point: admm stood at η {first.natural_map:.0e}")
        best = second if second.natural_map < first.natural_map or second.converged else first
        count = first.iterations + second.iterations
        left = self.max_iterations - count
        if not best.converged and left > 0 and len(start.impulse) <= _FEW:
            third = ConeProgram(*limits, left)(problem, ContactStart(best.impulse, best.velocity))
            third = replace(third, why=f"cone programmes: interior point stood at η {second.natural_map:.0e}")
            best = third if third.natural_map < best.natural_map or third.converged else best
            count += third.iterations
        return replace(best, iterations=count)
