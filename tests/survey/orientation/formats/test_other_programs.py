"""Calibrations of OpenCV as it projects; files of programs that are not read are named, with the way out."""

import numpy as np
import pytest

from ground.errors import MomaError, SurveyError
from pipelines.orient.project import read_project
from survey.orientation.formats.opencv import read_calibration
from survey.orientation.projection import project

MATRIX = (4010.0, 4000.0, 2990.5, 2004.25)  # fx, fy, cx, cy
COEFFICIENTS = (-0.11, 0.05, 0.0012, -0.0007, -0.01)  # k1, k2, p1, p2, k3

YAML = """%YAML:1.0
---
calibration_time: "Sat Nov 28 2026"
image_width: 6000
image_height: 4000
Camera_Matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 4.0100000000000000e+03, 0., 2.9905000000000000e+03, 0.,
       4.0e+03, 2004.25, 0., 0., 1. ]
Distortion_Coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.11, 0.05, 0.0012,
       -7.0e-04, -0.01 ]
Avg_Reprojection_Error: 0.3
"""
ROS = """image_width: 6000
image_height: 4000
camera_name: nikon
camera_matrix:
  rows: 3
  cols: 3
  data: [4010, 0, 2990.5, 0, 4000, 2004.25, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.11, 0.05, 0.0012, -0.0007, -0.01]
"""
XML = """<?xml version="1.0"?>
<opencv_storage>
<image_Width>6000</image_Width>
<image_Height>4000</image_Height>
<Camera_Matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
  <data>4010. 0. 2990.5 0. 4000. 2004.25 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix"><rows>5</rows><cols>1</cols><dt>d</dt>
  <data>-0.11 0.05 0.0012 -0.0007 -0.01</data></Distortion_Coefficients>
</opencv_storage>
"""


def as_opencv(points):
    """Project points in its axes, x right, y down, z forward, as OpenCV documents it; its first pixel is at 0."""
    (fx, fy, cx, cy), (k1, k2, p1, p2, k3) = MATRIX, COEFFICIENTS
    x, y = (points[:, :2] / points[:, 2:]).T
    r2 = x**2 + y**2
    radial = 1.0 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x**2)
    v = y * radial + p1 * (r2 + 2.0 * y**2) + 2.0 * p2 * x * y
    return np.column_stack([fx * u + cx, fy * v + cy])


@pytest.mark.parametrize("text", [YAML, ROS, XML])
def test_a_calibration_of_opencv_projects_as_opencv_does(tmp_path, text):
    path = tmp_path / "camera.yml"
    path.write_text(text)
    camera = read_calibration(path, "nikon")
    assert camera.size == (6000, 4000)
    points = np.random.default_rng(1).uniform([-3, -2, 4], [3, 2, 6], (40, 3))
    ours = project(camera, np.eye(3), np.zeros(3), points * (1.0, -1.0, -1.0))
    np.testing.assert_allclose(ours - 0.5, as_opencv(points), atol=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("image_width: 6000\n", ""), "size of the pictures"),
        (("-0.0007, -0.01]", "-0.0007, -0.01, 0.2]"), "rational"),
        (("plumb_bob", "equidistant"), "fisheye"),
        (("distortion_coefficients", "notes"), "no camera matrix"),
    ],
)
def test_a_calibration_that_says_too_little_or_another_model_is_refused(tmp_path, change, words):
    path = tmp_path / "camera.yml"
    path.write_text(ROS.replace(*change))
    with pytest.raises(SurveyError, match=words) as caught:
        read_calibration(path, "nikon")
    assert caught.value.remedy


def test_a_project_takes_its_camera_from_a_calibration(tmp_path):
    (tmp_path / "camera.yml").write_text(YAML)
    (tmp_path / "marks.txt").write_text("A p1 10 20\nA p2 30 40\nB p1 11 21\nB p2 33 44\n")
    project_file = tmp_path / "p.toml"
    camera = '[[cameras]]\nname = "nikon"\ncalibration = "camera.yml"\ncalibrate = ["c"]\n'
    project_file.write_text(f'marks = "marks.txt"\n{camera}')
    (read,) = read_project(project_file).network.cameras
    assert (read.name, read.unit, read.forward, read.free) == ("nikon", "px", True, ("c",))
    project_file.write_text(f'marks = "marks.txt"\n{camera}c = 4000.0\n')
    with pytest.raises(MomaError, match="c beside calibration"):
        read_project(project_file)


@pytest.mark.parametrize(
    ("name", "head", "program"),
    [
        ("bundle.out", "# Bundle file v0.3\n2 3\n", "Bundler"),
        (
            "wall_calibrated_camera_parameters.txt",
            "fileName imageWidth imageHeight\ncamera matrix K\n",
            "Pix4D",
        ),
        ("wall.p4d", "<pix4d>", "Pix4D"),
        ("cameras.csv", "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n", "RealityCapture"),
        ("IMG1.xmp", '<rdf:Description xcr:Version="3">', "RealityCapture"),
        ("Orientation-1.xml", '<?xml version="1.0" ?>\n<ExportAPERO>\n', "MicMac"),
        ("AutoCal.xml", "<ExportAPERO>\n<CalibrationInternConique>", "MicMac"),
        ("c.yml", YAML, "OpenCV"),
        ("c.xml", XML, "OpenCV"),
        ("lens.xml", "<?xml?>\n<calibration>\n  <projection>frame</projection>", "Metashape"),
        ("wall.psx", "<document/>", "Metashape"),
        ("sfm_data.json", '{"sfm_data_version": "0.3"', "OpenMVG"),
        ("reconstruction.json", '[{"cameras": {}, "shots": {', "OpenSfM"),
        ("cameras.sfm", '{"featuresFolders": [', "Meshroom"),
    ],
)
@pytest.mark.parametrize("key", ["marks", "metashape", "project"])
def test_a_file_of_another_program_is_named_with_the_way_out(tmp_path, name, head, program, key):
    (tmp_path / name).write_text(head)
    project_file = tmp_path / "p.toml"
    project_file.write_text(f'{key} = "{name}"\n')
    with pytest.raises(SurveyError, match=program) as caught:
        read_project(tmp_path / name if key == "project" else project_file)
    assert caught.value.where == str(tmp_path / name)
    assert any(word in str(caught.value.remedy) for word in ("colmap", "metashape", "calibration", "table"))
