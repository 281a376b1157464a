"""Similarity into the site frame and homography of a photograph, against exact data, other programs and chance.

Sources: Umeyama 1991, IEEE PAMI 13, 376 (case P03: its example; the paper prints 0.053 for the mean square, which is
0.5333); Horn 1987; the projective map of the unit square in closed form (Heckbert 1989, case P04); Hartley & Zisserman
2004, § 4.1 (direct linear transform) and § 4.3 (the reprojection error, which is minimised here by scipy).
"""

import mpmath
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ground.errors import GeometryError, SurveyError
from survey.records.survey import ControlPoint
from survey.registration.homography import fit_homography
from survey.registration.similarity import best_similarity
from survey.registration.site_frame import fit_similarity
from tests.validation.survey.stone_faces import NINTHS, THIRDS, turned

TRIALS = 2000
LAMBERT = np.array([650_000.0, 6_860_000.0, 300.0])


def control(source, target, source_sigma=0.003, target_sigma=0.002):
    """Control points C1, C2, …; sigmas one for all or of each."""
    n = len(source)
    sx, sy = np.broadcast_to(source_sigma, n), np.broadcast_to(target_sigma, n)
    return [
        ControlPoint(f"C{i + 1}", source[i], float(sx[i]), target[i], float(sy[i]), i + 1) for i in range(n)
    ]


# --- similarity ---


def test_umeyamas_example_is_case_p03():
    x, y = np.array([[0.0, 0], [1, 0], [0, 2]]), np.array([[0.0, 0], [-1, 0], [0, 2]])
    rotation, scale, source, target = best_similarity(x, y, np.ones(3))
    np.testing.assert_allclose(
        rotation, np.array([[3, 2], [-2, 3]]) / np.sqrt(13), atol=1e-9
    )  # 0.83205, 0.5547
    assert scale == pytest.approx(0.72111, abs=5e-6)
    np.testing.assert_allclose(target - scale * rotation @ source, [-0.8, 0.4], atol=1e-9)
    errors = y - target - scale * (x - source) @ rotation.T
    assert np.mean((errors**2).sum(axis=1)) == pytest.approx(0.533333, abs=5e-7)
    assert np.linalg.det(rotation) == pytest.approx(1.0)  # no reflection, though one would fit exactly


POINTS = np.array([[0, 0, 0], [16, 0, 3], [18, 9, -2], [-1, 11, 5], [7, 4, 8], [3, -6, 1]])


@pytest.mark.parametrize(("matrix", "divisor"), [(NINTHS, 9), (THIRDS, 3)], ids=["ninths", "thirds"])
@pytest.mark.parametrize(
    "away", [np.zeros(3), LAMBERT, np.array([7e6, -7e6, 7e6])], ids=["near", "lambert", "7e6"]
)
@pytest.mark.parametrize("count", [3, 4, 6])
def test_exact_similarities_are_found(matrix, divisor, away, count):
    # integers times integers over 8: no rounding in the data; scale 9/8 or 3/8
    target = POINTS @ matrix.T / 8 + away
    found = fit_similarity(control(POINTS.astype(float), target))
    np.testing.assert_allclose(found.rotation, matrix / divisor, atol=1e-12)
    assert found.scale == pytest.approx(divisor / 8, rel=1e-12)
    # asked for: 1e-10; a coordinate of 7e6 m in 64 bits is known to 1e-9 m
    np.testing.assert_allclose(found.apply(POINTS), target, atol=1e-12 if not away.any() else 2e-9, rtol=0)
    np.testing.assert_allclose(found.residuals, 0, atol=1e-12 if not away.any() else 2e-9)
    assert found.rejected == ()


def test_rotation_is_that_of_scipy():
    rng = np.random.default_rng(51)
    for _ in range(50):
        source = rng.uniform(-10, 10, (7, 3))
        sx, sy = (10 ** rng.uniform(-3, -2, 7) for _ in range(2))
        target = 1.5 * source @ turned(rng).T + rng.normal(size=(7, 3)) * sy[:, None] + 40
        found = fit_similarity(control(source, target, sx, sy))
        if found.rejected:
            continue
        weights = 1 / (sy**2 + found.scale**2 * sx**2)
        x, y = (p - np.average(p, axis=0, weights=weights) for p in (source, target))
        expected, _ = Rotation.align_vectors(y, x, weights)
        np.testing.assert_allclose(found.rotation, expected.as_matrix(), atol=1e-10)


def test_adjusted_similarity_is_the_minimum_to_twelve_digits():
    # Σ |y - t - s R x|² / (σy² + s² σx²), the maximum of the likelihood, in 40 digits: Newton's step there is nothing
    rng = np.random.default_rng(52)
    source = rng.uniform(-8, 8, (6, 3))
    sx, sy = np.array([2, 3, 5, 2, 3, 4]) * 1e-3, np.array([4, 2, 1, 3, 2, 5]) * 1e-3
    target = (
        1.2 * (source + rng.normal(size=(6, 3)) * sx[:, None]) @ turned(rng).T
        + rng.normal(size=(6, 3)) * sy[:, None]
    )
    found = fit_similarity(control(source, target, sx, sy))
    assert found.rejected == ()
    with mpmath.workdps(40):
        turn, x = (
            mpmath.matrix(found.rotation.tolist()),
            mpmath.matrix((source - found.survey_centre).tolist()),
        )
        y = mpmath.matrix((target - found.site_centre).tolist())

        def objective(p):
            a, b, c = p[3:6]
            small = mpmath.expm(mpmath.matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])) * turn
            scale, total = mpmath.mpf(found.scale) * mpmath.exp(p[6]), mpmath.mpf(0)
            for i in range(6):
                r = [y[i, k] - p[k] - scale * sum(small[k, j] * x[i, j] for j in range(3)) for k in range(3)]
                total += sum(v * v for v in r) / (mpmath.mpf(sy[i]) ** 2 + scale**2 * mpmath.mpf(sx[i]) ** 2)
            return total

        h = mpmath.mpf(10) ** -10
        unit = [[h if i == k else mpmath.mpf(0) for i in range(7)] for k in range(7)]
        at = lambda *steps: objective([sum(s) for s in zip(*steps, strict=True)])  # noqa: E731
        minus = [[-v for v in u] for u in unit]
        gradient = [(at(unit[k]) - at(minus[k])) / (2 * h) for k in range(7)]
        curvature = [(at(unit[k]) - 2 * at([mpmath.mpf(0)] * 7) + at(minus[k])) / h**2 for k in range(7)]
        steps = [float(g / c) for g, c in zip(gradient, curvature, strict=True)]
    np.testing.assert_allclose(steps, 0, atol=1e-12)


def similarity_error(found, rotation, scale, shift):
    """Translation at the site centre, small rotation and relative scale: found from true, (7,)."""
    moved = found.site_centre - shift - scale * rotation @ found.survey_centre
    turn = Rotation.from_matrix(found.rotation @ rotation.T).as_rotvec()
    return np.array([*moved, *turn, np.log(found.scale / scale)])


@pytest.mark.parametrize(
    "away", [pytest.param(np.zeros(3), marks=pytest.mark.slow), LAMBERT], ids=["near", "lambert"]
)
def test_similarity_is_unbiased_and_as_precise_as_it_says(away):
    rng = np.random.default_rng(53)
    rotation, scale = turned(rng), 1.05
    source = np.array([[0.0, 0, 0], [15, 1, 0], [14, 9, 4], [-1, 8, 6], [6, 4, 9], [9, -2, 3]])
    sx, sy = np.array([2, 2, 4, 2, 3, 2]) * 1e-3, np.array([3, 2, 2, 5, 2, 3]) * 1e-3
    errors, squares, points = [], [], []
    for _ in range(TRIALS):
        measured = source + rng.normal(size=(6, 3)) * sx[:, None]
        site = scale * source @ rotation.T + away + rng.normal(size=(6, 3)) * sy[:, None]
        found = fit_similarity(control(measured, site, sx, sy))
        if found.rejected:
            continue
        error = similarity_error(found, rotation, scale, away)
        errors.append(error / np.sqrt(np.diag(found.covariance)))
        squares.append([error @ np.linalg.solve(found.covariance, error), found.sigma0**2])
        far = np.array([30.0, 20.0, -5.0])
        points.append((found.apply(far) - scale * rotation @ far - away) / found.sigma_at(far))
    assert len(errors) > 0.98 * TRIALS  # 6 points tested at 0.1 %
    print(
        f"variances {np.mean(np.square(errors), axis=0).round(3)}, of a point {np.mean(np.square(points), axis=0)}"
    )
    np.testing.assert_allclose(np.mean(np.square(errors), axis=0), 1.0, atol=0.1)
    np.testing.assert_allclose(np.mean(np.square(points), axis=0), 1.0, atol=0.1)
    assert np.abs(np.mean(errors, axis=0)).max() < 4 / np.sqrt(len(errors))
    assert np.mean(squares, axis=0) == pytest.approx([7.0, 1.0], rel=0.05)  # χ² of 7, and sigma0² of 1


def test_scale_is_not_drawn_to_zero_by_errors_of_the_survey():
    # regression that takes x as free of error shrinks the scale by σx²/var x: here 0.06² × 8 / 8.7 → -0.3 %
    rng = np.random.default_rng(54)
    source = rng.uniform(-2, 2, (8, 3))
    scales = []
    for _ in range(1000):
        measured = source + rng.normal(0, 0.12, source.shape)
        found = fit_similarity(control(measured, source + 5, 0.12, 0.001))
        scales.append(found.scale)
    assert np.mean(scales) == pytest.approx(1.0, abs=4 * np.std(scales) / np.sqrt(1000) + 2e-3)


def verdict(fit, name):
    """True if the wrong one was left out, False if not; None if all was refused and it is among the suspects."""
    try:
        return name(fit())
    except (SurveyError, GeometryError) as error:
        return None if name(error) else False


@pytest.mark.parametrize(
    ("size", "trials"), [(0.03, 100), (0.1, 60), pytest.param(1.0, 400, marks=pytest.mark.slow)]
)
def test_a_wrong_control_point_is_named_and_left_out(size, trials):
    # 30 mm is 8 standard deviations of a misclosure; 6 points leave it no place to hide
    rng = np.random.default_rng(55)
    source = np.array([[0.0, 0, 0], [15, 1, 0], [14, 9, 4], [-1, 8, 6], [6, 4, 9], [9, -2, 3]])
    found = []
    for _ in range(trials):
        site = source @ turned(rng).T + rng.normal(0, 0.002, source.shape) + 100
        bad, way = int(rng.integers(6)), rng.normal(size=3)
        site[bad] += size * way / np.linalg.norm(way)
        points, wrong = control(source + rng.normal(0, 0.003, source.shape), site), f"C{bad + 1}"
        found.append(
            verdict(
                lambda points=points: fit_similarity(points), lambda out, wrong=wrong: wrong in suspects(out)
            )
        )
    print(f"{size} m: named {found.count(True) / trials:.1%}, refused {found.count(None) / trials:.1%}")
    assert found.count(True) >= (0.9 if size < 0.05 else 0.97) * trials
    assert found.count(False) <= 0.02 * trials


def suspects(out):
    """Names that a fit left out, or that an error begins with."""
    return out.rejected if hasattr(out, "rejected") else str(out)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_mirrored_frames_are_refused(axis):
    rng = np.random.default_rng(56)
    site = POINTS @ turned(rng).T + rng.normal(0, 0.002, POINTS.shape)
    source = POINTS.astype(float)
    source[:, axis] *= -1
    with pytest.raises(SurveyError, match="mirror"):
        fit_similarity(control(source, site))


# --- homography ---


def test_homography_of_the_unit_square_is_case_p04():
    found = fit_homography([[0, 0], [1, 0], [1, 1], [0, 1]], 0.001, [[0, 0], [4, 0], [3, 3], [0, 2]], 0.001)
    np.testing.assert_allclose(found.matrix, [[2.4, 0, 0], [0, 2.4, 0], [-0.4, 0.2, 1]], atol=1e-12)
    np.testing.assert_allclose(found.apply([[0.5, 0.5]]), [[4 / 3, 4 / 3]], atol=1e-12)


CAMERA = np.array([[3e-3, 2e-4, -2.0], [-1e-4, 3.1e-3, -1.5], [1.5e-5, -1e-5, 1.0]])  # pixels to metres


def mapped(matrix, image):
    y = np.column_stack([image, np.ones(len(image))]) @ matrix.T
    return y[:, :2] / y[:, 2:]


def direct_in_fifty_digits(image, plane):
    """Direct linear transform: the last singular direction of the 2 n × 9 system, in 50 digits, last entry 1."""
    with mpmath.workdps(50):
        rows = []
        for (u, v), (x, y) in zip(image.tolist(), plane.tolist(), strict=True):
            u, v, x, y = (mpmath.mpf(c) for c in (u, v, x, y))
            rows += [[u, v, 1, 0, 0, 0, -x * u, -x * v], [0, 0, 0, u, v, 1, -y * u, -y * v]]
        right = [mpmath.mpf(c) for pair in plane.tolist() for c in pair]
        h = mpmath.lu_solve(mpmath.matrix(rows), mpmath.matrix(right))
        return np.array([*(float(v) for v in h), 1.0]).reshape(3, 3)


@pytest.mark.parametrize("count", [4, 5, 9])
def test_exact_homographies_are_found(count):
    rng = np.random.default_rng(61)
    for _ in range(20):
        image = np.array([[0.0, 0], [4000, 0], [4000, 3000], [0, 3000]])
        image = np.vstack([image + rng.uniform(-200, 200, (4, 2)), rng.uniform(0, 3000, (count - 4, 2))])
        plane = mapped(CAMERA, image)
        found = fit_homography(image, 0.5, plane, 0.002)
        inside = rng.uniform(0, 3000, (20, 2))
        np.testing.assert_allclose(found.apply(inside), mapped(CAMERA, inside), atol=1e-10)
        np.testing.assert_allclose(found.matrix, CAMERA, rtol=1e-9, atol=1e-12)
        if count == 4:  # plane coordinates as rounded, so four points have one exact homography
            np.testing.assert_allclose(
                found.apply(inside), mapped(direct_in_fifty_digits(image, plane), inside), atol=1e-11
            )


MARKS = np.array(
    [[150.0, 200], [3800, 120], [3900, 2850], [90, 2900], [2000, 1500], [1000, 2200], [3000, 700]]
)


def test_homography_is_the_maximum_of_the_likelihood():
    # the reprojection error with the true image points as unknowns, minimised by scipy (Levenberg–Marquardt)
    rng = np.random.default_rng(62)
    su, sy = np.array([1, 1, 2, 1, 1, 3, 1.0]), np.array([2, 4, 2, 2, 6, 2, 2]) * 1e-3
    for _ in range(5):
        image = MARKS + rng.normal(size=(7, 2)) * su[:, None]
        plane = mapped(CAMERA, MARKS) + rng.normal(size=(7, 2)) * sy[:, None]
        found = fit_homography(image, su, plane, sy)
        if found.rejected:
            continue
        scale = np.abs(CAMERA.ravel()[:8])

        def residuals(p, image=image, plane=plane, scale=scale):
            matrix, true = np.append(p[:8] * scale, 1.0).reshape(3, 3), p[8:].reshape(7, 2)
            errors = (image - true) / su[:, None], (plane - mapped(matrix, true)) / sy[:, None]
            return np.concatenate(errors).ravel()

        start = np.concatenate([CAMERA.ravel()[:8] / scale, image.ravel()])
        best = least_squares(residuals, start, method="lm", x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        expected = mapped(np.append(best.x[:8] * scale, 1.0).reshape(3, 3), MARKS)
        np.testing.assert_allclose(found.apply(MARKS), expected, atol=1e-8)
        assert found.sigma0**2 * found.redundancy == pytest.approx(2 * best.cost, rel=1e-6)


MANY = pytest.mark.slow


@pytest.mark.parametrize(
    ("each", "trials"),
    [(True, 700), pytest.param(False, TRIALS, marks=MANY), pytest.param(True, TRIALS, marks=MANY)],
)
def test_homography_is_unbiased_and_as_precise_as_it_says(each, trials):
    rng = np.random.default_rng(63)
    su = np.array([1, 1, 2, 1, 1, 3, 1.0]) if each else np.ones(7)
    sy = (np.array([2, 4, 2, 2, 6, 2, 2]) if each else np.full(7, 3)) * 1e-3
    places = np.array([[500.0, 500], [2000, 2600], [3700, 1500]])
    true, squares, errors = mapped(CAMERA, places), [], []
    for _ in range(trials):
        image = MARKS + rng.normal(size=(7, 2)) * su[:, None]
        plane = mapped(CAMERA, MARKS) + rng.normal(size=(7, 2)) * sy[:, None]
        found = fit_homography(image, su, plane, sy)
        if found.rejected:
            continue
        seen = places + rng.normal(size=places.shape)
        error, variance = found.apply(seen) - true, found.covariance_at(seen, 1.0)
        errors.append(error / np.sqrt(np.einsum("kii->ki", variance)))
        squares.append(found.sigma0**2)
    assert len(errors) > 0.98 * trials
    print(f"variances {np.mean(np.square(errors), axis=0).round(3).ravel()}, sigma0² {np.mean(squares):.3f}")
    np.testing.assert_allclose(
        np.mean(np.square(errors), axis=0), 1.0, atol=max(0.1, 3 * np.sqrt(2 / trials))
    )
    assert np.abs(np.mean(errors, axis=0)).max() < 4 / np.sqrt(len(errors))
    assert np.mean(squares) == pytest.approx(
        1.0, abs=0.06
    )  # six degrees of freedom: 0.013, and 0.7 % lost tails


@pytest.mark.parametrize(
    ("size", "trials"), [(15.0, 40), (100.0, 20), pytest.param(1000.0, 400, marks=pytest.mark.slow)]
)
def test_a_wrong_mark_is_left_out(size, trials):
    # 15 px is 8 standard deviations; a homography has eight parameters, so ten marks rather than seven
    rng = np.random.default_rng(64)
    marks = np.vstack([MARKS, [[600, 1200], [2500, 400], [3300, 2300]]])
    found = []
    for _ in range(trials):
        image = marks + rng.normal(size=marks.shape)
        bad, way = int(rng.integers(len(marks))), rng.normal(size=2)
        image[bad] += size * way / np.linalg.norm(way)
        plane = mapped(CAMERA, marks) + rng.normal(0, 0.002, marks.shape)
        found.append(
            verdict(
                lambda image=image, plane=plane: fit_homography(image, 1.0, plane, 0.002),
                lambda out, bad=bad: (
                    bad in out.rejected if hasattr(out, "rejected") else f"mark {bad + 1}" in str(out)
                ),
            )
        )
    print(f"{size} px: left out {found.count(True) / trials:.1%}, refused {found.count(None) / trials:.1%}")
    assert found.count(True) >= (0.9 if size < 50 else 0.97) * trials
    assert found.count(False) <= (0.05 if size < 50 else 0.0) * trials
