"""Newton's method on the natural map (Alart & Curnier 1991; Acary, Brémond & Huber 2018, §4.3)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanics.problem import ContactProblem, ContactSolution, ContactStart, scale_of
from mechanics.residual import Residual, project_on_cone, residual
from mechanics.solvers.shifted_systems import ShiftedSystem, shifted_system
from moma.errors import SolverError

__all__ = ["Newton", "projection_derivative"]

Array = NDArray[np.float64]

# keeps D invertible where a contact is open, and 1 - D where it sticks, as between rigid stones W is singular
_SOFT, _GIVE = 1e-7, 1e-9
# shortest fraction of a step, and what a step must gain over what it promises
_SHORTEST, _GAIN = 0.02, 0.1
# how many steps that gain nothing are taken all the same
_DARING = 2


@dataclass(frozen=True)
class Newton:
    """Solves Φ(r) = r - P_K(r - ρ û(r)) = 0 from a start that is nearly right.

    With D the derivative of the projection P_K and S that of û by u, each step solves

        [ W + Θ ] Δr = -(ρ D S)⁻¹ Φ,     Θ = (ρ D S)⁻¹ (1 - D)

    so contacts that stick, slip or are open are told apart by themselves, and once they are right it converges within a
    few steps to rounding. Far from a solution it may go astray; then the best iterate is given back.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : steps after which it is given up
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 12

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`.

        Raises
        ------
        SolverError : if the problem has no form that can be factorised
        """
        system, limits = shifted_system(problem, "Newton"), (self.tolerance, self.velocity_tolerance)
        # not put on the cones first: that would break the balance, by which they are told apart
        impulse = start.impulse
        left, count, daring = residual(problem, impulse), 0, 0
        best = left, impulse
        while not left.within(*limits) and count < self.max_iterations and daring <= _DARING:
            count += 1
            try:
                step = _step(problem, system, impulse)
            except SolverError:
                # singular, far from a solution: the best so far has to do
                break
            found = _search(problem, impulse, left, step)
            if found is None:
                # the natural map has kinks: beyond one, a step that gains nothing at first may still lead on
                daring += 1
                found = impulse + step, residual(problem, impulse + step)
            impulse, left = found
            if left.natural_map < best[0].natural_map:
                best = left, impulse
        left, impulse = best
        return ContactSolution(impulse, left.dual, count, left.natural_map, left.within(*limits))


def _search(
    problem: ContactProblem, impulse: Array, left: Residual, step: Array
) -> tuple[Array, Residual] | None:
    """The first of ever shorter parts of a step that brings Φ down, and what is left there; None if none does."""
    size, length = np.linalg.norm(left.error), 1.0
    while length > _SHORTEST:
        new = impulse + length * step
        after = residual(problem, new)
        if np.linalg.norm(after.error) < (1.0 - _GAIN * length) * size:
            return new, after
        length *= 0.5
    return None


def _step(problem: ContactProblem, system: ShiftedSystem, r: Array) -> Array:
    scale, unit = scale_of(problem.delassus), np.eye(r.shape[1])
    u = problem.delassus.apply(r) + problem.u_free
    slide = np.sqrt((u[:, 1:] ** 2).sum(axis=1))
    dual = u.copy()
    dual[:, 0] += problem.bias + problem.friction * slide
    point = r - dual / scale
    error = r - project_on_cone(point, problem.friction, problem.cohesion)
    derivative = projection_derivative(point, problem.friction, problem.cohesion)
    derivative = (1.0 - _SOFT - _GIVE) * derivative + _SOFT * unit
    turn = np.tile(unit, (len(r), 1, 1))
    turn[:, 0, 1:] = (problem.friction / np.maximum(slide, 1e-300))[:, None] * u[:, 1:]
    inverse = scale * np.linalg.inv(derivative @ turn)
    solve = system(inverse @ (unit - derivative))
    step: Array = solve(-np.einsum("cij,cj->ci", inverse, error).ravel()).reshape(r.shape)
    return step


def projection_derivative(point: Array, friction: Array, cohesion: Array) -> Array:
    """An element (nc, d, d) of the derivative of the projection on {r_N ≥ 0, ‖r_T‖ ≤ μ r_N + k}."""
    n, size, d = point[:, 0], np.sqrt((point[:, 1:] ** 2).sum(axis=1)), point.shape[1]
    along = point[:, 1:] / np.maximum(size, 1e-300)[:, None]
    across = np.eye(along.shape[1]) - along[:, :, None] * along[:, None, :]
    foot = (n + friction * (size - cohesion)) / (1.0 + friction**2)
    inside = (n >= 0) & (size <= friction * n + cohesion)
    below = ~inside & (n < 0) & (size <= cohesion)
    sliding = ~inside & ~below & (foot > 0)
    edge = ~inside & ~below & ~sliding & (cohesion > 0)
    result = np.zeros((len(point), d, d))
    result[inside] = np.eye(d)
    result[below, 1:, 1:] = np.eye(d - 1)
    height = np.where(sliding, foot, 0.0)
    shrink = (friction * height + cohesion) / np.maximum(size, 1e-300)
    result[edge, 1:, 1:] = shrink[edge, None, None] * across[edge]
    # the foot moves with the point by gradient, along the generator (1, μ t)
    generator = np.column_stack([np.ones(len(point)), friction[:, None] * along])
    slope = generator[:, :, None] * generator[:, None, :] / (1.0 + friction**2)[:, None, None]
    slope[:, 1:, 1:] += shrink[:, None, None] * across
    result[sliding] = slope[sliding]
    return result
