"""Where outlines in space face, and which of them are doubtful, from numbers that a test gives."""

from pathlib import Path

import numpy as np
import pytest

from survey.clouds.outlines.outline import Attributes, Outline
from survey.clouds.outlines.reading import Drawing
from survey.clouds.placing import PlacedOutline, place_outlines
from survey.clouds.review import drawn_doubts, flat_doubts, measured_doubts
from survey.records.survey import Station

SQUARE = np.array([[0.0, 0, 0], [0.4, 0, 0], [0.4, 0, 0.2], [0, 0, 0.2]])


def outline(corners: np.ndarray, code: str = "S") -> Outline:
    return Outline(1, code, corners, Attributes(), "a.json:1")


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("y", [-5.0, 5.0])
def test_an_outline_in_space_faces_its_nearest_station_however_it_was_drawn(order: int, y: float) -> None:
    stations = [Station("far", np.array([0.0, -3 * y, 0])), Station("near", np.array([1.0, y, 3.0]))]
    (placed,) = place_outlines([outline(SQUARE[::order])], None, stations)
    assert placed.axes[2] @ [0.0, np.sign(y), 0.0] == pytest.approx(1.0)
    assert np.linalg.det(placed.axes) == pytest.approx(1.0)
    np.testing.assert_allclose(placed.corners, SQUARE[::order], atol=1e-12)


@pytest.mark.parametrize("order", [1, -1])
def test_without_station_corners_run_counter_clockwise_seen_from_outside(order: int) -> None:
    (placed,) = place_outlines([outline(SQUARE[::order])], None, ())
    # seen from -y the corners of the square run counter-clockwise
    assert placed.axes[2] @ [0.0, -1.0, 0.0] == pytest.approx(float(order))
    assert placed.area == pytest.approx(0.08)


def odd_sizes(sides: list[float]) -> list[str]:
    """Return the codes of squares whose size is odd."""
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    rings = [side * square + np.array([1e4 * k, 0.0]) for k, side in enumerate(sides)]
    outlines = [outline(ring, f"S{k}") for k, ring in enumerate(rings)]
    found = flat_doubts(outlines, rings, Drawing(Path("a.json"), tuple(outlines)))
    return [doubt.code for doubt in found if doubt.reason == "odd size"]


def test_a_size_is_odd_beyond_four_and_a_half_robust_standard_deviations_of_its_logarithm() -> None:
    """Areas of a spread of 1: sides that differ by e^(1/2); the median of |ln A| is 1, σ = 1.4826."""
    usual = [np.exp(0.5 * k) for k in (-2, -1, -1, -1, 0, 0, 0, 0, 1, 1, 1, 2)]
    inside, outside = (float(np.exp(0.5 * factor * 4.5 * 1.4826)) for factor in (0.9, 1.1))
    assert odd_sizes([*usual, inside, 1 / inside]) == []
    assert odd_sizes([*usual, outside, 1 / outside]) == ["S12", "S13"]


def test_stones_of_one_size_may_differ_by_the_least_spread() -> None:
    """Equal squares but one: ln A may differ by 4.5 · 0.25 = 1.125."""
    assert odd_sizes([1.0] * 13 + [float(np.exp(0.5 * 1.0))]) == []
    assert odd_sizes([1.0] * 13 + [float(np.exp(0.5 * 1.25))]) == ["S13"]
    # of fewer than a dozen outlines no size is usual
    assert odd_sizes([1.0] * 10 + [9.0]) == []


@pytest.mark.parametrize(("name", "doubtful"), [("a.json", ["S0"]), ("a.png", []), ("a.TIF", [])])
def test_outlines_of_a_picture_do_not_overlap_as_a_pixel_is_of_one_stone(
    name: str, doubtful: list[str]
) -> None:
    outlines = [outline(SQUARE, f"S{k}") for k in range(2)]
    drawing = Drawing(Path(name), tuple(outlines))
    placed = place_outlines(outlines, None, [Station("A", np.array([0.0, -5.0, 0.0]))])
    flat = flat_doubts(outlines, [corners[:, [0, 2]] for corners in (SQUARE, SQUARE)], drawing)
    for doubts in (drawn_doubts(placed, drawing), flat):
        assert [doubt.code for doubt in doubts if doubt.reason == "overlap"] == doubtful


@pytest.mark.parametrize(
    ("slopes", "clear", "count", "reasons"),
    [
        ((0.0, 0.0), 1.0, 500, []),
        ((np.tan(np.radians(19)), 0.0), 1.0, 500, []),
        ((np.tan(np.radians(21)), 0.0), 1.0, 500, ["turned"]),
        ((0.0, -np.tan(np.radians(21))), 1.0, 500, ["turned"]),
        ((0.28, 0.28), 1.0, 500, ["turned"]),
        ((0.0, 0.0), 0.69, 500, ["covered"]),
        ((0.0, 0.0), 0.71, 100, []),
        ((0.0, 0.0), 1.0, 99, ["few points"]),
    ],
)
def test_a_face_is_doubtful_where_it_is_turned_covered_or_hardly_measured(
    slopes: tuple[float, float], clear: float, count: int, reasons: list[str]
) -> None:
    (placed,) = place_outlines([outline(SQUARE)], None, ())
    assert isinstance(placed, PlacedOutline)
    found = measured_doubts(placed, np.array([*slopes, 0.0]), np.array([0.0, 0.0, clear, count]))
    assert [doubt.reason for doubt in found] == reasons


def test_the_turn_of_a_face_is_told_in_degrees() -> None:
    (placed,) = place_outlines([outline(SQUARE)], None, ())
    slopes = np.array([np.tan(np.radians(37.0)), 0.0, 0.0])
    (doubt,) = measured_doubts(placed, slopes, np.array([0.0, 0.0, 1.0, 500.0]))
    assert "turned 37° from" in doubt.text
