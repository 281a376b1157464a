"""First-order prediction at the mean, shares of the variance, and whether the quantity is linear there."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from pipelines.assess.study.methods.failure import Evaluate
from survey.conventions import PER_MILLE, TENTH

_MOST = 8
"""Unknowns that the linear prediction is tried along, the largest first."""

NOT_LINEAR = TENTH
"""Departure from the linear prediction at one standard deviation, over that of the quantity, from which it is told [-].

A tenth shifts a mean by a twentieth of the standard deviation at most.
"""

_BESIDE = PER_MILLE
"""Distance from the mean at which derivatives of either side are taken, in standard deviations [-].

A second mechanism within 10⁻⁶ of a limit load takes over nearer than that: λ moves by 5·10⁻⁵ of itself.
"""

_FEW = 3
"""Samples for each unknown from which a regression tells shares of the variance."""


@dataclass(frozen=True)
class Sides:
    """Derivatives by an unknown to either side of the mean, where they differ.

    Attributes
    ----------
    along : number of the unknown
    below, above : derivatives for values less and greater than the mean, by the standard normal unknown
    """

    along: int
    below: float
    above: float


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
    sides : unknowns, of the largest, by which the quantity has two derivatives: several mechanisms meet at the mean
    """

    mean: float
    sigma: float
    gradient: Array
    departure: float
    along: int
    evaluations: int
    sides: tuple[Sides, ...] = ()

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
    axes = np.eye(dimension)[largest]
    points = np.vstack(
        [axes, -axes, np.outer([1.0, -1.0], gradient / sigma), _BESIDE * axes, -_BESIDE * axes]
    )
    found = evaluate(points)
    values = np.array([sample.values.get(quantity, np.nan) for sample in found])
    count = len(largest)
    off = np.abs(values - mean - points @ gradient)[: 2 * count + 2] / sigma
    off[np.isnan(off)] = np.inf
    worst = int(np.argmax(off))
    along = int(largest[worst % count]) if worst < 2 * count else -1
    above, below = (values[2 * count + 2 :].reshape(2, count) - mean) / _BESIDE * [[1.0], [-1.0]]
    sides = tuple(
        Sides(int(largest[row]), float(below[row]), float(above[row]))
        for row in np.flatnonzero(np.abs(above - below) > NOT_LINEAR * sigma)
    )
    return FirstOrder(mean, sigma, gradient, float(off[worst]), along, 1 + len(points), sides)


def regressed(points: Array, values: Array) -> Array | None:
    """Return the gradient (n,) of a linear regression; None where there are too few samples."""
    known = np.isfinite(values)
    if int(known.sum()) < _FEW * (points.shape[1] + 1):
        return None
    design = np.column_stack([np.ones(int(known.sum())), points[known]])
    found, *_ = np.linalg.lstsq(design, values[known], rcond=None)
    return found[1:].astype(np.float64)
