"""Accelerated projected gradients (Nesterov 1983; Mazhar et al. 2015; Heyn et al. 2013).

With the de Saxcé shift s = μ‖u_T‖ the laws say that r minimises ½ rᵀ W r + (u_free + (bias + s) n)ᵀ r over its cones.
One product with W makes one iteration,

    r ← P_K(y - D⁻¹ (W y + u_free + (bias + s) n) / L),   y ← r + β (r - r_before)

with D the mean of each contact's own diagonal, L found by trial (Rayleigh's quotient of W along the step says at once
whether it was large enough), β after Nesterov, and a new start where the step turns against the gradient. The shift is
renewed in each iteration: held until the inner programme is solved, it would take three to ten times as many.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import project_on_cone, residual
from mechanics.solvers._kernels.apgd import Pair, Terms, curvature, momentum, project_step

__all__ = ["APGD"]


# smallest growth of L where it was too small [-]
_GROWTH = 2.0
# decay of L in each iteration [-]
_FORGETTING = 0.97
# curvature over L that rounding alone explains [-]
_SLACK = 1.0 + 1e-9
# smallest metric of a contact over the scale of W, so that a contact that nothing moves stays as it is [-]
_LEAST = 1e-12


@dataclass(frozen=True)
class APGD:
    """Accelerated projected gradients until η ≤ tolerance; W is needed by its products and diagonal blocks alone.

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    velocity_tolerance : and the largest velocity by which a contact may break its law, over that of u_free [-]
    max_iterations : iterations, each of one product with W and now and then one more, at most
    check_every : iterations between two looks at η
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    check_every: int = 10

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`; return the best of all looks."""
        limits = self.tolerance, self.velocity_tolerance
        left = residual(problem, start.impulse)
        if left.within(*limits):
            return ContactSolution(start.impulse, left.dual, 0, left.natural_map, True)
        run = _Run(problem, start)
        left = residual(problem, run.impulse)
        best, iterations = (run.impulse.copy(), left), 0
        while not left.within(*limits) and iterations < self.max_iterations:
            count = min(self.check_every, self.max_iterations - iterations)
            run.iterate(count)
            iterations += count
            left = residual(problem, run.impulse)
            if left.natural_map <= best[1].natural_map:
                best = run.impulse.copy(), left
        impulse, left = (run.impulse, left) if left.within(*limits) else best
        return ContactSolution(impulse, left.dual, iterations, left.natural_map, left.within(*limits))


class _Run:
    """Iterates of one solution."""

    def __init__(self, problem: ContactProblem, start: ContactStart) -> None:
        self._problem = problem
        own = problem.delassus.diagonal
        mean = np.einsum("cii->c", own) / own.shape[1]
        self._weight = np.maximum(mean, _LEAST * problem.delassus.scale)
        self._r = project_on_cone(start.impulse, problem.friction, problem.cohesion)
        wr = problem.delassus.apply(self._r)
        self._last, self._ahead = Pair(self._r, wr), Pair(self._r.copy(), wr.copy())
        self._new = np.empty_like(self._r)
        tangential = wr[:, 1:] + problem.u_free[:, 1:]
        self._slide = problem.friction * np.sqrt((tangential**2).sum(axis=1))
        self._terms = Terms(problem.biased, problem.u_free, problem.friction, problem.cohesion, self._weight)
        self._steepness, self._theta = 1.0, 1.0

    @property
    def impulse(self) -> Array:
        """r (nc, d), in its cones [N s]; overwritten by the next iterations."""
        return self._last.impulse

    def iterate(self, count: int) -> None:
        """Make `count` steps."""
        for _ in range(count):
            new = self._step()
            self._theta = momentum(new, self._last, self._ahead, self._terms, self._theta, self._slide)
            self._new, self._last = self._last.impulse, new
            self._steepness *= _FORGETTING

    def _step(self) -> Pair:
        """Return the next iterate, from y by a step that is short enough."""
        while True:
            project_step(self._ahead, self._slide, 1.0 / self._steepness, self._terms, self._new)
            new = Pair(self._new, self._problem.delassus.apply(self._new))
            seen = float(curvature(new, self._ahead, self._weight))
            # what is not a number is left to the residual
            if not seen > self._steepness * _SLACK:
                return new
            self._steepness = max(_GROWTH * self._steepness, seen)
