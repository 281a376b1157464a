import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import chi2

from ground.errors import GeometryError
from survey.arrays import Array
from survey.registration.homography import fit_homography

# an oblique view of a wall of some 8 m × 6 m on a photograph of 4000 × 3000 pixels
CAMERA = np.array([[0.0022, 0.0001, -4.0], [0.0002, -0.0021, 5.0], [6e-5, -2e-5, 1.0]])
IMAGE = np.array(
    [
        (210, 190),
        (3800, 240),
        (3650, 2810),
        (330, 2700),
        (1900, 1500),
        (1000, 700),
        (2900, 900),
        (1500, 2400),
    ],
    dtype=np.float64,
)


def mapped(matrix: Array, image: Array) -> Array:
    homogeneous = np.column_stack([image, np.ones(len(image))]) @ matrix.T
    out: Array = homogeneous[:, :2] / homogeneous[:, 2:]
    return out


def test_unit_square_to_quadrilateral() -> None:
    # closed form, case P04; the centre of the square maps to the point where the diagonals meet
    fit = fit_homography([[0, 0], [1, 0], [1, 1], [0, 1]], 1e-3, [[0, 0], [4, 0], [3, 3], [0, 2]], 1e-3)
    np.testing.assert_allclose(fit.matrix, [[2.4, 0, 0], [0, 2.4, 0], [-0.4, 0.2, 1]], atol=1e-12)
    np.testing.assert_allclose(fit.apply([[0.5, 0.5]]), [[4 / 3, 4 / 3]], atol=1e-12)
    assert fit.redundancy == 0
    assert np.isnan(fit.sigma0)
    assert np.isnan(fit.standardised).all()


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("count", [4, 5, 8])
def test_exact_data_give_the_exact_map(count: int, offset: float) -> None:
    plane = mapped(CAMERA, IMAGE) + offset
    fit = fit_homography(IMAGE[:count], 1.0, plane[:count], 0.003)
    np.testing.assert_allclose(fit.apply(IMAGE), plane, atol=1e-10 if offset == 0.0 else 1e-9)
    if offset == 0.0:
        np.testing.assert_allclose(fit.matrix, CAMERA, atol=1e-10)
    np.testing.assert_allclose(fit.residuals, 0, atol=1e-9)
    np.testing.assert_allclose(fit.image_residuals, 0, atol=1e-6)


@pytest.mark.parametrize("count", [4, 6])
def test_mapped_points_are_unbiased_and_as_precise_as_predicted(count: int) -> None:
    # 2000 photographs: means within 4 standard errors, normalised variances 1 ± 0.1 (standard error 0.032)
    rng, trials, sigma_image, sigma_plane = np.random.default_rng(count), 2000, 1.5, 0.004
    plane, new = mapped(CAMERA, IMAGE)[:count], np.array([[1200.0, 1800.0], [2700.0, 300.0]])
    truth, errors, distances = mapped(CAMERA, new), [], []
    for _ in range(trials):
        fit = fit_homography(
            IMAGE[:count] + rng.normal(0, sigma_image, (count, 2)),
            sigma_image,
            plane + rng.normal(0, sigma_plane, (count, 2)),
            sigma_plane,
        )
        seen = new + rng.normal(0, 2.0, new.shape)
        error, covariance = fit.apply(seen) - truth, fit.covariance_at(seen, 2.0)
        errors.append(error / np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)))
        distances.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance), error))
    np.testing.assert_allclose(np.mean(errors, axis=0), 0, atol=4 / np.sqrt(trials))
    np.testing.assert_allclose(np.var(errors, axis=0), 1, atol=0.1)
    # with the correlation of the two coordinates: chi-square of two degrees of freedom
    assert np.mean(np.array(distances) > chi2.isf(0.05, 2)) == pytest.approx(0.05, abs=0.015)


def test_adjustment_is_the_minimum_of_all_observations_together() -> None:
    # slow reference: the sixteen measured image coordinates are unknowns too
    rng = np.random.default_rng(2)
    si, sp = rng.uniform(2, 20, 8), rng.uniform(0.005, 0.05, 8)
    u = IMAGE + rng.normal(size=(8, 2)) * si[:, None]
    y = mapped(CAMERA, IMAGE) + rng.normal(size=(8, 2)) * sp[:, None]
    fit = fit_homography(u, si, y, sp)
    assert fit.rejected == ()
    units = np.array([1e-3, 1e-3, 1, 1e-3, 1e-3, 1, 1e-4, 1e-4])

    def errors(unknown: Array) -> Array:
        true = unknown[8:].reshape(8, 2) * 1e3
        seen = mapped(np.append(unknown[:8] * units, 1.0).reshape(3, 3), true)
        return np.concatenate([((true - u) / si[:, None]).ravel(), ((seen - y) / sp[:, None]).ravel()])

    start = np.concatenate([CAMERA.ravel()[:8] / units, u.ravel() / 1e3])
    best = least_squares(errors, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    matrix = np.append(best.x[:8] * units, 1.0).reshape(3, 3)
    assert fit.sigma0**2 * fit.redundancy == pytest.approx(2 * best.cost, rel=1e-8)
    np.testing.assert_allclose(fit.apply(IMAGE), mapped(matrix, IMAGE), atol=1e-6)


def test_residuals_are_given_in_metres_and_in_pixels() -> None:
    rng = np.random.default_rng(9)
    plane = mapped(CAMERA, IMAGE) + rng.normal(0, 0.004, (8, 2))
    fit = fit_homography(IMAGE, 1.0, plane, 0.004)
    np.testing.assert_allclose(fit.residuals, plane - fit.apply(IMAGE), atol=1e-12)
    np.testing.assert_allclose(fit.apply(IMAGE - fit.image_residuals), plane, atol=1e-10)
    assert 0.3 < fit.sigma0 < 2.0
    assert fit.redundancy == 8


def test_a_point_beyond_the_marks_is_mapped_with_less_precision() -> None:
    fit = fit_homography(IMAGE[:4], 1.0, mapped(CAMERA, IMAGE)[:4], 0.004)
    within, beyond = fit.covariance_at([[2000.0, 1500.0], [-4000.0, 1500.0]], 0.0)
    assert np.trace(beyond) > 10 * np.trace(within)


@pytest.mark.parametrize("index", range(8))
def test_a_wrong_mark_is_named_and_left_out(index: int) -> None:
    rng = np.random.default_rng(index)
    plane = mapped(CAMERA, IMAGE) + rng.normal(0, 0.003, (8, 2))
    plane[index] += rng.choice([-1, 1], 2) * rng.uniform(0.2, 0.8, 2)
    fit = fit_homography(IMAGE + rng.normal(0, 1, (8, 2)), 1.0, plane, 0.003)
    assert fit.rejected == (index,)
    assert fit.standardised[index] > fit.limits[index]
    assert fit.redundancy == 6


def test_five_marks_show_that_one_is_wrong_but_not_which() -> None:
    plane = mapped(CAMERA, IMAGE[:5])
    plane[2, 0] += 0.5
    with pytest.raises(
        GeometryError, match="north, east, low, door, sill: the 5 marks contradict each other"
    ):
        fit_homography(IMAGE[:5], 1.0, plane, 0.003, names=["north", "east", "low", "door", "sill"])


@pytest.mark.parametrize(
    ("image", "named"),
    [
        ([[0, 0], [100, 0], [200, 0], [50, 100]], "mark 1, mark 2, mark 3:"),
        ([[0, 0], [100, 0], [200, 2], [50, 100]], "mark 1, mark 2, mark 3:"),
        ([[0, 0], [100, 0], [100, 1], [50, 100]], "mark 2, mark 3:"),
        ([[0, 0], [100, 0], [200, 0], [300, 0], [50, 100]], "mark 1, mark 2, mark 3, mark 4:"),
        ([[7, 7]] * 4, "mark 1, mark 2, mark 3, mark 4:"),
    ],
)
def test_marks_that_fix_no_homography_are_named(image: list[list[float]], named: str) -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(GeometryError, match=named):
        fit_homography(image, 1.0, rng.uniform(0, 5, (len(image), 2)), 0.003)
    with pytest.raises(GeometryError, match=named):
        fit_homography(rng.uniform(0, 4000, (len(image), 2)), 1.0, image, 0.5)


def test_marks_whose_order_no_camera_can_see_are_refused() -> None:
    plane = mapped(CAMERA, IMAGE[:4])[[0, 2, 1, 3]]
    with pytest.raises(GeometryError, match="no camera has all the marks in front of it"):
        fit_homography(IMAGE[:4], 1.0, plane, 0.003)


def test_a_mark_inside_the_triangle_of_others_on_one_side_only_is_refused() -> None:
    image = [[0, 0], [1000, 0], [0, 1000], [1000, 1000]]
    with pytest.raises(GeometryError, match="mark"):
        fit_homography(image, 1.0, [[0, 0], [3, 0], [0, 3], [1, 1]], 0.003)


@pytest.mark.parametrize(
    ("image", "sigma"),
    [
        (IMAGE[:3], 1.0),
        (np.vstack([IMAGE[:3], [[np.nan, 1]]]), 1.0),
        (IMAGE[:4], -1.0),
        (IMAGE[:4], np.inf),
    ],
)
def test_marks_that_are_too_few_or_no_numbers_are_refused(image: Array, sigma: float) -> None:
    with pytest.raises(GeometryError):
        fit_homography(image, sigma, mapped(CAMERA, IMAGE[: len(image)]), 0.003)


def test_spoilt_marks_are_fitted_or_refused_and_nothing_else() -> None:
    # warnings are errors here; coordinates are copied, exchanged, scaled and shifted
    rng = np.random.default_rng(6)
    fitted, refused = 0, []
    for _ in range(80):
        image = IMAGE[: rng.integers(4, 9)].copy()
        plane = mapped(CAMERA, image)
        for points in (image, plane):
            for _ in range(rng.integers(0, 3)):
                i, j = rng.integers(len(points), size=2)
                match rng.integers(4):
                    case 0:
                        points[i] = points[j]
                    case 1:
                        points[[i, j]] = points[[j, i]]
                    case 2:
                        points[i] *= 10.0 ** rng.integers(-6, 7)
                    case _:
                        points[i] += rng.normal(size=2) * 10.0 ** rng.integers(-3, 4)
        try:
            fit = fit_homography(image, 1.0, plane, 0.003)
        except GeometryError as error:
            refused.append(error)
        else:
            assert np.isfinite(fit.covariance).all()
            fitted += 1
    assert min(fitted, len(refused)) > 10
    assert all(error.where and error.remedy for error in refused)
