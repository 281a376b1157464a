"""Cameras of scripts and correlations of results by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.orientation.formats import dbat, photomodeler, result
from survey.orientation.formats.xml_lines import read_xml

CAMERA = """<document><camera>
<name>one</name><image>{image}</image><sensor>{sensor}</sensor><focal>{focal}</focal>{more}
</camera></document>
"""


def camera(tmp_path, image="4000,3000", sensor="36,27", focal="28", more=""):
    path = tmp_path / "script.xml"
    path.write_text(CAMERA.format(image=image, sensor=sensor, focal=focal, more=more))
    (element,) = read_xml(path, "document").all("camera")
    return dbat._camera(element, ())


def test_a_camera_has_pixels_of_its_sensor_and_its_principal_point_in_the_middle(tmp_path):
    found = camera(tmp_path)
    assert (found.pixel, found.size, found.name) == (pytest.approx(0.009), (4000, 3000), "one")
    assert found.inner[:5] == pytest.approx([28.0, 18.0, 13.5, 0.0, 0.0])
    auto = camera(tmp_path, sensor="auto,27")
    assert auto.inner[:3] == pytest.approx([28.0, 18.0, 13.5])


def test_what_a_camera_states_itself_goes_before(tmp_path):
    more = "<cc>27.5</cc><pp>18.2,13.4</pp><aspect>1.002</aspect><K>1e-4,2e-6</K><P>3e-5,-4e-5</P>"
    found = camera(tmp_path, more=more)
    assert found.inner[0] == 27.5
    assert found.inner[1:3].tolist() == [18.2, 13.4]
    assert abs(found.inner[3]) == pytest.approx(0.002)
    assert found.inner[5:].tolist() == [1e-4, 2e-6, 0.0, 3e-5, -4e-5]
    # a principal point of zeros says nothing
    assert camera(tmp_path, more="<pp>0,0</pp>").inner[1:3] == pytest.approx([18.0, 13.5])
    models = [camera(tmp_path, more=f"<aspect>1.002</aspect><model>{n}</model>") for n in (-1, 1)]
    assert models[0].forward
    assert not models[1].forward
    assert models[0].inner[3] == pytest.approx(-models[1].inner[3])


@pytest.mark.parametrize(("width", "refused"), [(37.7, False), (38.0, True), (34.3, False), (34.0, True)])
def test_pixels_are_square_to_a_twentieth(tmp_path, width, refused):
    if refused:
        with pytest.raises(SurveyError, match=f"pixels of {width / 4000:g} × 0.009 mm"):
            camera(tmp_path, sensor=f"{width},27")
    else:
        camera(tmp_path, sensor=f"{width},27")


def test_smart_points_are_numbered_after_the_others():
    """Numbers that begin again are those of smart points, where some marks have no deviations."""
    with_, without = (1, np.array([0.0, 5, 1, 1, 0.5, 0.5])), (2, np.array([0.0, 1, 1, 1, 0, 0]))
    shift, split = photomodeler._smart_points([3, 5, 9, 1, 2], [with_, without])
    assert (shift, split) == (9, 3)
    assert {number + (shift if k >= split else 0) for k, number in enumerate([3, 5, 9, 1, 2])} == {
        3,
        5,
        9,
        10,
        11,
    }
    assert photomodeler._smart_points([3, 5, 9], [with_, without]) == (0, 3)
    assert photomodeler._smart_points([3, 5, 9, 1, 2], [with_]) == (0, 5)
    assert photomodeler._smart_points([3, 1, 9, 2], [without]) == (0, 4)


def test_a_photograph_with_other_values_has_a_camera_of_its_own():
    common = np.array([28.0, 18.0, 13.5, 36.0, 27.0, 0, 0, 0, 0, 0])
    size = np.array([4000.0, 3000.0])
    cameras = [photomodeler._camera("camera1", common, size, "a.txt")]
    assert cameras[0].pixel == pytest.approx(0.009)
    assert photomodeler._own_camera(cameras, common + 0.5 * photomodeler._COARSE, common, size, "") == 0
    other = common.copy()
    other[0] = 29.0
    assert photomodeler._own_camera(cameras, other, common, size, "") == 1
    assert photomodeler._own_camera(cameras, other, common, size, "") == 1
    assert [one.name for one in cameras] == ["camera1", "camera2"]
    for place in (0, 3, 4):
        wrong = common.copy()
        wrong[place] = 0.0
        with pytest.raises(SurveyError, match="greater than 0"):
            photomodeler._camera("camera1", wrong, size, "")


def test_pairs_of_parameters_that_are_hardly_told_apart_are_named(monkeypatch):
    columns = [("c1", "c"), ("c1", "xp"), ("c1", "k1"), ("P1", "rx"), ("c2", "c")]
    spread = np.array([2.0, 0.5, 3.0, 1.0, 4.0])
    correlation = np.eye(5)
    correlation[0, 1] = correlation[1, 0] = -0.999
    correlation[0, 2] = correlation[2, 0] = 0.9
    correlation[0, 4] = correlation[4, 0] = 0.999  # of two cameras
    photo = np.eye(6)
    photo[0, 4] = photo[4, 0] = 0.9999 * 10.0
    photo[4, 4] = 100.0
    made = SimpleNamespace(
        prepared=SimpleNamespace(columns=columns),
        statistics=SimpleNamespace(cameras=correlation * np.outer(spread, spread)),
        network=SimpleNamespace(photos=[SimpleNamespace(name="P1"), SimpleNamespace(name="P2")]),
        solution=None,
    )
    monkeypatch.setattr(result, "photo_precision", lambda *_: [photo, np.zeros((6, 6))])
    found = [(one["of"], one["a"], one["b"], round(one["value"], 4)) for one in result._correlations(made)]
    assert found == [("P1", result._ANGLES[0], result._ANGLES[4], 0.9999), ("c1", "c", "xp", -0.999)]
