"""Accelerograms: ground accelerations at equal steps of time, with their velocities and displacements."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array

Direction = tuple[float, float, float]
"""Direction (east, north, up) of a component."""


@dataclass(frozen=True, eq=False)
class Accelerogram:
    """One component of a ground motion.

    Velocity and displacement begin at zero and follow by the trapezoidal rule: the velocity is linear between the
    samples, and the displacement is its exact integral at them.

    Attributes
    ----------
    dt : step of time [s]
    acceleration : (n,) [m/s²]
    name : of the record
    source : file, and processing of the record
    direction : of the component; None if the file does not state it
    """

    dt: float
    acceleration: Array
    name: str
    source: str
    direction: Direction | None = None

    def __post_init__(self) -> None:
        acceleration = np.array(self.acceleration, dtype=np.float64)
        acceleration.setflags(write=False)
        object.__setattr__(self, "acceleration", acceleration)
        for ok, what, remedy in (
            (self.dt > 0 and np.isfinite(self.dt), f"dt = {self.dt!r}", "give seconds greater than 0"),
            (
                acceleration.ndim == 1 and len(acceleration) > 1,
                "less than two samples",
                "give the whole record",
            ),
            (bool(np.isfinite(acceleration).all()), "an acceleration is not finite", "give numbers"),
        ):
            if not ok:
                raise SceneError(what, where=self.source or self.name, remedy=remedy)

    def __len__(self) -> int:
        return len(self.acceleration)

    @property
    def duration(self) -> float:
        """From the first sample to the last [s]."""
        return self.dt * (len(self) - 1)

    @property
    def time(self) -> Array:
        """Instants of the samples (n,), the first at 0 [s]."""
        return np.linspace(0.0, self.duration, len(self))

    @property
    def peak(self) -> float:
        """Peak ground acceleration [m/s²]."""
        return float(np.abs(self.acceleration).max())

    @cached_property
    def velocity(self) -> Array:
        """At the samples (n,) [m/s]."""
        return _integral(self.acceleration, self.dt)

    @cached_property
    def displacement(self) -> Array:
        """At the samples (n,) [m]."""
        return _integral(self.velocity, self.dt)


def _integral(samples: Array, dt: float) -> Array:
    """Integrate from the first sample to each (n,) by the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(0.5 * dt * (samples[1:] + samples[:-1]))])
