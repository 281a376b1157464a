"""Residual of a contact problem: the natural map, computed outside the solvers."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.problem._kernels import natural_errors
from mechanics.problem.problem import ContactProblem

# smallest impulse that counts, over the one that would stop the fastest contact [-]
_NOTHING = 1e-8
_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Residual:
    """Residual of a contact problem.

    Attributes
    ----------
    natural_map : η [-]
    velocity : largest velocity by which a contact breaks its law, or that rounding hides, over the largest of u_free;
        over that of the bias where u_free is zero [-]
    error : (nc,) ‖e_α‖ of each contact [N s]
    dual : (nc, d) û, the velocity that is dual to r [m/s]
    """

    natural_map: float
    velocity: float
    error: Array
    dual: Array

    def within(self, tolerance: float, velocity_tolerance: float) -> bool:
        """Return whether both measures are within their tolerances."""
        return self.natural_map <= tolerance and self.velocity <= velocity_tolerance


def residual(problem: ContactProblem, impulse: Array) -> Residual:
    """Compute η = ‖e‖ / ‖r‖, e = r - P_K(r - ρ û), û = u + (bias + μ‖u_T‖) n and ρ = 1 / (mean diagonal of W).

    The de Saxcé form of Signorini–Coulomb (de Saxcé & Feng 1991; docs/theory.md §4), whatever the units. With adhesion
    ‖r‖ is that of the real impulses, without the shift. Zero without contacts. Where no impulse is given but one is
    needed, the size of P_K(-ρ û) replaces ‖r‖, so η is 1; where none is needed, rounding counts against 10⁻⁸ of the
    impulse that would stop the fastest u_free. Where contacts contradict each other impulses grow without bound, and η
    falls with them; the velocity error then shows it, and where W r is so large that its rounding hides the velocities,
    that rounding counts as their error.
    """
    if len(impulse) == 0:
        return Residual(0.0, 0.0, np.zeros(0), np.zeros_like(impulse))
    rho = 1.0 / problem.delassus.scale
    impulse = np.ascontiguousarray(impulse)  # a kernel is compiled once more for views
    u = problem.delassus.apply(impulse)
    u += problem.u_free
    # writes û into u
    error, whole, largest, size, projected = natural_errors(
        impulse, u, problem.bias, problem.friction, problem.cohesion, rho
    )
    pace = float(np.abs(problem.u_free).max())
    if problem.adhesion is not None and problem.adhesion.any():
        # a strong bond shifts r by far more than it carries
        size = projected = float(
            np.sqrt(((impulse[:, 0] - problem.adhesion) ** 2).sum() + (impulse[:, 1:] ** 2).sum())
        )
    scale = max(size, projected, _NOTHING * rho * pace)
    return Residual(
        # NaN stays NaN, which is within no tolerance
        0.0 if scale == 0 else whole / scale,
        _broken_velocity(problem, impulse, largest / rho, pace),
        error,
        u,
    )


def _broken_velocity(problem: ContactProblem, impulse: Array, largest: float, pace: float) -> float:
    """Return the largest velocity that breaks a law [m/s], or its rounding, over the velocity to be stopped."""
    bias = float(np.abs(problem.bias).max())
    slowest = pace or bias
    if slowest == 0:
        return 0.0
    diagonal = problem.delassus.diagonal
    hidden = _EPSILON * float(diagonal.max()) * float(np.abs(impulse).max()) / max(pace, bias)
    if hidden > _NOTHING:
        # the maxima may come from different contacts
        velocity = np.einsum("cij,cj->ci", np.abs(diagonal), np.abs(impulse))
        hidden = _EPSILON * float(velocity.max()) / max(pace, bias)
    return max(largest / slowest, hidden)


def natural_map(problem: ContactProblem, impulse: Array) -> float:
    """Return η of `residual`."""
    return residual(problem, impulse).natural_map


def project_on_cone(point: Array, friction: Array, cohesion: Array) -> Array:
    """Return the nearest points (nc, d) of {r_N ≥ 0, ‖r_T‖ ≤ μ r_N + k}."""
    n, size = point[:, 0], np.linalg.norm(point[:, 1:], axis=1)
    foot = np.maximum((n + friction * (size - cohesion)) / (1.0 + friction**2), 0.0)
    inside = size <= friction * np.maximum(n, 0.0) + cohesion
    height = np.where(inside, np.maximum(n, 0.0), foot)
    radius = np.where(inside, size, friction * foot + cohesion)
    shrink = np.where(size > 0, radius / np.where(size > 0, size, 1.0), 0.0)
    result: Array = np.column_stack([height, point[:, 1:] * shrink[:, None]])
    return result
