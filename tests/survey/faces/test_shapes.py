"""Verdicts on the shapes of simulated faces: rates of right ones and of false alarms."""

import time
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from survey.arrays import Array
from survey.faces.planes import fit_plane
from survey.faces.shapes import FaceShape, ShapeKind, judge_shape

SIGMA = 0.002
OBSERVER = np.array([0.0, 0.0, 5.0])
# heights of points (n, 2)
Relief = Callable[[Array], Array]


def margin(rng: np.random.Generator, count: int, size: float = 0.5) -> Array:
    """Four corners and points along the edges of a square face, (count, 2)."""
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * size / 2
    place = rng.uniform(0.0, 4.0, count - 4)
    side, way = place.astype(int), (place % 1.0)[:, None]
    return np.vstack([corners, corners[side] * (1.0 - way) + corners[(side + 1) % 4] * way])


def inside(rng: np.random.Generator, count: int, size: float = 0.5) -> Array:
    return rng.uniform(-size / 2, size / 2, (count, 2))


def verdict(flat: Array, heights: Array, rng: np.random.Generator, sigma: float | None = SIGMA) -> FaceShape:
    points = np.column_stack([flat, heights]) + rng.normal(0.0, SIGMA, (len(flat), 3))
    return judge_shape(fit_plane(points, sigma, OBSERVER), points, sigma)


def verdicts(
    layout: Callable[..., Array], relief: Relief, faces: int, count: int | None = None
) -> Counter[str]:
    rng = np.random.default_rng(1)
    found: Counter[str] = Counter()
    for _ in range(faces):
        flat = layout(rng, count or int(rng.integers(8, 21)))
        found[verdict(flat, relief(flat), rng).kind] += 1
    return found


def flat_face(flat: Array) -> Array:
    return np.zeros(len(flat))


def cylinder(flat: Array) -> Array:
    """Radius 3 m, bulging outwards, about the second axis."""
    return 3.0 * (np.sqrt(1.0 - (flat[:, 0] / 3.0) ** 2) - 1.0)


def bevel(flat: Array) -> Array:
    """A quarter of the points on a plane turned by 20°."""
    edge = np.quantile(flat[:, 0], 0.75)
    return -np.maximum(flat[:, 0] - edge, 0.0) * np.tan(np.radians(20.0))


@pytest.mark.parametrize("layout", [margin, inside])
def test_clean_faces_are_planes_in_more_than_99_percent(layout: Callable[..., Array]) -> None:
    found = verdicts(layout, flat_face, 2000)
    assert found["plane"] >= 1980, found


@pytest.mark.parametrize("layout", [margin, inside])
def test_a_cylinder_of_3_m_radius_is_curved_in_more_than_90_percent(layout: Callable[..., Array]) -> None:
    # 20 points over 0.5 m: the arch rises 10 mm, its points lie 3 mm off a plane on average, at a noise of 2 mm
    found = verdicts(layout, cylinder, 400, 20)
    assert found["curved"] > 360, found


def test_a_bevel_of_20_degrees_over_a_quarter_is_found_in_more_than_90_percent() -> None:
    # of 20 points 5 lie beyond the edge; where these lie near it, the bevel is no deeper than the noise
    found = verdicts(inside, bevel, 1000, 20)
    assert found["bevelled"] > 900, found


def test_curvatures_have_the_precision_that_they_say() -> None:
    # cylinders of 2 m radius in any direction: normalised errors have mean 0 ± 4/√400, variance 1 ± 4 √(2/400);
    # that the arc is no parabola adds u⁴/8R³ = 0.2 mm at most
    rng, errors = np.random.default_rng(2), []
    for _ in range(400):
        flat = inside(rng, 25)
        turn = rng.uniform(0.0, np.pi)
        u = flat @ [np.cos(turn), np.sin(turn)]
        shape = verdict(flat, np.sqrt(4.0 - u**2) - 2.0, rng)
        if shape.curvature is not None and shape.curvature_sigma is not None:
            errors.append((shape.curvature - [0.5, 0.0]) / shape.curvature_sigma)
    assert len(errors) >= 390
    assert np.abs(np.mean(errors, axis=0)).max() < 0.2
    np.testing.assert_allclose(np.var(errors, axis=0), 1.0, atol=0.3)


def test_the_angle_of_a_bevel_and_its_points_are_said() -> None:
    rng, angles = np.random.default_rng(3), []
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.25, 0.25, 6), np.linspace(-0.2, 0.2, 4)))
    flat = np.column_stack([x, y])
    beyond = np.maximum(x - 0.1, 0.0)  # columns at 0.15 and 0.25 m: 8 of 24 points
    for _ in range(50):
        shape = verdict(flat, -beyond * np.tan(np.radians(25.0)), rng)
        assert shape.kind is ShapeKind.BEVELLED
        assert set(np.flatnonzero(beyond > 0.1)) <= set(shape.bevel_points) <= set(np.flatnonzero(x > 0.0))
        assert shape.bevel_angle is not None
        angles.append(np.degrees(shape.bevel_angle))
    # two columns 0.1 m apart, four points each: ± 2 mm √(2/4) / 0.1 m = 0.8°
    assert np.mean(angles) == pytest.approx(25.0, abs=1.0)
    assert np.std(angles) < 2.0


def test_a_row_of_points_along_an_eroded_edge_is_bevelled_without_an_angle() -> None:
    rng = np.random.default_rng(4)
    flat = np.vstack([inside(rng, 14, 0.4), np.column_stack([np.full(5, 0.3), np.linspace(-0.2, 0.2, 5)])])
    heights = np.where(np.arange(19) < 14, 0.0, -0.015)
    shape = verdict(flat, heights, rng)
    assert shape.kind is ShapeKind.BEVELLED
    assert shape.bevel_angle is None
    assert shape.bevel_points == (14, 15, 16, 17, 18)
    assert "behind" in shape.text


@pytest.mark.parametrize("wrong", [1, 2])
def test_isolated_blunders_leave_a_face_plane(wrong: int) -> None:
    rng, found = np.random.default_rng(5), Counter[str]()
    for _ in range(500):
        flat = margin(rng, int(rng.integers(8, 21)))
        heights = np.zeros(len(flat))
        heights[rng.permutation(len(flat))[:wrong]] = rng.choice([-1, 1], wrong) * rng.uniform(
            0.03, 0.3, wrong
        )
        found[verdict(flat, heights, rng).kind] += 1
    assert found["plane"] >= 495, found


def test_a_rough_face_is_called_rough_with_its_scatter() -> None:
    # 40 points that scatter three times as far as they were measured
    rng = np.random.default_rng(6)
    points = np.column_stack([inside(rng, 40), np.zeros(40)]) + rng.normal(0.0, 3.0 * SIGMA, (40, 3))
    shape = judge_shape(fit_plane(points, SIGMA, OBSERVER), points, SIGMA)
    assert shape.kind is ShapeKind.ROUGH
    scatter = float(shape.text.split("scatter ")[1].split(" ")[0])
    assert scatter == pytest.approx(3.0, abs=0.9)


def test_three_points_are_not_tested() -> None:
    points = np.eye(3)
    assert judge_shape(fit_plane(points, SIGMA), points, SIGMA).kind is ShapeKind.UNTESTED


def test_without_a_precision_a_curve_is_told_by_what_it_leaves() -> None:
    rng = np.random.default_rng(7)
    kinds = {True: Counter[str](), False: Counter[str]()}
    for _ in range(200):
        flat = margin(rng, 20)
        for bent, found in kinds.items():
            found[verdict(flat, cylinder(flat) if bent else flat_face(flat), rng, None).kind] += 1
    assert kinds[True]["curved"] > 170, kinds
    assert kinds[False]["plane"] >= 194, kinds


def test_exact_points_on_a_plane_are_a_plane_without_a_precision() -> None:
    points = np.column_stack([inside(np.random.default_rng(8), 12), np.zeros(12)])
    for moved in (points, points + 1e6):
        assert judge_shape(fit_plane(moved, None), moved, None).kind is ShapeKind.PLANE


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([flat_face, cylinder, bevel]))
def test_the_verdict_does_not_depend_on_place_or_order(seed: int, relief: Relief) -> None:
    rng = np.random.default_rng(seed)
    flat = margin(rng, 16)
    points = np.column_stack([flat, 3.0 * relief(flat)]) + rng.normal(0.0, SIGMA, (16, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    order, away = rng.permutation(16), rng.uniform(-100.0, 100.0, 3)
    here = judge_shape(fit_plane(points, SIGMA, OBSERVER), points, SIGMA)
    moved = (points @ turn.T + away)[order]
    there = judge_shape(fit_plane(moved, SIGMA, turn @ OBSERVER + away), moved, SIGMA)
    assert (here.kind is ShapeKind.PLANE) == (there.kind is ShapeKind.PLANE)
    if here.kind is there.kind is ShapeKind.CURVED:
        assert here.curvature is not None
        np.testing.assert_allclose(here.curvature, there.curvature, rtol=1e-5)


@pytest.mark.slow
def test_a_clean_face_is_judged_in_microseconds() -> None:
    rng = np.random.default_rng(9)
    points = np.column_stack([margin(rng, 14), np.zeros(14)]) + rng.normal(0.0, 0.5 * SIGMA, (14, 3))
    fit = fit_plane(points, SIGMA, OBSERVER)
    laps = []
    for _ in range(200):
        start = time.perf_counter()
        judge_shape(fit, points, SIGMA)
        laps.append(time.perf_counter() - start)
    assert min(laps) < 20e-6  # 3 µs on a quiet machine
