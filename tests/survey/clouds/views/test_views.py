"""Frames of walls, world files, orthophotos and sections."""

import numpy as np
import pytest
from PIL import Image

from ground.errors import SurveyError, UsageError
from survey.clouds.points.chunks import Chunk, PointCloud
from survey.clouds.views.orthophoto import DEPTH_STEP, find_wall, paint_wall, write_picture
from survey.clouds.views.sections import Section, contour, join, section_plane
from survey.clouds.wall import Wall, read_wall, wall_lines
from survey.clouds.world import world_of
from survey.records.survey import Station
from tests.survey.clouds import scans

POINTS = scans.scan(0.005)
WALL = Wall(scans.ORIGIN, np.array([scans.RIGHT, scans.UP, scans.OUT]))


def silent(stage, done, total):
    pass


def source(points, colours=None, stations=()):
    def chunks(origin, wanted):
        parts = np.array_split(np.arange(len(points)), 3)
        return iter(
            [Chunk(points[k] - origin, colours[k] if colours is not None and wanted else None) for k in parts]
        )

    return PointCloud("a.laz", len(points), points[0], chunks, stations)


def test_a_frame_comes_back_from_its_file(tmp_path):
    turned = read_wall("2,1 5,5")
    (tmp_path / "w.toml").write_text(wall_lines(turned), encoding="utf-8")
    back = read_wall(str(tmp_path / "w.toml"))
    np.testing.assert_allclose(back.axes, turned.axes, atol=1e-15)
    np.testing.assert_array_equal(back.origin, [2.0, 1.0, 0.0])
    np.testing.assert_allclose(
        turned.axes[2], [0.8, -0.6, 0.0], atol=1e-15
    )  # towards who sees 2,1 at the left


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("origin = [1, 2]\nright = [1, 0, 0]", "origin is"),
        ("origin = [1, 2, nan]\nright = [1, 0, 0]", "origin is"),
        ("origin = [1, 2, 3]\nright = [1, 0, 0]\nup = [1, 0, 1]", "45.00° between right and up"),
        ("origin = [1, 2, 3]\nright = [0, 0, 1]", "right is upright"),
        ("origin = [1, 2, 3]\nright = [0, 0, 0]", "without length"),
        ("origin = [1, 2, 3]\nright = [1, 0, 0]\nleft = 1", "unknown key 'left'"),
        ("origin 1", "cannot be read as TOML"),
    ],
)
def test_wrong_frames_are_told(text, words, tmp_path):
    (tmp_path / "w.toml").write_text(text, encoding="utf-8")
    with pytest.raises(SurveyError, match=words):
        read_wall(str(tmp_path / "w.toml"))


def test_what_is_no_frame_is_told():
    with pytest.raises(UsageError, match="is no file"):
        read_wall("elsewhere.toml")
    with pytest.raises(UsageError, match="both points are the same"):
        read_wall("1,1 1,1")


def test_damaged_world_files_are_told(tmp_path):
    for text, words in (("1 2 3", "has 3 numbers"), ("0 0 0 0 0 0", "no area"), ("a b", "cannot be read")):
        (tmp_path / "a.pgw").write_text(text, encoding="ascii")
        with pytest.raises(SurveyError, match=words):
            world_of(tmp_path / "a.png")


def test_the_largest_upright_plane_is_the_wall():
    """The floor before it is larger, and the scanner says from which side it is seen."""
    rng = np.random.default_rng(3)
    floor = (
        scans.ORIGIN
        + rng.uniform(0.0, 2.5, (30000, 1)) * scans.RIGHT
        + rng.uniform(0.0, 3.0, (30000, 1)) * scans.OUT
    )
    everything = np.concatenate([floor, POINTS])
    for stations in ((), (Station("s1", scans.ORIGIN + 4.0 * scans.OUT),)):
        wall = find_wall([source(everything, stations=stations)], silent)
        assert wall.axes[2] @ scans.OUT > 0.999
        assert abs((wall.origin - scans.ORIGIN) @ scans.OUT) < 0.02
        assert abs((wall.origin - scans.ORIGIN) @ scans.RIGHT) < 0.02
    behind = find_wall(
        [source(everything, stations=(Station("s1", scans.ORIGIN - 4.0 * scans.OUT),))], silent
    )
    assert behind.axes[2] @ scans.OUT < -0.999
    with pytest.raises(SurveyError, match="no upright plane"):
        find_wall([source(floor)], silent)


def test_an_orthophoto_lies_where_its_world_file_says(tmp_path):
    """A stone is painted red; its pixels lie within its outline, and its depth is that of its face."""
    local = (POINTS - scans.ORIGIN) @ np.array([scans.RIGHT, scans.UP]).T
    ring = scans.rings()[4]
    inside = ((local > ring[0]) & (local < ring[2])).all(axis=1)
    colours = np.where(inside[:, None], (250, 0, 0), (90, 90, 90)).astype(np.uint8)
    picture, read, shown = paint_wall([source(POINTS, colours)], WALL, 0.01, 0.1, silent)
    assert read == shown == len(POINTS)
    lowest = write_picture(picture, tmp_path / "wall.png", tmp_path / "depth.png")
    places = world_of(tmp_path / "wall.png")
    pixels = np.asarray(Image.open(tmp_path / "wall.png"))
    row, column = np.nonzero((pixels[..., 0] > 240) & (pixels[..., 1] < 10))
    flat = places.place(np.column_stack([column, row]).astype(float))
    np.testing.assert_allclose(flat.min(axis=0), ring[0], atol=0.012)
    np.testing.assert_allclose(flat.max(axis=0), ring[2], atol=0.012)
    numbers = np.asarray(Image.open(tmp_path / "depth.png")).astype(float)
    depth = lowest + (numbers[row, column] - 1.0) * DEPTH_STEP
    assert abs(np.median(depth) - scans.RELIEF[4]) < 0.0005
    assert picture.coloured


def test_a_cloud_without_colours_is_drawn_as_a_relief():
    picture, _, _ = paint_wall([source(POINTS)], WALL, 0.01, 0.1, silent)
    assert not picture.coloured
    assert picture.colours.std() > 5


def test_pictures_beyond_memory_and_walls_elsewhere_are_told():
    with pytest.raises(UsageError, match=r"pixels.*--pixel 0\.\d"):
        paint_wall([source(POINTS)], WALL, 0.0001, 0.1, silent)
    far = Wall(scans.ORIGIN + 3.0 * scans.OUT, WALL.axes)
    with pytest.raises(SurveyError, match=r"within 0\.1 m of the wall"):
        paint_wall([source(POINTS)], far, 0.01, 0.1, silent)


def length(line):
    return np.linalg.norm(np.diff(line, axis=0), axis=1).sum()


def test_a_level_section_is_the_line_of_the_wall():
    section = Section(section_plane("z=10.15", WALL), 0.02, 0.01)
    for part in np.array_split(POINTS, 4):
        section.add(part - [50.0, 0, 0], np.array([50.0, 0, 0]))
    lines = section.lines(0.0025)
    assert 1.2 < length(lines[0]) < 1.7  # of 1.5 m, and in and out of two joints
    local = (lines[0] - scans.ORIGIN) @ np.array([scans.RIGHT, scans.UP, scans.OUT]).T
    np.testing.assert_allclose(local[:, 1], 0.15, atol=1e-9)
    assert local[:, 2].min() > -0.02
    assert local[:, 2].max() < 0.01


def test_sections_join_closed_curves_and_leave_noise_out():
    rng = np.random.default_rng(5)
    angle = np.arange(0.0, 2.0 * np.pi, 0.01)
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    lines = join(np.concatenate([ring, rng.uniform(3.0, 9.0, (5, 2))]), 0.025, 0.002, 4)
    assert len(lines) == 1
    assert length(lines[0]) == pytest.approx(2.0 * np.pi, rel=0.01)
    np.testing.assert_array_equal(lines[0][0], lines[0][-1])


def test_a_section_along_the_wall_is_the_contour_of_its_stones():
    picture, _, _ = paint_wall([source(POINTS)], WALL, 0.005, 0.1, silent)
    lines = contour(picture, section_plane("d=-0.008", WALL), 0.3, 0.002)
    assert 5.0 < sum(map(length, lines)) < 11.0  # the sides of six stones that are not at the end of the wall
    assert all(abs((line - scans.ORIGIN) @ scans.OUT + 0.008).max() < 1e-9 for line in lines)
    closed = [line for line in lines if np.allclose(line[0], line[-1])]
    assert closed
    assert 1.3 < length(closed[0]) < 1.9  # around one stone of 0.49 by 0.29 m, or more than one


def test_wrong_sections_are_told():
    with pytest.raises(UsageError, match="--section: cannot be read: 'y=2'"):
        section_plane("y=2", WALL)
