import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from survey.arrays import Array
from survey.faces.common_planes import common_plane
from survey.faces.planes import FaceFit

FRAME: Array = Rotation.from_rotvec([0.4, -0.3, 0.9]).as_matrix()  # columns: along, up, outward
PLACE = np.array([3.1e6, 5.2e6, 120.0])


def face(
    at: Array, height: float, slopes: Array, height_sigma: float = 5e-4, tilt_sigma: float = 2e-3
) -> FaceFit:
    normal = FRAME @ np.array([-slopes[0], -slopes[1], 1.0])
    normal /= np.linalg.norm(normal)
    centroid = PLACE + FRAME @ np.array([*at, height])
    axes = np.array([FRAME[:, 0] - (FRAME[:, 0] @ normal) * normal, np.cross(normal, FRAME[:, 0])])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    return FaceFit(
        normal=normal,
        offset=float(normal @ centroid),
        centroid=centroid,
        axes=axes,
        singular_values=np.array([0.5, 0.3, 0.001]),
        covariance=np.diag([tilt_sigma**2, tilt_sigma**2, height_sigma**2]),
        rms=0.001,
        sigma0=1.0,
        redundancy=7,
        rejected=(),
        residuals=np.empty(0),
        standardised=np.empty(0),
    )


def drawn(
    seed: int, count: int, relief: float, tilt: float, lean: tuple[float, float] = (0.01, -0.03)
) -> tuple[Array, Array, Array]:
    """Places, heights and slopes of faces about the plane height = 0.02 + lean · place."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-1, 1, (count, 2))
    slopes = np.array(lean) + rng.normal(0, tilt, (count, 2))
    return at, 0.02 + at @ lean + rng.normal(0, relief, count), slopes


def test_faces_of_one_plane_give_that_plane() -> None:
    at, heights, slopes = drawn(1, 5, 0.0, 0.0)
    plane = common_plane([face(*one) for one in zip(at, heights, slopes, strict=True)], PLACE)
    expected = FRAME @ np.array([-0.01, 0.03, 1.0]) / np.sqrt(1 + 0.01**2 + 0.03**2)
    np.testing.assert_allclose(plane.normal, expected, atol=1e-9)
    assert (plane.centroid - PLACE - 0.02 * FRAME[:, 2]) @ plane.normal == pytest.approx(0.0, abs=2e-9)
    assert plane.members == (0, 1, 2, 3, 4)
    # nothing but what the faces were measured with: neither heights nor tilts scatter beyond it
    assert plane.height_scatter < 5e-4 * np.sqrt(3)
    assert plane.tilt_scatter < 2e-3 * np.sqrt(3)


@pytest.mark.parametrize("count", [6, 20])
def test_variances_are_those_of_restricted_maximum_likelihood(count: int) -> None:
    # slow reference: both variances by maximising the likelihood of the residuals (Patterson & Thompson 1971)
    # slopes are small here, so that the squares of their cosines do not matter
    at, heights, slopes = drawn(count, count, 6e-5, 1.5e-4, (0.0, 0.0))
    plane = common_plane([face(*one, 1e-8, 1e-8) for one in zip(at, heights, slopes, strict=True)], PLACE)
    arms = np.column_stack([at, np.ones(count)])
    along, up = np.tile([1.0, 0, 0], (count, 1)), np.tile([0.0, 1, 0], (count, 1))
    design, seen = np.vstack([arms, along, up]), np.concatenate([heights, slopes[:, 0], slopes[:, 1]])

    def deviance(logs: Array) -> float:
        v = np.repeat(np.exp(logs), [count, 2 * count])
        normal = design.T @ (design / v[:, None])
        left = seen - design @ np.linalg.solve(normal, design.T @ (seen / v))
        return float(np.log(v).sum() + np.linalg.slogdet(normal)[1] + (left**2 / v).sum())

    best = minimize(
        deviance, np.log([1e-8, 1e-8]), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}
    )
    v = np.repeat(np.exp(best.x), [count, 2 * count])
    cofactors = np.linalg.inv(design.T @ (design / v[:, None]))
    redundancy = count - np.trace(cofactors @ arms.T @ arms) / v[0]
    # the predicted scatter is Student's: ν/(ν - 2) times the variance
    assert plane.height_scatter**2 == pytest.approx(v[0] * redundancy / (redundancy - 2), rel=2e-3)
    rest = 2 * count - np.trace(cofactors @ np.diag([count, count, 0])) / v[-1]
    assert plane.tilt_scatter**2 == pytest.approx(v[-1] * rest / (rest - 2), rel=2e-3)
    # covariance of the plane, its axes are those of FRAME but for its small slopes
    turn = plane.axes @ FRAME[:, :2]
    np.testing.assert_allclose(plane.covariance[2, 2], cofactors[2, 2], rtol=5e-3)
    np.testing.assert_allclose(
        turn.T @ plane.covariance[:2, :2] @ turn, cofactors[:2, :2], rtol=5e-3, atol=1e-9
    )


def test_two_sills_do_not_hide_each_other() -> None:
    at, heights, slopes = drawn(4, 10, 0.004, 0.01)
    heights[[3, 7]] += [0.15, 0.16]
    plane = common_plane([face(*one) for one in zip(at, heights, slopes, strict=True)], PLACE)
    assert plane.members == (0, 1, 2, 4, 5, 6, 8, 9)


def test_cornices_of_a_long_wall_are_left_out() -> None:
    at, heights, slopes = drawn(5, 400, 0.004, 0.01)
    heights[::8] += 0.2
    plane = common_plane([face(*one) for one in zip(at, heights, slopes, strict=True)], PLACE)
    assert set(plane.members) == {i for i in range(400) if i % 8}
    assert plane.height_scatter == pytest.approx(0.004, rel=0.15)


@pytest.mark.parametrize("height", [0.15, -0.1])
def test_a_sill_among_the_neighbours_is_left_out(height: float) -> None:
    at, heights, slopes = drawn(3, 8, 0.004, 0.01)
    plain = common_plane([face(*one) for one in zip(at, heights, slopes, strict=True)], PLACE)
    heights[2] += height
    plane = common_plane([face(*one) for one in zip(at, heights, slopes, strict=True)], PLACE)
    assert plane.members == (0, 1, 3, 4, 5, 6, 7)
    assert plane.height_scatter < 2 * plain.height_scatter


def test_chance_calls_a_face_outstanding_once_in_a_thousand_walls() -> None:
    # 1000 walls: 1 expected; more than 5 has a probability of 6·10⁻⁴
    left_out = 0
    for seed in range(1000):
        at, heights, slopes = drawn(seed, 8, 0.006, 0.015)
        fits = [face(*one) for one in zip(at, heights, slopes, strict=True)]
        left_out += len(common_plane(fits, PLACE).members) < 8
    assert left_out <= 5


@pytest.mark.parametrize("count", [5, 9])
def test_a_further_face_is_predicted_with_its_precision(count: int) -> None:
    # 1000 walls: the height and the tilts of one more face, over their predicted standard deviation, have variance 1
    errors = []
    rng = np.random.default_rng(count)
    for seed in range(1000):
        at, heights, slopes = drawn(seed + 5000, count + 1, 0.006, 0.015)
        noise = rng.normal(0, [5e-4, 2e-3, 2e-3], (count + 1, 3))
        seen = zip(at[:-1], (heights + noise[:, 0])[:-1], (slopes + noise[:, 1:])[:-1], strict=True)
        place = PLACE + FRAME[:, :2] @ at[-1]
        estimate = common_plane([face(*one) for one in seen], PLACE).face_at(place, "")
        true = face(at[-1], heights[-1], slopes[-1])
        tilt = -(estimate.axes @ (true.normal - estimate.normal)) / np.sqrt(np.diag(estimate.covariance)[:2])
        height = (true.centroid - estimate.centroid) @ estimate.normal / np.sqrt(estimate.covariance[2, 2])
        errors.append([height, *tilt])
    assert np.mean(errors, axis=0) == pytest.approx(0.0, abs=4 / np.sqrt(1000))
    # five neighbours do not tell their scatter well: Student's distribution of so few degrees of freedom has tails
    # that need not have a variance
    assert (np.mean(np.abs(errors) < 1.0, axis=0) > 0.65).all()
    assert (np.mean(np.abs(errors) < 3.0, axis=0) > 0.95).all()
    if count == 9:
        np.testing.assert_allclose(np.mean(np.square(errors), axis=0), 1.0, atol=0.2)


def test_points_on_the_face_correct_the_prediction_as_least_squares_does() -> None:
    # closed form: prediction and points as observations of two slopes and a height
    at, heights, slopes = drawn(4, 7, 0.006, 0.015)
    fits = [face(*one) for one in zip(at, heights, slopes, strict=True)]
    before = common_plane(fits, PLACE).face_at(PLACE, "")
    flat = np.array([(0.1, 0.05), (-0.2, 0.1)])
    heights_there = np.array([0.012, 0.004])
    points = before.centroid + flat @ before.axes + heights_there[:, None] * before.normal
    after = before.corrected(points, np.array([0.002, 0.003]), "")
    arms = np.column_stack([flat, np.ones(2)])
    weights = np.diag([0.002**-2, 0.003**-2])
    covariance = np.linalg.inv(np.linalg.inv(before.covariance) + arms.T @ weights @ arms)
    step = covariance @ arms.T @ weights @ heights_there
    np.testing.assert_allclose(after.covariance, covariance, rtol=1e-7, atol=1e-15)
    assert (after.centroid - before.centroid) @ before.normal == pytest.approx(step[2], rel=1e-6)
    np.testing.assert_allclose(-before.axes @ after.normal, step[:2], atol=1e-5)
