"""Newton's method on the natural map, with a proximal term (Alart & Curnier 1991; Acary, Brémond & Huber 2018)."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import Residual, project_on_cone, residual
from moma.errors import SolverError

__all__ = ["Newton", "projection_derivative"]


# part of 1 in D, which keeps it invertible where a contact is open [-]
_SOFT = 1e-7
# part of 1 in 1 - D, which keeps it invertible where a contact sticks, as W between rigid stones is singular [-]
_GIVE = 1e-9
# proximal term α over η and the scale of W [-]
_PROXIMAL = 0.3
# η below which α shrinks no more [-]
_FLOOR = 1e-8
# shortest part of a step [-]
_SHORTEST = 0.005
# gain that a step must bring, over what it promises [-]
_GAIN = 1e-4
# last iterates of which the worst is the one to beat
_MEMORY = 5
# steps without a gain that are taken all the same
_DARING = 10
# iterates in a row without a better η, after which it stops
_PATIENCE = 40
# η from which every step gains until rounding wins [-]
_SETTLED = 1e-5
# iterations in a row after which it has, each of an η that is no better than the best, nor larger than _NOISE times it
_ROUNDED, _NOISE = 4, 10.0
# change of the impulses within rounding [-], and change of η that it makes, over η, from which rounding is to blame:
# 1e-3 and more are measured where it is, 1e-11 where kinks are
_DIGITS, _HEARD = 1e-15, 1e-4
# η over the best so far that counts as better [-]
_BETTER = 0.7
# smallest diagonal of a contact over the scale of W [-]
_LEAST = 1e-12


@dataclass(frozen=True)
class Newton:
    """Newton's method for Φ(r) = r - P_K(r - ρ û(r)) = 0, with
    ρ = 1/(mean of the contact's own diagonal, or the scale of W where that is less than any of them).

    With D the derivative of the projection P_K and S that of û by u, each step solves

        [ W + Θ + α ] Δr = -(ρ D S)⁻¹ Φ,     Θ = (ρ D S)⁻¹ (1 - D)

    so contacts that stick, slip or are open sort themselves out, and once they are right it converges within a
    few steps to rounding. The proximal term α = 0.3 max(η, 10⁻⁸) W̄ (Levenberg 1944; Rockafellar 1976) makes the matrix
    regular where W is not, as between rigid stones with more contacts than freedoms; it shrinks with η, so
    convergence is all but quadratic. The line search wants less of Φ than the worst of the last five iterates had
    (Grippo, Lampariello & Lucidi 1986): Φ has kinks, and steps that are right may pass over them. The best iterate is
    given back.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : limit of the steps, each of one factorisation
    hopeless : η from which it gives up, as its steps would wander; if finite, it also stops near a solution once
        rounding keeps η from falling [-]
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 100
    hopeless: float = np.inf

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`.

        Raises
        ------
        SolverError : if W is known by its products alone
        """
        return self.ended(problem, start)[0]

    def ended(self, problem: ContactProblem, start: ContactStart) -> tuple[ContactSolution, bool]:
        """Solve from the impulses of `start`; return also whether rounding alone kept η from falling further.

        Raises
        ------
        SolverError : if W is known by its products alone
        """
        system, limits = problem.form("Newton").shifted, (self.tolerance, self.velocity_tolerance)
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True), False
        natural, daring, count, since, still = _Map(problem), 0, 0, 0, 0
        # the start is not projected on the cones: that would break the balance, which tells the states apart
        here, left = natural(start.impulse), residual(problem, start.impulse)
        best, merits = (left, start.impulse), deque([here.size], _MEMORY)
        rounded = False
        while not (left.within(*limits) or rounded) and count < self.max_iterations and since < _PATIENCE:
            count, since = count + 1, since + 1
            try:
                theta, right = natural.linear(here, min(left.natural_map, 1.0))
                step = system(theta)(right).reshape(here.impulse.shape)
            except SolverError:
                # singular, far from a solution: the best so far has to do
                break
            found = _search(natural, here, step, max(merits))
            if found is None:
                # beyond a kink, a step that gains nothing at first may still lead on
                daring += 1
                found = natural(here.impulse + step)
                merits.clear()
            if daring > _DARING or not np.isfinite(found.size):
                break
            here = found
            merits.append(here.size)
            left = residual(problem, here.impulse)
            since = 0 if left.natural_map < _BETTER * best[0].natural_map else since
            eta = best[0].natural_map
            still = still + 1 if since and left.natural_map < min(_NOISE * eta, _SETTLED) else 0
            if left.natural_map < best[0].natural_map:
                best = left, here.impulse
            if left.natural_map > self.hopeless:
                break
            rounded = (
                still >= _ROUNDED and np.isfinite(self.hopeless) and _noise(problem, best[1]) > _HEARD * eta
            )
        return _solution(*best, count, limits), rounded


def _noise(problem: ContactProblem, impulse: Array) -> float:
    """Return by how much η changes with the last digits of the impulses [-]."""
    last = _DIGITS * np.where(np.arange(impulse.size) % 2, 1.0, -1.0).reshape(impulse.shape)
    return abs(residual(problem, impulse * (1.0 + last)).natural_map - residual(problem, impulse).natural_map)


def _solution(left: Residual, impulse: Array, count: int, limits: tuple[float, float]) -> ContactSolution:
    return ContactSolution(impulse, left.dual, count, left.natural_map, left.within(*limits))


@dataclass(frozen=True)
class _Point:
    """The natural map at some impulses.

    Attributes
    ----------
    impulse, error : r, Φ (nc, d) [N s]
    u : relative velocities (nc, d) [m/s]
    point : r - ρ û, which is projected (nc, d) [N s]
    size : ‖Φ‖, each contact weighted by the root of its diagonal
    """

    impulse: Array
    error: Array
    u: Array
    point: Array
    size: float


class _Map:
    """Φ and its derivative."""

    def __init__(self, problem: ContactProblem) -> None:
        self._problem, self._scale = problem, problem.delassus.scale
        own = problem.delassus.diagonal
        mean = np.einsum("cii->c", own) / max(own.shape[1], 1)
        if self._scale < mean.min():
            # W is measured against its elastic part: with the far larger motion of whole stones in ρ, impulses
            # alone would tell which contacts are open
            mean[:] = self._scale
        self._own = np.maximum(mean, _LEAST * self._scale)

    def __call__(self, impulse: Array) -> _Point:
        """Return Φ at some impulses."""
        problem = self._problem
        u = problem.delassus.apply(impulse) + problem.u_free
        dual = u.copy()
        dual[:, 0] += problem.bias + problem.friction * np.sqrt((u[:, 1:] ** 2).sum(axis=1))
        point = impulse - dual / self._own[:, None]
        error = impulse - project_on_cone(point, problem.friction, problem.cohesion)
        size = float(np.sqrt((self._own[:, None] / self._scale * error**2).sum()))
        return _Point(impulse, error, u, point, size)

    def linear(self, here: _Point, eta: float) -> tuple[Array, Array]:
        """Return Θ + α (nc, d, d) and the right side (d nc,) of a step."""
        friction, unit = self._problem.friction, np.eye(here.u.shape[1])
        derivative = projection_derivative(here.point, friction, self._problem.cohesion)
        derivative = (1.0 - _SOFT - _GIVE) * derivative + _SOFT * unit
        turn = np.tile(unit, (len(here.u), 1, 1))
        slide = np.sqrt((here.u[:, 1:] ** 2).sum(axis=1))
        turn[:, 0, 1:] = (friction / np.maximum(slide, 1e-300))[:, None] * here.u[:, 1:]
        inverse = self._own[:, None, None] * np.linalg.inv(derivative @ turn)
        theta = inverse @ (unit - derivative) + _PROXIMAL * max(eta, _FLOOR) * self._scale * unit
        return theta, -np.einsum("cij,cj->ci", inverse, here.error).ravel()


def _search(natural: _Map, here: _Point, step: Array, worst: float) -> _Point | None:
    """Return the first of ever shorter parts of a step that gains on the worst of the last; None if none does."""
    length = 1.0
    while length > _SHORTEST:
        found = natural(here.impulse + length * step)
        if found.size < (1.0 - _GAIN * length) * worst:
            return found
        length *= 0.5
    return None


def projection_derivative(point: Array, friction: Array, cohesion: Array) -> Array:
    """Return an element (nc, d, d) of the derivative of the projection on {r_N ≥ 0, ‖r_T‖ ≤ μ r_N + k}."""
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
