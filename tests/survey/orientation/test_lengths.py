"""Scale bars and plumb lines as observations: a block of known scale, and all observations at once."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import GeometryError, SurveyError
from survey.orientation.bundle.adjustment import adjust, prepare
from survey.orientation.bundle.lengths import with_lengths
from survey.orientation.bundle.orient import orient
from survey.orientation.bundle.start import without_start
from survey.orientation.formats.result import orientation_values, read_orientation, write_orientation
from survey.orientation.network import Control, PlumbLine, ScaleBar
from survey.orientation.projection import project
from survey.orientation.stones.marked_stones import located_stones
from survey.records.survey import SurveyHead
from tests.survey.orientation.synthetic_block import noisy, spread_points, wall_block

TRUTH = wall_block(points=40)


def bars(pairs, sigma=3e-4, error=0.0):
    lengths = [np.linalg.norm(TRUTH.points[b] - TRUTH.points[a]) + error for a, b in pairs]
    return tuple(ScaleBar(pair, float(length), sigma) for pair, length in zip(pairs, lengths, strict=True))


def corners():
    return spread_points(TRUTH, 4)


def block(lines=(), length_error=0.0, seed=1):
    """The noisy block without control, at 0.31 of its size and turned, with two scale bars."""
    a, b, c, d = corners()
    network = noisy(TRUTH.network, np.random.default_rng(seed))
    made = bars([(a, b)], error=length_error) + bars([(c, d)])
    return replace(without_start(network), bars=made, plumb_lines=tuple(lines))


def shape(places):
    return np.linalg.norm(places[:, None] - places[None], axis=2)


@pytest.mark.slow
def test_a_scale_bar_gives_a_free_block_its_size():
    result = orient(block())
    values = orientation_values(result)
    np.testing.assert_allclose(shape(result.solution.unknowns.point), shape(TRUTH.points), atol=0.005)
    assert (values["scale"], values["vertical"]) == ("scale bars", None)
    assert [one["kind"] for one in values["lengths"]] == ["scale bar", "scale bar"]
    assert max(one["test"] for one in values["lengths"]) < 4.0
    assert result.statistics.sigma0 == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
def test_a_wrong_bar_is_the_one_that_misses():
    values = orientation_values(orient(block(length_error=0.02)))
    assert max(one["test"] for one in values["lengths"]) > 10.0


@pytest.mark.slow
def test_plumb_lines_set_a_block_upright():
    z = np.argsort(TRUTH.points[:, 2])
    low, high = int(z[0]), int(z[-1])
    lean = TRUTH.points[high] - TRUTH.points[low]
    # the frame in which these two stand above each other
    result = orient(block(lines=[PlumbLine((low, high), 0.001)]))
    found = result.solution.unknowns.point
    rise = found[high] - found[low]
    assert abs(rise[:2]).max() < 1e-6
    assert rise[2] == pytest.approx(np.linalg.norm(lean), abs=0.005)
    assert orientation_values(result)["vertical"] == "plumb lines"


def dense(network, prepared, start):
    """Adjust marks and lengths together by numerical derivatives of all residuals (a readable twin)."""
    from scipy.optimize import least_squares

    from survey.orientation.rotations import turned

    free = np.flatnonzero(start.free)

    def residuals(x):
        photos, points = x[: 6 * len(start.station)].reshape(-1, 6), start.point.copy()
        points[free] += x[6 * len(start.station) :].reshape(-1, 3)
        out = []
        for f, row in enumerate(photos):
            mine = network.photo == f
            seen = project(
                network.cameras[0], turned(start.rotation[f : f + 1], row[None, :3])[0], start.station[f] + row[3:],
                points[network.point[mine]],
            )  # fmt: skip
            out.append(((seen - network.image[mine]) / network.sigma[mine]).ravel())
        out += [(points[gcp.point] - gcp.place) / np.sqrt(np.diag(gcp.covariance)) for gcp in network.control]
        for bar in network.bars:
            a, b = bar.points
            out.append(np.array([(np.linalg.norm(points[b] - points[a]) - bar.length) / bar.sigma]))
        return np.concatenate(out)

    found = least_squares(residuals, np.zeros(6 * len(start.station) + 3 * len(free)), method="trf", xtol=1e-14,
                          ftol=1e-14, gtol=1e-14, x_scale="jac")  # fmt: skip
    points = start.point.copy()
    points[free] += found.x[6 * len(start.station) :].reshape(-1, 3)
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    return points, np.sqrt(np.diag(covariance)[6 * len(start.station) :]).reshape(-1, 3)


def without_distortion(network):
    """The network by a camera whose residuals are the same before and after the correction of its distortion."""
    camera = replace(network.cameras[0], inner=network.cameras[0].inner * np.r_[np.ones(3), np.zeros(7)])
    image = np.empty_like(network.image)
    for f, photo in enumerate(network.photos):
        mine = network.photo == f
        image[mine] = project(camera, photo.rotation, photo.station, network.start[network.point[mine]])
    return replace(network, cameras=(camera,), image=image)


def test_bars_beside_control_points_are_adjusted_as_all_observations_at_once():
    small = wall_block(columns=2, rows=1, points=14)
    control = tuple(Control(k, small.points[k], 0.004**2 * np.eye(3)) for k in range(4))
    network = noisy(without_distortion(replace(small.network, control=control)), np.random.default_rng(3))
    length = float(np.linalg.norm(small.points[5] - small.points[6]))
    network = replace(network, bars=(ScaleBar((5, 6), length + 0.003, 5e-4),))
    prepared = prepare(network)
    solution = with_lengths(network, prepared, adjust(network, prepared))
    points, deviations = dense(network, prepared, prepared.unknowns)
    np.testing.assert_allclose(solution.unknowns.point, points, atol=2e-6)
    from survey.orientation.bundle.statistics import statistics

    result = statistics(network, prepared, solution)
    own = np.sqrt(np.diagonal(result.points, axis1=1, axis2=2))
    np.testing.assert_allclose(own, deviations, rtol=2e-3)


def test_an_end_without_two_marks_is_refused():
    one = block()
    a = one.bars[0].points[0]
    kept = np.ones(len(one.photo), dtype=bool)
    kept[np.flatnonzero(one.point == a)[1:]] = False
    bare = replace(one, photo=one.photo[kept], point=one.point[kept], image=one.image[kept], sigma=one.sigma[kept],
                   lines=one.lines[kept])  # fmt: skip
    with pytest.raises(GeometryError, match=r"has [01] marks"):
        orient(bare)


@pytest.mark.parametrize(
    ("scale", "vertical", "missing"),
    [
        (None, None, "scale and the vertical"),
        ("scale bars", None, "the vertical"),
        (None, "plumb lines", "the scale"),
    ],
)
def test_stones_of_photographs_without_scale_or_vertical_are_refused_with_the_way_out(
    tmp_path, oriented_values, scale, vertical, missing
):
    values = {**oriented_values, "scale": scale, "vertical": vertical}
    write_orientation(tmp_path / "o.json", values)
    head = SurveyHead("s", str(tmp_path / "s.moma"), orientation="o.json")
    with pytest.raises(SurveyError, match=missing) as caught:
        list(located_stones(iter(()), head))
    assert ("scale_bars" in caught.value.remedy) == (scale is None)
    assert ("plumb_lines" in caught.value.remedy) == (vertical is None)


@pytest.fixture(scope="module")
def oriented_values():
    return orientation_values(orient(noisy(TRUTH.network, np.random.default_rng(2))))


def test_start_values_that_are_stated_to_be_right_are_taken(tmp_path, oriented_values):
    assert oriented_values["scale"] is None
    values = {**oriented_values, "scale": "start values", "vertical": "start values"}
    write_orientation(tmp_path / "o.json", values)
    assert read_orientation(tmp_path / "o.json").unknown == ()
    del values["scale"], values["vertical"]
    write_orientation(tmp_path / "old.json", values)
    assert read_orientation(tmp_path / "old.json").unknown == ("scale", "vertical")
