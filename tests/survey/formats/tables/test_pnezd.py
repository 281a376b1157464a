import random
import re
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from ground.errors import SurveyError, UsageError
from survey.formats.options import ReadingOptions
from survey.formats.reading import read_survey
from survey.formats.tables.code_template import CodeFields, CodeTemplate
from survey.formats.tables.reader import open_penzd, open_pnezd
from survey.records.survey import BlockRecord, Reject, Station, SurveyHead
from tests.survey.formats.survey_files import PNEZD

NUMBERED = "{zone}.{course}.{number}.{kind}.{role}"
ROWS = "1,5000.5,1000.25,10.125,A:v\n2,5000.5,1001.25,10.125,A:v\n3,5000.5,1001.25,11.125,A:v\n4,5000.5,1001,10.5,A:p\n"


def write(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "wall.txt"
    path.write_bytes(text.encode(encoding))
    return path


def test_northing_is_y_and_easting_is_x(tmp_path: Path) -> None:
    stream = open_pnezd(write(tmp_path, PNEZD))
    first, second = stream.blocks
    assert isinstance(first, BlockRecord)
    assert isinstance(second, BlockRecord)
    assert first.vertices.tolist() == [
        [1000.5, 5000.123, 10.25],
        [1001.5, 5000.124, 10.25],
        [1001.5, 5000.122, 11.25],
    ]
    assert first.points.tolist() == [[1001.0, 5000.121, 10.75]]
    assert first.names == ("4", "1", "2", "3")  # of points, then of corners
    assert (first.kind, first.course, first.sigma, first.sigmas) == ("ashlar", None, 0.003, None)
    assert (first.spans, second.spans, second.line) == ((range(2, 6),), (range(7, 10),), 7)
    (station,) = stream.head.stations
    assert (station.name, station.position.tolist(), station.line) == ("S1", [1000.0, 4990.0, 10.0], 6)
    assert stream.head.name == "wall"


def test_penzd_is_pnezd_with_the_easting_first(tmp_path: Path) -> None:
    swapped = "\n".join(
        ",".join([p, e, n, z, d]) for p, n, e, z, d in (row.split(",") for row in ROWS.splitlines())
    )
    (one,) = open_pnezd(write(tmp_path, ROWS)).blocks
    (other,) = open_penzd(write(tmp_path, swapped)).blocks
    assert isinstance(one, BlockRecord)
    assert isinstance(other, BlockRecord)
    assert one.vertices.tolist() == other.vertices.tolist()


@pytest.mark.parametrize(
    ("separator", "mark"), [*product([",", " , "], "."), *product([";", "\t", "   ", " ;"], ".,")]
)
@pytest.mark.parametrize("header", ["", "Pkt{}Hoch{}Rechts{}Höhe{}Code\n", "# 12 {} {} {}{} points\n"])
def test_lists_of_all_instruments_say_the_same(
    tmp_path: Path, separator: str, mark: str, header: str
) -> None:
    body = "".join(
        separator.join(field.replace(".", mark) for field in row.split(",")) + "\r\n"
        for row in ROWS.splitlines()
    )
    text = header.format(*[separator] * 4) + body
    (block,) = open_pnezd(write(tmp_path, text, "latin-1")).blocks
    assert isinstance(block, BlockRecord)
    assert block.vertices.tolist() == [
        [1000.25, 5000.5, 10.125],
        [1001.25, 5000.5, 10.125],
        [1001.25, 5000.5, 11.125],
    ]
    assert block.points.tolist() == [[1001.0, 5000.5, 10.5]]


def test_a_description_may_hold_separators_and_say_more(tmp_path: Path) -> None:
    rows = ROWS.replace(",A:v", ",A, header, 12, V").replace(",A:p", ",A,  HEADER, 12, point")
    options = ReadingOptions(codes="{block}, {kind}, {course}, {role}", sigma=0.002)
    (block,) = open_pnezd(write(tmp_path, rows), options).blocks
    assert isinstance(block, BlockRecord)
    assert (block.code, block.kind, block.course, block.sigma) == ("A", "header", 12, 0.002)
    assert (block.vertices.shape, block.points.shape) == ((3, 3), (1, 3))


@pytest.mark.parametrize(
    ("template", "description", "fields"),
    [
        ("{block}:{role}", "W01-01:v", CodeFields("W01-01", None, None, None, "vertex")),
        ("{block}:{role}", "W01:01:P", CodeFields("W01:01", None, None, None, "point")),
        ("{block}:{role}", "W01-01:x", None),
        ("{block}:{role}", "W01-01", None),
        ("{block}:{role}", "W 01:v", CodeFields("W 01", None, None, None, "vertex")),
        ("{block}:{role}", "N° 5 (neu):p", CodeFields("N° 5 (neu)", None, None, None, "point")),
        ("{block} {role}", "W 01 v", None),
        ("{block} {kind} {course?} {role}", "A header 3 v", CodeFields("A", "header", 3, None, "vertex")),
        ("{block} {kind} {course?} {role}", "A header p", CodeFields("A", "header", None, None, "point")),
        ("{block} {kind?} {role?}", "A v", CodeFields("A", None, None, None, "vertex")),
        ("{block} {kind?} {role?}", "A jamb", CodeFields("A", "jamb", None, None, "vertex")),
        ("{block}:{role} {*}", "A:p seen twice", CodeFields("A", None, None, None, "point")),
        ("{*} {block} {role}", "MW A BEG", CodeFields("A", None, None, None, "vertex")),
        ("{block} {role}", "A END", CodeFields("A", None, None, None, "vertex")),
        ("{block} {kind} {role}", "A Läufer v", CodeFields("A", "läufer", None, None, "vertex")),
        ("{block}", "W01-01", CodeFields("W01-01", None, None, None, "vertex")),
        ("{block}-{course}", "W01-01-12", CodeFields("W01-01", None, 12, None, "vertex")),
        (
            "{block} {kind} {course} {role}",
            "A  Header\t3 station",
            CodeFields("A", "header", 3, None, "station"),
        ),
        ("{block} {kind} {course} {role}", "A header three v", None),
        ("MW_{zone} {block}.{role}", "MW_N-1 A.1.s", CodeFields("A.1", None, None, "N-1", "station")),
        ("MW_{zone} {block}.{role}", "XW_N-1 A.1.s", None),
        ("{role}.{block}", "v.A", CodeFields("A", None, None, None, "vertex")),
        ("[{course}]{block}*", "[3]A*", CodeFields("A", None, 3, None, "vertex")),
        (NUMBERED, "NW.07.03.L.E", CodeFields("NW.07.03", "l", 7, "NW", "vertex")),
        (NUMBERED, "NW.B.06.S.F", CodeFields("NW.B.06", "s", None, "NW", "point")),
        (NUMBERED, "NW.07.L.E", None),
        (NUMBERED.replace(".", "-"), "NW-07-12a-L-E", CodeFields("NW-07-12a", "l", 7, "NW", "vertex")),
        ("{course}_{number}_{kind}_{role}", "07_03_L_E", CodeFields("07_03", "l", 7, None, "vertex")),
        ("{number} {role}", "12 v", CodeFields("12", None, None, None, "vertex")),
        ("{block}{role}", "05-04E", CodeFields("05-04", None, None, None, "vertex")),
        ("{course}-{number}{role}", "5-4F", CodeFields("5-4", None, 5, None, "point")),
        ("{block}{role}", "B4a", None),
        ("{block}{kind} {role?}", "0712L", CodeFields("0712", "l", None, None, "vertex")),
        ("{block}{kind} {role?}", "B02K Fl", CodeFields("B02", "k", None, None, "point")),
        ("{course:2}{number:2}{kind} {role?}", "0712L Fl", CodeFields("0712", "l", 7, None, "point")),
        ("{course:2}{number:2}{kind} {role?}", "B02K", CodeFields("B02", "k", None, None, "vertex")),
        ("{course:2}{number:2}{kind}", "712L", None),
        (
            "{zone:2}{course:2}{number:2}{kind:1}{role}",
            "NW0712LE",
            CodeFields("NW0712", "l", 7, "NW", "vertex"),
        ),
        ("{block:6}{role}", "NW071aF", CodeFields("NW071a", None, None, None, "point")),
    ],
)
def test_a_template_takes_a_description_apart(
    template: str, description: str, fields: CodeFields | None
) -> None:
    assert CodeTemplate(template).parse(description) == fields


@pytest.mark.parametrize(
    ("template", "words"),
    [
        ("{kind}:{role}", "no {block}"),
        ("", "no {block}"),
        ("{zone}{kind} {block}", "two ways"),
        ("{block} {role:1}", "a role a width"),
        ("{block}{kind}{role}", "two ways"),
        ("{role}{block}", "two ways"),
        ("{block}-{kind}", "two ways"),
        ("{block}-{course}-{zone}", "two ways"),
        ("{block}/{zone}", "two ways"),
        ("{block}:{block}", "twice"),
        ("{block}.{number}:{role}", "{block} beside {number}"),
        ("{course}{number}:{role}", "two ways"),
        ("{stone}:{role}", "field 'stone'"),
        ("{block:{role}", "brace"),
        ("{block}}:{role}", "brace"),
        ("{}{block}", "field ''"),
    ],
)
def test_a_template_that_says_too_little_or_two_things_is_refused(template: str, words: str) -> None:
    with pytest.raises(UsageError) as error:
        CodeTemplate(template)
    assert words in str(error.value)
    assert error.value.remedy


VALUES = {  # of fields, made of what separates fields too
    "block": ["a", "1", "a-1", "a:1", "v/1", "x_1", "a--x", "1-", "ax"],
    "zone": ["n", "n-1", "n:1", "1/x", "x_", "x"],
    "kind": ["k", "k-1", "x_k", "kx", "x"],
    "course": ["1", "12"],
    "role": ["v", "p", "s"],
}
FORMS = {  # as the documentation has them
    "block": r"[A-Za-z0-9][A-Za-z0-9_.+/:-]*",
    "zone": r"[A-Za-z0-9][A-Za-z0-9_.+/:-]*",
    "kind": r"[a-z][a-z0-9_-]*",
    "course": r"\d+",
    "role": r"vertex|v|point|p|station|s",
}


def test_what_a_template_accepts_has_one_reading() -> None:
    """Against every way to cut a description, for random templates and descriptions that fit them."""
    rng = random.Random(5)
    accepted, refused = 0, 0
    for _ in range(4000):
        names = rng.sample(list(VALUES), rng.randrange(2, 5))
        literals = [rng.choice(["-", ":", " ", "/", "#", "--", "x", "_", "-:", ""]) for _ in names[1:]]
        description = rng.choice(VALUES[names[0]])
        for name, literal in zip(names[1:], literals, strict=True):
            description += literal + rng.choice(VALUES[name])
        found = readings(names, literals, description)
        try:
            template = CodeTemplate(joined([f"{{{name}}}" for name in names], literals))
        except UsageError:
            refused += 1
            continue
        fields = template.parse(description)
        if not found:  # what follows a name at once is letters after a digit
            assert fields is None
            continue
        assert fields is not None
        (only,) = found
        assert fields.block == only["block"]
        assert fields.zone == only.get("zone")
        accepted += 1
    assert accepted > 500
    assert refused > 500


def joined(fields: list[str], literals: list[str]) -> str:
    return "".join(field + literal for field, literal in zip(fields, [*literals, ""], strict=True))


def readings(names: list[str], literals: list[str], text: str) -> list[dict[str, str]]:
    """All ways to cut a text, by trying every length of every field."""
    out = []
    for length in range(1, len(text) + 1):
        value, rest = text[:length], text[length:]
        if re.fullmatch(FORMS[names[0]], value) is None:
            continue
        if len(names) == 1:
            out += [{names[0]: value}] if not rest else []
        elif rest.startswith(literals[0]):
            for more in readings(names[1:], literals[1:], rest[len(literals[0]) :]):
                at_once = not literals[0] and names[1] in ("role", "kind")
                if not at_once or (value[-1].isdigit() and more[names[1]].isalpha()):
                    out.append({names[0]: value, **more})
    return out


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "no points"),
        ("Point,N,E,Z,D\n", 2, "no points"),
        ("1,2,3\n", 1, "not a point with two coordinates"),
        ("# x\n1;2;x;4;A:v\n", 2, "not a point with two coordinates"),
        (ROWS + "5,1,2\n", 5, "3 fields"),
        (ROWS + "5,1,2,3,A\n", 5, "'A' is not of the form {block}:{role}"),
        (ROWS + "5,1,2,3,A:blob\n", 5, "'A:blob' is not of the form"),
        (ROWS + "4,1,2,3,A:p\n", 5, "point 4 a second time"),
        (ROWS + ",1,2,3,A:p\n", 5, "not a number or name"),
        (ROWS + "5,1,nan,3,A:p\n", 5, "'nan'"),
        (ROWS + "5,1,2e9,3,A:p\n", 5, "beyond"),
        (ROWS + "5,1,2,3,B:v\n", 5, "1 vertices"),
        (ROWS + "5,1,2,3,S:s\n6,1,2,4,S:s\n", 6, "station S a second time"),
        (ROWS.replace(",", ";") + "5;1,5;2;3;A:p\n", 5, "line 1 writes decimals with '.'"),
        (ROWS.replace(",", ";") + "5;1.234,5;2;3;A:p\n", 5, "a comma and a point"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, text: str, line: int, words: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_survey(write(tmp_path, text), "pnezd")
    assert f"wall.txt:{line}: " in str(error.value)
    assert words in str(error.value)
    assert error.value.remedy


@pytest.mark.parametrize("count", [2, 3])
def test_a_station_that_is_listed_at_every_setup_is_one(tmp_path: Path, count: int) -> None:
    more = "".join(f"{k + 5},1,2,3,S:s\n" for k in range(count))
    stream = open_pnezd(write(tmp_path, ROWS + more))
    assert [one.name for one in stream.head.stations] == ["S"]


def test_a_wrong_line_spoils_its_stone_and_no_other(tmp_path: Path) -> None:
    text = (
        ROWS + "5,1,2,3,remark\n" + ROWS.replace("A:", "B:").replace(",1001,", ",1O01,").replace("\n", "\n1")
    )
    found = list(open_pnezd(write(tmp_path, text.removesuffix("1"))).blocks)
    assert [(type(one), one.code) for one in found] == [(BlockRecord, "A"), (Reject, None), (Reject, "B")]
    assert found[1].spans == (range(5, 6),)


@pytest.mark.parametrize("wrong", ["5,1,2,A, 7:p", "5,A, 7:p", "5,1,2,3,4,A, 7:p"])
def test_a_line_with_a_field_too_many_or_too_few_spoils_the_stone_that_it_names(
    tmp_path: Path, wrong: str
) -> None:
    rows = ROWS.replace(",A:", ",A, 7:")
    (one,) = open_pnezd(
        write(tmp_path, rows + wrong), ReadingOptions(codes="{block}, {course}:{role}")
    ).blocks
    assert isinstance(one, Reject)
    assert one.spans == (range(1, 6),)


def test_kind_course_and_zone_are_the_same_for_all_points_of_a_stone(tmp_path: Path) -> None:
    options = ReadingOptions(codes="{block} {course}:{role}")
    rows = ROWS.replace("A:", "A 1:").replace("A 1:p", "A 2:p")
    (found,) = open_pnezd(write(tmp_path, rows), options).blocks
    assert isinstance(found, Reject)
    assert "differs from line 1" in str(found.error)


def test_stations_of_the_list_join_those_of_the_head(tmp_path: Path) -> None:
    head = SurveyHead("", "", (Station("S", np.zeros(3)),))
    stream = open_pnezd(write(tmp_path, ROWS + "5,1,2,3,T:s\n"), ReadingOptions(head=head))
    assert [one.name for one in stream.head.stations] == ["S", "T"]
    found = list(open_pnezd(write(tmp_path, ROWS + "5,1,2,3,S:s\n"), ReadingOptions(head=head)).blocks)
    assert isinstance(found[-1], Reject)


def listed(*descriptions: str) -> str:
    """A list of points on a face, a metre square and wider with every point, with these descriptions."""
    places = ((0, 0), (0, 1), (1, 1), (1, 0))
    return "".join(
        f"{k + 1},{100 + places[k % 4][0] + k // 4},20.0,{places[k % 4][1]},{text}\n"
        for k, text in enumerate(descriptions)
    )


@pytest.mark.parametrize(
    "codes",
    [
        ["NW.07.03.L.E"] * 4 + ["NW.07.04.B.E"] * 3 + ["NW.B.01.V.E"] * 3,
        ["NW-07-03-L-E"] * 4 + ["NW-07-04-B-F"],
        ["07_03_L_E"] * 4 + ["07_04_L_E"] * 4,
        ["W01"] * 4 + ["W02"] * 4,
        ["W01.v"] * 4 + ["W02.p"],
    ],
)
def test_the_template_that_is_advised_makes_stones_of_the_list(tmp_path: Path, codes: list[str]) -> None:
    path = write(tmp_path, listed("FP", "STP", *codes))
    with pytest.raises(SurveyError) as error:
        open_penzd(path)
    advised = re.search('--codes "(.*)"', str(error.value.remedy))
    assert advised is not None
    stones = open_penzd(path, ReadingOptions(codes=advised[1])).blocks
    whole = [one for one in stones if isinstance(one, BlockRecord)]
    assert sum(len(one.vertices) + len(one.points) for one in whole) >= 4


def test_no_template_is_advised_that_makes_a_stone_of_every_point(tmp_path: Path) -> None:
    with pytest.raises(SurveyError) as error:
        open_penzd(write(tmp_path, listed("a1", "a2", "a3", "a4", "a5")))
    assert '--codes "' not in str(error.value.remedy)


def test_points_that_are_only_stations_or_control_belong_to_no_stone(tmp_path: Path) -> None:
    text = listed("FP", "FP", "STP", "Standpunkt", *["A:v"] * 4)
    stream = open_penzd(write(tmp_path, text))
    assert [one.name for one in stream.head.stations] == ["3", "4"]
    assert stream.remarks[0] == "control points belong to no stone and are left out: 2 FP"
    assert [one.code for one in stream.blocks] == ["A"]


def test_kinds_of_one_letter_are_not_guessed(tmp_path: Path) -> None:
    options = ReadingOptions(
        codes="{block} {kind}", known_kinds=frozenset(["ashlar", "base", "header", "springer"])
    )
    with pytest.raises(SurveyError) as error:
        open_penzd(write(tmp_path, listed(*["A B"] * 4, *["C SPR"] * 4)), options)
    assert '--kinds "b=ashlar,spr=springer"' in str(error.value.remedy)


@pytest.mark.parametrize(
    ("codes", "template"),
    [
        (["W1:S"] * 4 + ["W1:F"] * 2 + ["W2:S"] * 4, "{block}:{role}"),
        (["N-01-02-B-F"] * 2 + ["N-01-02-B-S"] * 4, NUMBERED.replace(".", "-")),
    ],
)
def test_a_role_s_at_three_places_is_a_corner(tmp_path: Path, codes: list[str], template: str) -> None:
    stream = open_penzd(write(tmp_path, listed("ST", *codes)), ReadingOptions(codes=template))
    stones = list(stream.blocks)
    assert [type(one) for one in stones] == [BlockRecord] * len({code[:-2] for code in codes})
    assert all(len(one.vertices) == 4 for one in stones if isinstance(one, BlockRecord))
    assert [one.name for one in stream.head.stations] == ["1"]
    assert any("sommet" in remark for remark in stream.remarks)


def test_a_station_beside_corners_of_another_role_is_none(tmp_path: Path) -> None:
    (one, *wrong) = open_pnezd(write(tmp_path, ROWS + "5,1,2,3,S:s\n6,1,2,4,S:s\n7,1,2,5,S:s\n")).blocks
    assert isinstance(one, BlockRecord)
    assert [
        "station S a second time" in str(reject.error) for reject in wrong if isinstance(reject, Reject)
    ] == [True] * 2


def test_a_table_without_names_of_columns_is_a_list(tmp_path: Path) -> None:
    from survey.formats.tables.reader import open_csv

    with pytest.raises(SurveyError, match="no names of columns") as error:
        open_csv(write(tmp_path, ROWS))
    assert "--format pnezd" in str(error.value.remedy)
