"""Newton's method by way of softer joints: each solution leads to that of joints a little harder."""

from dataclasses import dataclass, replace

from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.solvers.second_order.newton import Newton
from moma.errors import SolverError

__all__ = ["SofterJoints"]

# factors on the compliance of joints
_FACTORS = (100.0, 30.0, 10.0, 3.0, 1.0)
# steps of Newton's method with each
_STEPS = 30


@dataclass(frozen=True)
class SofterJoints:
    """Homotopy in the compliance E of joints: W + E is regular, and the larger E, the farther Newton's method reaches.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : steps of Newton's method in all
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 150

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; return the last iterate of the joints asked for, or of the hardest that were solved.

        Raises
        ------
        SolverError : if the joints do not yield
        """
        operator = problem.delassus
        if not isinstance(operator, CompliantDelassus):
            raise SolverError("the joints are rigid", where="softer joints", remedy='use the method "auto"')
        count = 0
        for factor in _FACTORS:
            soft = CompliantDelassus(operator.inner, factor * operator.joint_compliance)
            most = min(_STEPS, self.max_iterations - count)
            newton = Newton(self.tolerance, self.velocity_tolerance, most)
            found = newton(replace(problem, delassus=soft), start)
            count += found.iterations
            # the softest lead on even where they are not quite solved
            if found.converged or factor == _FACTORS[0]:
                start = ContactStart(found.impulse, found.velocity)
            if count >= self.max_iterations:
                break
        if found.converged and factor == _FACTORS[-1]:
            return replace(found, iterations=count)
        return ContactSolution(start.impulse, start.velocity, count, float("inf"), False)
