# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators, no-check-untyped-defs
"""Numba kernels that solve contact problems with a stored W: sweeps, ADMM and a proximal Newton method, all at once.

A problem is W (`Blocks`) and its `Terms`. Impulses r (nc, 3) are written in place.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.stored._kernels.sweeps import add_block, apply
from mechanics.contact._kernels.vectors import row
from mechanics.problem._kernels import admm_right_side, admm_update, natural_errors, plane_axes, solve_contact
from mechanics.solvers._kernels.block_fronts import analyse, factorise, solve
from mechanics.solvers._kernels.body_newton import alart_curnier

__all__ = [
    "ADMM",
    "NEWTON",
    "NOTHING",
    "SWEEPS",
    "Terms",
    "diagonal_blocks",
    "eta_of",
    "proximal_newton",
    "solve_stored",
    "static_admm",
    "sweeps",
]

# method with which solve_stored ended
NOTHING, SWEEPS, ADMM, NEWTON = 0, 1, 2, 3
# sweeps before the first looks; as many more may still be taken without another thought
_LOOK = 5
# time of a sweep for each block of W, and for each contact [ns]
_PER_BLOCK = 8.0
_PER_CONTACT = 60.0
# time of a multiplication of the factorisation [ns]
_PER_WORK = 0.4
# sweeps that take as long as a look and the derivatives
_STEP_SWEEPS = 4.0
# steps that Newton's method takes, about
_STEPS = 15.0
# iterations of ADMM with one factorisation, and between two looks
_STATIC = 18
_STATIC_LOOK = 3
# penalty of ADMM over the scale of W [-]
_STATIC_PENALTY = 1e-4
# η over that of the sweeps from which ADMM leaves the better start for Newton's method [-]
_BETTER = 0.1
# α of Newton's method over η and the scale of W, at first and then in turn, should it fail [-]
_SHARES = (0.1, 0.1, 1.0, 0.01, 0.1, 1.0)
# steps of an attempt
_ATTEMPT = 60
# iterates to which the line search looks back
_MEMORY = 5
# gain that a step must bring, over what it promises [-]
_GAIN = 1e-4
# shortest part of a step [-]
_SHORTEST = 1e-3
# part of a step below which α counts as too small [-]
_SHORT = 0.2
# factor by which α then grows, and falls again after whole steps
_ADAPT = 4.0
# sweeps between two attempts
_BETWEEN = 60


class Terms(NamedTuple):
    """Right side and laws of a stored problem.

    Attributes
    ----------
    q : (nc, 3) float64, u_free with the bias in its normal part [m/s]
    mu, k : (nc,) float64, friction [-] and cohesion [N s]
    """

    q: NDArray[np.float64]
    mu: NDArray[np.float64]
    k: NDArray[np.float64]


class _Goal(NamedTuple):
    """Tolerances, ρ = 1/(scale of W) [kg] and the largest velocity of q [m/s]."""

    eta: float
    velocity: float
    rho: float
    pace: float


@njit(cache=True)
def _reached(goal, eta, velocity):
    """Return whether both errors are within their tolerances."""
    return eta <= goal.eta and velocity <= goal.velocity


@njit(cache=True)
def diagonal_blocks(w):  # pragma: no cover - compiled
    """Return the symmetric parts of W_αα (nc, 3, 3) [1/kg], of W (`Blocks`)."""
    block, indices, indptr = w
    nc = len(indptr) - 1
    own = np.zeros((nc, 3, 3))
    for c in range(nc):
        for p in range(indptr[c], indptr[c + 1]):
            if indices[p] == c:
                for i in range(3):
                    for j in range(3):
                        own[c, i, j] += 0.5 * (block[p, i, j] + block[p, j, i])
    return own


@njit(cache=True)
def _local_factors(own):
    """Return the factors of mechanics.problem._kernels.local_factors (nc, 16), by cofactors."""
    nc = len(own)
    f = np.empty((nc, 16))
    for c in range(nc):
        w = own[c]
        a, b, d, e, g, h = w[0, 0], w[0, 1], w[0, 2], w[1, 1], w[1, 2], w[2, 2]
        c0, c1, c2 = e * h - g * g, d * g - b * h, b * g - d * e
        det = a * c0 + b * c1 + d * c2
        f[c, 0], f[c, 1], f[c, 2] = c0 / det, c1 / det, c2 / det
        f[c, 3], f[c, 4], f[c, 5] = c1 / det, (a * h - d * d) / det, (b * d - a * g) / det
        f[c, 6], f[c, 7], f[c, 8] = c2 / det, (b * d - a * g) / det, (a * e - b * b) / det
        f[c, 9], f[c, 10], f[c, 11] = a, b, d
        f[c, 12], f[c, 13], f[c, 14], f[c, 15] = plane_axes(e - b * b / a, g - b * d / a, h - d * d / a)
    return f


@njit(cache=True)
def eta_of(w, terms, r, rho, pace):  # pragma: no cover - compiled
    """Return η and the largest velocity error of r, as mechanics.problem.residual computes them; and û."""
    u = apply(r, w)
    u += terms.q
    _, whole, largest, size, projected = natural_errors(r, u, np.zeros(len(r)), terms.mu, terms.k, rho)
    scale = max(size, projected, 1e-8 * rho * pace)
    return (whole / scale if scale > 0.0 else 0.0), (largest / rho / pace if pace > 0.0 else 0.0), u


@njit(cache=True)
def sweeps(w, own, terms, r, goal, first, most, work):  # pragma: no cover - compiled
    """Sweep until the goal is reached, or until that is seen to take longer than `work` sweeps more.

    Looks come after `first` sweeps, then ever farther apart.

    Inputs
    ------
    w : Blocks
    own : (nc, 3, 3) float64, of `diagonal_blocks` [1/kg]
    terms : Terms
    r : (nc, 3) float64 [N s]
    goal : _Goal
    first, most : int64, sweeps before the first look, and in all
    work : float64, sweeps

    Outputs
    -------
    r : written
    η, velocity error, û, sweeps
    """
    nc = len(r)
    f = _local_factors(own)
    b, new = np.empty(3), np.empty(3)
    done, count, before = 0, first, np.inf
    eta, velocity, dual = np.inf, np.inf, r
    while done < most:
        count = min(count, most - done)
        for _ in range(count):
            for c in range(nc):
                u = row(terms.q, c)
                for p in range(w.indptr[c], w.indptr[c + 1]):
                    if w.indices[p] != c:
                        u = add_block(u, w.block[p], row(r, w.indices[p]))
                b[0], b[1], b[2] = u
                solve_contact(f[c], b, terms.mu[c], terms.k[c], new)
                r[c, 0], r[c, 1], r[c, 2] = new[0], new[1], new[2]
        done += count
        eta, velocity, dual = eta_of(w, terms, r, goal.rho, goal.pace)
        if _reached(goal, eta, velocity):
            break
        if before < np.inf:
            rate = np.log(before / eta) / count if eta > 0.0 else 0.0
            left = np.log(eta / goal.eta) / rate if rate > 0.0 and eta > goal.eta else np.inf
            if left > work:
                break
        before = eta
        count = max(first, done // 2)
    return eta, velocity, dual, done


@njit(cache=True)
def _jacobian(w, first, second, alpha, value):
    """Write A + B (W + α) into `value`."""
    block, indices, indptr = w
    for c in range(len(indptr) - 1):
        a, b = first[c], second[c]
        for p in range(indptr[c], indptr[c + 1]):
            x, to = block[p], value[p]
            for i in range(3):
                b0, b1, b2 = b[i, 0], b[i, 1], b[i, 2]
                to[i, 0] = b0 * x[0, 0] + b1 * x[1, 0] + b2 * x[2, 0]
                to[i, 1] = b0 * x[0, 1] + b1 * x[1, 1] + b2 * x[2, 1]
                to[i, 2] = b0 * x[0, 2] + b1 * x[1, 2] + b2 * x[2, 2]
            if indices[p] == c:
                for i in range(3):
                    for j in range(3):
                        to[i, j] += a[i, j] + alpha * b[i, j]


@njit(cache=True)
def proximal_newton(w, own, terms, r, goal, most, share, plan):  # pragma: no cover - compiled
    """Apply Newton's method with W + α in its derivative, α as small as η.

    Inputs
    ------
    w, own, terms, r, goal : as in `sweeps`
    most : int64, steps
    share : float64, α over η and the scale of W [-]
    plan : Plan of the pattern of W

    Outputs
    -------
    r : written, the best iterate
    η, velocity error, û, steps
    """
    nc = len(r)
    local = np.empty((nc, 2))
    for c in range(nc):
        local[c, 0], local[c, 1] = 1.0 / own[c, 0, 0], 2.0 / (own[c, 1, 1] + own[c, 2, 2])
    first, second = np.empty((nc, 3, 3)), np.empty((nc, 3, 3))
    error, trial_error = np.empty((nc, 3)), np.empty((nc, 3))
    factor, pivot = np.empty(plan.aptr[-1]), np.empty(3 * nc, dtype=np.int64)
    work, value = np.empty(plan.whole.max()), np.empty_like(w.block)
    u = apply(r, w) + terms.q
    merit = alart_curnier(r, u, terms.mu, terms.k, local, error, first, second)
    history = np.full(_MEMORY, merit)
    eta, worst, dual = eta_of(w, terms, r, goal.rho, goal.pace)
    best, best_eta, best_worst, best_dual = r.copy(), eta, worst, dual
    count, least = 0, share
    while count < most and not _reached(goal, best_eta, best_worst):
        _jacobian(w, first, second, share * min(eta, 1.0) / goal.rho, value)
        if not factorise(value, False, plan, factor, pivot):
            break
        step = -error
        solve(step, plan, factor, pivot, work)
        change = apply(step, w)
        limit, length = history.max(), 1.0
        while True:
            new, after = r + length * step, u + length * change
            merit = alart_curnier(new, after, terms.mu, terms.k, local, trial_error, first, second)
            if merit < (1.0 - _GAIN * length) * limit or length < _SHORTEST:
                break
            length *= 0.5
        if not np.isfinite(merit):
            break
        r[:], u[:], error[:] = new, after, trial_error
        if length < _SHORT:
            share = min(share * _ADAPT, 1e6)
        elif length == 1.0:
            share = max(share / _ADAPT, least)
        history[count % _MEMORY] = merit
        count += 1
        # u gathers rounding; W r is what counts
        eta, worst, dual = eta_of(w, terms, r, goal.rho, goal.pace)
        if eta < best_eta:
            best[:], best_eta, best_worst, best_dual = r, eta, worst, dual
    r[:] = best
    return best_eta, best_worst, best_dual, count


@njit(cache=True)
def static_admm(w, terms, r, goal, most, symmetric, plan):  # pragma: no cover - compiled
    """Apply ADMM with a small penalty, without over-relaxation, as long as η falls tenfold from look to look.

    Its first iterate holds every contact whatever that needs, put on the cones: where nothing opens or
    slides that is nearly the solution, and some iterations with the same factors are enough.

    Inputs
    ------
    w, terms, r, goal, plan : as in `proximal_newton`
    most : int64, iterations
    symmetric : bool, whether W is

    Outputs
    -------
    r : written
    η, velocity error, û, iterations
    """
    nc, mu, k = len(r), terms.mu, terms.k
    sigma = _STATIC_PENALTY / goal.rho
    lag = np.zeros(nc)
    factor, pivot = np.empty(plan.aptr[-1]), np.empty(3 * nc, dtype=np.int64)
    work, value = np.empty(plan.whole.max()), w.block.copy()
    for c in range(nc):
        for p in range(w.indptr[c], w.indptr[c + 1]):
            if w.indices[p] == c:
                for i in range(3):
                    value[p, i, i] += sigma
    y, right = np.zeros((nc, 3)), np.empty((nc, 3))
    count, before = 0, np.inf
    eta, worst, dual = np.inf, np.inf, r
    if not factorise(value, symmetric, plan, factor, pivot):
        return eta, worst, dual, count
    while count < most:
        for _ in range(min(_STATIC_LOOK, most - count)):
            for c in range(nc):
                lag[c] = mu[c] * np.sqrt(y[c, 1] ** 2 + y[c, 2] ** 2)
            admm_right_side(r, y, terms.q, lag, sigma, right)
            right *= sigma
            solve(right, plan, factor, pivot, work)
            admm_update(right, r, y, mu, k, 1.0)
            count += 1
        eta, worst, dual = eta_of(w, terms, r, goal.rho, goal.pace)
        if _reached(goal, eta, worst) or not eta < 0.1 * before:
            break
        before = eta
    return eta, worst, dual, count


@njit(cache=True)
def _symmetric(w, q):
    """Return whether W is symmetric, by two vectors."""
    x, y = q, np.empty_like(q)
    for c in range(len(q)):
        for i in range(3):
            y[c, i] = q[c, (i + 1) % 3] + ((c * 7 + i * 3) % 11) * 0.1 * abs(q[c, i])
    one, other = apply(x, w), apply(y, w)
    left, right, size = 0.0, 0.0, 0.0
    for c in range(len(q)):
        for i in range(3):
            left += y[c, i] * one[c, i]
            right += x[c, i] * other[c, i]
            size += abs(y[c, i] * one[c, i])
    return abs(left - right) <= 1e-10 * size


@njit(cache=True)
def solve_stored(w, terms, r, eta_goal, velocity_goal, most):  # pragma: no cover - compiled
    """Sweep; where that is seen to take long, apply ADMM or Newton's method, by the cost of their factors.

    Inputs
    ------
    w : Blocks
    terms : Terms
    r : (nc, 3) float64 [N s]
    eta_goal, velocity_goal : float64, tolerances [-]
    most : int64, sweeps and iterations in all

    Outputs
    -------
    r : written
    η, velocity error, û, sweeps and iterations, factorisations, method with which it ended
    """
    nc = len(r)
    own = diagonal_blocks(w)
    scale = 0.0
    for c in range(nc):
        scale += own[c, 0, 0] + own[c, 1, 1] + own[c, 2, 2]
    goal = _Goal(eta_goal, velocity_goal, 3.0 * nc / scale, np.abs(terms.q).max())
    eta, worst, dual = eta_of(w, terms, r, goal.rho, goal.pace)
    if _reached(goal, eta, worst):
        return eta, worst, dual, 0, 0, NOTHING
    cold = r.copy()
    sweep = _PER_BLOCK * len(w.block) + _PER_CONTACT * nc
    eta, worst, dual, done = sweeps(w, own, terms, r, goal, _LOOK, most, _STEPS * _STEP_SWEEPS)
    if _reached(goal, eta, worst) or done >= most:
        return eta, worst, dual, done, 0, SWEEPS
    plan = analyse(w.indices, w.indptr)
    best, best_eta, best_worst, best_dual, method = r.copy(), eta, worst, dual, SWEEPS
    r[:] = cold
    eta, worst, dual, count = static_admm(
        w, terms, r, goal, min(_STATIC, most - done), _symmetric(w, terms.q), plan
    )
    done += count
    factorised, attempt = 1, 0
    # derivatives and a look cost as much as some sweeps, the factorisation its multiplications
    step = _PER_WORK * plan.work / sweep + _STEP_SWEEPS
    if _reached(goal, eta, worst):
        return eta, worst, dual, done, factorised, ADMM
    # only far nearer to the solution is it the better start for Newton's method: sweeps know what opens and slides
    if eta < _BETTER * best_eta:
        best[:], best_eta, best_worst, best_dual, method = r, eta, worst, dual, ADMM
    while done < most and attempt < len(_SHARES):
        # from nothing, should the first attempt have failed; after that from sweeps once more
        r[:] = cold if attempt == 1 else best
        if attempt != 1 and method != ADMM:
            # as many sweeps as Newton's method would cost, at first; then some, for another start
            eta, worst, dual, count = sweeps(
                w, own, terms, r, goal, _LOOK if attempt == 0 else _BETWEEN, most - done,
                (_STEPS if attempt == 0 else 1.0) * step,
            )  # fmt: skip
            done += count
            if eta < best_eta:
                best[:], best_eta, best_worst, best_dual, method = r, eta, worst, dual, SWEEPS
            if _reached(goal, eta, worst) or done >= most:
                break
        eta, worst, dual, count = proximal_newton(
            w, own, terms, r, goal, min(_ATTEMPT, most - done), _SHARES[attempt], plan
        )
        done += count
        factorised += count
        if eta < best_eta:
            best[:], best_eta, best_worst, best_dual, method = r, eta, worst, dual, NEWTON
        if _reached(goal, eta, worst):
            break
        attempt += 1
    r[:] = best
    return best_eta, best_worst, best_dual, done, factorised, method
