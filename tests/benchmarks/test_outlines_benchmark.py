"""The benchmark of outlines: its measures on pictures whose answer is known, and boxes of photographs."""

import numpy as np
import pytest

from tests.paths import ROOT

pytest.importorskip("shapely")

PHOTOGRAPHS = ROOT.parent / "shared/data/segmentation"


def test_panoptic_quality_is_the_mean_overlap_of_what_is_found_less_what_is_not():
    from benchmarks.outlines import panoptic_quality

    true = np.zeros((10, 20), dtype=np.int64)
    true[:, :10], true[:, 10:] = 1, 2
    assert panoptic_quality(true, true) == 1.0
    # the first at an overlap of 0.9, the second lost, and one false
    found = np.zeros_like(true)
    found[1:, :10] = 1
    found[:2, 12:14] = 2
    assert panoptic_quality(found, true) == pytest.approx(0.9 / (1 + 0.5 + 0.5))


@pytest.mark.slow
def test_rendered_ashlar_is_found_with_corners_as_sure_as_stated():
    from benchmarks.outlines import corner_errors, panoptic_quality, picture_of
    from survey.clouds.pictures.proposal import propose_outlines
    from synthetic.buildings.rendered_walls import rasterised, render_wall

    wall = render_wall("ashlar", 100)
    proposal = propose_outlines(picture_of(wall.picture, wall.pixel))
    shape = wall.picture.shape[:2]
    found = rasterised([one.ring for one in proposal.stones], shape, wall.pixel)
    assert panoptic_quality(found, rasterised(wall.outlines, shape, wall.pixel)) > 0.85
    errors = corner_errors(proposal, wall)
    assert len(errors) > 40
    assert np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean()) < 0.008


@pytest.mark.slow
@pytest.mark.skipif(not PHOTOGRAPHS.is_dir(), reason="the photographs are not here")
def test_nine_of_ten_boxes_of_photographs_are_found():
    from benchmarks.outlines import _photographs

    every = list(_photographs(PHOTOGRAPHS))[-1]
    assert every["boxes"] == 138
    assert every["found"] > 0.9 * 138
    assert every["overlap"] > 0.8
