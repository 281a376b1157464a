"""Pictures that are no masks of stones: classes, white mortar, resampled colours; stones joined by a bridge."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ground.errors import SurveyError, UsageError
from survey.clouds.outlines.classes import check_stones
from survey.clouds.outlines.reading import read_outlines
from tests.paths import ROOT

CASES = ROOT.parent / "shared/cases/wild/mask-semantic-classes"
needs_shared = pytest.mark.skipif(not CASES.is_dir(), reason="the cases lie beside the project")
ROWS, COLUMNS, STONE, JOINT = 4, 5, 40, 6
TALL, WIDE = ROWS * (STONE + JOINT) + JOINT, COLUMNS * (STONE + JOINT) + JOINT


def bricks():
    """Return the number of the stone of each pixel, from 1; 0: mortar."""
    out = np.zeros((TALL, WIDE), np.uint8)
    for k in range(ROWS * COLUMNS):
        y, x = (JOINT + one * (STONE + JOINT) for one in divmod(k, COLUMNS))
        out[y : y + STONE, x : x + STONE] = k + 1
    return out


def saved(pixels, path):
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


def reasons(drawing):
    return {(one.code, reason) for one in drawing.outlines for reason, _ in one.doubts}


def test_classes_are_asked_for_and_each_piece_of_one_is_a_stone(tmp_path):
    classes = np.pad(np.where(bricks() > 0, 100, 200), 20)  # void, stone, mortar
    path = saved(classes, tmp_path / "a.png")
    with pytest.raises(SurveyError, match="100 has 20 pieces: a picture of classes") as refused:
        read_outlines(path)
    assert "--layer 100" in str(refused.value)
    assert len(read_outlines(path, layer="100").outlines) == ROWS * COLUMNS
    with pytest.raises(UsageError, match=r"no pixel is 7; the picture has 0, 100, 200"):
        read_outlines(path, layer="7")


def test_classes_in_colours(tmp_path):
    colours = np.zeros((TALL, WIDE, 3), np.uint8)
    colours[bricks() > 0] = (255, 0, 0)
    colours[bricks() == 0] = (0, 0, 255)
    colours[:JOINT] = 0
    path = saved(colours, tmp_path / "a.png")
    with pytest.raises(SurveyError, match="--layer #ff0000"):
        read_outlines(path)
    assert len(read_outlines(path, layer="#ff0000").outlines) == ROWS * COLUMNS


def test_white_mortar_is_refused_and_black_stones_can_be_named(tmp_path):
    path = saved(np.where(bricks() > 0, 0, 255), tmp_path / "a.png")
    with pytest.raises(SurveyError, match="black has 20 pieces: white is the mortar"):
        read_outlines(path)
    assert len(read_outlines(path, layer="0").outlines) == ROWS * COLUMNS


def test_labels_of_stones_some_in_pieces_are_none_of_this(tmp_path):
    labels = bricks()
    labels[:, WIDE // 2 - 2 : WIDE // 2 + 2] = 0  # a pole stands before the middle stones
    drawing = read_outlines(saved(labels, tmp_path / "a.png"))
    assert len(drawing.outlines) == ROWS * COLUMNS
    assert {reason for _, reason in reasons(drawing)} == {"in pieces"}


@pytest.mark.parametrize(("pixels", "doubted"), [(1, True), (3, True), (STONE // 2, False)])
def test_a_bridge_between_two_stones_is_questioned(tmp_path, pixels, doubted):
    white = bricks() > 0
    y, x = JOINT + STONE // 2, JOINT + STONE
    white[y : y + pixels, x : x + JOINT] = True
    drawing = read_outlines(saved(np.where(white, 255, 0), tmp_path / "a.png"))
    assert len(drawing.outlines) == ROWS * COLUMNS - 1
    assert ("neck" in {reason for _, reason in reasons(drawing)}) == doubted


def test_most_of_the_wall_in_one_piece_is_questioned(tmp_path):
    white = bricks() > 0
    white[TALL // 2 - 20 : TALL // 2 + 20] = white[:, WIDE // 2 - 20 : WIDE // 2 + 20] = True
    white[:, JOINT : JOINT + 20] = white[JOINT : JOINT + 20] = True
    drawing = read_outlines(saved(np.where(white, 255, 0), tmp_path / "a.png"))
    assert "whole wall" in {reason for _, reason in reasons(drawing)}


def test_resampled_labels_are_refused(tmp_path):
    picture = Image.fromarray(bricks() * 10).resize(
        (int(0.77 * WIDE), int(0.77 * TALL)), Image.Resampling.BICUBIC
    )
    picture.save(tmp_path / "a.png")
    with pytest.raises(SurveyError, match="thin rims: the picture was resampled"):
        read_outlines(tmp_path / "a.png")


@needs_shared
def test_pictures_of_the_cases():
    with pytest.raises(SurveyError, match="100 has 12 pieces"):
        read_outlines(CASES / "i_three_classes.png")
    assert len(read_outlines(CASES / "i_three_classes.png", layer="100").outlines) == 12
    with pytest.raises(SurveyError, match="resampled"):
        read_outlines(CASES / "c_rgb_antialiased.png")


@pytest.mark.parametrize("black_stones", [False, True])
@pytest.mark.parametrize("opening", [False, True])
def test_smoothed_edges_between_black_and_white_are_read(tmp_path, black_stones, opening):
    stones = bricks() > 0
    if opening:  # wider than any stone
        stones[: 3 * (STONE + JOINT), STONE + JOINT : 3 * (STONE + JOINT) + JOINT] = False
    count = ROWS * COLUMNS - (6 if opening else 0)
    white = np.where(stones != black_stones, 255, 0).astype(np.uint8)
    high, wide = white.shape
    picture = Image.fromarray(white).resize((4 * wide, 4 * high), Image.Resampling.NEAREST)
    path = tmp_path / "a.png"
    picture.resize((int(2.5 * wide), int(2.5 * high)), Image.Resampling.LANCZOS).convert("RGB").save(path)
    if black_stones:
        with pytest.raises(SurveyError, match=f"black has {count} pieces: white is the mortar.*--layer 0"):
            read_outlines(path)
    found = read_outlines(path, layer="0" if black_stones else None).outlines
    assert len(found) == count
    sides = np.array([np.ptp(one.corners, axis=0) for one in found])
    assert np.abs(sides - 2.5 * STONE).max() < 2.5


@pytest.mark.parametrize("hidden", [(255, 255, 255), (0, 0, 0), (12, 200, 30)])
@pytest.mark.parametrize("colours", [1, 20])
def test_what_is_transparent_is_mortar_whatever_colour_it_hides(tmp_path, hidden, colours):
    stones = bricks()
    pixels = np.zeros((*stones.shape, 4), np.uint8)
    pixels[..., :3] = hidden
    seen = stones > 0
    pixels[seen, 0], pixels[seen, 1], pixels[seen, 2] = 0, 0, (stones[seen] % colours) * 10
    pixels[seen, 3] = 255
    if colours > 1:
        pixels[seen, 1] = 90
    path = saved(pixels, tmp_path / "a.png")
    assert len(read_outlines(path).outlines) == ROWS * COLUMNS


def test_the_colours_of_a_line_drawing_are_listed(tmp_path):
    pixels = np.full((TALL, WIDE, 3), (200, 0, 0), np.uint8)
    pixels[bricks() > 0] = 255
    path = saved(pixels, tmp_path / "a.png")
    with pytest.raises(SurveyError, match=r"no 0 among them.*--layer: #c80000, #ffffff"):
        read_outlines(path)
    assert len(read_outlines(path, layer="#ffffff").outlines) == ROWS * COLUMNS


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("thick", "refused"), [(2, True), (3, False)])
def test_colours_two_pixels_thick_are_rims(thick, refused, turned):
    """Two areas, and four stripes between them: those of three pixels have a middle."""
    rows = np.concatenate([np.full(10, 1), np.repeat([3, 4, 5, 6], thick), np.full(10, 2)])
    numbers = np.repeat(rows[:, None], 12, axis=1)
    numbers = numbers.T.copy() if turned else numbers
    values = np.arange(7)
    if refused:
        with pytest.raises(SurveyError, match="4 of 7 numbers or colours are thin rims"):
            check_stones(numbers, values, False, Path("a.png"))
    else:
        check_stones(numbers, values, False, Path("a.png"))
