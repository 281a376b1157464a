from fractions import Fraction

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from ground.errors import SurveyError
from survey.arrays import Array
from survey.records.survey import (
    BlockRecord,
    ControlPoint,
    Extrusion,
    Photograph,
    PhotoMark,
    SolidRecord,
    Station,
    SurveyHead,
)
from survey.registration.similarity import best_similarity
from survey.registration.site_frame import SiteTransform, fit_similarity, record_to_site, to_site

TURN: Array = Rotation.from_rotvec([0.3, -0.5, 2.0]).as_matrix()
WALL = np.array(
    [
        (0, 0, 0),
        (12, 0.5, 0.2),
        (11.5, -0.4, 6),
        (0.3, 0.2, 6.5),
        (6, 1.5, 3),
        (5, -0.7, 8),
        (2, 3, 1),
        (9, 2, 7),
    ],
    dtype=np.float64,
)


def control(
    measured: Array, site: Array, measured_sigma: float = 0.003, site_sigma: float = 0.004
) -> list[ControlPoint]:
    pairs = enumerate(zip(measured, site, strict=True))
    return [ControlPoint(f"C{i}", x, measured_sigma, y, site_sigma, i + 3) for i, (x, y) in pairs]


def transformed(points: Array, scale: float = 1.002, turn: Array = TURN) -> Array:
    out: Array = np.array([350.0, -120.0, 44.0]) + scale * points @ turn.T
    return out


# ------------------------------------------------------------------------------------------ closed form, exactness


def test_closed_form_is_umeyamas_example() -> None:
    # Umeyama (1991), recomputed: case P03
    x, y = np.array([[0.0, 0], [1, 0], [0, 2]]), np.array([[0.0, 0], [-1, 0], [0, 2]])
    rotation, scale, x0, y0 = best_similarity(x, y, np.ones(3))
    shift = y0 - scale * rotation @ x0
    # in closed form: R = [[3, 2], [-2, 3]]/√13, c = √13/5, t = (-0.8, 0.4), mean squared error 8/15
    np.testing.assert_allclose(rotation, np.array([[3, 2], [-2, 3]]) / np.sqrt(13), atol=1e-12)
    assert scale == pytest.approx(np.sqrt(13) / 5, abs=1e-12)
    np.testing.assert_allclose(shift, [-0.8, 0.4], atol=1e-12)
    error = ((y - shift - scale * x @ rotation.T) ** 2).sum(axis=1).mean()
    assert error == pytest.approx(8 / 15, abs=1e-12)
    np.testing.assert_allclose([rotation[0, 0], rotation[0, 1], scale], [0.83205, 0.5547, 0.72111], atol=5e-6)


def test_closed_form_rotation_is_that_of_scipy() -> None:
    rng = np.random.default_rng(5)
    x, y, weights = rng.normal(size=(9, 3)), rng.normal(size=(9, 3)), rng.uniform(0.1, 3, 9)
    rotation, _, x0, y0 = best_similarity(x, y, weights)
    other, _ = Rotation.align_vectors(y - y0, x - x0, weights=weights)
    np.testing.assert_allclose(rotation, other.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_exact_data_give_the_exact_transform(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn, scale = Rotation.random(rng=rng).as_matrix(), rng.uniform(0.5, 2)
    measured = rng.uniform(-10, 10, (rng.integers(3, 8), 3))
    fit = fit_similarity(control(measured, transformed(measured, scale, turn)))
    np.testing.assert_allclose(fit.rotation, turn, atol=1e-12)
    assert fit.scale == pytest.approx(scale, abs=1e-12)
    new = rng.uniform(-20, 20, (5, 3))
    np.testing.assert_allclose(fit.apply(new), transformed(new, scale, turn), atol=1e-10)
    np.testing.assert_allclose(fit.residuals, 0, atol=1e-10)
    assert np.linalg.det(fit.rotation) == pytest.approx(1, abs=1e-12)


def test_control_in_one_plane_is_enough() -> None:
    flat = WALL * [1, 0, 1]
    fit = fit_similarity(control(flat, transformed(flat)))
    np.testing.assert_allclose(fit.apply(WALL), transformed(WALL), atol=1e-10)


def test_coordinates_of_seven_million_metres_lose_nothing() -> None:
    # survey coordinates in 1/1024 m, and offsets that are whole: both sets are the same binary numbers
    rng = np.random.default_rng(3)
    near = np.round(WALL * 1024) / 1024
    there = np.round(transformed(near) * 1024 + rng.normal(0, 3, near.shape)) / 1024
    far, offset = np.array([7e6, 5e6, 300]), np.array([-6.5e6, 7e6, 1000])
    small = fit_similarity(control(near, there))
    large = fit_similarity(control(near + far, there + offset))
    np.testing.assert_allclose(large.rotation, small.rotation, atol=1e-13)
    assert large.scale == pytest.approx(small.scale, abs=1e-13)
    # the site centre can be written down to half a unit in the last place, 4.7e-10 m, and no better
    np.testing.assert_allclose(large.residuals, small.residuals, atol=1e-12)
    np.testing.assert_allclose(large.covariance, small.covariance, rtol=1e-9, atol=1e-18)
    moved = large.apply(near + far)
    exact = _exactly(large, near + far)
    assert np.abs(moved - np.array(exact, dtype=np.float64)).max() <= 1e-9  # one unit in the last place
    np.testing.assert_allclose(moved - offset, small.apply(near), atol=2e-9)


def _exactly(fit: SiteTransform, points: Array) -> list[list[float]]:
    """site_centre + s R (x - survey_centre) in rational numbers."""
    s, rotation = Fraction(fit.scale), [[Fraction(v) for v in row] for row in fit.rotation.tolist()]
    out = []
    for point in points.tolist():
        arm = [Fraction(x) - Fraction(c) for x, c in zip(point, fit.survey_centre.tolist(), strict=True)]
        turned = [sum(r * a for r, a in zip(row, arm, strict=True)) for row in rotation]
        out.append(
            [float(Fraction(c) + s * t) for c, t in zip(fit.site_centre.tolist(), turned, strict=True)]
        )
    return out


# ----------------------------------------------------------------------------------------- least squares, precision


def test_adjustment_is_the_minimum_of_all_observations_together() -> None:
    # slow reference: the twenty-four measured coordinates of the survey are unknowns too
    rng = np.random.default_rng(11)
    sx, sy = rng.uniform(0.02, 0.2, 8), rng.uniform(0.02, 0.2, 8)
    x, y = (
        WALL + rng.normal(size=(8, 3)) * sx[:, None],
        transformed(WALL) + rng.normal(size=(8, 3)) * sy[:, None],
    )
    points = [
        ControlPoint(f"C{i}", a, s, b, t) for i, (a, s, b, t) in enumerate(zip(x, sx, y, sy, strict=True))
    ]
    fit = fit_similarity(points)

    def errors(unknown: Array) -> Array:
        true = unknown[7:].reshape(8, 3)
        turn = Rotation.from_rotvec(unknown[3:6]).as_matrix()
        seen = unknown[:3] + unknown[6] * true @ turn.T
        return np.concatenate([((true - x) / sx[:, None]).ravel(), ((seen - y) / sy[:, None]).ravel()])

    start = np.concatenate([y[0], Rotation.from_matrix(TURN).as_rotvec(), [1.0], x.ravel()])
    best = least_squares(errors, start, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert fit.scale == pytest.approx(best.x[6], abs=1e-8)
    np.testing.assert_allclose(fit.rotation, Rotation.from_rotvec(best.x[3:6]).as_matrix(), atol=1e-8)
    np.testing.assert_allclose(fit.apply(np.zeros(3)), best.x[:3], atol=1e-7)
    assert fit.sigma0**2 * fit.redundancy == pytest.approx(2 * best.cost, rel=1e-9)
    # its covariance: the part of the inverse normal matrix, at x = 0, that belongs to the translation and the scale
    full = np.linalg.inv(best.jac.T @ best.jac)
    np.testing.assert_allclose(fit.sigma_at(np.zeros(3)), np.sqrt(np.diag(full)[:3]), rtol=0.01)
    assert np.sqrt(fit.covariance[6, 6]) == pytest.approx(np.sqrt(full[6, 6]) / best.x[6], rel=0.01)


def test_estimates_are_unbiased_and_as_precise_as_predicted() -> None:
    # 2000 surveys: means within 4 standard errors; variances of normalised errors 1 ± 0.1 (standard error 0.032)
    rng, count, sx, sy = np.random.default_rng(8), 2000, 0.006, 0.004
    site, far = transformed(WALL), np.array([[20.0, 5.0, 10.0]])
    errors, places, tests, kept = [], [], [], 0
    for _ in range(count):
        fit = fit_similarity(
            control(WALL + rng.normal(0, sx, WALL.shape), site + rng.normal(0, sy, WALL.shape), sx, sy)
        )
        true_centre = transformed(fit.survey_centre)
        turn = Rotation.from_matrix(fit.rotation @ TURN.T).as_rotvec()
        error = np.concatenate([fit.site_centre - true_centre, turn, [np.log(fit.scale / 1.002)]])
        # the centroid itself is an observation: only its place on site is predicted, given that in the survey
        errors.append(error / np.sqrt(np.diag(fit.covariance)))
        places.append(((fit.apply(far) - transformed(far)) / fit.sigma_at(far))[0])
        kept += not fit.rejected
        tests.append(fit.standardised**2)
    for normalised in (np.array(errors), np.array(places)):
        np.testing.assert_allclose(normalised.mean(axis=0), 0, atol=4 / np.sqrt(count))
        np.testing.assert_allclose(normalised.var(axis=0), 1, atol=0.1)
    # chi-square of three degrees of freedom: its mean, and how many exceed the upper one per cent
    np.testing.assert_allclose(np.mean(tests, axis=0), 3, atol=5 * np.sqrt(6 / count))
    assert np.mean(np.array(tests) > chi2.isf(0.01, 3)) == pytest.approx(0.01, abs=0.003)
    # of nine tests at 0.1 % each, most of one survey in a hundred fails one
    assert kept >= 0.985 * count


def test_scale_is_not_biased_by_errors_of_the_survey() -> None:
    # closed form: the error σ of the survey's coordinates shortens the scale by nσ²·3/Σ|x|²; least squares does not
    rng, count, sigma = np.random.default_rng(21), 2000, 0.3
    measured = rng.uniform(-6, 6, (12, 3))
    measured -= measured.mean(axis=0)
    site = transformed(measured)
    adjusted, plain = [], []
    for _ in range(count):
        noisy = measured + rng.normal(0, sigma, measured.shape)
        adjusted.append(fit_similarity(control(noisy, site, sigma, 1e-3)).scale / 1.002 - 1)
        plain.append(best_similarity(noisy, site, np.ones(12))[1] / 1.002 - 1)
    expected = -3 * 11 * sigma**2 / (measured**2).sum()
    error = np.std(plain) / np.sqrt(count)
    assert np.mean(plain) == pytest.approx(expected, abs=4 * error)
    assert expected < -8 * error
    assert abs(np.mean(adjusted)) < 4 * error


def test_precision_is_worst_far_from_the_control() -> None:
    fit = fit_similarity(control(WALL, transformed(WALL)))
    # eight points of √(3² + 1.002²·4²) mm: at their centroid that over √8
    at_centre = fit.sigma_at(fit.survey_centre)
    np.testing.assert_allclose(at_centre, np.hypot(0.004, 1.002 * 0.003) / np.sqrt(8), rtol=1e-9)
    assert (fit.sigma_at(fit.survey_centre + 100.0) > 5 * at_centre).all()


def test_a_survey_in_millimetres_is_brought_to_metres() -> None:
    millimetres = WALL * 1000.0
    fit = fit_similarity(control(millimetres, transformed(millimetres, 0.001), 3.0, 0.004))
    np.testing.assert_allclose(fit.apply(millimetres), transformed(WALL, 1.0), atol=1e-10)
    same = fit_similarity(control(WALL, transformed(WALL, 1.0), 0.003, 0.004))
    np.testing.assert_allclose(fit.covariance, same.covariance, rtol=1e-9, atol=1e-18)


def test_scale_is_told_from_one_only_where_it_differs() -> None:
    rng = np.random.default_rng(4)
    noise = rng.normal(0, 0.003, (2, 8, 3))
    same = fit_similarity(control(WALL + noise[0], transformed(WALL, 1.0) + noise[1], 0.003, 0.003))
    other = fit_similarity(control(WALL + noise[0], transformed(WALL, 1.003) + noise[1], 0.003, 0.003))
    assert not same.scale_differs
    assert other.scale_differs
    assert other.scale_test > 3.3


# ------------------------------------------------------------------------------------------------------- blunders


def noisy(seed: int, count: int = 8) -> list[ControlPoint]:
    rng = np.random.default_rng(seed)
    wall = WALL[:count]
    return control(
        wall + rng.normal(0, 0.003, wall.shape), transformed(wall) + rng.normal(0, 0.004, wall.shape)
    )


def moved(points: list[ControlPoint], index: int, by: Array) -> list[ControlPoint]:
    out = list(points)
    out[index] = ControlPoint(
        out[index].name, out[index].measured, 0.003, out[index].site + by, 0.004, out[index].line
    )
    return out


@pytest.mark.parametrize("size", [0.05, 1.0, 100.0])
@pytest.mark.parametrize("index", range(8))
def test_a_blunder_is_named_and_left_out(index: int, size: float) -> None:
    points = noisy(index + 100)
    direction = np.random.default_rng(index).normal(size=3)
    fit = fit_similarity(moved(points, index, size * direction / np.linalg.norm(direction)))
    assert fit.rejected == (f"C{index}",)
    assert fit.standardised[index] > fit.limits[index]
    assert fit.redundancy == 3 * 7 - 7
    without = fit_similarity(points[:index] + points[index + 1 :])
    np.testing.assert_allclose(fit.apply(WALL), without.apply(WALL), atol=1e-9)
    assert np.linalg.norm(fit.residuals[index]) == pytest.approx(size, abs=0.03 + 0.01 * size)


def test_two_points_with_exchanged_names_are_both_left_out() -> None:
    points = noisy(17)
    a, b = points[1], points[6]
    points[1] = ControlPoint(a.name, a.measured, 0.003, b.site, 0.004, a.line)
    points[6] = ControlPoint(b.name, b.measured, 0.003, a.site, 0.004, b.line)
    assert fit_similarity(points).rejected == ("C1", "C6")


def test_three_inconsistent_points_name_all_three() -> None:
    with pytest.raises(SurveyError, match=r"C0 \(line 3\), C1 \(line 4\), C2.*five or more show which"):
        fit_similarity(moved(noisy(1, 3), 1, np.array([0.5, 0.0, 0.2])))


def test_four_inconsistent_points_name_the_suspicious_ones() -> None:
    with pytest.raises(SurveyError, match="C2") as raised:
        fit_similarity(moved(noisy(1, 4), 2, TURN @ [0.3, 0.0, 0.2]))
    assert "C0 (" not in raised.value.where  # type: ignore[operator]


def test_precision_that_was_overstated_is_refused_as_a_contradiction() -> None:
    rng = np.random.default_rng(2)
    points = control(WALL + rng.normal(0, 0.03, WALL.shape), transformed(WALL))
    with pytest.raises(SurveyError, match="times less precise than stated"):
        fit_similarity(points)


# ------------------------------------------------------------------------------------------------ degenerate sets


def test_fewer_than_three_points_are_refused() -> None:
    with pytest.raises(SurveyError, match="three control points, found 2"):
        fit_similarity(noisy(1, 2))
    with pytest.raises(SurveyError, match="found 0"):
        fit_similarity([])


@pytest.mark.parametrize("lateral", [0.0, 0.01])
def test_points_on_a_line_are_refused(lateral: float) -> None:
    line = np.linspace(0, 9, 5)[:, None] * [1.0, 2.0, 0.5] + [[0, 0, 0], [0, 0, lateral], *[[0, 0, 0]] * 3]
    with pytest.raises(SurveyError, match="lie on one line in the survey"):
        fit_similarity(control(line, transformed(line)))


def test_points_that_coincide_are_refused() -> None:
    spot = np.tile([3.0, 4.0, 5.0], (4, 1))
    with pytest.raises(SurveyError, match="coincide in the survey"):
        fit_similarity(control(spot, transformed(WALL[:4])))
    with pytest.raises(SurveyError, match="coincide on site"):
        fit_similarity(control(WALL[:4], spot))


def test_mirrored_frames_are_refused() -> None:
    with pytest.raises(SurveyError, match="mirror image"):
        fit_similarity(control(WALL, transformed(WALL)[:, [1, 0, 2]]))


def test_values_that_are_no_numbers_are_refused() -> None:
    bad = WALL.copy()
    bad[2, 1] = np.nan
    with pytest.raises(SurveyError, match=r"control point C2 \(line 5\)"):
        fit_similarity(control(bad, transformed(WALL)))


def test_spoilt_control_points_are_fitted_or_refused_and_nothing_else() -> None:
    # warnings are errors here; coordinates are copied, exchanged, scaled, shifted and flattened
    rng = np.random.default_rng(6)
    fitted, refused = 0, []
    for _ in range(80):
        sets = [WALL[: rng.integers(3, 9)].copy()]
        sets.append(transformed(sets[0]))
        for points in sets:
            for _ in range(rng.integers(0, 3)):
                i, j, axis = *rng.integers(len(points), size=2), rng.integers(3)
                match rng.integers(5):
                    case 0:
                        points[i] = points[j]
                    case 1:
                        points[[i, j]] = points[[j, i]]
                    case 2:
                        points[i] *= 10.0 ** rng.integers(-6, 7)
                    case 3:
                        points[i] += rng.normal(size=3) * 10.0 ** rng.integers(-3, 4)
                    case _:
                        points[:, axis] = points[0, axis]
        try:
            fit = fit_similarity(control(*sets))
        except SurveyError as error:
            refused.append(error)
        else:
            assert np.linalg.det(fit.rotation) == pytest.approx(1.0)
            assert np.isfinite(fit.covariance).all()
            fitted += 1
    assert min(fitted, len(refused)) > 10
    assert all(error.where and error.remedy for error in refused)


# ---------------------------------------------------------------------------------------------- moving a survey


def test_a_survey_is_moved_into_the_site_frame() -> None:
    fit = fit_similarity(control(WALL, transformed(WALL, 2.0)))
    head = SurveyHead(
        "north",
        "north.moma",
        stations=(Station("S1", np.array([1.0, 2, 3])),),
        control=tuple(control(WALL, WALL)),
        photographs=(
            Photograph("P1", 1.0, (PhotoMark(np.array([5.0, 6]), np.array([4.0, 5, 6]), 0.002, 9),), "S1", 8),
        ),
        extrusion=Extrusion(np.array([0.0, 3, 0]), 0.8),
    )
    there = to_site(head, fit)
    np.testing.assert_allclose(
        there.stations[0].position, transformed(np.array([1.0, 2, 3]), 2.0), atol=1e-10
    )
    mark = there.photographs[0].marks[0]
    np.testing.assert_allclose(mark.position, transformed(np.array([4.0, 5, 6]), 2.0), atol=1e-10)
    assert mark.sigma == pytest.approx(0.004)
    np.testing.assert_array_equal(mark.image, [5, 6])
    np.testing.assert_allclose(there.extrusion.direction, 3 * TURN[:, 1], atol=1e-10)  # type: ignore[arg-type]
    assert there.control is head.control


def test_a_stone_is_moved_into_the_site_frame_and_keeps_its_taped_depth() -> None:
    fit = fit_similarity(control(WALL, transformed(WALL, 2.0)))
    stone = BlockRecord(
        "W01", "header", 1, WALL[:4], WALL[4:6], 0.003, depth=0.4, depth_sigma=0.01,
        sigmas=np.full(6, 0.003), extrusion=Extrusion(np.array([0.0, 0, 2])),
    )  # fmt: skip
    there = record_to_site(stone, fit)
    np.testing.assert_allclose(there.vertices, transformed(WALL[:4], 2.0), atol=1e-10)
    np.testing.assert_allclose(there.points, transformed(WALL[4:6], 2.0), atol=1e-10)
    assert there.sigma == pytest.approx(0.006)
    np.testing.assert_allclose(there.sigmas, 0.006)  # type: ignore[arg-type]
    np.testing.assert_allclose(there.extrusion.direction, 2 * TURN[:, 2], atol=1e-10)  # type: ignore
    assert (there.depth, there.depth_sigma, there.code) == (0.4, 0.01, "W01")


def test_a_stone_on_a_photograph_has_no_corners_to_move() -> None:
    fit = fit_similarity(control(WALL, transformed(WALL)))
    stone = BlockRecord("W02", "header", 1, np.empty((0, 3)), np.empty((0, 3)), 0.003, image=np.ones((4, 2)))
    assert record_to_site(stone, fit).vertices.shape == (0, 3)


def test_a_solid_is_moved_into_the_site_frame() -> None:
    fit = fit_similarity(control(WALL, transformed(WALL)))
    there = record_to_site(SolidRecord("B1", "block", None, WALL, ((0, 1, 2),)), fit)
    np.testing.assert_allclose(there.vertices, transformed(WALL), atol=1e-10)
