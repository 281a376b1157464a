"""Stones to be measured again, with reason and action: a short list, and what need not be done.

A stone is on the short list if measuring it again changes a verdict on the wall (first), or if what was measured cannot
be right. Weaknesses that no verdict depends on, and those that so many stones share that they are the survey's, are
counted.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from enum import IntEnum

from scipy.special import chdtri, ndtri

from survey.conventions import ENOUGH, RARE, SOME
from survey.faces.shapes import ShapeKind
from survey.quality.contradictions import Contradiction
from survey.quality.corners import Misplaced, Sign
from survey.quality.departures.depths import DoubtfulDepth
from survey.quality.precision import StoneQuality, SurveyQuality
from survey.records.survey import Reject

TILT = 0.5
"""Uncertainty of a plane's tilt above which it is too weak: 0.4 m behind the face it makes a hidden corner
uncertain by 3.5 mm, a third of a joint [degrees]."""

BLUNDERS = SOME
"""Part of a face's points left out above which the rest is doubtful: no fit survives half, and faults come in
patches."""

SCATTER = 1.5
"""Scatter of a face's points over that of the survey above which it was measured worse, or is rough."""

SMOOTH = 1.0 / 3.0
"""Scatter of a face's points over the stated sigma below which they were interpolated, not measured."""

_COMMON = 0.2  # part of the stones above which they share a weakness: it is the survey's
_MANY = ENOUGH  # stones from which that is so
_ROWS = 12  # longest list that is worked off in a day
_ASKED = 40  # stones of which it is asked what depends on them, the most urgent
_TOGETHER = 2  # points that chance leaves out together; of three, chance has no share
_FREEDOM = 8  # least redundancy for which a small scatter is not accidental

_SHAPE_ACTIONS = {
    ShapeKind.BEVELLED.value: "see on site: a broken edge is left out as it should be; a cut one is a face of its own",
    ShapeKind.CURVED.value: "see on site whether the face is curved; if so, split it into flat parts",
    ShapeKind.ROUGH.value: "measure more points, on the dressed margin, and look for mortar or plants on the face",
}

_CORNER_ACTIONS = {
    Sign.SEAM: "look whether there is a joint, and draw one stone or the joint",
    Sign.OVERLAP: "measure the corners of both again: one was measured on the other stone, or mistyped",
    Sign.ANGLE: "measure this corner again, unless the stone is cut so",
    Sign.SIZE: "measure its corners again, unless the stone is of that size",
}


class Urgency(IntEnum):
    """Reasons to measure a stone again, most urgent first."""

    MISSING = 1
    DEPTH = 2
    OVERLAP = 3
    UNCHECKED = 4
    BLUNDERS = 5
    ANGLE = 6
    SIZE = 7
    KIND = 8
    TWICE = 9
    TILT = 10
    SHAPE = 11
    SCATTER = 12
    SMOOTH = 13
    EDGE = 14


_WRONG = frozenset(
    {
        Urgency.MISSING,
        Urgency.DEPTH,
        Urgency.OVERLAP,
        Urgency.UNCHECKED,
        Urgency.BLUNDERS,
        Urgency.ANGLE,
        Urgency.SIZE,
        Urgency.KIND,
        Urgency.TWICE,
    }
)

_URGENCIES = {
    Sign.OVERLAP: Urgency.OVERLAP,
    Sign.ANGLE: Urgency.ANGLE,
    Sign.SIZE: Urgency.SIZE,
    Sign.SEAM: Urgency.TWICE,
}

_ALWAYS: Mapping[Urgency, str] = {
    Urgency.MISSING: "whether the wall stands, which has a hole there",
    Urgency.DEPTH: "whether the wall stands, by its weight and what it rests on",
    Urgency.OVERLAP: "whether the wall stands, whose joints are cut to fit",
}

_WEAK: Mapping[Urgency, tuple[str, str]] = {
    Urgency.MISSING: ("could not be made", "see the format of the file"),
    Urgency.DEPTH: ("a depth that contradicts other evidence", "correct the rules"),
    Urgency.OVERLAP: ("faces that overlap", "see how corners are measured"),
    Urgency.UNCHECKED: (
        "faces of three points, which nothing checks",
        "measure five points or more on a face",
    ),
    Urgency.BLUNDERS: ("a quarter of the points lies off the plane", "see which surface is measured"),
    Urgency.ANGLE: ("angles that are not usual for the kind", "see how corners are measured"),
    Urgency.SIZE: ("sizes that no other stone of the kind has", "see how corners are measured"),
    Urgency.TILT: (
        f"a tilt of the face uncertain by more than {TILT}°",
        "measure more points on a face, farther apart",
    ),
    Urgency.SHAPE: ("curved faces", "measure more points on a face"),
    Urgency.SCATTER: ("points that scatter more than the others", "measure on the dressed margin"),
    Urgency.SMOOTH: ("points that scatter too little to have been measured", "see how they were made"),
    Urgency.KIND: ("proportions that are not those of the kind", "see on site what kinds they are"),
    Urgency.TWICE: ("drawn or named twice", "see how outlines are drawn"),
    Urgency.EDGE: ("broken or cut edges", "these are left out as they should be"),
}


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
    changes : verdict that depends on it; None if none does
    """

    code: str | None
    line: int
    urgency: Urgency
    severity: float
    reason: str
    action: str
    changes: str | None = None


@dataclass(frozen=True)
class ShortList:
    """Stones to measure again, one row each, and what is not on the list.

    Attributes
    ----------
    rows : those whose measurement changes a verdict, then the others; most urgent first within each
    more : number of stones that would follow
    left : weaknesses of other stones, counted, in sentences
    """

    rows: tuple[Remeasure, ...]
    more: int
    left: tuple[str, ...]


def list_remeasures(
    stones: Sequence[StoneQuality],
    rejects: Iterable[Reject],
    contradictions: Sequence[Contradiction],
    quality: SurveyQuality,
    misplaced: Iterable[Misplaced] = (),
    depths: Iterable[DoubtfulDepth] = (),
) -> tuple[Remeasure, ...]:
    """List all reasons to measure a stone again, most urgent first; a stone may have several.

    Parameters
    ----------
    stones : all stones that were made
    rejects : those that could not be made
    contradictions : stones whose proportions are not those of their kind
    quality : of the survey; where its stated sigma is wrong, stones are compared with the estimated one
    misplaced : signs of corners out of place; the size of a stone of the wrong kind is none
    depths : depths that contradict other evidence
    """
    made = {stone.code for stone in stones}
    remeasures = [_missing(reject, made) for reject in rejects]
    scale = quality.sigma0 or 1.0
    for stone in stones:
        remeasures += _reasons(stone, scale, RARE / len(stones))
    remeasures += [
        Remeasure(
            depth.code,
            depth.line,
            Urgency.DEPTH,
            depth.score,
            f"{depth.text} ({depth.score:.1f} σ)",
            "measure its depth again, or correct the rule that gives it",
        )
        for depth in depths
    ]
    of_wrong_kind = {contradiction.code for contradiction in contradictions}
    remeasures += [
        Remeasure(
            corner.code,
            corner.line,
            _URGENCIES[corner.sign],
            corner.severity,
            corner.text,
            _CORNER_ACTIONS[corner.sign],
        )
        for corner in misplaced
        if corner.sign is not Sign.SIZE or corner.code not in of_wrong_kind
    ]
    remeasures += [
        Remeasure(
            contradiction.code,
            contradiction.line,
            Urgency.KIND,
            contradiction.significance,
            f"is called a {contradiction.kind}, but {contradiction.text} ({contradiction.significance:.1f} σ)",
            "see on site what kind of stone it is, and measure its face and depth again",
        )
        for contradiction in contradictions
    ]
    return tuple(sorted(remeasures, key=lambda remeasure: (remeasure.urgency, -remeasure.severity)))


def short_list(
    remeasures: Sequence[Remeasure], stones: int, verdicts: Callable[[str], str | None] = lambda code: None
) -> ShortList:
    """Choose what is worth a way back to the wall.

    Parameters
    ----------
    remeasures : all reasons, most urgent first
    stones : number of stones of the survey, with those that could not be made
    verdicts : what changes in the verdicts on the wall without the stone of a code; None if nothing does. Called for
        few stones, since each may take a while
    """
    counts = Counter(remeasure.urgency for remeasure in remeasures)
    common = {urgency for urgency, count in counts.items() if count >= _MANY and count > _COMMON * stones}
    individual = [remeasure for remeasure in remeasures if remeasure.urgency not in common]
    asked: dict[str, str | None] = {}
    doubted = (one for one in individual if one.urgency is not Urgency.EDGE)
    for code in dict.fromkeys(one.code for one in doubted if one.code is not None):
        asked[code] = verdicts(code) if len(asked) < _ASKED else None
    rows: dict[object, Remeasure] = {}
    for remeasure in individual:
        changes = _ALWAYS.get(remeasure.urgency) or asked.get(remeasure.code or "")
        if changes is None and remeasure.urgency not in _WRONG:
            continue
        key = remeasure.code if remeasure.code is not None else remeasure
        if key in rows:
            first = rows[key]
            reason, action = f"{first.reason}; {remeasure.reason}", first.action
            if remeasure.action not in action:
                action = f"{action}; {remeasure.action}"
            rows[key] = replace(first, reason=reason, action=action)
        else:
            rows[key] = replace(remeasure, changes=changes)
    ordered = sorted(rows.values(), key=lambda row: (row.changes is None, row.urgency, -row.severity))
    listed = {one.code for one in ordered}
    left = Counter(
        remeasure.urgency
        for remeasure in remeasures
        if remeasure.urgency in common or remeasure.code not in listed
    )
    texts = tuple(_left(urgency, left[urgency], stones, urgency in common) for urgency in sorted(left))
    return ShortList(tuple(ordered[:_ROWS]), max(len(ordered) - _ROWS, 0), texts)


def _left(urgency: Urgency, count: int, stones: int, common: bool) -> str:
    subject = f"{count} of {stones} stones" if common else f"{count} stone{'s' if count > 1 else ''}"
    weak, remedy = _WEAK[urgency]
    if common:
        return f"{subject}: {weak}; so many that it is the survey, not the stones: {remedy}"
    return f"{subject}: {weak}; no verdict depends on {'them' if count > 1 else 'it'}"


def _missing(reject: Reject, made: Set[str]) -> Remeasure:
    """Return why a stone could not be made; where another has its code the wall has no hole there."""
    line = reject.spans[0].start if reject.spans else 0
    action = reject.error.remedy or "measure the stone again"
    where = "" if reject.error.where is None else f" ({reject.error.where})"
    reason = f"could not be made: {reject.error.what}{where}"
    urgency = Urgency.TWICE if reject.code in made else Urgency.MISSING
    return Remeasure(reject.code, line, urgency, 0.0, reason, action)


def _reasons(stone: StoneQuality, scale: float, chance: float) -> Iterator[Remeasure]:
    def reason(urgency: Urgency, severity: float, words: str, action: str) -> Remeasure:
        """Return a reason to measure the stone again."""
        return Remeasure(stone.code, stone.line, urgency, severity, words, action)

    if stone.measured and stone.redundancy == 0:
        yield reason(
            Urgency.UNCHECKED,
            stone.area,
            "three points, which any plane fits: nothing checks them",
            "measure five points or more on the face",
        )
    left_out = len(stone.blunders) + len(stone.worn)
    if left_out > BLUNDERS * stone.points and not _is_chance(stone, left_out, scale, chance):
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
    yield from _scatter_reasons(stone, scale, chance, reason)


def _is_chance(stone: StoneQuality, left_out: int, scale: float, chance: float) -> bool:
    """Return whether a survey of sound stones has points as far off: two of seven are a quarter, and left out together.

    Of some 10,000 faces of seven points one loses two by chance, each at Baarda's 0.1 %.
    """
    return left_out <= _TOGETHER and stone.astray / scale < -float(ndtri(chance / (2.0 * stone.points)))


def _scatter_reasons(
    stone: StoneQuality, scale: float, chance: float, reason: Callable[[Urgency, float, str, str], Remeasure]
) -> Iterator[Remeasure]:
    relative = None if stone.sigma0 is None or not stone.measured else stone.sigma0 / scale
    sort = {ShapeKind.CURVED.value: Urgency.SHAPE, ShapeKind.BEVELLED.value: Urgency.EDGE}.get(stone.shape)
    if sort is not None:
        yield reason(sort, relative or 0.0, stone.shape_text, _SHAPE_ACTIONS[stone.shape])
    elif relative is not None and _is_rough(relative, stone.redundancy, chance):
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


def _is_rough(relative: float, redundancy: int, chance: float) -> bool:
    """Return whether the points of a face scatter more than chance allows: Σ w r² follows χ²."""
    return relative > SCATTER and redundancy * relative**2 > float(chdtri(redundancy, chance))
