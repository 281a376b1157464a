"""Automatic solver selection by the bodies of a problem."""

from dataclasses import dataclass

from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.solvers.strategies.elastic import Elastic
from mechanics.solvers.strategies.rigid import Alternating

__all__ = ["Auto"]


@dataclass(frozen=True)
class Auto:
    """`Alternating` between rigid bodies, `Elastic` where some are deformable; `why` of the solution gives the reason.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : sweeps and iterations of all methods together
    thorough : as in `Alternating`
    motion_speed : as in `Alternating`
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    thorough: bool = True
    motion_speed: float | None = None

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; return the best solution of all methods."""
        limits = self.tolerance, self.velocity_tolerance, self.max_iterations
        if problem.delassus.rigid is None:
            return Elastic(*limits)(problem, start)
        return Alternating(*limits, self.thorough, self.motion_speed)(problem, start)
