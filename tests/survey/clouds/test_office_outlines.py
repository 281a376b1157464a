"""Outlines as offices export them: names of attributes, labels of drawings, classes, tables of corners, pixels."""

import json
import re

import numpy as np
import pytest

from ground.errors import SurveyError, UsageError
from survey.clouds.outlines.outline import attributes_of, field_map
from survey.clouds.outlines.reading import read_outlines
from survey.formats.tables.kinds import read_kinds
from tests.survey.clouds.scans import CODES, geojson, rings
from tests.survey.formats.workbooks import xlsx


@pytest.mark.parametrize(
    ("values", "code", "course", "depth"),
    [
        ({"id": 7, "Stein_Nr": "05-03", "Steinlage": "5", "Tiefe_cm": 38.0}, "05-03", 5, 0.38),
        ({"fid": 7, "Steinnummer": "B 2", "Schicht": 2, "Tiefe (mm)": "380"}, "B 2", 2, 0.38),
        ({"fid": 7, "numéro de pierre": "P3", "profondeur [cm]": "38,0"}, "P3", None, 0.38),
        ({"id": 7, "depth": 0.38}, "7", None, 0.38),
        (
            {"id": 7, "Steinnumme": "05-03", "Steinlage": 5.0, "Profondeur": "0,38"},
            "05-03",
            5,
            0.38,
        ),  # of a shapefile
        ({"EntityHandle": "3A", "Text": "05-03", "Layer": "STEINE"}, "05-03", None, None),
    ],
)
def test_attributes_are_named_as_columns_of_tables_are(values, code, course, depth):
    said = attributes_of(values, {}, "here")
    assert (said.code, said.course) == (code, course)
    assert said.depth == (depth if depth is None else pytest.approx(depth))
    assert ("Layer" in values) == ("Layer" in said.notes)


def test_a_depth_in_another_unit_is_refused_with_the_name_that_states_it():
    with pytest.raises(SurveyError, match="as in depth_cm"):
        attributes_of({"Tiefe": 38}, {}, "here")
    assert attributes_of({"depth_cm": 38}, {}, "here").depth == pytest.approx(0.38)


def test_what_no_attribute_is_known_for_is_said(tmp_path):
    path = geojson(tmp_path / "a.geojson", Zustand=["gut"] * 6, Lage=["links"] * 6)
    (remark,) = read_outlines(path).remarks
    assert remark.startswith("kept as notes: Zustand, Lage; --fields")
    assert read_outlines(geojson(tmp_path / "b.geojson", Lage=[1, 1, 1, 2, 2, 2])).remarks == ()


def drawing(path, symbol=True, stones_are_blocks=False, frame=True):
    """Write six stones, labels with attributes, a frame, and superseded numbers on a layer that is off."""
    ezdxf = pytest.importorskip("ezdxf")
    made = ezdxf.new("R2010")
    space = made.modelspace()
    made.layers.add("ALT").off()
    if frame:
        space.add_lwpolyline([(-1, -1), (3, -1), (3, 2), (-1, 2)], close=True, dxfattribs={"layer": "RAHMEN"})
    for k, (code, ring) in enumerate(zip(CODES, rings(), strict=True)):
        x, y = ring.mean(axis=0)
        space.add_text(f"9{k}", height=0.02, dxfattribs={"layer": "ALT"}).set_placement((x, y))
        block = made.blocks.new(f"B{k}")
        block.add_attdef("NR", (0, 0), height=0.02)
        if symbol:
            block.add_circle((0, 0), 0.04)
        (block if stones_are_blocks else space).add_lwpolyline(
            ring - (x, y) if stones_are_blocks else ring, close=True, dxfattribs={"layer": "STEINE"}
        )
        insert = space.add_blockref(f"B{k}", (x, y), dxfattribs={"layer": "NUMMERN"})
        insert.add_auto_attribs({"NR": code})
    made.saveas(path)
    return path


def test_labels_are_no_stones_and_texts_that_are_off_are_no_names(tmp_path):
    found = read_outlines(drawing(tmp_path / "a.dxf", frame=False))
    assert [one.code for one in found.outlines] == list(CODES)
    np.testing.assert_allclose([one.corners for one in found.outlines], rings(), atol=1e-9)
    reasons = dict(found.left)
    assert reasons["left out"] == "6 closed curves of labels, which stand in the outlines of stones"
    assert reasons["hidden"] == "texts on layers that are frozen or off are left out: 6 ALT"


def test_the_layer_that_a_frame_asks_for_is_that_of_the_stones(tmp_path):
    path = drawing(tmp_path / "a.dxf")
    with pytest.raises(SurveyError, match="leave it out with --layer STEINE"):
        read_outlines(path)
    assert [one.code for one in read_outlines(path, layer="STEINE").outlines] == list(CODES)


def test_stones_that_are_blocks_with_their_numbers_stay_stones(tmp_path):
    found = read_outlines(drawing(tmp_path / "a.dxf", symbol=False, stones_are_blocks=True, frame=False))
    assert [one.code for one in found.outlines] == list(CODES)
    framed = drawing(tmp_path / "b.dxf", symbol=False, stones_are_blocks=True)
    assert len(read_outlines(framed, layer="STEINE").outlines) == len(CODES)


def coco(path, names):
    """Write the six stones in pixels of 5 mm, the last two of other categories if there are names for them."""
    annotations = [
        {"id": k, "image_id": 1, "category_id": max(0, k - 6 + len(names)),
         "segmentation": [(ring * 200.0).ravel().tolist()]}
        for k, ring in enumerate(rings())
    ]  # fmt: skip
    images = [{"id": 1, "file_name": "a.png", "width": 300, "height": 120}]
    categories = [{"id": k, "name": name} for k, name in enumerate(names)]
    path.write_text(json.dumps({"images": images, "categories": categories, "annotations": annotations}))
    return path


def test_categories_are_asked_for(tmp_path):
    path = coco(tmp_path / "a.json", ["stone", "door", "mortar"])
    with pytest.raises(UsageError, match=r"stone \(4\), door \(1\), mortar \(1\).*--layer stone"):
        read_outlines(path)
    assert len(read_outlines(path, layer="stone").outlines) == 4
    with pytest.raises(UsageError, match="no 'stones' among the categories"):
        read_outlines(path, layer="stones")


def test_categories_that_are_kinds_are_kinds(tmp_path):
    found = read_outlines(coco(tmp_path / "a.json", ["Läufer", "header"])).outlines
    assert [one.said.kind for one in found] == ["stretcher"] * 5 + ["header"]
    found = read_outlines(coco(tmp_path / "b.json", ["stone"])).outlines
    assert [one.said.kind for one in found] == [None] * 6


def test_run_lengths_state_the_size_of_the_picture_and_jpeg_is_named(tmp_path):
    mask = np.zeros((120, 300), int)
    mask[20:80, 40:140] = 1
    flat = mask.T.ravel()
    counts = np.diff(np.concatenate([[0], np.flatnonzero(np.diff(flat)) + 1, [len(flat)]])).tolist()
    path = tmp_path / "a.json"
    path.write_text(json.dumps([{"image_id": 1, "segmentation": {"size": [120, 300], "counts": counts}}]))
    assert read_outlines(path).size == (300, 120)
    (tmp_path / "a.jpg").write_bytes(b"")
    with pytest.raises(UsageError, match="JPEG smears the edges of stones; export"):
        read_outlines(tmp_path / "a.jpg")


def corners(names, scale=1.0, third=False):
    """Return a table of the corners, with decimal commas."""
    lines = [";".join(names)]
    for code, ring in zip(CODES, rings(), strict=True):
        for x, y in ring * scale:
            places = (x, 0.0, y) if third else (x, y)
            lines.append(";".join([code, *(f"{one:.3f}".replace(".", ",") for one in places)]))
    return lines


@pytest.mark.parametrize(
    ("names", "scale"),
    [
        (["Stein-Nr.", "X [mm]", "Y [mm]"], 1000.0),
        (["Steinnummer", "Rechts", "Hoch"], 1.0),
        (["code", "s_cm", "t_cm"], 100.0),
    ],
)
def test_corners_are_columns_by_name(tmp_path, names, scale):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(corners(names, scale)), encoding="cp1252")
    found = read_outlines(path).outlines
    assert [one.code for one in found] == list(CODES)
    np.testing.assert_allclose([one.corners for one in found], rings(), atol=1e-6)


def test_corners_in_a_workbook_and_in_space(tmp_path):
    rows = [line.replace(",", ".").split(";") for line in corners(["Stein", "X", "Y", "Z"], third=True)]
    cells = [rows[0], *([row[0], *map(float, row[1:])] for row in rows[1:])]
    path = tmp_path / "a.xlsx"
    path.write_bytes(xlsx({"Ecken": cells, "Legende": [["Stein", "Nummer"]]}))
    found = read_outlines(path, layer="Ecken").outlines
    np.testing.assert_allclose(
        [one.corners for one in found], [np.insert(ring, 1, 0.0, axis=1) for ring in rings()], atol=1e-6
    )


def test_well_known_text_in_the_plane_of_the_wall(tmp_path):
    rows = [
        f'"POLYGON (({", ".join(f"{x:g} {y:g}" for x, y in [*ring, ring[0]])}))",{k},{code}'
        for k, (code, ring) in enumerate(zip(CODES, rings(), strict=True))
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["WKT,id,Stein_Nr", *rows]), encoding="utf-8-sig")
    found = read_outlines(path).outlines
    assert [one.code for one in found] == list(CODES)
    np.testing.assert_allclose([one.corners for one in found], rings(), atol=1e-9)


def test_outlines_on_a_picture_without_a_world_file_are_asked_for_the_size_of_a_pixel(tmp_path):
    flipped = [np.column_stack([ring[:, 0], ring[:, 1] - 0.6]) * 1000.0 for ring in rings()]
    path = geojson(tmp_path / "a.geojson", flipped)
    with pytest.raises(SurveyError, match="pixels of a picture without a world file"):
        read_outlines(path)
    assert len(read_outlines(path, unit=0.001).outlines) == len(CODES)


ANEW = {"Lage": [1, 1, 1, 2, 2, 2], "Nr": [1, 2, 3, 1, 2, 3]}


@pytest.mark.parametrize("corners", [False, True])
def test_numbers_that_begin_anew_in_each_course_are_joined_as_the_message_says(tmp_path, corners):
    path = geojson(tmp_path / "a.geojson", **ANEW, Typ=["Rückwand"] * 6)
    path.write_text(path.read_text(encoding="utf-8").replace('"code"', '"Foto"'), encoding="utf-8")
    if corners:
        path = tmp_path / "a.csv"
        rows = [
            f"{ANEW['Lage'][k]};{ANEW['Nr'][k]};Rückwand;{x};{y}"
            for k, ring in enumerate(rings())
            for x, y in ring
        ]
        path.write_text("\n".join(["Lage;Nr;Typ;x;y", *rows]), encoding="utf-8")
    with pytest.raises(SurveyError, match="numbered anew in each") as refused:
        read_outlines(path)
    fields, kinds = re.findall(r'--(?:fields|kinds) "([^"]*)"', str(refused.value))
    assert (fields, kinds) == ("code=Lage+Nr", "Rückwand=ashlar")
    found = read_outlines(path, chosen=field_map(fields), kinds=read_kinds(kinds)).outlines
    assert [one.code for one in found] == ["1-1", "1-2", "1-3", "2-1", "2-2", "2-3"]
    assert [one.said.course for one in found] == ANEW["Lage"]
    assert all(len(one.corners) == 4 and one.said.notes.keys() <= {"Foto"} for one in found)


def test_a_code_that_stands_twice_by_a_slip_is_no_number_of_a_course(tmp_path):
    path = geojson(tmp_path / "a.geojson", codes=["1", "2", "3", "4", "5", "1"], Lage=ANEW["Lage"])
    assert len(read_outlines(path).outlines) == 6


def test_a_kind_that_is_not_known_is_stated_as_the_message_says(tmp_path):
    path = geojson(tmp_path / "a.geojson", Typ=["Rückwand"] * 6)
    with pytest.raises(SurveyError) as refused:
        read_outlines(path)
    (kinds,) = re.findall(r'--kinds "([^"]*)"', str(refused.value))
    assert {one.said.kind for one in read_outlines(path, kinds=read_kinds(kinds)).outlines} == {"ashlar"}


@pytest.mark.parametrize("column", ["WKT", "wkt_geom", "Geometrie"])
@pytest.mark.parametrize(("mark", "ending"), [(",", ".csv"), (";", ".csv"), ("\t", ".txt")])
@pytest.mark.parametrize("last", [False, True])
def test_well_known_text_stands_in_any_column(tmp_path, column, mark, ending, last):
    rows = [["Stein", column]]
    for code, ring in zip(CODES, rings(), strict=True):
        places = ", ".join(f"{x} {y}" for x, y in [*ring, ring[0]])
        rows.append([code, f'"MULTIPOLYGON ((({places})))"'])
    path = tmp_path / f"a{ending}"
    path.write_text("\n".join(mark.join(row if last else row[::-1]) for row in rows), encoding="utf-8-sig")
    found = read_outlines(path).outlines
    assert [one.code for one in found] == list(CODES)
    assert [one.corners.tolist() for one in found] == [ring.tolist() for ring in rings()]
    assert found[1].where == f"{path}:3"
    assert not found[0].said.notes
