"""How well a contact problem is solved: the natural map, computed outside the solvers."""

import numpy as np
from numpy.typing import NDArray

from mechanics.problem import ContactProblem
from mechanics.solvers._kernels import apply_delassus

__all__ = ["dual_velocity", "natural_map", "project_on_cone"]

Array = NDArray[np.float64]


def dual_velocity(problem: ContactProblem, impulse: Array) -> Array:
    """û = W r + u_free + (bias + μ‖u_T‖) n (nc, 3), local frame [m/s]."""
    u, _, _ = apply_delassus(impulse, *problem.delassus.arrays)
    velocity: Array = u + problem.u_free
    velocity[:, 0] += problem.bias + problem.friction * np.linalg.norm(velocity[:, 1:], axis=1)
    return velocity


def natural_map(problem: ContactProblem, impulse: Array) -> float:
    """η = ‖r - P_K(r - ρ û)‖ / ‖r‖ with û = u + (bias + μ‖u_T‖) n and ρ = 1 / (mean diagonal of W).

    The de Saxcé form of Signorini–Coulomb (de Saxcé & Feng 1991; docs/theory.md §4); independent of units. Zero
    without contacts; where no impulse is given but one is needed, the size of P_K(-ρ û) replaces ‖r‖, so η is 1.
    """
    if len(impulse) == 0:
        return 0.0
    rho = 1.0 / problem.delassus.scale
    projected = project_on_cone(impulse - rho * dual_velocity(problem, impulse), problem.friction)
    scale = max(float(np.linalg.norm(impulse)), float(np.linalg.norm(projected)))
    return float(np.linalg.norm(impulse - projected)) / scale if scale > 0 else 0.0


def project_on_cone(point: Array, friction: Array) -> Array:
    """Nearest points (nc, 3) of Coulomb's cones ‖r_T‖ ≤ μ r_N."""
    n, size = point[:, 0], np.linalg.norm(point[:, 1:], axis=1)
    inside = size <= friction * n
    below = friction * size <= -n
    height = (n + friction * size) / (1.0 + friction**2)
    shrink = np.where(size > 0, friction * height / np.where(size > 0, size, 1.0), 0.0)
    on_cone = np.column_stack([height, point[:, 1] * shrink, point[:, 2] * shrink])
    result: Array = np.where(inside[:, None], point, np.where(below[:, None], 0.0, on_cone))
    return result
