"""Points and outlines in exchange formats, written here by their published specifications."""

import json
import re

import numpy as np
import pytest

from ground.errors import SurveyError, UsageError
from survey.formats.options import ReadingOptions
from survey.formats.reading import WAYS_OUT, format_of, open_survey
from survey.records.survey import Reject

CORNERS = [
    ("v", 10.07, 37.965, 6.826),
    ("v", 10.436, 38.011, 6.828),
    ("v", 10.435, 38.01, 7.14),
    ("p", 10.2, 37.98, 7.0),
]


def gsi(size, unit="0", digits=3, code=71, inside=True):
    """GSI-8 or GSI-16: a station, then points with a code on their line or on one before."""

    def word(index, info, data, sign="+"):
        return f"{index}{info}{sign}{data:0>{size}}"

    def coordinate(index, value):
        return word(index, f"..0{unit}", round(abs(value) * 10**digits), "-" if value < 0 else "+")

    star = "*" if size == 16 else ""
    lines = [" ".join([word(11, "0001", "S1"), *map(coordinate, (84, 85, 86), (12.0, -28.5, 7.9))])]
    for k, (role, x, y, z) in enumerate(CORNERS, 101):
        if not inside:
            lines.append(" ".join([word(41, "0001", "A1"), word(42, "....", role)]))
        words = [word(11, f"{k:04}", k), word(21, ".022", 12345), word(31, "..00", 9999)]
        words += [coordinate(81, x), coordinate(82, y), coordinate(83, z)]
        if inside:
            words.append(word(code, "....", f"A1:{role}"))
        lines.append(" ".join(words))
    return "\n".join(star + line + " " for line in lines)


LANDXML = """<?xml version="1.0" encoding="UTF-8"?>
<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2">
  <Units><{units} linearUnit="{unit}" areaUnit="x" volumeUnit="x"/></Units>
  <CgPoints name="wall">
{points}
    <CgPoint name="ref" pntRef="101"/>
  </CgPoints>
</LandXML>
"""

JOBXML = """<?xml version="1.0" encoding="utf-8"?>
<JOBFile jobName="wall" version="5.6">
  <FieldBook>
    <StationRecord ID="1" TimeStamp="x"><StationName>S1</StationName><TheodoliteHeight>1.5</TheodoliteHeight></StationRecord>
    <PointRecord ID="2" TimeStamp="x"><Name>101</Name><Code>A1:v</Code><Circle><HorizontalCircle>1</HorizontalCircle></Circle></PointRecord>
  </FieldBook>
  <Reductions>
    <Point ID="0"><Name>S1</Name><Code></Code><Grid><North>-28.5</North><East>12.0</East><Elevation>7.9</Elevation></Grid></Point>
{points}
    <Point ID="9"><Name>9</Name><Code>A1:v</Code><Deleted>true</Deleted><Grid><North>0</North><East>0</East><Elevation>0</Elevation></Grid></Point>
  </Reductions>
</JOBFile>
"""  # noqa: E501


def landxml(unit="meter", size=1.0, code='code="A1:{role}"'):
    points = "\n".join(
        f'    <CgPoint name="{k}" {code.format(role=role)}>{y / size:.9f} {x / size:.9f} {z / size:.9f}</CgPoint>'
        for k, (role, x, y, z) in enumerate(CORNERS, 101)
    )
    return LANDXML.format(units="Metric" if "meter" in unit else "Imperial", unit=unit, points=points)


def jobxml():
    points = "\n".join(
        f'<Point ID="{k}"><Name>{k}</Name><Code>A1:{role}</Code><Classification>Normal</Classification>'
        f"<Grid><North>{y}</North><East>{x}</East><Elevation>{z}</Elevation></Grid></Point>"
        for k, (role, x, y, z) in enumerate(CORNERS, 101)
    )
    return JOBXML.format(points=points)


def read(path, text, format=None, **options):
    path.write_text(text, encoding="utf-8")
    stream = open_survey(path, format or format_of(path), ReadingOptions(**options))
    (one,) = stream.blocks
    assert not isinstance(one, Reject), one.error
    return stream, one


@pytest.mark.parametrize(
    ("name", "text", "codes"),
    [
        ("a.gsi", gsi(8), None),
        ("a.gsi", gsi(16), None),
        ("a.gsi", gsi(16, "6", 4), None),
        ("a.gsi", gsi(8, "8", 5), None),
        ("a.gsi", gsi(8, inside=False), "{block} {role}"),
        ("a.xml", landxml(), None),
        ("a.xml", landxml("foot", 0.3048), None),
        ("a.xml", landxml("USSurveyFoot", 1200 / 3937), None),
        ("a.landxml", landxml("millimeter", 0.001, 'desc="A1:{role}"'), None),
        ("a.jxl", jobxml(), None),
        ("a.xml", jobxml(), None),
    ],
)
def test_points_of_every_format_say_the_same(tmp_path, name, text, codes):
    stream, one = read(tmp_path / name, text, codes=codes)
    assert one.code == "A1"
    np.testing.assert_allclose(one.vertices, [row[1:] for row in CORNERS[:3]], atol=1e-9)
    np.testing.assert_allclose(one.points, [CORNERS[3][1:]], atol=1e-9)
    assert one.names == ("104", "101", "102", "103")
    if "xml" not in name or "JOB" in text:
        (station,) = stream.head.stations
        assert station.name == "S1"
        np.testing.assert_allclose(station.position, [12.0, -28.5, 7.9])


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.gsi", gsi(8)[:-30] + "8x..00+00000000", "is not a word of GSI-8"),
        ("a.gsi", gsi(8).replace("81..00", "81..05"), "is not a coordinate in metres or feet"),
        ("a.gsi", "110001+00000101 21.022+00012345\n", "no point has coordinates"),
        ("a.xml", landxml()[:-30], "not whole XML"),
        ("a.xml", landxml().replace('linearUnit="meter"', 'linearUnit="rod"'), "unknown linear unit 'rod'"),
        ("a.xml", landxml().replace("37.965000000 ", ""), "a point of 2 numbers"),
        ("a.xml", landxml().replace("CgPoint ", "Point "), "not whole XML"),
        ("a.xml", "<LandXML/>", "the file has no CgPoint"),
        ("a.jxl", jobxml().replace("6.826", "nan"), "elevation is 'nan'"),
        ("a.jxl", "<JOBFile/>", "the file has no Point with a Grid"),
        ("a.xml", '<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>', "declares entities"),
    ],
)
def test_a_damaged_file_is_refused_with_its_place(tmp_path, name, text, words):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SurveyError) as error:
        list(open_survey(path, format_of(path)).blocks)
    assert words in str(error.value)
    assert str(error.value).startswith(str(path))
    assert error.value.remedy


def geojson(coordinates, shape="Polygon", **properties):
    feature = {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": shape, "coordinates": coordinates},
    }
    return json.dumps({"type": "FeatureCollection", "features": [{"id": 7, **feature}]})


RING = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 0]]


@pytest.mark.parametrize(
    "text",
    [
        geojson([RING], Stein="A1", Steinart="Binder", Tiefe=0.5),
        geojson([[RING]], "MultiPolygon", block="A1", kind="header", depth=0.5),
        geojson(RING, "LineString", name="A1", kind="header", depth="0.5"),
        geojson([RING[:3]], block="A1", kind="header", depth=0.5, course=None),
    ],
)
def test_outlines_of_geojson(tmp_path, text):
    _, one = read(tmp_path / "a.geojson", text)
    assert one.vertices.tolist() == RING[:3]
    assert (one.code, one.kind, one.course, one.depth) == ("A1", "header", None, 0.5)


def test_a_feature_without_a_name_has_its_number(tmp_path):
    _, one = read(tmp_path / "a.geojson", geojson([RING], remark="rissig"), unit=0.01)
    assert (one.code, one.notes, one.vertices[1].tolist()) == ("7", {"remark": "rissig"}, [0.01, 0, 0])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[", ":1: not JSON"),
        ("{}", "not a FeatureCollection"),
        ('{"features": []}', "no features"),
        (geojson([[one[:2] for one in RING]]), ":1: an outline in two dimensions, without z"),
        (geojson([RING, RING]), ":1: an outline of 2 rings"),
        (geojson([0, 0, 0], "Point"), ":1: a feature of type 'Point', not one outline"),
        (geojson(None), ":1: a feature without coordinates"),
        (geojson([[[0, 0, "x"], [1, 0, 0], [1, 0, 1]]]), "not a number"),
        (
            geojson([[[8.7001, 47.4, 400.0], [8.70011, 47.4, 400.0], [8.70011, 47.4, 400.5]]]),
            "look like degrees",
        ),
    ],
)
def test_what_is_not_an_outline_is_refused(tmp_path, text, words):
    path = tmp_path / "a.geojson"
    path.write_text(text)
    with pytest.raises(SurveyError) as error:
        open_survey(path, "geojson")
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("name", "start", "format"),
    [
        ("a.moma", "", "moma"),
        ("a.txt", "moma-survey 1\n", "moma"),
        ("a.CSV", "x", "csv"),
        ("a.ods", "PK", "csv"),
        ("a.GSI", "*11", "gsi"),
        ("a.stl", "solid", "solids"),
        ("a.xml", "<JOBFile>", "jobxml"),
        ("a.xml", "<LandXML>", "landxml"),
    ],
)
def test_the_format_is_told_by_the_ending_and_the_first_line(tmp_path, name, start, format):
    path = tmp_path / name
    path.write_text(start)
    assert format_of(path) == format


@pytest.mark.parametrize("ending", [*WAYS_OUT, ".abc", ""])
def test_other_files_are_named_with_the_way_out(tmp_path, ending):
    path = tmp_path / f"a{ending}"
    path.write_text("x")
    with pytest.raises(UsageError, match="does not tell the format") as error:
        format_of(path)
    assert error.value.remedy == WAYS_OUT.get(ending, error.value.remedy)


def of_features(jxl):
    """Three stones, whose names, kinds and roles are attributes of a feature code."""
    points, records = [], []
    places = ((stone, corner) for stone in ("1-1", "1-2", "2-1") for corner in CORNERS)
    for number, (stone, (role, x, y, z)) in enumerate(places, 1):
        said = zip("abc", (stone, "Binder", "Ecke" if role == "v" else "Fläche"), strict=True)
        coded = f"<Name>{number}</Name><Code>MAUER</Code>"
        if jxl:
            words = [f"<Attribute><Name>{n}</Name><Value>{v}</Value></Attribute>" for n, v in said]
            feature = f"<Features><Feature Name='MAUER'>{''.join(words)}</Feature></Features>"
            grid = f"<Grid><North>{y}</North><East>{x}</East><Elevation>{z}</Elevation></Grid>"
            records.append(f"<PointRecord>{coded}{feature}</PointRecord>")
            points.append(f"<Point>{coded}{grid}</Point>")
        else:
            words = [f'<Property label="{n}" value="{v}"/>' for n, v in said]
            feature = f'<Feature code="MAUER">{"".join(words)}</Feature>'
            points.append(f'<CgPoint name="{number}" code="MAUER">{y} {x} {z}{feature}</CgPoint>')
    if jxl:
        book = f"<FieldBook>{''.join(records)}</FieldBook>"
        return f"<JOBFile>{book}<Reductions>{''.join(points)}</Reductions></JOBFile>"
    return f"<LandXML><CgPoints>{''.join(points)}</CgPoints></LandXML>"


@pytest.mark.parametrize(("name", "jxl"), [("a.jxl", True), ("a.landxml", False)])
def test_attributes_of_a_feature_code_are_read_as_the_message_says(tmp_path, name, jxl):
    path = tmp_path / name
    path.write_text(of_features(jxl), encoding="utf-8")
    with pytest.raises(SurveyError, match="'MAUER 1-1 Binder Ecke' is not of the form") as refused:
        open_survey(path, format_of(path))
    (codes,) = re.findall(r'--codes "([^"]*)"', str(refused.value))
    assert codes == "MAUER {block} {kind} {role}"
    stones = list(open_survey(path, format_of(path), ReadingOptions(codes=codes)).blocks)
    assert [(one.code, one.kind, len(one.vertices), len(one.points)) for one in stones] == [
        (code, "header", 3, 1) for code in ("1-1", "1-2", "2-1")
    ]
    path.write_text(of_features(jxl).replace("MAUER", "1-1:v"), encoding="utf-8")
    (stone,) = open_survey(path, format_of(path)).blocks  # a code that fits has no need of attributes
    assert len(stone.vertices) == 12


@pytest.mark.parametrize("name", ["Bezeichnung", "Etichetta", "ref"])
def test_an_attribute_that_names_the_stones_is_told_as_the_message_says(tmp_path, name):
    ring = [[x, y, z] for _, x, y, z in CORNERS[:3]]
    features = [
        {
            "type": "Feature",
            "properties": {"Zustand": "gut", name: f"S{k}"},
            "geometry": {"type": "Polygon", "coordinates": [[*ring, ring[0]]]},
        }
        for k in (1, 2)
    ]
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    with pytest.raises(SurveyError, match="known to name the stones") as refused:
        open_survey(path, "geojson")
    (columns,) = re.findall(r'--columns "([^"]*)"', str(refused.value))
    assert [one.code for one in open_survey(path, "geojson", ReadingOptions(columns=columns)).blocks] == [
        "S1",
        "S2",
    ]
