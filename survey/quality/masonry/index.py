"""The masonry quality index of Borri, Corradi, Castori & De Maria (2015), with what is not known left open.

Seven parameters are each fulfilled (F), partly (PF) or not (NF). For vertical, in-plane and out-of-plane loads

    MQI = SM (SD + SS + WC + HJ + VJ + MM)

with values from Table 8 of the paper, from 0 to 10; category A is good, C inadequate (Table 9). The curves of its
Figure 10 give ranges of compressive strength and Young's modulus from the index for vertical loads, of shear strength
from that for loads in the plane.

A. Borri, M. Corradi, G. Castori, A. De Maria: A method for the analysis and classification of historic masonry.
Bulletin of Earthquake Engineering 13 (2015) 2647-2665, doi 10.1007/s10518-015-9731-4
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files
from typing import Any

from scipy.special import ndtr

from survey.conventions import TAIL


class Direction(StrEnum):
    """Directions of loads."""

    VERTICAL = "vertical"
    IN_PLANE = "in_plane"
    OUT_OF_PLANE = "out_of_plane"


class Parameter(StrEnum):
    """Parameters of the index, by the names of the paper."""

    SM = "SM"
    SD = "SD"
    SS = "SS"
    WC = "WC"
    HJ = "HJ"
    VJ = "VJ"
    MM = "MM"


DIRECTIONS = tuple(Direction)

PARAMETERS: Mapping[Parameter, str] = {
    Parameter.SM: "state of the stones",
    Parameter.SD: "size of the stones",
    Parameter.SS: "shape of the stones",
    Parameter.WC: "bonding through the wall",
    Parameter.HJ: "level beds",
    Parameter.VJ: "staggered head joints",
    Parameter.MM: "mortar",
}
"""Parameters, and what they are about."""


@dataclass(frozen=True)
class Grade:
    """Judgement on one parameter.

    Attributes
    ----------
    chances : probabilities of not, partly and wholly fulfilled; None if the survey does not tell
    text : the evidence
    """

    chances: tuple[float, float, float] | None
    text: str

    @property
    def possible(self) -> tuple[int, ...]:
        """Grades within the range, from 0 (NF) to 2 (F)."""
        if self.chances is None:
            return (0, 1, 2)
        return tuple(k for k, chance in enumerate(self.chances) if chance >= TAIL)

    @property
    def words(self) -> str:
        """Short form: "F", "PF or F", "not known"."""
        if self.chances is None:
            return "not known"
        return " or ".join(("NF", "PF", "F")[k] for k in self.possible)


UNKNOWN = Grade(None, "the survey does not tell")


def given_grade(level: str) -> Grade:
    """Return the grade that somebody states.

    Parameters
    ----------
    level : "good", "medium" or "poor"
    """
    chances = {"poor": (1.0, 0.0, 0.0), "medium": (0.0, 1.0, 0.0), "good": (0.0, 0.0, 1.0)}[level]
    return Grade(chances, f"stated: {level}")


def graded(value: float, sigma: float, bounds: tuple[float, float], text: str) -> Grade:
    """Grade a measured quantity, the larger the better, with its uncertainty.

    Parameters
    ----------
    value, sigma : quantity and its standard deviation
    bounds : from where on it is partly, and wholly fulfilled
    text : the evidence
    """
    low, high = (float(ndtr((value - bound) / max(sigma, 1e-12))) for bound in bounds)
    return Grade((1.0 - low, low - high, high), text)


def limits(name: str) -> tuple[float, float]:
    """Return the limits of the paper from which a parameter is partly, and wholly fulfilled."""
    partly, wholly = _published()["limits"][name]
    return partly, wholly


def index_range(grades: Mapping[Parameter, Grade], direction: Direction) -> tuple[float, float]:
    """Return the lowest and highest index that the grades allow.

    Parameters
    ----------
    grades : of all parameters
    direction : of the loads
    """
    values, k = _published()["values"], DIRECTIONS.index(direction)

    def index(end: int) -> float:
        """Return the masonry quality index at one end of the possible grades [-]."""
        value: dict[Parameter, float] = {
            name: values[name][k][grades[name].possible[end]] for name in PARAMETERS
        }
        return value.pop(Parameter.SM) * sum(value.values())

    return index(0), index(-1)


def category(index: float, direction: Direction) -> str:
    """Return the category of an index: A is good, B average, C inadequate."""
    low, high = _published()["categories"][direction]
    return "A" if index >= high else "B" if index >= low else "C"


def mechanical_ranges(indices: Mapping[Direction, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Return the ranges of compressive strength, shear strength and Young's modulus [Pa].

    Parameters
    ----------
    indices : lowest and highest index of each direction
    """
    ranges = {}
    for name, curve in _published()["curves"].items():
        low, high = indices[Direction(curve["direction"])]
        (least, slow), (most, fast) = curve["lower"], curve["upper"]
        ranges[name] = (least * math.exp(slow * low), most * math.exp(fast * high))
    return ranges


@cache
def _published() -> Mapping[str, Any]:
    """Return the tables of the paper: values of parameters, bounds of categories, curves of properties."""
    return tomllib.loads(files(__package__).joinpath("index.toml").read_text(encoding="utf-8"))
