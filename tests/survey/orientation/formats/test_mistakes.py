"""Mistakes in files of photographs are named by file and line."""

from dataclasses import replace

import pytest

from ground.errors import SurveyError
from survey.orientation.formats.colmap import read_colmap, write_colmap
from survey.orientation.formats.control import ControlRow, read_control, with_control
from survey.orientation.formats.dbat import read_dbat, write_dbat
from survey.orientation.formats.marks import read_marks
from survey.orientation.formats.metashape import read_metashape, write_metashape
from survey.orientation.formats.photomodeler import read_photomodeler, write_photomodeler
from survey.orientation.formats.result import read_orientation
from tests.survey.orientation.formats.test_round_trips import written


def changed(path, line, text):
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[line - 1] = text
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (2, "0.0005 20", "line of tolerance, iterations, width and height has 2 numbers"),
        (2, "0.0005 20 0 4000", "0 × 4000 pixels"),
        (4, "24 18 12 36 24 0 0 0", "camera has 8 numbers"),
        (4, "0 18 12 36 24 0 0 0 0 0", "must be greater than 0"),
        (6, "zero P01", "photograph 'zero' is not a number"),
        (7, "0 1 2 x 4 5 6", "is 'x', not a number"),
        (-1, "0 1 2", "a mark has 3 numbers"),
        (-1, "77 1 100 100 1 1", "photograph 77, which is not in the file"),
    ],
)
def test_photomodeler(tmp_path, line, text, message):
    path = tmp_path / "export.txt"
    write_photomodeler(written(plain=True), path)
    if line < 0:
        line = len(path.read_text(encoding="utf-8").splitlines())
    changed(path, line, text)
    with pytest.raises(SurveyError, match=message) as caught:
        read_photomodeler(path)
    assert caught.value.where == f"{path}:{line}"


def test_photomodeler_file_that_was_cut_short(tmp_path):
    path = tmp_path / "export.txt"
    write_photomodeler(written(plain=True), path)
    path.write_text("\n".join(path.read_text(encoding="utf-8").splitlines()[:9]), encoding="utf-8")
    with pytest.raises(SurveyError, match="the file ends before"):
        read_photomodeler(path)


def test_photomodeler_point_marked_twice(tmp_path):
    path = tmp_path / "export.txt"
    write_photomodeler(written(plain=True), path)
    lines = path.read_text(encoding="utf-8").splitlines()
    changed(path, len(lines), lines[-2])
    with pytest.raises(SurveyError, match="is marked twice on photograph"):
        read_photomodeler(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1, a, 0, 0", "write: number, name"),
        ("1, a, 0, 0, north", "'north', not a number"),
        ("1, a, 0, 0, 0, 0.1, 0, 0.1", "a standard deviation of 0 beside others"),
        ("1, a, 0, 0, 0, -0.1", "must not be negative"),
        ("1, a, 0, 0, 0, 1, 2, 0, 2, 1, 0, 0, 0, 1", "not symmetric and positive"),
        ("7, b, 0, 0, 0", "is there twice, first at"),
    ],
)
def test_control(tmp_path, text, message):
    path = tmp_path / "control.txt"
    if text[3:] == "a, 0, 0":
        text = "1, a, 0"
    path.write_text(f"# control\n7, x, 1, 2, 3\n{text}\n", encoding="utf-8")
    with pytest.raises(SurveyError, match=message) as caught:
        read_control(path)
    assert caught.value.where == f"{path}:3"


def test_control_points_of_another_project(tmp_path):
    path = tmp_path / "control.txt"
    path.write_text("901, x, 1, 2, 3\n902, y, 1, 2, 4\n", encoding="utf-8")
    with pytest.raises(SurveyError, match="none of the 2 control points is marked on a photograph: 901, 902"):
        with_control(written(), read_control(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("P1, 7, 12.0", "a mark of 3 values"),
        ("P1, 7, 12.0, x", "'x', not a number"),
        ("P1, 7, 12.0, 13.0, 0", "it must be greater than 0"),
        ("P1,6,1,2", "marked twice on photograph P1, first in line 2"),
    ],
)
def test_marks(tmp_path, text, message):
    path = tmp_path / "marks.txt"
    path.write_text(f"# marks\nP1, 6, 1.5, 2.5\n{text}\n", encoding="utf-8")
    with pytest.raises(SurveyError, match=message) as caught:
        read_marks(path)
    assert caught.value.where == f"{path}:3"


@pytest.mark.parametrize(
    ("file", "line", "text", "message"),
    [
        ("cameras.txt", 1, "1 FISHEYE 6000 4000 1 2 3", "camera model 'FISHEYE' cannot be read"),
        ("cameras.txt", 1, "1 PINHOLE 6000 4000 1 2 3", "3 parameters of PINHOLE"),
        ("images.txt", 1, "1 1 0 0 0 0 0 0 1", "an image of 9 values"),
        ("images.txt", 1, "1 1 1 0 0 0 0 0 1 P01", "a quaternion of length"),
        ("images.txt", 1, "1 1 0 0 0 0 0 0 9 P01", "camera 9 is not in cameras.txt"),
        ("images.txt", 2, "1.0 2.0", "2 values of marks"),
        ("images.txt", 2, "1.0 2.0 999", "point 999 is not in points3D.txt"),
        ("points3D.txt", 2, "2 1.0 2.0", "a point of 3 values"),
    ],
)
def test_colmap(tmp_path, file, line, text, message):
    write_colmap(written(forward=True), tmp_path)
    changed(tmp_path / file, line, text)
    with pytest.raises(SurveyError, match=message) as caught:
        read_colmap(tmp_path)
    assert caught.value.where == f"{tmp_path / file}:{line}"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<document", "<model", "not XML|is expected"),
        ("</chunk>", "", "this is not XML: mismatched tag"),
        ('type="frame"', 'type="fisheye"', "is 'fisheye'"),
        ("<f>", "<k4>0.1</k4><f>", "has k4"),
        ('sensor_id="0"', 'sensor_id="7"', "sensor 7 is not in the file"),
        ("<transform>1.0", "<transform>oops", "not a number"),
        ("<transform>", "<transform>3.5 ", "17 numbers"),
        ('<?xml version="1.0" encoding="UTF-8"?>', "<!DOCTYPE a><!-- -->", "has a DOCTYPE"),
    ],
)
def test_metashape(tmp_path, old, new, message):
    path = tmp_path / "doc.xml"
    write_metashape(written(forward=True), path)
    text = path.read_text(encoding="utf-8")
    if "oops" in new:
        start = text.index("<transform>") + len("<transform>")
        text = text[:start] + "oops" + text[text.index(" ", start) :]
    else:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SurveyError, match=message) as caught:
        read_metashape(path)
    assert caught.value.where.startswith(f"{path}:")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('format="id,path"', 'format="id"', "has no path"),
        ("<image>6000,4000</image>", "<image>6000</image>", "has 1 numbers"),
        ("<model>3</model>", "<model>8</model>", "lens distortion model 8"),
        ("<all>false</all>", "<most>true</most>", "write true or false"),
    ],
)
def test_dbat(tmp_path, old, new, message):
    script = write_dbat(written(), tmp_path)
    text = script.read_text(encoding="utf-8")
    assert old in text
    script.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SurveyError, match=message) as caught:
        read_dbat(script)
    assert caught.value.where.startswith(f"{script}:")


def test_dbat_tables_are_named_by_line(tmp_path):
    script = write_dbat(written(), tmp_path)
    changed(tmp_path / "marks.txt", 4, "1, 7, 5.0")
    with pytest.raises(SurveyError, match="a row of 3 values") as caught:
        read_dbat(script)
    assert caught.value.where == f"{tmp_path / 'marks.txt'}:4"


@pytest.mark.parametrize(
    ("text", "message"), [("{", "not JSON"), ("{}", "not the result"), ("[1]", "not the result")]
)
def test_orientation(tmp_path, text, message):
    path = tmp_path / "orientation.json"
    with pytest.raises(SurveyError, match="moma orient"):
        read_orientation(path)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SurveyError, match=message):
        read_orientation(path)


def test_control_points_that_are_marked_nowhere_are_named_and_left_out():
    network = written()
    kept = network.point != network.control[0].point
    less = replace(
        network, photo=network.photo[kept], point=network.point[kept], image=network.image[kept],
        sigma=network.sigma[kept], lines=network.lines[kept], control=(),
    )  # fmt: skip
    rows = [ControlRow(network.names[one.point], "", one.place, one.covariance) for one in network.control]
    found = with_control(less, rows)
    assert len(found.control) == len(rows) - 1
    assert found.remarks == (f"control points that are marked nowhere: {rows[0].number}",)
