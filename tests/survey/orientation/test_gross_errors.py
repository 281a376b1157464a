"""What contradicts all others is left out and named: control points, and photographs with the reason."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import MomaError
from survey.orientation.bundle.orient import orient
from survey.orientation.bundle.start import without_start
from survey.orientation.projection import project
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


@pytest.mark.slow
def test_a_report_names_what_it_does_not_leave_out():
    with pytest.raises(MomaError, match="P04") as caught:
        orient(mirrored(unstarted(), 3), "report")
    assert caught.value.remedy
