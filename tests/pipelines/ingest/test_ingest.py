"""Survey files into the database: every format, nothing by halves, nothing of the user's lost."""

import json
import logging
import math

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.query.api import find
from archmodel.store.stones import load_stones
from ground.errors import DatabaseError, GeometryError, SurveyError, UsageError
from pipelines.ingest.ingest import ingest
from pipelines.ingest.reading_options import reading_options
from tests.moma.commands import invoke, prints

HEAD = """\
moma-survey 1
# bay 3, north wall
name wall
observer 12 -20 1
sigma 0.003
depth header course 1-3 0.45 sigma 0.02 source broken end
depth * 0.4 source thickness of the wall
"""
CONTROL = """\
control C1 10 0 0 site 652010 6862000 40
control C2 16 0 0 site 652016 6862000 40
control C3 10 0 3 site 652010 6862000 43
control C4 12 1 1 site 652012 6862001 41
"""


def corners(k):
    """Return the corners of stone k of a wall in the plane y = 0, counter-clockwise for an observer in front of it."""
    x = 10.0 + 0.7 * k
    return [(x, 0.0, 0.5), (x + 0.6, 0.0, 0.5), (x + 0.6, 0.0, 0.8), (x, 0.0, 0.8)]


def moma(k, kind="header", words=" course 1", change=lambda row: row):
    rows = [change(f"  vertex {x:.3f} {y:.3f} {z:.3f}") for x, y, z in corners(k)]
    return "\n".join([f"stone W{k} {kind}{words}", *rows, "end"]) + "\n"


def csv(k, kind="header", depth="0.45"):
    return "".join(f"W{k},{kind},1,v,{x:.3f},{y:.3f},{z:.3f},{depth}\n" for x, y, z in corners(k))


def pnezd(k, kind="HEADER"):
    rows = enumerate(corners(k), start=100 * k + 1)
    return "".join(f"{n},{y:.3f},{x:.3f},{z:.3f},W{k} {kind} 1 v\n" for n, (x, y, z) in rows)


def obj(k, kind="header"):
    front = corners(k)
    points = [*front, *((x, 0.45, z) for x, _, z in front)]
    sides = [(0, 1, 2, 3), (7, 6, 5, 4), (1, 0, 4, 5), (2, 1, 5, 6), (3, 2, 6, 7), (0, 3, 7, 4)]
    return (
        f"o W{k}:{kind}\n"
        + "".join(f"v {x:.3f} {y:.3f} {z:.3f}\n" for x, y, z in points)
        + "".join(f"f {' '.join(str(i - 8) for i in side)}\n" for side in sides)
    )


COLUMNS = "block,kind,course,role,x,y,z,depth\n"
CODES = "{block} {kind} {course} {role}"
STATION = "9,-20.000,12.000,1.000,observer s\n"
SURVEYS = {
    "moma": HEAD + "".join(map(moma, range(4))),
    "csv": "# by hand\n" + COLUMNS + "".join(map(csv, range(4))),
    "pnezd": "".join(map(pnezd, range(4))),
    "solids": "".join(map(obj, range(4))),
}
SUFFIX = {"moma": "moma", "csv": "csv", "pnezd": "txt", "solids": "obj"}


@pytest.fixture
def desk(tmp_path):
    """A place to work: survey files, a header file, databases."""
    return Desk(tmp_path)


class Desk:
    def __init__(self, folder):
        self.folder = folder
        (folder / "head.moma").write_text(HEAD)
        self.files = {"head.moma"}

    def url(self, name="wall"):
        return f"sqlite:///{self.folder / name}.db"

    def write(self, text, name):
        path = self.folder / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        self.files.add(name)
        return path

    def options(self, format):
        if format == "moma":
            return reading_options()
        codes = CODES if format == "pnezd" else None
        return reading_options(self.folder / "head.moma", codes)

    def ingest(self, path, format, name="wall", **more):
        return ingest([path], self.url(name), format, options=self.options(format), **more)

    def stones(self, name="wall"):
        with open_database(self.url(name)) as database, database.session(read_only=True) as session:
            return {one.code: one for one in load_stones(session, find(session, "entity", []))}

    def show(self, code, *more, name="wall"):
        return prints("show", code, "--db", self.url(name), *more)

    def left(self):
        """List the files beside those of the test."""
        return {path.name for path in self.folder.iterdir()} - self.files


def same_wall(stones, codes):
    assert set(stones) == set(codes)
    for code in codes:
        stone, (x, _, z) = stones[code], corners(int(code[1:]))[0]
        np.testing.assert_allclose(stone.normal, [0, -1, 0], atol=1e-9)
        low, high = stone.solid_vertices.min(axis=0), stone.solid_vertices.max(axis=0)
        np.testing.assert_allclose(low, [x, 0.0, z], atol=1e-9)
        np.testing.assert_allclose(high, [x + 0.6, 0.45, z + 0.3], atol=1e-9)
        assert (stone.kind, stone.depth) == ("header", pytest.approx(0.45))


@pytest.mark.parametrize("format", SURVEYS)
def test_a_wall_is_the_same_in_the_database_whatever_format_it_came_in(desk, format):
    told = []
    path = desk.write(SURVEYS[format], f"wall.{SUFFIX[format]}")
    report = desk.ingest(path, format, progress=told.append)
    (file,) = report.files
    assert (file.stones, file.refused, file.rejects, file.frame) == ({"header": 4}, (), None, None)
    same_wall(desk.stones(), ["W0", "W1", "W2", "W3"])
    assert desk.left() == {"wall.db"}
    assert [(one.done, one.total, one.text) for one in told] == [
        *((k + 1, None, f"W{k}") for k in range(4)),
        *((k + 1, 4, f"W{k}") for k in range(4)),
        (0, None, ""),
    ]
    assert told[-1].stage == "relate"
    origin = {"moma": "rule", "csv": "stone", "pnezd": "rule", "solids": "solid"}[format]
    assert {one.depth_origin for one in desk.stones().values()} == {origin}


def spoiled(format, what):
    """A survey whose stone W2 is wrong, and the text that puts it right again."""
    text = SURVEYS[format]
    wrong = {
        "kind": {
            "moma": ("W2 header", "W2 heder"),
            "csv": ("W2,header", "W2,heder"),
            "pnezd": ("W2 HEADER", "W2 HEDER"),
        },
        "number": {
            "moma": ("vertex 11.400 ", "vertex 11.4OO "),
            "csv": ("v,11.400,", "v,11.4OO,"),
            "pnezd": ("11.400,", "11.4OO,"),
        },
    }[what][format]
    assert text.count(wrong[0])
    return text.replace(*wrong), wrong


@pytest.mark.parametrize("what", ["kind", "number"])
@pytest.mark.parametrize("format", ["moma", "csv", "pnezd"])
def test_rejects_that_are_corrected_are_taken_in_with_the_head_in_effect(desk, format, what):
    text, (right, wrong) = spoiled(format, what)
    path = desk.write(text, f"wall.{SUFFIX[format]}")
    report = desk.ingest(path, format, keep_going=True)
    (file,) = report.files
    assert file.stones == {"header": 3}
    assert [one.code for one in file.refused] == ["W2"]
    line = text[: text.index(wrong)].count("\n") + 1
    assert f"{path}:{line}" in file.refused[0].reason
    rejects = desk.folder / f"wall.rejects.{SUFFIX[format]}"
    assert file.rejects == str(rejects)
    assert desk.left() == {"wall.db", rejects.name}
    content = rejects.read_text()
    assert "# rejected by moma: 1 of wall." in content
    assert file.refused[0].reason in content
    assert "W1" not in content

    rejects.write_text(content.replace(wrong, right))
    desk.ingest(rejects, format)
    same_wall(desk.stones(), ["W0", "W1", "W2", "W3"])
    origin = {"moma": "rule", "csv": "stone", "pnezd": "rule"}[format]
    assert desk.stones()["W2"].depth_origin == origin


@pytest.mark.parametrize("format", ["moma", "csv", "pnezd"])
def test_a_byte_order_mark_does_not_end_up_amid_the_rejects(desk, format):
    text, (right, wrong) = spoiled(format, "kind")
    path = desk.write(b"\xef\xbb\xbf" + text.encode(), f"wall.{SUFFIX[format]}")
    desk.ingest(path, format, keep_going=True)
    rejects = desk.folder / f"wall.rejects.{SUFFIX[format]}"
    assert b"\xef" not in rejects.read_bytes()
    rejects.write_text(rejects.read_text().replace(wrong, right))
    desk.ingest(rejects, format)
    same_wall(desk.stones(), ["W0", "W1", "W2", "W3"])


def test_stations_among_the_points_of_a_list_stay_with_its_rejects(desk):
    # clockwise for its station: without it the face would look the other way
    turned = "".join(reversed(pnezd(2, "HEDER").splitlines(keepends=True)))
    text = pnezd(1) + STATION.replace("observer s", "S1 HEADER 1 s") + turned
    options = reading_options(None, CODES)
    deep = desk.write("moma-survey 1\ndepth * 0.45 source guess\n", "deep.moma")
    options = reading_options(deep, CODES)
    path = desk.write(text, "wall.txt")
    ingest([path], desk.url(), "pnezd", options=options, keep_going=True)
    rejects = desk.folder / "wall.rejects.txt"
    rejects.write_text(rejects.read_text().replace("HEDER", "HEADER"))
    ingest([rejects], desk.url(), "pnezd", options=options)
    same_wall(desk.stones(), ["W1", "W2"])


def test_control_points_and_rules_of_the_head_hold_for_corrected_rejects(desk):
    text = HEAD + CONTROL + moma(0) + moma(1, change=lambda row: row.replace("0.800", "0.8O0"))
    path = desk.write(text, "wall.moma")
    report = desk.ingest(path, "moma", keep_going=True)
    rejects = desk.folder / "wall.rejects.moma"
    rejects.write_text(rejects.read_text().replace("0.8O0", "0.800"))
    again = desk.ingest(rejects, "moma")
    assert report.files[0].frame["scale"] == again.files[0].frame["scale"] == pytest.approx(1.0, abs=1e-9)
    stone = desk.stones()["W1"]
    np.testing.assert_allclose(
        stone.vertices, np.array(corners(1)) + np.array([652000, 6862000, 40]), atol=1e-8
    )
    assert (stone.depth, stone.depth_origin) == (0.45, "rule")


def test_bytes_of_a_latin_1_file_are_kept_as_they_are(desk):
    note = moma(1, "heder").replace("end", "  note état érodé à gauche\nend")
    text = (HEAD.replace("name wall", "name façade") + moma(0) + note).encode("latin-1")
    path = desk.write(text.replace(b"\n", b"\r\n"), "wall.moma")
    desk.ingest(path, "moma", keep_going=True)
    rejects = desk.folder / "wall.rejects.moma"
    content = rejects.read_bytes()
    assert note.encode("latin-1").replace(b"\n", b"\r\n") in content
    assert "name façade\r\n".encode("latin-1") in content
    rejects.write_bytes(content.replace(b"heder", b"header"))
    desk.ingest(rejects, "moma")
    assert desk.stones()["W1"].notes == {"état": "érodé à gauche"}


def test_of_solids_the_rejects_are_reasons(desk):
    text = obj(0) + obj(1, "heder") + obj(2).rsplit("f ", 1)[0]  # the last one has a hole
    path = desk.write(text, "wall.obj")
    report = desk.ingest(path, "solids", keep_going=True)
    assert {one.code for one in report.files[0].refused} == {"W1", "W2"}
    lines = (desk.folder / "wall.rejects.txt").read_text().splitlines()
    reasons = [one for one in lines if one.startswith("# ") and str(path) in one]
    assert len(reasons) == 2
    assert any("did you mean header?" in one for one in reasons)


@pytest.mark.parametrize("format", ["moma", "csv", "pnezd"])
def test_without_keep_going_one_wrong_stone_keeps_all_out(desk, format):
    text, _ = spoiled(format, "kind")
    path = desk.write(text, f"wall.{SUFFIX[format]}")
    with pytest.raises(SurveyError, match=r"unknown kind 'heder'.*did you mean header") as caught:
        desk.ingest(path, format)
    assert f"{path}:" in str(caught.value)
    assert desk.left() == set()


def test_a_face_that_cannot_be_is_a_reject_with_its_place(desk):
    flat = moma(1, change=lambda row: row.replace("0.800", "0.500"))
    path = desk.write(HEAD + moma(0) + flat, "wall.moma")
    with pytest.raises(GeometryError, match=rf"{path}:14: stone W1: "):
        desk.ingest(path, "moma")
    (file,) = desk.ingest(path, "moma", keep_going=True).files
    assert file.stones == {"header": 1}
    assert f"{path}:14: stone W1: " in file.refused[0].reason


def test_a_survey_of_nothing_but_wrong_stones_is_a_failure(desk):
    path = desk.write(HEAD + moma(0, "heder") + moma(1, "heder"), "wall.moma")
    with pytest.raises(SurveyError, match=r"none of its 2 stones can be ingested; the first: .*heder"):
        desk.ingest(path, "moma", keep_going=True)
    assert desk.left() == set()


def test_a_file_of_rejects_replaces_only_what_nobody_has_touched(desk):
    path = desk.write(HEAD + moma(0) + moma(1, "heder"), "wall.moma")
    rejects = desk.folder / "wall.rejects.moma"
    rejects.write_text("my own notes\n")
    with pytest.raises(UsageError, match="is not a file of rejects"):
        desk.ingest(path, "moma", keep_going=True)
    assert rejects.read_text() == "my own notes\n"
    assert desk.left() == {rejects.name}
    rejects.unlink()

    desk.ingest(path, "moma", "first", keep_going=True)
    first = rejects.read_bytes()
    desk.ingest(path, "moma", "second", keep_going=True)  # nobody has touched it
    assert rejects.read_bytes() == first
    rejects.write_bytes(first.replace(b"heder", b"header"))  # an evening's work
    with pytest.raises(UsageError, match="was changed since it was written"):
        desk.ingest(path, "moma", "third", keep_going=True)
    assert b"W1 header" in rejects.read_bytes()
    assert desk.left() == {"first.db", "second.db", rejects.name}


def test_rejects_never_replace_the_survey_itself(desk):
    path = desk.write(HEAD + moma(0) + moma(1, "heder"), "wall.moma")
    desk.ingest(path, "moma", "first", keep_going=True)
    rejects = desk.folder / "wall.rejects.moma"
    for survey in (path, rejects):
        before = survey.read_bytes()
        with pytest.raises(UsageError, match="is the survey file itself"):
            desk.ingest(survey, "moma", keep_going=survey)
        assert survey.read_bytes() == before
    with pytest.raises(UsageError, match="is a folder"):
        desk.ingest(path, "moma", keep_going=desk.folder)
    with pytest.raises(UsageError, match="one file of rejects for 2"):
        ingest([path, rejects], desk.url(), keep_going=desk.folder / "r.moma")


def test_nothing_is_left_behind_where_the_rejects_cannot_be_written(desk):
    path = desk.write(HEAD + moma(0) + moma(1, "heder"), "wall.moma")
    with pytest.raises(UsageError, match="rejects cannot be written"):
        desk.ingest(path, "moma", keep_going=desk.folder / "none" / "r.moma")
    assert desk.left() == set()


def test_nothing_is_left_behind_where_the_database_refuses(desk):
    first = desk.write(HEAD + moma(0), "first.moma")
    desk.ingest(first, "moma")
    before = (desk.folder / "wall.db").read_bytes()
    again = desk.write(HEAD + moma(3) + moma(0) + moma(1, "heder"), "again.moma")
    with pytest.raises(DatabaseError, match=r"the code W0 is taken by the stone at .*first\.moma:8"):
        desk.ingest(again, "moma", keep_going=True)
    assert (desk.folder / "wall.db").read_bytes() == before
    assert desk.left() == {"wall.db"}
    # nor is a database made for files that contradict each other
    twin = desk.write(HEAD.replace("bay 3", "bay 4") + moma(0), "twin.moma")
    words = r"twin\.moma:8: the code W0 is taken by the stone at .*first\.moma:8"
    for pair, error, said in (
        ([first, first], UsageError, "given twice"),
        ([first, twin], SurveyError, words),
    ):
        with pytest.raises(error, match=said):
            ingest(pair, desk.url("new"))
        assert desk.left() == {"wall.db"}


def test_two_files_are_taken_in_together_or_not_at_all(desk):
    good = desk.write(HEAD + moma(0), "good.moma")
    bad = desk.write(HEAD + moma(1) + moma(2, "heder"), "bad.moma")
    hopeless = desk.write(HEAD + moma(3, "heder"), "hopeless.moma")
    with pytest.raises(SurveyError, match="heder"):
        ingest([good, bad], desk.url())
    assert desk.left() == set()
    with pytest.raises(SurveyError, match="none of its 1 stones"):
        ingest([bad, good, hopeless], desk.url(), keep_going=True)
    assert desk.left() == set()
    report = ingest([bad, good], desk.url(), keep_going=True)
    assert [file.stones for file in report.files] == [{"header": 1}, {"header": 1}]
    assert [file.rejects for file in report.files] == [str(desk.folder / "bad.rejects.moma"), None]
    same_wall(desk.stones(), ["W0", "W1"])


def finite_only(text):
    return json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def test_rejects_without_keep_going_is_wrong_use(desk):
    path = desk.write(SURVEYS["moma"], "wall.moma")
    done = invoke("ingest", path, "--rejects", desk.folder / "r.moma", "--db", desk.url())
    assert done.exit_code == 2
    assert "--keep-going" in done.stderr
    assert desk.left() == set()


@pytest.mark.parametrize("format", SURVEYS)
def test_the_command_says_what_became_of_the_stones(desk, format):
    text = SURVEYS[format]
    wrong = (
        obj(4, "heder")
        if format == "solids"
        else {"moma": moma, "csv": csv, "pnezd": pnezd}[format](4, "heder")
    )
    path = desk.write(text + wrong, f"wall.{SUFFIX[format]}")
    words = ["ingest", path, "--format", format, "--keep-going"]
    words += [] if format == "moma" else ["--header", desk.folder / "head.moma"]
    words += ["--codes", CODES] if format == "pnezd" else []
    done = invoke(*words, "--db", desk.url("told"))
    assert done.exit_code == 0, done.output
    said = done.stdout
    assert "4 stones of survey" in said
    assert "1 stones rejected, to be corrected in" in said
    assert "unknown kind 'heder'" in said
    assert "nan" not in said.split()
    assert ("worst plane: W" in said) == (format != "solids")
    done = invoke(*words, "--db", desk.url("json"), "--json")
    (file,) = finite_only(done.stdout)["files"]
    assert file["stones"] == {"header": 4}
    assert file["refused"][0]["code"] == "W4"
    assert file["frame"] is None
    assert math.isfinite(file["rms"])


@pytest.mark.parametrize("count", [3, 4])
def test_the_frame_is_told_in_numbers_that_json_can_say(desk, count):
    # three points have redundancy 2 only; exact ones leave no residual
    head = HEAD + "".join(CONTROL.splitlines(keepends=True)[:count])
    path = desk.write(head + moma(0), "wall.moma")
    done = invoke("ingest", path, "--db", desk.url(), "--json")
    assert done.exit_code == 0, done.output
    frame = finite_only(done.stdout)["files"][0]["frame"]
    assert [one["name"] for one in frame["control"]] == ["C1", "C2", "C3", "C4"][:count]
    assert max(abs(x) for one in frame["control"] for x in one["residual"]) < 1e-8
    said = invoke("ingest", path, "--db", desk.url("told")).stdout
    assert f"in the frame of the site by {count} control points: scale 1.000000" in said
    assert finite_only(desk.show("W0", "--json"))["solid"]["centroid"][1] == pytest.approx(6862000.225)


PHOTO = """\
photo P1 sigma 0.5
mark P1 0 0 at 10 0 0
mark P1 4000 0 at 14 0 0
mark P1 4000 2000 at 14 0 2
mark P1 0 2000 at 10 0 2
"""
ON_PHOTO = """\
stone P stretcher zone north
  photo P1
  pixel 100 900
  pixel 600 900
  pixel 600 1200
  pixel 100 1200
end
"""


def test_show_says_sensible_things_of_a_stone_of_each_provenance(desk):
    notes = "  note edge eroded\n  point 10.1 0.001 0.6\n  point 10.3 0.09 0.7\n  point 10.5 -0.001 0.6\nend"
    stones = moma(0).replace("end", notes) + moma(1) + ON_PHOTO
    desk.ingest(desk.write(HEAD + PHOTO + stones, "wall.moma"), "moma")
    desk.ingest(desk.write(obj(5), "more.obj"), "solids")
    for code, origin, words in (
        ("W0", "rule", ["points measured on the face", "broken end", "eroded", "rejected", "0.45 m"]),
        ("P", "structure", ["photograph P1", "thickness of the wall", "north", "0.4 m"]),
        ("W5", "solid", ["solid of", "more.obj", "0.45 m"]),
    ):
        text = desk.show(code)
        assert not [word for word in words if word not in text], text
        assert not {"nan", "-0"} & set(text.lower().split()), text
        about = finite_only(desk.show(code, "--json"))
        assert about["depth"]["origin"] == origin
        assert about["solid"]["volume"] > 0.0
    assert finite_only(desk.show("W0", "--json"))["measured"]["rejected"] == [2]
    assert finite_only(desk.show("P", "--json"))["face"]["length"] == pytest.approx(0.5, abs=1e-6)


def test_blunders_are_told_by_the_names_that_the_instrument_gave_them(desk):
    inside = [(10.1, 0.001, 0.6), (10.3, 0.09, 0.7), (10.5, -0.001, 0.6), (10.2, 0.0, 0.75)]
    rows = [f"7{k},{y},{x},{z},W0 HEADER 1 p" for k, (x, y, z) in enumerate(inside)]
    report = desk.ingest(desk.write(pnezd(0) + "\n".join(rows) + "\n", "wall.txt"), "pnezd")
    assert report.files[0].rejected == {"W0": 1}
    assert finite_only(desk.show("W0", "--json"))["measured"]["rejected"] == ["71"]


def test_nothing_is_logged_or_printed_by_the_library(desk, capsys, caplog):
    with caplog.at_level(logging.INFO):
        desk.ingest(desk.write(SURVEYS["moma"], "wall.moma"), "moma")
    assert capsys.readouterr() == ("", "")
    assert not caplog.records
