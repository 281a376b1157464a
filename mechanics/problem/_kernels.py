"""Numba kernels that every solver uses: the exact solution of one contact, and the natural map of all."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Laws(NamedTuple):
    """Laws of all contacts, as Gauss–Seidel sweeps need them.

    Attributes
    ----------
    shift : (nc, 3) float64, u_free with the bias in its normal part [m/s]
    friction, cohesion : (nc,) float64, μ [-] and k [N s]
    factors : (nc, 16) float64 of `local_factors`, or (nc, 13) of rigid bodies
    """

    shift: NDArray[np.float64]
    friction: NDArray[np.float64]
    cohesion: NDArray[np.float64]
    factors: NDArray[np.float64]


class LocalCompliance(NamedTuple):
    """W_αα of one contact for the search of its slip; A = W_TT - W_TN W_NT / W_NN [1/kg].

    Attributes
    ----------
    nn, n1, n2 : W_NN and W_NT
    cos, sin : rotation to the axes of A
    first, second : eigenvalues of A
    """

    nn: float
    n1: float
    n2: float
    cos: float
    sin: float
    first: float
    second: float


@njit(cache=True)
def local_factors(diagonal):  # pragma: no cover - compiled
    """Return the factors of the local solves: W⁻¹ (9), W_NN, W_NT (2), and rotation and eigenvalues of A.

    Inputs
    ------
    diagonal : (nc, 3, 3) float64, W_αα [1/kg]

    Outputs
    -------
    (nc, 16) float64, from the tenth on a `LocalCompliance`
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
        factors[c, 9], factors[c, 10], factors[c, 11] = nn, w[0, 1], w[0, 2]
        factors[c, 12:] = plane_axes(a, b, d)
    return factors


@njit(cache=True)
def plane_axes(a, b, d):  # pragma: no cover - compiled
    """Return the rotation (cos, sin) to the axes of [[a, b], [b, d]], and its eigenvalues."""
    angle = 0.5 * np.arctan2(2.0 * b, a - d)
    co, si = np.cos(angle), np.sin(angle)
    return (
        co,
        si,
        co * co * a + 2.0 * co * si * b + si * si * d,
        si * si * a - 2.0 * co * si * b + co * co * d,
    )


@njit(cache=True)
def slip(w, b, mu, k, guess):  # pragma: no cover - compiled
    """Return the impulse of a contact that neither sticks nor is without any load: r_N ≥ 0 and ‖r_T‖ = μ r_N + k.

    Slip means u_T = -λ r_T with λ > 0, so r_T(λ) = -(A + λ)⁻¹ c and r_N(λ) = -(b_N + W_NT r_T)/W_NN. The value
    ‖r_T‖ - μ r_N⁺ - k changes its sign on (0, ∞), so the root is bracketed and Newton's method, kept inside the
    bracket, finds it, beginning at λ = `guess` if that is positive. Where it has no r_N > 0 there, cohesion is spent
    without pressure: r_N = 0 and ‖r_T‖ ≤ k.

    Inputs
    ------
    w : LocalCompliance
    b : three float64, u of the contact without its own impulse [m/s]
    mu, k : float64, friction [-] and cohesion [N s]
    guess : float64, λ [1/kg]

    Outputs
    -------
    three float64, r [N s]
    """
    if b[0] < 0.0 or k > 0.0:
        r = _slip_pressed(w, b, mu, k, guess)
        if r[0] > 0.0 or k == 0.0:
            return r
    return _slip_unpressed(w, b, k)


@njit(cache=True)
def _slip_pressed(w, b, mu, k, guess):
    """Return the impulse of a contact that slips under pressure; zero where it would have to be pulled."""
    if mu == 0.0 and k == 0.0:
        return -b[0] / w.nn, 0.0, 0.0
    c1, c2 = b[1] - w.n1 * b[0] / w.nn, b[2] - w.n2 * b[0] / w.nn
    co, si = w.cos, w.sin
    # in the axes of A
    x1, x2 = co * c1 + si * c2, -si * c1 + co * c2
    m1, m2 = co * w.n1 + si * w.n2, -si * w.n1 + co * w.n2
    t1, t2 = -x1 / w.first, -x2 / w.second
    n = -(b[0] + m1 * t1 + m2 * t2) / w.nn
    if n <= 0.0 and t1 * t1 + t2 * t2 <= k * k:
        # even stuck it would have to be pulled
        return 0.0, 0.0, 0.0
    low, high = 0.0, -1.0
    lam = guess
    if not lam > 0.0:
        lam = np.sqrt(x1 * x1 + x2 * x2) * w.nn / (mu * max(-b[0], 0.0) + k * w.nn) * 0.5
    for _ in range(100):
        t1, t2 = -x1 / (w.first + lam), -x2 / (w.second + lam)
        n = -(b[0] + m1 * t1 + m2 * t2) / w.nn
        size = np.sqrt(t1 * t1 + t2 * t2)
        value = size - mu * max(n, 0.0) - k
        if value > 0.0:
            low = lam
        else:
            high = lam
        if abs(value) <= 1e-14 * (size + mu * abs(n) + k):
            break
        d1, d2 = -t1 / (w.first + lam), -t2 / (w.second + lam)
        slope = (t1 * d1 + t2 * d2) / size
        if n > 0.0:
            slope += mu * (m1 * d1 + m2 * d2) / w.nn
        trial = lam - value / slope if slope < 0.0 else -1.0
        if high < 0.0:
            lam = trial if trial > low else 4.0 * lam
        else:
            if high - low <= 1e-15 * high:
                break
            lam = trial if low < trial < high else 0.5 * (low + high)
    if n < 0.0:
        return 0.0, 0.0, 0.0
    size = np.sqrt(t1 * t1 + t2 * t2)
    scale = (mu * n + k) / size if size > 0.0 else 0.0
    return n, scale * (co * t1 - si * t2), scale * (si * t1 + co * t2)


@njit(cache=True)
def _slip_unpressed(w, b, k):
    """Return the impulse at r_N = 0: stick tangentially, or slide against ‖r_T‖ = k."""
    co, si = w.cos, w.sin
    m11 = co * co * w.first + si * si * w.second + w.n1 * w.n1 / w.nn
    m12 = co * si * (w.first - w.second) + w.n1 * w.n2 / w.nn
    m22 = si * si * w.first + co * co * w.second + w.n2 * w.n2 / w.nn
    low, high, lam = 0.0, np.sqrt(b[1] * b[1] + b[2] * b[2]) / k, 0.0
    t1 = t2 = 0.0
    for _ in range(200):
        det = (m11 + lam) * (m22 + lam) - m12 * m12
        t1, t2 = -((m22 + lam) * b[1] - m12 * b[2]) / det, -((m11 + lam) * b[2] - m12 * b[1]) / det
        size = np.sqrt(t1 * t1 + t2 * t2)
        if lam == 0.0 and size <= k:
            return 0.0, t1, t2
        if size > k:
            low = lam
        else:
            high = lam
        if abs(size - k) <= 1e-14 * k or high - low <= 1e-15 * high:
            break
        lam = 0.5 * (low + high)
    size = np.sqrt(t1 * t1 + t2 * t2)
    return 0.0, t1 * k / size, t2 * k / size


@njit(cache=True)
def solve_contact(f, b, mu, k, r):  # pragma: no cover - compiled
    """Solve u = W r + b with Signorini's and Coulomb's laws at one contact, exactly.

    Open if b_N ≥ 0 and nothing holds it; stick if r = -W⁻¹ b is admissible; otherwise slip.

    Inputs
    ------
    f : (16,) float64, a row of `local_factors`
    b : (3,) float64, u of the contact without its own impulse [m/s]
    mu, k : float64, friction [-] and cohesion [N s]

    Outputs
    -------
    r : (3,) float64, written [N s]
    """
    if b[0] >= 0.0 and k == 0.0:
        r[:] = 0.0
        return
    for i in range(3):
        r[i] = -(f[3 * i] * b[0] + f[3 * i + 1] * b[1] + f[3 * i + 2] * b[2])
    limit = mu * r[0] + k
    if r[0] >= 0.0 and r[1] * r[1] + r[2] * r[2] <= limit * limit:
        return
    w = LocalCompliance(f[9], f[10], f[11], f[12], f[13], f[14], f[15])
    r[0], r[1], r[2] = slip(w, (b[0], b[1], b[2]), mu, k, 0.0)


@njit(cache=True)
def natural_errors(r, u, bias, mu, k, rho):  # pragma: no cover - compiled
    """Compute e = r - P_K(r - ρ û) with û = u + (bias + μ‖u_T‖) n of every contact; u becomes û.

    K is the part r_N ≥ 0 of the cone ‖r_T‖ ≤ μ r_N + k.

    Inputs
    ------
    r : (nc, d) float64 [N s]
    u : (nc, d) float64, overwritten by û [m/s]
    bias, mu, k : (nc,) float64 [m/s], [-], [N s]
    rho : float64 [kg]

    Outputs
    -------
    error : (nc,) float64, ‖e‖ [N s]
    whole, largest : ‖e‖ over all contacts, and of the worst [N s]
    size : ‖r‖ over all contacts [N s]
    projected : ‖P_K(r - ρ û)‖ over all contacts [N s]
    """
    nc, d = r.shape
    error = np.empty(nc)
    total = projected = whole = largest = 0.0
    for c in range(nc):
        slide = 0.0
        for i in range(1, d):
            slide += u[c, i] * u[c, i]
        u[c, 0] += bias[c] + mu[c] * np.sqrt(slide)
        n = r[c, 0] - rho * u[c, 0]
        tangential = 0.0
        for i in range(1, d):
            t = r[c, i] - rho * u[c, i]
            tangential += t * t
        tangential = np.sqrt(tangential)
        height, radius = onto_cone(n, tangential, mu[c], k[c])
        shrink = radius / tangential if tangential > 0.0 else 0.0
        e = (r[c, 0] - height) ** 2
        total += r[c, 0] ** 2
        for i in range(1, d):
            e += (r[c, i] - shrink * (r[c, i] - rho * u[c, i])) ** 2
            total += r[c, i] ** 2
        error[c] = np.sqrt(e)
        whole += e
        largest = max(largest, e)
        projected += height * height + radius * radius
    return error, np.sqrt(whole), np.sqrt(largest), np.sqrt(total), np.sqrt(projected)


@njit(cache=True)
def onto_cone(n, t, mu, k):  # pragma: no cover - compiled
    """Return the point of {n ≥ 0, t ≤ μ n + k} that is nearest to (n, t), t ≥ 0."""
    if n >= 0.0 and t <= mu * n + k:
        return n, t
    if n < 0.0 and t <= k:
        return 0.0, t
    # foot on the line t = μ n + k
    foot = (n + mu * (t - k)) / (1.0 + mu * mu)
    return (foot, mu * foot + k) if foot > 0.0 else (0.0, k)
