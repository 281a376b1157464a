"""Newton's method by way of softer joints: each solution leads to that of joints a little harder."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, Delassus
from mechanics.solvers.scales import HELD
from mechanics.solvers.second_order.newton import Newton


@dataclass(frozen=True)
class SofterJoints:
    """Homotopy in the compliance E of joints: W + E is regular, and the larger E, the farther Newton's method reaches.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : steps of Newton's method in all, of which each takes its share of what is left
    factors : on the compliance of joints, in turn [-]
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 150
    factors: tuple[float, ...] = (100.0,)

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; return the last iterate of the joints asked for, or of the hardest that were solved."""
        count, others = 0, len(self.factors)
        for k, operator in enumerate(_softened(problem.delassus, self.factors)):
            most = int(np.ceil((self.max_iterations - count) / (others + 1 - k)))
            newton = Newton(self.tolerance, self.velocity_tolerance, most)
            solution = newton(replace(problem, delassus=operator), start)
            count += solution.iterations
            # the softest lead on even where they are not quite solved
            if solution.converged or k == 0:
                start = ContactStart(solution.impulse, solution.velocity)
            # where joints are not solved, harder ones are not either
            if count >= self.max_iterations or not (solution.converged or k == 0):
                break
        if solution.converged and operator is problem.delassus:
            return replace(solution, iterations=count)
        return ContactSolution(start.impulse, start.velocity, count, float("inf"), False)


def _softened(operator: Delassus, factors: tuple[float, ...]) -> Iterator[Delassus]:
    """Yield the operator with softer joints, ever harder, and as it is; rigid joints yield next to nothing at first."""
    inner, compliance = operator, np.full(operator.diagonal.shape[:2], HELD * operator.scale)
    if isinstance(operator, CompliantDelassus):
        inner, compliance = operator.inner, operator.joint_compliance
    for factor in factors:
        yield CompliantDelassus(inner, factor * compliance)
    yield operator
