import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ground.errors import GeometryError
from survey.arrays import Array
from survey.faces.planes import fit_plane
from tests.survey.faces.plane_twin import CHECKERBOARD


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


def test_normal_looks_to_the_observer() -> None:
    for height in (5.0, -5.0):
        assert fit_plane(CHECKERBOARD, 0.01, observer=[0.1, 0.2, height]).normal[2] * height > 0


def test_three_points_have_no_redundancy_and_say_so() -> None:
    fit = fit_plane([[0, 0, 0], [1, 0, 0], [0, 1, 0]], 0.003)
    assert fit.redundancy == 0
    assert np.isnan(fit.sigma0)
    assert np.isfinite(fit.covariance).all()


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0, 0, 0], [1, 0, 0]], r"found \(2, 3\)"),
        ([[1, 2, 3]] * 5, "all 5 points coincide"),
        ([[0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 0]], "only 2 of 4 points are distinct.*1 m long"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], "on one line, 3 m long and 0 m wide"),
        ([[0, 0, 0], [1, 0, 0], [2, 0.004, 0], [3, 0, 0]], "3 m by 0.00.* not known better than"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, np.nan]], "point 3 is not finite"),
        ([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]], "point 3 is not finite"),
    ],
)
def test_points_without_a_plane_are_refused_with_the_reason(points: list[list[float]], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        fit_plane(points, 0.003)


@pytest.mark.parametrize(
    ("sigma", "words"),
    [
        (0.0, "point 1 is 0 m"),
        ([0.01] * 15 + [-0.01], "point 16 is -0.01 m"),
        ([0.01, np.nan] + [0.01] * 14, "point 2 is nan m"),
        ([0.01, 0.01], r"\(2,\) standard deviations for 16 points"),
    ],
)
def test_a_precision_that_is_none_is_refused(sigma: float | list[float], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        fit_plane(CHECKERBOARD, sigma)


@pytest.mark.parametrize(("width", "refused"), [(0.030, True), (0.040, False)])
def test_a_strip_is_refused_where_its_tilt_is_not_known_to_ten_degrees(width: float, refused: bool) -> None:
    # four corners of 3 mm: σ / (√4 · width/2) is 10° = 0.1745 at 17 mm; of 6 mm at 34 mm
    corners = np.array([[0, 0, 0], [0.6, 0, 0], [0.6, width, 0], [0, width, 0]])
    fit_plane(corners, 0.003)
    if refused:
        with pytest.raises(GeometryError, match=r"0\.6 m by 0\.03 m: .* better than 11°"):
            fit_plane(corners, 0.006)
    else:
        fit_plane(corners, 0.006)


def test_predicted_standard_deviations_are_those_of_many_faces() -> None:
    # 2000 simulated faces with known noise: normalised errors have variance 1; its own standard error is
    # √(2/2000) = 0.032
    rng, sigma = np.random.default_rng(7), 0.003
    turn, shift = Rotation.from_rotvec([0.5, 0.2, -0.4]).as_matrix(), np.array([40.0, -25.0, 12.0])
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


def test_a_fifth_of_gross_blunders_leaves_the_normal_within_three_standard_deviations() -> None:
    # two tilts within 3 standard deviations: 99.46 % without any blunder, so 0.46 % are left to the search; ± 0.22 %
    rng, sigma, good = np.random.default_rng(11), 0.003, 0
    for _ in range(2000):
        points = np.column_stack([rng.uniform(-0.3, 0.3, 15), rng.uniform(-0.2, 0.2, 15), np.zeros(15)])
        points += rng.normal(0, sigma, points.shape)
        points[:3, 2] += rng.choice([-1, 1], 3) * rng.uniform(0.03, 0.3, 3)
        fit = fit_plane(points, sigma, observer=[0, 0, 5])
        tilts = fit.axes @ np.array([0.0, 0.0, 1.0])
        good += bool((np.abs(tilts) < 3.0 * np.sqrt(np.diag(fit.covariance)[:2])).all())
    assert good >= 1980


def test_half_of_a_face_may_be_wrong_if_its_points_are_not_wrong_together() -> None:
    # 10 of 20 points 10 to 100 standard deviations off; least squares of the median needs 12 good ones
    rng, found = np.random.default_rng(12), 0
    for _ in range(100):
        points = np.column_stack([rng.uniform(-0.3, 0.3, 20), rng.uniform(-0.2, 0.2, 20), np.zeros(20)])
        points += rng.normal(0, 0.003, points.shape)
        points[:10, 2] += rng.choice([-1, 1], 10) * rng.uniform(0.03, 0.3, 10)
        found += set(range(10)) <= set(fit_plane(points, 0.003, observer=[0, 0, 5]).rejected)
    assert found >= 95


def test_points_behind_a_face_are_blunders_rather_than_points_in_front_of_it() -> None:
    # an eroded edge, 4 to 6 points of 16 lost by 10 to 25 mm: seen from where it lies behind, the face is found more
    # often than where the same points would stand out of it
    rng, right = np.random.default_rng(13), {5.0: 0, -5.0: 0}
    for _ in range(500):
        points = np.column_stack([rng.uniform(-0.3, 0.3, 16), rng.uniform(-0.2, 0.2, 16), np.zeros(16)])
        lost = np.argsort(points[:, 0])[: int(rng.integers(4, 7))]
        points[lost, 2] -= rng.uniform(0.010, 0.025, len(lost))
        points += rng.normal(0, 0.00173, points.shape)
        for height in right:
            right[height] += set(lost) == set(fit_plane(points, 0.00173, [0, 0, height]).rejected)
    assert right[5.0] > 1.2 * right[-5.0]
    assert right[5.0] > 300


def test_a_plane_seen_edge_on_is_not_the_face() -> None:
    # six points along one edge at any height lie on a plane across the face, which leaves three points over
    edge = np.column_stack([np.linspace(0, 0.6, 6), np.zeros(6), [0.0, 0.1, -0.15, 0.2, 0.0, -0.1]])
    face = [[0.1, 0.2, 0.0], [0.5, 0.2, 0.0], [0.3, 0.3, 0.0], [0.2, 0.35, 0.0]]
    fit = fit_plane(np.vstack([edge, face]), 0.002, observer=[0.3, 0.2, 5])
    np.testing.assert_allclose(fit.normal, [0, 0, 1], atol=1e-12)
    assert fit.rejected == (1, 2, 3, 5)


def test_points_far_beside_the_face_do_not_turn_it() -> None:
    # a point 10 m away would fit any plane within ±130 mm there, and then be all that is known of the tilt
    points = np.vstack([0.1 * CHECKERBOARD, [[10.0, 0.0, 0.05]]])
    fit = fit_plane(points, 0.002, observer=[0, 0, 9])
    assert fit.rejected == (16,)
    np.testing.assert_allclose(fit.normal, [0, 0, 1], atol=1e-12)


def test_points_close_together_do_not_make_the_rest_of_a_face_lie_beside_it() -> None:
    # six points within 70 mm by 16 mm know little of a tilt; the seventh, alone 0.4 m away, is then no wild shot
    close = np.array(
        [[0, 0, 0], [0.07, 0, 0], [0.07, 0.016, 0], [0, 0.016, 0], [0.03, 0.008, 0], [0.05, 0, 0]]
    )
    fit = fit_plane(np.vstack([close, [[0.1, 0.4, 0.0]]]), 0.003)
    assert fit.rejected == ()


def test_the_tests_honour_the_precision_of_each_point() -> None:
    # 20 mm off is a blunder of a point of 2 mm, and nothing for one of 10 mm
    points = 0.1 * CHECKERBOARD
    points[5, 2] += 0.02
    precise, coarse = np.full(16, 0.002), np.full(16, 0.002)
    coarse[5] = 0.01
    assert fit_plane(points, precise).rejected == (5,)
    assert fit_plane(points, coarse).rejected == ()


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
@example(
    seed=153005111, count=10, size=1.0, away=0.0
)  # one corner alone, far from nine points close together
def test_exact_planes_are_recovered_at_any_size_and_place(
    seed: int, count: int, size: float, away: float
) -> None:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    flat = np.column_stack([rng.uniform(-size, size, (count, 2)), np.zeros(count)])
    flat[:3, :2] = size * np.array([[-1, -1], [1, -1], [0, 1]])
    rounding = 1e-14 + 4 * np.spacing(abs(away) + size) / size
    for sigma in (0.003 * size, None):
        fit = fit_plane(flat @ turn.T + away, sigma, observer=2 * size * turn[:, 2] + away)
        assert np.linalg.norm(fit.normal - turn[:, 2]) < 20 * rounding
        assert fit.rejected == ()


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(6, 24), st.sampled_from([0.0, 0.2]), st.floats(0.1, 10.0))
def test_turned_moved_scaled_and_shuffled_points_have_the_turned_moved_and_scaled_plane(
    seed: int, count: int, wrong: float, scale: float
) -> None:
    rng = np.random.default_rng(seed)
    points = _face(rng, count, wrong)
    sigma, observer = rng.uniform(0.001, 0.003, count), np.array([0, 0, 5.0])
    turn, away, order = (
        Rotation.from_rotvec(rng.normal(size=3)).as_matrix(),
        rng.uniform(-1e3, 1e3, 3),
        rng.permutation(count),
    )
    fit = fit_plane(points, sigma, observer)
    moved = scale * (points @ turn.T) + away
    other = fit_plane(moved[order], scale * sigma[order], scale * (turn @ observer) + away)
    # erosion is a length: smaller blunders, and points beyond the limit by chance, count by the side they lie on
    if 0.8 < scale < 1.2 or (wrong == 0.0 and np.abs(fit.standardised).max() < 3.29):
        assert {int(order[i]) for i in other.rejected} == set(fit.rejected)
        np.testing.assert_allclose(other.normal, turn @ fit.normal, atol=1e-9)
        np.testing.assert_allclose(other.centroid, scale * (turn @ fit.centroid) + away, atol=1e-8)
        np.testing.assert_allclose(other.residuals, scale * fit.residuals[order], atol=1e-9)
        np.testing.assert_allclose(other.standardised, fit.standardised[order], atol=1e-6)
        np.testing.assert_allclose(
            np.diag(other.covariance), np.diag(fit.covariance) * [1, 1, scale**2], rtol=1e-6
        )


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(5, 20))
def test_a_point_given_twice_is_a_point_of_half_the_variance(seed: int, count: int) -> None:
    points = _face(np.random.default_rng(seed), count, 0.0)
    sigma = np.full(count, 0.003)
    twice = fit_plane(np.vstack([points, points[:2]]), 0.003)
    sigma[:2] /= np.sqrt(2.0)
    once = fit_plane(points, sigma)
    if once.rejected == twice.rejected == ():
        np.testing.assert_allclose(twice.normal, once.normal, atol=1e-13)
        np.testing.assert_allclose(twice.covariance, once.covariance, rtol=1e-11, atol=1e-18)


def test_a_fit_repeats_bit_for_bit() -> None:
    for count in (12, 26, 60):
        points = _face(np.random.default_rng(count), count, 0.3)
        first, second = (fit_plane(points, 0.002, [0, 0, 5]) for _ in range(2))
        assert first.normal.tobytes() == second.normal.tobytes()
        assert first.residuals.tobytes() == second.residuals.tobytes()
        assert first.rejected == second.rejected


def test_axes_and_normal_are_right_handed() -> None:
    for height in (5.0, -5.0):
        fit = fit_plane(CHECKERBOARD, 0.01, observer=[0, 0, height])
        frame = np.vstack([fit.axes, fit.normal])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(frame) == pytest.approx(1.0)


def _face(rng: np.random.Generator, count: int, wrong: float) -> Array:
    """Points of 2 mm on a face of 0.6 m by 0.4 m, a part of them 30 to 300 mm off."""
    points = np.column_stack([rng.uniform(-0.3, 0.3, count), rng.uniform(-0.2, 0.2, count), np.zeros(count)])
    points[-4:, :2] = [[-0.3, -0.2], [0.3, -0.2], [0.3, 0.2], [-0.3, 0.2]]
    points += rng.normal(0, 0.002, points.shape)
    off = int(wrong * count)
    points[:off, 2] += rng.choice([-1, 1], off) * rng.uniform(0.03, 0.3, off)
    return points
