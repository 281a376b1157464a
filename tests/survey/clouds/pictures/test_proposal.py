"""Stones are found between joints of any colour or depth, named by their courses, and not where there is no wall."""

import re

import numpy as np
import pytest

from survey.clouds.pictures.proposal import propose_outlines
from survey.clouds.settings import OutlineSettings
from tests.survey.clouds.pictures.walls import as_picture, courses, found_overlaps, painted, photograph

pytest.importorskip("shapely")

BOXES, SHAPE = courses()


@pytest.mark.parametrize(("stone", "mortar"), [(175.0, 110.0), (110.0, 175.0), (150.0, 125.0)])
def test_joints_may_be_darker_lighter_or_faint(stone, mortar):
    found = propose_outlines(photograph(painted(BOXES, SHAPE, stone, mortar)))
    assert found.findings.texts == ()
    assert len(found.stones) == len(BOXES)
    assert found_overlaps(found, BOXES, SHAPE).min() > 0.8


def test_joints_that_only_the_depth_shows_are_found():
    rng = np.random.default_rng(2)
    plain = as_picture(rng.normal(160.0, 4.0, SHAPE))
    assert propose_outlines(photograph(plain)).findings.refused
    depth = np.full(SHAPE, -0.012, dtype=np.float32)
    for x0, y0, x1, y1 in BOXES:
        depth[y0:y1, x0:x1] = 0.0
    depth += rng.normal(0.0, 0.001, SHAPE).astype(np.float32)
    found = propose_outlines(photograph(plain, depth))
    assert len(found.stones) == len(BOXES)
    assert found_overlaps(found, BOXES, SHAPE).min() > 0.8


def test_stones_have_courses_places_codes_and_kinds_in_reading_order():
    found = propose_outlines(photograph(painted(BOXES, SHAPE)))
    named = [one.named for one in found.stones]
    assert [one.code for one in named][:5] == ["C01-01", "C01-02", "C01-03", "C01-04", "C01-05"]
    assert [one.course for one in named] == sorted(one.course for one in named)
    assert {one.course for one in named} == {1, 2, 3, 4}
    # whole stones are twice as long as high, the halves at the ends about square
    assert [one.kind for one in named if one.course == 1] == [
        "header",
        "stretcher",
        "stretcher",
        "stretcher",
        "header",
    ]
    assert {one.kind for one in named if one.course == 2} == {"stretcher"}


def test_outlines_leave_the_mortar_out_and_state_how_sure_they_are():
    found = propose_outlines(photograph(painted(BOXES, SHAPE)))
    inner = [one for one in found.stones if not one.cut]
    assert inner
    for one in inner:
        assert len(one.ring) == 4
        assert np.ptp(one.ring, axis=0) == pytest.approx([0.344, 0.160], abs=0.006)
        assert 0.0005 < one.sigma < 0.006
    assert all(one.probability > 0.9 for one in found.borders)


def test_an_opening_is_no_stone_and_has_jambs_and_a_sill():
    boxes, shape = courses(6, 4)
    picture = painted(boxes, shape)
    picture[60:172, 120:240] = 25
    found = propose_outlines(photograph(picture))
    assert len(found.openings) == 1
    low, high = found.openings[0]
    for one in found.stones:
        middle = one.ring.mean(axis=0)
        assert not ((middle > low) & (middle < high)).all()
    kinds = [one.named.kind for one in found.stones]
    assert kinds.count("jamb") >= 4


def test_a_stain_hides_no_head_joint_between_strong_beds():
    picture = painted(BOXES, SHAPE).astype(np.float64)
    # the joint at the middle of the second course is nearly as light as its stones
    picture[50:86, 176:184] = 0.8 * 172.0 + 0.2 * picture[50:86, 176:184]
    found = propose_outlines(photograph(picture.astype(np.uint8)))
    assert found_overlaps(found, BOXES, SHAPE).min() > 0.6


def noise(shape, seed=3):
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(seed)
    field = sum(gaussian_filter(rng.normal(size=shape), s) * s for s in (0.7, 1.5, 3.0))
    return 120.0 + 30.0 * field / field.std()


def lawn():
    out = as_picture(noise((300, 400)))
    out[..., 0] //= 2
    out[..., 2] //= 3
    return out


def blurred():
    from scipy.ndimage import gaussian_filter

    return gaussian_filter(painted(BOXES, SHAPE).astype(np.float64), (14.0, 14.0, 0.0)).astype(np.uint8)


def turned(degrees):
    from PIL import Image

    boxes, shape = courses(8, 6)
    whole = Image.fromarray(painted(boxes, shape)).rotate(degrees, Image.Resampling.BICUBIC)
    return np.asarray(whole)[60:-60, 60:-60]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lawn, "no wall"),
        (blurred, "blurred|no wall|no joints"),
        (lambda: painted(BOXES, SHAPE)[:60, :90], "tiny"),
        (lambda: turned(7.0), "tilted"),
        (lambda: turned(-9.0), "tilted"),
    ],
)
def test_a_picture_that_is_not_fit_is_refused_with_the_reason(make, words):
    found = propose_outlines(photograph(make()))
    assert found.stones == ()
    assert found.findings.refused
    assert re.search(words, " ".join(found.findings.texts))


def test_tiles_give_the_same_stones_as_the_whole():
    boxes, shape = courses(8, 8)
    picture = photograph(painted(boxes, shape))
    whole = propose_outlines(picture)
    tiles = propose_outlines(picture, OutlineSettings(tile=420, overlap=120))
    assert len(tiles.stones) == len(whole.stones) == len(boxes)
    assert found_overlaps(tiles, boxes, shape).min() > 0.8


@pytest.mark.parametrize("mode", ["RGB", "L", "P", "RGBA"])
def test_colours_are_read_whole_whatever_the_height(mode, tmp_path):
    from PIL import Image

    from survey.clouds.pictures.photograph import open_photograph

    pixels = np.random.default_rng(1).integers(0, 256, (700, 30, 3)).astype(np.uint8)
    picture = Image.fromarray(pixels).convert(mode)
    picture.save(tmp_path / "wall.png")
    found = open_photograph(tmp_path / "wall.png", pixel=0.002).pixels
    assert (found == np.asarray(picture.convert("RGB"))).all()
