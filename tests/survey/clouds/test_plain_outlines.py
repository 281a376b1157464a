"""Outlines in plain JSON and CSV, without a cloud, at the size of the wall."""

import json

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.clouds.masks import open_masks
from survey.clouds.outlines.reading import read_outlines
from survey.clouds.settings import MaskOptions
from survey.records.survey import FRAME_NOTE, OUTLINE_NOTE

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
