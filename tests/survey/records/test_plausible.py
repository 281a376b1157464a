"""Ranges of sizes and properties: usual ones pass, slips of unit and solids on their side are told."""

import itertools
import math

import numpy as np
import pytest

from survey.records.plausible import (
    DENSITY,
    FRICTION,
    LENGTH,
    POISSON,
    YOUNG,
    Range,
    doubt_of,
    lies_on_its_side,
)

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


def ring(half, stones=15, rows=1):
    """Boxes (n, 6) of the voussoirs of a barrel along y, up to an angle from its crown [rad]."""
    edges = np.linspace(-half, half, stones + 1)
    corner = np.array([[(r * np.sin(a), r * np.cos(a)) for r in (2.0, 2.3)] for a in edges])
    found = []
    for row in range(rows):
        for low, high in itertools.pairwise(corner):
            points = np.vstack([low, high])
            (x, z), (x_end, z_end) = points.min(axis=0), points.max(axis=0)
            found.append((x, 0.4 * row, z, x_end, 0.4 * (row + 1), z_end))
    return np.array(found)


def turned(boxes):
    """The same stones in a file whose y points upwards."""
    return np.column_stack([boxes[:, [0, 2]], -boxes[:, 4], boxes[:, [3, 5]], -boxes[:, 1]])


@pytest.mark.parametrize("half", [np.pi / 2, np.pi / 4, np.pi / 6])
@pytest.mark.parametrize("rows", [1, 3, 9])
def test_a_sound_barrel_vault_stands_however_flat_and_long(half, rows):
    assert not lies_on_its_side(ring(half, rows=rows))


@pytest.mark.parametrize("half", [np.pi / 2, np.pi / 4, np.pi / 6])
def test_an_arch_whose_file_has_y_upwards_lies_on_its_side(half):
    assert lies_on_its_side(turned(ring(half)))
