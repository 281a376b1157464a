"""Pictures of closed joints: what is drawn is what the report says, and it is seen."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from mechanics.scene.shapes import BOX_FACES
from pipelines.draw.closing_pictures import (
    closing_surface,
    draw_elevations,
    draw_in_space,
    flat_facades,
    viewpoint,
)
from pipelines.draw.elevations.closing_shapes import Stages, closing_shapes, places
from pipelines.draw.elevations.sheet import FLAG
from pipelines.draw.offscreen.closing import ClosingSurface
from pipelines.draw.offscreen.jobs import load_surface, save_surface
from survey.geometry.solids import Solid, area_vector
from survey.joints.report import ClosingReport, Gap, Overlap, StoneJoint
from survey.joints.settings import JointMode
from synthetic.buildings.quoins import corner
from synthetic.buildings.vaults import barrel_vault
from tests.pipelines.results_by_hand import box

pytestmark = pytest.mark.draws
AWAY = np.array([0.0, -1.0, 0.0])


def wall(rows=3, columns=4):
    """Stones of 0.6 m by 0.4 m by 0.3 m in a grid without gaps, seen from -y."""
    return [
        Solid(
            f"{row}-{k}",
            np.array(box((0.6 * k, 0.0, 0.3 * row), (0.6 * k + 0.6, 0.4, 0.3 * row + 0.3))),
            BOX_FACES,
        )
        for row in range(rows)
        for k in range(columns)
    ]


def face_of(solid):
    """The side that looks to -y."""
    polygons = [solid.vertices[list(face)] for face in solid.faces]
    return max(polygons, key=lambda one: float(area_vector(one) @ AWAY))


def bed(lower, upper, width=0.012, left_open=""):
    place = upper.vertices.mean(axis=0) * [1, 1, 0] + [0, 0, upper.vertices[:, 2].min()]
    return StoneJoint(
        (upper.code, lower.code),
        -1 if left_open else 0,
        width,
        0.5,
        0.24,
        place,
        np.array([0.0, 0, 1]),
        left_open,
    )


def report(stones, **given):
    told = {
        "mode": JointMode.CLOSE,
        "joints": (),
        "displacement": {one.code: np.zeros(8) for one in stones},
        "volume_change": {},
        "alone": (),
        "gaps": (),
        "overlaps": (),
    }
    return ClosingReport(**told | given)


def shapes_of(stones, simplified=None, hypotheses=(), **given):
    faces = [face_of(one) for one in stones]
    moved = {one.code: np.zeros(8) for one in stones} if simplified is None else simplified
    return closing_shapes(
        "A wall", Stages(stones, stones, stones), moved, report(stones, **given), faces, frozenset(hypotheses)
    )


def pixels_of(path):
    from PIL import Image

    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def count_of(pixels, colour):
    return int((np.abs(pixels - 255.0 * np.array(to_rgb(colour))).max(axis=2) < 3).sum())


def test_places_are_told_with_the_worst_first():
    gaps = (
        Gap(("A", "B"), 0.004, 0.1, np.zeros(3), "beyond the bound"),
        Gap(("C", "D"), 0.012, 0.2, np.ones(3), "it opens too wide"),
    )
    overlaps = (Overlap(("E", "F"), 1e-4, 0.002, np.zeros(3)),)
    found = places(report([], gaps=gaps, overlaps=overlaps))
    assert [one.text for one in found] == [
        "E and F lie 2.0 mm in each other",
        "C and D open by 12.0 mm: it opens too wide",
        "A and B open by 4.0 mm: beyond the bound",
    ]
    assert [one.kind for one in found] == ["overlap", "gap", "gap"]


def test_corners_have_their_own_displacement_or_the_largest_of_their_stone():
    stones = wall(1, 2)
    own = {"0-0": np.arange(8) * 1e-3, "0-1": np.array([0.001, 0.007])}  # of corners that are no longer there
    drawn = shapes_of(stones, displacement=own).stones
    np.testing.assert_array_equal(drawn[0].moved, np.arange(8) * 1e-3)
    np.testing.assert_array_equal(drawn[1].moved, np.full(8, 0.007))
    unknown = shapes_of(stones, displacement={}).stones
    assert np.isnan(unknown[0].moved).all()
    np.testing.assert_allclose(drawn[0].normal, AWAY, atol=1e-15)
    assert drawn[0].area == pytest.approx(0.18)


def test_the_surface_has_all_faces_and_joints(tmp_path):
    stones = wall(2, 2)
    joints = (bed(stones[0], stones[2]), bed(stones[1], stones[3], left_open="beyond the bound"))
    surface = closing_surface(shapes_of(stones, joints=joints))

    def area(points, triangles):
        a, b, c = points[triangles].transpose(1, 0, 2)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    assert area(surface.points, surface.triangles) == pytest.approx(4 * 2 * (0.24 + 0.18 + 0.12))
    assert len(surface.edges) == 4 * 12
    assert area(surface.joint_points, surface.joint_triangles) == pytest.approx(0.24)
    assert area(surface.gap_points, surface.gap_triangles) == pytest.approx(0.24)
    np.testing.assert_array_equal(surface.joint_width, 0.012)
    save_surface(tmp_path / "surface.npz", surface)
    again = load_surface(tmp_path / "surface.npz", ClosingSurface)
    np.testing.assert_array_equal(again.triangles, surface.triangles)


def test_a_wall_has_one_elevation_a_corner_two_and_a_vault_none():
    def of(building):
        blocks = building.blocks()
        solids = [one.solid for one in blocks]
        faces = [one.face.outline for one in blocks]
        return closing_shapes("x", Stages(solids, solids, solids), {}, report([]), faces, frozenset())

    assert len(flat_facades(shapes_of(wall()))) == 1
    assert len(flat_facades(of(corner(4)))) == 2
    vault = of(barrel_vault(9, 3))
    assert flat_facades(vault) == ()
    towards, height = viewpoint(vault)
    assert height < 0.0  # from below, where its faces were seen from
    axis = np.array([-np.sin(np.radians(23.0)), np.cos(np.radians(23.0)), 0.0])
    assert abs(towards @ axis) > 0.99  # along its axis
    towards, height = viewpoint(shapes_of(wall()))
    np.testing.assert_allclose(towards, AWAY, atol=1e-12)
    assert height > 0.0


@pytest.mark.parametrize("step", ["simplified", "moved"])
def test_elevations_colour_what_moved_where_it_moved(tmp_path, step):
    stones = wall(1, 3)
    moved = {one.code: np.where(one.vertices[:, 0] > 1.7, 0.01, 0.0) for one in stones}
    given = {"simplified": moved} if step == "simplified" else {"displacement": moved}
    assert draw_elevations(tmp_path, shapes_of(stones, **given)) == (f"{step}.png", "joints.png")
    pixels = pixels_of(tmp_path / f"{step}.png")
    wide = int(0.85 * pixels.shape[1])  # without the scale beside it
    blue = (pixels[:, :wide, 2] - pixels[:, :wide, 0] > 60).any(axis=0)  # what is far up the scale
    assert blue.mean() > 0.05
    assert np.flatnonzero(blue).min() > 0.7 * wide  # the right half of the third stone


def test_what_is_open_or_overlaps_is_marked(tmp_path):
    stones = wall(2, 3)
    closed = tuple(bed(stones[k], stones[k + 3]) for k in range(3))
    draw_elevations(tmp_path, shapes_of(stones, joints=closed))
    plain = pixels_of(tmp_path / "joints.png")
    assert count_of(plain, FLAG) == 0
    left = (closed[0], bed(stones[1], stones[4], left_open="beyond the bound"), closed[2])
    gap = Gap(("1-1", "0-1"), 0.03, 0.24, left[1].centroid, "beyond the bound")
    draw_elevations(tmp_path, shapes_of(stones, joints=left, gaps=(gap,)))
    marked = pixels_of(tmp_path / "joints.png")
    assert count_of(marked, FLAG) > 500
    overlap = Overlap(("1-0", "0-0"), 1e-4, 0.002, closed[0].centroid)
    draw_elevations(tmp_path, shapes_of(stones, joints=closed, overlaps=(overlap,)))
    black = pixels_of(tmp_path / "joints.png")
    assert count_of(black, "#000000") > count_of(plain, "#000000") + 100


def test_hypotheses_are_hatched(tmp_path):
    stones = wall(1, 2)
    draw_elevations(tmp_path, shapes_of(stones))
    before = pixels_of(tmp_path / "joints.png")
    draw_elevations(tmp_path, shapes_of(stones, hypotheses=["0-1"]))
    after = pixels_of(tmp_path / "joints.png")
    wide = before.shape[1]
    third = slice(int(0.2 * wide), int(0.3 * wide))
    assert (after[60:200, third] < 200).sum() == (
        before[60:200, third] < 200
    ).sum()  # the left one is as it was
    assert (after < 200).sum() > (before < 200).sum() + 1000


def test_there_is_no_picture_of_what_moved_nothing(tmp_path):
    assert draw_elevations(tmp_path, shapes_of(wall(1, 2))) == ("joints.png",)


def test_the_whole_is_drawn_in_space(tmp_path):
    stones = wall(2, 2)
    joints = (bed(stones[0], stones[2], width=0.02), bed(stones[1], stones[3], left_open="beyond the bound"))
    moved = {one.code: np.full(8, 0.004) for one in stones}
    shapes = shapes_of(stones, joints=joints, displacement=moved)
    names = draw_in_space(tmp_path, shapes)
    assert names == ("moved-3d.png", "joints-3d.png")
    for name in names:
        pixels = pixels_of(tmp_path / name)
        assert (pixels[[0, -1]][:, [0, -1]] == 255).all()
        assert (np.ptp(pixels, axis=2) > 60).mean() > 0.01
    assert count_of(pixels_of(tmp_path / "joints-3d.png"), FLAG) > 1000
    assert count_of(pixels_of(tmp_path / "moved-3d.png"), FLAG) == 0
    shut = replace(shapes, joints=shapes.joints[:1])
    draw_in_space(tmp_path, shut)
    assert count_of(pixels_of(tmp_path / "joints-3d.png"), FLAG) == 0
