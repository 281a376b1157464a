"""What counts as a missing stone, and what as an opening."""

from dataclasses import dataclass

__all__ = ["MissingSettings"]


@dataclass(frozen=True)
class MissingSettings:
    """What counts as a hole in the survey of a wall, and what as an opening of the wall.

    Attributes
    ----------
    max_joint : neighbours of a course that are farther apart have a hole between them [m]
    min_length : of a stone; a narrower hole is an open joint or a break [m]
    covered : least part of a hole's length with stones, or the ground, below it, and with stones above it [-]
    max_stones : a hole that would take more stones is an opening
    max_courses : so is one that is higher
    """

    max_joint: float = 0.06
    min_length: float = 0.15
    covered: float = 0.7
    max_stones: int = 3
    max_courses: int = 2
