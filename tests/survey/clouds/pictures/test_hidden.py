"""Joints go straight on behind what hides them, and what hides them is no joint."""

import numpy as np
import pytest

from survey.clouds.pictures.joints import grain_and_contrast, line_strength
from survey.clouds.pictures.proposal import measured_fields, propose_outlines
from survey.clouds.pictures.shapes import outline_shapes, without_mortar
from tests.survey.clouds.pictures.walls import courses, found_overlaps, painted, photograph

BOXES, SHAPE = courses()


def disc(middle, radius, shape=SHAPE):
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    return np.hypot(rows - middle[0], columns - middle[1]) < radius


def with_ivy(*bushes, dense=0.6):
    """A wall with bushes of single leaves, between which it shows."""
    rng = np.random.default_rng(6)
    out = painted(BOXES, SHAPE)
    for middle, radius in bushes:
        out[disc(middle, radius) & (rng.random(SHAPE) < dense)] = (60, 100, 45)
    return out


@pytest.mark.slow
def test_stones_behind_ivy_stay_whole():
    found = propose_outlines(photograph(with_ivy(((44, 90), 17), ((110, 200), 15))))
    assert len(found.stones) == len(BOXES)
    assert found_overlaps(found, BOXES, SHAPE).min() > 0.85


@pytest.mark.parametrize(("radius", "dense"), [(12, 0.6), (12, 0.1)])
def test_leaves_are_no_step_of_colour(radius, dense):
    wall = with_ivy(((22, 45), radius), dense=dense)
    stone = np.zeros(SHAPE, bool)
    stone[7:37, 12:78] = True
    fields = measured_fields(photograph(wall), (slice(0, SHAPE[0]), slice(0, SHAPE[1])), 1.0)
    assert fields.hidden[22, 45] == (dense > 0.5)
    assert fields.parting[stone & ~fields.hidden].max() < 0.25


def test_colours_tell_nothing_near_what_hides_them():
    wall = painted(BOXES, SHAPE).astype(np.float64)
    wall[:44, 90:180] *= (1.1, 1.0, 0.7)
    bush = disc((22, 90), 12)
    wall[bush & (np.random.default_rng(6).random(SHAPE) < 0.6)] = (60, 100, 45)
    fields = measured_fields(
        photograph(wall.clip(0, 255).astype(np.uint8)), (slice(0, SHAPE[0]), slice(0, SHAPE[1])), 1.0
    )
    near = disc((22, 90), 15)
    assert (fields.parting[near] == fields.strength.evidence[near]).all()
    # farther away, both stones differ in colour beside their joint
    assert (fields.parting[2:6, 84:97] > fields.strength.evidence[2:6, 84:97]).any()


def test_what_is_in_one_place_has_no_contrast_of_joints():
    rng = np.random.default_rng(5)
    channel = rng.normal(size=(200, 300)).astype(np.float32)
    _, bare = grain_and_contrast(channel)
    for start in range(100, 240, 10):
        channel[60:110, start : start + 3] -= 40.0
    _, local = grain_and_contrast(channel)
    assert local == pytest.approx(bare, abs=0.3)
    channel[::40] -= 40.0
    assert grain_and_contrast(channel)[1] < -2.0


@pytest.mark.parametrize("reach", [20, 60])
def test_a_joint_goes_on_behind_a_veil(reach):
    image = np.zeros((80, 240), np.float32)
    image[39:42] = 1.0
    veil = np.zeros(image.shape, bool)
    veil[:, 120 - reach : 120 + reach] = True
    image[veil] = 0.0
    found = line_strength(image, veil)
    assert (found.evidence[36:45, 120].argmax() + 36) == pytest.approx(40, abs=1)
    assert found.evidence[40, 120] > 5.0 * found.evidence[60, 120]
    assert line_strength(image).evidence[40, 120] < 0.01


def test_a_hidden_joint_is_of_the_usual_width():
    regions = np.ones((40, 60), np.int64)
    regions[:, 30:] = 2
    image = np.random.default_rng(1).normal(size=regions.shape).astype(np.float32)
    stone = without_mortar(regions, image, np.ones(regions.shape, bool), 1.0)
    assert (~stone).sum(axis=1) == pytest.approx(np.full(40, 4))


def test_evidence_is_no_less_beside_a_veil():
    image = np.zeros((80, 240), np.float32)
    image[39:42] = 1.0
    veil = np.zeros(image.shape, bool)
    veil[:, 120:] = True
    evidence = line_strength(image, veil).evidence[40]
    assert evidence[114] == pytest.approx(evidence[60], rel=0.05)


def test_sides_meet_behind_a_veil():
    rng = np.random.default_rng(2)
    regions = np.zeros((80, 120), np.int64)
    regions[10:70, 10:110] = 1
    veil = disc((70, 110), 24, regions.shape) | disc((12, 50), 14, regions.shape)
    regions[veil & (rng.random(regions.shape) < 0.5)] = 0
    (shape,) = outline_shapes(regions, regions > 0, veil)
    assert len(shape.ring) == 4
    true = np.array([(10, 10), (109, 10), (109, 69), (10, 69)])
    for corner in true:
        assert np.hypot(*(shape.ring - corner).T).min() < 2.0


def test_a_side_that_is_hidden_is_straight_from_one_bed_to_the_other():
    rng = np.random.default_rng(2)
    regions = np.zeros((80, 120), np.int64)
    regions[10:70, 10:110] = 1
    veil = np.zeros(regions.shape, bool)
    veil[:, 100:] = True
    regions[veil & (rng.random(regions.shape) < 0.3)] = 0
    (shape,) = outline_shapes(regions, regions > 0, veil)
    assert len(shape.ring) == 4
    for corner in ((10, 10), (109, 10), (109, 69), (10, 69)):
        assert np.hypot(*(shape.ring - corner).T).min() < 4.0  # a joint is three pixels wide
