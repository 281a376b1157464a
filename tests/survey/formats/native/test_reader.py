from collections.abc import Iterable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ground.errors import SurveyError, UsageError
from survey.formats.native.reader import open_moma, read_head, read_moma, with_header
from survey.formats.options import ReadingOptions
from survey.records.survey import (
    OBSERVER,
    BlockRecord,
    Canon,
    ControlPoint,
    DepthRule,
    Extrusion,
    Photograph,
    PhotoMark,
    Reject,
    Station,
    Survey,
    SurveyHead,
)
from synthetic.formats import write_moma
from tests.paths import ROOT
from tests.survey.formats.survey_files import MOMA

SAMPLE = (ROOT / "data" / "samples" / "window" / "window.moma").read_bytes()
STONE = "stone A header course 2\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nend\n"
HEAD = "moma-survey 1\nsigma 0.003\n"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "a.moma"
    path.write_text(text, encoding="utf-8")
    return path


WHERE = {"line", "spans", "path"}  # where something stands in a file, not what it says


def assert_same(one: Any, other: Any, but: Iterable[str] = WHERE) -> None:
    """Equal to the last bit, all the way down."""
    assert type(one) is type(other), (one, other)
    if is_dataclass(one):
        for field in fields(one):
            if field.name not in but:
                assert_same(getattr(one, field.name), getattr(other, field.name), but)
    elif isinstance(one, tuple):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_same(a, b, but)
    elif isinstance(one, np.ndarray):
        assert one.shape == other.shape
        assert one.tobytes() == other.tobytes()
    else:
        assert one == other


def test_all_that_a_stone_can_say_is_read(tmp_path: Path) -> None:
    text = (
        "# a wall\nmoma-survey 1\nname north wall\nobserver 1 -2e1 +3.5 # tripod\nsigma 0.003\n"
        "depth header 0.5 sigma 0.02 source broken end at W03 # sic\n\n"
        "stone W01-01 header course 1\n\tsigma 0.005\n  depth 0.61 source drilled\n  note mason a cross\n"
        "  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 1 0\n  point .5 .5 0.001\nend\n"
        "stone V1 voussoir\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nend\n"
    )
    survey = read_moma(write(tmp_path, text))
    assert survey.head.name == "north wall"
    assert survey.head.viewpoint(None) is not None
    assert survey.head.viewpoint(None).tolist() == [1.0, -20.0, 3.5]
    (rule,) = survey.head.depth_rules
    assert (rule.kind, rule.depth, rule.sigma, rule.source, rule.line) == (
        *("header", 0.5, 0.02),
        "broken end at W03 # sic",
        6,
    )
    first, second = survey.blocks
    assert (first.code, first.kind, first.course, first.sigma, first.line) == (
        "W01-01",
        "header",
        1,
        0.005,
        8,
    )
    assert (first.depth, first.depth_sigma, first.depth_source) == (0.61, None, "drilled")
    assert first.notes == {"mason": "a cross"}
    assert first.vertices.shape == (3, 3)
    assert first.points.tolist() == [[0.5, 0.5, 0.001]]
    assert (second.course, second.sigma, second.points.shape) == (None, 0.003, (0, 3))


def test_what_is_written_is_read_back_to_the_last_bit(tmp_path: Path, survey: Survey) -> None:
    again = tmp_path / "again.moma"
    write_moma(survey, again)
    assert again.read_bytes() == SAMPLE
    assert_same(read_moma(again), survey, but={"path"})


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "empty"),
        ("stone A header\n", 1, "not a MOMA survey"),
        ("moma-survey 2\n", 1, "moma-survey 1"),
        (HEAD, 3, "no stones"),
        (HEAD + "ston A header\n", 3, "'ston'"),
        (HEAD + "stone A header 3\n", 3, "stone CODE KIND"),
        (HEAD + "stone A 1header\n", 3, "kind"),
        (HEAD + "stone A header course one\n", 3, "course"),
        (HEAD + STONE + STONE, 8, "line 3"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1"), 6, "2 coordinates"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 nan"), 6, "'nan'"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 1_0"), 6, "'1_0'"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 1e999"), 6, "1e999"),
        (HEAD + STONE.replace("vertex 1 1 0", "vertex 1 1 0,5"), 6, "'0,5'"),
        (HEAD + STONE.replace("vertex 1 1 0\n", ""), 6, "2 vertices"),
        (HEAD + STONE.replace("end\n", ""), 7, "no 'end'"),
        (HEAD + STONE.replace("end", "depth 0.5 source x\ndepth 0.4 source y\nend"), 8, "second 'depth'"),
        (HEAD + STONE.replace("end", "depth 0.5\nend"), 7, "source"),
        (HEAD + STONE.replace("end", "depth -0.5 source x\nend"), 7, "greater than 0"),
        (HEAD + "depth header 0.5 source x\ndepth header 0.4 source y\n", 4, "line 3"),
        ("moma-survey 1\n" + STONE, 6, "sigma"),
        (HEAD + STONE + "sigma 0.01\n", 8, "unknown word"),
        (HEAD + "station S 1 2 3\nstation S 1 2 3\n", 4, "line 3"),
        (HEAD + "observer 1 2 3\nstation observer 1 2 3\n", 4, "line 3"),
        (HEAD + 'station "S 2 1 2 3\n', 3, "is not a name"),
        (HEAD + 'station "" 1 2 3\n', 3, "not a name"),
        (HEAD + "sigma 0.001\n", 3, "second 'sigma'"),
        (HEAD + "control C 1 2 3\n", 3, "no place on the site"),
        (HEAD + "control C 1 2 3 site 1 2 3 sigma 0\n", 3, "greater than 0"),
        (HEAD + "control C 1 2 site 1 2 3\n", 3, "2 coordinates"),
        (HEAD + "control C 1 2 3 site 1 2 3\ncontrol C 1 2 3 site 1 2 3\n", 4, "line 3"),
        ("moma-survey 1\ncontrol C 1 2 3 site 1 2 3 sigma 1\n" + STONE, 2, "control point C has no sigma"),
        (HEAD + "photo P\n" + "mark P 1 2 at 1 2 3\n" * 3 + STONE, 3, "3 marks"),
        (HEAD + "mark P 1 2 at 1 2 3\n" + STONE, 3, "no photo P"),
        (HEAD + "photo P station S\n" + "mark P 1 2 at 1 2 3\n" * 4 + STONE, 3, "no station S"),
        (HEAD + "photo P\nmark P 1 2 1 2 3\n", 4, "no place on the wall"),
        (HEAD + "depth * course 2 0.5 source x\n", 3, "every kind"),
        (HEAD + "depth header course 3-2 0.5 source x\n", 3, "courses 3-2"),
        (HEAD + "depth header course 0.5 source x\n", 3, "courses '0.5'"),
        (HEAD + "depth header course 1-3 0.5 source x\ndepth header course 3 0.4 source y\n", 4, "line 3"),
        (HEAD + "depth * 0.5 source x\ndepth * 0.4 source y\n", 4, "line 3"),
        (HEAD + "canon header 0.3 0.3 source x\n", 3, "no sigma"),
        (HEAD + "canon header 0.3 sigma 0.3 source x\n", 3, "height"),
        (HEAD + "canon header 1 1 sigma 1 source x\ncanon header 1 1 sigma 1 source x\n", 4, "line 3"),
        (HEAD + "extrude\n", 3, "has no values"),
        (HEAD + "extrude along 0 0 0\n", 3, "no length"),
        (HEAD + "extrude tail 1.1\n", 3, "larger than the face"),
        (HEAD + "extrude tail 0.9 along 0 0 1\n", 3, "unexpected 'along'"),
        (HEAD + STONE.replace("course 2", "zone x course 2"), 3, "unexpected 'course'"),
        (HEAD + STONE.replace("end", "station S\nend"), 7, "no station S"),
        (HEAD + STONE.replace("end", "photo P\nend"), 7, "no photo P"),
        (HEAD + STONE.replace("end", "pixel 1 2\nend"), 8, "pixels, but no photo"),
        (HEAD + STONE.replace("end", "tail 0.8\nend"), 7, "unknown word 'tail'"),
        (HEAD + STONE.replace("1 1 0", "1 1 0 0"), 6, "unexpected '0'"),
        (HEAD + STONE.replace("1 1 0", "1 1 0 sigma"), 6, "sigma is missing"),
        (HEAD + STONE.replace("1 1 0", "1 1 0 sigma 0.1 0.1"), 6, "unexpected '0.1'"),
        (HEAD + STONE.replace("end\n", STONE), 7, "no 'end'"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, text: str, line: int, words: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_moma(write(tmp_path, text))
    assert f"a.moma:{line}: " in str(error.value)
    assert words in str(error.value)
    assert error.value.remedy
    assert "\n" not in str(error.value)


def test_a_missing_file_and_other_encodings_are_named(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"none\.moma: cannot be read"):
        read_moma(tmp_path / "none.moma")
    with pytest.raises(SurveyError, match="cannot be read"):
        read_moma(tmp_path)
    path = tmp_path / "wide.moma"
    path.write_text(HEAD + STONE, encoding="utf-16")
    assert len(read_moma(path).blocks) == 1
    path.write_text(HEAD + STONE, encoding="utf-32")
    with pytest.raises(SurveyError, match=r"wide\.moma:1: the text is UTF-32"):
        read_moma(path)


def test_a_note_of_two_lines_cannot_be_written(tmp_path: Path, survey: Survey) -> None:
    two = replace(survey, head=replace(survey.head, name="north\nsigma 9"))
    with pytest.raises(SurveyError, match=r"cannot be written"):
        write_moma(two, tmp_path / "two.moma")
    assert not (tmp_path / "two.moma").exists()


def test_all_that_a_head_can_say_is_read(tmp_path: Path) -> None:
    survey = read_moma(write(tmp_path, MOMA))
    head = survey.head
    assert [(one.name, one.position.tolist(), one.line) for one in head.stations] == [
        (OBSERVER, [14.2908, 29.4147, 8.0771], 3),
        ("S 2", [1.0, 2.0, 3.0], 4),
    ]
    (point,) = head.control
    assert (point.name, point.measured.tolist(), point.measured_sigma) == ("C1", [0.0, 0.0, 0.0], 0.002)
    assert (point.site.tolist(), point.site_sigma, point.line) == ([1000.0, 2000.0, 50.0], 0.003, 6)
    (photo,) = head.photographs
    assert (photo.name, photo.sigma, photo.station, photo.line) == ("P1", 0.8, OBSERVER, 7)
    assert [one.image.tolist() for one in photo.marks] == [[10, 10], [90, 10], [90, 90], [10, 90]]
    assert [(one.sigma, one.line) for one in photo.marks] == [
        (0.003, 8),
        (0.001, 9),
        (0.003, 10),
        (0.003, 11),
    ]
    assert photo.marks[2].position.tolist() == [1.0, 0.0, 1.0]
    assert [(one.kind, one.courses, one.zone, one.depth, one.sigma) for one in head.depth_rules] == [
        ("header", (1, 3), "north", 0.51, 0.02),
        ("header", None, None, 0.5, 0.03),
        (None, None, None, 0.4, None),
    ]
    assert head.canons == (Canon("header", 0.31, 0.31, 0.01, "roman foot", 15),)
    assert head.extrusion.direction is not None
    assert (head.extrusion.direction.tolist(), head.extrusion.tail) == ([0.0, 1.0, 0.0], 0.9)


def test_all_that_stones_can_say_of_themselves_is_read(tmp_path: Path) -> None:
    first, second, third = read_moma(write(tmp_path, MOMA)).blocks
    assert (first.zone, first.station, first.extrusion) == ("north wall", "S 2", Extrusion(None, 0.8))
    assert first.sigmas is not None
    assert first.sigmas.tolist() == [0.004, 0.002, 0.004, 0.004]  # the point, then the corners
    assert first.sigma == pytest.approx(np.sqrt((3 * 0.004**2 + 0.002**2) / 4), rel=1e-15)
    assert (second.photograph, second.vertices.shape, second.points.shape) == ("P1", (0, 3), (0, 3))
    assert second.image.tolist() == [[20, 20], [40, 20.5], [40, 60]]
    assert (third.sigma, third.sigmas, third.zone, third.station, third.extrusion) == (0.003, *[None] * 4)
    lines = ["", *MOMA.split("\n")]
    for one in (first, second, third):
        (span,) = one.spans
        assert (lines[span[0]].split()[:2], lines[span[-1]]) == (["stone", one.code], "end")


def test_a_wrong_stone_is_left_out_and_the_others_are_read(tmp_path: Path) -> None:
    def stone(code: str, more: str = "") -> str:
        return STONE.replace("stone A", f"stone {code}").replace("end\n", more + "end\n")

    text = (
        HEAD  # lines 1 and 2
        + stone("A")  # 3 to 7
        + stone("B", "vertex 1 2\n")  # 8 to 13
        + stone("C").replace("end\n", "")  # 14 to 17
        + stone("D")  # 18 to 22
        + "lost words\nvertex 0 0 0\n"  # 23, 24
        + stone("A")  # 25 to 29
        + stone("E!")  # 30 to 34
        + stone("F")  # 35 to 39
        + stone("G", "station S\n").replace("end\n", "")  # 40 to 44
    )
    stream = open_moma(write(tmp_path, text))
    found = list(stream.blocks)
    assert [one.code for one in found if isinstance(one, BlockRecord)] == ["A", "D", "F"]
    rejects = [one for one in found if isinstance(one, Reject)]
    assert [(one.code, str(one.error.where).rpartition(":")[2], one.spans) for one in rejects] == [
        ("B", "12", (range(8, 14),)),
        ("C", "18", (range(14, 18),)),
        (None, "23", (range(23, 25),)),
        ("A", "25", (range(25, 30),)),
        (None, "30", (range(30, 35),)),
        ("G", "44", (range(40, 46),)),
    ]
    assert [one.code for one in found][:3] == ["A", "B", "C"]  # in the order of the file


def test_stones_come_while_the_file_is_read(tmp_path: Path) -> None:
    """The second stone's text is not needed for the first: a file that ends in it is refused only then."""
    stream = open_moma(write(tmp_path, HEAD + STONE + "stone B header\n"))
    assert next(stream.blocks).code == "A"
    assert isinstance(next(stream.blocks), Reject)


def test_a_header_file_has_no_stones(tmp_path: Path) -> None:
    path = tmp_path / "head.moma"
    path.write_text(MOMA[: MOMA.index("stone")], encoding="utf-8")
    survey = read_moma(write(tmp_path, MOMA))
    assert_same(read_head(path), survey.head, but={"path"})
    path.write_text("moma-survey 1\nsigma 0.007\n", encoding="utf-8")
    assert read_head(path).name == ""
    assert with_header(ReadingOptions(), path).sigma == 0.007
    path.write_text("moma-survey 1\n", encoding="utf-8")
    assert with_header(ReadingOptions(sigma=0.002), path).sigma == 0.002
    with pytest.raises(SurveyError, match=r"a\.moma:18: a stone in a header file"):
        read_head(tmp_path / "a.moma")
    with pytest.raises(UsageError, match="a head of its own"):
        open_moma(tmp_path / "a.moma", ReadingOptions(head=read_head(path)))


NAMES = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.+/:-]{0,12}", fullmatch=True) | st.sampled_from(
    ["north wall", "tour Ségur", "#1", "a  b", "end", "sigma", "Ω-7"]
)
TEXTS = st.sampled_from(["archive of 1912 # sic", "end", '"quoted"', "tiefe: 0,5 m", "Ω", "a  b", "# x"])
KINDS = st.sampled_from(["header", "stretcher", "voussoir", "key-stone_2"])
NUMBERS = st.floats(-1e8, 1e8, allow_nan=False)
LENGTHS = st.floats(1e-300, 1e8, allow_nan=False)
SIGMAS = st.sampled_from([0.003, 0.00173]) | LENGTHS


def places(columns: int, least: int = 0, most: int = 4) -> st.SearchStrategy[Any]:
    rows = st.lists(st.lists(NUMBERS, min_size=columns, max_size=columns), min_size=least, max_size=most)
    return rows.map(lambda one: np.array(one, dtype=float).reshape(-1, columns))


PLACE = places(3, 1, 1).map(lambda one: one[0])
IMAGE = places(2, 1, 1).map(lambda one: one[0])
EXTRUSIONS = st.builds(
    Extrusion,
    st.none() | PLACE.filter(lambda one: one.any()),
    st.just(1.0) | st.floats(0.0, 1.0, exclude_min=True),
)


@st.composite
def heads(draw: st.DrawFn) -> SurveyHead:
    stations = draw(st.lists(NAMES | st.just(OBSERVER), unique=True, max_size=3))
    known = st.none() | st.sampled_from(stations) if stations else st.none()
    marks = st.lists(st.builds(PhotoMark, IMAGE, PLACE, SIGMAS), min_size=4, max_size=5).map(tuple)
    rules = draw(
        st.lists(
            st.tuples(KINDS, st.none() | NAMES, st.none() | st.integers(0, 99)),
            unique=True,
            max_size=4,
        )
    )
    width = 0 if len({(kind, zone) for kind, zone, _ in rules}) < len(rules) else 7
    return SurveyHead(
        name=draw(TEXTS),
        path="",
        stations=tuple(Station(name, draw(PLACE)) for name in stations),
        control=tuple(
            ControlPoint(name, draw(PLACE), draw(SIGMAS), draw(PLACE), draw(SIGMAS))
            for name in draw(st.lists(NAMES, unique=True, max_size=3))
        ),
        photographs=tuple(
            Photograph(name, draw(SIGMAS), draw(marks), draw(known))
            for name in draw(st.lists(NAMES, unique=True, max_size=2))
        ),
        depth_rules=tuple(
            DepthRule(
                *(kind, draw(LENGTHS), draw(st.none() | SIGMAS), draw(TEXTS)),
                courses=None if course is None else (course, course + width),
                zone=zone,
            )
            for kind, zone, course in rules
        )
        + draw(st.sampled_from([(), (DepthRule(None, 0.4, None, "guess"),)])),
        canons=tuple(
            Canon(kind, draw(LENGTHS), draw(LENGTHS), draw(SIGMAS), draw(TEXTS))
            for kind in draw(st.lists(KINDS, unique=True, max_size=2))
        ),
        extrusion=draw(EXTRUSIONS),
    )


@st.composite
def surveys(draw: st.DrawFn) -> Survey:
    head = draw(heads())
    codes = draw(
        st.lists(st.from_regex(r"[^\W_][\w.+/:-]{0,9}", fullmatch=True), unique=True, min_size=1, max_size=4)
    )
    return Survey(head, tuple(draw(blocks(code, head)) for code in codes))


@st.composite
def blocks(draw: st.DrawFn, code: str, head: SurveyHead) -> BlockRecord:
    photograph = draw(st.sampled_from([None, *(one.name for one in head.photographs)]))
    points = draw(places(3))
    vertices = draw(places(3, 3)) if photograph is None else np.empty((0, 3))
    sigma, sigmas, count = draw(SIGMAS), None, len(points) + len(vertices)
    if count and draw(st.booleans()):
        sigmas = np.array(draw(st.lists(SIGMAS, min_size=count, max_size=count)))
        sigma = float(np.sqrt(float(sigmas @ sigmas) / count))
    depth = draw(st.none() | LENGTHS)
    return BlockRecord(
        code=code,
        kind=draw(KINDS),
        course=draw(st.none() | st.integers(0, 999999)),
        vertices=vertices,
        points=points,
        sigma=sigma,
        depth=depth,
        depth_sigma=None if depth is None else draw(st.none() | SIGMAS),
        depth_source=None if depth is None else draw(TEXTS),
        notes=draw(st.dictionaries(st.sampled_from(["edge", "#", '"a', "Ω"]), TEXTS, max_size=2)),
        zone=draw(st.none() | NAMES),
        station=draw(st.sampled_from([None, *(one.name for one in head.stations)])),
        photograph=photograph,
        image=draw(places(2, 3)) if photograph is not None else np.empty((0, 2)),
        sigmas=sigmas,
        extrusion=draw(st.none() | EXTRUSIONS),
    )


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(surveys())
def test_whatever_is_written_is_read_back_to_the_last_bit(tmp_path: Path, survey: Survey) -> None:
    path = tmp_path / "w.moma"
    write_moma(survey, path)
    again = read_moma(path)
    assert_same(again, survey)
    text = path.read_bytes()
    write_moma(again, path)
    assert path.read_bytes() == text


@pytest.mark.parametrize(
    "head",
    [
        SurveyHead("a\nb", ""),
        SurveyHead(" a", ""),
        SurveyHead("a", "", (Station('"', np.zeros(3)),)),
        SurveyHead("a", "", (Station("x" * 65, np.zeros(3)),)),
        SurveyHead("a", "", (Station("S", np.array([0.0, 0.0, np.nan])),)),
        SurveyHead("a", "", depth_rules=(DepthRule("header", 0.5, None, ""),)),
    ],
)
def test_what_cannot_be_read_back_is_not_written(tmp_path: Path, survey: Survey, head: SurveyHead) -> None:
    path = tmp_path / "w.moma"
    with pytest.raises(SurveyError, match="cannot be written"):
        write_moma(replace(survey, head=head), path)
    with pytest.raises(SurveyError, match="no stones"):
        write_moma(replace(survey, blocks=()), path)
    assert not path.exists()


def test_the_short_way_of_reading_coordinates_reads_what_the_long_one_does(tmp_path: Path) -> None:
    """Lines of vertices and points are matched as a whole; a comment at their end asks for the long way."""
    words = ["0", "-0", "+1", ".5", "5.", "1e3", "1E-3", "1e-400", "100000000", "1e8", "1.0000001e8", "1e999"]
    words += [
        *("e5", "--1", "1e", "1_0", "nan", "1,5", "0x1", "1e5.0", ".", "-", "١", "1e+", "1e05"),
        "00012.50",
    ]
    for word in words:
        both = []
        for end in ("", " # long"):
            text = HEAD + STONE.replace("end", f"point {word} 1 2{end}\nend")
            try:
                both.append(read_moma(write(tmp_path, text)).blocks[0].points.tolist())
            except SurveyError as error:
                both.append(str(error))
        assert both[0] == both[1], word


def test_kinds_are_words_of_five_languages(tmp_path):
    path = tmp_path / "a.moma"
    path.write_text(
        "moma-survey 1\nsigma 0.003\ndepth Binder 0.5 source seen\ncanon Läufer 0.6 0.3 sigma 0.03 source seen\n"
        "stone W1 Schlussstein\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 0 1\nend\n",
        encoding="utf-8",
    )
    survey = read_moma(path)
    assert [rule.kind for rule in survey.head.depth_rules] == ["header"]
    assert [canon.kind for canon in survey.head.canons] == ["stretcher"]
    assert survey.blocks[0].kind == "keystone"
