"""Stones that are missing in the frame of an opening: jambs beside it, the sill below it.

The other jambs tell where the opening begins and ends. A course whose gap reaches beyond that lacks its jamb; the
lowest gap, if it reaches beyond on both sides, lacks the sill.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from survey.unseen.missing.gaps import CourseGap, Hole
from survey.unseen.missing.settings import MissingSettings
from survey.unseen.missing.sides import Elevation

__all__ = ["FrameGap", "frame_gaps"]

_ENOUGH = 2  # jambs on one side that tell where the opening is
_STRAIGHT = 0.03  # metres by which they may differ
_OF_ARCHES = {"voussoir", "keystone", "springer"}
_LONGEST = 1.3  # times the longest jamb of the facade: a longer gap lacks other stones too


@dataclass(frozen=True)
class FrameGap:
    """Where a stone of an opening's frame is missing.

    Attributes
    ----------
    gap : of the course
    kind : "jamb" or "sill"
    start, stop : where the stone ends on the side of the opening [m]; None: at the neighbour's joint
    """

    gap: CourseGap
    kind: str
    start: float | None
    stop: float | None


def frame_gaps(
    hole: Hole, signs: tuple[str, ...], elevation: Elevation, settings: MissingSettings
) -> Iterator[FrameGap]:
    """The stones that are missing around an opening.

    Parameters
    ----------
    hole : the opening
    signs : what frames it, as `missing_stones_gaps.opening_signs` says
    elevation : the facade
    settings : the least length of a stone
    """
    left = _reveal([gap.start for gap in hole.gaps if gap.left.block.kind == "jamb"])
    right = _reveal([gap.stop for gap in hole.gaps if gap.right.block.kind == "jamb"])
    if left is None or right is None or right <= left:
        return
    lengths = [float(np.ptp(one.outline[:, 0])) for one in elevation.stones if one.block.kind == "jamb"]
    longest = _LONGEST * max(lengths)
    for number, gap in enumerate(hole.gaps):
        before, after = left - gap.start, gap.stop - right
        if number == 0 and min(before, after) > settings.max_joint and "a sill below" not in signs:
            if (gap.below != -1).mean() >= settings.covered:
                yield FrameGap(gap, "sill", None, None)
            continue
        # a course above the jambs, at the arch, is none of theirs
        spans = gap.start <= left + _STRAIGHT and gap.stop >= right - _STRAIGHT
        spans = spans and not {gap.left.block.kind, gap.right.block.kind} & _OF_ARCHES
        if spans and settings.min_length < before <= longest and gap.left.block.kind != "jamb":
            yield FrameGap(gap, "jamb", None, left)
        if spans and settings.min_length < after <= longest and gap.right.block.kind != "jamb":
            yield FrameGap(gap, "jamb", right, None)


def _reveal(places: list[float]) -> float | None:
    """Where an opening begins or ends, if enough jambs agree on it."""
    if len(places) < _ENOUGH:
        return None
    middle = float(np.median(places))
    agreed = [place for place in places if abs(place - middle) <= _STRAIGHT]
    return float(np.mean(agreed)) if len(agreed) >= max(_ENOUGH, 0.5 * len(places)) else None
