"""Joints have the width that they were painted with, and pictures keep their means when they are resized."""

import numpy as np
import pytest

from survey.clouds.pictures import scale
from survey.clouds.pictures.joints import WIDTH
from survey.clouds.pictures.scale import joint_width, resized, resized_field
from tests.survey.clouds.pictures.walls import as_picture, courses, painted


@pytest.mark.parametrize("joint", [3, 6])
def test_the_width_of_joints_is_found(joint):
    boxes, shape = courses(2, 2, height=20 * joint, length=30 * joint, joint=joint)
    width, contrast = joint_width(painted(boxes, shape, noise=2.0))
    assert width == pytest.approx(joint, rel=0.34)
    assert contrast > 1.0


def test_a_picture_too_small_for_any_joint_has_the_usual_width_and_no_contrast():
    assert joint_width(np.zeros((20, 300, 3), np.uint8)) == (WIDTH, 0.0)
    # 27 pixels become 40 at half of the usual width of a joint
    assert joint_width(painted([(2, 2, 80, 25)], (27, 90)))[1] != 0.0


def contrasts(monkeypatch, values, shape=(150, 150)):
    """The width that is found where joints of each width have a contrast over grain."""
    given = iter(values)
    monkeypatch.setattr(scale, "_parts", lambda shape, side: [(slice(0, 60), slice(0, 60))])
    monkeypatch.setattr(scale, "grain_and_contrast", lambda field: (2.0, 2.0 * next(given)))
    return joint_width(np.zeros((*shape, 3), np.uint8))


@pytest.mark.parametrize(
    ("values", "width"),
    [
        # widths of 2, 3, 4, 6 and 8 pixels; the next would leave 37 pixels
        ((0.1, 0.2, 0.3, 1.0, 0.9), 6.0),
        ((0.1, 0.2, 0.51, 1.0, 0.9), 4.0),
        ((0.1, 0.49, 0.3, 0.4, 1.0), 8.0),
        # pixels between those of a picture show nothing more
        ((1.0, 0.6, 0.1, 0.1, 0.1), 3.0),
        ((1.0, 0.1, 0.1, 0.1, 0.1), 2.0),
        # none stands out
        ((-0.4, -0.3, -0.2, -0.5, -0.6), 4.0),
    ],
)
def test_of_widths_of_half_of_the_best_contrast_the_finest_is_taken(monkeypatch, values, width):
    assert contrasts(monkeypatch, values) == (width, pytest.approx(max(values)))


def test_one_place_with_a_strong_contrast_does_not_decide(monkeypatch):
    given = iter([0.1, 0.2, 9.0] * 5)
    monkeypatch.setattr(scale, "_parts", lambda shape, side: [(slice(0, 60), slice(0, 60))] * 3)
    monkeypatch.setattr(scale, "grain_and_contrast", lambda field: (1.0, next(given)))
    assert joint_width(np.zeros((150, 150, 3), np.uint8))[1] == pytest.approx(0.2)


def test_the_parts_of_a_picture_are_its_middle_and_its_corners():
    found = {(a.start, a.stop, b.start, b.stop) for a, b in scale._parts((100, 300, 3), 60)}
    corners = {(r, r + 60, c, c + 60) for r in (0, 40) for c in (0, 240)}
    assert found == corners | {(20, 80, 120, 180)}
    # one that is lower than a part has no corners above one another
    low = [(a.start, b.start) for a, b in scale._parts((50, 300, 3), 60)]
    assert low == [(0, 0), (0, 120), (0, 240)]


@pytest.mark.parametrize("factor", [3.0, 0.5])
def test_a_resized_picture_has_means_of_what_is_within_its_pixels(factor):
    field = np.random.default_rng(1).uniform(50.0, 200.0, (60, 90)).astype(np.float32)
    picture = as_picture(field)
    shape = (round(60 / factor), round(90 / factor))
    small, picture_small = resized_field(field, factor), resized(picture, factor)
    assert (small.shape, picture_small.shape) == (shape, (*shape, 3))
    assert small.mean() == pytest.approx(field.mean(), rel=0.01)
    if factor > 1.0:
        blocks = field.reshape(20, 3, 30, 3).mean(axis=(1, 3))
        assert small == pytest.approx(blocks, abs=0.01)
        assert picture_small[..., 0] == pytest.approx(blocks, abs=2.0)  # rounded twice


def test_where_a_pixel_is_unknown_a_larger_one_is():
    field = np.ones((60, 90), np.float32)
    field[7, 10] = np.nan
    assert np.argwhere(np.isnan(resized_field(field, 3.0))).tolist() == [[2, 3]]


def test_a_picture_keeps_a_pixel_however_small_it_becomes():
    assert resized(np.zeros((2, 90, 3), np.uint8), 30.0).shape == (1, 3, 3)
