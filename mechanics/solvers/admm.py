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
from mechanics.residual import project_on_cone, residual
from mechanics.solvers._kernels import admm_right_side, admm_update
from moma.errors import SolverError

__all__ = ["ADMM"]

_OVER_RELAXATION = 1.6


@dataclass(frozen=True)
class ADMM:
    """Iterates until η ≤ tolerance.

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    velocity_tolerance : and the largest velocity by which a contact may break its law, over that of u_free [-]
    max_iterations : iterations after which it is given up
    penalty : σ over the mean diagonal of W; where all that touches stays in touch, the smaller the faster; larger
        values bear with contacts that open and slide [-]
    check_every : iterations between two looks at η
    patience : give up after a look that finds η less than this many times smaller than two looks before; 0: never
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-4
    max_iterations: int = 2000
    penalty: float = 0.1
    check_every: int = 10
    patience: float = 0.0

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; its velocity, û = -σ y, lets the iteration go on where it stopped.

        The best of all looks is given back.

        Raises
        ------
        SolverError : if the problem carries no sparse form
        """
        if problem.sparse is None:
            raise SolverError("the problem has no sparse form", where="ADMM", remedy='use the method "nsgs"')
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        form, sigma = problem.sparse(), self.penalty * scale_of(problem.delassus)
        lift, across, factor = form.lift, form.across, form.factor(sigma)
        mu, cohesion = problem.friction, problem.cohesion
        shifted = problem.u_free.copy()
        shifted[:, 0] += problem.bias
        z, y = project_on_cone(start.impulse, mu, cohesion), -start.velocity / sigma
        right = np.empty_like(shifted)
        left, iterations = residual(problem, z), 0
        looks, best = [np.inf, np.inf], (left, z.copy(), y.copy())
        limits = self.tolerance, self.velocity_tolerance
        while not left.within(*limits) and iterations < self.max_iterations:
            if looks[-2] < self.patience * left.natural_map:
                break
            looks.append(left.natural_map)
            for _ in range(min(self.check_every, self.max_iterations - iterations)):
                admm_right_side(z, y, shifted, mu, sigma, right)
                inner = factor.solve(lift @ right.ravel())
                r = right - (across @ inner).reshape(right.shape) / sigma
                admm_update(r, z, y, mu, cohesion, _OVER_RELAXATION)
                iterations += 1
            left = residual(problem, z)
            if left.natural_map <= best[0].natural_map:
                best = left, z.copy(), y.copy()
        if not left.within(*limits):
            left, z, y = best
        return ContactSolution(z, -sigma * y, iterations, left.natural_map, left.within(*limits))
