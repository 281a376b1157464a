"""Outlines without a cloud that are drawn twice, or around all others."""

import json

import pytest

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
@pytest.mark.parametrize(
    ("name", "size", "codes"),
    [("o_twice.dxf", None, ["S1", "S3", "S5"]), ("g_whole_wall_too.json", (2.0, 1.2), ["S013"])],
)
def test_outlines_of_the_cases(name, size, codes):
    review = open_masks(CASES / name, MaskOptions(depth=0.4, size=size)).review
    assert [one.code for one in review if one.reason == "overlap"] == codes
