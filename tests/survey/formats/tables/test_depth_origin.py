"""What was assumed of a depth stays assumed when a layer or table comes back."""

import json
from pathlib import Path

import pytest

from ground.errors import SurveyError
from survey.extrusion.depth import depth_for
from survey.formats.reading import open_survey
from survey.records.survey import BlockRecord, Reject

HEAD = "block;x;y;z;depth;depth_origin;depth_source\n"


def stones(path: Path, origin: str) -> str:
    """A table of one stone whose depth is of this origin."""
    corners = ((0, 0), (1, 0), (1, 1))
    path.write_text(
        HEAD + "".join(f"A;{x};0;{z};0.5;{origin};a rule\n" for x, z in corners), encoding="utf-8"
    )
    (block,) = open_survey(path, "csv").blocks
    if isinstance(block, Reject):
        raise block.error
    assert isinstance(block, BlockRecord)
    return depth_for(block, []).origin


@pytest.mark.parametrize(
    ("text", "origin"),
    [
        ("kind", "kind"),
        ("rule", "rule"),
        ("structure", "structure"),
        ("", "stone"),
        ("stone", "stone"),
        ("solid", "stone"),
    ],
)
def test_an_assumed_depth_stays_assumed(tmp_path: Path, text: str, origin: str):
    assert stones(tmp_path / "a.csv", text) == origin


def test_an_unknown_origin_is_refused_at_its_line(tmp_path: Path):
    with pytest.raises(SurveyError, match=r"a\.csv:2: origin of a depth 'guess'"):
        stones(tmp_path / "a.csv", "guess")


@pytest.mark.parametrize("origin", ["kind", "stone"])
def test_a_layer_of_ones_own_comes_back_with_the_origin_of_its_depths(tmp_path: Path, origin: str):
    ring = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [0, 0, 0]]
    values = {
        "code": "A",
        "depth": 0.55,
        "depth_origin": origin,
        "depth_source": "guess",
        "height": 1.0,
        "z": 0.5,
    }
    feature = {
        "type": "Feature",
        "id": "A",
        "geometry": {"type": "Polygon", "coordinates": [ring]},
        "properties": values | {"station": "A outer"},
    }
    path = tmp_path / "own.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}), encoding="utf-8")
    (block,) = open_survey(path, "geojson").blocks
    assert isinstance(block, BlockRecord)
    depth = depth_for(block, [])
    assert (depth.value, depth.source, depth.origin) == (0.55, "guess", origin)
