"""The solver that chooses: what a problem is made of, its size, and how sweeps get on, decide."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.delassus.rigid import RigidDelassus
from mechanics.delassus.stored import StoredDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers._kernels import stored_portfolio as portfolio
from mechanics.solvers.strategies.elastic import Elastic
from mechanics.solvers.strategies.rigid import Alternating

__all__ = ["Auto"]

# what the compiled portfolio ended with
_ENDED = {
    portfolio.NOTHING: "nothing: the start is a solution",
    portfolio.SWEEPS: "sweeps: they get on faster than factors would pay",
    portfolio.ADMM: "static ADMM: sweeps are slow, and nothing much opens or slides",
    portfolio.NEWTON: "proximal Newton: sweeps are slow, and contacts open or slide",
}


@dataclass(frozen=True)
class Auto:
    """Solves whatever problem; `why` of its solutions says how, and why so.

    - a W that is stored: sweeps as long as, by the fall of η, they end sooner than methods that factorise would; then
      ADMM with a single factorisation, as long as η falls fast; then Newton's method on regularised problems, with
      sweeps between its attempts (docs/decisions/021-a-portfolio-for-stored-problems.md);
    - rigid bodies: `Alternating`; bodies of which some are deformable: `Elastic`.

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
        limits = self.tolerance, self.velocity_tolerance, self.max_iterations
        if isinstance(problem.delassus, StoredDelassus) and problem.adhesion is None:
            return self._stored(problem, problem.delassus, start)
        if isinstance(problem.delassus, RigidDelassus | StoredDelassus):
            return Alternating(*limits)(problem, start)
        return Elastic(*limits)(problem, start)

    def _stored(
        self, problem: ContactProblem, operator: StoredDelassus, start: ContactStart
    ) -> ContactSolution:
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True, "nothing: no contacts")
        impulse = start.impulse.copy()
        eta, velocity, dual, count, _, ended = portfolio.solve_stored(
            operator.block,
            operator.indices.astype(np.int64, copy=False),
            operator.indptr.astype(np.int64, copy=False),
            problem.biased,
            problem.friction,
            problem.cohesion,
            impulse,
            self.tolerance,
            self.velocity_tolerance,
            self.max_iterations,
        )
        within = eta <= self.tolerance and velocity <= self.velocity_tolerance
        if within and np.isfinite(self.velocity_tolerance):
            # impulses without bound can hide velocities in their rounding
            within = residual(problem, impulse).within(self.tolerance, self.velocity_tolerance)
        found = ContactSolution(impulse, dual, count, eta, within, _ENDED[ended])
        if within or count >= self.max_iterations:
            return found
        rest = Alternating(self.tolerance, self.velocity_tolerance, self.max_iterations - count)
        other = rest(problem, ContactStart(impulse, np.zeros_like(dual)))
        best = other if other.natural_map < eta else found
        return replace(best, iterations=count + other.iterations)
