"""Numba kernels of the contact problem: products with W, exact local solves, Gauss–Seidel sweeps."""

import numpy as np
from numba import njit

__all__ = ["apply_delassus", "local_factors", "solve_contact", "sweep"]

NONE, RIGID, ELASTIC = 0, 1, 2


@njit(cache=True)
def apply_delassus(r, body, kind, jacobian, response, slot, yptr, bptr, block):  # pragma: no cover - compiled
    """What the impulses r (nc, 3) do: u = W r (nc, 3), rigid velocities (nb, 6), elastic side velocities."""
    nc, nb = r.shape[0], yptr.shape[0] - 1
    v = np.zeros((nb, 6))
    p, y = np.zeros(yptr[nb]), np.zeros(yptr[nb])
    for c in range(nc):
        sign = 1.0
        for s in range(2):
            b = body[c, s]
            if kind[c, s] == RIGID:
                for i in range(6):
                    for k in range(3):
                        v[b, i] += sign * response[c, s, i, k] * r[c, k]
            elif kind[c, s] == ELASTIC:
                start = yptr[b] + 3 * slot[c, s]
                for k in range(3):
                    p[start + k] += sign * r[c, k]
            sign = -1.0
    for b in range(nb):
        n = yptr[b + 1] - yptr[b]
        for row in range(n):
            start = bptr[b] + row * n
            total = 0.0
            for col in range(n):
                total += block[start + col] * p[yptr[b] + col]
            y[yptr[b] + row] = total
    u = np.zeros((nc, 3))
    for c in range(nc):
        _relative_velocity(c, u[c], v, y, body, kind, jacobian, slot, yptr)
    return u, v, y


@njit(cache=True, inline="always")
def _relative_velocity(c, u, v, y, body, kind, jacobian, slot, yptr):
    """Add to u (3,) the local relative velocity at contact c."""
    sign = 1.0
    for s in range(2):
        b = body[c, s]
        if kind[c, s] == RIGID:
            for k in range(3):
                total = 0.0
                for i in range(6):
                    total += jacobian[c, s, k, i] * v[b, i]
                u[k] += sign * total
        elif kind[c, s] == ELASTIC:
            start = yptr[b] + 3 * slot[c, s]
            for k in range(3):
                u[k] += sign * y[start + k]
        sign = -1.0


@njit(cache=True)
def local_factors(diagonal):  # pragma: no cover - compiled
    """Per contact what its local solve needs: W⁻¹ (9), W_NN, W_NT (2), and, of A = W_TT - W_TN W_NT / W_NN, the
    rotation (cos, sin) to its axes and its eigenvalues. (nc, 16)
    """
    nc = diagonal.shape[0]
    factors = np.empty((nc, 16))
    for c in range(nc):
        w = diagonal[c]
        factors[c, :9] = np.linalg.inv(w).ravel()
        nn = w[0, 0]
        a = w[1, 1] - w[1, 0] * w[0, 1] / nn
        b = w[1, 2] - w[1, 0] * w[0, 2] / nn
        d = w[2, 2] - w[2, 0] * w[0, 2] / nn
        angle = 0.5 * np.arctan2(2.0 * b, a - d)
        co, si = np.cos(angle), np.sin(angle)
        factors[c, 9], factors[c, 10], factors[c, 11] = nn, w[0, 1], w[0, 2]
        factors[c, 12], factors[c, 13] = co, si
        factors[c, 14] = co * co * a + 2.0 * co * si * b + si * si * d
        factors[c, 15] = si * si * a - 2.0 * co * si * b + co * co * d
    return factors


@njit(cache=True)
def solve_contact(f, b, mu, r):  # pragma: no cover - compiled
    """Solve u = W r + b with Signorini's and Coulomb's laws at one contact, exactly; r (3,) is written.

    Open if b_N ≥ 0. Stick if r = -W⁻¹ b lies in the cone. Else slip: u_T = -λ r_T with λ > 0 gives
    r_T(λ) = -(A + λ)⁻¹ c and r_N(λ) = -(b_N + W_NT r_T)/W_NN, and ‖r_T‖ - μ r_N changes its sign on (0, ∞), so the
    root is bracketed and Newton's method, kept inside the bracket, finds it.
    """
    if b[0] >= 0.0:
        r[:] = 0.0
        return
    for k in range(3):
        r[k] = -(f[3 * k] * b[0] + f[3 * k + 1] * b[1] + f[3 * k + 2] * b[2])
    if r[0] > 0.0 and r[1] * r[1] + r[2] * r[2] <= mu * mu * r[0] * r[0]:
        return
    nn, n1, n2 = f[9], f[10], f[11]
    if mu == 0.0:
        r[0], r[1], r[2] = -b[0] / nn, 0.0, 0.0
        return
    co, si, l1, l2 = f[12], f[13], f[14], f[15]
    c1, c2 = b[1] - n1 * b[0] / nn, b[2] - n2 * b[0] / nn
    # in the axes of A
    x1, x2 = co * c1 + si * c2, -si * c1 + co * c2
    m1, m2 = co * n1 + si * n2, -si * n1 + co * n2
    low, high = 0.0, -1.0
    lam = np.sqrt(x1 * x1 + x2 * x2) * nn / (mu * -b[0]) * 0.5
    t1 = t2 = n = 0.0
    for _ in range(100):
        t1, t2 = -x1 / (l1 + lam), -x2 / (l2 + lam)
        n = -(b[0] + m1 * t1 + m2 * t2) / nn
        size = np.sqrt(t1 * t1 + t2 * t2)
        value = size - mu * n
        if value > 0.0:
            low = lam
        else:
            high = lam
        if abs(value) <= 1e-14 * (size + mu * abs(n)):
            break
        d1, d2 = -t1 / (l1 + lam), -t2 / (l2 + lam)
        slope = (t1 * d1 + t2 * d2) / size + mu * (m1 * d1 + m2 * d2) / nn
        trial = lam - value / slope if slope < 0.0 else -1.0
        if high < 0.0:
            lam = trial if trial > low else 4.0 * lam
        else:
            if high - low <= 1e-15 * high:
                break
            lam = trial if low < trial < high else 0.5 * (low + high)
    size = np.sqrt(t1 * t1 + t2 * t2)
    n = max(n, 0.0)
    scale = mu * n / size if size > 0.0 else 0.0
    r[0] = n
    r[1], r[2] = scale * (co * t1 - si * t2), scale * (si * t1 + co * t2)


@njit(cache=True)
def sweep(
    count,
    backward,
    r,
    v,
    y,
    shift,
    mu,
    factors,
    diagonal,
    body,
    kind,
    jacobian,
    response,
    slot,
    yptr,
    bptr,
    block,
):  # pragma: no cover - compiled
    """`count` passes of non-smooth Gauss–Seidel; r, v and y are kept up to date in place.

    `shift` is u_free with the bias added to its normal part. With `backward`, every second pass runs the
    other way round.
    """
    nc = r.shape[0]
    u, b, new = np.empty(3), np.empty(3), np.empty(3)
    for n in range(count):
        for position in range(nc):
            c = nc - 1 - position if backward and n % 2 == 1 else position
            u[:] = shift[c]
            _relative_velocity(c, u, v, y, body, kind, jacobian, slot, yptr)
            w = diagonal[c]
            for k in range(3):
                b[k] = u[k] - w[k, 0] * r[c, 0] - w[k, 1] * r[c, 1] - w[k, 2] * r[c, 2]
            solve_contact(factors[c], b, mu[c], new)
            d0, d1, d2 = new[0] - r[c, 0], new[1] - r[c, 1], new[2] - r[c, 2]
            if d0 == 0.0 and d1 == 0.0 and d2 == 0.0:
                continue
            r[c] = new
            for s in range(2):
                a = body[c, s]
                if kind[c, s] == RIGID:
                    for i in range(6):
                        v[a, i] += (
                            response[c, s, i, 0] * d0 + response[c, s, i, 1] * d1 + response[c, s, i, 2] * d2
                        )
                elif kind[c, s] == ELASTIC:
                    start, size = yptr[a], yptr[a + 1] - yptr[a]
                    # the block is symmetric: rows, which lie together in memory, serve as columns
                    row = bptr[a] + 3 * slot[c, s] * size
                    for k in range(size):
                        y[start + k] += (
                            block[row + k] * d0 + block[row + size + k] * d1 + block[row + 2 * size + k] * d2
                        )
                d0, d1, d2 = -d0, -d1, -d2
