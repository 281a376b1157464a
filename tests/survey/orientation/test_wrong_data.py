"""Networks that contradict themselves are refused, with the place and the reason."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import MomaError, SurveyError
from survey.orientation.bundle.orient import orient
from survey.orientation.bundle.start import without_start
from tests.survey.orientation.synthetic_block import noisy, spread_points, wall_block, with_points


def network(control=8, relief=0.4, seed=1):
    truth = wall_block(points=60, relief=relief)
    made = with_points(truth, spread_points(truth, control)) if control else truth.network
    made = noisy(made, np.random.default_rng(seed))
    lines = {"photos": 100, "control": 200}
    return replace(
        made,
        path="block.txt",
        photos=tuple(
            replace(one, where=f"block.txt:{lines['photos'] + k}") for k, one in enumerate(made.photos)
        ),
        control=tuple(replace(one, where=f"control.txt:{k + 1}") for k, one in enumerate(made.control)),
        cameras=tuple(replace(one, where="block.txt:4") for one in made.cameras),
    )


def placed(one, change):
    return replace(one, control=tuple(replace(each, place=change(each.place)) for each in one.control))


def refused(one, message, where):
    with pytest.raises(MomaError, match=message) as caught:
        orient(one)
    assert caught.value.where == where
    assert caught.value.remedy


def test_sound_networks_are_oriented_from_start_values_and_from_none():
    for one in (network(), without_start(network()), without_start(network(control=0))):
        assert orient(one).statistics.sigma0 == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_control_points(count):
    refused(network(control=count), f"{count} control point", "control.txt:1")


def test_control_points_on_one_line():
    line = placed(network(), lambda place: np.array([place[0], 0.3 * place[0], 1.0]))
    refused(line, r"the 8 control points .* lie on one line", "control.txt:1")


def test_points_on_one_line_do_not_orient_a_photograph():
    one = network(control=0)
    truth = np.column_stack(
        [np.linspace(0, 8, len(one.names)), np.zeros(len(one.names)), np.full(len(one.names), 2.0)]
    )
    from survey.orientation.projection import project

    image = np.empty_like(one.image)
    for f, photo in enumerate(one.photos):
        mine = one.photo == f
        image[mine] = project(one.cameras[0], photo.rotation, photo.station, truth[one.point[mine]])
    inside = ((image > 0) & (image < one.cameras[0].size)).all(axis=1)
    thin = replace(one, start=truth, image=image[inside], photo=one.photo[inside], point=one.point[inside],
                   sigma=one.sigma[inside], lines=one.lines[inside])  # fmt: skip
    with pytest.raises(
        MomaError, match=r"do not determine|no sound datum|cannot be oriented|not determined|converge"
    ):
        orient(thin)


MIRRORS = {
    "x": lambda p: p * (-1, 1, 1),
    "y": lambda p: p * (1, -1, 1),
    "z": lambda p: p * (1, 1, -1),
    "xy": lambda p: p[[1, 0, 2]],
}


@pytest.mark.parametrize("axis", MIRRORS)
def test_mirrored_control_points(axis):
    refused(placed(network(), MIRRORS[axis]), "control points are mirrored", "control.txt:1")


def test_mirrored_control_points_without_start_values():
    refused(placed(without_start(network()), MIRRORS["x"]), "control points are mirrored", "control.txt:1")


@pytest.mark.parametrize("change", [lambda p: p * (-1, 1, 1), lambda p: p[[1, 0, 2]]], ids=["x", "xy"])
def test_mirrored_control_points_of_one_plane(change):
    one = network(relief=0.0)
    # a plan from above: the wall laid flat
    flat = placed(one, lambda p: np.array([p[0], p[2], -p[1]]))
    turn = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    flat = replace(
        flat,
        start=one.start @ turn.T,
        photos=tuple(replace(p, rotation=turn @ p.rotation, station=turn @ p.station) for p in one.photos),
    )
    assert orient(flat).statistics.sigma0 == pytest.approx(1.0, abs=0.1)
    refused(placed(flat, change), "they are mirrored", "control.txt:1")


def without(one, axis):
    """The network with the control points of the plane in front, without start values."""
    flat = replace(one, control=tuple(replace(c, place=c.place * (1, 0, 1)) for c in one.control))
    return without_start(placed(flat, axis))


def test_mirrored_control_points_of_one_plane_without_start_values_are_told_as_an_open_question():
    """A plane seen from behind is its mirror image: residuals cannot tell, the side of the stations can."""
    one = network(relief=0.0)
    for change, side in ((lambda p: p, "(0, -1, 0)"), (MIRRORS["x"], "(0, 1, 0)")):
        result = orient(without(one, change))
        assert result.statistics.sigma0 == pytest.approx(1.0, abs=0.15)
        (remark,) = [text for text in result.remarks if "mirrored" in text]
        assert side in remark.replace("-0,", "0,")


def test_mirrored_control_points_of_one_plane_are_told_where_stations_are_given():
    """Stations that are found elsewhere than they were given leave the question open; those that agree do not."""
    one = network(relief=0.0)
    flat = replace(one, control=tuple(replace(c, place=c.place * (1, 0, 1)) for c in one.control))
    start = np.full_like(one.start, np.nan)
    assert not [text for text in orient(replace(flat, start=start)).remarks if "mirrored" in text]
    result = orient(replace(placed(flat, MIRRORS["x"]), start=start))
    assert [text for text in result.remarks if "mirrored" in text]


def test_control_points_that_all_check_hold_nothing():
    one = network()
    checks = tuple(replace(c, check=True) for c in one.control)
    refused(replace(one, control=checks), "all 8 control points only check the result", "control.txt:1")


def test_marks_that_count_upwards_are_mirrored():
    one = without_start(network())
    height = one.cameras[0].size[1]
    up = replace(one, image=one.image * (1, -1) + (0, height))
    refused(up, "control points are mirrored", "control.txt:1")


def test_control_points_in_millimetres():
    one = without_start(network())
    refused(placed(one, lambda place: 1e3 * place), "are of another unit", "control.txt:1")


def test_marks_in_millimetres():
    one = network()
    refused(replace(one, image=one.image * 0.006), "all marks of camera camera1 lie within", one.where(0))


def test_a_control_point_that_is_off_is_left_out_and_its_marks_are_not_blamed():
    one = network()
    off = tuple(
        replace(c, place=c.place + (k == 3) * np.array([0.1, 0, 0])) for k, c in enumerate(one.control)
    )
    result = orient(replace(one, control=off), "remove")
    assert [c.check for c in result.network.control].index(True) == 3
    assert not set(result.removed) & set(np.flatnonzero(one.point == one.control[3].point).tolist())
    name = one.names[one.control[3].point]
    assert any(f"left out, which the others contradict: {name} (" in text for text in result.remarks)
    assert result.statistics.sigma0 == pytest.approx(1.0, abs=0.1)


def test_a_wrong_camera_is_doubted_rather_than_the_marks():
    one = network()
    camera = replace(one.cameras[0], inner=one.cameras[0].inner * np.r_[1.3, np.ones(9)])
    result = orient(replace(one, cameras=(camera,)), "remove")
    assert any("check the camera (calibrate c, K1)" in text for text in result.remarks)


def test_start_values_in_another_frame_are_no_mistake():
    one = network()
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    other = replace(
        one,
        start=3.0 * one.start @ turn.T + 50.0,
        photos=tuple(
            replace(p, rotation=turn @ p.rotation, station=3.0 * turn @ p.station + 50.0) for p in one.photos
        ),
    )
    assert orient(other).statistics.sigma0 == pytest.approx(orient(one).statistics.sigma0, rel=1e-9)


def test_control_points_of_other_places():
    one = network()
    order = [3, 0, 1, 2, 7, 4, 5, 6]
    shuffled = replace(
        one,
        control=tuple(
            replace(c, place=one.control[k].place) for c, k in zip(one.control, order, strict=True)
        ),
    )
    with pytest.raises(SurveyError, match="control points") as caught:
        orient(shuffled)
    assert caught.value.where


def test_a_photograph_without_marks():
    one = network()
    kept = one.photo != 2
    bare = replace(one, photo=one.photo[kept], point=one.point[kept], image=one.image[kept],
                   sigma=one.sigma[kept], lines=one.lines[kept])  # fmt: skip
    refused(bare, "photograph P03 has no marks", "block.txt:102")


def test_a_photograph_with_too_few_known_points():
    one = network()
    kept = (one.photo != 2) | (np.cumsum(one.photo == 2) <= 3)
    few = replace(one, photo=one.photo[kept], point=one.point[kept], image=one.image[kept],
                  sigma=one.sigma[kept], lines=one.lines[kept])  # fmt: skip
    refused(
        without_start(few), "photograph P03 cannot be oriented: 3 of its points are known", "block.txt:102"
    )


def test_a_mark_outside_its_photograph():
    one = network()
    image = one.image.copy()
    image[10] = [9000.0, 100.0]
    refused(replace(one, image=image), r"at \(9000, 100\) lies outside photograph", one.where(10))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: replace(c, inner=c.inner * np.r_[1e-3, np.ones(9)]), "of different units"),
        (
            lambda c: replace(c, inner=c.inner * np.r_[[1e-3] * 3, np.ones(7)], pixel=c.pixel * 1e-3),
            "not in millimetres",
        ),
        (lambda c: replace(c, inner=c.inner * np.r_[1.0, 1e3, np.ones(8)]), "principal point"),
        (
            lambda c: replace(c, inner=c.inner * np.r_[np.ones(5), [1e3] * 3, 1.0, 1.0]),
            "K and P are of another unit",
        ),
    ],
)
def test_a_camera_of_another_unit(change, message):
    one = network()
    refused(replace(one, cameras=tuple(map(change, one.cameras))), message, "block.txt:4")


def test_two_photographs_that_are_swapped():
    one = network()
    photo = one.photo.copy()
    photo[one.photo == 1], photo[one.photo == 4] = 4, 1
    refused(replace(one, photo=photo), "photographs P02 and P05 are swapped", "block.txt:101")


def test_two_observed_stations_that_are_swapped():
    one = network(control=0)
    stations = [photo.station for photo in one.photos]
    stations[1], stations[4] = stations[4], stations[1]
    photos = tuple(
        replace(photo, station=None, rotation=None, observed_station=station, station_sigma=np.full(3, 0.02))
        for photo, station in zip(one.photos, stations, strict=True)
    )
    refused(
        without_start(replace(one, photos=photos)), "photographs P02 and P05 are swapped", "block.txt:101"
    )


def test_an_observed_station_that_is_off():
    one = network(control=0)
    photos = tuple(
        replace(
            photo,
            observed_station=photo.station + (k == 3) * np.array([2.0, 0, 0]),
            station_sigma=np.full(3, 0.02),
        )
        for k, photo in enumerate(one.photos)
    )
    refused(replace(one, photos=photos), "observed station of photograph P04 is 2 m from", "block.txt:103")


def test_marks_of_another_photograph():
    one = network()
    image = one.image.copy()
    mine = one.photo == 3
    image[mine] = np.roll(image[mine], 7, axis=0)
    refused(without_start(replace(one, image=image)), "photograph P04 cannot be oriented", "block.txt:103")


def test_points_that_one_photograph_shows_are_left_out_with_a_remark():
    one = network()
    names = (*one.names, "lone")
    more = replace(
        one,
        names=names,
        start=np.vstack([one.start, [np.nan] * 3]),
        photo=np.append(one.photo, 0),
        point=np.append(one.point, len(one.names)),
        image=np.vstack([one.image, [100.0, 100.0]]),
        sigma=np.vstack([one.sigma, [0.5, 0.5]]),
        lines=np.append(one.lines, 999),
    )
    result = orient(more)
    assert any("one photograph only and left out: lone" in text for text in result.remarks)
    assert result.statistics.sigma0 == pytest.approx(orient(one).statistics.sigma0, rel=1e-9)


def shifted(one, number, by):
    """The network with one control point moved along x."""
    moved = (
        replace(c, place=c.place + (k == number) * np.array([by, 0, 0])) for k, c in enumerate(one.control)
    )
    return replace(one, control=tuple(moved))


def seen_less(one, kept):
    """The network with some of its marks."""
    return replace(
        one, photo=one.photo[kept], point=one.point[kept], image=one.image[kept], sigma=one.sigma[kept],
        lines=one.lines[kept],
    )  # fmt: skip


def test_a_control_point_that_is_far_off_is_named_although_it_pulls_the_others_off():
    one = shifted(network(), 3, 0.4)
    name = one.names[one.control[3].point]
    refused(one, rf"far from where the others put them: {name} \(0\.4", "control.txt:4")
    result = orient(one, "remove")
    assert [c.check for c in result.network.control] == [k == 3 for k in range(8)]


def test_a_wrong_control_point_with_one_mark_loses_this_mark():
    """Its place and its mark cannot be told apart."""
    one = shifted(network(), 3, 0.1)
    marks = np.flatnonzero(one.point == one.control[3].point)
    result = orient(seen_less(one, np.setdiff1d(np.arange(len(one.photo)), marks[1:])), "remove")
    assert marks[0] in result.removed
    assert not any(c.check for c in result.network.control)


def test_a_camera_that_is_not_determined_is_no_fault_of_the_control_points():
    one = network()
    second = replace(one.cameras[0], name="second", free=("c", "xp", "yp", "as", "sk"))
    last = len(one.photos) - 1
    photos = (*one.photos[:-1], replace(one.photos[-1], camera=1))
    few = np.setdiff1d(np.arange(len(one.photo)), np.flatnonzero(one.photo == last)[4:])
    two = replace(seen_less(one, few), cameras=(*one.cameras, second), photos=photos)
    refused(two, "do not determine second", "block.txt:4")


def test_marks_in_a_corner_of_the_photographs_of_one_camera_name_it():
    one = network()
    second = replace(one.cameras[0], name="second")
    last = one.photo == len(one.photos) - 1
    photos = (*one.photos[:-1], replace(one.photos[-1], camera=1))
    image = np.where(last[:, None], 0.006 * one.image, one.image)
    two = replace(one, cameras=(*one.cameras, second), photos=photos, image=image)
    refused(two, "all marks of camera second lie within", one.where(int(np.flatnonzero(last)[0])))
