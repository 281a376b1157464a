"""Outlines in plain JSON and CSV, without a cloud, at the size of the wall; those that are drawn twice."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SurveyError, UsageError
from survey.clouds.masks import open_masks
from survey.clouds.outlines.reading import read_outlines
from survey.clouds.settings import MaskOptions
from survey.records.survey import FRAME_NOTE, OUTLINE_NOTE
from tests.paths import ROOT

FIRST, SECOND = (
    [[0.02, 0.01], [0.2, 0.01], [0.2, 0.1]],
    [[0.22, 0.01], [0.38, 0.01], [0.38, 0.1], [0.22, 0.1]],
)
TABLE = "Stein;x;y;depth\n" + "".join(
    f"{code};{x};{y};0,25\n".replace(".", ",")
    for code, ring in (("7", FIRST), ("8b", SECOND))
    for x, y in ring
)
FORMS = {
    "objects": [{"stone": 0, "outline_m": FIRST, "area_m2": 0.008}, {"stone": "b", "outline_m": SECOND}],
    "codes": {"0": FIRST, "b": SECOND},
    "rings": [FIRST, SECOND],
}


@pytest.mark.parametrize(
    ("form", "codes"), [("objects", "S000 b"), ("codes", "S000 b"), ("rings", "S001 S002")]
)
def test_forms_of_plain_json(form, codes, tmp_path):
    path = tmp_path / "stones.json"
    path.write_text(json.dumps(FORMS[form]), encoding="utf-8")
    found = read_outlines(path).outlines
    assert [one.code for one in found] == codes.split()
    np.testing.assert_array_equal(found[1].corners, SECOND)
    assert not read_outlines(path).pixels


def test_a_table_has_a_row_for_each_corner(tmp_path):
    path = tmp_path / "stones.csv"
    path.write_text(TABLE, encoding="utf-8")
    found = read_outlines(path).outlines
    assert [(one.code, one.said.depth, len(one.corners)) for one in found] == [
        ("S007", 0.25, 3),
        ("8b", 0.25, 4),
    ]
    path.write_text(TABLE.replace("0,22", "a"), encoding="utf-8")
    with pytest.raises(SurveyError, match=r"stones\.csv:5: x is 'a', not a number"):
        read_outlines(path)
    path.write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(SurveyError, match="columns a, b; give a header with code, x and y"):
        read_outlines(path)


def test_stones_know_how_far_the_wall_reaches_beyond_them(tmp_path):
    path = tmp_path / "stones.json"
    path.write_text(json.dumps(FORMS["objects"]), encoding="utf-8")
    stream = open_masks(path, MaskOptions(size=(0.4, 0.12), depth=0.3))
    first, second = stream.blocks
    np.testing.assert_allclose(
        [float(one) for one in first.notes[FRAME_NOTE].split()], [0.02, 0.01, 0.2, 0.02]
    )
    assert second.notes[OUTLINE_NOTE] == "outline drawn to 1.0 mm"
    np.testing.assert_allclose(first.vertices[1], [0.2, 0.0, 0.01])
    assert stream.review == ()
    short = open_masks(path, MaskOptions(size=(0.36, 0.12), depth=0.3))
    assert [(one.code, one.reason) for one in short.review] == [("b", "beyond the size")]


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
