"""Tables of control points and of marks as spreadsheets and cameras write them."""

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.orientation.formats.control import read_control
from survey.orientation.formats.marks import read_marks

PLACE = (431000.12, 5411000.5, 200.1)
FOOT = 0.3048


def control(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "control.txt"
    path.write_text(text, encoding=encoding)
    return read_control(path)


@pytest.mark.parametrize(
    "text",
    [
        "1;A;431000,12;5411000,5;200,1\n",
        "1\tA\t431000,12\t5411000,5\t200,1\n",
        "1,A,431000.12,5411000.5,200.1\n",
        "1 A 431000,12 5411000,5 200,1\n",
        "sep=;\n1;A;431000,12;5411000,5;200,1\n",
        "Points of the facade, 2024\n\nPunkt;Name;Y;X;Z\n1;A;5411000,5;431000,12;200,1\n",
        "Punkt;Hochwert [m];Rechtswert [m];Höhe [mm];Name\n1;5411000,5;431000,12;200100;A\n",
        "# name, number, z, y, x\nA, 1, 200.1, 5411000.5, 431000.12\n",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16"])
def test_a_control_point_is_read_whatever_separates_its_values(tmp_path, text, encoding):
    (row,) = control(tmp_path, text, encoding)
    assert (row.number, row.name) == ("1", "A")
    np.testing.assert_allclose(row.place, PLACE, rtol=0, atol=1e-6)
    assert not row.covariance.any()


def test_control_in_feet_is_converted_with_its_deviations(tmp_path):
    (row,) = control(
        tmp_path, "Point,Easting (ft),Northing (ft),Elevation (ft),Accuracy (ft)\nT1,100,200,30,0.01\n"
    )
    np.testing.assert_allclose(row.place, FOOT * np.array([100.0, 200.0, 30.0]), rtol=1e-12)
    np.testing.assert_allclose(row.covariance, (0.01 * FOOT) ** 2 * np.eye(3), rtol=1e-12)
    (survey,) = control(tmp_path, "Point;X [US survey feet];Y [ftUS];Z [us-ft]\nT1;3937;7874;0\n")
    np.testing.assert_allclose(survey.place, [1200.0, 2400.0, 0.0], rtol=1e-12)


def test_deviations_are_taken_by_name(tmp_path):
    (row,) = control(tmp_path, "id;sz;x;y;z;sx;sy;name\nT1;0,003;1,5;2,5;3,5;0,001;0,002;-\n")
    np.testing.assert_allclose(np.sqrt(np.diag(row.covariance)), [0.001, 0.002, 0.003], rtol=1e-12)
    assert row.name == ""


@pytest.mark.parametrize(
    ("text", "where", "message"),
    [
        ("id;x;y\n1;2,5;3,5;4,5\n", 1, "no column z among id, x, y"),
        ("id;x;east;y;z\n1;2;3;4;5\n", 1, "columns 'x' and 'east' are both x"),
        ("id;x;y;z;weight\n1;2;3;4;5\n", 1, "column 'weight' is not known; name it sigma"),
        ("id;x [rod];y;z\n1;2;3;4\n", 2, "'rod', which is not a unit of length"),
        ("1;A;1,5;2.x;3,5\n2;B;1,5;2,5;3,5\n", 1, "neither names of columns nor a row"),
        ("1;A;1,5;2,5;3,5\n2;B;1.5;2.5;3.5\n", 2, "line 1 writes decimals with ','"),
        ("a;b\nc;d\n", 1, "not a row of this table; write: number, name"),
    ],
)
def test_a_table_of_control_points_that_is_not_understood_is_refused(tmp_path, text, where, message):
    with pytest.raises(SurveyError, match=message) as caught:
        control(tmp_path, text)
    assert str(caught.value.where).endswith(f"control.txt:{where}")


@pytest.mark.parametrize(
    "text",
    [
        "# photograph, point, x, y [px]\nIMG 001, T 1, 10.5, 20.5\nIMG 002, T 1, 11.5, 21.5\n",
        "Marks of 2024\nImage;Marker;x [px];y [px]\nIMG 001;T 1;10,5;20,5\nIMG 002;T 1;11,5;21,5\n",
        "point\ty\tx\tphoto\nT 1\t20.5\t10.5\tIMG 001\nT 1\t21.5\t11.5\tIMG 002\n",
    ],
)
def test_marks_have_names_with_blanks_and_head_lines(tmp_path, text):
    path = tmp_path / "marks.txt"
    path.write_text(text, encoding="utf-8")
    rows = read_marks(path)
    assert [(one.photo, one.point, one.x, one.y) for one in rows] == [
        ("IMG 001", "T 1", 10.5, 20.5),
        ("IMG 002", "T 1", 11.5, 21.5),
    ]


def test_marks_in_millimetres_or_without_a_photograph_are_refused(tmp_path):
    path = tmp_path / "marks.txt"
    path.write_text("photo;point;x [mm];y [mm]\nP1;T1;1,5;2,5\n", encoding="utf-8")
    with pytest.raises(SurveyError, match=r"marks\.txt:1: marks in a unit of length; give marks in pixels"):
        read_marks(path)
    path.write_text("point;x;y;z\nT1;1,5;2,5;3,5\n", encoding="utf-8")
    with pytest.raises(SurveyError, match="no column photograph among point, x, y, z"):
        read_marks(path)
    path.write_text("photo;point;x;y\n1-Jan;T1;1,5;2,5\n", encoding="utf-8")
    with pytest.raises(
        SurveyError, match="the photograph of a mark is a date, 1-Jan; format the column as text"
    ):
        read_marks(path)


METASHAPE = """# CoordinateSystem: LOCAL_CS["Local Coordinates (m)",LOCAL_DATUM["Local Datum",0]]
#Label,X/Easting,Y/Northing,Z/Altitude,Accuracy_X/Easting_(m),Accuracy_Y/Northing_(m),Accuracy_Z/Altitude_(m){more}
target 1,2683401.2,1248077.9,408.55,0.005,0.006,0.01{values}
target 2,2683404.1,1248073.3,408.75,0.005,0.006,0.01{values}
# Total Error,,,,,,,0.0031
"""


@pytest.mark.parametrize(
    ("more", "values"),
    [
        ("", ""),
        (",Error_(m),X_error,Y_error,Z_error,X_est,Y_est,Z_est", ",0.0031,0.001,0.002,-0.001,1.0,2.0,3.0"),
        (",Error_(m),Enable", ",0.0031,1"),
    ],
)
def test_markers_as_metashape_exports_its_reference(tmp_path, more, values):
    first, second = control(tmp_path, METASHAPE.format(more=more, values=values))
    assert (first.number, second.number) == ("target 1", "target 2")
    np.testing.assert_allclose(first.place, [2683401.2, 1248077.9, 408.55], rtol=0, atol=1e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(first.covariance)), [0.005, 0.006, 0.01], rtol=1e-9)


@pytest.mark.parametrize(
    "names", ["#Label,Longitude,Latitude,Altitude", "id,lon,lat,h", "Name,Breite,Länge,Höhe"]
)
def test_control_in_degrees_is_refused(tmp_path, names):
    with pytest.raises(SurveyError, match=r"longitudes and latitudes; export .* in a projected system"):
        control(tmp_path, f"{names}\nT1,8.52,47.38,408.55\nT2,8.53,47.38,409.55\n")


def test_a_column_that_a_comment_names_and_nobody_knows_is_no_deviation(tmp_path):
    with pytest.raises(SurveyError, match="column 'weight' is not known"):
        control(tmp_path, "# name,x,y,z,weight\nT1,1.5,2.5,3.5,4\n")
    (row,) = control(tmp_path, "# name,x,y,z\nT1,1.5,2.5,3.5,0.004\n")
    assert row.covariance[0, 0] == pytest.approx(0.004**2)


@pytest.mark.parametrize(
    "names",
    [
        "#cameraName,markerName,x,y,reprojError",
        "Image name;Marker;x;y;rms",
        "# file name, gcp name, x [px], y [px], weight",
    ],
)
def test_only_a_column_of_that_name_holds_deviations_of_marks(tmp_path, names):
    mark = ";" if ";" in names else ","
    path = tmp_path / "marks.csv"
    path.write_text(
        "\n".join([names, *(mark.join((f"D{k}.JPG", "g0", "12.5", "8.5", "0.3")) for k in (1, 2))])
    )
    rows = read_marks(path)
    assert [(row.photo, row.point, row.x, row.y, row.sigma) for row in rows] == [
        (f"D{k}.JPG", "g0", 12.5, 8.5, None) for k in (1, 2)
    ]
