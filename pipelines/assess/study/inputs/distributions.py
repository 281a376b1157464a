"""Distributions of inputs, as functions of standard normal variables.

A value follows from a standard normal z, so that correlation, sampling plans, design points and gradients need one
space alone. Correlations are those of z; for normal inputs they are those of the values.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from ground.errors import SceneError
from mechanics.arrays import Array
from pipelines.assess.study.settings import Shape
from survey.conventions import VANISHING

_LEAST_EIGENVALUE = VANISHING
"""Least eigenvalue of a matrix of correlations that counts as positive: rounding of its entries leaves 10⁻¹⁵ [-]."""


@dataclass(frozen=True)
class Distribution:
    """Distribution of one unknown.

    Attributes
    ----------
    shape : its family
    mean, sigma : of normal and lognormal ones
    low, high, mode : of uniform and triangular ones

    >>> Distribution(Shape.UNIFORM, low=1.0, high=3.0).value(0.0)
    2.0
    >>> round(Distribution(Shape.LOGNORMAL, mean=2.0, sigma=0.2).value(1.0), 4)
    2.1988
    """

    shape: Shape
    mean: float = 0.0
    sigma: float = 1.0
    low: float = 0.0
    high: float = 1.0
    mode: float = 0.5

    def __post_init__(self) -> None:
        what = ""
        if self.shape in (Shape.NORMAL, Shape.LOGNORMAL):
            if not self.sigma >= 0.0:
                what = f"sigma = {self.sigma:g}"
            elif self.shape is Shape.LOGNORMAL and not self.mean > 0.0:
                what = f"a lognormal input with the mean {self.mean:g}"
        elif not self.low < self.high:
            what = f"low = {self.low:g} is not less than high = {self.high:g}"
        elif self.shape is Shape.TRIANGULAR and not self.low <= self.mode <= self.high:
            what = f"mode = {self.mode:g} is not between low = {self.low:g} and high = {self.high:g}"
        if what:
            raise SceneError(
                what, remedy="give sigma of 0 or more, a positive mean of lognormal ones, low < high"
            )

    @property
    def certain(self) -> bool:
        """True where it has a single value."""
        return self.shape in (Shape.NORMAL, Shape.LOGNORMAL) and self.sigma == 0.0

    def value(self, z: float) -> float:
        """Return the value at a standard normal z."""
        match self.shape:
            case Shape.NORMAL:
                return self.mean + self.sigma * z
            case Shape.LOGNORMAL:
                spread = self._log_sigma
                return self.mean * math.exp(spread * z - 0.5 * spread**2)
            case Shape.UNIFORM:
                return self.low + (self.high - self.low) * float(norm.cdf(z))
            case Shape.TRIANGULAR:
                return self._triangular(z)

    def slope(self, z: float) -> float:
        """Return the derivative of the value by z."""
        match self.shape:
            case Shape.NORMAL:
                return self.sigma
            case Shape.LOGNORMAL:
                return self._log_sigma * self.value(z)
            case Shape.UNIFORM:
                return (self.high - self.low) * float(norm.pdf(z))
            case Shape.TRIANGULAR:
                value, span = self.value(z), self.high - self.low
                if value < self.mode:
                    density = 2.0 * (value - self.low) / span / (self.mode - self.low)
                else:
                    density = 2.0 * (self.high - value) / span / max(self.high - self.mode, 1e-300)
                return float(norm.pdf(z)) / density if density > 0.0 else 0.0

    @property
    def _log_sigma(self) -> float:
        return math.sqrt(math.log1p((self.sigma / self.mean) ** 2))

    def _triangular(self, z: float) -> float:
        span, share = self.high - self.low, float(norm.cdf(z))
        rising = (self.mode - self.low) / span
        if share < rising:
            return self.low + math.sqrt(share * span * (self.mode - self.low))
        # the complement is exact in the upper tail
        return self.high - math.sqrt(float(norm.sf(z)) * span * (self.high - self.mode))


def correlation_root(matrix: Array) -> Array:
    """Return the lower L (n, n) with L Lᵀ the matrix of correlations.

    Raises
    ------
    SceneError : it is not symmetric with ones on its diagonal, or not positive definite

    >>> correlation_root(np.array([[1.0, 0.6], [0.6, 1.0]]))
    array([[1. , 0. ],
           [0.6, 0.8]])
    """
    if (
        np.abs(matrix - matrix.T).max(initial=0.0) > VANISHING
        or np.abs(np.diag(matrix) - 1.0).max(initial=0.0) > VANISHING
    ):
        raise SceneError(
            "the matrix of correlations is not symmetric with ones on its diagonal",
            remedy="give each pair the same value twice, and each input 1 with itself",
        )
    least = float(np.linalg.eigvalsh(matrix)[0]) if len(matrix) else 1.0
    if least < _LEAST_EIGENVALUE:
        raise SceneError(
            f"the matrix of correlations is not positive definite: its least eigenvalue is {least:.3g}",
            remedy="give smaller correlations, or make inputs that are the same one input",
        )
    return np.linalg.cholesky(matrix).astype(np.float64)
