"""Numba kernels of accelerated projected gradients: the passes over all contacts between two products with W."""

import numpy as np
from numba import njit

from mechanics.problem._kernels import onto_cone

__all__ = ["curvature", "momentum", "project_step"]


@njit(cache=True)
def project_step(y, wy, shift, slide, mu, k, weight, length, new):  # pragma: no cover - compiled
    """P_K(y - (length/weight) (W y + shift + slide n)) into `new` (nc, d).

    `weight` (nc,) is the metric of each contact [1/kg]; being one number, it leaves its cone as it is.
    """
    for c in range(y.shape[0]):
        a = length / weight[c]
        n = y[c, 0] - a * (wy[c, 0] + shift[c, 0] + slide[c])
        tangential = 0.0
        for i in range(1, y.shape[1]):
            t = y[c, i] - a * (wy[c, i] + shift[c, i])
            new[c, i] = t
            tangential += t * t
        tangential = np.sqrt(tangential)
        height, radius = onto_cone(n, tangential, mu[c], k[c])
        shrink = radius / tangential if tangential > 0.0 else 0.0
        new[c, 0] = height
        for i in range(1, y.shape[1]):
            new[c, i] *= shrink


@njit(cache=True)
def curvature(new, y, wnew, wy, weight):  # pragma: no cover - compiled
    """Rayleigh's quotient of W in the metric, along new - y; zero where they are the same."""
    energy = size = 0.0
    for c in range(y.shape[0]):
        for i in range(y.shape[1]):
            d = new[c, i] - y[c, i]
            energy += d * (wnew[c, i] - wy[c, i])
            size += weight[c] * d * d
    return energy / size if size > 0.0 else 0.0


@njit(cache=True)
def momentum(new, r, wnew, wr, y, wy, u_free, mu, weight, theta, slide):  # pragma: no cover - compiled
    """One step of Nesterov's sequence: y and W y from the two last iterates, and the slides μ‖u_T‖ (nc,) at the last.

    Where the step turns against the gradient the sequence begins anew (O'Donoghue & Candès 2015). The next θ is
    given back.
    """
    turned = 0.0
    for c in range(y.shape[0]):
        for i in range(y.shape[1]):
            turned += weight[c] * (y[c, i] - new[c, i]) * (new[c, i] - r[c, i])
    after = 0.5 * theta * (np.sqrt(theta * theta + 4.0) - theta)
    beta = theta * (1.0 - theta) / (theta * theta + after)
    if turned > 0.0:
        after, beta = 1.0, 0.0
    for c in range(y.shape[0]):
        tangential = 0.0
        for i in range(y.shape[1]):
            y[c, i] = new[c, i] + beta * (new[c, i] - r[c, i])
            wy[c, i] = wnew[c, i] + beta * (wnew[c, i] - wr[c, i])
            if i > 0:
                tangential += (wnew[c, i] + u_free[c, i]) ** 2
        slide[c] = mu[c] * np.sqrt(tangential)
    return after
