"""PTX and PCD files; counts are held against the size of a file; what panics is an error; identity poses."""

import struct

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.clouds.cloud import open_cloud
from survey.clouds.points import las, pcd, ptx
from survey.clouds.points.reading import open_points
from survey.clouds.settings import CloudOptions
from survey.clouds.wall import read_wall
from survey.records.survey import OBSERVER, Station, SurveyHead
from tests.pipelines.ingest.test_cases import CASES, needs_shared
from tests.survey.clouds import scans
from tests.survey.clouds.test_points import COLOURS, POINTS, e57_file, read

TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # of rows
SHIFT = np.array([4.0e5, 5.0e6, 300.0])


def ptx_file(path, points, turn=TURN, shift=SHIFT, columns=None, colours=None):
    """Write two scans of the same points, with one in ten that did not come back."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = turn, shift
    lines = []
    for _ in range(2):
        lines += [str(columns or 1), str(len(points) + 10)]
        lines += [" ".join(map(repr, row)) for row in np.vstack([shift, turn]).tolist()]
        lines += [" ".join(map(repr, row)) for row in matrix.tolist()]
        tail = [""] * len(points) if colours is None else [" {} {} {}".format(*one) for one in colours]
        lines += ["0 0 0 0.500000" + ("" if colours is None else " 0 0 0")] * 10
        lines += [
            " ".join(map(repr, row)) + " 0.5" + more for row, more in zip(points.tolist(), tail, strict=True)
        ]
    path.write_text("\n".join([*lines, ""]))
    return path


def test_ptx_moves_its_scans_and_leaves_out_what_did_not_come_back(tmp_path, monkeypatch):
    monkeypatch.setattr(ptx, "LINES", 50)
    path = ptx_file(tmp_path / "a.ptx", POINTS, colours=COLOURS)
    places, tints = read(path, colours=True)
    np.testing.assert_allclose(places, np.tile(POINTS @ TURN + SHIFT, (2, 1)), atol=1e-8)
    np.testing.assert_array_equal(tints, np.tile(COLOURS, (2, 1)))
    assert [one.position.tolist() for one in open_points(path).stations] == [SHIFT.tolist()] * 2
    plain = open_points(ptx_file(tmp_path / "b.ptx", POINTS, np.eye(3), np.zeros(3)))
    assert plain.stations == ()


@pytest.mark.parametrize("ending", [".pts", ".xyz", ".txt"])
def test_a_ptx_of_another_ending_is_read_as_what_it_is(tmp_path, ending):
    path = ptx_file(tmp_path / "a.ptx", POINTS)
    places = read(path)
    renamed = path.rename(path.with_suffix(ending))
    np.testing.assert_array_equal(read(renamed), places)


def test_fields_of_points_may_have_capitals(tmp_path):
    rows = "\n".join(" ".join(map(repr, row)) for row in POINTS.tolist())
    fields = "".join(f"property double {axis}\n" for axis in "XYZ")
    path = tmp_path / "a.ply"
    path.write_text(f"ply\nformat ascii 1.0\nelement vertex {len(POINTS)}\n{fields}end_header\n{rows}\n")
    np.testing.assert_array_equal(read(path), POINTS)
    cloud = pcd_file(tmp_path / "a.pcd", POINTS, "ascii")
    cloud.write_bytes(cloud.read_bytes().replace(b"FIELDS x y z", b"FIELDS X Y Z"))
    np.testing.assert_allclose(read(cloud), POINTS, atol=1e-6)


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (1, "3000000000", "announces .* more than the file has room for"),
        (2, "many", "the head of a scan cannot be read"),
        (8, "1 1 1 0", "is no rotation"),
        (2, "250", "announces 250 points and holds|cannot be read"),
    ],
)
def test_wrong_ptx_files_are_refused(tmp_path, line, text, message):
    path = ptx_file(tmp_path / "a.ptx", POINTS[:100])
    lines = path.read_text().splitlines()
    lines[line - 1] = text
    path.write_text("\n".join(lines))
    with pytest.raises(SurveyError, match=message):
        open_points(path)


def pcd_file(path, points, kind, station=(0, 0, 0)):
    record = np.dtype([("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("rgb", "<u4")])
    rows = np.zeros(len(points), record)
    for k, name in enumerate("xyz"):
        rows[name] = points[:, k]
    rows["rgb"] = (COLOURS[: len(points)].astype(np.uint32) << (16, 8, 0)).sum(axis=1)
    head = [
        "# .PCD v0.7", "VERSION 0.7", "FIELDS x y z rgb", "SIZE 8 8 8 4", "TYPE F F F U", "COUNT 1 1 1 1",
        f"WIDTH {len(points)}", "HEIGHT 1", "VIEWPOINT {} {} {} 1 0 0 0".format(*station), f"POINTS {len(points)}",
        f"DATA {kind}", "",
    ]  # fmt: skip
    text = "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist()).encode()
    path.write_bytes("\n".join(head).encode() + (text if kind == "ascii" else rows.tobytes()))
    return path


@pytest.mark.parametrize("kind", ["ascii", "binary"])
def test_pcd(tmp_path, kind, monkeypatch):
    monkeypatch.setattr(pcd, "CHUNK", 50)
    points = POINTS.copy()
    points[7, 2] = np.nan
    path = pcd_file(tmp_path / "a.pcd", points, kind, (1.0, 2.0, 3.0))
    places, tints = read(path, colours=True)
    keep = np.arange(len(POINTS)) != 7
    np.testing.assert_allclose(places, POINTS[keep], atol=1e-9)
    np.testing.assert_array_equal(tints, COLOURS[keep])
    assert open_points(path).stations[0].position.tolist() == [1.0, 2.0, 3.0]
    assert open_points(pcd_file(tmp_path / "b.pcd", POINTS, kind)).stations == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"DATA binary", b"DATA binary_compressed", "pcl_convert_pcd_ascii_binary"),
        (b"FIELDS x y", b"FIELDS a b", "no x, y and z"),
        (b"\nPOINTS ", b"\nPOINTS 9999", "announces 9999.* more than it has room for"),
        (b"TYPE F F", b"TYPE F Q", "the head cannot be read"),
    ],
)
def test_wrong_pcd_files_are_refused(tmp_path, old, new, message):
    path = pcd_file(tmp_path / "a.pcd", POINTS, "binary")
    path.write_bytes(path.read_bytes().replace(old, new, 1))
    with pytest.raises(SurveyError, match=message):
        open_points(path)


@pytest.mark.parametrize(
    ("place", "form", "value", "what"),
    [
        (100, "<I", 3_470_000_000, "records in its head"),
        (247, "<Q", 10**12, "points"),
        (243, "<I", 10**9, "extended"),
    ],
)
def test_las_counts_are_held_against_the_size_of_the_file(tmp_path, place, form, value, what):
    import laspy

    path = scans.las(tmp_path / "a.las", POINTS)
    cloud = laspy.read(path)
    laspy.convert(cloud, file_version="1.4", point_format_id=6).write(str(path))
    whole = bytearray(path.read_bytes())
    struct.pack_into(form, whole, place, value)
    path.write_bytes(whole)
    with pytest.raises(SurveyError, match=f"announces {value} {what}"):
        open_points(path)


def test_a_panic_of_the_decompressor_is_an_error(tmp_path, monkeypatch):
    import laspy

    class PanicException(BaseException):
        pass

    path = scans.las(tmp_path / "a.laz", POINTS)
    cloud = open_points(path)

    def panic(*_args, **_more):
        raise PanicException("index out of bounds")

    monkeypatch.setattr(laspy, "open", panic)
    with pytest.raises(SurveyError, match="cannot be read as LAS or LAZ: index out of bounds"):
        list(cloud.chunks(np.zeros(3), False))
    with pytest.raises(SurveyError, match="cannot be read as LAS or LAZ"):
        las.open_las(path)

    def stop(*_args, **_more):
        raise KeyboardInterrupt

    monkeypatch.setattr(laspy, "open", stop)
    with pytest.raises(KeyboardInterrupt):
        las.open_las(path)


def test_an_identity_pose_is_no_station(tmp_path):
    e57_file(tmp_path / "a.e57", POINTS, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))
    assert open_points(tmp_path / "a.e57").stations == ()
    e57_file(tmp_path / "b.e57", POINTS, np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, -5.0, 1.5]))
    assert len(open_points(tmp_path / "b.e57").stations) == 1


@pytest.mark.parametrize(("y", "sound"), [(-5.0, True), (-0.5, True), (6.0, False)])
def test_a_scanner_behind_most_faces_is_refused(tmp_path, y, sound):
    """The wall of the scans is seen from -y, and its outlines run counter-clockwise from there."""
    shapes = [scans.in_space(ring) for ring in scans.rings()]
    outlines = scans.geojson(tmp_path / "a.geojson", shapes)
    middle = np.mean(np.concatenate(shapes), axis=0)
    away = np.cross(shapes[0][1] - shapes[0][0], shapes[0][3] - shapes[0][0])
    place = middle - away / np.linalg.norm(away) * y
    e57_file(tmp_path / "a.e57", scans.scan() - place, np.array([1.0, 0.0, 0.0, 0.0]), place)
    options = CloudOptions(outlines=outlines, sigma=0.001)
    if sound:
        assert len(list(open_cloud([tmp_path / "a.e57"], options).blocks)) == len(shapes)
        return
    with pytest.raises(SurveyError, match=r"6 of 6 outlines run clockwise.*--header"):
        open_cloud([tmp_path / "a.e57"], options)


@pytest.mark.parametrize(
    ("name", "y", "sound"), [("S1", -5.0, True), ("S1", 6.0, False), (OBSERVER, 6.0, True)]
)
def test_a_station_of_the_header_file_behind_most_faces_is_refused_and_an_observer_is_believed(
    tmp_path, name, y, sound
):
    shapes = [scans.in_space(ring) for ring in scans.rings()]
    place = np.mean(np.concatenate(shapes), axis=0) + y * -scans.OUT
    options = CloudOptions(
        outlines=scans.geojson(tmp_path / "a.geojson", shapes),
        sigma=0.001,
        head=SurveyHead("w", "head.moma", stations=(Station(name, place),)),
    )
    cloud = scans.xyz(tmp_path / "a.xyz", scans.scan())
    if sound:
        assert len(list(open_cloud([cloud], options).blocks)) == len(shapes)
        return
    with pytest.raises(SurveyError, match=r"6 of 6 outlines run clockwise seen from its station") as caught:
        open_cloud([cloud], options)
    assert "observer X Y Z" in caught.value.remedy


@pytest.mark.parametrize(("y", "sound"), [(-4.0, True), (2.0, False)])
def test_a_station_behind_the_frame_of_the_wall_is_refused(tmp_path, y, sound):
    wall = read_wall(str(scans.frame(tmp_path)))
    head = SurveyHead(
        "w", "head.moma", stations=(Station("S1", scans.ORIGIN + 0.7 * scans.RIGHT + y * -scans.OUT),)
    )
    options = CloudOptions(outlines=scans.geojson(tmp_path / "a.geojson"), sigma=0.001, wall=wall, head=head)
    cloud = scans.xyz(tmp_path / "a.xyz", scans.scan())
    if sound:
        assert len(list(open_cloud([cloud], options).blocks)) == 6
        return
    with pytest.raises(SurveyError, match="stands behind the wall"):
        open_cloud([cloud], options)


@needs_shared
def test_the_case_of_the_identity_pose_is_seen_as_its_text():
    folder = CASES / "photographs/e57-identity-pose"
    found = []
    for name in ("idpose.xyz", "idpose.e57"):
        options = CloudOptions(outlines=folder / "front.geojson")
        found.append(list(open_cloud([folder / name], options).blocks))
    assert [one.station for one in found[0]] == [one.station for one in found[1]]
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(
            one.vertices, other.vertices, atol=1e-3
        )  # single precision, another sample
