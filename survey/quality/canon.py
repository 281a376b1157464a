"""Dimensions against theory: how far stones are from the usual ones of their kind."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.quality.precision import StoneQuality
from survey.records.survey import Canon

__all__ = ["ENOUGH", "Deviation", "KindStandard", "deviations", "standards"]


ENOUGH = 5
"""Stones of a kind from which a median and its scatter can be had."""

_EXACT = 1e-6  # metres: nothing is known better than this
_CONSISTENT = 1.4826  # median absolute deviation to standard deviation, of a normal distribution


@dataclass(frozen=True)
class KindStandard:
    """The usual face of a kind of stone.

    Attributes
    ----------
    kind : the kind of stone
    length, height : of its face, level and upwards [m]
    length_scatter, height_scatter : how much stones differ from it, beyond the precision of their measurement,
        standard deviation [m]
    source : the evidence, in words
    stones : how many stones of the survey it is the median of; 0 if archaeologists gave it
    """

    kind: str
    length: float
    height: float
    length_scatter: float
    height_scatter: float
    source: str
    stones: int


@dataclass(frozen=True, slots=True)
class Deviation:
    """How far one stone is from the usual ones of its kind.

    Attributes
    ----------
    code, kind : of the stone
    length, height : measured minus usual [m]
    length_score, height_score : the same over the standard deviation of measurement and scatter together [-]
    """

    code: str
    kind: str
    length: float
    height: float
    length_score: float
    height_score: float

    @property
    def worst(self) -> float:
        """The larger score, without its sign."""
        return max(abs(self.length_score), abs(self.height_score))


def standards(stones: Sequence[StoneQuality], canons: Iterable[Canon]) -> dict[str, KindStandard]:
    """The usual face of every kind: the canon of the survey, else the median of five stones or more.

    The scatter of a median is 1.4826 times the median absolute deviation, which single odd stones do not
    move, without the part that the precision of the measurement explains.

    Parameters
    ----------
    stones : all stones of the survey
    canons : what archaeologists hold for the usual dimensions
    """
    found = {
        one.kind: KindStandard(one.kind, one.length, one.height, one.sigma, one.sigma, one.source, 0)
        for one in canons
    }
    for kind in sorted({stone.kind for stone in stones} - set(found)):
        own = [stone for stone in stones if stone.kind == kind]
        if len(own) >= ENOUGH:
            found[kind] = _median(kind, own)
    return found


def deviations(stones: Sequence[StoneQuality], usual: Mapping[str, KindStandard]) -> tuple[Deviation, ...]:
    """Compare every stone with its kind, in the order given; stones of kinds without a standard are left out."""
    return tuple(_deviation(stone, usual[stone.kind]) for stone in stones if stone.kind in usual)


def _deviation(stone: StoneQuality, usual: KindStandard) -> Deviation:
    length, height = stone.length - usual.length, stone.height - usual.height
    return Deviation(
        stone.code,
        stone.kind,
        length,
        height,
        _score(length, _precision(stone), usual.length_scatter),
        _score(height, _precision(stone), usual.height_scatter),
    )


def _precision(stone: StoneQuality) -> float:
    """Standard deviation of its dimensions; those of a solid that was modelled are taken as they are."""
    return stone.dimension_sigma if math.isfinite(stone.dimension_sigma) else 0.0


def _score(deviation: float, precision: float, scatter: float) -> float:
    return deviation / max(math.hypot(precision, scatter), _EXACT)


def _median(kind: str, stones: Sequence[StoneQuality]) -> KindStandard:
    precision = float(np.median([_precision(stone) for stone in stones]))
    length, length_scatter = _centre(np.array([stone.length for stone in stones]), precision)
    height, height_scatter = _centre(np.array([stone.height for stone in stones]), precision)
    source = f"median of {len(stones)} stones of this survey"
    return KindStandard(kind, length, height, length_scatter, height_scatter, source, len(stones))


def _centre(values: Array, precision: float) -> tuple[float, float]:
    """Median, and robust standard deviation beyond what the precision explains."""
    middle = float(np.median(values))
    spread = _CONSISTENT * float(np.median(np.abs(values - middle)))
    return middle, math.sqrt(max(spread**2 - precision**2, 0.0))
