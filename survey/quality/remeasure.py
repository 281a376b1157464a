"""Stones to be measured again, with reason and action, most urgent first."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

from survey.faces.shapes import ShapeKind
from survey.quality.contradictions import Contradiction
from survey.quality.corners import Misplaced, Sign
from survey.quality.precision import StoneQuality, SurveyQuality
from survey.records.survey import Reject

__all__ = ["BLUNDERS", "SCATTER", "SMOOTH", "TILT", "Remeasure", "Urgency", "list_remeasures"]

TILT = 0.5
"""Uncertainty of a plane's tilt above which it is too weak: 0.4 m behind the face it makes a hidden corner
uncertain by 3.5 mm, a third of a joint [degrees]."""

BLUNDERS = 0.25
"""Part of a face's points left out above which the rest is doubtful: no fit survives half, and faults come in
patches."""

SCATTER = 1.5
"""Scatter of a face's points over that of the survey above which it was measured worse, or is rough."""

SMOOTH = 1.0 / 3.0
"""Scatter of a face's points over the stated sigma below which they were interpolated, not measured."""

_UNLIKELY = 3.29  # two-sided normal quantile of 0.1 %: one sound stone in a thousand is listed by mistake
_FREEDOM = 8  # least redundancy for which a small scatter is not accidental

_SHAPE_ACTIONS = {
    ShapeKind.BEVELLED.value: "see on site: a broken edge is left out as it should be; a cut one is a face of its own",
    ShapeKind.CURVED.value: "see on site whether the face is curved; if so, split it into flat parts",
    ShapeKind.ROUGH.value: "measure more points, on the dressed margin, and look for mortar or plants on the face",
}

_CORNER_ACTIONS = {
    Sign.OVERLAP: "measure the corners of both again: one was measured on the other stone, or mistyped",
    Sign.ANGLE: "measure this corner again, unless the stone is cut so",
    Sign.SIZE: "measure its corners again, unless the stone is of that size",
}


class Urgency(IntEnum):
    """Reasons to measure a stone again, most urgent first."""

    MISSING = 1
    UNCHECKED = 2
    BLUNDERS = 3
    OVERLAP = 4
    ANGLE = 5
    SIZE = 6
    TILT = 7
    SHAPE = 8
    SCATTER = 9
    SMOOTH = 10
    KIND = 11
    EDGE = 12


@dataclass(frozen=True)
class Remeasure:
    """One reason to measure a stone again.

    Attributes
    ----------
    code : of the stone; None if even that was unreadable
    line : of the survey file, counted from 1; 0 if unknown
    urgency : class of the reason
    severity : severity among reasons of its class
    reason : defect, with numbers
    action : remedy
    """

    code: str | None
    line: int
    urgency: Urgency
    severity: float
    reason: str
    action: str


def list_remeasures(
    stones: Sequence[StoneQuality],
    rejects: Iterable[Reject],
    contradictions: Sequence[Contradiction],
    quality: SurveyQuality,
    misplaced: Iterable[Misplaced] = (),
) -> tuple[Remeasure, ...]:
    """List the stones to measure again, most urgent first; a stone may have several reasons.

    Parameters
    ----------
    stones : all stones that were made
    rejects : those that could not be made
    contradictions : stones whose proportions are not those of their kind
    quality : of the survey; where its stated sigma is wrong, stones are compared with the estimated one
    misplaced : signs of corners out of place; the size of a stone of the wrong kind is none
    """
    found = [_missing(one) for one in rejects]
    scale = quality.sigma0 or 1.0
    for stone in stones:
        found += _reasons(stone, scale)
    of_wrong_kind = {one.code for one in contradictions}
    found += [
        Remeasure(
            one.code, one.line, Urgency[one.sign.name], one.severity, one.text, _CORNER_ACTIONS[one.sign]
        )
        for one in misplaced
        if one.sign is not Sign.SIZE or one.code not in of_wrong_kind
    ]
    found += [
        Remeasure(
            one.code,
            one.line,
            Urgency.KIND,
            one.significance,
            f"is called a {one.kind}, but {one.text} ({one.significance:.1f} σ)",
            "see on site what kind of stone it is, and measure its face and depth again",
        )
        for one in contradictions
    ]
    return tuple(sorted(found, key=lambda one: (one.urgency, -one.severity)))


def _missing(reject: Reject) -> Remeasure:
    line = reject.spans[0].start if reject.spans else 0
    action = reject.error.remedy or "measure the stone again"
    where = "" if reject.error.where is None else f" ({reject.error.where})"
    reason = f"could not be made: {reject.error.what}{where}"
    return Remeasure(reject.code, line, Urgency.MISSING, 0.0, reason, action)


def _reasons(stone: StoneQuality, scale: float) -> Iterator[Remeasure]:
    def reason(urgency: Urgency, severity: float, words: str, action: str) -> Remeasure:
        return Remeasure(stone.code, stone.line, urgency, severity, words, action)

    if stone.measured and stone.redundancy == 0:
        yield reason(
            Urgency.UNCHECKED,
            stone.area,
            "three points, which any plane fits: nothing checks them",
            "measure five points or more on the face",
        )
    left_out = len(stone.blunders) + len(stone.worn)
    if left_out > BLUNDERS * stone.points:
        yield reason(
            Urgency.BLUNDERS,
            left_out / stone.points,
            f"{left_out} of {stone.points} points do not lie on its plane",
            "see which surface was measured, and measure the face again",
        )
    if stone.tilt_sigma > TILT:
        yield reason(
            Urgency.TILT,
            stone.tilt_sigma,
            f"the tilt of its plane is uncertain by {stone.tilt_sigma:.2g}°",
            "measure points at the upper and lower edge, as far apart as the face allows",
        )
    yield from _scatter_reasons(stone, scale, reason)


def _scatter_reasons(
    stone: StoneQuality, scale: float, reason: Callable[[Urgency, float, str, str], Remeasure]
) -> Iterator[Remeasure]:
    relative = None if stone.sigma0 is None or not stone.measured else stone.sigma0 / scale
    sort = {ShapeKind.CURVED.value: Urgency.SHAPE, ShapeKind.BEVELLED.value: Urgency.EDGE}.get(stone.shape)
    if sort is not None:
        yield reason(sort, relative or 0.0, stone.shape_text, _SHAPE_ACTIONS[stone.shape])
    elif relative is not None and _is_rough(relative, stone.redundancy):
        text = (
            f"its points scatter {relative:.1f} times as far as those of the survey, {stone.rms * 1e3:.1f} mm"
        )
        yield reason(Urgency.SCATTER, relative, text, _SHAPE_ACTIONS[ShapeKind.ROUGH.value])
    elif relative is not None and relative < SMOOTH and stone.redundancy >= _FREEDOM:
        text = f"its points scatter only {relative:.2f} times as far as those of the survey"
        yield reason(
            Urgency.SMOOTH,
            1.0 / max(relative, 1e-9),
            text,
            "see whether its points were measured or interpolated",
        )


def _is_rough(relative: float, redundancy: int) -> bool:
    return relative > SCATTER and (relative - 1.0) * math.sqrt(2.0 * redundancy) > _UNLIKELY
