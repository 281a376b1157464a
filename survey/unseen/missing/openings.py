"""Missing stones in the frame of an opening: jambs beside it, the sill below it.

The other jambs show the edges of the opening. A course whose gap reaches beyond them lacks its jamb; the lowest gap,
if it reaches beyond on both sides, lacks the sill.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from survey.conventions import WEAR
from survey.unseen.missing.gaps import CourseGap, Hole
from survey.unseen.missing.settings import MissingSettings
from survey.unseen.missing.sides import Elevation

_ENOUGH = 2  # least number of jambs on one side that show the edge of the opening
_STRAIGHT = WEAR  # metres by which they may differ
_OF_ARCHES = {"voussoir", "keystone", "springer"}
_LONGEST = 1.3  # of the longest jamb of the facade: a longer gap lacks other stones too


@dataclass(frozen=True)
class FrameGap:
    """A gap of a stone of an opening's frame.

    Attributes
    ----------
    gap : of the course
    kind : "jamb" or "sill"
    start, stop : ends of the stone on the side of the opening [m]; None: at the neighbour's joint
    """

    gap: CourseGap
    kind: str
    start: float | None
    stop: float | None


def frame_gaps(
    hole: Hole, signs: tuple[str, ...], elevation: Elevation, settings: MissingSettings
) -> Iterator[FrameGap]:
    """Return the missing stones around an opening.

    Parameters
    ----------
    hole : the opening
    signs : signs of its frame, as of `survey.unseen.missing.gaps.opening_signs`
    elevation : the facade
    settings : the least length of a stone
    """
    left = _reveal([gap.start for gap in hole.gaps if gap.left.block.kind == "jamb"])
    right = _reveal([gap.stop for gap in hole.gaps if gap.right.block.kind == "jamb"])
    if left is None or right is None or right <= left:
        return
    lengths = [float(np.ptp(stone.outline[:, 0])) for stone in elevation.stones if stone.block.kind == "jamb"]
    longest = _LONGEST * max(lengths)
    for number, gap in enumerate(hole.gaps):
        before, after = left - gap.start, gap.stop - right
        if number == 0 and min(before, after) > settings.max_joint and "a sill below" not in signs:
            if (gap.below != -1).mean() >= settings.covered:
                yield FrameGap(gap, "sill", None, None)
            continue
        # a course above the jambs, at the arch, has no jamb
        spans = gap.start <= left + _STRAIGHT and gap.stop >= right - _STRAIGHT
        spans = spans and not {gap.left.block.kind, gap.right.block.kind} & _OF_ARCHES
        if spans and settings.min_length < before <= longest and gap.left.block.kind != "jamb":
            yield FrameGap(gap, "jamb", None, left)
        if spans and settings.min_length < after <= longest and gap.right.block.kind != "jamb":
            yield FrameGap(gap, "jamb", right, None)


def _reveal(places: list[float]) -> float | None:
    """Return the edge of an opening, if enough jambs agree on it."""
    if len(places) < _ENOUGH:
        return None
    middle = float(np.median(places))
    agreed = [place for place in places if abs(place - middle) <= _STRAIGHT]
    return float(np.mean(agreed)) if len(agreed) >= max(_ENOUGH, 0.5 * len(places)) else None
