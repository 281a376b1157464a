"""Strategy for deformable stones among many rigid ones: first as if all were rigid, then Newton's method."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array
from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.strategies.compliant import Compliant, polished

__all__ = ["RigidFirst"]

# times that both are made, each from the best impulses so far
_ROUNDS = 2
# steps of Newton's method in each
_NEWTON_STEPS = 30
# tolerances of Newton's method over those asked for, of joints that yield, and of rigid ones, whose W is singular [-]
_FURTHER, _RIGID_FURTHER = 1e-3, 0.1
# η from which Newton's method goes on from the impulses of the last step [-]
_NEAR = 1e-3
# tolerances of the stones as rigid ones over those asked for [-]
_ROUGH = 100.0


@dataclass(frozen=True)
class RigidFirst:
    """Rigid stones whose joints yield by what the deformable ones yield right there, then Newton's method for W itself.

    W = W_r + W_e, that of rigid stones and what they yield. With only the diagonal D of W_e, and what the others yield
    taken from the impulses r of the last round,

        u = (W_r + D) r̂ + (u_free + (W_e - D) r)

    is a problem between rigid stones, whose factors cost a fiftieth and which methods for many bodies solve from nothing.
    It shows what opens, slides and sticks. Newton's method ends it; its equations have such factors, too.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : of each part
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`.

        Raises
        ------
        SolverError : if W is not that of bodies
        """
        limits = self.tolerance, self.velocity_tolerance
        left = residual(problem, start.impulse)
        best = ContactSolution(
            start.impulse, left.dual, 0, left.natural_map, left.within(*limits), "nothing: it is solved"
        )
        yields = problem.delassus.joint_compliance is not None
        count, near = 0, bool(start.impulse.any()) and left.natural_map <= _NEAR
        for _ in range(_ROUNDS):
            if best.converged:
                break
            begin = ContactStart(best.impulse, best.velocity)
            if not near:
                found = self._as_rigid(problem, begin)
                begin, count = ContactStart(found.impulse, found.velocity), count + found.iterations
            near = False
            most = min(_NEWTON_STEPS, self.max_iterations)
            found = polished(problem, begin, limits, most, _FURTHER if yields else _RIGID_FURTHER)
            count += found.iterations
            if found.converged or found.natural_map < best.natural_map:
                best = replace(found, why="Newton: stones as rigid ones first")
        return replace(best, iterations=count)

    def _as_rigid(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Return the solution of the stones as rigid ones."""
        operator = problem.delassus
        rigid = operator.as_rigid
        assert rigid is not None
        yielding: Array = np.maximum(np.einsum("cii->ci", operator.diagonal - rigid.diagonal), 0.0)
        simple = CompliantDelassus(rigid, yielding)
        late = operator.apply(start.impulse) - simple.apply(start.impulse)
        solver = Compliant(_ROUGH * self.tolerance, _ROUGH * self.velocity_tolerance, self.max_iterations)
        return solver(replace(problem, delassus=simple, u_free=problem.u_free + late), start)
