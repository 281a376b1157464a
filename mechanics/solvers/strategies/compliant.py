"""Strategy for scenes with compliant joints, W + E for W."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, Delassus
from mechanics.problem.residual import residual
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.proximal_newton import polished
from mechanics.solvers.strategies.elastic import Elastic
from mechanics.solvers.strategies.rigid import TURNS, many_bodies, some_bodies
from mechanics.solvers.strategies.rigid_first import RigidFirst

__all__ = ["Compliant"]

# factors of E, from soft joints to those asked for: each solution leads Newton's method to the next
_HOMOTOPY = (100.0, 30.0, 10.0, 3.0, 1.0)
# factor above which also a solution that is not quite one leads on [-]
_TOO_SOFT = 10.0
# steps of Newton's method with each
_NEWTON_STEPS = 30
# iterations of the interior point
_INTERIOR = 60
# iterations with kept factors between many bodies on springs, in the turns of rigid joints: forces of joints that yield
# do not drift for long, so most steps end in the first turn, where each step of Newton's method factorises anew
_ADMM_ITERATIONS = 1000
# compliance of most joints over W_αα from which they are springs: below, as between rigid stones, those turns would
# take hundreds of iterations [-]
_YIELDING = 5e-3
# stages below it, extrapolated as soon as it is known what opens, slides and sticks
_STAGES = (*TURNS[:2], *(4 * (Stage((1.0, 0.05, 0.02), 100, extrapolated=True),)))


@dataclass(frozen=True)
class Compliant:
    """Newton's method, from softer joints where it fails, then the interior point; with deformable stones as `Elastic`.

    Some deformable stones among more rigid ones are solved as rigid ones first.

    Some hundred bodies, and many on springs, begin with ADMM, whose factors last for many iterations. What it leaves is
    little enough on springs; between others it would be a creep, and Newton's method goes on.

    With E the matrix W + E is regular, however many points stones share, so the method that solves it is fast; from
    contacts far from those of the solution it wanders, and softer joints bring it near. Where it is not solved, the
    solution is that of the hardest joints that were: a start for joints a little softer.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : of all together
    thorough : try the interior point, too, which takes as long as all the others, and softer joints also where ADMM
        came first between joints that yield next to nothing
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    thorough: bool = False

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True, "nothing: no contacts")
        if problem.delassus.rigid is None:
            found = self._deforming(problem, start)
            return replace(found, why=f"compliant joints, {found.why}")
        near, made, springs = None, 0, False
        if some_bodies(problem):
            springs = _yields(problem.delassus)
            if many_bodies(problem) or not springs:
                near = self._begun(problem, start, springs)
                made = near.iterations
                if (near.converged and springs) or made >= self.max_iterations:
                    return near
                start = ContactStart(near.impulse, near.velocity)
        found = self._newton(problem, start, "Newton", self.max_iterations - made)
        if near is not None and near.converged and not found.converged:
            found = replace(near, iterations=found.iterations)
        found = replace(found, iterations=found.iterations + made)
        # where joints yield next to nothing and ADMM has not led near, softer ones seldom do, with 100 factorisations
        softer = near is None or springs or self.thorough
        if softer and not found.converged and found.iterations < self.max_iterations:
            found = self._softer(problem, start, found.iterations)
        left = self.max_iterations - found.iterations
        if not found.converged and self.thorough and left > 0:
            path = InteriorPoint(self.tolerance, self.velocity_tolerance, min(_INTERIOR, left))(
                problem, start
            )
            path = replace(path, iterations=path.iterations + found.iterations)
            found = self._judged(problem, path, "interior point")
        return found

    def _deforming(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        limits, made = (self.tolerance, self.velocity_tolerance), 0
        if problem.delassus.mostly_rigid:
            first = RigidFirst(*limits, self.max_iterations)(problem, start)
            made = first.iterations
            if first.converged or made >= self.max_iterations:
                return first
        found = Elastic(*limits, self.max_iterations - made)(problem, start)
        return replace(found, iterations=found.iterations + made)

    def _begun(self, problem: ContactProblem, start: ContactStart, springs: bool) -> ContactSolution:
        """Return where ADMM leads, which has found most of what opens and slides, if not all."""
        most = min(_ADMM_ITERATIONS, self.max_iterations)
        stages = TURNS if springs else _STAGES
        found = BodyADMM(self.tolerance, self.velocity_tolerance, most, stages)(problem, start)
        return replace(found, why="compliant joints, admm of bodies")

    def _softer(self, problem: ContactProblem, start: ContactStart, count: int) -> ContactSolution:
        """Return the solution by way of softer joints, after `count` iterations."""
        operator = problem.delassus
        assert isinstance(operator, CompliantDelassus)
        for factor in _HOMOTOPY:
            soft = CompliantDelassus(operator.inner, factor * operator.joint_compliance)
            most = self.max_iterations - count
            found = self._newton(replace(problem, delassus=soft), start, "Newton from softer joints", most)
            count += found.iterations
            if found.converged or factor > _TOO_SOFT:
                start = ContactStart(found.impulse, found.velocity)
            if count >= self.max_iterations:
                break
        if not found.converged or factor > _HOMOTOPY[-1]:
            best = replace(found, impulse=start.impulse, velocity=start.velocity)
            found = self._judged(problem, best, found.why)
        return replace(found, iterations=count)

    def _newton(self, problem: ContactProblem, start: ContactStart, name: str, most: int) -> ContactSolution:
        limits = self.tolerance, self.velocity_tolerance
        found = polished(problem, start, limits, min(_NEWTON_STEPS, most))
        return replace(found, why=f"compliant joints, {name}")

    def _judged(self, problem: ContactProblem, found: ContactSolution, name: str) -> ContactSolution:
        left = residual(problem, found.impulse)
        within = left.within(self.tolerance, self.velocity_tolerance)
        return replace(found, natural_map=left.natural_map, converged=within, why=f"compliant joints, {name}")


def _yields(operator: Delassus) -> bool:
    """Return whether most joints yield by as much as springs do, and not by as little as keeps W regular."""
    assert isinstance(operator, CompliantDelassus)
    own = np.einsum("cii->c", operator.inner.diagonal) / 3.0
    return bool(np.median(operator.joint_compliance[:, 0] / own) >= _YIELDING)
