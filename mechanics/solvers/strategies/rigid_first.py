"""Strategy for deformable stones among many rigid ones: first as if all were rigid, then Newton's method."""

from dataclasses import dataclass, replace

from mechanics.delassus.compliant import simplified
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.first_order.body_admm import BodyADMM
from mechanics.solvers.second_order.proximal_newton import polished
from mechanics.solvers.strategies.rigid import FROM_NOTHING
from moma.errors import SolverError

__all__ = ["RigidFirst"]

# ways to begin, as `why` tells them; the second is gone twice, from the best impulses so far
_WARM, _COLD = "warm start", "stones as rigid ones first"
# steps of Newton's method in each
_STEPS = 30
# η from which Newton's method goes on from the impulses of the last step [-]
_NEAR = 1e-3
# tolerances of the stones as rigid ones over those asked for [-], and the penalties with which they are solved, three
# times by what contacts have come to do
_ROUGH = 100.0
_STAGES = (*FROM_NOTHING, FROM_NOTHING[-1], FROM_NOTHING[-1])


@dataclass(frozen=True)
class RigidFirst:
    """Rigid stones whose joints yield by what the deformable ones yield right there, then Newton's method for W itself.

    W = W_r + W_e, that of rigid stones and what they yield. With only the diagonal D of W_e, and what the others yield
    taken from the impulses r of the last round,

        u = (W_r + D) r̂ + (u_free + (W_e - D) r)

    is a problem between rigid stones, whose factors cost a fiftieth, and which ADMM on their velocities solves from
    nothing. It shows what opens, slides and sticks. Newton's method ends it; its equations have such factors, too.
    Joints must yield: where stones touch in more points than they need, W is singular, and Newton's method goes astray.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : of ADMM and of Newton's method, each time
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`.

        Raises
        ------
        SolverError : if W is not that of bodies of which some deform
        """
        limits = self.tolerance, self.velocity_tolerance
        left = residual(problem, start.impulse)
        best = ContactSolution(start.impulse, left.dual, 0, left.natural_map, left.within(*limits), _WARM)
        near, count = bool(start.impulse.any()) and left.natural_map <= _NEAR, 0
        for way in (_WARM if near else _COLD, _COLD):
            if best.converged:
                break
            begin = best if way == _WARM else self._as_rigid(problem, best)
            start = ContactStart(begin.impulse, begin.velocity)
            found = polished(problem, start, limits, min(_STEPS, self.max_iterations))
            count += begin.iterations + found.iterations
            if found.converged or found.natural_map < best.natural_map:
                best = replace(found, why=f"Newton: {way}")
            elif way == _COLD:
                # another time it would be the same
                break
        return replace(best, iterations=count)

    def _as_rigid(self, problem: ContactProblem, begin: ContactSolution) -> ContactSolution:
        """Return the solution of the stones as rigid ones."""
        operator = problem.delassus
        simple = simplified(operator)
        if simple is None:
            raise SolverError(
                "W is not that of bodies of which some deform",
                where="stones as rigid ones",
                remedy='use "auto"',
            )
        late = operator.apply(begin.impulse) - simple.apply(begin.impulse)
        stones = replace(problem, delassus=simple, u_free=problem.u_free + late)
        limits = _ROUGH * self.tolerance, _ROUGH * self.velocity_tolerance
        solver = BodyADMM(*limits, self.max_iterations, _STAGES)
        return solver(stones, ContactStart(begin.impulse, begin.velocity))
