"""Protocols of loads: changes of gravity, forces on stones, imposed motions of supports.

Each load is a small frozen class behind one of three protocols, in a file of its own. Its `until` is the time from
which it is constant [s], infinity if it never is; no scene reaches equilibrium before. Its `course` tells when it
is largest; None where it never changes.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mechanics.arrays import Array

_STRONG = 0.95  # of the integral of the square, at which strong motion ends by its usual definition (Trifunac 1975) [-]
_SAMPLES = 1000  # instants beside those given, so that long pieces are integrated too
_TIME_ROUNDING = 1e-9  # of an instant, by which rounding may place the end of a run before it [-]


@dataclass(frozen=True)
class Course:
    """Course of a load in time.

    Attributes
    ----------
    name : of the load, in words
    peak : instant of its largest value [s]
    strong : end of its strong part: 95 % of the integral of its square, of an acceleration the Arias intensity [s]
    until : time from which it is constant [s]
    """

    name: str
    peak: float
    strong: float
    until: float

    @classmethod
    def of(cls, name: str, time: Array, value: Array, until: float) -> "Course":
        """Return the course of a load with values (n,) or (n, k), linear between instants (n,) [s]."""
        rows = value.reshape(len(time), -1)
        size = np.linalg.norm(rows, axis=1)
        fine = np.union1d(time, np.linspace(time[0], time[-1], _SAMPLES))
        squares = sum(np.interp(fine, time, column) ** 2 for column in rows.T)
        square = np.concatenate([[0.0], np.cumsum(np.diff(fine) * (squares[1:] + squares[:-1]))])
        strong = float(np.interp(_STRONG * square[-1], square, fine)) if square[-1] > 0.0 else float(time[0])
        return cls(name, float(time[size.argmax()]), strong, until)

    def missed(self, end: float) -> bool:
        """Return True where a run that ends at `end` [s] ends before the peak or the end of the strong part."""
        return end < max(self.peak, self.strong) * (1.0 - _TIME_ROUNDING)

    def beyond(self, end: float) -> str:
        """Return the lack of a run that ends at `end` [s], in words; nothing where the load is over by then."""
        if not end < self.until * (1.0 - _TIME_ROUNDING):
            return ""
        rest = "" if math.isinf(self.until) else f", and it goes on until {self.until:.4g} s"
        if end < self.peak * (1.0 - _TIME_ROUNDING):
            return (
                f"the run ends at {end:.4g} s, before the peak of the {self.name} at {self.peak:.4g} s{rest}"
            )
        if self.missed(end):
            return (
                f"the run ends at {end:.4g} s, before the strong part of the {self.name} does at {self.strong:.4g} s; "
                f"its peak is at {self.peak:.4g} s{rest}"
            )
        return f"the run ends at {end:.4g} s, before the {self.name} does; its peak is at {self.peak:.4g} s{rest}"


class GravityChange(Protocol):
    """Change of gravity with time: a ramp, a tilting table."""

    @property
    def until(self) -> float:
        """Time from which it is constant [s]."""

    @property
    def course(self) -> "Course | None":
        """Course in time; None if it is constant."""

    def __call__(self, time: float, gravity: Array) -> Array:
        """Return gravity (3,) at `time`, from that of the scene or of the preceding change [m/s²]."""


class Force(Protocol):
    """Force on some stones.

    Attributes
    ----------
    stones : codes of the stones on which it acts, the same on each
    """

    @property
    def stones(self) -> frozenset[str]:
        """Codes."""

    @property
    def until(self) -> float:
        """Time from which it is constant [s]."""

    @property
    def course(self) -> "Course | None":
        """Course in time; None if it is constant."""

    def __call__(self, time: float, centre: Array, rotation: Array) -> tuple[Array, Array]:
        """Return the force (n, 3) [N] and its moment about the centre of mass (n, 3) [N m] at `time`, world axes.

        `centre` (n, 3) and `rotation` (n, 3, 3), from the axes of the start to world axes, are those of the stones.
        """


@dataclass(frozen=True)
class Pose:
    """Displacement of stones by a motion since the start: x → pivot + rotation (x - pivot) + displacement.

    Attributes
    ----------
    displacement : (3,) [m]
    rotation : (3, 3) [-]
    pivot : (3,) [m]
    """

    displacement: Array
    rotation: Array
    pivot: Array


class Motion(Protocol):
    """Imposed motion of stones that are otherwise fixed: settlement, spreading, shaking.

    Attributes
    ----------
    stones : codes of these stones
    """

    @property
    def stones(self) -> frozenset[str]:
        """Codes."""

    @property
    def until(self) -> float:
        """Time at which it comes to rest [s]."""

    @property
    def course(self) -> "Course | None":
        """Course in time; None if it is constant."""

    def pose(self, time: float) -> Pose:
        """Return the pose of the stones at `time` [s]; continuous, and the identity at time 0."""


@dataclass(frozen=True)
class Loads:
    """All loads on a scene besides constant gravity."""

    gravity: tuple[GravityChange, ...] = ()
    forces: tuple[Force, ...] = ()
    motions: tuple[Motion, ...] = ()

    @property
    def until(self) -> float:
        """Time from which all of them are constant [s]; 0 without loads."""
        gravity, forces = (one.until for one in self.gravity), (force.until for force in self.forces)
        return max([0.0, *gravity, *forces, *(motion.until for motion in self.motions)])

    @property
    def courses(self) -> tuple[Course, ...]:
        """Courses of the loads that change with time."""
        gravity, forces = (one.course for one in self.gravity), (force.course for force in self.forces)
        found = (*gravity, *forces, *(motion.course for motion in self.motions))
        return tuple(course for course in found if course is not None)

    def unfinished(self, end: float, missed: bool) -> tuple[str, ...]:
        """Return in words the loads that are not over at the `end` of a run [s].

        With `missed` those alone of which it misses the peak or strong part, otherwise the other ones.
        """
        beyond = (course.beyond(end) for course in self.courses if course.missed(end) is missed)
        return tuple(dict.fromkeys(filter(None, beyond)))
