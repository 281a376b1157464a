"""Changes of gravity: a ramp, and a tilting table."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.spatial.transform import Rotation

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.scene.loads.load import Course
from mechanics.scene.loads.time_series import History
from mechanics.stones.settings import check_settings


@dataclass(frozen=True)
class GravityRamp:
    """Linear increase of gravity from zero, so that a structure takes up its weight without a shock."""

    duration: Annotated[float, Setting("Time until gravity is whole.", "s", above=0)]

    def __post_init__(self) -> None:
        check_settings("gravity ramp", self)

    @property
    def until(self) -> float:
        """T [s]."""
        return self.duration

    @property
    def course(self) -> Course:
        """Course of the part of gravity that acts."""
        return Course.of("ramp of gravity", np.array([0.0, self.duration]), np.array([0.0, 1.0]), self.until)

    def __call__(self, time: float, gravity: Array) -> Array:
        """Return g t/T up to the duration T, then g (3,) [m/s²]."""
        return gravity * min(max(time / self.duration, 0.0), 1.0)


@dataclass(frozen=True)
class TiltingTable:
    """Gravity on a table that turns about a horizontal axis, in the axes of the table.

    The scene is described in the axes of the table, which do not move: gravity turns by the opposite angle. The
    acceleration of the table is neglected, so it must turn slowly. An imposed motion turns the table itself.

    Attributes
    ----------
    axis : (3,) about which the table turns, right-handed; its length does not matter
    angle : by which it has turned [rad]
    """

    axis: tuple[float, float, float]
    angle: History

    def __post_init__(self) -> None:
        if not (np.isfinite(self.axis).all() and any(self.axis)):
            raise SceneError(
                f"axis = {self.axis!r}", where="tilting table", remedy="give a direction, e.g. (0, 1, 0)"
            )
        if self.angle.value.ndim != 1:
            raise SceneError("the angle is a vector", where="tilting table", remedy="give one angle a time")

    @classmethod
    def at_rate_degrees(
        cls, axis: tuple[float, float, float], rate: float, limit: float, start: float = 0.0
    ) -> "TiltingTable":
        """Return a table that turns at a constant rate [°/s] from the time `start` [s] up to a limit [°]."""
        if not (rate > 0 and limit > 0 and start >= 0):
            raise SceneError(
                f"rate = {rate:g} °/s, limit = {limit:g} °, start = {start:g} s",
                where="tilting table",
                remedy="give a rate and a limit greater than 0, from a time of 0 or later",
            )
        return cls(axis, History(np.array([start, start + limit / rate]), np.radians([0.0, limit])))

    @property
    def until(self) -> float:
        """Time from which the angle is constant [s]."""
        return self.angle.until

    @property
    def course(self) -> Course | None:
        """Course of the angle; None if it is constant."""
        return Course.of("tilt", self.angle.time, self.angle.value, self.until) if self.until else None

    def __call__(self, time: float, gravity: Array) -> Array:
        """Return gravity (3,) turned by minus the angle [m/s²]."""
        axis = np.array(self.axis) / np.linalg.norm(self.axis)
        turned: Array = Rotation.from_rotvec(-float(self.angle(time)) * axis).apply(gravity)
        return turned
