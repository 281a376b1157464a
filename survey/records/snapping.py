"""Report on bringing the faces of solids into common planes."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class OpenContact:
    """Two stones with matching faces that could not be brought into one plane.

    Attributes
    ----------
    stones : codes of the two
    area : shared by their faces [m²]
    reason : in words
    """

    stones: tuple[str, str]
    area: float
    reason: str


@dataclass(frozen=True)
class Snapping:
    """Changes made to bring faces into common planes.

    Attributes
    ----------
    tolerance : largest movement allowed [m]
    contacts : number of pairs of faces that now share a plane
    planes : number of these planes
    moved : by code, the largest movement of a corner of the stone [m]
    folded : by code, the number of free faces that had to be folded
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
        """Largest movement of a corner [m]."""
        return max(self.moved.values(), default=0.0)
