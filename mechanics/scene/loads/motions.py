"""Imposed motions of supports: settlement, spreading, and motions of given velocities."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from scipy.spatial.transform import Rotation

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.scene.loads.load import Course, Pose
from mechanics.scene.loads.time_series import History
from mechanics.stones.validation import finite

Vector = tuple[float, float, float]


def _still() -> History:
    return History.constant(np.zeros(3))


def _no_spin() -> History:
    return History.constant(0.0)


@dataclass(frozen=True)
class ImposedMotion:
    """Stones that move as one body, with given velocities.

    Places follow from velocities by exact integration, as these are linear between the given instants.

    Attributes
    ----------
    stones : codes
    velocity : (3,) with time [m/s]
    spin : turning velocity about `axis` with time [rad/s]
    axis : (3,) right-handed, of any length
    pivot : (3,) a point of the axis at the start; it moves with `velocity` [m]
    """

    stones: frozenset[str]
    velocity: History = field(default_factory=_still)
    spin: History = field(default_factory=_no_spin)
    axis: Annotated[Vector, Setting("Axis of the spin, right-handed.", "-")] = (0.0, 0.0, 1.0)
    pivot: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for ok, what, remedy in (
            (self.velocity.components == 3, "a velocity without three components", "give x, y and z"),
            (self.spin.value.ndim == 1, "a spin that is a vector", "give one number a time, and an axis"),
            (np.isfinite(self.axis).all() and any(self.axis), f"axis = {self.axis!r}", "give a direction"),
            (finite(self.pivot, 3), f"pivot = {self.pivot!r}", "give x, y and z"),
        ):
            if not ok:
                raise SceneError(what, where="motion", remedy=remedy)

    @property
    def until(self) -> float:
        """Time at which the stones come to rest [s]; infinity if they never do."""
        moving = self.velocity.value[-1].any() or self.spin.value[-1].any()
        return float(np.inf) if moving else max(self.velocity.until, self.spin.until)

    @property
    def course(self) -> Course | None:
        """Course of the velocity, or of the spin where there is no velocity; None if neither changes."""
        changing = self.velocity if self.velocity.until else self.spin
        if not changing.until:
            return None
        stones = ", ".join(sorted(self.stones)[:2]) + ", …" * (len(self.stones) > 2)
        return Course.of(f"motion of {stones}", changing.time, changing.value, self.until)

    def pose(self, time: float) -> Pose:
        """Return the pose of the stones at `time` [s]."""
        axis = np.array(self.axis) / np.linalg.norm(self.axis)
        turn = Rotation.from_rotvec(float(self.spin.integral(time)) * axis)
        return Pose(self.velocity.integral(time), turn.as_matrix(), np.array(self.pivot))


def settlement(
    stones: Iterable[str], displacement: Vector, duration: float, start: float = 0.0
) -> ImposedMotion:
    """Move supports by `displacement` (3,) [m] within `duration` after `start` [s], without jumps of velocity."""
    return ImposedMotion(frozenset(stones), History.trapezoid(start, duration, displacement))


def spreading(
    first: Iterable[str],
    second: Iterable[str],
    direction: Vector,
    distance: float,
    duration: float,
    start: float = 0.0,
) -> tuple[ImposedMotion, ImposedMotion]:
    """Spread supports by `distance` [m]: the second group moves by half of it along `direction`, the first back."""
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        raise SceneError("direction has no length", where="spreading", remedy="give for example (1, 0, 0)")
    half = 0.5 * distance * np.array(direction) / length
    return (
        ImposedMotion(frozenset(first), History.trapezoid(start, duration, -half)),
        ImposedMotion(frozenset(second), History.trapezoid(start, duration, half)),
    )
