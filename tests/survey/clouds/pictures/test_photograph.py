"""A picture lies where its pixel, its size or its world file says, with the depth map and the mask beside it."""

import json

import numpy as np
import pytest
from PIL import Image

from ground.errors import SurveyError, UsageError
from survey.clouds.pictures.photograph import open_photograph
from survey.clouds.views.orthophoto import DEPTH_STEP

SHAPE = (20, 30)


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "wall.png"
    Image.fromarray(np.random.default_rng(1).integers(0, 256, (*SHAPE, 3)).astype(np.uint8)).save(path)
    return path


def corners(found):
    """Places of the lower left and the upper right corner of the picture."""
    height, width = SHAPE
    return found.places.place(np.array([[-0.5, height - 0.5], [width - 0.5, -0.5]])).ravel().tolist()


def test_the_lower_left_corner_is_the_origin(picture):
    found = open_photograph(picture, pixel=0.01)
    assert corners(found) == pytest.approx([0.0, 0.0, 0.3, 0.2])
    assert found.stated
    assert (found.depth, found.left_out) == (None, None)


def test_without_a_scale_pixels_count_as_millimetres(picture):
    found = open_photograph(picture)
    assert corners(found) == pytest.approx([0.0, 0.0, 0.03, 0.02])
    assert not found.stated


@pytest.mark.parametrize(
    ("size", "fits"),
    [((3.0, 2.0), True), ((3.05, 2.0), True), ((3.0, 2.03), True), ((3.07, 2.0), False), ((2.0, 3.0), False)],
)
def test_pixels_are_square_to_two_percent(picture, size, fits):
    if fits:
        found = open_photograph(picture, size=size)
        # the sides of a pixel differ by a percent or two; its area is kept
        width, height = corners(found)[2:]
        assert width * height == pytest.approx(size[0] * size[1])
        assert width / height == pytest.approx(1.5)
    else:
        across, up = 1e3 * size[0] / 30, 1e3 * size[1] / 20
        with pytest.raises(UsageError, match=f"pixels of {across:.2f} by {up:.2f} mm"):
            open_photograph(picture, size=size)


def test_a_scale_is_stated_once(picture):
    with pytest.raises(UsageError, match="give one of them"):
        open_photograph(picture, pixel=0.01, size=(0.3, 0.2))
    picture.with_suffix(".pgw").write_text("0.01\n0\n0\n-0.01\n100.005\n50.195\n")
    assert corners(open_photograph(picture)) == pytest.approx([100.0, 50.0, 100.3, 50.2])
    assert open_photograph(picture).stated
    with pytest.raises(UsageError, match="--pixel with a picture whose world file"):
        open_photograph(picture, pixel=0.01)


def test_what_a_mask_shows_white_is_no_wall(picture, tmp_path):
    white = np.zeros(SHAPE, np.uint8)
    white[:5] = 128
    white[5:8] = 127
    Image.fromarray(white).save(tmp_path / "mask.png")
    found = open_photograph(picture, mask=tmp_path / "mask.png")
    assert np.flatnonzero(found.left_out.all(axis=1)).tolist() == [0, 1, 2, 3, 4]
    assert found.left_out.sum() == 5 * 30


def test_a_mask_is_as_large_as_its_picture(picture, tmp_path):
    Image.fromarray(np.zeros((21, 30), np.uint8)).save(tmp_path / "mask.png")
    with pytest.raises(UsageError, match="has 30 × 21 pixels, the picture 30 × 20"):
        open_photograph(picture, mask=tmp_path / "mask.png")


def write_depth(folder, lowest=-0.2, index=True):
    numbers = np.full(SHAPE, 1, np.uint16)
    numbers[10:] = 301
    numbers[:, 8] = numbers[:, 20:] = 0
    Image.fromarray(numbers).save(folder / "depth.png")
    if index:
        (folder / "cloud.json").write_text(json.dumps({"depth_lowest": lowest}))
    return folder / "depth.png"


def test_the_depth_map_beside_an_orthophoto_is_taken_with_its_lowest_depth(picture, tmp_path):
    write_depth(tmp_path)
    depth = open_photograph(picture).depth
    assert depth[2, 5] == pytest.approx(-0.2)
    assert depth[15, 5] == pytest.approx(-0.2 + 300 * DEPTH_STEP)
    assert np.isnan(depth[2, 29])  # the number 0 is no depth
    assert np.isfinite(depth[:, 8]).all()  # but a gap of a pixel is closed


def test_a_depth_map_of_another_program_is_only_taken_if_it_is_named(picture, tmp_path):
    path = write_depth(tmp_path, index=False)
    assert open_photograph(picture).depth is None
    depth = open_photograph(picture, depth=path).depth
    assert depth[15, 5] == pytest.approx(300 * DEPTH_STEP)


def test_an_index_without_its_lowest_depth_is_an_error(picture, tmp_path):
    write_depth(tmp_path)
    (tmp_path / "cloud.json").write_text("{}")
    with pytest.raises(SurveyError, match="depth_lowest"):
        open_photograph(picture)


def test_another_picture_beside_a_depth_map_has_none(picture, tmp_path):
    write_depth(tmp_path)
    assert open_photograph(picture.rename(tmp_path / "other.png")).depth is None


def test_what_is_no_picture_is_an_error(tmp_path):
    with pytest.raises(UsageError, match="no such file"):
        open_photograph(tmp_path / "wall.png")
    (tmp_path / "wall.png").write_text("text")
    with pytest.raises(SurveyError, match="cannot be read as a picture"):
        open_photograph(tmp_path / "wall.png")
