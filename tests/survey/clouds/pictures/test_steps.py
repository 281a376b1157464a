"""Steps of colour part stones where their mortar does not show; shade and texture part nothing."""

import numpy as np
import pytest
from scipy.ndimage import binary_opening, gaussian_filter

from survey.clouds.pictures import channels, scale
from survey.clouds.pictures.channels import lightness, without_shade
from survey.clouds.pictures.joints import Strength, step_evidence
from survey.clouds.pictures.proposal import propose_outlines
from survey.clouds.pictures.regions import over_texture
from synthetic.buildings.rendered_walls import render_wall
from tests.survey.clouds.pictures.walls import as_picture, courses, found_overlaps, painted, photograph

BOXES, SHAPE = courses()


def stepped(grains):
    """Two channels (2, h, w) whose second steps at the middle column, by a number of grains."""
    out = np.zeros((2, 40, 60), np.float32)
    out[1, :, 30:] = grains
    return step_evidence(out)


@pytest.mark.parametrize(
    ("grains", "evidence"), [(1.9, 0.0), (2.6, 0.1), (3.5, 0.25), (5.0, 0.5), (20.0, 0.5)]
)
def test_a_step_counts_like_half_a_joint_at_most_and_from_texture_on(grains, evidence):
    found = stepped(grains)
    assert found[:, 28:32].max() == pytest.approx(evidence, abs=0.01)
    assert found[:, [10, 50]].max() == 0.0


def test_a_leaning_step_counts_as_an_upright_one():
    rows, columns = np.mgrid[:60, :80]
    out = np.stack([np.zeros((60, 80)), 5.0 * (columns - 0.5 * rows > 25.0)]).astype(np.float32)
    assert np.median(step_evidence(out)[20:40].max(axis=1)) > 0.4


def coloured(*, hidden=(), shade=None, seed=5):
    """A wall of stones of many hues; joints that are hidden have the mean colour of the stones beside them."""
    rng = np.random.default_rng(seed)
    picture = np.full((*SHAPE, 3), 105.0)
    hues = np.where(np.arange(len(BOXES))[:, None] % 2, (184.0, 172.0, 146.0), (166.0, 172.0, 176.0))
    for (x0, y0, x1, y1), hue in zip(BOXES, hues, strict=True):
        picture[y0:y1, x0:x1] = hue
    for k in hidden:
        (x0, y0, x1, y1), after = BOXES[k], BOXES[k + 1]
        picture[y0:y1, x1 : (x1 + after[0]) // 2] = hues[k]
        picture[y0:y1, (x1 + after[0]) // 2 : after[0]] = hues[k + 1]
    if shade is not None:
        rows, columns = np.mgrid[: SHAPE[0], : SHAPE[1]]
        picture *= np.where(columns + 0.6 * rows > shade, 0.62, 1.0)[..., None]
    return np.clip(picture + rng.normal(0.0, 4.0, picture.shape), 0.0, 255.0).astype(np.uint8)


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [(), (0, 2), (5, 7, 10, 12)])
def test_stones_whose_joint_has_their_colour_are_parted_where_their_colours_meet(hidden):
    found = propose_outlines(photograph(coloured(hidden=hidden)))
    assert len(found.stones) == len(BOXES)
    assert found_overlaps(found, BOXES, SHAPE).min() > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("shade", [150.0, 260.0])
def test_the_edge_of_a_shade_parts_no_stone(shade):
    found = propose_outlines(photograph(coloured(shade=shade)))
    assert len(found.stones) == len(BOXES)
    assert found_overlaps(found, BOXES, SHAPE).min() > 0.8


def test_a_shade_changes_the_logarithm_by_a_constant_and_colours_not_at_all():
    pixels = np.full((40, 60, 3), (200, 120, 60), np.uint8)
    light = 0.5 * ((pixels[:, 30:] / 255.0 + 0.055) / 1.055) ** 2.4
    pixels[:, 30:] = np.round(255.0 * (1.055 * light ** (1.0 / 2.4) - 0.055))
    raw = list(lightness(pixels))
    logarithm, green, blue = without_shade(raw)
    for before, after in ((raw[1], green), (raw[2], blue)):
        assert abs(np.diff(after[0, [0, -1]])[0]) < 0.15 * abs(np.diff(before[0, [0, -1]])[0])
    assert np.unique(np.round(logarithm, 3)).size == 2


@pytest.mark.parametrize("joint", [0.5, 4.0])
def test_texture_is_no_evidence_however_faint_the_joints_are(joint):
    rng = np.random.default_rng(3)
    evidence = np.zeros((200, 200), np.float32)
    evidence[::4, ::4] = 0.2 * rng.uniform(0.8, 1.2, (50, 50))
    evidence[::40] = joint
    field = over_texture(Strength(evidence, evidence, evidence, evidence)).evidence
    assert np.median(field[::40]) == pytest.approx(1.0, abs=0.02)
    # half of the texture is below its median, and what is above is so by a fifth of it at most
    assert field[1::40].max() == 0.0
    assert np.delete(field, np.s_[::40], axis=0).max() < 0.3 * 0.2 / (joint - 0.2)


def meadow(kind):
    """Grass in half shade, gravel, and blades that stand upright: none has stones in courses."""
    rng = np.random.default_rng(4)
    sigma = {"shade": (1.5, 1.5), "gravel": (4.0, 4.0), "blades": (8.0, 1.0)}[kind]
    grey = sum(
        gaussian_filter(rng.normal(size=(300, 400)), (s * sigma[0], s * sigma[1])) * s
        for s in (0.6, 1.0, 2.0)
    )
    out = as_picture(120.0 + 30.0 * grey / grey.std()).astype(np.float64)
    if kind != "gravel":
        out *= (0.5, 1.0, 0.35)
    if kind == "shade":
        out[:, 200:] *= 0.5
    return out.astype(np.uint8)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["shade", "gravel", "blades"])
def test_what_has_no_joints_is_no_wall(kind):
    found = propose_outlines(photograph(meadow(kind)))
    assert found.stones == ()
    assert found.findings.refused


@pytest.mark.parametrize(("size", "found"), [(21, False), (28, True)])
def test_an_opening_is_as_high_as_stated(size, found):
    where = np.zeros((60, 80), dtype=bool)
    where[10 : 10 + size, 20:60] = True
    where[:, :5] = True
    light = np.where(where, 5.0, 70.0).astype(np.float32)
    assert channels.openings(light, None).any() == found


def test_runs_are_those_of_an_opening_by_a_line():
    dots = np.random.default_rng(1).random((50, 70)) < 0.8
    assert np.array_equal(channels._runs(dots, 6), binary_opening(dots, np.ones((1, 6), dtype=bool)))


@pytest.mark.slow
def test_joints_of_every_width_are_tried_on_about_as_many_pixels(monkeypatch):
    seen = []
    combined = scale.combined
    monkeypatch.setattr(scale, "combined", lambda fields: seen.append(fields[0].shape) or combined(fields))
    width, _ = scale.joint_width(np.tile(painted(BOXES, SHAPE), (12, 6, 1)))
    assert width == 3.0
    assert max(max(shape) for shape in seen) == 384
    assert sum(rows * columns for rows, columns in seen) < 3e6


@pytest.mark.slow
def test_corners_are_as_sure_as_stated_of_flush_and_of_recessed_joints():
    from benchmarks.outlines import corner_errors, picture_of

    errors = []
    for seed in (0, 1):  # flush; recessed, so that their shaded side passes for mortar
        wall = render_wall("coursed", seed, pixel=0.004)
        errors.append(corner_errors(propose_outlines(picture_of(wall.picture, wall.pixel)), wall))
    every = np.concatenate(errors)[:, 2:]
    assert len(every) > 20
    assert 0.8 < float(np.sqrt((every**2).mean())) < 1.3
