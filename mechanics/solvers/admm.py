"""ADMM on the sparse system (Boyd et al. 2011; Tasora et al. 2021; Acary, Brémond & Huber 2018).

Splits r = z: r minimises the quadratic part, z lies in the Coulomb cone. With the scaled dual y and penalty σ,

    r ← (W + σ)⁻¹ [σ (z - y) - u_free - bias - s n],   z ← P_K(r + y),   y ← y + r - z,   s = μ‖u_T‖

where r is over-relaxed, and the de Saxcé shift s, taken from û = -σ y each time, makes the friction Coulomb's own and
not the convex, associated one. By the Woodbury identity W + σ is solved through the sparse, positive definite
ŵ⁻¹ + H Hᵀ/σ, factorised once as long as the contacts persist. So the motion of whole stones, which holds Gauss–Seidel
back, is solved for exactly; only the elastic compliance decides how fast the iteration converges.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.problem import ContactProblem, ContactSolution, ContactStart, scale_of
from mechanics.residual import natural_map, project_on_cone
from moma.errors import SolverError

__all__ = ["ADMM"]

_OVER_RELAXATION = 1.6
# σ over the mean diagonal of W: larger values leave gaps for long, smaller ones lose friction in the first steps
_PENALTY = 0.1


@dataclass(frozen=True)
class ADMM:
    """Iterates until η ≤ tolerance; for scenes with deformable bodies.

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    max_iterations : iterations after which it is given up
    check_every : iterations between two looks at η
    """

    tolerance: float = 1e-6
    max_iterations: int = 2000
    check_every: int = 10

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; its velocity, û = -σ y, lets the iteration go on where it stopped.

        Raises
        ------
        SolverError : if the problem carries no sparse form
        """
        if problem.sparse is None:
            raise SolverError("the problem has no sparse form", where="ADMM", remedy='use the method "nsgs"')
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        lift, sigma = problem.sparse.lift, _PENALTY * scale_of(problem.delassus)
        mu, cohesion = problem.friction, problem.cohesion
        factor, across = problem.sparse.factor(sigma), lift.T.tocsr()
        shifted = problem.u_free.copy()
        shifted[:, 0] += problem.bias
        z, y = project_on_cone(start.impulse, mu, cohesion), -start.velocity / sigma
        eta, iterations = natural_map(problem, z), 0
        while eta > self.tolerance and iterations < self.max_iterations:
            for _ in range(min(self.check_every, self.max_iterations - iterations)):
                right = sigma * (z - y) - shifted
                right[:, 0] -= mu * sigma * np.linalg.norm(y[:, 1:], axis=1)
                inner = factor.solve(lift @ (right.ravel() / sigma))
                r = ((right.ravel() - across @ inner) / sigma).reshape(-1, 3)
                relaxed = _OVER_RELAXATION * r + (1 - _OVER_RELAXATION) * z
                z = project_on_cone(relaxed + y, mu, cohesion)
                y = y + relaxed - z
                iterations += 1
            eta = natural_map(problem, z)
        return ContactSolution(z, -sigma * y, iterations, eta, eta <= self.tolerance)
