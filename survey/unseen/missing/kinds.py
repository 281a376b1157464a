"""Stones that would fill a gap, from the usual lengths and depths of the kinds of a facade.

A gap of width w is filled by stones of kinds k₁ … kₙ with probability

    p(k₁ … kₙ | w) ∝ rⁿ⁻¹ · n!/(…) · Π pₖ · N(w - (n + 1) j; Σ lₖ, Σ σₖ²)

with the share pₖ of a kind, the mean lₖ and standard deviation σₖ of its length, the usual joint j, and the factor r
by which each further missing stone is less likely.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, permutations

import numpy as np

from ground.statistics.scale import deviation
from survey.arrays import Array
from survey.conventions import BROKEN, CERTAIN, GROUP, SOME, STEP
from survey.extrusion.depth import Depth
from survey.unseen.missing.gaps import CourseGap
from survey.unseen.missing.settings import MissingSettings
from survey.unseen.missing.sides import Elevation, FlatStone

_PARTICULAR = {
    *("jamb", "sill", "lintel", "mullion", "springer", "voussoir", "keystone", "quoin", "infill"),
    "support",
}
_ENOUGH = GROUP  # least number of stones of a kind for its usual length
_LEAST_SIGMA = STEP  # metres: least standard deviation of a kind's length
_FURTHER = SOME  # factor by which each further missing stone is less likely [-]
_UNLIKELY = CERTAIN  # standard deviations beyond which a length is unusual
_CLOSE = BROKEN  # metres: distance of head joints of two courses beyond which they count as staggered


@dataclass(frozen=True)
class UsualKind:
    """A kind of plain stone of a facade.

    Attributes
    ----------
    kind : its name
    length, sigma : mean and standard deviation of the lengths of its stones [m]
    share : of all plain stones [-]
    """

    kind: str
    length: float
    sigma: float
    share: float


@dataclass(frozen=True)
class Filling:
    """Stones that would fill a gap.

    Attributes
    ----------
    kinds : of the stones
    probability : against all other fillings considered [-]
    off : difference of the gap's width from their total usual length, in standard deviations
    """

    kinds: tuple[str, ...]
    probability: float
    off: float

    @property
    def usual(self) -> bool:
        """True if stones of such lengths are known on the facade."""
        return abs(self.off) <= _UNLIKELY


def usual_kinds(elevation: Elevation) -> tuple[UsualKind, ...]:
    """Return the kinds of plain stones of a facade, without those that frame openings and arches, and corners."""
    lengths: dict[str, list[float]] = {}
    for stone in elevation.stones:
        if stone.block.course is not None and stone.block.kind not in _PARTICULAR:
            lengths.setdefault(stone.block.kind, []).append(float(np.ptp(stone.outline[:, 0])))
    total = sum(len(values) for values in lengths.values())
    return tuple(
        UsualKind(
            kind,
            float(np.mean(values)),
            max(float(np.std(values, ddof=1)), _LEAST_SIGMA),
            len(values) / total,
        )
        for kind, values in sorted(lengths.items())
        if len(values) >= _ENOUGH
    )


def likeliest(
    width: float, joint: float, kinds: Sequence[UsualKind], settings: MissingSettings
) -> Filling | None:
    """Return the most likely stones in a gap; None if no kind is known."""
    candidates = []
    for count in range(1, settings.max_stones + 2):
        for some in combinations_with_replacement(kinds, count):
            sigma = math.sqrt(sum(kind.sigma**2 for kind in some))
            off = (width - (count + 1) * joint - sum(kind.length for kind in some)) / sigma
            orders = math.factorial(count) / math.prod(
                math.factorial(n) for n in Counter(kind.kind for kind in some).values()
            )
            prior = _FURTHER ** (count - 1) * orders * math.prod(kind.share for kind in some)
            candidates.append(
                (math.log(prior / sigma) - 0.5 * off**2, off, tuple(kind.kind for kind in some))
            )
    if not candidates:
        return None
    best = max(candidates)
    total = sum(math.exp(candidate[0] - best[0]) for candidate in candidates)
    return Filling(best[2], 1.0 / total, best[1])


def split(
    gap: CourseGap, filling: Filling, kinds: Sequence[UsualKind], elevation: Elevation
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Return the order of several stones in a gap, and the places along it where they meet.

    Their usual lengths are stretched to fill the gap; the order is chosen whose joints stay farthest from the head
    joints of the courses above and below.
    """
    lengths = {kind.kind: kind.length for kind in kinds}
    avoid = _joints_around(gap, elevation)

    def cuts(order: tuple[str, ...]) -> Array:
        """Return the joints between stones in an order [m]."""
        ends = np.cumsum([lengths[kind] for kind in order])
        out: Array = gap.start + gap.width * ends[:-1] / ends[-1]
        return out

    def clear(order: tuple[str, ...]) -> float:
        """Return the least distance of these joints from those to be avoided [m]."""
        places = cuts(order)
        if not len(places) or not len(avoid):
            return 0.0
        return min(float(np.abs(places[:, None] - avoid).min()), _CLOSE)

    best = max(sorted(set(permutations(filling.kinds))), key=clear)
    return best, tuple(cuts(best).tolist())


def depth_of_kind(
    kind: str, gap_beside: Sequence[FlatStone], elevation: Elevation, course: int | None
) -> Depth:
    """Return the probable depth of a kind: that of its course, or of the facade, or of its neighbours."""
    alike = [stone.block for stone in elevation.stones if stone.block.kind == kind]
    same = [block for block in alike if course is not None and block.course == course]
    blocks, where = (same, f" of course {course}") if len(same) >= _ENOUGH else (alike, "")
    if not blocks:
        blocks = [stone.block for stone in gap_beside]
        text = f"hypothesis: as its neighbours {' and '.join(block.code for block in blocks)}"
    else:
        text = f"hypothesis: median of {len(blocks)} {kind}{'s' if len(blocks) > 1 else ''}{where}"
    depths = np.array([block.depth.value for block in blocks])
    sigmas = [block.depth.sigma for block in blocks if block.depth.sigma is not None]
    value = float(np.median(depths))
    spread = deviation(depths, value)
    sigma = math.hypot(spread, float(np.median(sigmas))) if sigmas else None
    return Depth(value, sigma, text, "kind", 0)


def _joints_around(gap: CourseGap, elevation: Elevation) -> Array:
    """Return the ends of the stones above and below a gap, along the wall [m]."""
    places = []
    for bordering in (gap.below, gap.above):
        for i in sorted({i for i in bordering.tolist() if i >= 0}):
            outline = elevation.stones[i].outline
            places += [float(outline[:, 0].min()), float(outline[:, 0].max())]
    return np.array([place for place in places if gap.start < place < gap.stop])
