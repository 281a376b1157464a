"""First-order prediction at the mean, shares of the variance, and whether the quantity is linear there."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from pipelines.assess.study.methods.failure import Evaluate

__all__ = ["NOT_LINEAR", "FirstOrder", "first_order"]

_MOST = 8
"""Unknowns that the linear prediction is tried along, the largest first."""

NOT_LINEAR = 0.1
"""Departure from the linear prediction at one standard deviation, over that of the quantity, from which it is told [-].

A tenth shifts a mean by a twentieth of the standard deviation at most.
"""


@dataclass(frozen=True)
class FirstOrder:
    """First-order prediction of a quantity.

    Attributes
    ----------
    mean, sigma : of the quantity
    gradient : (n,) by standard normal unknowns
    departure : largest difference from it at one standard deviation, over `sigma` [-]; NaN if not tried
    along : number of the unknown where it is largest; -1: none
    evaluations : samples taken
    """

    mean: float
    sigma: float
    gradient: Array
    departure: float
    along: int
    evaluations: int

    @property
    def shares(self) -> Array:
        """Shares (n,) of the variance."""
        squares: Array = self.gradient**2
        return squares / (float(squares.sum()) or 1.0)

    @property
    def linear(self) -> bool:
        """True where the quantity follows the prediction."""
        return self.departure <= NOT_LINEAR

    def predicted(self, points: Array) -> Array:
        """Return the prediction (m,) at points (m, n)."""
        predicted: Array = self.mean + points @ self.gradient
        return predicted


def first_order(evaluate: Evaluate, quantity: str, dimension: int, check: bool = True) -> FirstOrder | None:
    """Return the first-order prediction at the mean; None where there is no gradient.

    Parameters
    ----------
    quantity : its name
    check : try it at one standard deviation either way, along the unknowns with the largest shares
    """
    (middle,) = evaluate(np.zeros((1, dimension)), gradient=True)
    if not middle.done or middle.gradient is None:
        return None
    gradient, mean = middle.gradient, middle.values[quantity]
    sigma = float(np.linalg.norm(gradient))
    if not check or sigma == 0.0:
        return FirstOrder(mean, sigma, gradient, float("nan") if sigma else 0.0, -1, 1)
    largest = np.argsort(-np.abs(gradient), kind="stable")[:_MOST]
    largest = largest[gradient[largest] != 0.0]
    points = np.zeros((2 * len(largest) + 2, dimension))
    for row, number in enumerate(largest):
        points[2 * row, number], points[2 * row + 1, number] = 1.0, -1.0
    points[-2:] = np.outer([1.0, -1.0], gradient / sigma)
    found = evaluate(points)
    values = np.array([sample.values.get(quantity, np.nan) for sample in found])
    off = np.abs(values - mean - points @ gradient) / sigma
    off[np.isnan(off)] = np.inf
    worst = int(np.argmax(off))
    along = int(largest[worst // 2]) if worst < 2 * len(largest) else -1
    return FirstOrder(mean, sigma, gradient, float(off[worst]), along, 1 + len(points))
