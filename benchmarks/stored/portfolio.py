"""Portfolio of solvers for stored problems: sweeps, ADMM and Newton's method, chosen by observed convergence."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.stored._kernels import portfolio
from benchmarks.stored.operator import StoredDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.strategies.rigid import Alternating

__all__ = ["StoredAuto"]

# reason for the method with which the compiled portfolio ended
_ENDED = {
    portfolio.NOTHING: "nothing: the start is a solution",
    portfolio.SWEEPS: "sweeps: they get on faster than factors would pay",
    portfolio.ADMM: "static ADMM: sweeps are slow, and nothing much opens or slides",
    portfolio.NEWTON: "proximal Newton: sweeps are slow, and contacts open or slide",
}


@dataclass(frozen=True)
class StoredAuto:
    """Solver of stored problems; `why` of its solutions names the method and the reason.

    Sweeps go on as long as, by the fall of η, they end sooner than methods that factorise would; then ADMM with a
    single factorisation, as long as η falls fast; then Newton's method on regularised problems, with sweeps between its
    attempts (docs/design/solvers.md). `Alternating` has the last word, and solves
    problems with adhesion and those of other operators.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : sweeps and iterations of all methods together
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; the best of all methods is given back."""
        limits, operator = (self.tolerance, self.velocity_tolerance), problem.delassus
        if not isinstance(operator, StoredDelassus) or problem.adhesion is not None:
            return Alternating(*limits, self.max_iterations)(problem, start)
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True, "nothing: no contacts")
        impulse = start.impulse.copy()
        eta, velocity, dual, count, _, ended = portfolio.solve_stored(
            operator.blocks,
            portfolio.Terms(problem.biased, problem.friction, problem.cohesion),
            impulse,
            *limits,
            self.max_iterations,
        )
        within = eta <= self.tolerance and velocity <= self.velocity_tolerance
        if within and np.isfinite(self.velocity_tolerance):
            # impulses without bound can hide velocities in their rounding
            within = residual(problem, impulse).within(*limits)
        found = ContactSolution(impulse, dual, count, eta, within, _ENDED[ended])
        if within or count >= self.max_iterations:
            return found
        rest = Alternating(*limits, self.max_iterations - count)
        other = rest(problem, ContactStart(impulse, np.zeros_like(dual)))
        best = other if other.natural_map < eta else found
        return replace(best, iterations=count + other.iterations)
