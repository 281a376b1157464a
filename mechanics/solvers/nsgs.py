"""Non-smooth Gauss–Seidel (Jean 1999; Jourdan, Alart & Jean 1998)."""

from dataclasses import dataclass

from mechanics.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.residual import dual_velocity, residual

__all__ = ["NSGS"]


@dataclass(frozen=True)
class NSGS:
    """Sweeps the contacts, solving each exactly with its neighbours frozen, until η ≤ tolerance.

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    max_iterations : sweeps after which it is given up
    check_every : sweeps between two looks at η
    """

    tolerance: float = 1e-6
    max_iterations: int = 2000
    check_every: int = 20

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`."""
        impulse = start.impulse.copy()
        eta = residual(problem, impulse).natural_map
        shift = problem.u_free.copy()
        shift[:, 0] += problem.bias
        sweep = problem.delassus.gauss_seidel(shift, problem.friction, problem.cohesion)
        sweeps = 0
        while eta > self.tolerance and sweeps < self.max_iterations:
            count = min(self.check_every, self.max_iterations - sweeps)
            sweep(impulse, count)
            sweeps += count
            eta = residual(problem, impulse).natural_map
        return ContactSolution(impulse, dual_velocity(problem, impulse), sweeps, eta, eta <= self.tolerance)
