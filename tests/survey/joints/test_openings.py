"""Openings of a leaf: windows, doors, niches and the picture's border stay open, pockets of rubble are filled."""

from itertools import pairwise

import numpy as np
import pytest

from survey.clouds.masks import open_masks
from survey.clouds.settings import MaskOptions
from survey.geometry.solids import volume_of
from survey.joints.close import close_joints
from survey.joints.settings import JointMode, JointSettings
from survey.registration.stones import survey_stones
from tests.paths import ROOT

SHARED = ROOT.parent / "shared"
MORTAR = JointSettings(mode=JointMode.MORTAR)
WIDTH, HEIGHT, DEPTH = 1.4, 0.8, 0.3
COURSE, STONE, JOINT = 0.2, 0.4, 0.012


def box(x0, y0, x1, y1):
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=float)


def bond(hole):
    """Stones of a running bond around a hole ((x0, y0), (x1, y1)), which cuts them along courses."""
    (x0, y0), (x1, y1) = hole
    outlines = []
    for course in range(round(HEIGHT / COURSE)):
        low, high = COURSE * course, COURSE * (course + 1)
        cuts = np.arange(-0.5 * STONE * (course % 2), WIDTH + STONE, STONE).clip(0.0, WIDTH)
        spans = [(0.0, WIDTH)] if low >= y1 - 1e-9 or high <= y0 + 1e-9 else [(0.0, x0), (x1, WIDTH)]
        for begin, end in spans:
            ends = sorted({begin, end, *(one for one in cuts if begin + 0.08 < one < end - 0.08)})
            outlines += [
                box(a + JOINT / 2 * (a > begin), low + JOINT / 2, b - JOINT / 2 * (b < end), high - JOINT / 2)
                for a, b in pairwise(ends)
                if b > a + JOINT
            ]
    return outlines


def closed(outlines, path, size=(WIDTH, HEIGHT), settings=MORTAR):
    rows = ["code,x,y"]
    for k, ring in enumerate(outlines, start=1):
        rows += [f"S{k:02d},{x:.9f},{y:.9f}" for x, y in ring.tolist()]
    path.write_text("\n".join(rows), encoding="utf-8")
    return close_joints(
        list(survey_stones(open_masks(path, MaskOptions(size=size, depth=DEPTH))).stones), settings
    )


@pytest.mark.parametrize(
    ("hole", "sides"),
    [
        (((0.5, 0.2), (1.0, 0.6)), ()),  # a window
        (((0.5, 0.0), (1.0, 0.6)), ("below",)),  # a door
        (((0.5, 0.4), (1.0, HEIGHT)), ("above",)),  # a window that touches the top
        (((1.0, 0.2), (WIDTH, 0.6)), ("right",)),  # a niche, open to the side
        (((0.0, 0.4), (0.5, HEIGHT)), ("left", "above")),  # a corner that has fallen
    ],
)
def test_background_wider_than_mortar_stays_open(tmp_path, hole, sides):
    found = closed(bond(hole), tmp_path / "wall.csv")
    (leaf,) = found.report.leaves
    (opening,) = leaf.openings
    low, high = (np.clip(one, 0.0, (WIDTH, HEIGHT)) for one in hole)
    assert opening.sides == sides
    np.testing.assert_allclose(opening.low, low, atol=JOINT)
    np.testing.assert_allclose(opening.size, high - low, atol=2.0 * JOINT)
    assert opening.area == pytest.approx(np.prod(high - low), rel=0.06)
    assert leaf.growth < 3.0 * JOINT
    assert max(leaf.thickness.values()) < 2.0 * JOINT
    volume = sum(map(volume_of, found.solids))
    assert volume == pytest.approx(DEPTH * (WIDTH * HEIGHT - opening.area), rel=1e-9)
    assert not found.report.alone


def test_mortar_ends_flush_where_a_joint_opens_into_an_opening(tmp_path):
    (leaf,) = closed(bond(((0.5, 0.2), (1.0, 0.6))), tmp_path / "wall.csv").report.leaves
    jamb = leaf.openings[0].edges.reshape(-1, 2)
    jamb = jamb[(jamb[:, 1] > 0.25) & (jamb[:, 1] < 0.55) & (jamb[:, 0] < 0.7)]
    assert len(jamb)  # where the bed of the two courses beside it ends
    np.testing.assert_allclose(jamb[:, 0], 0.5, atol=0.25 * JOINT)


def test_pockets_of_unequal_joints_are_filled(tmp_path):
    chance = np.random.default_rng(11)
    outlines = []
    for i in range(4):
        for j in range(4):
            drawn_in = chance.uniform(0.004, 0.028, 4)  # joints of 8 to 56 mm
            ring = box(0.2 * i, 0.15 * j, 0.2 * (i + 1), 0.15 * (j + 1))
            cut = np.array(
                [drawn_in[[0, 1]], [-drawn_in[2], drawn_in[1]], -drawn_in[2:], [drawn_in[0], -drawn_in[3]]]
            )
            outlines.append(ring + cut)
    found = closed(outlines, tmp_path / "wall.csv", size=(0.8, 0.6))
    (leaf,) = found.report.leaves
    assert leaf.openings == ()
    assert leaf.filled > 0.08
    assert sum(map(volume_of, found.solids)) == pytest.approx(DEPTH * 0.8 * 0.6, rel=1e-9)


def test_a_stone_left_out_is_filled_where_max_width_says_so(tmp_path):
    outlines = bond(((0.0, HEIGHT), (0.0, HEIGHT)))
    lost = next(k for k, one in enumerate(outlines) if np.allclose(one.mean(axis=0), [0.8, 0.3]))
    outlines = [one for k, one in enumerate(outlines) if k != lost]
    (leaf,) = closed(outlines, tmp_path / "a.csv").report.leaves
    assert leaf.openings[0].size == pytest.approx((STONE, COURSE), abs=3.0 * JOINT)
    wide = JointSettings(mode=JointMode.MORTAR, max_width=0.5)
    assert closed(outlines, tmp_path / "b.csv", settings=wide).report.leaves[0].openings == ()


def test_a_picture_larger_than_the_wall_and_a_stone_by_itself(tmp_path):
    outlines = [one + np.array([0.3, 0.0]) for one in bond(((0.5, 0.2), (1.0, 0.6)))] + [
        box(1.0, 0.35, 1.1, 0.45)
    ]
    found = closed(outlines, tmp_path / "wall.csv", size=(WIDTH + 0.6, HEIGHT + 0.4))
    (leaf,) = found.report.leaves
    around, window = leaf.openings
    assert set(around.sides) == {"left", "right", "above", "below"}
    assert around.area == pytest.approx(0.6 * HEIGHT + 0.4 * (WIDTH + 0.6), rel=0.01)
    assert window.area == pytest.approx(0.5 * 0.4 - 0.01, rel=0.06)
    assert found.report.alone == (f"S{len(outlines):02d}",)
    open_area = around.area + window.area
    whole = (WIDTH + 0.6) * (HEIGHT + 0.4)
    assert sum(map(volume_of, found.solids)) == pytest.approx(DEPTH * (whole - open_area), rel=1e-9)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the masks lie beside the project")
@pytest.mark.parametrize(("mask", "growth"), [("WR1_100.png", 0.0501), ("WR2_250.png", 0.0480)])
def test_rubble_of_experiments_is_filled(mask, growth):
    path = SHARED / "data/experiments/masks" / mask
    stones = survey_stones(open_masks(path, MaskOptions(size=(1.0, 1.2), depth=0.2))).stones
    report = close_joints(list(stones), MORTAR).report
    assert report.leaves[0].openings == ()
    assert report.leaves[0].growth == pytest.approx(growth, rel=0.01)
