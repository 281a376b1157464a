"""Strategy for scenes with compliant joints, W + E for W."""

from dataclasses import dataclass, replace

from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.proximal_newton import ProximalNewton
from mechanics.solvers.second_order.scaling import equilibrated
from mechanics.solvers.strategies.elastic import Elastic

__all__ = ["Compliant"]

# factors of E, from soft joints to those asked for: each solution leads Newton's method to the next
_HOMOTOPY = (100.0, 30.0, 10.0, 3.0, 1.0)
# steps of Newton's method with each
_NEWTON_STEPS = 30
# tolerances of Newton's method over those asked for: what they leave would be a creep [-]
_FURTHER = 1e-3
# iterations of the interior point
_INTERIOR = 60


@dataclass(frozen=True)
class Compliant:
    """Newton's method, from softer joints where it fails, then the interior point; with deformable stones as `Elastic`.

    With E the matrix W + E is regular, however many points stones share, so the method that solves it is fast; from
    contacts far from those of the solution it wanders, and softer joints bring it near.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : of all together
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; return the best solution of all methods."""
        if problem.delassus.rigid is None:
            found = Elastic(self.tolerance, self.velocity_tolerance, self.max_iterations)(problem, start)
            return replace(found, why=f"compliant joints, {found.why}")
        best = self._newton(problem, start, "Newton", self.max_iterations)
        if not best.converged and best.iterations < self.max_iterations:
            best = _better(best, self._softer(problem, start, self.max_iterations - best.iterations))
        if not best.converged and best.iterations < self.max_iterations:
            most = min(_INTERIOR, self.max_iterations - best.iterations)
            found = InteriorPoint(self.tolerance, self.velocity_tolerance, most)(problem, start)
            best = _better(best, self._judged(problem, found, "interior point"))
        return best

    def _softer(self, problem: ContactProblem, start: ContactStart, most: int) -> ContactSolution:
        operator, count = problem.delassus, 0
        assert isinstance(operator, CompliantDelassus)
        for factor in _HOMOTOPY:
            soft = CompliantDelassus(operator.inner, factor * operator.joint_compliance)
            found = self._newton(
                replace(problem, delassus=soft), start, "Newton from softer joints", most - count
            )
            start, count = ContactStart(found.impulse, found.velocity), count + found.iterations
        return replace(found, iterations=count)

    def _newton(self, problem: ContactProblem, start: ContactStart, name: str, most: int) -> ContactSolution:
        even, each = equilibrated(problem)
        unit = each[:, None]
        further = _FURTHER * self.tolerance, _FURTHER * self.velocity_tolerance
        solver = ProximalNewton(*further, min(_NEWTON_STEPS, most))
        found = solver(even, ContactStart(start.impulse / unit, start.velocity * unit))
        found = replace(found, impulse=found.impulse * unit, velocity=found.velocity / unit)
        return self._judged(problem, found, name)

    def _judged(self, problem: ContactProblem, found: ContactSolution, name: str) -> ContactSolution:
        left = residual(problem, found.impulse)
        within = left.within(self.tolerance, self.velocity_tolerance)
        return replace(found, natural_map=left.natural_map, converged=within, why=f"compliant joints, {name}")


def _better(one: ContactSolution, other: ContactSolution) -> ContactSolution:
    """Return the one that is solved or has the smaller η, with the iterations of both."""
    best = min(one, other, key=lambda solution: (not solution.converged, solution.natural_map))
    return replace(best, iterations=one.iterations + other.iterations)
