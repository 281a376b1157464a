"""Masks alone: one plane face for each stone, at a stated scale."""

import json

import numpy as np
import pytest
from PIL import Image

from ground.errors import UsageError
from survey.clouds.masks import open_masks
from survey.clouds.settings import MaskOptions
from survey.clouds.wall import read_wall
from survey.records.survey import Reject
from survey.registration.stones import survey_stones
from tests.survey.clouds import scans
from tests.survey.clouds.test_outlines import TALL, WIDTH, WORLD, coco, label_image


def white(path):
    Image.fromarray(np.where(label_image() > 0, 255, 0).astype(np.uint8)).save(path)
    return path


def stones(stream):
    found = list(survey_stones(stream).stones)
    assert not [one for one in found if isinstance(one, Reject)]
    return found


def test_white_stones_become_faces_of_their_size(tmp_path):
    stream = open_masks(white(tmp_path / "a.png"), MaskOptions(size=(1.5, 0.6), depth=0.2))
    made = stones(stream)
    assert [one.code for one in made] == [f"S{k:03d}" for k in range(1, 7)]
    assert stream.review == ()
    for one, ring in zip(made, scans.rings(), strict=True):
        assert one.depth.value == 0.2
        assert one.face.measures.length == pytest.approx(0.49, abs=0.004)
        assert one.face.measures.height == pytest.approx(0.29, abs=0.004)
        np.testing.assert_allclose(one.face.fit.normal, [0.0, -1.0, 0.0], atol=1e-9)
        assert np.ptp(one.solid.vertices[:, 1]) == pytest.approx(0.2)
        flat = one.face.outline[:, [0, 2]]
        assert max(np.linalg.norm(flat - corner, axis=1).min() for corner in ring) < 0.003


def test_a_wall_and_a_world_file_place_them(tmp_path):
    path = white(tmp_path / "a.png")
    path.with_suffix(".pgw").write_text(WORLD, encoding="ascii")
    wall = read_wall(str(scans.frame(tmp_path)))
    made = stones(open_masks(path, MaskOptions(depth=0.2, wall=wall)))
    assert np.abs((made[0].face.outline - scans.ORIGIN) @ scans.OUT).max() < 1e-9
    assert made[0].face.fit.normal @ scans.OUT > 0.9999


def test_masks_of_coco_with_a_size(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps(coco("compressed")), encoding="utf-8")
    made = stones(open_masks(tmp_path / "a.json", MaskOptions(size=(1.5, 0.6), depth=0.3)))
    assert len(made) == 6
    assert made[0].face.record.notes["score"] == "0.5"


def test_a_size_that_stretches_pixels_is_doubtful(tmp_path):
    stream = open_masks(white(tmp_path / "a.png"), MaskOptions(size=(1.5, 0.7), depth=0.2))
    assert [one.reason for one in stream.review] == ["stretched"]
    assert f"{WIDTH} × {TALL} pixels" in stream.review[0].text


def test_an_unknown_scale_is_asked_for(tmp_path):
    path = white(tmp_path / "a.png")
    with pytest.raises(UsageError, match=r"give it in metres, e\.g\. --size 1\.0x1\.2"):
        open_masks(path, MaskOptions(depth=0.2))
    path.with_suffix(".pgw").write_text(WORLD, encoding="ascii")
    with pytest.raises(UsageError, match="leave --size out"):
        open_masks(path, MaskOptions(size=(1.5, 0.6), depth=0.2))
