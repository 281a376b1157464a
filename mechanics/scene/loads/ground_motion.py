"""Ground motions: accelerograms as imposed motions of the supports."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.load import Course, Pose
from mechanics.scene.loads.time_series import History

_BRAKING = 0.1  # deceleration after a record over its peak, too little to shake a stone by itself [-]


@dataclass(frozen=True)
class Component:
    """One record and its direction (3,), of any length."""

    direction: tuple[float, float, float]
    record: Accelerogram

    def __post_init__(self) -> None:
        if not (np.isfinite(self.direction).all() and any(self.direction)):
            raise SceneError(
                f"direction = {self.direction!r}", where="ground motion", remedy="give e.g. (1, 0, 0)"
            )


@dataclass(frozen=True)
class GroundMotion:
    """Recorded motion of the ground with its stones.

    The velocity is linear between the samples. Whatever is left of it at the last one goes to zero linearly within
    `braking_time`, and the ground then stays where it is.

    Attributes
    ----------
    stones : codes
    components : up to three, in different directions
    start : time of the first sample; the ground rests before
    """

    stones: frozenset[str]
    components: tuple[Component, ...]
    scale: Annotated[float, Setting("Factor on the records.", "-")] = 1.0
    start: Annotated[float, Setting("Start time.", "s", at_least=0)] = 0.0

    def __post_init__(self) -> None:
        directions = np.array([component.direction for component in self.components], dtype=float).reshape(
            -1, 3
        )
        # records in parallel directions would merely add up
        if not self.components or np.linalg.matrix_rank(directions) < len(directions):
            raise SceneError(
                f"{len(self.components)} components whose directions are not independent",
                where="ground motion",
                remedy="give one record for each of up to three directions",
            )
        if not (np.isfinite(self.scale) and self.start >= 0):
            raise SceneError(
                f"scale = {self.scale!r}, start = {self.start!r} s",
                where="ground motion",
                remedy="give a number, and a time of 0 or later",
            )

    @property
    def until(self) -> float:
        """Time at which the ground comes to rest [s]."""
        return max(one.until for one in self._velocity)

    @property
    def course(self) -> Course:
        """Course of the acceleration of the strongest component."""
        record = max((component.record for component in self.components), key=lambda one: one.peak)
        return Course.of("ground motion", self.start + record.time, record.acceleration, self.until)

    def pose(self, time: float) -> Pose:
        """Return the pose of the ground at `time` [s]."""
        return Pose(sum((one.integral(time) for one in self._velocity), np.zeros(3)), np.eye(3), np.zeros(3))

    @cached_property
    def _velocity(self) -> tuple[History, ...]:
        """Velocity (3,) of each component with time [m/s]."""
        return tuple(self._history(component) for component in self.components)

    def _history(self, component: Component) -> History:
        record = component.record
        direction = np.array(component.direction) / np.linalg.norm(component.direction)
        speed = np.append(self.scale * record.velocity, 0.0)
        instants = np.append(record.time, record.duration + braking_time(record))
        return History(self.start + instants, np.outer(speed, direction))


def braking_time(record: Accelerogram) -> float:
    """Return the time within which the ground comes to rest after a record [s].

    A record that ends at rest needs one step. Any other one, such as a single pulse, leaves a velocity, which is taken
    away with a tenth of the record's peak acceleration: within one step it would be a blow.
    """
    left = abs(float(record.velocity[-1]))
    return max(record.dt, left / (_BRAKING * record.peak)) if left > 0 else record.dt
