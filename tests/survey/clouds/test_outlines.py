"""Outlines of every format, as other programs write them."""

import json

import numpy as np
import pytest
from PIL import Image

from ground.errors import SurveyError, UsageError
from survey.clouds.masks import open_masks
from survey.clouds.outlines.coco import mask_columns
from survey.clouds.outlines.labels import read_labels
from survey.clouds.outlines.outline import attributes_of, field_map, made_code
from survey.clouds.outlines.reading import read_outlines
from survey.clouds.outlines.rejected import rejected_outlines
from survey.clouds.outlines.tracing import few_corners, trace
from survey.clouds.settings import MaskOptions
from survey.formats.points.geojson import open_geojson
from survey.geometry.polygons import ring_area
from survey.records.survey import BlockRecord, Reject
from tests.survey.clouds import scans

PIXEL = 0.004
"""Side of a pixel of the pictures [m]."""
WIDTH, TALL = round(1.5 / PIXEL), round(0.6 / PIXEL)
WORLD = f"{PIXEL}\n0\n0\n-{PIXEL}\n{PIXEL / 2}\n{0.6 - PIXEL / 2}\n"


def nearest(found, expected):
    """Largest distance of an expected corner from the nearest one found."""
    return max(float(np.linalg.norm(found - corner, axis=1).min()) for corner in expected)


def label_image():
    """Numbers of the stones from 1, the wall's picture from above."""
    numbers = np.zeros((TALL, WIDTH), np.uint8)
    for k, ring in enumerate(scans.rings(), start=1):
        low, high = np.round(ring[0] / PIXEL).astype(int), np.round(ring[2] / PIXEL).astype(int)
        numbers[TALL - high[1] : TALL - low[1], low[0] : high[0]] = k
    return numbers


def check_rings(outlines, within):
    assert len(outlines) == 6
    for one, ring in zip(outlines, scans.rings(), strict=True):
        assert len(one.corners) == 4, one
        assert nearest(one.corners, ring) <= within


@pytest.mark.parametrize("driver", ["GPKG", "ESRI Shapefile", "GeoJSON", "FlatGeobuf"])
def test_vector_files_by_gdal(driver, tmp_path):
    import pyogrio
    import shapely

    ending = {"GPKG": "gpkg", "ESRI Shapefile": "shp", "GeoJSON": "geojson", "FlatGeobuf": "fgb"}[driver]
    shapes = shapely.to_wkb(np.array([shapely.Polygon(ring) for ring in scans.rings()]))
    said = [
        np.array(["A 1", "A 2", "A 3", "B°1", "B 2", "B 3"], dtype=object),
        np.array([1, 1, 1, 2, 2, 2], np.int32),
        np.array([0.3, np.nan, 0.3, 0.3, 0.3, 0.3]),
    ]
    path = tmp_path / f"stones.{ending}"
    names = ["Stein-Nr", "Lage", "Tiefe"]
    pyogrio.raw.write(path, shapes, said, names, geometry_type="Polygon", crs="EPSG:25832", driver=driver)
    drawing = read_outlines(path)
    by_code = sorted(drawing.outlines, key=lambda one: one.code)
    check_rings(by_code, 1e-9)
    assert [one.code for one in by_code] == ["A-1", "A-2", "A-3", "B-1", "B-2", "B-3"]
    assert [one.said.course for one in by_code] == [1, 1, 1, 2, 2, 2]
    assert [one.said.depth for one in by_code] == [0.3, None, 0.3, 0.3, 0.3, 0.3]


def test_outlines_in_space_keep_their_heights(tmp_path):
    path = scans.geojson(tmp_path / "a.geojson", [scans.in_space(ring) for ring in scans.rings()])
    first = read_outlines(path).outlines[0]
    np.testing.assert_allclose(first.corners, scans.in_space(scans.rings()[0]))


def test_several_layers_are_asked_for(tmp_path):
    import pyogrio
    import shapely

    path, shape = tmp_path / "a.gpkg", shapely.to_wkb(np.array([shapely.box(0, 0, 1, 1)]))
    for k, name in enumerate(("stones", "cracks")):
        pyogrio.raw.write(
            path,
            shape,
            [],
            [],
            geometry_type="Polygon",
            crs="EPSG:25832",
            driver="GPKG",
            layer=name,
            append=k > 0,
        )
    with pytest.raises(UsageError, match="2 layers; name one with --layer: stones, cracks"):
        read_outlines(path)
    (one,) = read_outlines(path, layer="stones").outlines
    assert one.code == "S1"


def drawing(path, units=6, scale=1.0, texts=True, layers=False):
    import ezdxf

    made = ezdxf.new("R2010", units=units)
    space = made.modelspace()
    for k, ring in enumerate(scans.rings()):
        layer = scans.CODES[k] if layers else "0"
        if k == 1:  # whose ends meet, without being marked as closed
            space.add_lwpolyline([*(ring * scale), ring[0] * scale], dxfattribs={"layer": layer})
        elif k == 2:
            space.add_polyline2d(ring * scale, close=True, dxfattribs={"layer": layer})
        else:
            space.add_lwpolyline(ring * scale, close=True, dxfattribs={"layer": layer})
        if texts:
            space.add_text(f"{scans.CODES[k]} v", height=0.02).set_placement(tuple(ring.mean(axis=0) * scale))
    space.add_lwpolyline([(0, 0), (1, 1)])
    made.saveas(path)
    return path


def test_dxf_with_texts_as_codes(tmp_path):
    outlines = read_outlines(drawing(tmp_path / "a.dxf")).outlines
    check_rings(outlines, 1e-9)
    assert [one.code for one in outlines] == [f"{code}-v" for code in scans.CODES]


def test_dxf_in_millimetres_with_layers_as_codes(tmp_path):
    outlines = read_outlines(drawing(tmp_path / "a.dxf", 4, 1000.0, texts=False, layers=True)).outlines
    check_rings(outlines, 1e-9)
    assert [one.code for one in outlines] == list(scans.CODES)


def test_dxf_in_space_and_its_arcs(tmp_path):
    import ezdxf

    made = ezdxf.new("R2010")
    ring = scans.in_space(scans.rings()[0])
    made.modelspace().add_polyline3d(ring, close=True)
    made.modelspace().add_text("K7", height=0.1).set_placement(tuple(ring.mean(axis=0)))
    made.saveas(tmp_path / "a.dxf")
    (one,) = read_outlines(tmp_path / "a.dxf").outlines
    np.testing.assert_allclose(one.corners, ring)
    assert one.code == "K7"
    made = ezdxf.new("R2010")
    made.modelspace().add_lwpolyline(
        [(0, 0, 0, 0, 0), (1, 0, 0, 0, 1.0), (1, 1, 0, 0, 0), (0, 1, 0, 0, 0)], close=True
    )
    made.saveas(tmp_path / "b.dxf")
    (one,) = read_outlines(tmp_path / "b.dxf").outlines
    assert abs(ring_area(one.corners)) == pytest.approx(1.0 + np.pi / 8, rel=0.02)


def test_dxf_without_closed_lines_is_told(tmp_path):
    import ezdxf

    made = ezdxf.new()
    made.modelspace().add_lwpolyline([(0, 0), (1, 0), (1, 1)])
    made.saveas(tmp_path / "a.dxf")
    with pytest.raises(SurveyError, match="no closed curve, but 1 open LWPOLYLINE"):
        read_outlines(tmp_path / "a.dxf")


@pytest.mark.parametrize("kind", ["8 bit", "16 bit", "32 bit TIFF", "colours", "palette"])
def test_label_pictures(kind, tmp_path):
    numbers, path = label_image(), tmp_path / "a.png"
    if kind == "8 bit":
        Image.fromarray(numbers).save(path)
    elif kind == "16 bit":
        Image.fromarray(numbers.astype(np.uint16) * 700).save(path)
    elif kind == "32 bit TIFF":
        path = tmp_path / "a.tif"
        Image.fromarray(numbers.astype(np.int32) * 70000).save(path)
    elif kind == "colours":
        table = np.array(
            [(0, 0, 0), (9, 200, 1), (1, 2, 250), (200, 3, 3), (99, 99, 1), (1, 99, 99), (7, 7, 8)], np.uint8
        )
        Image.fromarray(table[numbers]).save(path)
    else:
        image = Image.fromarray(numbers, mode="P")
        image.putpalette(list(range(256)) * 3)
        image.save(path)
    path.with_suffix(".tfw" if path.suffix == ".tif" else ".pgw").write_text(WORLD, encoding="ascii")
    drawing = read_outlines(path)
    assert drawing.pixel == pytest.approx(PIXEL)
    found = sorted(
        drawing.outlines, key=lambda one: (one.corners[:, 1].mean().round(1), one.corners[:, 0].mean())
    )
    check_rings(found, 0.75 * PIXEL)
    if kind == "16 bit":
        assert [one.code for one in found] == ["S700", "S1400", "S2100", "S2800", "S3500", "S4200"]


def test_a_geotiff_says_itself_where_it_lies(tmp_path):
    from PIL import TiffImagePlugin

    tags = TiffImagePlugin.ImageFileDirectory_v2()
    for tag, values in ((33550, (PIXEL, PIXEL, 0.0)), (33922, (0.0, 0.0, 0.0, 0.0, 0.6, 0.0))):
        tags[tag], tags.tagtype[tag] = values, 12
    Image.fromarray(label_image()).save(tmp_path / "a.tif", tiffinfo=tags)
    check_rings(read_outlines(tmp_path / "a.tif").outlines, 0.75 * PIXEL)


def test_white_stones_are_numbered_from_the_ground_and_specks_are_left_out(tmp_path):
    """Edges are grey, as programs draw them, and some pixels are dirty."""
    white = np.where(label_image() > 0, 255, 0).astype(np.uint8)
    white[5, 0], white[TALL // 2, 1] = 255, 255
    white[:, 2] = np.where(white[:, 2] > 0, 120, 0)
    Image.fromarray(white).convert("RGB").save(tmp_path / "a.png")
    labels = read_labels(tmp_path / "a.png")
    assert labels.values is None
    assert labels.specks == 2
    drawing = read_outlines(tmp_path / "a.png")
    assert drawing.pixels
    assert [one.code for one in drawing.outlines] == [f"S{k:03d}" for k in range(1, 7)]
    lowest = [one.corners[:, 1].mean() for one in drawing.outlines]
    assert min(lowest[:3]) > max(lowest[3:])  # rows are counted from above


def test_pictures_without_stones_are_told(tmp_path):
    Image.fromarray(np.zeros((20, 20), np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(SurveyError, match="a picture of labels has stones in white"):
        read_outlines(tmp_path / "a.png")
    (tmp_path / "b.png").write_bytes(b"no picture")
    with pytest.raises(SurveyError, match="cannot be read as a picture"):
        read_outlines(tmp_path / "b.png")


def compressed(mask):
    """COCO's compressed run lengths, by its published code (maskApi.c, rleToString)."""
    flat = mask.T.ravel()
    edges = np.flatnonzero(np.diff(flat.astype(int))) + 1
    runs = np.diff([0, *edges, len(flat)]).tolist()
    runs = ([0] if flat[0] else []) + runs
    text = ""
    for k, run in enumerate(runs):
        value = run - (runs[k - 2] if k > 2 else 0)
        more = True
        while more:
            digit = value & 0x1F
            value >>= 5
            more = value != -1 if digit & 0x10 else value != 0
            text += chr((digit | 0x20 if more else digit) + 48)
    return text


def test_run_lengths_come_back():
    rng = np.random.default_rng(3)
    for _ in range(50):
        mask = rng.random((17, 23)) < rng.uniform(0.02, 0.98)
        columns, first = mask_columns({"size": [17, 23], "counts": compressed(mask)}, "")
        last = first + columns.shape[1]
        assert (columns == mask[:, first:last]).all()
        assert not mask[:, :first].any()
        assert not mask[:, last:].any()
    with pytest.raises(SurveyError, match="run lengths of 5 pixels for a picture of 3 × 2"):
        mask_columns({"size": [2, 3], "counts": [2, 3]}, "")


def coco(kind):
    numbers, annotations = label_image(), []
    for k in range(1, 7):
        mask = numbers == k
        if kind == "polygon":
            ring = scans.rings()[k - 1] / PIXEL
            shape = [np.column_stack([ring[:, 0], TALL - ring[:, 1]]).ravel().tolist()]
        elif kind == "compressed":
            shape = {"size": [TALL, WIDTH], "counts": compressed(mask)}
        else:
            edges = np.flatnonzero(np.diff(mask.T.ravel().astype(int))) + 1
            shape = {"size": [TALL, WIDTH], "counts": np.diff([0, *edges, mask.size]).tolist()}
        annotations.append(
            {"id": k, "image_id": 1, "category_id": 3, "segmentation": shape, "score": 0.4 + 0.1 * k}
        )
    image = {"id": 1, "file_name": "photos/wall.png", "width": WIDTH, "height": TALL}
    return {"images": [image], "categories": [{"id": 3, "name": "stone"}], "annotations": annotations}


@pytest.mark.parametrize("kind", ["polygon", "compressed", "runs"])
def test_masks_of_coco(kind, tmp_path):
    (tmp_path / "a.json").write_text(json.dumps(coco(kind)), encoding="utf-8")
    (tmp_path / "wall.pgw").write_text(WORLD, encoding="ascii")
    outlines = read_outlines(tmp_path / "a.json").outlines
    check_rings(outlines, 0.75 * PIXEL)
    assert [one.code for one in outlines] == [f"S{k:03d}" for k in range(1, 7)]
    assert outlines[2].said.score == pytest.approx(0.7)
    assert outlines[2].said.notes["category"] == "stone"


def test_results_of_coco_are_a_list_of_one_picture(tmp_path):
    annotations = coco("compressed")["annotations"]
    (tmp_path / "a.json").write_text(json.dumps(annotations), encoding="utf-8")
    assert len(read_outlines(tmp_path / "a.json").outlines) == 6
    annotations[0]["image_id"] = 2
    (tmp_path / "a.json").write_text(json.dumps(annotations), encoding="utf-8")
    with pytest.raises(UsageError, match="masks of 2 pictures"):
        read_outlines(tmp_path / "a.json")


def test_a_traced_rectangle_has_its_corners_between_pixels():
    mask = np.zeros((30, 40), bool)
    mask[5:20, 10:33] = True
    ring, pieces, share = trace(mask)
    assert (pieces, share) == (1, 1.0)
    corners = few_corners(ring, 1.5)
    assert nearest(corners, np.array([(9.5, 4.5), (32.5, 4.5), (32.5, 19.5), (9.5, 19.5)])) < 1e-6
    assert len(corners) == 4


def test_turned_stones_are_traced_below_a_pixel():
    rows, columns = np.mgrid[0:200, 0:200]
    for angle in np.radians((7.0, 21.0, 38.0)):
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        u, v = (
            (columns - 100) * along[0] + (rows - 100) * along[1],
            (columns - 100) * across[0] + (rows - 100) * across[1],
        )
        corners = few_corners(trace((abs(u) < 60) & (abs(v) < 35))[0], 1.5)
        truth = 100 + np.array(
            [a * along + b * across for a, b in ((-60, -35), (60, -35), (60, 35), (-60, 35))]
        )
        assert len(corners) == 4
        assert nearest(corners, truth) < 0.6


def test_pieces_and_holes_of_masks():
    mask = np.zeros((40, 40), bool)
    mask[2:20, 2:38] = True
    mask[8:12, 8:12] = False
    mask[30:36, 5:10] = True
    ring, pieces, share = trace(mask)
    assert pieces == 2
    assert 0.9 < share < 0.97
    assert abs(ring_area(ring)) == pytest.approx(18 * 36, rel=0.01)


def test_attributes_by_names_in_five_languages():
    said = attributes_of({"Pierre": "P1", "Assise": 3, "Profondeur": "0,35", "Farbe": "rot"}, {}, "here")
    assert (said.code, said.course, said.depth, said.notes) == ("P1", 3, 0.35, {"Farbe": "rot"})
    chosen = field_map("code=uuid, course=row no")
    said = attributes_of({"id": 7, "uuid": "x1", "row no": "2"}, chosen, "here")
    assert (said.code, said.course) == ("x1", 2)
    with pytest.raises(SurveyError, match=r"no attribute 'uuid'.*attributes are: id"):
        attributes_of({"id": 7}, chosen, "here")
    with pytest.raises(SurveyError, match="course 'third' is not a whole number"):
        attributes_of({"course": "third"}, {}, "here")
    with pytest.raises(SurveyError, match=r"depth is 350 m.*in metres"):
        attributes_of({"depth": 350}, {}, "here")
    with pytest.raises(UsageError, match="--fields"):
        field_map("colour=red")


def test_codes_are_made_by_a_stated_rule():
    assert [made_code(one) for one in (" Stein 12 ", "Grün°3", "A1.1 SPR v", "7.0", "°")] == [
        "Stein-12",
        "Grün-3",
        "A1.1-SPR-v",
        "7",
        "",
    ]


def test_a_curve_drawn_by_many_corners_is_described_by_few(tmp_path):
    ring, dense = scans.rings()[0], []
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        dense += [a + share * (b - a) for share in np.linspace(0, 1, 9)[:-1]]
    jitter = np.random.default_rng(5).normal(0.0, 0.002, (len(dense), 2))
    path = scans.geojson(tmp_path / "a.geojson", [np.array(dense) + jitter], ["A"])
    (one,) = read_outlines(path, sigma=0.005).outlines
    assert len(one.corners) == 4
    assert nearest(one.corners, ring) < 0.004


def test_wrong_files_are_told(tmp_path):
    (tmp_path / "a.gpkg").write_bytes(b"nothing")
    with pytest.raises(SurveyError, match="cannot be read"):
        read_outlines(tmp_path / "a.gpkg")
    with pytest.raises(UsageError, match="no such file"):
        read_outlines(tmp_path / "b.gpkg")
    (tmp_path / "a.doc").write_bytes(b"")
    with pytest.raises(UsageError, match=r"unknown ending '.doc'.*\.gpkg"):
        read_outlines(tmp_path / "a.doc")
    line = {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [0, 0]}}
    (tmp_path / "a.geojson").write_text(
        json.dumps({"type": "FeatureCollection", "features": [line]}), encoding="utf-8"
    )
    with pytest.raises(SurveyError, match="feature 0: a Point, not a polygon"):
        read_outlines(tmp_path / "a.geojson")


def test_outlines_of_wild_masks_never_cross_themselves():
    """Merged blobs with bays and necks: the outline is a polygon, and keeps the area."""
    from scipy.ndimage import gaussian_filter, label
    from shapely import Polygon

    rng, tried = np.random.default_rng(13), 0
    for _ in range(30):
        numbers, count = label(gaussian_filter(rng.normal(size=(90, 90)), 3.0) > 0.05)
        for k in range(1, count + 1):
            ring, _, _ = trace(numbers == k)
            if abs(ring_area(ring)) < 200.0:
                continue
            corners = few_corners(ring, 1.5)
            shape = Polygon(corners)
            assert shape.is_valid
            assert shape.area == pytest.approx(abs(ring_area(ring)), rel=0.15)
            tried += 1
    assert tried > 60


def collection(path, *geometries):
    """GeoJSON in a projected system: three sound outlines, then features with these geometries."""
    sound = [{"type": "Polygon", "coordinates": [square(0.6 * k)]} for k in range(3)]
    features = [
        {"type": "Feature", "properties": {"code": f"S{k}"}, "geometry": geometry}
        for k, geometry in enumerate([*sound, *geometries])
    ]
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}
    path.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))
    return path


def square(x):
    return [[x, 0.0], [x + 0.5, 0.0], [x + 0.5, 0.3], [x, 0.3], [x, 0.0]]


@pytest.mark.parametrize(
    ("geometry", "words", "drawn"),
    [
        (None, "no geometry", 0),
        ({"type": "Point", "coordinates": [1.0, 2.0]}, "a Point", 0),
        ({"type": "LineString", "coordinates": square(2.4)[:4]}, "not closed", 4),
        ({"type": "Polygon", "coordinates": []}, "no geometry", 0),
        ({"type": "Polygon", "coordinates": [[[4, 0], [5, 0], [4, 0]]]}, "2 corners", 2),
    ],
)
def test_a_feature_that_is_no_outline_spoils_no_other(tmp_path, geometry, words, drawn):
    path = collection(tmp_path / "stones.geojson", geometry)
    with pytest.raises(SurveyError, match=words):
        read_outlines(path)
    stones = list(open_masks(path, MaskOptions(depth=0.4)).blocks)
    (reject,) = [one for one in stones if isinstance(one, Reject)]
    assert len(stones) == 4
    assert words in str(reject.error)
    (feature,) = json.loads(rejected_outlines(path, None, {}, 0.005, 1.5, [reject]))["features"]
    assert (feature["properties"]["code"], words in feature["properties"]["reason"]) == ("S3", True)
    assert len((feature["geometry"] or {"coordinates": ()})["coordinates"]) == drawn


def test_features_of_which_none_is_an_outline_are_refused_at_the_first(tmp_path):
    path = tmp_path / "stones.geojson"
    points = [
        {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [k, 0]}}
        for k in (1, 2)
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": points}))
    with pytest.raises(SurveyError, match="feature 0: a Point"):
        open_masks(path, MaskOptions(depth=0.4))


def test_an_unclosed_ring_is_closed_and_one_that_crosses_itself_named(tmp_path):
    crossing = [[3.0, 0.0], [3.5, 0.3], [3.5, 0.0], [3.0, 0.3], [3.0, 0.0]]
    rings = [{"type": "Polygon", "coordinates": [ring]} for ring in (square(2.4)[:4], crossing)]
    stream = open_masks(collection(tmp_path / "stones.geojson", *rings), MaskOptions(depth=0.4))
    stones = list(stream.blocks)
    assert [len(one.vertices) for one in stones] == [4] * 5
    assert [(one.code, one.reason) for one in stream.review] == [("S4", "crosses itself")]


def test_outlines_in_space_that_are_wrong_spoil_no_other(tmp_path):
    features = [
        {"type": "Feature", "properties": {"code": f"S{k}"},
         "geometry": {"type": "Polygon", "coordinates": [[[x, 0.0, z] for x, z in square(0.6 * k)]]}}
        for k in range(3)
    ]  # fmt: skip
    features[1]["geometry"] = None
    path = tmp_path / "stones.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    found = list(open_geojson(path).blocks)
    assert [type(one) for one in found] == [Reject, BlockRecord, BlockRecord]
    assert "stones.geojson:2: a feature without coordinates" in str(found[0].error)
