"""What bringing the faces of solids into common planes has changed, and what it has left open."""

from collections.abc import Mapping
from dataclasses import dataclass

__all__ = ["OpenContact", "Snapping"]


@dataclass(frozen=True)
class OpenContact:
    """Two stones whose faces match, but could not be brought into one plane.

    Attributes
    ----------
    stones : codes of the two
    area : that their faces share [m²]
    reason : why, in words
    """

    stones: tuple[str, str]
    area: float
    reason: str


@dataclass(frozen=True)
class Snapping:
    """What bringing faces into common planes has changed.

    Attributes
    ----------
    tolerance : within which it was done [m]
    contacts : pairs of faces that share a plane now
    planes : how many planes these are
    moved : by code, how far the corner of the stone moved that moved farthest [m]
    folded : by code, how many free faces had to be folded
    left_open : contacts that could not be closed
    """

    tolerance: float
    contacts: int
    planes: int
    moved: Mapping[str, float]
    folded: Mapping[str, int]
    left_open: tuple[OpenContact, ...]

    @property
    def largest_movement(self) -> float:
        """How far the corner moved that moved farthest [m]."""
        return max(self.moved.values(), default=0.0)
