"""Corners of traced outlines by hand, and shapes of annotations, polygons and point files that are known."""

import json

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.clouds.outlines import annotations, coco, tracing, vector
from survey.clouds.outlines.outline import Attributes
from survey.clouds.outlines.tracing import few_corners
from survey.clouds.points import ptx
from survey.clouds.points.chunks import Chunk, PointCloud
from survey.clouds.points.reading import open_points
from survey.clouds.views import orthophoto
from survey.clouds.views.orthophoto import Picture, filled, paint_wall
from survey.clouds.views.sections import Section, _thinned, contour, section_plane
from survey.clouds.wall import Wall


def dense(corners, step=0.5):
    """A ring with a place at every step along the sides of a polygon."""
    places = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, round(float(np.linalg.norm(b - a)) / step))
        places += [a + (b - a) * k / count for k in range(count)]
    return np.array(places)


def matched(found, corners, within):
    """Return whether each corner is found, and no more."""
    apart = np.linalg.norm(found[:, None] - np.array(corners)[None], axis=2)
    return len(found) == len(corners) and (apart.min(axis=0) < within).all()


PENTAGON = np.array([[0.0, 0.0], [30.0, 2.0], [33.0, 20.0], [14.0, 31.0], [-4.0, 17.0]])


@pytest.mark.parametrize("start", [0, 17, 60])
def test_corners_of_a_polygon_are_found_wherever_its_boundary_begins(start):
    ring = np.roll(dense(PENTAGON), start, axis=0)
    assert matched(few_corners(ring, 1.0), PENTAGON, 1e-6)


def test_corners_lie_where_lines_fitted_to_both_sides_meet():
    rng = np.random.default_rng(3)
    ring = dense(PENTAGON) + rng.normal(0.0, 0.15, (len(dense(PENTAGON)), 2))
    # a place of the boundary is off by 0.15; a line through forty of them by a few hundredths
    assert matched(few_corners(ring, 1.0), PENTAGON, 0.25)


def test_corners_are_worn_by_no_more_than_the_tolerance():
    square = np.array([[2.0, 0.0], [18.0, 0.0], [20.0, 2.0], [20.0, 20.0], [0.0, 20.0], [0.0, 2.0]])
    assert matched(few_corners(dense(square), 2.0), [[0, 0], [20, 0], [20, 20], [0, 20]], 0.7)
    assert len(few_corners(dense(square), 0.3)) == 6


def test_small_rings_have_their_extremes():
    ring = dense(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]), 0.25)
    found = few_corners(ring, 5.0)
    assert len(found) >= 3
    assert np.ptp(found, axis=0).tolist() == [2.0, 1.0]
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert few_corners(triangle, 5.0) is triangle


def test_sides_that_cross_are_told():
    bow = np.array([[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]])
    assert tracing._crosses(bow)
    assert not tracing._crosses(bow[[0, 2, 1, 3]])
    # one whose lines meet beyond their ends does not
    assert not tracing._crosses(np.array([[0.0, 0.0], [4.0, 0.0], [5.0, 1.0], [2.0, 0.5], [-3.0, 3.0]]))


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.4, 1.6, 2.5])
def test_a_line_has_the_direction_of_its_places(angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    places = np.array([3.0, -2.0]) + np.outer([-2.0, -1.0, 0.5, 2.5], along)
    middle, direction = tracing._line(places)
    assert middle == pytest.approx([3.0, -2.0])
    assert abs(direction @ along) == pytest.approx(1.0)


def test_ends_of_a_side_are_left_out_where_it_has_enough_places():
    ring = np.column_stack([np.arange(100.0), np.zeros(100)])
    side = tracing._side(ring, 90, 30)  # past the beginning
    cut = int(tracing._SPAN * 40)
    assert side[0, 0] == (90 + cut) % 100
    assert side[-1, 0] == 30 - cut
    assert len(side) == 41 - 2 * cut
    assert tracing._side(ring, 5, 6)[:, 0].tolist() == [5.0, 6.0]


def test_a_thinned_line_keeps_its_ends_and_its_corners():
    line = np.concatenate(
        [
            np.column_stack([np.arange(11.0), np.zeros(11)]),
            np.column_stack([np.full(5, 10.0), np.arange(1.0, 6.0)]),
        ]
    )
    line[4, 1] = 0.2
    assert _thinned(line, 0.3).tolist() == [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0]]
    assert [4.0, 0.2] in _thinned(line, 0.1).tolist()
    # a line that comes back to its start
    loop = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [0.0, 0.0]])
    assert _thinned(loop, 0.5).tolist() == loop.tolist()


def test_shapes_of_annotations_are_boxes_ellipses_and_closed_lines():
    box = annotations._via_ring({"name": "rect", "x": 3, "y": 4, "width": 10, "height": 5})
    assert box.tolist() == [[3.0, 4.0], [13.0, 4.0], [13.0, 9.0], [3.0, 9.0]]
    ellipse = annotations._via_ring({"name": "ellipse", "cx": 10, "cy": 20, "rx": 4, "ry": 2})
    assert ((ellipse - [10.0, 20.0]) / [4.0, 2.0]) ** 2 @ [1.0, 1.0] == pytest.approx(np.ones(len(ellipse)))
    assert ellipse[0] == pytest.approx([14.0, 20.0])
    assert np.ptp(ellipse, axis=0) == pytest.approx([8.0, 4.0], rel=0.02)
    circle = annotations._via_ring({"name": "circle", "cx": 1, "cy": 2, "r": 3})
    assert np.hypot(*(circle - [1.0, 2.0]).T) == pytest.approx(np.full(len(circle), 3.0))
    closed = {"name": "polyline", "all_points_x": [0, 4, 4, 0], "all_points_y": [0, 0, 3, 0]}
    assert annotations._via_ring(closed).tolist() == [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]
    for wrong in (
        {"name": "polyline", "all_points_x": [0, 4, 4], "all_points_y": [0, 0, 3]},
        {"name": "polygon", "all_points_x": [0, 4, 0], "all_points_y": [0, 0, 0]},
        {"name": "point", "cx": 1, "cy": 2},
    ):
        with pytest.raises(ValueError, match=r"open|2|point"):
            annotations._via_ring(wrong)


def labelme(tmp_path, *shapes):
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"shapes": list(shapes)}))
    return list(annotations._of_labelme(path, list(shapes)))


def test_a_circle_is_given_by_its_middle_and_a_place_on_it(tmp_path):
    (circle, box) = labelme(
        tmp_path,
        {"shape_type": "circle", "label": "A", "points": [[10, 20], [13, 24]]},
        {"shape_type": "rectangle", "label": "B", "points": [[1, 2], [5, 9]]},
    )
    assert np.hypot(*(circle.ring - [10.0, 20.0]).T) == pytest.approx(np.full(len(circle.ring), 5.0))
    assert box.ring.tolist() == [[1.0, 2.0], [5.0, 2.0], [5.0, 9.0], [1.0, 9.0]]
    assert box.where.endswith("shape 2")
    with pytest.raises(SurveyError, match="'line' is no outline"):
        labelme(tmp_path, {"shape_type": "line", "points": [[1, 2], [5, 9], [4, 4]]})


NONE = Attributes()


@pytest.mark.parametrize(("side", "doubted"), [(2.0, False), (3.0, True)])
def test_a_polygon_in_pieces_is_doubted_where_more_than_a_twentieth_is_lost(side, doubted):
    """Of 100 and 4 or 9: 3.8 or 8.3 %."""
    large = [0.5, 0.5, 10.5, 0.5, 10.5, 10.5, 0.5, 10.5]
    small = [20, 0, 20 + side, 0, 20 + side, side, 20, side]
    found = coco._polygon(1, "A", [small, large], NONE, 1.0, "a.json")
    assert found.corners.tolist() == [[0, 0], [10, 0], [10, 10], [0, 10]]
    assert bool(found.doubts) == doubted
    if doubted:
        assert "the largest, with 92% of the area" in found.doubts[0][1]


def test_runs_of_a_mask_go_down_its_columns():
    columns, first = coco.mask_columns({"size": [4, 5], "counts": [5, 2, 3, 1, 9]}, "")
    whole = np.zeros(20, bool)
    whole[[5, 6, 10]] = True
    assert first == 1
    assert columns.tolist() == whole.reshape(5, 4).T[:, 1:3].tolist()
    # to the end of a column, and no farther
    columns, first = coco.mask_columns({"size": [4, 5], "counts": [4, 4, 12]}, "")
    assert (columns.shape, first, columns.all()) == ((4, 1), 1, True)
    empty, first = coco.mask_columns({"size": [4, 5], "counts": [20]}, "")
    assert (empty.shape, first) == ((4, 0), 0)
    with pytest.raises(SurveyError, match="21 pixels for a picture of 5 × 4"):
        coco.mask_columns({"size": [4, 5], "counts": [5, 16]}, "")


@pytest.mark.parametrize(("side", "pieces"), [(1.0, 0), (4.0, 1)])
def test_of_several_polygons_the_largest_is_taken_and_large_others_are_told(side, pieces):
    shapely = pytest.importorskip("shapely")
    parts = [shapely.box(20, 0, 20 + side, side), shapely.box(0, 0, 10, 10)]
    found = vector._outline(1, 7, shapely.MultiPolygon(parts), NONE, "a.gpkg")
    assert np.ptp(found.corners, axis=0).tolist() == [10.0, 10.0]
    assert len(found.doubts) == pieces
    if pieces:
        assert found.doubts[0] == ("in pieces", "2 pieces; the largest is taken")
    hole = shapely.box(0, 0, 10, 10) - shapely.box(4, 4, 5, 5)
    assert vector._outline(1, 7, hole, NONE, "").doubts[0][0] == "holes"
    assert vector._outline(1, 7, shapely.LineString([(0, 0), (1, 0), (1, 1)]), NONE, "").code == "S7"


HEAD = (
    "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT {1}\n{2}DATA ascii\n"
)


def test_a_pcd_has_as_many_points_as_its_width_times_its_height(tmp_path):
    path = tmp_path / "a.pcd"
    rows = "".join(f"{k} {2 * k} {3 * k}\n" for k in range(6))
    for points in ("", "POINTS 6\n"):
        path.write_text(HEAD.format(3, 2, points) + rows)
        cloud = open_points(path)
        places = np.concatenate([chunk.places for chunk in cloud.chunks(np.zeros(3), False)])
        assert places.tolist() == [[k, 2 * k, 3 * k] for k in range(6)]
    path.write_text(HEAD.format(4, 2, "") + rows)
    with pytest.raises(SurveyError, match="announces 8 points"):
        list(open_points(path).chunks(np.zeros(3), False))
    assert 2 * 12 * 3 > len(rows) + 1 > 2 * 12 / 3
    path.write_text(HEAD.format(4, 3, "") + rows)
    with pytest.raises(SurveyError, match="more than it has room for"):
        open_points(path)


def test_a_wrong_row_of_a_pcd_is_told_with_its_place(tmp_path):
    path = tmp_path / "a.pcd"
    path.write_text(HEAD.format(4, 1, "") + "1 2 3\n4 5 6\n7 x 9\n1 2 3\n")
    with pytest.raises(SurveyError) as raised:
        list(open_points(path).chunks(np.zeros(3), False))
    assert "points 1 to 4" in str(raised.value.where)


def scan(columns, rows, shift, places):
    pose = [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (*shift, 1)]
    head = [
        f"{columns}",
        f"{rows}",
        "0 0 0",
        "1 0 0",
        "0 1 0",
        "0 0 1",
        *(" ".join(map(str, row)) for row in pose),
    ]
    return "\n".join([*head, *places]) + "\n"


def test_scans_of_a_ptx_follow_one_another_with_their_own_poses(tmp_path):
    path = tmp_path / "a.ptx"
    first = scan(2, 2, (10, 0, 0), ["1 0 0 0.5", "0 0 0 0.5", "2 0 0 0.5", "3 0 0 0.5"])
    path.write_text(first + scan(1, 2, (0, 5, 0), ["1 1 0 0.5", "1 2 0 0.5"]))
    cloud = open_points(path)
    places = np.concatenate([chunk.places for chunk in cloud.chunks(np.zeros(3), False)])
    assert places.tolist() == [[11, 0, 0], [12, 0, 0], [13, 0, 0], [1, 6, 0], [1, 7, 0]]
    assert [station.position.tolist() for station in cloud.stations] == [[10, 0, 0], [0, 5, 0]]
    # the second scan begins with line 15, and its points with line 25
    path.write_text(first + scan(1, 2, (0, 5, 0), ["1 x 0 0.5", "1 2 0 0.5"]))
    with pytest.raises(SurveyError) as raised:
        open_points(path)
    assert "lines 25 to 25" in str(raised.value.where)
    path.write_text(first + scan(1, 3, (0, 5, 0), ["1 1 0 0.5", "1 2 0 0.5"]))
    with pytest.raises(SurveyError, match="announces 3 points and holds 2") as raised:
        open_points(path)
    assert str(raised.value.where).endswith(":15")
    assert ptx.is_ptx(path)


WALL = Wall(np.array([100.0, 50.0, 10.0]), np.array([[0.8, 0.6, 0.0], [0.0, 0.0, 1.0], [0.6, -0.8, 0.0]]))


def cloud(local, colours=None):
    """A cloud of places in the frame of the wall."""
    places = WALL.origin + np.array(local) @ WALL.axes

    def chunks(origin, wanted):
        yield Chunk(places - origin, np.array(colours, np.uint8) if colours is not None and wanted else None)

    return PointCloud("a.las", len(places), places[0], chunks, ())


def painted(local, colours=None, pixel=0.1, slab=0.5):
    return paint_wall([cloud(local, colours)], WALL, pixel, slab, lambda *_: None)


def test_a_painted_wall_has_the_means_of_its_pixels_where_they_lie():
    local = [[1.03, 2.02, 0.1], [1.06, 2.08, 0.2], [1.55, 2.31, -0.1], [1.55, 2.31, 0.9]]
    colours = [[100, 0, 10], [200, 50, 20], [9, 9, 9], [0, 0, 0]]
    picture, read, shown = painted(local, colours)
    assert (read, shown) == (4, 3)
    assert picture.low == pytest.approx([1.0, 2.0])
    height, width = picture.counts.shape
    row, column = np.argwhere(picture.counts == 2)[0]
    # the pixel from 1.0 to 1.1 m along and from 2.0 to 2.1 m up, which is the lowest row
    assert (row, column) == (height - 1, 0)
    assert picture.depths[row, column] == pytest.approx(0.15)
    assert picture.colours[row, column].tolist() == [150, 25, 15]
    assert picture.counts[height - 4, 5] == 1
    assert picture.depths[height - 4, 5] == pytest.approx(-0.1)
    assert picture.counts.sum() == 3
    assert width >= 6


def test_a_relief_is_light_where_its_normal_is_towards_the_light():
    rows, columns = np.mgrid[:20, :30]
    level = orthophoto._relief(np.zeros((20, 30), np.float32), 0.1)[10, 15, 0]
    for slope, lighter in (
        ((0.0, 1.0), True),
        ((0.0, -1.0), False),
        ((1.0, 0.0), True),
        ((-1.0, 0.0), False),
    ):
        # rising to the right turns the normal to the left, and rising downwards turns it up: the light is upper left
        depths = (0.1 * (slope[0] * rows + slope[1] * columns)).astype(np.float32)
        shade = orthophoto._relief(depths, 0.1)[10, 15, 0]
        assert (shade > level) == lighter
    light = np.array(orthophoto._LIGHT) / np.linalg.norm(orthophoto._LIGHT)
    assert level == int(230.0 * light[2])
    tilted = orthophoto._relief((0.1 * columns).astype(np.float32), 0.1)[10, 15, 0]
    assert tilted == pytest.approx(230.0 * (light @ np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)), abs=1.0)


def test_a_gap_is_closed_by_the_mean_of_its_neighbours():
    values = np.array([[1.0, 2.0, 3.0], [4.0, np.nan, 6.0], [7.0, 8.0, 9.0]], np.float32)
    assert filled(values)[1, 1] == pytest.approx((2.0 + 4.0 + 6.0 + 8.0) / 4.0)


def test_a_section_of_a_wall_lies_in_its_plane():
    along = np.linspace(0.0, 2.0, 400)
    places = WALL.origin + np.column_stack([along, np.full(400, 1.5), 0.05 * np.sin(3.0 * along)]) @ WALL.axes
    section = Section(section_plane("z=11.5", WALL), 0.1, 0.02)
    section.add(places - WALL.origin, WALL.origin)
    section.add(places - WALL.origin + [0.0, 0.0, 0.06], WALL.origin)  # 6 cm above it
    (line,) = section.lines(0.01)
    assert line[:, 2] == pytest.approx(np.full(len(line), 11.5))
    local = (line - WALL.origin) @ WALL.axes.T
    assert local[:, 2] == pytest.approx(0.05 * np.sin(3.0 * local[:, 0]), abs=0.02)
    assert np.ptp(local[:, 0]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("text", "origin", "normal"),
    [
        ("s=2", (101.6, 51.2, 10.0), (-0.8, -0.6, 0.0)),
        ("d=-0,5", (99.7, 50.4, 10.0), (0.6, -0.8, 0.0)),
        ("z=3", (100.0, 50.0, 3.0), (0.0, 0.0, 1.0)),
    ],
)
def test_planes_of_sections_lie_across_or_along_the_wall(text, origin, normal):
    plane = section_plane(text, WALL)
    assert plane.origin == pytest.approx(origin)
    assert np.abs(plane.axes[2] @ normal) == pytest.approx(1.0)


def test_a_contour_lies_where_the_surface_crosses_its_distance():
    pytest.importorskip("contourpy")
    # a ridge: depth falls to both sides of s = 1.5 m, by one to one
    columns = 1.0 + 0.1 * (np.arange(10) + 0.5)
    depths = np.tile(0.5 - np.abs(columns - 1.5), (8, 1)).astype(np.float32)
    picture = Picture(WALL, np.array([1.0, 2.0]), 0.1, np.ones((8, 10), np.float32), depths, None, False)
    lines = contour(picture, section_plane("d=0.2", WALL), 0.3, 0.01)
    assert len(lines) == 2
    local = [(line - WALL.origin) @ WALL.axes.T for line in lines]
    assert sorted(float(line[:, 0].mean()) for line in local) == pytest.approx([1.2, 1.8], abs=0.01)
    for line in local:
        assert line[:, 2] == pytest.approx(np.full(len(line), 0.2))
        assert sorted((line[:, 1].min(), line[:, 1].max())) == pytest.approx([2.05, 2.75], abs=0.01)
    assert contour(picture, section_plane("d=0.2", WALL), 0.8, 0.01) == []
