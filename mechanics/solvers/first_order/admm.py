"""ADMM on the sparse system of bodies (Boyd et al. 2011; Tasora et al. 2021; Acary, Brémond & Huber 2018).

Splits r = z: r minimises the quadratic part, z lies in the Coulomb cone. With the scaled dual y and penalty σ,

    r ← (W + σ)⁻¹ [σ (z - y) - u_free - bias - s n],   z ← P_K(r + y),   y ← y + r - z,   s = μ‖u_T‖

where r is over-relaxed, and the de Saxcé shift s, taken from û = -σ y now and then, makes the friction Coulomb's own
and not the convex, associated one. By the Woodbury identity W + σ is solved through the sparse, positive definite
ŵ⁻¹ + H Hᵀ/σ, factorised once as long as the contacts persist. So the motion of whole stones, which holds Gauss–Seidel
back, is solved for exactly; only the elastic compliance decides how fast the iteration converges.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.problem._kernels import admm_right_side, admm_update
from mechanics.problem.forms import Form
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import project_on_cone, residual

__all__ = ["ADMM"]


# looks between two balances of the penalty
_BALANCE_LOOKS = 2
# factor below which a change of the penalty does not pay for another factorisation
_LEAST_CHANGE = 2.0
# largest change of the penalty at a time
_MOST_CHANGE = 5.0
# bounds of the penalty over the scale of W [-]
_BOUNDS = (1e-4, 1.0)


@dataclass(frozen=True)
class ADMM:
    """Alternating directions until η ≤ tolerance.

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    velocity_tolerance : and the largest velocity by which a contact may break its law, over that of u_free [-]
    max_iterations : limit of the iterations
    penalty : σ over the mean diagonal of W; where all that touches stays in touch, the smaller the faster; larger
        values bear with contacts that open and slide [-]
    check_every : iterations between two looks at η
    patience : stop after a look that finds η less than this many times smaller than two looks before; 0: never
    hold : iterations for which the de Saxcé shift is held; held longer, it is steadier where much slides
    balanced : let the penalty follow the ratio of dual and primal residual (He, Yang & Wang 2000)
    over_relaxation : by how much r overshoots; 1: not at all, where a small penalty finds r nearly at once and an
        overshoot is what is left
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    penalty: float = 0.1
    check_every: int = 10
    patience: float = 0.0
    hold: int = 1
    balanced: bool = False
    over_relaxation: float = 1.6

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`, whose velocity û = -σ y lets the iteration continue where it stopped.

        Returns the best of all looks.

        Raises
        ------
        SolverError : if W is known by its products alone
        """
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        limits = self.tolerance, self.velocity_tolerance
        impulse = project_on_cone(start.impulse, problem.friction, problem.cohesion)
        left, looks = residual(problem, impulse), [np.inf, np.inf]
        if left.within(*limits):
            # a solution costs no factorisation
            return ContactSolution(impulse, start.velocity, 0, left.natural_map, True)
        run = _Run(problem, problem.form("ADMM"), start, self)
        best = left, run.z.copy(), run.velocity
        while not left.within(*limits) and run.iterations < self.max_iterations:
            if looks[-2] < self.patience * left.natural_map:
                break
            looks.append(left.natural_map)
            run.iterate(min(self.check_every, self.max_iterations - run.iterations))
            left = residual(problem, run.z)
            if left.natural_map <= best[0].natural_map:
                best = left, run.z.copy(), run.velocity
            if self.balanced and len(looks) % _BALANCE_LOOKS == 0:
                run.balance()
        if left.within(*limits):
            return ContactSolution(run.z, run.velocity, run.iterations, left.natural_map, True)
        left, impulse, velocity = best
        return ContactSolution(impulse, velocity, run.iterations, left.natural_map, left.within(*limits))


class _Run:
    """Iterates of one solution."""

    def __init__(self, problem: ContactProblem, form: Form, start: ContactStart, settings: ADMM) -> None:
        self._problem, self._form, self._settings = problem, form, settings
        self._shift, self._scale = problem.biased, problem.delassus.scale
        self._sigma = sigma = settings.penalty * self._scale
        self._relaxed = form.relaxed(sigma)
        self.z = project_on_cone(start.impulse, problem.friction, problem.cohesion)
        self._y = -start.velocity / sigma
        self._lag = np.zeros(len(self.z))
        self._r, self._last, self._right = self.z, self.z, np.empty_like(self.z)
        self.iterations = 0

    @property
    def velocity(self) -> Array:
        """û = -σ y (nc, d) [m/s]."""
        return -self._sigma * self._y

    def iterate(self, count: int) -> None:
        """Update r, z and y `count` times."""
        problem, sigma, over = self._problem, self._sigma, self._settings.over_relaxation
        for _ in range(count):
            if self.iterations % self._settings.hold == 0:
                self._lag = problem.friction * np.sqrt((self._y[:, 1:] ** 2).sum(axis=1))
            admm_right_side(self.z, self._y, self._shift, self._lag, sigma, self._right)
            self._r = self._relaxed(self._right.ravel()).reshape(self._right.shape)
            self._last = self.z.copy()
            admm_update(self._r, self.z, self._y, problem.friction, problem.cohesion, over)
            self.iterations += 1

    def balance(self) -> None:
        """Adapt σ to the ratio of the residuals."""
        tiny, sigma = 1e-300, self._sigma
        primal = _norm(self._r - self.z) / max(_norm(self.z), tiny)
        dual = sigma * _norm(self.z - self._last) / max(sigma * _norm(self._y), _norm(self._shift), tiny)
        factor = float(np.clip(np.sqrt(dual / max(primal, tiny)), 1.0 / _MOST_CHANGE, _MOST_CHANGE))
        if 1.0 / _LEAST_CHANGE <= factor <= _LEAST_CHANGE:
            return
        new = float(np.clip(sigma / factor, _BOUNDS[0] * self._scale, _BOUNDS[1] * self._scale))
        self._y *= sigma / new
        self._lag *= sigma / new
        self._sigma, self._relaxed = new, self._form.relaxed(new)


def _norm(values: Array) -> float:
    return float(np.sqrt((values**2).sum()))
