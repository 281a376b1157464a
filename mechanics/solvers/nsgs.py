"""Non-smooth Gauss–Seidel (Jean 1999; Jourdan, Alart & Jean 1998)."""

from dataclasses import dataclass

from mechanics.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.residual import residual

__all__ = ["NSGS"]


@dataclass(frozen=True)
class NSGS:
    """Sweeps the contacts, solving each exactly with its neighbours frozen, until η ≤ tolerance.

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    velocity_tolerance : and the largest velocity by which a contact may break its law, over that of u_free [-]
    max_iterations : sweeps after which it is given up
    check_every : sweeps between two looks at η
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-4
    max_iterations: int = 2000
    check_every: int = 20

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`."""
        impulse = start.impulse.copy()
        left = residual(problem, impulse)
        limits = self.tolerance, self.velocity_tolerance
        sweeps = 0
        if not left.within(*limits):
            shift = problem.u_free.copy()
            shift[:, 0] += problem.bias
            sweep = problem.delassus.gauss_seidel(shift, problem.friction, problem.cohesion)
            while not left.within(*limits) and sweeps < self.max_iterations:
                count = min(self.check_every, self.max_iterations - sweeps)
                sweep(impulse, count)
                sweeps += count
                left = residual(problem, impulse)
        return ContactSolution(impulse, left.dual, sweeps, left.natural_map, left.within(*limits))
