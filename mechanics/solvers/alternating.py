"""Gauss–Seidel and ADMM in turn: each is quick where the other is slow."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.residual import residual
from mechanics.solvers.admm import ADMM
from mechanics.solvers.nsgs import NSGS

__all__ = ["Alternating"]

# sweeps with which every solution begins: near a solution they suffice
_FIRST_SWEEPS = 20
# a small penalty finds the forces in stones that stay in touch within a few dozen iterations, or never
# it is then driven further than asked for, which costs little and spares the next steps any work
_FURTHER = 0.03
_STATIC_PENALTY, _STATIC_ITERATIONS, _STATIC_PATIENCE = 1e-3, 60, 3.0


@dataclass(frozen=True)
class Alternating:
    """For rigid scenes: a few sweeps; ADMM with a small penalty, as long as it converges fast; then sweeps again.

    Gauss–Seidel carries news by one stone in a sweep, so the first steps of a tall wall cost it thousands of sweeps;
    ADMM with a small penalty solves the motion of all stones at once, and needs some 30 iterations as long as
    few contacts open or slide. Where they do, Gauss–Seidel is the better one.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : sweeps, after the attempt with ADMM
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-4
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""
        sweep = NSGS(self.tolerance, self.velocity_tolerance, min(_FIRST_SWEEPS, self.max_iterations))
        best = sweep(problem, start)
        if best.converged or self.max_iterations <= _FIRST_SWEEPS or problem.sparse is None:
            return best
        static = ADMM(
            _FURTHER * self.tolerance,
            _FURTHER * self.velocity_tolerance,
            _STATIC_ITERATIONS,
            penalty=_STATIC_PENALTY,
            patience=_STATIC_PATIENCE,
        )
        # not from the sweeps: they end near a solution, but with velocities that lead ADMM astray
        found = static(problem, ContactStart(start.impulse, np.zeros_like(start.velocity)))
        done = best.iterations + found.iterations
        if found.converged or residual(problem, found.impulse).within(
            self.tolerance, self.velocity_tolerance
        ):
            return replace(found, iterations=done, converged=True)
        if found.natural_map < best.natural_map:
            best = found
        rest = replace(sweep, max_iterations=self.max_iterations - _FIRST_SWEEPS)
        last = rest(problem, ContactStart(best.impulse, best.velocity))
        if last.natural_map > best.natural_map:
            last = replace(best, iterations=last.iterations)
        return replace(last, iterations=done + last.iterations)
