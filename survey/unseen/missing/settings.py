"""Settings of missing stones: criteria of a hole, and of an opening."""

from dataclasses import dataclass

from survey.conventions import LARGELY, SMALL_STONE
from survey.unseen.core.settings import MAX_JOINT


@dataclass(frozen=True)
class MissingSettings:
    """Criteria of a hole in the survey of a wall, and of an opening of the wall.

    Attributes
    ----------
    max_joint : largest distance of neighbours of a course without a hole between them [m]
    min_length : least length of a stone; a narrower hole is an open joint or a break [m]
    covered : least part of a hole's length with stones, or the ground, below it, and with stones above it [-]
    max_stones : largest number of stones that fill a hole; a larger hole is an opening
    max_courses : largest height of a hole, in courses; a higher one is an opening
    """

    max_joint: float = MAX_JOINT
    min_length: float = SMALL_STONE
    covered: float = LARGELY
    max_stones: int = 3
    max_courses: int = 2
