"""Numba kernels of accelerated projected gradients: the passes over all contacts between two products with W."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.problem._kernels import onto_cone

__all__ = ["Pair", "Terms", "curvature", "momentum", "project_step"]


class Pair(NamedTuple):
    """Impulses of one iterate and W times them.

    Attributes
    ----------
    impulse : (nc, d) float64, r [N s]
    product : (nc, d) float64, W r [m/s]
    """

    impulse: NDArray[np.float64]
    product: NDArray[np.float64]


class Terms(NamedTuple):
    """Right side, laws and metric of a problem.

    Attributes
    ----------
    shift : (nc, d) float64, u_free with the bias in its normal part [m/s]
    u_free : (nc, d) float64 [m/s]
    friction, cohesion : (nc,) float64 [-], [N s]
    weight : (nc,) float64, metric of each contact; being one number, it leaves its cone as it is [1/kg]
    """

    shift: NDArray[np.float64]
    u_free: NDArray[np.float64]
    friction: NDArray[np.float64]
    cohesion: NDArray[np.float64]
    weight: NDArray[np.float64]


@njit(cache=True)
def project_step(ahead, slide, length, terms, new):  # pragma: no cover - compiled
    """Compute P_K(y - (length/weight) (W y + shift + slide n)).

    Inputs
    ------
    ahead : Pair of y
    slide : (nc,) float64, μ‖u_T‖ [m/s]
    length : float64 [-]
    terms : Terms

    Outputs
    -------
    new : (nc, d) float64, written [N s]
    """
    (y, wy), shift = ahead, terms.shift
    for c in range(y.shape[0]):
        a = length / terms.weight[c]
        n = y[c, 0] - a * (wy[c, 0] + shift[c, 0] + slide[c])
        tangential = 0.0
        for i in range(1, y.shape[1]):
            t = y[c, i] - a * (wy[c, i] + shift[c, i])
            new[c, i] = t
            tangential += t * t
        tangential = np.sqrt(tangential)
        height, radius = onto_cone(n, tangential, terms.friction[c], terms.cohesion[c])
        shrink = radius / tangential if tangential > 0.0 else 0.0
        new[c, 0] = height
        for i in range(1, y.shape[1]):
            new[c, i] *= shrink


@njit(cache=True)
def curvature(new, ahead, weight):  # pragma: no cover - compiled
    """Return Rayleigh's quotient of W in the metric, along new - y.

    Inputs
    ------
    new, ahead : Pair of the new iterate and of y
    weight : (nc,) float64 [1/kg]

    Outputs
    -------
    float64 [-], zero where they are the same
    """
    y = ahead.impulse
    energy = size = 0.0
    for c in range(y.shape[0]):
        for i in range(y.shape[1]):
            d = new.impulse[c, i] - y[c, i]
            energy += d * (new.product[c, i] - ahead.product[c, i])
            size += weight[c] * d * d
    return energy / size if size > 0.0 else 0.0


@njit(cache=True)
def momentum(new, last, ahead, terms, theta, slide):  # pragma: no cover - compiled
    """Make one step of Nesterov's sequence, from the two last iterates.

    Where the step turns against the gradient the sequence begins again (O'Donoghue & Candès 2015).

    Inputs
    ------
    new, last : Pair of the two last iterates
    terms : Terms
    theta : float64, θ of the sequence

    Outputs
    -------
    ahead : Pair of y, written
    slide : (nc,) float64, μ‖u_T‖ at the last iterate, written [m/s]
    float64, the next θ
    """
    (new_r, new_w), (r, wr), (y, wy) = new, last, ahead
    turned = 0.0
    for c in range(y.shape[0]):
        for i in range(y.shape[1]):
            turned += terms.weight[c] * (y[c, i] - new_r[c, i]) * (new_r[c, i] - r[c, i])
    after = 0.5 * theta * (np.sqrt(theta * theta + 4.0) - theta)
    beta = theta * (1.0 - theta) / (theta * theta + after)
    if turned > 0.0:
        after, beta = 1.0, 0.0
    for c in range(y.shape[0]):
        tangential = 0.0
        for i in range(y.shape[1]):
            y[c, i] = new_r[c, i] + beta * (new_r[c, i] - r[c, i])
            wy[c, i] = new_w[c, i] + beta * (new_w[c, i] - wr[c, i])
            if i > 0:
                tangential += (new_w[c, i] + terms.u_free[c, i]) ** 2
        slide[c] = terms.friction[c] * np.sqrt(tangential)
    return after
