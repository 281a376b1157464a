import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from moma.errors import GeometryError
from survey.planes import fit_plane

Array = NDArray[np.float64]

# Reference case P01, "TLS plane, exact checkerboard set" (closed form): x in {-3,-1,1,3},
# y in {-1.5,-.5,.5,1.5}, z = ±0.01 alternating, i + j odd → +
CHECKERBOARD = np.array(
    [
        (x, y, 0.01 if (i + j) % 2 else -0.01)
        for i, x in enumerate((-3.0, -1.0, 1.0, 3.0))
        for j, y in enumerate((-1.5, -0.5, 0.5, 1.5))
    ]
)


def test_checkerboard_has_its_closed_form_plane_and_covariance() -> None:
    fit = fit_plane(CHECKERBOARD, None)
    np.testing.assert_allclose(fit.normal, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(fit.centroid, 0, atol=1e-12)
    # singular values 8.944272, 4.472136, 0.04; rms 0.01; sigma0(n - 3) 0.011094004
    np.testing.assert_allclose(fit.singular_values, [np.sqrt(80), np.sqrt(20), 0.04], rtol=1e-12)
    assert fit.rms == pytest.approx(0.01, rel=1e-12)
    assert fit.sigma0 == pytest.approx(np.sqrt(16e-4 / 13), rel=1e-12)
    # std n_x 0.00124035, n_y 0.00248069, d 0.0027735: sigma0 over √Σx², √Σy², √n
    expected = fit.sigma0 / np.array([np.sqrt(80), np.sqrt(20), 4.0])
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), expected, rtol=1e-12)
    np.testing.assert_allclose(expected, [0.00124035, 0.00248069, 0.0027735], rtol=5e-6)
    assert (fit.redundancy, fit.rejected) == (13, ())


def test_checkerboard_turned_and_a_thousand_kilometres_away_keeps_its_normal() -> None:
    turn = _rotation(np.array([0.3, -0.5, 0.8]))
    fit = fit_plane(CHECKERBOARD @ turn.T + 1e6, None, observer=turn[:, 2] * 10 + 1e6)
    assert np.linalg.norm(np.cross(fit.normal, turn[:, 2])) < 1e-7  # P01's tolerance
    assert fit.normal @ turn[:, 2] > 0


def test_normal_looks_to_the_observer() -> None:
    for height in (5.0, -5.0):
        assert fit_plane(CHECKERBOARD, 0.01, observer=[0.1, 0.2, height]).normal[2] * height > 0


def test_three_points_have_no_redundancy_and_say_so() -> None:
    fit = fit_plane([[0, 0, 0], [1, 0, 0], [0, 1, 0]], 0.003)
    assert fit.redundancy == 0
    assert np.isnan(fit.sigma0)
    assert np.isfinite(fit.covariance).all()


@pytest.mark.parametrize(
    "points",
    [
        [[0, 0, 0], [1, 0, 0]],
        [[0, 0, 0], [1, 1, 1], [2, 2, 2], [3, 3, 3]],
        [[1, 2, 3]] * 5,
        [[0, 0, 0], [1, 0, 0], [0, 1, np.nan]],
    ],
)
def test_points_without_a_plane_are_refused(points: list[list[float]]) -> None:
    with pytest.raises(GeometryError):
        fit_plane(points, 0.003)


def test_predicted_standard_deviations_are_those_of_many_faces() -> None:
    # 2000 simulated faces with known noise: normalised errors have variance 1; its own standard error is
    # √(2/2000) = 0.032
    rng, sigma = np.random.default_rng(7), 0.003
    turn, shift = _rotation(np.array([0.5, 0.2, -0.4])), np.array([40.0, -25.0, 12.0])
    errors = []
    for _ in range(2000):
        flat = np.column_stack([rng.uniform(-0.3, 0.3, 12), rng.uniform(-0.2, 0.2, 12), np.zeros(12)])
        points = flat @ turn.T + shift
        fit = fit_plane(points + rng.normal(0, sigma, points.shape), sigma, observer=shift + turn[:, 2])
        tilts = fit.axes @ turn[:, 2]
        at_centroid = (fit.centroid - shift) @ turn[:, 2]
        elsewhere = shift + 0.4 * turn[:, 0] - 0.3 * turn[:, 1]
        height = fit.normal @ (fit.centroid - elsewhere) / (fit.normal @ turn[:, 2])
        parameters = np.append(tilts, at_centroid) / np.sqrt(np.diag(fit.covariance))
        errors.append(np.append(parameters, height / fit.height_sigma(elsewhere[None])))
    np.testing.assert_allclose(np.var(errors, axis=0), 1.0, atol=0.1)


def test_a_fifth_of_blunders_leaves_the_normal_within_three_standard_deviations() -> None:
    rng, sigma, good = np.random.default_rng(11), 0.003, 0
    for _ in range(300):
        points = np.column_stack([rng.uniform(-0.3, 0.3, 15), rng.uniform(-0.2, 0.2, 15), np.zeros(15)])
        points += rng.normal(0, sigma, points.shape)
        points[:3, 2] += rng.choice([-1, 1], 3) * rng.uniform(0.03, 0.3, 3)
        fit = fit_plane(points, sigma, observer=[0, 0, 5])
        assert {0, 1, 2} <= set(fit.rejected)
        tilts = fit.axes @ np.array([0.0, 0.0, 1.0])
        good += bool((np.abs(tilts) < 3.3 * np.sqrt(np.diag(fit.covariance)[:2])).all())
    assert (
        good >= 294
    )  # 2 tilts at 3.3 standard deviations: 0.2 % expected outside, and some for lost good points


def test_rejected_points_keep_their_residuals() -> None:
    points = CHECKERBOARD.copy()
    points[5, 2] += 0.5
    fit = fit_plane(points, 0.01, observer=[0, 0, 9])
    assert fit.rejected == (5,)
    assert fit.residuals.shape == (16,)
    assert fit.residuals[5] == pytest.approx(0.5, abs=0.03)


def test_standardised_residuals_are_standard_normal_in_the_fit_and_out_of_it() -> None:
    # accepted: v_i / (σ √(1 - h_i)) with h_i = 1/16 + x²/80 + y²/20 on the checkerboard; rejected: √(1 + h_i)
    x, y, z = CHECKERBOARD.T
    lever = 1 / 16 + x**2 / 80 + y**2 / 20
    fit = fit_plane(CHECKERBOARD, 0.01, observer=[0, 0, 9])
    np.testing.assert_allclose(fit.standardised, z / 0.01 / np.sqrt(1 - lever), rtol=1e-12)
    broken = fit_plane(np.vstack([CHECKERBOARD, [[5.0, 0.0, 1.0]]]), 0.01, observer=[0, 0, 9])
    assert broken.rejected == (16,)
    lever_5 = 1 / 16 + 25 / 80
    assert broken.standardised[16] == pytest.approx(1.0 / 0.01 / np.sqrt(1 + lever_5), rel=1e-12)


def test_a_point_that_no_other_checks_has_no_standardised_residual() -> None:
    fit = fit_plane([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0.001], [0, 5, 0.0]], 0.003)
    np.testing.assert_array_equal(np.isnan(fit.standardised), [False, False, False, False, True])
    assert np.isnan(fit_plane([[0, 0, 0], [1, 0, 0], [0, 1, 0]], 0.003).standardised).all()


def test_height_is_least_certain_far_from_the_centroid() -> None:
    # σ √(1/16 + x²/80 + y²/20) on the checkerboard
    fit = fit_plane(CHECKERBOARD, 0.01)
    places = np.array([[0.0, 0, 0], [3, 0, 0], [0, 7, 0.4]])
    expected = 0.01 * np.sqrt(np.array([1 / 16, 1 / 16 + 9 / 80, 1 / 16 + 49 / 20]))
    np.testing.assert_allclose(fit.height_sigma(places), expected, rtol=1e-10)


def test_weights_follow_the_precision_of_each_point() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.004]])
    trusting = fit_plane(points, [0.001, 0.001, 0.001, 1.0], observer=[0, 0, 1])
    np.testing.assert_allclose(trusting.normal, [0, 0, 1], atol=1e-5)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(4, 40), st.floats(1e-4, 1e3), st.floats(-1e6, 1e6))
def test_exact_planes_are_recovered_at_any_size_and_place(
    seed: int, count: int, size: float, away: float
) -> None:
    rng = np.random.default_rng(seed)
    turn = _rotation(rng.normal(size=3))
    flat = np.column_stack([rng.uniform(-size, size, (count, 2)), np.zeros(count)])
    flat[:3, :2] = size * np.array([[-1, -1], [1, -1], [0, 1]])
    fit = fit_plane(flat @ turn.T + away, 0.003 * size, observer=2 * size * turn[:, 2] + away)
    rounding = 1e-14 + 4 * np.spacing(abs(away) + size) / size
    assert np.linalg.norm(fit.normal - turn[:, 2]) < 20 * rounding
    assert fit.rejected == ()


def _rotation(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    out: Array = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return out
