"""Ranges of sizes and properties: what is usual passes, slips of unit are named, the impossible is told apart."""

import math

import pytest

from survey.quality.plausible import DENSITY, FRICTION, LENGTH, POISSON, YOUNG, Range, doubt_of

RANGES = (LENGTH, DENSITY, YOUNG, POISSON, FRICTION)


@pytest.mark.parametrize("of", RANGES, ids=lambda one: one.quantity)
def test_usual_values_are_possible(of: Range) -> None:
    assert of.possible[0] <= of.usual[0] < of.usual[1] <= of.possible[1]
    assert doubt_of(of.usual[0], of) is doubt_of(of.usual[1], of) is None
    assert of.reason


@pytest.mark.parametrize(
    ("value", "of"),
    [
        (0.01, LENGTH),  # tessera
        (20.5, LENGTH),  # the stone in the quarry at Baalbek
        (900.0, DENSITY),  # pumice
        (5000.0, DENSITY),  # iron ore
        (2e7, YOUNG),  # adobe
        (1.5e11, YOUNG),  # dense quartzite
        (5.67, FRICTION),  # tan 80°
    ],
)
def test_rare_stones_are_doubted_but_possible(value: float, of: Range) -> None:
    doubt = doubt_of(value, of)
    assert doubt is not None
    assert not doubt.impossible


@pytest.mark.parametrize(
    ("value", "of", "unit"),
    [
        (376.0, LENGTH, "in millimetres it would be 0.376 m"),
        (1e5, LENGTH, ""),  # one vertex at 100 km: a slip, and no unit explains it
        (2.2, DENSITY, "in g/cm³ (t/m³) it would be 2200 kg/m³"),
        (23.5, DENSITY, "in kN/m³ it would be 2396 kg/m³"),
        (10.0, YOUNG, "in GPa it would be 1e+10 Pa"),
        (12000.0, YOUNG, "in MPa (N/mm²) it would be 1.2e+10 Pa"),
        (1e9, FRICTION, ""),
        (35.0, FRICTION, "in degrees it would be 0.7002"),
        (0.5, POISSON, ""),
    ],
)
def test_impossible_values_are_named_with_the_likely_unit(value: float, of: Range, unit: str) -> None:
    doubt = doubt_of(value, of)
    assert doubt is not None
    assert doubt.impossible
    assert "is not that of a stone" in doubt.text
    assert doubt.text.partition("; ")[2] == unit


def test_no_number_is_no_stone() -> None:
    doubt = doubt_of(math.nan, DENSITY)
    assert doubt is not None
    assert doubt.impossible
