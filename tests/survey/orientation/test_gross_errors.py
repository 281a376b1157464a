"""What contradicts all others is left out and named: control points, and photographs with the reason."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import MomaError
from survey.orientation.bundle import gross_errors
from survey.orientation.bundle.agreement import adjusted_alone, contradicted_control
from survey.orientation.bundle.gross_errors import healed
from survey.orientation.bundle.orient import orient
from survey.orientation.bundle.start import without_start
from survey.orientation.projection import project
from tests.survey.orientation.synthetic_block import noisy, wall_block
from tests.survey.orientation.test_wrong_data import network


def unstarted():
    return without_start(network())


def exchanged(one, *numbers):
    """The network with the places of control points handed on in a ring."""
    places = [gcp.place for gcp in one.control]
    for k, n in enumerate(numbers):
        places[n] = one.control[numbers[(k + 1) % len(numbers)]].place
    pairs = zip(one.control, places, strict=True)
    return replace(one, control=tuple(replace(gcp, place=place) for gcp, place in pairs))


def mirrored(one, photo):
    image = one.image.copy()
    mine = one.photo == photo
    image[mine, 0] = one.cameras[0].size[0] - image[mine, 0]
    return replace(one, image=image)


def zoomed(one, photo, factor):
    """The network with a photograph by a lens of another camera constant, without the points that fall outside it."""
    truth = network()
    camera = one.cameras[0]
    lens = replace(camera, inner=camera.inner * np.r_[factor, np.ones(4), np.zeros(5)])
    image, mine = one.image.copy(), one.photo == photo
    held = truth.photos[photo]
    image[mine] = project(lens, held.rotation, held.station, truth.start[one.point[mine]])
    kept = ((image > 0) & (image < camera.size)).all(axis=1) | ~mine
    return replace(one, image=image[kept], photo=one.photo[kept], point=one.point[kept], sigma=one.sigma[kept],
                   lines=one.lines[kept])  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("numbers", [(2, 5), (0, 7), (1, 3, 6)])
def test_exchanged_control_points_are_left_out_and_named(numbers):
    one = exchanged(unstarted(), *numbers)
    result = orient(one, "remove")
    names = {one.names[one.control[n].point] for n in numbers}
    assert {result.network.names[gcp.point] for gcp in result.network.control if gcp.check} == names
    text = " ".join(result.remarks)
    assert all(f"{name} (" in text for name in names)
    assert ("are exchanged" in text) == (len(numbers) == 2)
    assert not result.left_out
    assert result.statistics.sigma0 == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("photo", [3, 0, 6])
def test_a_mirrored_photograph_is_left_out_and_named(photo):
    result = orient(mirrored(unstarted(), photo), "remove")
    assert list(result.left_out) == [f"P0{photo + 1}"]
    assert "it is mirrored" in result.left_out[f"P0{photo + 1}"]
    assert len(result.removed) < 5  # a test of 0.1 % finds some in a thousand sound marks
    assert result.statistics.sigma0 == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("photo", "factor"), [(1, 1.4), (4, 2.1), (6, 0.6)])
def test_a_photograph_of_another_focal_length_is_left_out_and_named(photo, factor):
    result = orient(zoomed(unstarted(), photo, factor), "remove")
    assert list(result.left_out) == [f"P0{photo + 1}"]
    (words,) = result.left_out.values()
    told = float(words.split("about ")[1].split()[0])
    assert told == pytest.approx(24.0 * factor, rel=0.05)
    assert result.statistics.sigma0 == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(("photo", "factor"), [(1, 1.4), (3, 0.45), (2, 3.0)])
def test_the_camera_constant_of_another_lens_is_found_whatever_its_distortion(photo, factor):
    one, truth = zoomed(network(), photo, factor), network()
    alone = SimpleNamespace(
        unknowns=SimpleNamespace(point=truth.start, inner=np.array([one.cameras[0].inner]))
    )
    image = one.image.copy()
    (first, *_) = np.flatnonzero(one.photo == photo)
    image[first] += 200.0  # a mark of another point
    for changed in (one, replace(one, image=image)):
        words = gross_errors._diagnosis(changed, photo, alone)
        told, sigma = (float(word) for word in re.search(r"about (\S+) ± (\S+) mm", words).groups())
        assert told == pytest.approx(24.0 * factor, abs=4.0 * sigma + 0.05)


def test_a_photograph_with_the_numbers_of_another_fits_no_lens():
    one = network()
    mine = np.flatnonzero(one.photo == 2)
    point = one.point.copy()
    point[mine] = np.roll(point[mine], 5)
    alone = SimpleNamespace(unknowns=SimpleNamespace(point=one.start, inner=np.array([one.cameras[0].inner])))
    assert "Check the numbers" in gross_errors._diagnosis(replace(one, point=point), 2, alone)


@pytest.mark.slow
def test_a_report_names_what_it_does_not_leave_out():
    with pytest.raises(MomaError, match="P04") as caught:
        orient(mirrored(unstarted(), 3), "report")
    assert caught.value.remedy


def agreed_stub(points, sigma0):
    """An adjustment of photographs alone, with the places of their points and σ₀."""
    return SimpleNamespace(unknowns=SimpleNamespace(point=points)), sigma0


def one_wrong_by_a_metre(count):
    """The network with this many control points, the first of them a metre off, and the truth."""
    one = network(control=count)
    truth = np.array(one.start)
    wrong = replace(one.control[0], place=one.control[0].place + np.array([1.0, 0.0, 0.0]))
    return replace(one, control=(wrong, *one.control[1:])), truth


@pytest.mark.parametrize(("count", "found"), [(4, False), (5, True)])
def test_four_control_points_must_be_left_to_tell_which_is_wrong(count, found):
    one, truth = one_wrong_by_a_metre(count)
    names = [one.names[gcp.point] for gcp, _ in contradicted_control(one, agreed_stub(truth, 1.0)[0])]
    assert names == ([one.names[one.control[0].point]] if found else [])


@pytest.mark.parametrize(("sigma0", "agree"), [(2.2, True), (4.5, False)])
def test_photographs_agree_whose_marks_fit_up_to_three_times_worse_than_stated(monkeypatch, sigma0, agree):
    one, truth = one_wrong_by_a_metre(8)
    monkeypatch.setattr(gross_errors, "adjusted_alone", lambda network: agreed_stub(truth, sigma0))
    assert (healed(one) is not None) == agree


def test_sixty_photographs_are_left_out_one_at_a_time_the_suspected_first(monkeypatch):
    rows = np.arange(200)
    one = network()
    many = replace(
        one,
        photos=tuple(replace(one.photos[0], name=f"P{f}") for f in rows),
        photo=np.repeat(rows, 2),
        point=np.tile([0, 1], len(rows)),
        image=np.zeros((2 * len(rows), 2)),
        sigma=np.ones((2 * len(rows), 2)),
        lines=np.zeros(2 * len(rows), dtype=int),
    )
    tried = []
    monkeypatch.setattr(gross_errors, "adjusted_alone", lambda network: tried.append(network.photos))
    assert healed(many, suspicion=np.where(rows == 150, 0.9, 0.1)) is None
    left_out = [
        ({photo.name for photo in many.photos} - {photo.name for photo in rest}) for rest in tried[1:]
    ]
    assert left_out[0] == {"P150"}
    assert 45 <= len(left_out) <= 90  # an adjustment each


@pytest.mark.slow
@pytest.mark.parametrize(("pixels", "oriented"), [(10.0, True), (30.0, False)])
def test_marks_that_miss_by_three_thousandths_of_a_photograph_orient_nothing(pixels, oriented):
    one = noisy(wall_block(points=60).network, np.random.default_rng(4), scale=pixels / 0.5)
    assert (adjusted_alone(one) is not None) == oriented
