"""Comparison of stones' dimensions with the usual ones of their kind."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ground.statistics.scale import deviation
from survey.arrays import Array
from survey.conventions import ENOUGH, TOUCHING
from survey.quality.precision import StoneQuality
from survey.records.survey import Canon


@dataclass(frozen=True)
class KindStandard:
    """The usual face of a kind of stone.

    Attributes
    ----------
    kind : the kind of stone
    length, height : of its face, level and upwards [m]
    length_scatter, height_scatter : standard deviation of stones from it, beyond the precision of their
        measurement [m]
    source : evidence
    stones : number of stones of the survey behind the median; 0 if archaeologists gave it
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
    """Deviation of one stone from the usual dimensions of its kind.

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
        """The larger score in absolute value."""
        return max(abs(self.length_score), abs(self.height_score))


def standards(stones: Sequence[StoneQuality], canons: Iterable[Canon]) -> dict[str, KindStandard]:
    """Return the usual face of every kind: the canon of the survey, or the median of five stones or more.

    The scatter of a median is 1.4826 times the median absolute deviation, which single outliers do not affect,
    less the part explained by the precision of the measurement.

    Parameters
    ----------
    stones : all stones of the survey
    canons : usual dimensions according to archaeologists
    """
    kind_standards = {
        canon.kind: KindStandard(
            canon.kind, canon.length, canon.height, canon.sigma, canon.sigma, canon.source, 0
        )
        for canon in canons
    }
    for kind in sorted({stone.kind for stone in stones} - set(kind_standards)):
        same_kind = [stone for stone in stones if stone.kind == kind]
        if len(same_kind) >= ENOUGH:
            kind_standards[kind] = _median(kind, same_kind)
    return kind_standards


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
    """Return the standard deviation of its dimensions; zero for a modelled solid."""
    return stone.dimension_sigma if math.isfinite(stone.dimension_sigma) else 0.0


def _score(deviation: float, precision: float, scatter: float) -> float:
    return deviation / max(math.hypot(precision, scatter), TOUCHING)


def _median(kind: str, stones: Sequence[StoneQuality]) -> KindStandard:
    precision = float(np.median([_precision(stone) for stone in stones]))
    length, length_scatter = _centre(np.array([stone.length for stone in stones]), precision)
    height, height_scatter = _centre(np.array([stone.height for stone in stones]), precision)
    source = f"median of {len(stones)} stones of this survey"
    return KindStandard(kind, length, height, length_scatter, height_scatter, source, len(stones))


def _centre(values: Array, precision: float) -> tuple[float, float]:
    """Return the median, and the robust standard deviation beyond the precision."""
    middle = float(np.median(values))
    spread = deviation(values, middle)
    return middle, math.sqrt(max(spread**2 - precision**2, 0.0))
