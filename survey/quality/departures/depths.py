"""Depths that cannot be right, held against the rule, the kind, the neighbours and the opposite face.

Depths of stones scatter by factors, so they are compared by their logarithm. The scatter is that of the stones
compared, from medians, but no less than a tenth: masons did not cut hidden ends to measure.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ground.statistics.scale import deviation
from survey.arrays import Array
from survey.conventions import ALIKE, ENOUGH, SOME, STEP
from survey.quality.departures.shapes import critical
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality
from survey.records.survey import DepthRule

_NEIGHBOURS = 8  # stones with which one is compared
_DEPTH_SCATTER = 0.12  # scatter of depths that needs no reason, over the depth [-]
_WITHOUT = SOME  # standard deviation of a rule that states none, over its depth [-]
_PARALLEL = math.degrees(ALIKE)  # largest angle of two opposite faces [degrees]
_THICKEST = 6.0  # largest thickness of a wall whose two faces are set against each other [m]
_OPPOSITE = 0.3  # distance of a face on the other side, along and up, from the place opposite a stone [m]
_SLENDER = 0.2  # depth over the shorter side of the face below which a stone is a slab [-]
_LONG = 6.0  # depth over the longer side of the face above which it is a beam across the wall [-]


@dataclass(frozen=True)
class DoubtfulDepth:
    """A depth that contradicts other evidence.

    Attributes
    ----------
    code, line : of the stone
    against : "rule", "kind", "neighbours", "opposite face" or "own face"
    depth, expected : [m]
    score : departure over its standard deviation [-]
    text : finding, with numbers
    """

    code: str
    line: int
    against: str
    depth: float
    expected: float
    score: float
    text: str


def doubtful_depths(
    stones: Sequence[StoneQuality], facades: Sequence[Facade], rules: Sequence[DepthRule], alpha: float
) -> tuple[DoubtfulDepth, ...]:
    """Find the stones whose depth contradicts other evidence, the worst first; one finding per stone.

    Parameters
    ----------
    stones : all stones of the survey; those without a depth and modelled solids are left out
    facades : of the stones
    rules : depth rules of the survey
    alpha : probability that a survey with sound depths is given one doubt
    """
    with_depth = [i for i, stone in enumerate(stones) if stone.depth is not None and stone.source != "solid"]
    limit = critical(alpha, 3 * len(with_depth), max(float(len(with_depth)), 2.0))
    thickness = dict(_thickness(stones, with_depth, facades))
    through = {i for i, thick in thickness.items() if _reaches(stones[i], thick)}
    with_depth = [i for i in with_depth if i not in through]
    doubts = [
        *_against_rules(stones, with_depth, rules, limit),
        *_against_kind(stones, with_depth, limit),
        *_against_neighbours(stones, with_depth, facades, limit),
        *_against_opposite(stones, with_depth, thickness, limit),
    ]
    doubted = {doubt.code for doubt in doubts}
    doubts += [one for one in _against_face(stones, with_depth) if one.code not in doubted]
    order = ("opposite face", "rule", "kind", "neighbours", "own face")
    best: dict[str, DoubtfulDepth] = {}
    for doubt in sorted(doubts, key=lambda one: (order.index(one.against), -one.score)):
        best.setdefault(doubt.code, doubt)
    return tuple(sorted(best.values(), key=lambda one: (-one.score, one.code)))


def _against_rules(
    stones: Sequence[StoneQuality], known: Sequence[int], rules: Sequence[DepthRule], limit: float
) -> Iterator[DoubtfulDepth]:
    for i in known:
        stone = stones[i]
        if stone.depth_origin != "stone":
            continue
        rule = next((rule for rule in rules if _holds(rule, stone)), None)
        if rule is not None:
            sigma = (
                _relative(stone, rule.depth) ** 2
                + max((rule.sigma or _WITHOUT * rule.depth) / rule.depth, _DEPTH_SCATTER) ** 2
            )
            yield from _doubt(
                stone, rule.depth, math.sqrt(sigma), limit, "rule", f"the rule for it, {rule.source},"
            )


def _holds(rule: DepthRule, stone: StoneQuality) -> bool:
    within = rule.courses is None or (
        stone.course is not None and rule.courses[0] <= stone.course <= rule.courses[1]
    )
    return rule.kind in (None, stone.kind) and within and rule.zone in (None, stone.zone)


def _against_kind(
    stones: Sequence[StoneQuality], known: Sequence[int], limit: float
) -> Iterator[DoubtfulDepth]:
    kinds: dict[str, list[int]] = defaultdict(list)
    for i in known:
        kinds[stones[i].kind].append(i)
    for kind, members in kinds.items():
        if len(members) >= ENOUGH:
            yield from _among(
                stones, members, members, limit, "kind", f"the other stones of its kind, {kind},"
            )


def _among(
    stones: Sequence[StoneQuality],
    own: Sequence[int],
    beside: Sequence[int],
    limit: float,
    against: str,
    words: str,
) -> Iterator[DoubtfulDepth]:
    logs = np.log([stones[i].depth or math.nan for i in beside])
    middle = float(np.median(logs))
    spread = max(deviation(logs, middle), _DEPTH_SCATTER)
    for i in own:
        yield from _doubt(
            stones[i],
            math.exp(middle),
            math.hypot(spread, _relative(stones[i], math.exp(middle))),
            limit,
            against,
            words,
        )


def _against_neighbours(
    stones: Sequence[StoneQuality], with_depth: Sequence[int], facades: Sequence[Facade], limit: float
) -> Iterator[DoubtfulDepth]:
    """Compare a stone with those beside it, where its kind has too few."""
    counts: dict[str, int] = defaultdict(int)
    for i in with_depth:
        counts[stones[i].kind] += 1
    there = set(with_depth)
    for facade in facades:
        members = [i for i in facade.members.tolist() if i in there]
        rare = [i for i in members if counts[stones[i].kind] < ENOUGH]
        if len(members) <= ENOUGH or not rare:
            continue
        places = np.array([facade.frame.flatten(stones[i].outline).mean(axis=0) for i in members])
        tree = cKDTree(places)
        for i in rare:
            near = tree.query(places[members.index(i)], k=min(_NEIGHBOURS + 1, len(members)))[1]
            beside = [members[k] for k in np.ravel(near).tolist() if members[k] != i]
            yield from _among(stones, [i], beside, limit, "neighbours", "the stones beside it")


def _thickness(
    stones: Sequence[StoneQuality], known: Sequence[int], facades: Sequence[Facade]
) -> Iterator[tuple[int, float]]:
    """Yield the distance of stones to the face on the other side of the wall [m]."""
    upright = [facade for facade in facades if facade.azimuth is not None]
    for facade in upright:
        behind = [
            i
            for opposite in upright
            if facade.frame.axes[2] @ opposite.frame.axes[2] <= -math.cos(math.radians(_PARALLEL))
            for i in opposite.members.tolist()
        ]
        if not behind:
            continue
        boxes = _boxes(stones, facade, behind)
        for i in sorted(set(facade.members.tolist()).intersection(known)):
            (box,) = _boxes(stones, facade, [i])
            apart = np.maximum(boxes[:, :2] - box[2:4], box[:2] - boxes[:, 2:4]).max(axis=1)
            thick = box[4] - boxes[:, 4]
            facing = (apart < _OPPOSITE) & (thick > 0.0) & (thick < _THICKEST)
            if facing.any():
                yield i, float(np.median(thick[facing]))


def _reaches(stone: StoneQuality, thick: float) -> bool:
    """Return whether a stone reaches through a wall, as a through stone does: nothing is odd about its depth."""
    assert stone.depth is not None
    return abs(stone.depth - thick) <= STEP + 3.0 * _sigma(stone)


def _sigma(stone: StoneQuality) -> float:
    """Return the standard deviation of the end of a stone [m]."""
    face = stone.offset_sigma if math.isfinite(stone.offset_sigma) else 0.0
    return math.hypot(stone.depth_sigma or 0.0, face)


def _against_opposite(
    stones: Sequence[StoneQuality], known: Sequence[int], thickness: Mapping[int, float], limit: float
) -> Iterator[DoubtfulDepth]:
    """Compare a depth with the distance to the face on the other side of the wall."""
    for i in known:
        stone, thick = stones[i], thickness.get(i)
        assert stone.depth is not None
        if thick is None or stone.depth - thick - STEP <= limit * _sigma(stone):
            continue
        text = (
            f"it is {stone.depth:.2f} m deep and comes out of the opposite face, {thick:.2f} m behind its own"
        )
        score = (stone.depth - thick - STEP) / max(_sigma(stone), 0.05 * thick)
        yield DoubtfulDepth(stone.code, stone.line, "opposite face", stone.depth, thick, score, text)


def _boxes(stones: Sequence[StoneQuality], facade: Facade, members: Sequence[int]) -> Array:
    """Return low and high ends along and up, and the place outwards of faces, (m, 5)."""
    rows = []
    for i in members:
        flat = facade.frame.flatten(stones[i].outline)
        out = float(((stones[i].outline - facade.frame.origin) @ facade.frame.axes[2]).mean())
        rows.append([*flat.min(axis=0), *flat.max(axis=0), out])
    return np.array(rows)


def _against_face(stones: Sequence[StoneQuality], known: Sequence[int]) -> Iterator[DoubtfulDepth]:
    for i in known:
        stone = stones[i]
        assert stone.depth is not None
        short, long = sorted((stone.length, stone.height))
        expected = _SLENDER * short if stone.depth < _SLENDER * short else _LONG * long
        if short > 0.0 and (stone.depth < _SLENDER * short or stone.depth > _LONG * long):
            text = (
                f"it is {stone.depth:.2f} m deep behind a face of {stone.length:.2f} by {stone.height:.2f} m"
            )
            score = abs(math.log(stone.depth / expected)) / _DEPTH_SCATTER
            yield DoubtfulDepth(stone.code, stone.line, "own face", stone.depth, expected, score, text)


def _doubt(
    stone: StoneQuality, expected: float, sigma: float, limit: float, against: str, words: str
) -> Iterator[DoubtfulDepth]:
    assert stone.depth is not None
    score = abs(math.log(stone.depth / expected)) / sigma
    if score > limit:
        verb = "have" if against in ("kind", "neighbours") else "says"
        text = f"it is {stone.depth:.2f} m deep, {words} {verb} {expected:.2f} m"
        yield DoubtfulDepth(stone.code, stone.line, against, stone.depth, expected, score, text)


def _relative(stone: StoneQuality, expected: float) -> float:
    """Return the standard deviation of a depth over the depth that it would have."""
    assert stone.depth is not None
    return (stone.depth_sigma or 0.0) / max(stone.depth, expected)
