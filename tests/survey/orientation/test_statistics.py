"""Covariances, redundancy and reliability: against a dense twin, and against what noise really does."""

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from survey.orientation.bundle.adjustment import adjust, prepare, similarity
from survey.orientation.bundle.control import control_tests
from survey.orientation.bundle.orient import orient
from survey.orientation.bundle.statistics import photo_precision, statistics
from survey.orientation.network import INTERIOR
from survey.orientation.rotations import angles
from tests.survey.orientation.bundle_twin import jacobian
from tests.survey.orientation.synthetic_block import noisy, spread_points, wall_block, with_points


@pytest.fixture(autouse=True, scope="module")
def one_thread():
    """Matrices are small here, and threads of BLAS would only wait for each other."""
    with threadpool_limits(1):
        yield


SIZES = {
    "c": 1e-4,
    "xp": 1e-4,
    "yp": 1e-4,
    "as": 1e-6,
    "sk": 1e-6,
    "K1": 1e-7,
    "K2": 1e-9,
    "K3": 1e-11,
    "P1": 1e-7,
    "P2": 1e-7,
}


def small(free=INTERIOR, control=5, forward=False):
    truth = wall_block(columns=3, points=14, free=free, forward=forward, relief=1.5)
    return with_points(truth, spread_points(truth, control)) if control else truth.network


def solved(network):
    prepared = prepare(network)
    solution = adjust(network, prepared)
    return prepared, solution, statistics(network, prepared, solution)


def dense(network, prepared, solution):
    sizes = [SIZES.get(name, 1e-5) for _, name in prepared.columns]
    sizes += [1e-5] * (3 * int(solution.unknowns.free.sum()))
    return jacobian(prepared, solution.unknowns, sizes)


@pytest.mark.parametrize("forward", [False, True])
def test_covariances_and_redundancies_are_those_of_the_dense_inverse(forward):
    network = noisy(small(forward=forward), np.random.default_rng(1))
    prepared, solution, found = solved(network)
    rows = dense(network, prepared, solution)
    scale = 1.0 / np.linalg.norm(rows, axis=0)
    covariance = np.linalg.inv((rows * scale).T @ (rows * scale)) * scale * scale[:, None]
    count = len(prepared.columns)
    deviations = np.sqrt(np.diag(covariance))
    off = (found.cameras - covariance[:count, :count]) / np.outer(deviations[:count], deviations[:count])
    assert np.abs(off).max() < 2e-4
    for k, i in enumerate(np.flatnonzero(solution.unknowns.free)):
        own = covariance[count + 3 * k :, count + 3 * k :][:3, :3]
        np.testing.assert_allclose(found.points[i], own, rtol=1e-3, atol=2e-4 * np.trace(own))
    parts = 1.0 - np.einsum("ij,jk,ik->i", rows, covariance, rows)
    marks = 2 * len(prepared.order)
    np.testing.assert_allclose(found.parts[prepared.order].ravel(), parts[:marks], atol=1e-4)
    # redundancy numbers of marks and control points add up to the redundancy
    assert parts.sum() == pytest.approx(found.redundancy, abs=1e-3)
    # a blunder of one σ in a coordinate moves its point by a column of C Jᵀ
    k = 7
    i = int(network.point[prepared.order[k]])
    place = count + 3 * int(np.flatnonzero(np.flatnonzero(solution.unknowns.free) == i)[0])
    for row in range(2):
        moved = covariance[place : place + 3] @ rows[2 * k + row]
        assert found.reach[prepared.order[k], row] == pytest.approx(float(np.linalg.norm(moved)), rel=1e-3)


def test_without_control_the_points_have_the_least_total_variance():
    network = noisy(small(free=(), control=0), np.random.default_rng(2))
    prepared, solution, found = solved(network)
    assert found.redundancy == 2 * len(network.photo) - len(prepared.columns) - 3 * len(network.names) + 7
    rows = dense(network, prepared, solution)
    values = solution.unknowns
    arms = values.point - values.point.mean(axis=0)
    free = np.zeros((rows.shape[1], 7))
    count = len(prepared.columns)
    free[count:] = similarity(arms).reshape(-1, 7)
    for f, place in enumerate(values.column):
        free[place[3:6]] = similarity(values.station[f : f + 1] - values.point.mean(axis=0))[0]
        free[place[:3], 3:6] = values.rotation[f].T
    assert np.abs(rows @ free).max() < 1e-3  # the marks do not see a similarity
    held = np.zeros_like(free)
    held[count:] = free[count:]
    weight = float(np.median(np.diag(rows.T @ rows)))
    bordered = np.block([[rows.T @ rows, weight * held], [weight * held.T, np.zeros((7, 7))]])
    covariance = np.linalg.inv(bordered)[: rows.shape[1], : rows.shape[1]]
    for i in range(len(network.names)):
        own = covariance[count + 3 * i :, count + 3 * i :][:3, :3]
        np.testing.assert_allclose(found.points[i], own, rtol=2e-3, atol=1e-3 * np.trace(own))
    off = found.cameras - covariance[:count, :count]
    sizes = np.sqrt(np.diag(covariance)[:count])
    assert np.abs(off / np.outer(sizes, sizes)).max() < 2e-3


def normalised(draws):
    """Errors of points, cameras and calibration over their predicted deviations, over noisy draws."""
    truth = wall_block(columns=3, points=30, free=("c", "xp", "yp", "K1"), relief=1.2)
    exact = with_points(truth, spread_points(truth, 6))
    points, cameras, inner, sigma0 = [], [], [], []
    for draw in range(draws):
        network = noisy(exact, np.random.default_rng(1000 + draw))
        prepared, solution, found = solved(network)
        values = solution.unknowns
        off = values.point - truth.points
        points.append(off / np.sqrt(np.diagonal(found.points, axis1=1, axis2=2)))
        deviations = np.sqrt(
            np.diagonal(photo_precision(network, prepared, solution, found), axis1=1, axis2=2)
        )
        place = np.array([[*angles(r), *s] for r, s in zip(values.rotation, values.station, strict=True)])
        true = np.array([[*angles(one.rotation), *one.station] for one in truth.network.photos])
        cameras.append((place - true) / deviations)
        free = [INTERIOR.index(name) for name in ("c", "xp", "yp", "K1")]
        inner.append(
            (values.inner[0, free] - truth.network.cameras[0].inner[free])
            / np.sqrt(np.diag(found.cameras)[-4:])
        )
        sigma0.append(found.sigma0)
    return [np.array(one) for one in (points, cameras, inner, sigma0)]


def check_honest(draws, tolerance):
    points, cameras, inner, sigma0 = normalised(draws)
    names = ("points", "cameras", "calibration", "sigma0")
    print(
        {
            n: round(float(np.mean(one**2)), 4)
            for n, one in zip(names, (points, cameras, inner, sigma0), strict=True)
        }
    )
    for one in (points, cameras):
        assert np.mean(one**2) == pytest.approx(1.0, abs=tolerance)
        assert abs(np.mean(one)) < tolerance
    assert np.mean(inner**2) == pytest.approx(1.0, abs=2 * tolerance)
    assert np.mean(sigma0**2) == pytest.approx(1.0, abs=0.5 * tolerance)


def test_predicted_covariances_are_honest():
    check_honest(100, 0.1)


@pytest.mark.slow
def test_predicted_covariances_are_honest_in_a_thousand_draws():
    check_honest(1000, 0.1)


def check_blunders(draws):
    truth = wall_block(points=60)
    exact = with_points(truth, spread_points(truth, 6))
    found = wrong = total = 0
    for draw in range(draws):
        rng = np.random.default_rng(draw)
        network = noisy(exact, rng)
        spoilt = rng.choice(len(network.photo), 5, replace=False)
        way = rng.uniform(0, 2 * np.pi, 5)
        image = network.image.copy()
        image[spoilt] += 10.0 * network.sigma[spoilt] * np.column_stack([np.cos(way), np.sin(way)])
        result = orient(replace(network, image=image), "remove")
        found += len(set(result.removed) & set(spoilt.tolist()))
        wrong += len(set(result.removed) - set(spoilt.tolist()))
        total += 5
    print(f"{found} of {total} blunders found, {wrong} of {draws * len(exact.photo)} sound marks left out")
    assert found >= 0.95 * total
    assert wrong <= 0.01 * len(exact.photo) * draws


def test_blunders_of_ten_sigma_are_found():
    check_blunders(20)


@pytest.mark.slow
def test_a_thousand_blunders_of_ten_sigma():
    check_blunders(200)


def test_control_points_and_check_points_are_tested_by_their_own_precision():
    truth = wall_block(points=60)
    exact = with_points(truth, spread_points(truth, 8))
    exact = replace(exact, control=tuple(replace(one, check=k >= 5) for k, one in enumerate(exact.control)))
    tests = []
    for draw in range(40):
        network = noisy(exact, np.random.default_rng(draw))
        _, solution, found = solved(network)
        tests.append(control_tests(network, solution, found))
    mean = np.mean(np.square(tests), axis=0)
    np.testing.assert_allclose(mean, 1.0, atol=0.5)  # √(2 / (3 · 40)) is 0.13


def test_observed_stations_hold_a_network_and_count_as_observations():
    truth = wall_block(points=60)
    rng = np.random.default_rng(4)
    photos = tuple(
        replace(one, observed_station=one.station + 0.02 * rng.normal(size=3), station_sigma=np.full(3, 0.02))
        for one in truth.network.photos
    )
    network = noisy(replace(truth.network, photos=photos), rng)
    prepared, solution, found = solved(network)
    assert found.redundancy == 2 * len(network.photo) + 3 * 8 - 6 * 8 - 3 * len(network.names)
    off = (solution.unknowns.station - [one.station for one in truth.network.photos]).ravel()
    columns = prepared.unknowns.column[:, 3:6].ravel()
    own = found.cameras[np.ix_(columns, columns)]
    assert 8 < off @ np.linalg.solve(own, off) < 48  # χ² of 24


def test_an_observed_orientation_holds_a_photograph():
    truth = wall_block(points=40)
    photo = truth.network.photos[2]
    held = replace(photo, observed_rotation=photo.rotation, angle_sigma=np.full(3, 1e-7),
                   observed_station=photo.station, station_sigma=np.full(3, 1e-7))  # fmt: skip
    photos = tuple(held if k == 2 else one for k, one in enumerate(truth.network.photos))
    exact = with_points(truth, spread_points(truth, 5))
    network = noisy(replace(exact, photos=photos), np.random.default_rng(3))
    prepared, solution, found = solved(network)
    assert np.abs(solution.unknowns.rotation[2] - photo.rotation).max() < 1e-6
    assert np.abs(solution.unknowns.station[2] - photo.station).max() < 1e-6
    assert photo_precision(network, prepared, solution, found)[2, 0, 0] < 1.1e-14
