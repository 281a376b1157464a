"""Point clouds of each format come back as they were written, in chunks."""

import sys

import numpy as np
import pytest
import trimesh

from ground.errors import SurveyError, UsageError
from survey.clouds.points import chunks, e57, las, ply, text
from survey.clouds.points.reading import open_points
from tests.survey.clouds import scans

POINTS = scans.scan(0.05)
COLOURS = np.random.default_rng(2).integers(0, 256, POINTS.shape).astype(np.uint8)


def read(path, colours=False):
    """All points of a file, with their colours."""
    cloud = open_points(path)
    origin = np.floor(cloud.near)
    found = list(cloud.chunks(origin, colours))
    places = np.concatenate([one.places for one in found]) + origin
    assert cloud.count in (None, len(places))
    assert np.linalg.norm(cloud.near - places.mean(axis=0)) < 10.0
    return (places, np.concatenate([one.colours for one in found])) if colours else places


@pytest.mark.parametrize("ending", ["las", "laz"])
def test_las_and_laz_by_laspy(ending, tmp_path, monkeypatch):
    monkeypatch.setattr(las, "CHUNK", 50)
    path = scans.las(tmp_path / f"a.{ending}", POINTS, COLOURS)
    places, tints = read(path, colours=True)
    np.testing.assert_allclose(places, POINTS, atol=6e-5)
    np.testing.assert_array_equal(tints, COLOURS)


def test_laz_without_colours_has_its_intensity(tmp_path):
    import laspy

    path = scans.las(tmp_path / "a.laz", POINTS)
    cloud = laspy.read(path)
    cloud.intensity = np.linspace(0, 60000, len(POINTS)).astype(np.uint16)
    cloud.write(str(path))
    _, tints = read(path, colours=True)
    assert tints[0].max() == 0
    assert tints[-1].min() == 255


def e57_file(path, points, rotation, translation, **fields):
    import pye57

    with pye57.E57(str(path), mode="w") as file:
        data = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T, strict=True)) | fields
        file.write_scan_raw(data, rotation=rotation, translation=translation)


def test_e57_by_libe57_is_moved_by_its_pose(tmp_path, monkeypatch):
    """A scan from a quarter turn about z, in buffers of fifty points."""
    monkeypatch.setattr(e57, "CHUNK", 50)
    shift = np.array([100.0, 200.0, 12.0])
    turned = (POINTS - shift) @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    tints = dict(zip(("colorRed", "colorGreen", "colorBlue"), COLOURS.T, strict=True))
    half = np.sqrt(0.5)
    e57_file(tmp_path / "a.e57", turned, [half, 0.0, 0.0, half], shift, **tints)
    places, found = read(tmp_path / "a.e57", colours=True)
    np.testing.assert_allclose(places, POINTS, atol=1e-6)  # single precision, near its own origin
    np.testing.assert_array_equal(found, COLOURS)
    (station,) = open_points(tmp_path / "a.e57").stations
    np.testing.assert_allclose(station.position, shift)


def test_invalid_points_of_e57_are_left_out(tmp_path):
    state = np.zeros(len(POINTS), np.int8)
    state[::3] = 2
    e57_file(
        tmp_path / "a.e57", POINTS - scans.ORIGIN, [1.0, 0, 0, 0], scans.ORIGIN, cartesianInvalidState=state
    )
    cloud = open_points(tmp_path / "a.e57")
    places = np.concatenate([one.places for one in cloud.chunks(np.zeros(3), False)])
    np.testing.assert_allclose(places, POINTS[state == 0], atol=1e-6)


def test_spherical_coordinates_of_e57():
    np.testing.assert_allclose(
        e57._from_sphere(np.array([[2.0, np.pi / 2, np.pi / 6]])), [[0.0, 3**0.5, 1.0]], atol=1e-12
    )


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_ply_by_trimesh(encoding, tmp_path, monkeypatch):
    monkeypatch.setattr(ply, "CHUNK", 50)
    near = POINTS - scans.ORIGIN  # trimesh writes single precision
    made = trimesh.PointCloud(near, colors=COLOURS).export(file_type="ply", encoding=encoding.split("_")[0])
    (tmp_path / "a.ply").write_bytes(made)
    places, tints = read(tmp_path / "a.ply", colours=True)
    np.testing.assert_allclose(places, near, atol=1e-6)
    np.testing.assert_array_equal(tints, COLOURS)


@pytest.mark.parametrize("order", ["little", "big"])
def test_ply_by_its_specification_with_fields_that_nobody_reads(order, tmp_path):
    swap = "<" if order == "little" else ">"
    head = (
        f"ply\nformat binary_{order}_endian 1.0\ncomment by hand\nelement vertex {len(POINTS)}\n"
        "property double x\nproperty double y\nproperty double z\nproperty float scalar_C2C\nproperty uchar label\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    )
    kind = np.dtype([("x", "f8"), ("y", "f8"), ("z", "f8"), ("c", "f4"), ("l", "u1")]).newbyteorder(swap)
    rows = np.zeros(len(POINTS), kind)
    for k, name in enumerate("xyz"):
        rows[name] = POINTS[:, k]
    rows["c"] = np.nan
    (tmp_path / "a.ply").write_bytes(head.encode() + rows.tobytes() + b"\x03" + bytes(12))
    np.testing.assert_array_equal(read(tmp_path / "a.ply"), POINTS)


def lines(separator=" ", comma=False, end="\n", head="", more=""):
    rows = [separator.join(f"{one:.4f}" for one in place) + more for place in POINTS]
    body = end.join(rows) + end
    return head + (body.replace(".", ",") if comma else body)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.xyz", lines()),
        ("a.xyz", lines("\t", end="\r\n")),
        ("a.xyz", lines("; ", comma=True)),
        ("a.xyz", lines("  ", comma=True)),
        ("a.csv", lines(",", head="x,y,z\n")),
        ("a.asc", lines(", ", head="# exported\n\n")),
        ("a.txt", "\ufeff" + lines(head="//X Y Z\n")),
        ("a.pts", f"{len(POINTS)}\n" + lines(more=" -1200 12 13 14")),
    ],
)
def test_texts_of_points(name, content, tmp_path, monkeypatch):
    monkeypatch.setattr(text, "LINES", 50)
    (tmp_path / name).write_text(content, encoding="utf-8", newline="")
    np.testing.assert_allclose(read(tmp_path / name), POINTS, atol=6e-5)


def test_pts_of_two_scans_with_colours(tmp_path):
    part = f"{len(POINTS)}\n" + lines(more=" -1200 12 13 14")
    (tmp_path / "a.pts").write_text(part + part, encoding="ascii")
    places, tints = read(tmp_path / "a.pts", colours=True)
    np.testing.assert_allclose(places, np.concatenate([POINTS, POINTS]), atol=6e-5)
    assert (tints == [12, 13, 14]).all()


def test_single_precision_far_away_warns(tmp_path):
    """At 500 km single precision steps by 31 mm, so that 16 mm are lost."""
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n" + "".join(
        f"property float {k}\n" for k in "xyz"
    )
    far = np.array([[500000.0, 5000.0, 10.0]] * 2, "<f4").tobytes()
    (tmp_path / "a.ply").write_bytes(f"{head}end_header\n".encode() + far)
    (warning,) = open_points(tmp_path / "a.ply").warnings
    assert "rounds by up to 16 mm" in warning
    assert chunks.lost_digits(tmp_path / "a.ply", 1000.0) == ()
    e57_file(tmp_path / "a.e57", POINTS + np.array([500000.0, 0.0, 0.0]), [1.0, 0, 0, 0], np.zeros(3))
    (warning,) = open_points(tmp_path / "a.e57").warnings
    assert "16 mm" in warning


@pytest.mark.parametrize("ending", [".ply", ".pcd", ".e57"])
def test_single_precision_in_which_faces_are_lines_is_refused(tmp_path, ending):
    """At 5,411 km single precision steps by half a metre."""
    path = tmp_path / f"a{ending}"
    northing = 5411000.0
    if ending == ".e57":
        e57_file(path, POINTS + np.array([0.0, northing, 0.0]), [1.0, 0, 0, 0], np.zeros(3))
    elif ending == ".pcd":
        rows = "".join(f"{x} {y + northing} {z}\n" for x, y, z in POINTS)
        fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1"
        count = f"WIDTH {len(POINTS)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(POINTS)}\nDATA ascii"
        path.write_text(f"# .PCD v0.7\nVERSION 0.7\n{fields}\n{count}\n{rows}")
    else:
        head = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n"
        head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
        path.write_bytes(head.encode() + np.array([[1.0, northing, 10.0]] * 2, "<f4").tobytes())
    with pytest.raises(SurveyError, match="rounds by up to 250 mm; export in double precision"):
        open_points(path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.laz", b"nothing", "cannot be read as LAS or LAZ"),
        ("a.e57", b"nothing" * 100, "cannot be read as E57"),
        ("a.ply", b"solid", "is not a PLY file"),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nend_header\n",
            "no x, y and z",
        ),
        ("a.xyz", b"a b c\n" * 200, "no line with x, y and z"),
        ("a.xyz", b"1 2 3\n4 5 6\n7 8\n", "a.xyz:3: '7 8' is not a point"),
        ("a.xyz", b"1 2 3\n4 five 6\n", "a.xyz:2"),
    ],
)
def test_damaged_files_are_errors_that_name_the_place(name, content, words, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SurveyError, match=words.replace("(", r"\(")):
        read(tmp_path / name)


def test_a_truncated_file_is_not_half_taken(tmp_path):
    whole = scans.las(tmp_path / "a.laz", POINTS).read_bytes()
    (tmp_path / "a.laz").write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.raises(SurveyError):
        read(tmp_path / "a.laz")
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 5\n" + "".join(
        f"property float {k}\n" for k in "xyz"
    )
    (tmp_path / "a.ply").write_bytes(f"{head}end_header\n".encode() + bytes(40))
    with pytest.raises(SurveyError, match="announces 5 points"):
        read(tmp_path / "a.ply")


def test_other_formats_are_told_the_way_out(tmp_path):
    (tmp_path / "a.rcs").write_bytes(b"")
    with pytest.raises(UsageError, match="ReCap scan files are not read; export it as LAZ or E57"):
        open_points(tmp_path / "a.rcs")
    with pytest.raises(UsageError, match="no such file"):
        open_points(tmp_path / "b.laz")


@pytest.mark.parametrize(("module", "ending"), [("laspy", "las"), ("lazrs", "laz"), ("pye57", "e57")])
def test_missing_packages_name_themselves(module, ending, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / f"a.{ending}").write_bytes(b"")
    with pytest.raises(UsageError, match=rf"need the package {module}.*pip install 'moma-masonry\[clouds\]'"):
        open_points(tmp_path / f"a.{ending}")
