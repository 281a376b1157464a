"""Stones whose measured proportions contradict their kind.

Each rule is one function, which compares a quantity with a limit. A stone contradicts its kind if the measured
value exceeds the limit by more than three standard deviations of the measurement.

===================  ============================================================================
kind                 definition, and contradiction
===================  ============================================================================
header               laid across the wall: its face is longer than the stretchers beside it, or
                     than the stone is deep
stretcher            laid along the wall: its face is shorter than high, or than the stone is deep
voussoir, keystone   a wedge: its sides do not converge towards the intrados
springer             its sloped side takes the thrust, or its face, of a vault that springs from the wall:
                     all its sides are level or plumb, and its face is plumb
sill, lintel         spans the opening: its face is higher than long
===================  ============================================================================

Jambs, quoins and rubble have no proportions of their own.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import BESIDE, GROUP, SIGNIFICANT, SLOPED
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality
from survey.quality.wedges import SideConvergence, sloped_side, wedges

_MIN_STONES = GROUP  # least number of stones for a median of the survey
_MEDIAN = math.sqrt(
    0.5 * math.pi
)  # standard deviation of a median over that of a mean, of a normal distribution [-]
_PARALLEL = math.radians(1.0)  # least convergence of a wedge: an arch of 1 m would have more than 180 stones


@dataclass(frozen=True)
class Contradiction:
    """A stone whose proportions are not those of its kind.

    Attributes
    ----------
    code, kind, line : of the stone
    text : measured and expected values
    excess : amount beyond the limit [m] or [rad]
    significance : the same in standard deviations of the measurement
    """

    code: str
    kind: str
    line: int
    text: str
    excess: float
    significance: float


@dataclass(frozen=True)
class _Finding:
    excess: float
    sigma: float
    text: str


@dataclass(frozen=True)
class _Around:
    """Quantities of other stones that the rules need.

    Attributes
    ----------
    stretchers : median length of the stretchers beside each header, its standard deviation, and a description of them
    wedges : convergence of each stone of an arch
    convergence : least convergence of a wedge here [rad]
    """

    stretchers: Mapping[int, tuple[float, float, str]]
    wedges: Mapping[int, SideConvergence]
    convergence: float


Rule = Callable[[int, StoneQuality, _Around], _Finding | None]


def contradictions(stones: Sequence[StoneQuality], facades: Sequence[Facade]) -> tuple[Contradiction, ...]:
    """Find the stones that contradict their kind, most significant first; one may do so twice.

    Parameters
    ----------
    stones : all stones of the survey
    facades : facades of the stones
    """
    measured = wedges(stones, facades)
    around = _Around(_stretchers_beside(stones, facades), measured, _least_convergence(measured))
    signs = []
    for index, stone in enumerate(stones):
        for rule in _RULES.get(stone.kind, ()):
            finding = rule(index, stone, around)
            if finding is not None and finding.excess > SIGNIFICANT * finding.sigma:
                signs.append(
                    Contradiction(
                        stone.code,
                        stone.kind,
                        stone.line,
                        finding.text,
                        finding.excess,
                        finding.excess / finding.sigma,
                    )
                )
    return tuple(sorted(signs, key=lambda sign: -sign.significance))


def _longer_than_stretchers(index: int, stone: StoneQuality, around: _Around) -> _Finding | None:
    if index not in around.stretchers:
        return None
    median, sigma, subject = around.stretchers[index]
    text = f"its face is {_metres(stone.length)} long, {subject} {_metres(median)}"
    return _Finding(stone.length - median, math.hypot(stone.dimension_sigma, sigma), text)


def _longer_than_deep(_: int, stone: StoneQuality, __: _Around) -> _Finding | None:
    if stone.depth is None or stone.depth_sigma is None:
        return None
    text = f"its face is {_metres(stone.length)} long, the stone {_metres(stone.depth)} deep"
    return _Finding(stone.length - stone.depth, math.hypot(stone.dimension_sigma, stone.depth_sigma), text)


def _shorter_than_deep(index: int, stone: StoneQuality, around: _Around) -> _Finding | None:
    finding = _longer_than_deep(index, stone, around)
    return None if finding is None else _Finding(-finding.excess, finding.sigma, finding.text)


def _higher_than_long(_: int, stone: StoneQuality, __: _Around) -> _Finding | None:
    text = f"its face is {_metres(stone.height)} high and {_metres(stone.length)} long"
    return _Finding(stone.height - stone.length, math.sqrt(2.0) * stone.dimension_sigma, text)


def _no_wedge(index: int, _: StoneQuality, around: _Around) -> _Finding | None:
    if index not in around.wedges:
        return None
    wedge = around.wedges[index]
    angle, least = math.degrees(wedge.convergence), math.degrees(around.convergence)
    trend = "converge" if angle >= 0.0 else "diverge"
    text = f"its sides {trend} by {abs(angle):.1f}° towards the intrados; a wedge has {least:.1f}° here"
    return _Finding(around.convergence - wedge.convergence, wedge.sigma, text)


def _no_slope(_: int, stone: StoneQuality, __: _Around) -> _Finding | None:
    slope, sigma = sloped_side(stone)
    overhang = math.asin(min(abs(float(stone.normal[2])), 1.0))  # of a vault across the wall
    if overhang > slope:
        slope, sigma = overhang, math.radians(stone.tilt_sigma)
    text = f"its steepest side is {math.degrees(slope):.1f}° off level or plumb; it takes no thrust"
    return _Finding(SLOPED - slope, sigma, text)


_RULES: Mapping[str, tuple[Rule, ...]] = {
    "header": (_longer_than_stretchers, _longer_than_deep),
    "stretcher": (_higher_than_long, _shorter_than_deep),
    "voussoir": (_no_wedge,),
    "keystone": (_no_wedge,),
    "springer": (_no_slope,),
    "sill": (_higher_than_long,),
    "lintel": (_higher_than_long,),
}


def _metres(value: float) -> str:
    return f"{value:.3f} m"


def _stretchers_beside(
    stones: Sequence[StoneQuality], facades: Sequence[Facade]
) -> dict[int, tuple[float, float, str]]:
    """Return for every header the median length of the stretchers next to it in its course, or of the survey."""
    expected = {}
    every = [stone for stone in stones if stone.kind == "stretcher"]
    whole = _middle(every, "stretchers of the survey have") if len(every) >= _MIN_STONES else None
    for headers, stretchers, places in _courses(stones, facades):
        order = np.argsort(places[1])
        beside = np.array(stretchers, dtype=np.intp)[order]
        at = places[1][order]
        for index, place in zip(headers, places[0].tolist(), strict=True):
            k = int(np.searchsorted(at, place))
            neighbours = beside[max(k - BESIDE // 2, 0) : k + BESIDE // 2].tolist()
            if len(neighbours) >= 2:
                expected[index] = _middle([stones[i] for i in neighbours], "stretchers beside it are")
            elif whole is not None:
                expected[index] = whole
    return expected


def _courses(
    stones: Sequence[StoneQuality], facades: Sequence[Facade]
) -> Iterator[tuple[list[int], list[int], tuple[Array, Array]]]:
    """Yield headers and stretchers of each course of each facade, and their places along it."""
    for facade in facades:
        groups: dict[tuple[str | None, int | None], tuple[list[int], list[int]]] = {}
        for i in facade.members.tolist():
            if stones[i].kind in ("header", "stretcher"):
                pair = groups.setdefault((stones[i].zone, stones[i].course), ([], []))
                pair[stones[i].kind == "stretcher"].append(i)
        for headers, stretchers in groups.values():
            here = [
                np.array(
                    [float((stones[i].outline[0] - facade.frame.origin) @ facade.frame.axes[0]) for i in rows]
                )
                for rows in (headers, stretchers)
            ]
            yield headers, stretchers, (here[0], here[1])


def _middle(stones: Sequence[StoneQuality], words: str) -> tuple[float, float, str]:
    """Return the median length, the part of its standard deviation due to measurement, and a description."""
    squares = [stone.dimension_sigma**2 for stone in stones]
    sigma = _MEDIAN * math.sqrt(sum(squares)) / len(squares)
    return float(np.median([stone.length for stone in stones])), sigma, words


def _least_convergence(measured: Mapping[int, SideConvergence]) -> float:
    """Return half the median convergence of the survey's arch stones; 1° if there are too few."""
    if len(measured) < _MIN_STONES:
        return _PARALLEL
    return max(_PARALLEL, float(np.median([wedge.convergence for wedge in measured.values()])) / 2.0)
