"""Outlines without a cloud that are drawn twice, or around all others."""

import json
from dataclasses import replace

import pytest

from ground.errors import UsageError
from survey.clouds.masks import open_masks
from survey.clouds.settings import MaskOptions
from tests.paths import ROOT

CASES = ROOT.parent / "shared/cases/wild/outlines-drawn-twice"
STONES = {
    f"S{3 * row + column + 1}": [
        [0.4 * column + x, 0.2 * row + y] for x, y in ((0.01, 0.01), (0.39, 0.01), (0.39, 0.19), (0.01, 0.19))
    ]
    for row in range(2)
    for column in range(3)
}
FRAME = [[0.0, 0.0], [1.2, 0.0], [1.2, 0.4], [0.0, 0.4]]


def overlaps(stones, path):
    path.write_text(json.dumps(stones), encoding="utf-8")
    return [
        (one.code, one.text)
        for one in open_masks(path, MaskOptions(depth=0.2)).review
        if one.reason == "overlap"
    ]


def test_sound_outlines_do_not_overlap(tmp_path):
    assert overlaps(STONES, tmp_path / "a.json") == []


@pytest.mark.parametrize(("shift", "share"), [(0.0, 100), (0.25, 34), (0.365, 0)])
def test_an_outline_drawn_again_is_told(tmp_path, shift, share):
    again = [[x + shift, y] for x, y in STONES["S3"]]
    found = overlaps(STONES | {"S3B": again}, tmp_path / "a.json")
    assert [code for code, text in found if "S3B" in text] == (["S3"] if share else [])
    if share:
        assert any(f"with S3B, {share}% of the smaller" in text for _, text in found)


def test_a_frame_that_holds_all_others_is_one_overlap(tmp_path):
    found = overlaps(STONES | {"WALL": FRAME, "S4B": STONES["S4"]}, tmp_path / "a.json")
    assert {code for code, _ in found} == {"WALL", "S4"}
    assert "it holds all 7 others" in dict(found)["WALL"]


@pytest.mark.skipif(not CASES.is_dir(), reason="the cases lie beside the project")
def test_outlines_drawn_twice_in_a_drawing():
    review = open_masks(CASES / "o_twice.dxf", MaskOptions(depth=0.4)).review
    assert [one.code for one in review if one.reason == "overlap"] == ["S1", "S3", "S5"]


@pytest.mark.skipif(not CASES.is_dir(), reason="the cases lie beside the project")
def test_a_polygon_around_the_wall_has_a_category_of_its_own():
    """Its class is asked for, as that of mortar; among the stones nothing overlaps."""
    path, options = CASES / "g_whole_wall_too.json", MaskOptions(depth=0.4, size=(2.0, 1.2))
    with pytest.raises(
        UsageError, match=r"stone \(12\), wall \(1\); name that of the stones, e.g. --layer stone"
    ):
        open_masks(path, options)
    stones = open_masks(path, replace(options, layer="stone"))
    assert not [one for one in stones.review if one.reason == "overlap"]
