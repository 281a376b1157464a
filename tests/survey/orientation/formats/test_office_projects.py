"""Projects as offices export them: components, common accuracies, few marks, binary models, DBAT's signs."""

import re
import struct
from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.orientation.formats.colmap import _quaternion, read_colmap, write_colmap
from survey.orientation.formats.dbat import read_dbat, write_dbat
from survey.orientation.formats.local_frame import LocalFrame
from survey.orientation.formats.metashape import read_metashape, write_metashape
from survey.orientation.network import INTERIOR
from tests.pipelines.ingest.test_cases import CASES, needs_shared
from tests.survey.orientation.formats.test_round_trips import same_pictures, written

FLIP = np.diag([1.0, -1.0, -1.0])


def strings(network, folder, ending="\0"):
    """Write the binary form of a text model, with a mark without a point on every photograph."""
    folder.mkdir()
    _, model, *size = (folder.parent / "text/cameras.txt").read_text().split()[:4]
    values = [float(one) for one in (folder.parent / "text/cameras.txt").read_text().split()[4:]]
    number = {"OPENCV": 4, "FULL_OPENCV": 6}[model]
    head = struct.pack("<QIiQQ", 1, 1, number, *map(int, size))
    (folder / "cameras.bin").write_bytes(head + struct.pack(f"<{len(values)}d", *values))
    out = struct.pack("<Q", len(network.photos))
    for k, photo in enumerate(network.photos):
        turn = (photo.rotation @ FLIP).T
        mine = np.flatnonzero(network.photo == k)
        out += struct.pack("<I7dI", k + 1, *_quaternion(turn), *(-turn @ photo.station), 1)
        out += photo.name.encode() + ending.encode() + struct.pack("<Q", len(mine) + 1)
        out += struct.pack("<ddq", 1.0, 2.0, -1)
        for j in mine:
            out += struct.pack("<ddq", *network.image[j], int(network.names[network.point[j]]))
    (folder / "images.bin").write_bytes(out)
    out = struct.pack("<Q", len(network.names))
    for name, place in zip(network.names, network.start, strict=True):
        out += struct.pack("<Q3d3BdQ", int(name), *place, 0, 0, 0, 0.5, 1) + struct.pack("<II", 1, 0)
    (folder / "points3D.bin").write_bytes(out)


def models(tmp_path):
    network = written(forward=True)
    write_colmap(network, tmp_path / "text")
    text = read_colmap(tmp_path / "text")
    strings(text, tmp_path / "bin")
    return text


def test_a_binary_model_is_that_of_the_text(tmp_path):
    text, binary = models(tmp_path), read_colmap(tmp_path / "bin")
    same_pictures(text, binary)
    np.testing.assert_array_equal(binary.cameras[0].inner, text.cameras[0].inner)


@pytest.mark.parametrize("file", ["cameras.bin", "images.bin", "points3D.bin"])
def test_a_binary_model_that_is_cut_or_announces_too_much_is_refused(tmp_path, file):
    models(tmp_path)
    path = tmp_path / "bin" / file
    whole = path.read_bytes()
    path.write_bytes(whole[:-5])
    with pytest.raises(SurveyError, match=rf"{file}, byte \d+: the file ends \d+ bytes too early"):
        read_colmap(tmp_path / "bin")
    path.write_bytes(struct.pack("<Q", 3_000_000_000) + whole[8:])
    with pytest.raises(SurveyError, match="announces 3000000000 records, more than it has room for"):
        read_colmap(tmp_path / "bin")


def test_a_photograph_of_ten_thousand_keypoints_is_read(tmp_path):
    models(tmp_path)
    path = tmp_path / "text/images.txt"
    lines = path.read_text().splitlines()
    lines[1] += " 1234.5678 2345.6789 -1" * 10_000
    path.write_text("\n".join([*lines, ""]))
    assert len(lines[1]) > 1 << 16
    assert len(read_colmap(tmp_path / "text").photos) == len(read_colmap(tmp_path / "bin").photos)


@needs_shared
def test_the_binary_model_of_the_case():
    found = read_colmap(CASES / "photographs/colmap-binary/bin")
    assert len(found.photos) > 2
    assert len(found.image) > 100
    assert np.isfinite(found.start).all()


def metashape(tmp_path, *changes):
    path = tmp_path / "a.xml"
    write_metashape(written(forward=True), path)
    text = path.read_text()
    for old, new in changes:
        assert re.search(old, text), old
        text = re.sub(old, new, text)
    path.write_text(text)
    return path


MOVED = (
    '<transform><rotation locked="true">0 -1 0 1 0 0 0 0 1</rotation><translation locked="true">10 20 30'
    '</translation><scale locked="true">2</scale></transform>'
)


@pytest.mark.parametrize(
    "changes",
    [
        [("</cameras>", f"</cameras>{MOVED}")],
        [("<cameras>", f'<components active_id="0"><component id="0">{MOVED}</component></components><cameras>')],
        [
            ("<cameras>", f'<components active_id="7"><component id="3"/><component id="7">{MOVED}</component>'
             "</components><cameras>"),
            (r'(<camera id="\d+")', r'\1 component_id="7"'),
        ],
    ],
)  # fmt: skip
def test_the_transform_of_a_chunk_or_of_its_component_is_applied(tmp_path, changes):
    plain, found = read_metashape(metashape(tmp_path)), read_metashape(metashape(tmp_path, *changes))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for one, other in zip(plain.photos, found.photos, strict=True):
        np.testing.assert_allclose(other.station, 2.0 * turn @ one.station + (10, 20, 30), atol=1e-9)
        np.testing.assert_allclose(other.rotation, turn @ one.rotation, atol=1e-9)


@pytest.mark.parametrize("value", [0.02, 0.005])
def test_markers_without_an_accuracy_have_that_of_the_chunk(tmp_path, value):
    path = metashape(
        tmp_path,
        (r' s[xyz]="[^"]*"', ""),
        ("<settings>", f'<settings><property name="accuracy_markers" value="{value}"/>'),
    )
    for one in read_metashape(path).control:
        np.testing.assert_allclose(one.covariance, value**2 * np.eye(3), rtol=1e-12)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_photographs_with_few_marks_are_left_out_and_named(tmp_path, count):
    path = metashape(tmp_path)
    lines, seen = [], 0
    for line in path.read_text().splitlines():
        first = 'location camera_id="0"' in line
        seen += first
        lines += [] if first and seen > count else [line]
    path.write_text("\n".join(lines))
    whole = written(forward=True)
    found = read_metashape(path)
    assert [one.name for one in found.photos] == [one.name for one in whole.photos[1:]]
    assert len(found.image) == np.count_nonzero(whole.photo != 0)
    assert any(f"left out: {whole.photos[0].name}" in one for one in found.remarks)
    assert found.photo.min() == 0


def test_a_sensor_that_nobody_uses_is_ignored(tmp_path):
    path = metashape(tmp_path, ("<sensors>", '<sensors><sensor id="9" label="fisheye" type="fisheye"/>'))
    found = read_metashape(path)
    assert [one.name for one in found.cameras] == [one.name for one in written(forward=True).cameras]
    assert {one.camera for one in found.photos} == {0}


def test_control_by_longitude_and_latitude_comes_to_a_local_frame(tmp_path):
    count = iter(range(100))
    places = [(11.0 + 1e-5 * (k % 4), 48.0 + 1e-5 * (k // 4), 500.0 + k) for k in range(100)]

    def geographic(_):
        return '<reference x="{}" y="{}" z="{}"'.format(*places[next(count)])

    path = metashape(
        tmp_path,
        (r'<reference x="[^"]*" y="[^"]*" z="[^"]*"', geographic),
        ("<settings>", '<reference>GEOGCS["WGS 84"]</reference><settings>'),
    )
    found = read_metashape(path)
    np.testing.assert_allclose(found.control[0].place, 0.0, atol=1e-9)
    # a hundred-thousandth of a degree: 0.7456 m to the east at 48° north, 1.1119 m to the north
    np.testing.assert_allclose(found.control[1].place, [0.7460, 0.0, 1.0], atol=2e-3)
    np.testing.assert_allclose(found.control[4].place[1:], [1.1120, 4.0], atol=2e-3)
    assert "east, north and up" in found.remarks[0]
    assert np.linalg.det(LocalFrame(np.array(places[0])).axes) == pytest.approx(1.0)


@needs_shared
def test_the_cases_of_metashape():
    parts = read_metashape(CASES / "photographs/metashape-components/comp_free.xml")
    whole = read_metashape(CASES / "photographs/metashape-accuracy/acc.xml")
    for one, other in zip(parts.photos, whole.photos, strict=True):
        np.testing.assert_allclose(one.station, other.station, atol=1e-6)
    np.testing.assert_allclose(whole.control[0].covariance, 0.02**2 * np.eye(3))


@pytest.mark.parametrize("forward", [False, True])
def test_dbat_has_the_signs_of_its_result_files(tmp_path, forward):
    """In data/script/camcaldemo/result/c4040z.xml of version 0.9.2.0, with its report: pp, K and P as estimated."""
    network = written(forward=forward)
    camera = network.cameras[0]
    inner = dict(zip(INTERIOR, camera.inner, strict=True))
    script = write_dbat(network, tmp_path)
    text = script.read_text()
    numbers = {
        name: [float(one) for one in re.search(f"<{name}>(.*)</{name}>", text)[1].split(",")]
        for name in ("pp", "K", "P")
    }
    assert numbers["pp"] == [inner["xp"], inner["yp"]]
    assert numbers["K"] == [inner["K1"], inner["K2"], inner["K3"]]
    assert numbers["P"] == [inner["P1"], inner["P2"]]
    made = re.sub("<pp>.*</pp>", "<pp>3.61546,2.61329</pp>", text)
    made = re.sub("<K>.*</K>", "<K>0.00458860,-4.5135e-05,-2.0525e-06</K>", made)
    made = re.sub("<aspect>.*</aspect>", "<aspect>0.99961040</aspect>", made)
    script.write_text(made)
    found = dict(zip(INTERIOR, read_dbat(script).cameras[0].inner, strict=True))
    assert (found["xp"], found["yp"], found["K1"], found["K3"]) == (3.61546, 2.61329, 0.0045886, -2.0525e-06)
    assert found["as"] == pytest.approx(-0.0003896 if forward else 0.0003896, rel=1e-3)
    assert replace(camera).forward == forward
