"""ADMM on the sparse system (Boyd et al. 2011; Tasora et al. 2021; Acary, Brémond & Huber 2018).

Splits r = z: r minimises the quadratic part, z lies in the Coulomb cone. With the scaled dual y and penalty σ,

    r ← (W + σ)⁻¹ [σ (z - y) - u_free - bias - s n],   z ← P_K(r + y),   y ← y + r - z,   s = μ‖u_T‖

where r is over-relaxed, and the de Saxcé shift s, taken from u = -σ (r - z + y) - s n each time, makes the friction
Coulomb's own and not the convex, associated one. By the Woodbury identity W + σ is solved through the sparse,
positive definite ŵ⁻¹ + H Hᵀ/σ, factorised once as long as the contacts persist. So the motion of whole stones, which
holds Gauss–Seidel back, is solved for exactly; only the elastic compliance decides how fast the iteration converges.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanics.problem import ContactProblem, ContactSolution
from mechanics.residual import natural_map, project_on_cone, relative_velocity
from moma.errors import SolverError

__all__ = ["ADMM"]

Array = NDArray[np.float64]

_OVER_RELAXATION = 1.6
# σ over the elastic compliance of a contact; 1 to 10 were within 30 % of the best on an arch and a wall
_PENALTY = 3.0


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

    def __call__(self, problem: ContactProblem, start: Array) -> ContactSolution:
        """Solve from the impulses `start` (nc, 3).

        Raises
        ------
        SolverError : if the problem carries no sparse form
        """
        if problem.sparse is None:
            raise SolverError("the problem has no sparse form", where="ADMM", remedy='use the method "nsgs"')
        lift, sigma = problem.sparse.lift, _PENALTY * problem.sparse.softness
        factor = problem.sparse.factor(sigma)
        mu, shifted = problem.friction, problem.u_free.copy()
        shifted[:, 0] += problem.bias
        z, y, slip = self._start(problem, start, sigma)
        eta, iterations = natural_map(problem, z), 0
        while eta > self.tolerance and iterations < self.max_iterations:
            for _ in range(min(self.check_every, self.max_iterations - iterations)):
                right = sigma * (z - y) - shifted
                right[:, 0] -= slip
                inner = factor.solve(lift @ (right.ravel() / sigma))
                r = ((right.ravel() - lift.T @ inner) / sigma).reshape(-1, 3)
                slip = mu * sigma * np.linalg.norm((r - z + y)[:, 1:], axis=1)
                r = _OVER_RELAXATION * r + (1 - _OVER_RELAXATION) * z
                z = project_on_cone(r + y, mu)
                y = y + r - z
                iterations += 1
            eta = natural_map(problem, z)
        return ContactSolution(z, iterations, eta, eta <= self.tolerance)

    @staticmethod
    def _start(problem: ContactProblem, start: Array, sigma: float) -> tuple[Array, Array, Array]:
        """z in the cone, and y = -û/σ with û the nearest admissible velocity of `start`."""
        z = project_on_cone(start, problem.friction)
        u = relative_velocity(problem, z)
        slip = problem.friction * np.linalg.norm(u[:, 1:], axis=1)
        u[:, 0] += problem.bias + slip
        return z, (-u - project_on_cone(-u, problem.friction)) / sigma if z.any() else np.zeros_like(z), slip
