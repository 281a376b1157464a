"""Catalogue of the pictures of a result: titles, scales and palettes, and what must be known to draw each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from ground.units import CENTI, MEGA

UnitOf = Callable[[float], tuple[float, str]]
"""Factor and unit by the end of a scale."""


@dataclass(frozen=True)
class Picture:
    """One picture that a scene file can ask for.

    Attributes
    ----------
    title : in the heading of the picture
    shows : stress of the stones, their motion, or what their joints carry
    scale : title of the scale of colours; "" if nothing is coloured by value
    unit_of : factor and unit by the end of the scale
    palette : map of colours, and the part of it that is used
    capped : the scale ends at the value exceeded in 1 % of the volume, or in joints that bear 1 % of the force, not at
        the largest one
    note : line below the picture
    """

    title: str
    shows: Literal["stress", "motion", "joints"]
    scale: str = ""
    unit_of: UnitOf = lambda _: (1.0, "")
    palette: tuple[str, float] = ("viridis_r", 1.0)
    capped: bool = False
    note: str = ""


def _length_unit(largest: float) -> tuple[float, str]:
    if largest >= 0.1:
        return 1.0, "m"
    return (1e3, "mm") if largest >= 1e-4 else (1e6, "µm")


def _pascals(largest: float) -> tuple[float, str]:
    return (1e-6, "MPa") if largest >= 1e5 else (1e-3, "kPa")


def _always(factor: float, unit: str) -> UnitOf:
    return lambda _: (factor, unit)


READABLE = 0.85  # part of a colour map on whose darkest colour edges can be seen [-]

PICTURES: Mapping[str, Picture] = {
    "von_mises": Picture(
        "Von Mises stress",
        "stress",
        "Von Mises stress",
        _always(1.0 / MEGA, "MPa"),
        ("inferno_r", READABLE),
        capped=True,
    ),
    "displacement": Picture("displacement", "motion", "Displacement", _length_unit),
    "principal_tension": Picture(
        "tension", "stress", "Largest principal stress, tension", _pascals, ("Reds", 1.0), capped=True
    ),
    "principal_compression": Picture(
        "compression",
        "stress",
        "Smallest principal stress, compression",
        _pascals,
        ("Blues", 1.0),
        capped=True,
    ),
    "utilisation": Picture(
        "stress over strength",
        "stress",
        "Stress over strength",
        _always(1.0, ""),
        ("YlOrRd", 1.0),
        capped=True,
    ),
    "error": Picture(
        "error of the stress",
        "stress",
        "Estimated error of the stress",
        _always(1.0 / CENTI, "%"),
        ("Purples", 1.0),
    ),
    "pressure": Picture(
        "pressure in the joints",
        "joints",
        "Mean pressure of the joints",
        _pascals,
        ("inferno_r", READABLE),
        capped=True,
    ),
    "resultants": Picture(
        "resultants of the joints",
        "joints",
        note="strokes: as long as the force is large; blue: within the kern, red: outside",
    ),
}
"""Pictures by the name that scene files give them."""
