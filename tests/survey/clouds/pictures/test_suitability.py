"""Pictures that are too small, blurred, tilted or not rectified are told, with the angle that they were turned by."""

import re

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from survey.clouds.pictures.suitability import Findings, judge_picture, judge_result
from tests.survey.clouds.pictures.walls import as_picture

FIT = Findings(False, (), 1.0)


def squares(shape=(160, 240), blur=0.0):
    """Light squares with sharp edges, or blurred by a standard deviation [px]."""
    rows, columns = np.indices(shape) // 20
    grey = 90.0 + 80.0 * ((rows + columns) % 2)
    return as_picture(np.round(gaussian_filter(grey, blur)) if blur else grey)


@pytest.mark.parametrize("shape", [(95, 200), (200, 95), (96, 200)])
def test_a_picture_needs_96_pixels_a_side(shape):
    found = judge_picture(squares(shape), 3.0, 1.0)
    assert found.refused == (min(shape) < 96)
    assert found.contrast == 1.0
    assert (f"{shape[1]} × {shape[0]} pixels" in " ".join(found.texts)) == found.refused


@pytest.mark.parametrize(
    ("contrast", "blur", "refused", "words"),
    [
        (0.5, 0.0, False, "^$"),
        (0.34, 0.0, True, "no joints.*--joint"),
        (0.36, 3.0, False, "corners are less sure"),
        (0.34, 3.0, True, "it is blurred.*sharper"),
    ],
)
def test_faint_joints_and_blur_are_told_apart(contrast, blur, refused, words):
    found = judge_picture(squares(blur=blur), 3.0, contrast)
    assert found.refused == refused
    assert re.search(words, " ".join(found.texts))


@pytest.mark.parametrize(
    ("blur", "soft"), [(0.0, False), (1.0, False), (1.6, False), (2.4, True), (4.0, True), (20.0, True)]
)
def test_a_picture_is_soft_from_a_blur_of_two_pixels_on(blur, soft):
    assert bool(judge_picture(squares(blur=blur), 3.0, 1.0).texts) == soft


def test_detail_is_judged_in_the_middle_of_a_picture():
    middle = squares((400, 800), 4.0)
    middle[:90] = squares((90, 800))
    middle[:, :190] = squares((400, 190))
    assert "blurred" in " ".join(judge_picture(middle, 3.0, 1.0).texts)
    outer = squares((400, 800))
    outer[:90] = squares((90, 800), 4.0)
    outer[:, :190] = squares((400, 190), 4.0)
    assert judge_picture(outer, 3.0, 1.0).texts == ()


def wall(degrees=0.0, lean=0.0, widening=0.0, rows=6):
    """Outlines of a wall, turned, whose head joints alone lean, or whose beds open to one side [degrees]."""
    turn, tangent = np.radians(degrees), np.tan(np.radians(lean))
    rings = []
    for row in range(rows):
        for column in range(8):
            left, low = 0.5 * column + 0.25 * (row % 2), 0.3 * row
            ring = np.array([[0.0, 0.0], [0.49, 0.0], [0.49, 0.29], [0.0, 0.29]]) + np.array([left, low])
            ring[:, 0] += tangent * ring[:, 1]
            # a bed at height y has the angle widening · y over the height of the wall
            ring[:, 1] += ring[:, 0] * np.tan(np.radians(widening) * (ring[:, 1] / (0.3 * rows) - 0.5))
            rings.append(ring @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]))
    return rings


def judged(rings, scores=0.9, coursed=True, before=FIT):
    return judge_result(before, rings, [scores] * len(rings), coursed)


def test_a_level_wall_is_fit():
    assert judged(wall()) == FIT


@pytest.mark.parametrize(
    ("degrees", "told", "refused"),
    [
        (1.9, False, False),
        (2.1, True, False),
        (-2.1, True, False),
        (3.9, True, False),
        (4.1, True, True),
        (-9.0, True, True),
    ],
)
def test_a_tilt_is_told_with_its_angle_from_two_degrees_and_refused_from_four(degrees, told, refused):
    found = judged(wall(degrees))
    assert found.refused == refused
    assert found.texts == (
        (
            f"it is tilted: beds lean by {degrees:.1f}°; turn or rectify it first",
            f"it is tilted: head joints lean by {degrees:.1f}°; turn or rectify it first",
        )
        if told
        else ()
    )


def test_head_joints_that_lean_alone_are_told_alone():
    (text,) = judged(wall(lean=-3.0)).texts
    assert "head joints lean by 3.0°" in text


@pytest.mark.parametrize(("widening", "refused"), [(2.8, False), (5.0, True)])
def test_beds_that_converge_by_more_than_three_degrees_are_refused(widening, refused):
    found = judged(wall(widening=widening))
    assert found.refused == refused
    assert any(f"beds changes by {widening:.0f}°" in text for text in found.texts) == refused


def test_a_few_stones_askew_tilt_no_wall():
    rings = wall()
    rings[::5] = [ring + [0.0, 1.0] * (ring[:, :1] - ring[0, 0]) * 0.3 for ring in rings[::5]]
    assert judged(rings) == FIT


def test_directions_by_chance_do_not_converge():
    rng = np.random.default_rng(3)
    rings = [ring + rng.normal(0.0, 0.02, ring.shape) for ring in wall(rows=2)]
    assert not judged(rings).refused


def test_few_stones_or_unsure_ones_are_no_wall():
    assert judged(wall()[:3]).refused
    assert not judged(wall()[:4]).refused
    assert judged(wall(), 0.49).refused
    assert not judged(wall(), 0.51).refused
    assert "(48 regions)" in judged(wall(), 0.1).texts[-1]


def test_beds_of_rubble_are_not_judged_and_what_was_refused_stays_so():
    assert judged(wall(9.0), coursed=False) == FIT
    before = Findings(True, ("it is tiny",), 0.1)
    assert judged(wall(9.0), before=before) == before
    assert judged(wall(3.0), before=Findings(False, ("soft",), 0.5)).texts[0] == "soft"
