"""Deformable stones among many rigid ones, solved as rigid ones whose joints yield."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from ground.errors import SolverError
from mechanics.delassus.compliant import simplified
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.solvers.first_order.body_admm import BodyADMM


@dataclass(frozen=True)
class StonesAsRigid:
    """Body ADMM on the rigid stones, their joints yielding by what the deformable ones yield right there.

    W = W_r + W_e, that of rigid stones and what they yield. With only the diagonal D of W_e, and what the others yield
    taken from the impulses r of the start,

        u = (W_r + D) r̂ + (u_free + (W_e - D) r)

    is a problem between rigid stones, whose factors cost a fiftieth. It shows what opens, slides and sticks.

    Attributes
    ----------
    tolerance, velocity_tolerance, max_iterations : as in `BodyADMM`
    rigid : method for rigid stones
    """

    tolerance: float
    velocity_tolerance: float
    max_iterations: int
    rigid: Callable[[float, float, int], BodyADMM] = BodyADMM

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`.

        Raises
        ------
        SolverError : if W is not that of bodies of which some deform
        """
        operator = problem.delassus
        simple = simplified(operator)
        if simple is None:
            raise SolverError("no body deforms", where="stones as rigid ones", remedy='use the method "auto"')
        late = operator.apply(start.impulse) - simple.apply(start.impulse)
        stones = replace(problem, delassus=simple, u_free=problem.u_free + late)
        solver = self.rigid(self.tolerance, self.velocity_tolerance, self.max_iterations)
        return solver(stones, start)
