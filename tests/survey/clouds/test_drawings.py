"""Drawings and annotations as offices deliver them: blocks, labels, hidden layers, units, elevations, classes."""

import json
import shlex

import ezdxf
import numpy as np
import pytest
from ezdxf.math import Vec2
from ezdxf.render import ConnectionSide

from ground.errors import SurveyError, UsageError
from survey.clouds.masks import open_masks
from survey.clouds.outlines.reading import read_outlines
from survey.clouds.settings import MaskOptions

SQUARE = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.3), (0.0, 0.3)]
FOOT = 1200.0 / 3937.0


@pytest.fixture
def drawing(tmp_path):
    """A drawing to fill, which is saved and read."""
    doc = ezdxf.new("R2010")
    path = tmp_path / "a.dxf"

    def read(**given):
        doc.saveas(path)
        return read_outlines(path, **given)

    doc.read = read
    doc.path = path
    return doc


def square(space, x=0.0, layer="STONES", **given):
    """Draw one stone from x."""
    ring = [(x + a, b) for a, b in SQUARE]
    return space.add_lwpolyline(ring, close=True, dxfattribs={"layer": layer, **given})


def areas(found):
    return sorted(np.ptp(one.corners[:, 0]) * np.ptp(one.corners[:, 1]) for one in found.outlines)


def test_blocks_splines_circles_and_hatches_are_outlines(drawing):
    space = drawing.modelspace()
    square(space)
    inner = drawing.blocks.new("INNER")
    square(inner, layer="0")
    outer = drawing.blocks.new("OUTER")
    outer.add_blockref("INNER", (1.0, 0.0))
    space.add_blockref("OUTER", (0.0, 1.0), dxfattribs={"layer": "STONES"})
    space.add_circle((3.0, 3.0), 0.2, dxfattribs={"layer": "STONES"})
    space.add_spline(
        [(5, 0, 0), (5.5, 0, 0), (5.5, 0.3, 0), (5, 0.3, 0)], dxfattribs={"layer": "STONES"}
    ).closed = True
    hatch = space.add_hatch(dxfattribs={"layer": "STONES"})
    hatch.paths.add_polyline_path([(7 + a, b) for a, b in SQUARE], is_closed=True)
    hatch.paths.add_polyline_path([(7.1 + 0.2 * a, 0.1 + 0.2 * b) for a, b in SQUARE], is_closed=True)
    filling = space.add_hatch(dxfattribs={"layer": "STONES"})
    filling.paths.add_polyline_path(SQUARE, is_closed=True)
    space.add_line((0, 0), (1, 1))
    found = drawing.read()
    assert len(found.outlines) == 5
    assert all("layer" not in one.said.notes or one.said.notes["layer"] == "STONES" for one in found.outlines)
    assert min(
        one.corners[:, 0].min() for one in found.outlines if one.corners[:, 1].min() > 0.9
    ) == pytest.approx(1.0)
    assert found.left == (("left out", "1 LINE: neither closed curves nor texts"),)
    assert len(drawing.read(layer="stones").outlines) == 5


def test_what_is_hidden_is_left_out_and_counted_unless_it_is_named(drawing):
    space = drawing.modelspace()
    drawing.layers.add("OLD").freeze()
    drawing.layers.add("OFF").off()
    square(space)
    square(space, 1.0, "OLD")
    square(space, 2.0, "OFF")
    square(space, 3.0, invisible=1)
    found = drawing.read()
    assert len(found.outlines) == 1
    assert found.left == (
        ("hidden", "outlines on layers that are frozen or off are left out: 1 OFF, 1 OLD, 1 STONES"),
    )
    assert len(drawing.read(layer="OLD").outlines) == 1


def test_a_drawing_whose_stones_are_all_hidden_names_the_layer(drawing):
    drawing.layers.add("OLD").freeze()
    square(drawing.modelspace(), layer="OLD")
    with pytest.raises(SurveyError, match=r"1 OLD on layers that are frozen or off.*--layer OLD"):
        drawing.read()


@pytest.mark.parametrize(
    ("code", "length"), [(0, 1.0), (4, 0.001), (1, 0.0254), (2, 0.3048), (14, 0.1), (21, FOOT)]
)
def test_units_of_drawings(drawing, code, length):
    drawing.header["$INSUNITS"] = code
    square(drawing.modelspace())
    (one,) = drawing.read().outlines
    assert np.ptp(one.corners[:, 0]) == pytest.approx(0.5 * length, rel=1e-12)
    (one,) = drawing.read(unit=0.01).outlines
    assert np.ptp(one.corners[:, 0]) == pytest.approx(0.005, rel=1e-12)


@pytest.mark.parametrize("code", [7, 18, 99])
def test_a_unit_of_no_masonry_is_asked_for(drawing, code):
    drawing.header["$INSUNITS"] = code
    square(drawing.modelspace())
    with pytest.raises(SurveyError, match=rf"number {code} .*--unit m"):
        drawing.read()
    assert len(drawing.read(unit=1.0).outlines) == 1


def label(drawing, space, place, **tags):
    block = drawing.blocks.get("LABEL") if "LABEL" in drawing.blocks else drawing.blocks.new("LABEL")
    insert = space.add_blockref(block.name, place)
    for tag, text in tags.items():
        insert.add_attrib(tag, text, (place[0] + 9.0, place[1]))  # beside the stone


def test_labels_name_stones_and_carry_their_attributes(drawing):
    space = drawing.modelspace()
    square(space)
    square(space, 1.0)
    label(drawing, space, (0.1, 0.1), MATERIAL="granite", NR="Q 7", ART="Läufer", TIEFE="0,3")
    label(drawing, space, (1.1, 0.1), NR="Q 8", ART="B")
    one, other = drawing.read(kinds={"b": "header"}).outlines
    assert (one.code, one.said.kind, one.said.depth, one.said.notes["MATERIAL"]) == (
        "Q-7",
        "stretcher",
        0.3,
        "granite",
    )
    assert (other.code, other.said.kind) == ("Q-8", "header")


def test_a_text_belongs_to_the_smallest_outline_around_it(drawing):
    space = drawing.modelspace()
    space.add_lwpolyline([(-1, -1), (9, -1), (9, 2), (-1, 2)], close=True, dxfattribs={"layer": "FRAME"})
    for k in range(2):
        square(space, float(k))
        space.add_text(f"A{k}", dxfattribs={"insert": (k + 0.1, 0.1)})
    assert [one.code for one in drawing.read().outlines] == ["S1", "A0", "A1"]
    square(space, 2.0)
    space.add_text("A2", dxfattribs={"insert": (2.1, 0.1)})
    with pytest.raises(SurveyError, match=r"holds 3 texts of other outlines.*--layer STONES"):
        drawing.read()
    assert len(drawing.read(layer="STONES").outlines) == 3


def masked(path, **given):
    stream = open_masks(path, MaskOptions(depth=0.4, **given))
    return stream, list(stream.blocks)


def test_elevations_of_plane_polylines_say_nothing(drawing):
    space = drawing.modelspace()
    square(space, elevation=12.5)
    square(space, 1.0)
    drawing.saveas(drawing.path)
    _, stones = masked(drawing.path)
    np.testing.assert_allclose(stones[0].vertices, [(x, 0.0, z) for x, z in SQUARE], atol=1e-12)


@pytest.mark.parametrize("turned", [False, True])
def test_outlines_in_space_keep_their_places_and_are_seen_from_outside(drawing, turned):
    space = drawing.modelspace()
    for x in (0.0, 1.0):
        ring = [(x + a, 3.0, b) for a, b in SQUARE]
        space.add_polyline3d(ring[::-1] if turned else ring, close=True)
    drawing.saveas(drawing.path)
    stream, stones = masked(drawing.path)
    assert len(stones) == 2
    assert (stones[0].vertices[:, 1] == 3.0).all()
    assert np.sign(stream.head.stations[0].position[1] - 3.0) == (1.0 if turned else -1.0)
    space.add_polyline3d([(5.0 + a, 3.0, b) for a, b in (SQUARE if turned else SQUARE[::-1])], close=True)
    drawing.saveas(drawing.path)
    with pytest.raises(SurveyError, match=r"runs around another side.*--header"):
        masked(drawing.path)


def labelme(tmp_path, *shapes):
    path = tmp_path / "a.json"
    made = [{"label": label, "shape_type": kind, "points": points} for label, kind, points in shapes]
    path.write_text(json.dumps({"shapes": made, "imagePath": "a.jpg", "imageWidth": 200, "imageHeight": 100}))
    return path


def test_labelme_counts_from_the_corner_and_names_by_labels(tmp_path):
    path = labelme(
        tmp_path,
        ("A1", "polygon", [[0, 0], [100, 0], [100, 100], [0, 100]]),
        ("A2", "rectangle", [[100, 0], [200, 100]]),
    )
    found = read_outlines(path)
    assert [one.code for one in found.outlines] == ["A1", "A2"]
    assert (found.size, found.pixels) == ((200, 100), True)
    _, stones = masked(path, size=(2.0, 1.0))
    np.testing.assert_allclose(np.ptp(stones[0].vertices, axis=0), [1.0, 0.0, 1.0], atol=1e-12)
    assert stones[0].vertices[:, 2].min() == pytest.approx(0.0, abs=1e-12)


def test_labels_that_repeat_are_classes_and_are_asked_for(tmp_path):
    box = "rectangle", [[0, 0], [10, 10]]
    path = labelme(tmp_path, *[("stone", *box)] * 3, *[("mortar", *box)] * 2)
    with pytest.raises(UsageError, match=r"2 labels: stone \(3\), mortar \(2\).*--layer stone"):
        read_outlines(path)
    assert [one.code for one in read_outlines(path, layer="stone").outlines] == ["S001", "S002", "S003"]
    with pytest.raises(UsageError, match="labels are: stone"):
        read_outlines(path, layer="joint")
    kinds = labelme(tmp_path, *[("Läufer", *box)] * 2, *[("Binder", *box)] * 2)
    assert [one.said.kind for one in read_outlines(kinds).outlines] == ["stretcher"] * 2 + ["header"] * 2


def test_a_shape_that_is_no_outline_is_named(tmp_path):
    path = labelme(tmp_path, ("A1", "line", [[0, 0], [10, 10]]))
    with pytest.raises(SurveyError, match="shape 1: a shape of type 'line' is no outline"):
        read_outlines(path)


@pytest.mark.parametrize("project", [False, True])
def test_via_by_regions_as_a_list_or_by_number(tmp_path, project):
    from PIL import Image

    regions = [
        {"shape_attributes": {"name": "polygon", "all_points_x": [0, 9, 9, 0], "all_points_y": [0, 0, 9, 9]},
         "region_attributes": {"name": "A1", "kind": "Sturz"}},
        {"shape_attributes": {"name": "circle", "cx": 20, "cy": 20, "r": 5}, "region_attributes": {"name": "A2"}},
    ]  # fmt: skip
    image = {"filename": "w.png", "size": 1, "regions": dict(enumerate(regions)) if project else regions}
    content = {"w.png1": image, "x.png1": {"filename": "x.png", "size": 1, "regions": []}}
    path = tmp_path / "v.json"
    path.write_text(json.dumps({"_via_settings": {}, "_via_img_metadata": content} if project else content))
    with pytest.raises(UsageError, match="put the picture beside it"):
        masked(path, size=(1.0, 1.0))
    Image.new("L", (40, 40)).save(tmp_path / "w.png")
    found = read_outlines(path)
    assert ([one.code for one in found.outlines], found.size) == (["A1", "A2"], (40, 40))
    assert found.outlines[0].said.kind == "lintel"
    assert found.outlines[1].corners.mean(axis=0) == pytest.approx([19.5, 19.5], abs=0.1)
    content["x.png1"]["regions"] = regions
    path.write_text(json.dumps(content))
    with pytest.raises(UsageError, match=r"outlines on 2 pictures: w\.png, x\.png"):
        read_outlines(path)


@pytest.mark.parametrize("east", [11.0, -75.0, 2.0])
def test_longitudes_and_latitudes_are_named(tmp_path, east):
    ring = [[east + 4e-6 * a, 48.0 + 4e-6 * b] for a, b in [*SQUARE, SQUARE[0]]]
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    with pytest.raises(SurveyError, match=r"longitudes and latitudes.*projected system"):
        read_outlines(path)


@pytest.mark.parametrize(
    ("text", "kind"), [("Läufer", "stretcher"), ("BI", "header"), ("Claveau", "voussoir")]
)
def test_kinds_of_layers_in_other_languages_and_by_a_table(tmp_path, text, kind):
    ring = [[a, b] for a, b in [*SQUARE, SQUARE[0]]]
    feature = {
        "type": "Feature",
        "properties": {"Art": text},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
    (stone,) = masked(path, kinds={"bi": "header"})[1]
    assert stone.kind == kind


def test_texts_of_a_mirrored_drawing_stand_in_their_outlines_and_are_a_question(drawing):
    space = drawing.modelspace()
    for k in range(3):
        back = {"extrusion": (0, 0, -1)}
        space.add_lwpolyline([(-2.0 * k - a, b) for a, b in SQUARE], close=True, dxfattribs=back)
        # turned about twice, it can be read from the front
        upright = {"insert": (-2.0 * k - 0.25, 0.15), "text_generation_flag": 2, **back}
        space.add_text(f"S{k}", dxfattribs=upright)
    found = drawing.read()
    lefts = {one.said.code: float(one.corners[:, 0].min()) for one in found.outlines}
    assert lefts == pytest.approx({"S0": 0.0, "S1": 2.0, "S2": 4.0})
    for text in space.query("TEXT"):
        text.dxf.text_generation_flag = 0
    with pytest.raises(SurveyError, match=r"most of its texts are mirrored.*set its texts upright"):
        drawing.read()


def test_texts_written_backwards_are_a_question(drawing):
    space = drawing.modelspace()
    square(space)
    square(space, 1.0)
    space.add_text("A", dxfattribs={"insert": (0.2, 0.1), "text_generation_flag": 2})
    space.add_text("B", dxfattribs={"insert": (1.2, 0.1)})
    assert {one.said.code for one in drawing.read().outlines} == {"A", "B"}  # a slip
    space.add_text("north", dxfattribs={"insert": (5, 5), "text_generation_flag": 2})
    with pytest.raises(SurveyError, match="most of its texts are mirrored"):
        drawing.read()


@pytest.mark.parametrize("names", [("QUADER", "BOGEN"), ("QUADER", "BOGEN", "A B"), ("STEINE 1,2",)])
def test_a_frame_is_left_out_by_the_layers_of_all_stones(drawing, names):
    space = drawing.modelspace()
    for k in range(6):
        square(space, 0.6 * k, layer=names[k % len(names)])
        space.add_text(f"{k + 1}", height=0.02).set_placement((0.6 * k + 0.2, 0.1))
    frame = drawing.blocks.new("FRAME")
    frame.add_lwpolyline([(-1, -1), (9, -1), (9, 1), (-1, 1)], close=True)
    frame.add_lwpolyline([(7, -1), (9, -1), (9, -0.5), (7, -0.5)], close=True)
    frame.add_attdef("PLAN", (7.1, -0.9))
    insert = space.add_blockref("FRAME", (0, 0), dxfattribs={"layer": "RAHMEN"})
    insert.add_auto_attribs({"PLAN": "123.04"})
    with pytest.raises(SurveyError, match="the outline holds 7 texts") as refused:
        drawing.read()
    layers = shlex.split(str(refused.value).partition("with --layer ")[2])
    found = drawing.read(layer=layers[0])
    assert [one.code for one in found.outlines] == ["1", "2", "3", "4", "5", "6"]
    assert ("left out", "outlines on layers that --layer does not name: 2 RAHMEN") in found.left


def outline_of_pieces(space, x, pieces):
    """Draw one stone as lines, an arc, or open polylines that meet at their ends."""
    a, b, c, d = [(x + one, two) for one, two in SQUARE]
    if pieces == "lines":
        for start, stop in ((c, b), (a, b), (c, d), (a, d)):
            space.add_line(start, stop)
    elif pieces == "arc":
        space.add_arc((x + 0.25, 0.3), 0.25, 0, 180)
        space.add_lwpolyline([d, a, b, c])
    else:
        space.add_lwpolyline([b, a, d])
        space.add_line(b, c)
        space.add_line(d, c)


@pytest.mark.parametrize(("pieces", "corners"), [("lines", 4), ("arc", 5), ("polylines", 4)])
def test_single_lines_that_meet_at_their_ends_are_an_outline(drawing, pieces, corners):
    space = drawing.modelspace()
    for k in range(3):
        outline_of_pieces(space, 0.6 * k, pieces)
    assert len(drawing.read().outlines) == 3
    for k in range(3):
        space.add_text(f"N{k}", height=0.02).set_placement((0.6 * k + 0.2, 0.1))
    for start, stop in (((-1, -1), (5, -1)), ((5, -1), (5, 2)), ((5, 2), (-1, 2)), ((-1, 2), (-1, -1))):
        space.add_line(start, stop)  # a frame
    space.add_line((-1, -1), (-2, -1))
    outline_of_pieces(space, 3.0, pieces)  # a symbol without a text
    found = drawing.read()
    assert [one.code for one in found.outlines] == ["N0", "N1", "N2"]
    assert all(len(one.corners) >= corners for one in found.outlines)
    left = {text.partition(" ")[0]: text for _, text in found.left}
    assert "closed curves of single lines, without a text" in left["1"]
    assert "5 LINE" in left["5"]  # a frame from whose corner a line leads away is no closed curve


@pytest.mark.parametrize("label", ["lines", "texts", "abbreviation"])
def test_a_word_for_a_kind_in_a_label_is_the_kind(drawing, label):
    space = drawing.modelspace()
    for k, word in enumerate(("Läufer", "Binder")):
        square(space, 0.6 * k)
        word = word[0] if label == "abbreviation" else word
        if label == "texts":
            space.add_text(word, height=0.02).set_placement((0.6 * k + 0.1, 0.2))
            space.add_text(f"1-{k}", height=0.02).set_placement((0.6 * k + 0.2, 0.1))
        else:
            text = rf"{{\fArial|b0;\C1;1-{k}}}\P{{\H0.5x;{word}}}"
            space.add_mtext(text, dxfattribs={"char_height": 0.02, "insert": (0.6 * k + 0.2, 0.2)})
    square(space, 1.2)
    space.add_text("Binder" if label != "abbreviation" else "B", height=0.02).set_placement((1.4, 0.1))
    found = drawing.read(
        kinds={"l": "stretcher", "b": "header"} if label == "abbreviation" else None
    ).outlines
    kinds = ["stretcher", "header", "header"]
    assert [(one.code, one.said.kind) for one in found] == list(zip(("1-0", "1-1", "S3"), kinds, strict=True))
    assert not any(one.doubts for one in found)


def numbered(drawing, place, text):
    """Insert a label: a number in a circle."""
    if "NUMBER" not in drawing.blocks:
        block = drawing.blocks.new("NUMBER")
        block.add_circle((0, 0), 0.05)
        block.add_attdef("NR", (0, 0), dxfattribs={"height": 0.02})
    drawing.modelspace().add_blockref("NUMBER", place).add_auto_attribs({"NR": text})


@pytest.mark.parametrize("label", ["leader", "text", "multileader"])
def test_a_label_beside_its_stone_is_of_the_stone_that_its_leader_points_to(drawing, label):
    space = drawing.modelspace()
    for k in range(5):
        square(space, 0.6 * k)
        place = (0.6 * k + 0.2, 0.1)
        if k > 2:  # beside it
            tip, place = place, (0.6 * k + 0.1, 2.0)
        if label == "multileader" and k > 2:
            made = space.add_multileader_mtext("Standard")
            made.set_content(f"N{k}\\PBinder")
            made.add_leader_line(ConnectionSide.left, [Vec2(tip)])
            made.build(insert=Vec2(place))
            continue
        if k > 2:
            space.add_leader([tip, (place[0] + 0.01, 1.98)])
        if label == "text":
            space.add_text(f"N{k}", height=0.02).set_placement(place)
        else:
            numbered(drawing, place, f"N{k}")
    found = drawing.read()
    assert [one.code for one in found.outlines] == [f"N{k}" for k in range(5)]
    assert areas(found) == pytest.approx([0.15] * 5)
    assert [one.said.kind for one in found.outlines][3:] == (
        ["header"] * 2 if label == "multileader" else [None] * 2
    )


def test_labels_that_stand_in_no_outline_are_listed(drawing):
    space = drawing.modelspace()
    for k in range(5):
        square(space, 0.6 * k)
        numbered(drawing, (0.6 * k + 0.2, 0.1 if k < 4 else 2.0), f"N{k}")
    found = drawing.read()
    assert [one.code for one in found.outlines] == ["N0", "N1", "N2", "N3", "S5"]
    assert ("texts", "1 labels stand in no outline: N4") in found.left
