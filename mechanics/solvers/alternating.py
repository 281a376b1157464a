"""Gauss–Seidel and ADMM in turn: each is quick where the other is slow."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.residual import residual
from mechanics.solvers.admm import ADMM
from mechanics.solvers.nsgs import NSGS

__all__ = ["Alternating", "moving_admm"]

# sweeps with which every solution begins: near a solution they suffice
_FIRST_SWEEPS = 20
# sweeps between two extrapolations, and from how many iterates
_LOOK, _DEPTH = 5, 10
# a small penalty finds the forces in stones that stay in touch within a few dozen iterations, or never
_STATIC_PENALTY, _STATIC_ITERATIONS, _STATIC_PATIENCE = 1e-3, 60, 3.0
# it is then driven further than asked for, which costs little and spares the next steps any work
_FURTHER = 0.03
# where contacts open and slide: a larger penalty, balanced, and a shift that is held; for this share of the iterations
_MOVING_PENALTY, _MOVING_HOLD, _MOVING_SHARE = 0.03, 10, 0.8


def moving_admm(tolerance: float, velocity_tolerance: float, max_iterations: int) -> ADMM:
    """ADMM for rigid bodies of which many slide or open."""
    return ADMM(
        tolerance, velocity_tolerance, max_iterations, _MOVING_PENALTY, hold=_MOVING_HOLD, balanced=True
    )


@dataclass(frozen=True)
class Alternating:
    """For rigid scenes: sweeps, ADMM with a small penalty, ADMM with a balanced one, sweeps; the best of all counts.

    Gauss–Seidel carries news by one stone in a sweep, so the first steps of a tall wall cost it thousands of sweeps;
    ADMM with a small penalty solves the motion of all stones at once, and needs some 30 iterations as long as
    few contacts open or slide. Where many do, a larger penalty and a steadier shift are better
    (docs/decisions/006-alternating-solver.md has the measurements).

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : sweeps and iterations together
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""
        limits = self.tolerance, self.velocity_tolerance
        best = ContactSolution(start.impulse, start.velocity, 0, np.inf, False)
        # from nothing, sweeps would leave much of the friction where they happen to begin
        if start.impulse.any() or problem.sparse is None:
            best = NSGS(*limits, min(_FIRST_SWEEPS, self.max_iterations), _LOOK, _DEPTH)(problem, start)
        if best.converged or problem.sparse is None:
            return best if best.converged else self._rest(problem, best)
        # not from the sweeps: they end near a solution, but with velocities that lead a small penalty astray
        cold = ContactStart(start.impulse, np.zeros_like(start.velocity))
        static = ADMM(
            _FURTHER * limits[0],
            _FURTHER * limits[1],
            min(_STATIC_ITERATIONS, self.max_iterations),
            _STATIC_PENALTY,
            patience=_STATIC_PATIENCE,
        )
        best = self._better(best, static(problem, cold), problem)
        if not best.converged and self.max_iterations > best.iterations:
            count = int(_MOVING_SHARE * (self.max_iterations - best.iterations))
            moving = moving_admm(*limits, count)
            best = self._better(best, moving(problem, start), problem)
        return best if best.converged else self._rest(problem, best)

    def _rest(self, problem: ContactProblem, best: ContactSolution) -> ContactSolution:
        """Sweeps for what is left of the iterations."""
        count = max(self.max_iterations - best.iterations, 0)
        sweep = NSGS(self.tolerance, self.velocity_tolerance, count, _LOOK, _DEPTH)
        return self._better(best, sweep(problem, ContactStart(best.impulse, best.velocity)), problem)

    def _better(
        self, one: ContactSolution, other: ContactSolution, problem: ContactProblem
    ) -> ContactSolution:
        """The one with the smaller η, with the iterations of both."""
        best = other if other.natural_map < one.natural_map else one
        within = residual(problem, best.impulse).within(self.tolerance, self.velocity_tolerance)
        return replace(best, iterations=one.iterations + other.iterations, converged=within)
