"""Numba kernels that solve contact problems with a stored W: sweeps, ADMM and a proximal Newton method, all at once.

A problem is (block, indices, indptr, q, mu, k): W in block-sparse rows, u_free with the bias in its normal part,
friction and cohesion. Impulses r (nc, 3) are written in place.
"""

import numpy as np
from numba import njit

from mechanics.delassus._kernels.stored import apply
from mechanics.problem._kernels import admm_right_side, admm_update, natural_errors, plane_axes, solve_contact
from mechanics.solvers._kernels.block_fronts import analyse, factorise, solve

__all__ = [
    "ADMM",
    "NEWTON",
    "NOTHING",
    "SWEEPS",
    "alart_curnier",
    "diagonal_blocks",
    "eta_of",
    "proximal_newton",
    "solve_stored",
    "static_admm",
    "sweeps",
]

# what solve_stored ended with
NOTHING, SWEEPS, ADMM, NEWTON = 0, 1, 2, 3
# sweeps before the first looks; as many more may still be taken without another thought
_LOOK = 5
# a sweep costs some nanoseconds for each block of W and each contact, a multiplication of the factorisation a part of
# one; a look and the derivatives about as much as four sweeps; Newton's method takes some 15 steps
_PER_BLOCK, _PER_CONTACT, _PER_WORK, _STEP_SWEEPS, _STEPS = 8.0, 60.0, 0.4, 4.0, 15.0
# iterations of ADMM with one factorisation, between two looks, and its penalty over the scale of W
_STATIC, _STATIC_LOOK, _STATIC_PENALTY, _BETTER = 18, 3, 1e-4, 0.1
# α of Newton's method over η and the scale of W, at first and then in turn, should it fail; steps of an attempt; looks
# back of the line search, what a step must gain over what it promises, and the shortest
_SHARES = (0.1, 0.1, 1.0, 0.01, 0.1, 1.0)
_ATTEMPT, _MEMORY, _GAIN, _SHORTEST = 60, 5, 1e-4, 1e-3
# steps that short say that α is too small; by how much it then grows, and falls again after whole steps
_SHORT, _ADAPT = 0.2, 4.0
# sweeps between two attempts
_BETWEEN = 60


@njit(cache=True)
def diagonal_blocks(block, indices, indptr):  # pragma: no cover - compiled
    """W_αα (nc, 3, 3), its symmetric part."""
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
    """As mechanics.solvers._kernels.local_factors, by cofactors."""
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
def eta_of(block, indices, indptr, q, mu, k, r, rho, pace, none):  # pragma: no cover - compiled
    """η and the largest velocity error of r, as mechanics.residual computes them; and û."""
    u = apply(r, block, indices, indptr)
    u += q
    _, whole, largest, size, projected = natural_errors(r, u, none, mu, k, rho)
    scale = max(size, projected, 1e-8 * rho * pace)
    return (whole / scale if scale > 0.0 else 0.0), (largest / rho / pace if pace > 0.0 else 0.0), u


@njit(cache=True)
def sweeps(
    block, indices, indptr, own, q, mu, k, r, rho, pace, eta_goal, velocity_goal, first, most, work
):  # pragma: no cover - compiled
    """Gauss–Seidel until η is reached, or until that is seen to take longer than `work` sweeps more.

    Looks come after `first` sweeps, then ever farther apart.

    Returns
    -------
    η, velocity error, û, sweeps
    """
    nc = len(r)
    none = np.zeros(nc)
    f = _local_factors(own)
    b, new = np.empty(3), np.empty(3)
    done, count, before = 0, first, np.inf
    eta, velocity, dual = np.inf, np.inf, r
    while done < most:
        count = min(count, most - done)
        for _ in range(count):
            for c in range(nc):
                u0, u1, u2 = q[c, 0], q[c, 1], q[c, 2]
                for p in range(indptr[c], indptr[c + 1]):
                    w, j = block[p], indices[p]
                    if j == c:
                        continue
                    r0, r1, r2 = r[j, 0], r[j, 1], r[j, 2]
                    u0 += w[0, 0] * r0 + w[0, 1] * r1 + w[0, 2] * r2
                    u1 += w[1, 0] * r0 + w[1, 1] * r1 + w[1, 2] * r2
                    u2 += w[2, 0] * r0 + w[2, 1] * r1 + w[2, 2] * r2
                b[0], b[1], b[2] = u0, u1, u2
                solve_contact(f[c], b, mu[c], k[c], new)
                r[c, 0], r[c, 1], r[c, 2] = new[0], new[1], new[2]
        done += count
        eta, velocity, dual = eta_of(block, indices, indptr, q, mu, k, r, rho, pace, none)
        if eta <= eta_goal and velocity <= velocity_goal:
            break
        if before < np.inf:
            rate = np.log(before / eta) / count if eta > 0.0 else 0.0
            left = np.log(eta / eta_goal) / rate if rate > 0.0 and eta > eta_goal else np.inf
            if left > work:
                break
        before = eta
        count = max(first, done // 2)
    return eta, velocity, dual, done


@njit(cache=True)
def alart_curnier(r, u, mu, k, rho, error, first, second):  # pragma: no cover - compiled
    """F(r, u) of Alart & Curnier (1991), and its derivatives A by r and B by u; all written.

    F_N = r_N - (r_N - ρ_N u_N)⁺, F_T = r_T - P(r_T - ρ_T u_T), P onto a disk of radius μ (r_N - ρ_N u_N)⁺ + k.

    Returns
    -------
    ½‖F‖²
    """
    total = 0.0
    for c in range(len(r)):
        a, b = first[c], second[c]
        a[:], b[:] = 0.0, 0.0
        rn, rt = rho[c, 0], rho[c, 1]
        n = r[c, 0] - rn * u[c, 0]
        t1, t2 = r[c, 1] - rt * u[c, 1], r[c, 2] - rt * u[c, 2]
        if n > 0.0:
            error[c, 0] = rn * u[c, 0]
            b[0, 0] = rn
            radius = mu[c] * n + k[c]
        else:
            error[c, 0] = r[c, 0]
            a[0, 0] = 1.0
            radius = k[c]
        size = np.sqrt(t1 * t1 + t2 * t2)
        if radius <= 0.0:
            error[c, 1], error[c, 2] = r[c, 1], r[c, 2]
            a[1, 1], a[2, 2] = 1.0, 1.0
        elif size <= radius:
            error[c, 1], error[c, 2] = rt * u[c, 1], rt * u[c, 2]
            b[1, 1], b[2, 2] = rt, rt
        else:
            d1, d2, s = t1 / size, t2 / size, radius / size
            error[c, 1], error[c, 2] = r[c, 1] - radius * d1, r[c, 2] - radius * d2
            g11, g12, g22 = s * (1.0 - d1 * d1), -s * d1 * d2, s * (1.0 - d2 * d2)
            a[1, 1], a[1, 2], a[2, 1], a[2, 2] = 1.0 - g11, -g12, -g12, 1.0 - g22
            b[1, 1], b[1, 2], b[2, 1], b[2, 2] = rt * g11, rt * g12, rt * g12, rt * g22
            if n > 0.0:
                a[1, 0], a[2, 0] = -mu[c] * d1, -mu[c] * d2
                b[1, 0], b[2, 0] = mu[c] * rn * d1, mu[c] * rn * d2
        total += error[c, 0] ** 2 + error[c, 1] ** 2 + error[c, 2] ** 2
    return 0.5 * total


@njit(cache=True)
def _jacobian(block, indices, indptr, first, second, alpha, value):
    """A + B (W + α) into `value`."""
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
def proximal_newton(
    block, indices, indptr, own, q, mu, k, r, rho, pace, eta_goal, velocity_goal, most, share, pattern, aptr
):  # pragma: no cover - compiled
    """Newton's method with W + α in its derivative, α as small as η: r is written.

    Returns
    -------
    η, velocity error, û of the best iterate, steps
    """
    _, width, whole, fptr, front, offset, mptr, member, eptr, entry, row, column, parent, place, _ = pattern
    nc = len(r)
    none, local = np.zeros(nc), np.empty((nc, 2))
    for c in range(nc):
        local[c, 0], local[c, 1] = 1.0 / own[c, 0, 0], 2.0 / (own[c, 1, 1] + own[c, 2, 2])
    first, second = np.empty((nc, 3, 3)), np.empty((nc, 3, 3))
    error, trial_error = np.empty((nc, 3)), np.empty((nc, 3))
    factor, pivot = np.empty(aptr[-1]), np.empty(3 * nc, dtype=np.int64)
    work, value = np.empty(whole.max()), np.empty_like(block)
    u = apply(r, block, indices, indptr) + q
    merit = alart_curnier(r, u, mu, k, local, error, first, second)
    history = np.full(_MEMORY, merit)
    eta, worst, dual = eta_of(block, indices, indptr, q, mu, k, r, rho, pace, none)
    best, best_eta, best_worst, best_dual = r.copy(), eta, worst, dual
    count, least = 0, share
    while count < most and not (best_eta <= eta_goal and best_worst <= velocity_goal):
        _jacobian(block, indices, indptr, first, second, share * min(eta, 1.0) / rho, value)
        if not factorise(
            value, False, width, whole, fptr, front, offset, eptr, entry, row, column, parent, place, aptr, factor,
            pivot,
        ):  # fmt: skip
            break
        step = -error
        solve(step, width, whole, fptr, front, offset, mptr, member, aptr, factor, pivot, work)
        change = apply(step, block, indices, indptr)
        limit, length = history.max(), 1.0
        while True:
            new, after = r + length * step, u + length * change
            merit = alart_curnier(new, after, mu, k, local, trial_error, first, second)
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
        eta, worst, dual = eta_of(block, indices, indptr, q, mu, k, r, rho, pace, none)
        if eta < best_eta:
            best[:], best_eta, best_worst, best_dual = r, eta, worst, dual
    r[:] = best
    return best_eta, best_worst, best_dual, count


@njit(cache=True)
def static_admm(
    block, indices, indptr, q, mu, k, r, rho, pace, eta_goal, velocity_goal, most, symmetric, pattern, aptr
):  # fmt: skip  # pragma: no cover - compiled
    """ADMM with a small penalty and without over-relaxation, as long as η falls tenfold from look to look.

    Its first iterate holds every contact whatever that needs, put on the cones: where nothing opens or
    slides that is nearly the solution, and some iterations with the same factors are enough. r is written.

    Returns
    -------
    η, velocity error, û, iterations
    """
    _, width, whole, fptr, front, offset, mptr, member, eptr, entry, row, column, parent, place, _ = pattern
    nc = len(r)
    sigma = _STATIC_PENALTY / rho
    none, lag = np.zeros(nc), np.zeros(nc)
    factor, pivot = np.empty(aptr[-1]), np.empty(3 * nc, dtype=np.int64)
    work, value = np.empty(whole.max()), block.copy()
    for c in range(nc):
        for p in range(indptr[c], indptr[c + 1]):
            if indices[p] == c:
                for i in range(3):
                    value[p, i, i] += sigma
    y, right = np.zeros((nc, 3)), np.empty((nc, 3))
    count, before = 0, np.inf
    eta, worst, dual = np.inf, np.inf, r
    if not factorise(
        value, symmetric, width, whole, fptr, front, offset, eptr, entry, row, column, parent, place, aptr, factor,
        pivot,
    ):  # fmt: skip
        return eta, worst, dual, count
    while count < most:
        for _ in range(min(_STATIC_LOOK, most - count)):
            for c in range(nc):
                lag[c] = mu[c] * np.sqrt(y[c, 1] ** 2 + y[c, 2] ** 2)
            admm_right_side(r, y, q, lag, sigma, right)
            right *= sigma
            solve(right, width, whole, fptr, front, offset, mptr, member, aptr, factor, pivot, work)
            admm_update(right, r, y, mu, k, 1.0)
            count += 1
        eta, worst, dual = eta_of(block, indices, indptr, q, mu, k, r, rho, pace, none)
        if (eta <= eta_goal and worst <= velocity_goal) or not eta < 0.1 * before:
            break
        before = eta
    return eta, worst, dual, count


@njit(cache=True)
def _symmetric(block, indices, indptr, q):
    """Whether W is, as far as two vectors tell."""
    x, y = q, np.empty_like(q)
    for c in range(len(q)):
        for i in range(3):
            y[c, i] = q[c, (i + 1) % 3] + ((c * 7 + i * 3) % 11) * 0.1 * abs(q[c, i])
    one, other = apply(x, block, indices, indptr), apply(y, block, indices, indptr)
    left, right, size = 0.0, 0.0, 0.0
    for c in range(len(q)):
        for i in range(3):
            left += y[c, i] * one[c, i]
            right += x[c, i] * other[c, i]
            size += abs(y[c, i] * one[c, i])
    return abs(left - right) <= 1e-10 * size


@njit(cache=True)
def solve_stored(
    block, indices, indptr, q, mu, k, r, eta_goal, velocity_goal, most
):  # pragma: no cover - compiled
    """Sweeps; where these are seen to take long, ADMM or Newton's method, by what their factors cost; r is written.

    Returns
    -------
    η, velocity error, û, sweeps and iterations, factorisations, what it ended with
    """
    nc = len(r)
    own = diagonal_blocks(block, indices, indptr)
    scale = 0.0
    for c in range(nc):
        scale += own[c, 0, 0] + own[c, 1, 1] + own[c, 2, 2]
    rho, pace = 3.0 * nc / scale, np.abs(q).max()
    none = np.zeros(nc)
    eta, worst, dual = eta_of(block, indices, indptr, q, mu, k, r, rho, pace, none)
    if eta <= eta_goal and worst <= velocity_goal:
        return eta, worst, dual, 0, 0, NOTHING
    cold = r.copy()
    sweep = _PER_BLOCK * len(block) + _PER_CONTACT * nc
    eta, worst, dual, done = sweeps(
        block, indices, indptr, own, q, mu, k, r, rho, pace, eta_goal, velocity_goal, _LOOK, most,
        _STEPS * _STEP_SWEEPS,
    )  # fmt: skip
    if (eta <= eta_goal and worst <= velocity_goal) or done >= most:
        return eta, worst, dual, done, 0, SWEEPS
    pattern = analyse(indices, indptr)
    whole, work = pattern[2], pattern[-1]
    aptr = np.zeros(len(whole) + 1, dtype=np.int64)
    for f in range(len(whole)):
        aptr[f + 1] = aptr[f] + whole[f] * whole[f]
    best, best_eta, best_worst, best_dual, with_ = r.copy(), eta, worst, dual, SWEEPS
    r[:] = cold
    eta, worst, dual, count = static_admm(
        block, indices, indptr, q, mu, k, r, rho, pace, eta_goal, velocity_goal, min(_STATIC, most - done),
        _symmetric(block, indices, indptr, q), pattern, aptr,
    )  # fmt: skip
    done += count
    factorised, attempt = 1, 0
    # derivatives and a look cost as much as some sweeps, the factorisation what it multiplies
    step = _PER_WORK * work / sweep + _STEP_SWEEPS
    if eta <= eta_goal and worst <= velocity_goal:
        return eta, worst, dual, done, factorised, ADMM
    # only far nearer to the solution is it the better start for Newton's method: sweeps know what opens and slides
    if eta < _BETTER * best_eta:
        best[:], best_eta, best_worst, best_dual, with_ = r, eta, worst, dual, ADMM
    while done < most and attempt < len(_SHARES):
        # from nothing, should the first attempt have failed; after that from sweeps once more
        r[:] = cold if attempt == 1 else best
        if attempt != 1 and with_ != ADMM:
            # as many sweeps as Newton's method would cost, at first; then some, for another start
            eta, worst, dual, count = sweeps(
                block, indices, indptr, own, q, mu, k, r, rho, pace, eta_goal, velocity_goal,
                _LOOK if attempt == 0 else _BETWEEN, most - done, (_STEPS if attempt == 0 else 1.0) * step,
            )  # fmt: skip
            done += count
            if eta < best_eta:
                best[:], best_eta, best_worst, best_dual, with_ = r, eta, worst, dual, SWEEPS
            if (eta <= eta_goal and worst <= velocity_goal) or done >= most:
                break
        eta, worst, dual, count = proximal_newton(
            block, indices, indptr, own, q, mu, k, r, rho, pace, eta_goal, velocity_goal, min(_ATTEMPT, most - done),
            _SHARES[attempt], pattern, aptr,
        )  # fmt: skip
        done += count
        factorised += count
        if eta < best_eta:
            best[:], best_eta, best_worst, best_dual, with_ = r, eta, worst, dual, NEWTON
        if eta <= eta_goal and worst <= velocity_goal:
            break
        attempt += 1
    r[:] = best
    return best_eta, best_worst, best_dual, done, factorised, with_
