"""Stones measured in a cloud: planes with their covariance, clutter, review, rejects."""

import numpy as np
import pytest

from ground.errors import SurveyError, UsageError
from survey.clouds import cloud as cloud_module
from survey.clouds.cloud import open_cloud
from survey.clouds.collecting import collect_points
from survey.clouds.outlines.reading import read_outlines
from survey.clouds.placing import place_outlines
from survey.clouds.points.chunks import Chunk, PointCloud
from survey.clouds.settings import CloudOptions
from survey.clouds.wall import Wall, read_wall
from survey.faces.faces import outline_face
from survey.records.survey import Reject
from survey.registration.stones import survey_stones
from synthetic.buildings.window import make_window
from synthetic.scan import outlines_text, scan_window, visible_corners
from tests.survey.clouds import scans


def measured(folder, points, outlines, **options):
    """The stream of a cloud in a text file."""
    path = scans.xyz(folder / "scan.xyz", points)
    return open_cloud([path], CloudOptions(outlines=outlines, **options))


@pytest.fixture
def wall(tmp_path):
    return read_wall(str(scans.frame(tmp_path)))


def test_faces_are_found_within_their_standard_deviations(tmp_path, wall):
    stream = measured(
        tmp_path, scans.scan(), scans.geojson(tmp_path / "a.geojson", course=[1, 1, 1, 2, 2, 2]), wall=wall
    )
    records = list(stream.blocks)
    assert [(one.code, one.course) for one in records] == list(
        zip(scans.CODES, (1, 1, 1, 2, 2, 2), strict=True)
    )
    assert stream.review == ()
    for record, relief, ring in zip(records, scans.RELIEF, scans.rings(), strict=True):
        face = outline_face(record, stream.head.viewpoint(None))
        assert face.fit.normal @ scans.OUT > 0.9999
        height = (face.fit.centroid - scans.ORIGIN) @ scans.OUT
        assert abs(height - relief) < 4.0 * face.fit.covariance[2, 2] ** 0.5
        assert 2e-5 < face.fit.covariance[2, 2] ** 0.5 < 2e-4
        flat = (face.outline - scans.ORIGIN) @ np.array([scans.RIGHT, scans.UP]).T
        assert max(np.linalg.norm(flat - corner, axis=1).min() for corner in ring) < 1e-3
        assert record.notes["points"].endswith("independent ones")
        assert record.spans == (range(record.line, record.line + 1),)


def window(spacing, clutter):
    """The window bay's true stones, and the records of its scan with jittered outlines."""
    bay = make_window()
    return bay, scan_window(bay, spacing, clutter=clutter)


@pytest.mark.parametrize("clutter", [False, True])
def test_the_window_bay_is_measured_through_jitter_and_clutter(clutter, tmp_path, monkeypatch):
    """Corners within 8 mm RMS with 5 mm of jitter a coordinate; planes within three predicted sigma in 99 %."""
    bay, scan = window(0.009, clutter)
    assert 0.04 < scan.clutter.mean() < 0.07 if clutter else not scan.clutter.any()
    (tmp_path / "a.geojson").write_text(outlines_text(scan), encoding="utf-8")
    source = PointCloud(
        tmp_path / "scan.laz",
        len(scan.points),
        scan.points[0],
        lambda origin, colours: iter([Chunk(part - origin) for part in np.array_split(scan.points, 7)]),
    )
    monkeypatch.setattr(cloud_module, "open_points", lambda path: source)
    options = CloudOptions(
        outlines=tmp_path / "a.geojson", wall=Wall(bay.frame.origin, bay.frame.axes), sigma=0.0015
    )
    stream = open_cloud([source.path], options)
    true = {stone.plan.code: (stone, one) for stone, one in zip(bay.stones, bay.measured, strict=True)}
    errors, corners = [], []
    for record in stream.blocks:
        assert not isinstance(record, Reject)
        stone, survey = true[record.code]
        face = outline_face(record, stream.head.viewpoint(None))
        height = (stone.offset - stone.normal @ face.fit.centroid) / (stone.normal @ face.fit.normal)
        tilts = face.fit.axes @ (stone.normal - face.fit.normal)
        errors.append(np.array([*tilts, height]) / np.sqrt(face.fit.covariance.diagonal()))
        seen = stone.on_face(bay.frame, visible_corners(stone, survey))
        corners += [np.linalg.norm(face.outline - corner, axis=1).min() for corner in seen]
    assert len(errors) == 98
    assert np.sqrt(np.mean(np.square(corners))) < 0.008
    # one stone in a hundred may lie beyond
    assert np.mean(np.abs(errors).max(axis=1) <= 3.0) >= 0.989
    assert 0.6 < np.std(errors) < 1.15


def test_points_of_a_rough_scan_are_worth_less_than_their_number(tmp_path, wall):
    """With roughness of 2 mm over some centimetres, thousands of points are worth some hundred."""
    from scipy.ndimage import gaussian_filter

    points = scans.scan(0.005)
    local = (points - scans.ORIGIN) @ np.array([scans.RIGHT, scans.UP]).T
    field = gaussian_filter(np.random.default_rng(8).normal(size=(320, 140)), 4.0)
    cells = np.floor(local / 0.005).astype(int)
    rough = points + np.outer(field[cells[:, 0], cells[:, 1]] * (0.002 / field.std()), scans.OUT)
    outlines = scans.geojson(tmp_path / "a.geojson")
    smooth, bumpy = (
        [one.notes["points"] for one in measured(tmp_path, each, outlines, wall=wall).blocks]
        for each in (points, rough)
    )
    for even, uneven in zip(smooth, bumpy, strict=True):
        worth = [int(text.split("as good as ")[1].split()[0]) for text in (even, uneven)]
        assert worth[1] < int(uneven.split()[0]) / 10
        assert worth[1] < 0.7 * worth[0]


def test_what_hangs_before_a_stone_is_left_out(tmp_path, wall):
    """A board 60 mm before the wall hides a third of one stone; the others and its plane stay as they are."""
    points = scans.scan()
    local = (points - scans.ORIGIN) @ np.array([scans.RIGHT, scans.UP]).T
    board = (local[:, 0] > 0.7) & (local[:, 0] < 0.86) & (local[:, 1] < 0.3)
    points[board] += 0.06 * scans.OUT
    stream = measured(tmp_path, points, scans.geojson(tmp_path / "a.geojson"), wall=wall)
    record = list(stream.blocks)[1]
    face = outline_face(record, stream.head.viewpoint(None))
    assert abs((face.fit.centroid - scans.ORIGIN) @ scans.OUT - scans.RELIEF[1]) < 0.001
    assert [(one.code, one.reason) for one in stream.review] == [("A2", "covered")]


def test_outlines_in_space_need_no_wall(tmp_path):
    shapes = [scans.in_space(ring) for ring in scans.rings()]
    stream = measured(tmp_path, scans.scan(), scans.geojson(tmp_path / "a.geojson", shapes), sigma=0.001)
    for one in survey_stones(stream).stones:
        if isinstance(one, Reject):  # no depth is known
            assert "depth" in str(one.error)
    records = list(measured(tmp_path, scans.scan(), tmp_path / "a.geojson", sigma=0.001).blocks)
    face = outline_face(records[0], None)
    assert face.fit.normal @ scans.OUT > 0.9999  # drawn counter-clockwise as seen from outside


def test_outlines_of_a_plane_need_a_wall(tmp_path):
    with pytest.raises(UsageError, match=r'the outlines lie in a plane.*--wall "X,Y X,Y"'):
        measured(tmp_path, scans.scan(0.05), scans.geojson(tmp_path / "a.geojson"))


def test_a_cloud_beside_its_outlines_is_told(tmp_path, wall):
    path = scans.geojson(tmp_path / "a.geojson")
    with pytest.raises(
        SurveyError,
        match=r"none of its \d+ points lies in an outline: .*0.01 to 0.59 m up, the cloud .* 5.00 to",
    ):
        measured(tmp_path, scans.scan(0.05) + np.array([0.0, 0.0, 5.0]), path, wall=wall)


@pytest.mark.parametrize("framed", [False, True])
def test_a_cloud_that_was_shifted_near_zero_is_told(tmp_path, wall, framed):
    shift = np.array([2683000.0, 1248000.0, 0.0])
    if framed:
        path = scans.geojson(tmp_path / "a.geojson")
        given = {"wall": Wall(wall.origin + shift, wall.axes)}
    else:
        path = scans.geojson(tmp_path / "a.geojson", [scans.in_space(ring) + shift for ring in scans.rings()])
        given = {}
    with pytest.raises(SurveyError, match="global shift, export it with true coordinates"):
        measured(tmp_path, scans.scan(0.05), path, **given)


@pytest.mark.parametrize(("unit", "length"), [("cm", 0.01), ("mm", 0.001)])
def test_the_unit_of_outlines_beside_a_cloud_is_asked_for(tmp_path, wall, unit, length):
    path = scans.geojson(tmp_path / "a.geojson", [ring / length for ring in scans.rings()])
    with pytest.raises(
        SurveyError, match=f"6 of 6 outlines have the size of stones in {unit}, .*--unit {unit}, or"
    ):
        measured(tmp_path, scans.scan(0.05), path, wall=wall)
    stones = list(measured(tmp_path, scans.scan(), path, wall=wall, outline_unit=length).blocks)
    assert [one.code for one in stones] == list(scans.CODES)


def test_the_review_lists_overlaps_odd_sizes_leaks_scores_and_few_points(tmp_path, wall):
    shapes = [*scans.rings(), *(scans.rings()[0] + (0.0, 0.6 * k) for k in range(1, 8))]
    shapes[1] = shapes[1] - (0.1, 0.0)  # over its neighbour
    a, b = scans.rings()[2][0], scans.rings()[2][2]
    shapes[2] = np.array(
        [a, (b[0], a[1]), b, b - (0.03, 0), (b[0] - 0.03, a[1] + 0.03), a + np.array((0, 0.03))]
    )  # along joints
    shapes[3] = scans.rings()[3] * (1, 0.5) + (0, 0.16)
    shapes[4] = np.array([(0.7, 0.4), (0.76, 0.4), (0.76, 0.44), (0.7, 0.44)])
    codes = [*scans.CODES[:5], "A1", *(f"X{k}" for k in range(1, 8))]
    path = scans.geojson(tmp_path / "a.geojson", shapes, codes, score=[0.9, 0.9, 0.9, 0.3, *[0.9] * 9])
    stream = measured(tmp_path, scans.scan(), path, wall=wall)
    found = {(one.code, one.reason) for one in stream.review}
    assert {
        ("A1", "overlap"),
        ("A3", "leak"),
        ("B1", "low score"),
        ("B2", "odd size"),
        ("B2", "rejected"),
    } <= found
    assert ("X1", "rejected") in found
    rejects = {one.code: str(one.error) for one in stream.blocks if isinstance(one, Reject)}
    assert "too few points: 0 within its outline and 0.15 m" in rejects["X1"]
    assert "a second stone A1; the first is" in rejects["A1"]
    assert "feature 5" in rejects["A1"]


def test_a_sparse_scan_is_doubtful(tmp_path, wall):
    stream = measured(
        tmp_path, scans.scan(0.045), scans.geojson(tmp_path / "a.geojson"), wall=wall, margin=0.0
    )
    assert {one.reason for one in stream.review} == {"few points"}
    for record, relief in zip(stream.blocks, scans.RELIEF, strict=True):
        fit = outline_face(record, stream.head.viewpoint(None)).fit
        assert abs((fit.centroid - scans.ORIGIN) @ scans.OUT - relief) < 4.0 * fit.covariance[2, 2] ** 0.5


def test_memory_depends_on_the_stones_alone(tmp_path, wall):
    drawing = read_outlines(scans.geojson(tmp_path / "a.geojson"))
    placed = place_outlines(drawing.outlines, wall, ())
    sizes = []
    for repeats in (1, 20):
        points = scans.scan(0.02)
        source = PointCloud(
            tmp_path / "a.laz", None, scans.ORIGIN, lambda o, _, n=repeats, p=points: iter([Chunk(p - o)] * n)
        )
        collected = collect_points([source], placed, np.full(6, 0.01), 0.1)
        sizes.append(sum(one.nbytes for one in collected.samples))
        assert collected.read == repeats * len(points)
        assert collected.inside == collected.samples.counts.sum()
    assert sizes[0] == sizes[1]


def test_the_order_of_files_is_one_survey(tmp_path, wall):
    """A wall scanned in two files, of which each holds half of every stone, is as good as one."""
    points, outlines = scans.scan(), scans.geojson(tmp_path / "a.geojson")
    halves = [scans.xyz(tmp_path / f"{k}.xyz", points[k::2]) for k in range(2)]
    stream = open_cloud(halves, CloudOptions(outlines=outlines, wall=wall))
    counts = [int(one.notes["points"].split()[0]) for one in stream.blocks]
    whole = [
        int(one.notes["points"].split()[0]) for one in measured(tmp_path, points, outlines, wall=wall).blocks
    ]
    assert counts == whole
