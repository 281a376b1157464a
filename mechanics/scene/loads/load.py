"""Protocols of loads: changes of gravity, forces on stones, imposed motions of supports.

Each load is a small frozen class behind one of three protocols, in a file of its own. Its `until` is the time from
which it is constant [s], infinity if it never is; no scene reaches equilibrium before.
"""

from dataclasses import dataclass
from typing import Protocol

from mechanics.arrays import Array

__all__ = ["Force", "GravityChange", "Loads", "Motion", "Pose"]


class GravityChange(Protocol):
    """Change of gravity with time: a ramp, a tilting table."""

    @property
    def until(self) -> float:
        """Time from which it is constant [s]."""

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
        gravity, forces = (one.until for one in self.gravity), (one.until for one in self.forces)
        return max([0.0, *gravity, *forces, *(one.until for one in self.motions)])
