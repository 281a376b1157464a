"""The kernels of planes and of other shapes, against slow and readable numpy."""

import math

import numpy as np
import pytest

from survey.arrays import Array, Bools
from survey.faces._kernels.planes import Points, leverages, weighted_plane
from survey.faces._kernels.robust_fit import fit_face
from survey.faces._kernels.shapes import fit_columns, fit_two_planes, grow_columns, truncated_sum
from survey.faces._kernels.triples import beside_the_rest, search_triples, smallest
from tests.survey.faces.plane_twin import LIMIT, accepted_points, compact, plane_of, triple_planes

SIGMA = 0.002


def contaminated(rng: np.random.Generator, count: int, wrong: int, kind: str) -> Array:
    """A face in some direction, `wrong` points of it off by 5 to 15 mm to one side or by up to 300 mm to either."""
    flat = np.column_stack([rng.uniform(-0.3, 0.3, count), rng.uniform(-0.2, 0.2, count), np.zeros(count)])
    flat += rng.normal(0.0, SIGMA, flat.shape)
    small, large = (
        -rng.uniform(0.005, 0.015, wrong),
        rng.choice([-1, 1], wrong) * rng.uniform(0.03, 0.3, wrong),
    )
    flat[:wrong, 2] += small if kind == "mortar" else large
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    out: Array = flat @ turn.T + rng.uniform(-50, 50, 3)
    return out


def test_weighted_plane_is_that_of_the_singular_value_decomposition() -> None:
    rng = np.random.default_rng(1)
    for _ in range(100):
        count = int(rng.integers(4, 40))
        points = contaminated(rng, count, 0, "gross")
        points -= points[0]
        root, accepted = 1.0 / rng.uniform(0.001, 0.01, count), rng.random(count) < 0.8
        accepted[:3] = True
        frame, work = np.empty((5, 3)), np.empty((3, count))
        local = Points(np.ascontiguousarray(points.T), root)
        total = weighted_plane(local, accepted, frame, work)
        twin = plane_of(points, root, accepted)
        assert twin is not None
        assert total == pytest.approx(twin.weight, rel=1e-14)
        np.testing.assert_allclose(frame[0], twin.centroid, atol=1e-15)
        np.testing.assert_allclose(frame[4], twin.singular, rtol=1e-12)
        assert np.abs(np.sum(frame[1:4] * twin.vectors, axis=1)) == pytest.approx(1.0, abs=1e-13)
        residuals, lever = np.empty(count), np.empty(count)
        leverages(local, frame, total, residuals, lever)
        np.testing.assert_allclose(np.abs(residuals), np.abs(twin.distances(points)), atol=1e-14)
        np.testing.assert_allclose(lever, twin.leverages(points, root), rtol=1e-9)


def test_smallest_values_are_those_of_a_sorted_list() -> None:
    rng = np.random.default_rng(7)
    for count in range(1, 40):
        values = rng.integers(0, 9, count).astype(float)
        for size in range(1, count + 1):
            assert smallest(values, size) == np.sort(values)[size - 1]


def test_points_far_beside_a_face_are_no_part_of_it_but_corners_around_it_are() -> None:
    rng = np.random.default_rng(8)
    patch = np.column_stack([rng.uniform(-0.05, 0.05, (20, 2)), np.zeros(20)])
    corners = np.array([[-0.4, -0.3, 0], [0.4, -0.3, 0], [0.4, 0.3, 0], [-0.4, 0.3, 0]])
    for points, lost in (
        (patch, []),
        (np.vstack([patch, corners]), []),
        (np.vstack([patch, corners[1:3]]), [20, 21]),
        (np.vstack([corners, 0.5 * corners, [[3.0, 0, 0]]]), [8]),
    ):
        kept = beside_the_rest(np.ascontiguousarray(points.T))
        assert sorted(set(range(len(points))) - set(kept.tolist())) == lost
        np.testing.assert_array_equal(kept, np.flatnonzero(compact(points)))


def test_triples_of_least_median_and_least_truncated_squares() -> None:
    rng = np.random.default_rng(2)
    for count in (5, 12, 26):
        points = contaminated(rng, count, count // 4, "gross")
        points -= points[0]
        root, size = np.full(count, 1.0 / SIGMA), count // 2 + 2
        found = search_triples(Points(np.ascontiguousarray(points.T), root), size, True, np.zeros(4))
        _, distances = triple_planes(points, root, np.zeros(3), 0.0)
        distances = np.abs(distances)
        medians = np.sort(distances, axis=1)[:, size - 1]
        assert np.sort(found[0])[size - 1] == pytest.approx(medians.min(), rel=1e-9)
        sums = np.minimum(distances, LIMIT) ** 2
        assert (np.minimum(found[1], LIMIT) ** 2).sum() == pytest.approx(sums.sum(axis=1).min(), rel=1e-9)


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("kind", ["mortar", "gross"])
def test_faces_lose_the_points_that_the_twin_loses(kind: str, known: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(40):
        count = int(rng.integers(4, 21))
        points = contaminated(rng, count, int(rng.integers(0, count // 2 + 1)), kind)
        sigma = SIGMA * rng.uniform(0.7, 1.5, count) if known else np.ones(count)
        observer = points[0] + 5.0 * rng.normal(size=3) if rng.random() < 0.8 else None
        towards = np.full(3, math.nan) if observer is None else observer
        _, frame, accepted, *_ = fit_face(points, sigma, known, towards)
        np.testing.assert_array_equal(accepted, accepted_points(points, sigma, known, observer))
        twin = plane_of(points - points[0], 1.0 / sigma, accepted)
        assert twin is not None
        assert abs(frame[3] @ twin.vectors[2]) == pytest.approx(1.0, abs=1e-13)


def test_columns_are_fitted_as_by_least_squares() -> None:
    rng = np.random.default_rng(4)
    design, z, root = rng.normal(size=(15, 6)), rng.normal(size=15), rng.uniform(0.5, 2.0, 15)
    chosen = np.arange(15) > 2
    inverse, residuals, lever = np.empty((6, 6)), np.empty(15), np.empty(15)
    found = fit_columns(design, z, root, chosen, inverse, residuals, lever)
    weighted = design[chosen] * root[chosen, None]
    np.testing.assert_allclose(found, np.linalg.lstsq(weighted, z[chosen] * root[chosen])[0], rtol=1e-10)
    np.testing.assert_allclose(inverse, np.linalg.inv(weighted.T @ weighted), rtol=1e-9)
    np.testing.assert_allclose(residuals, z - design @ found, atol=1e-13)
    hat = (design * root[:, None]) @ inverse @ (design * root[:, None]).T
    np.testing.assert_allclose(lever, np.diag(hat), rtol=1e-9)


def test_columns_that_the_points_do_not_determine_give_nothing() -> None:
    design = np.ones((5, 2))
    out = fit_columns(
        design, np.ones(5), np.ones(5), np.ones(5, bool), np.empty((2, 2)), np.empty(5), np.empty(5)
    )
    assert np.isnan(out).all()


def test_growth_leaves_out_what_the_columns_do_not_explain() -> None:
    rng = np.random.default_rng(5)
    u = np.linspace(-1.0, 1.0, 15)
    design = np.column_stack([np.ones(15), u, u * u])
    z = 3.0 * u * u + rng.normal(0.0, 0.01, 15)
    z[6] += 0.2
    chosen = grow_columns(design, z, np.full(15, 100.0), np.ones(15, dtype=bool), 8)
    assert np.flatnonzero(~chosen).tolist() == [6]


def test_two_planes_are_the_best_of_all_lines() -> None:
    rng = np.random.default_rng(6)
    u, v = rng.uniform(-0.25, 0.25, (2, 16))
    z = -np.maximum(u - 0.1, 0.0) * 0.4 + rng.normal(0.0, SIGMA, 16)
    root = np.full(16, 1.0 / SIGMA)
    score, within, far, way, plane = fit_two_planes(u, v, z, root)
    least, best = math.inf, np.zeros(16, dtype=bool)
    for angle in 2.0 * np.pi * np.arange(24) / 24:
        order = np.argsort(-(np.cos(angle) * u + np.sin(angle) * v))
        for count in range(
            4, 9
        ):  # every set of so many points beyond a line, each part with a plane of its own
            beyond = np.isin(np.arange(16), order[:count])
            residuals = np.where(beyond, z - lateral_plane(u, v, z, beyond), z)
            fitted = np.where(beyond, residuals, z - lateral_plane(u, v, z, ~beyond))
            total = min(truncated_sum(root, residuals), truncated_sum(root, fitted))
            if total < least:
                least, best = total, beyond
    assert score == pytest.approx(least, rel=1e-9)
    assert within == pytest.approx(score, rel=1e-9)  # no blunder here
    np.testing.assert_array_equal(far, best)
    assert math.atan(math.hypot(plane[1], plane[2])) == pytest.approx(math.atan(0.4), abs=0.1)
    assert way[0] > 0.8


def lateral_plane(u: Array, v: Array, z: Array, chosen: Bools) -> Array:
    design = np.column_stack([np.ones_like(u), u, v])
    out: Array = design @ np.linalg.lstsq(design[chosen], z[chosen])[0]
    return out
