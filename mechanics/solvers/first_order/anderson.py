"""Anderson acceleration of a fixed-point iteration (Anderson 1965; Walker & Ni 2011)."""

import numpy as np

from mechanics.arrays import Array
from mechanics.solvers.scales import ROUNDING


class Anderson:
    """Extrapolation from the last iterates of x ← G(x).

    Parameters
    ----------
    depth : number of differences of iterates
    """

    def __init__(self, depth: int) -> None:
        self._depth = depth
        self._images: list[Array] = []
        self._steps: list[Array] = []

    def __call__(self, x: Array, image: Array) -> Array | None:
        """Return the extrapolated iterate, given x and G(x); None as long as too little is known."""
        self._images.append(image.ravel().copy())
        self._steps.append((image - x).ravel())
        del self._images[: -self._depth - 1], self._steps[: -self._depth - 1]
        if len(self._steps) < 2:
            return None
        steps, images = np.diff(self._steps, axis=0), np.diff(self._images, axis=0)
        gram = steps @ steps.T
        size = float(np.trace(gram))
        if size == 0.0:
            return None
        # regularised, as late differences are nearly parallel
        gram += ROUNDING * size * np.eye(len(gram))
        weights = np.linalg.solve(gram, steps @ self._steps[-1])
        extrapolated: Array = (self._images[-1] - weights @ images).reshape(x.shape)
        return extrapolated

    def forget(self) -> None:
        """Start over: after a bad extrapolation the old iterates mislead."""
        del self._images[:-1], self._steps[:-1]
