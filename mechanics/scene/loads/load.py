"""What a load can be: a change of gravity, a force on stones, an imposed motion of supports.

Each is a small frozen class behind one of three protocols; to add one, write one file. Each says `until` when it
changes [s], infinity if it never ceases to: before that no scene has come to its equilibrium.
"""

from dataclasses import dataclass
from typing import Protocol

from mechanics.arrays import Array

__all__ = ["Force", "GravityChange", "Loads", "Motion", "Pose"]


class GravityChange(Protocol):
    """Changes gravity with time: a ramp, a tilting table."""

    @property
    def until(self) -> float:
        """When it ceases to change [s]."""

    def __call__(self, time: float, gravity: Array) -> Array:
        """Gravity (3,) at `time`, given that of the scene or of the change before this one [m/s²]."""


class Force(Protocol):
    """A force on some stones.

    Attributes
    ----------
    stones : codes of the stones on which it acts, the same on each
    """

    @property
    def stones(self) -> frozenset[str]:
        """Codes."""

    @property
    def until(self) -> float:
        """When it ceases to change [s]."""

    def __call__(self, time: float, centre: Array, rotation: Array) -> tuple[Array, Array]:
        """Force (n, 3) [N] and its moment about the centre of mass (n, 3) [N m] at `time`, world axes.

        `centre` (n, 3) and `rotation` (n, 3, 3), from the axes of the start to world axes, are those of the stones.
        """


@dataclass(frozen=True)
class Pose:
    """Where a motion has taken its stones since the start: x → pivot + rotation (x - pivot) + displacement.

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
    """An imposed motion of stones that are otherwise fixed: settlement, spreading, shaking.

    Attributes
    ----------
    stones : codes of the stones that move so
    """

    @property
    def stones(self) -> frozenset[str]:
        """Codes."""

    @property
    def until(self) -> float:
        """When it comes to rest [s]."""

    def pose(self, time: float) -> Pose:
        """Where the stones are at `time` [s]; continuous, and the identity at time 0."""


@dataclass(frozen=True)
class Loads:
    """Everything that acts on a scene besides constant gravity."""

    gravity: tuple[GravityChange, ...] = ()
    forces: tuple[Force, ...] = ()
    motions: tuple[Motion, ...] = ()

    @property
    def until(self) -> float:
        """When all of them have ceased to change [s]; 0 without loads."""
        gravity, forces = (one.until for one in self.gravity), (one.until for one in self.forces)
        return max([0.0, *gravity, *forces, *(one.until for one in self.motions)])
