"""Samples as methods take them, and when a sample counts as failing."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mechanics.arrays import Array
from pipelines.assess.workers.store import Sample


class Evaluate(Protocol):
    """Function that takes samples at points."""

    def __call__(self, points: Array, gradient: bool = False) -> list[Sample]:
        """Return the samples at points (m, n) in their order."""


@dataclass(frozen=True)
class Failure:
    """Limit state g = ±(value - level), negative where it fails.

    Attributes
    ----------
    quantity : its name
    level : at which it begins
    above : it fails above the level
    """

    quantity: str
    level: float
    above: bool = False

    @property
    def sign(self) -> float:
        """Factor of value - level in g."""
        return -1.0 if self.above else 1.0

    def state(self, sample: Sample) -> float:
        """Return g of a sample; NaN where it is not known."""
        value = sample.values.get(self.quantity, float("nan")) if sample.done else float("nan")
        return self.sign * (value - self.level)

    def states(self, samples: Sequence[Sample]) -> Array:
        """Return g (m,) of samples; NaN where it is not known."""
        return np.array([self.state(sample) for sample in samples])

    def gradient(self, sample: Sample) -> Array | None:
        """Return the gradient (n,) of g; None where it is not known."""
        if not sample.done or sample.gradient is None or not sample.gradient.any():
            return None
        gradient: Array = self.sign * sample.gradient
        return gradient
