"""Clouds of points as text, with columns in any order, unit and encoding."""

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.clouds.points.text import open_text

PLACES = np.array([[1.25, 0.5, 7.0], [2.25, 0.75, 7.5], [3.5, 0.25, 8.0]])


def read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "cloud.txt"
    path.write_text(text, encoding=encoding)
    (chunk,) = open_text(path).chunks(np.zeros(3), True)
    return chunk


def rows(form):
    return "".join(form.format(x=x, y=y, z=z, k=k) + "\n" for k, (x, y, z) in enumerate(PLACES, start=1))


@pytest.mark.parametrize(
    "text",
    [
        "Y,X,Z\n" + rows("{y},{x},{z}"),
        "id,x,y,z\n" + rows("{k},{x},{y},{z}"),
        "name;z;y;x\n" + rows("P{k};{z};{y};{x}"),
        "Hochwert;Rechtswert;Höhe\n" + rows("{y};{x};{z}").replace(".", ","),
        "Intensity X Y Z\n" + rows("200 {x} {y} {z}"),
        "x,y,z,\n" + rows("{x},{y},{z},"),
        rows("{x};{y};{z};"),
        rows('"{x}","{y}","{z}"'),
        rows("{x:.4E} {y:.4E} {z:.4E}").replace("E", "D"),
        "//X Y Z Scalar\n3\n" + rows("{x} {y} {z} nan"),
        rows("{x} {y} {z}") + "nan nan nan\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
def test_columns_of_a_cloud_are_read_by_name(tmp_path, text, encoding):
    found = read(tmp_path, text, encoding)
    np.testing.assert_allclose(found.places, PLACES, rtol=0, atol=1e-12)
    assert found.colours is None


def test_colours_are_columns_of_this_name_or_whole_numbers(tmp_path):
    for text in ("R,G,B,X,Y,Z\n" + rows("{k},20,30,{x},{y},{z}"), rows("{x} {y} {z} {k} 20 30")):
        np.testing.assert_array_equal(read(tmp_path, text).colours, [[k, 20, 30] for k in (1, 2, 3)])
    for text in ("x y z nx ny nz\n" + rows("{x} {y} {z} 0 1 0"), rows("{x} {y} {z} 0.0 1.0 0.0")):
        assert read(tmp_path, text).colours is None


def test_a_cloud_in_feet_is_converted(tmp_path):
    text = "X [ft],Y [ft],Z [ft]\n" + rows("{x},{y},{z}")
    np.testing.assert_allclose(read(tmp_path, text).places, 0.3048 * PLACES, rtol=1e-12)
    text = "X (US survey feet);Y (ftUS);Z (us-ft)\n" + rows("{x};{y};{z}")
    np.testing.assert_allclose(read(tmp_path, text).places, 1200.0 / 3937.0 * PLACES, rtol=1e-12)
    text = "z_mm y_mm x_mm\n" + rows("{z} {y} {x}")
    np.testing.assert_allclose(read(tmp_path, text).places, 0.001 * PLACES, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (rows("{k},{x},{y},{z}"), ":1: the first column counts the rows, and the columns have no names"),
        ("x y up\n" + rows("{x} {y} {z}"), ":1: no column z among x, y, up; name the columns x, y and z"),
        ("ncols 3\nnrows 3\n" + rows("{x} {y} {z}"), ":1: a grid of heights, not points"),
        (rows("{x} {y} {z}") + "1 2 3 4\n", ":4: '1 2 3 4' is not a point like the others"),
        (rows("{x};{y};{z};") + "1;2;3;4;\n", ":4: '1;2;3;4;' is not a point like the others"),
        ("id,x,y,z\n" + rows("P{k},{x},{y},{z}") + "P4,1,2\n", ":5: 'P4,1,2' is not a point like the others"),
    ],
)
def test_a_cloud_that_is_not_understood_is_refused(tmp_path, text, message):
    with pytest.raises(SurveyError) as caught:
        read(tmp_path, text)
    assert message in str(caught.value)


def test_a_later_piece_of_another_width_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("survey.clouds.points.text.LINES", 3)
    path = tmp_path / "cloud.txt"
    path.write_text(rows("{x} {y} {z} 7") + "1 23 4\n", encoding="utf-8")
    with pytest.raises(SurveyError, match=r":4: '1 23 4' is not a point like the others"):
        list(open_text(path).chunks(np.zeros(3), False))
