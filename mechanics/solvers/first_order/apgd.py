"""Accelerated projected gradients (Nesterov 1983; Mazhar et al. 2015; Heyn et al. 2013).

With the de Saxcé shift s = μ‖u_T‖ the laws say that r minimises ½ rᵀ W r + (u_free + (bias + s) n)ᵀ r over its cones.
One product with W makes one iteration,

    r ← P_K(y - D⁻¹ (W y + u_free + (bias + s) n) / L),   y ← r + β (r - r_before)

with D the mean of each contact's own diagonal, L found by trial (Rayleigh's quotient of W along the step says at once
whether it was large enough), β after Nesterov, and a new start where the step turns against the gradient. The shift is
renewed in each iteration: held until the inner programme is solved it takes three to ten times as many.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, scale_of
from mechanics.problem.residual import project_on_cone, residual
from mechanics.solvers._kernels.apgd import curvature, momentum, project_step

__all__ = ["APGD"]


# by how much L grows where it was too small, at least, and by how much it forgets in each iteration
_GROWTH, _FORGETTING = 2.0, 0.97
# by how much rounding may pass L
_SLACK = 1.0 + 1e-9
# of the mean diagonal of W: the smallest metric of a contact, so that one that nothing moves is left alone
_LEAST = 1e-12


@dataclass(frozen=True)
class APGD:
    """Iterates until η ≤ tolerance; needs nothing of W but its products, its diagonal blocks and its own memory.

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    velocity_tolerance : and the largest velocity by which a contact may break its law, over that of u_free [-]
    max_iterations : iterations, each of one product with W and now and then one more, after which it is given up
    check_every : iterations between two looks at η
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    check_every: int = 10

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`; the best of all looks is given back."""
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
    """The iterates of one solution."""

    def __init__(self, problem: ContactProblem, start: ContactStart) -> None:
        self._problem = problem
        self._shift = problem.biased
        own = problem.delassus.diagonal
        mean = np.einsum("cii->c", own) / own.shape[1]
        self._weight = np.maximum(mean, _LEAST * scale_of(problem.delassus))
        self._r = project_on_cone(start.impulse, problem.friction, problem.cohesion)
        self._wr = problem.delassus.apply(self._r)
        self._y, self._wy = self._r.copy(), self._wr.copy()
        self._new = np.empty_like(self._r)
        tangential = self._wr[:, 1:] + problem.u_free[:, 1:]
        self._slide = problem.friction * np.sqrt((tangential**2).sum(axis=1))
        self._steepness, self._theta = 1.0, 1.0

    @property
    def impulse(self) -> Array:
        """r (nc, d), in its cones [N s]; overwritten by the next iterations."""
        return self._r

    def iterate(self, count: int) -> None:
        """So many steps."""
        problem, weight = self._problem, self._weight
        for _ in range(count):
            product = self._step()
            self._theta = momentum(
                self._new, self._r, product, self._wr, self._y, self._wy,
                problem.u_free, problem.friction, weight, self._theta, self._slide,
            )  # fmt: skip
            self._r, self._new, self._wr = self._new, self._r, product
            self._steepness *= _FORGETTING

    def _step(self) -> Array:
        """Take `new` from y by a step that is short enough; W new is given back."""
        problem, weight = self._problem, self._weight
        while True:
            project_step(
                self._y, self._wy, self._shift, self._slide, problem.friction, problem.cohesion,
                weight, 1.0 / self._steepness, self._new,
            )  # fmt: skip
            product = problem.delassus.apply(self._new)
            seen = float(curvature(self._new, self._y, product, self._wy, weight))
            # what is not a number is left to the residual
            if not seen > self._steepness * _SLACK:
                return product
            self._steepness = max(_GROWTH * self._steepness, seen)
