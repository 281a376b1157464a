"""Simplification of stones whose face was measured."""

import re
from collections import defaultdict
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.faces.faces import outline_face
from survey.geometry.watertight import check_watertight
from survey.records.survey import BlockRecord, Extrusion
from survey.simplify.blockiness import about
from survey.simplify.result import BlockShape
from survey.simplify.simplify import BlockyStone, simplify
from survey.simplify.squaring import SimplifyBounds
from tests.paths import ROOT
from tests.survey.simplify import report_twin as twin

DEPTH = Depth(0.4, None, "test", "kind", 1)
TRAPEZIUM = np.array([[0, 0], [0.2, 0], [0.35, 0.6], [-0.1, 0.55]])  # a voussoir
NO_POINTS, STRAIGHT, UNTURNED = np.empty((0, 3)), Extrusion(), np.eye(3)
SEEDS = st.integers(0, 2**32 - 1)
FEW = settings(max_examples=80, deadline=None)


def surveyed(
    flat: np.ndarray,
    *,
    points: np.ndarray = NO_POINTS,
    height: np.ndarray | float = 0.0,
    depth: float = 0.4,
    extrusion: Extrusion = STRAIGHT,
    sigma: float = 0.002,
    turn: np.ndarray = UNTURNED,
    shift: np.ndarray | float = 0.0,
) -> SurveyedBlock:
    """Return a stone whose face lies at z = 0, seen from above, then turned and shifted with its observer."""
    vertices = np.column_stack([flat, np.broadcast_to(height, len(flat))])
    record = BlockRecord("A", "voussoir", None, vertices @ turn.T + shift, points @ turn.T + shift, sigma)
    if extrusion.direction is not None:
        extrusion = Extrusion(turn @ extrusion.direction, extrusion.tail)
    face = outline_face(record, turn @ [0.1, 0.1, 9.0] + shift)
    return extrude(face, Depth(depth, None, "test", "kind", 1), extrusion)


def blocky(flat: np.ndarray) -> BlockyStone:
    return simplify(surveyed(flat))


def cut_corner(quad: np.ndarray, corner: int, back: float, on: float) -> np.ndarray:
    here = quad[corner]
    before, after = quad[corner - 1] - here, quad[(corner + 1) % len(quad)] - here
    two = [here + back * before / np.linalg.norm(before), here + on * after / np.linalg.norm(after)]
    return np.vstack([quad[:corner], two, quad[corner + 1 :]])


def random_quad(rng: np.random.Generator) -> np.ndarray:
    """Draw a dressed face, 0.25 to 1.2 m, each corner up to 15 % of the shorter side out of square."""
    sides = rng.uniform(0.25, 1.2, 2)
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * sides
    return corners + rng.uniform(-0.15, 0.15, (4, 2)) * sides.min()


def apart(found: np.ndarray, true: np.ndarray) -> float:
    """Return the largest distance of a corner from the nearest of the other set, either way."""
    distances = np.linalg.norm(found[:, None] - true, axis=2)
    return float(max(distances.min(axis=0).max(), distances.min(axis=1).max()))


def assert_sound_result(block: SurveyedBlock, stone: BlockyStone) -> None:
    """Check the facts of every simplified stone, against the twin."""
    origin = block.face.outline[0]
    old, new, report = about(block.solid, origin), about(stone.solid, origin), stone.report
    far = 4.0 * np.spacing(np.abs(stone.solid.vertices).max())
    size = float(np.ptp(new.vertices, axis=0).max())
    check_watertight(new, convex=False)
    assert twin.bend(new) <= 1e-12 + far / size
    if stone.shape is not BlockShape.POLYHEDRON:
        assert twin.highest(new) <= 1e-12 * size + far
        counts = {BlockShape.WEDGE: (3, 3), BlockShape.HEXAHEDRON: (4, 4), BlockShape.PRISM: (5, 99)}
        low, high = counts[stone.shape]
        assert low <= len(stone.sound) == len(new.vertices) // 2 <= high
        assert report.worst_angle == pytest.approx(twin.worst_angle(new), abs=1e-5)
    np.testing.assert_allclose(report.displacement, twin.displacement(old, new), atol=1e-12 + far)
    assert report.volume_change == pytest.approx(
        twin.volume(new) / twin.volume(old) - 1.0, abs=1e-9 + 1e3 * far
    )
    assert 0.0 < report.blockiness <= 1.0
    count = len(block.face.outline)
    trusted = np.array([i not in block.face.rejected_vertices for i in range(count)])
    left = np.array([twin.distance_to_edges(corner, new) for corner in old.vertices[:count]])
    if stone.shape is BlockShape.POLYHEDRON:
        assert stone.solid is block.solid
    else:
        assert report.within == bool((left[trusted] <= report.tolerance).all())
        bounds = SimplifyBounds()
        assert left[trusted].max(initial=0.0) <= max(bounds.max_shift, 1e-12)
        assert report.displacement[:count].max() <= bounds.max_restored + 1e-9
    for corner, known in zip(stone.solid.vertices, stone.sound, strict=False):
        if not known:  # where the survey found it
            nearest = np.linalg.norm(block.face.outline[~trusted] - corner, axis=1).min()
            assert nearest <= 1e-12 + far


def test_four_corners_stay_as_they_were_measured() -> None:
    block = surveyed(TRAPEZIUM)
    stone = simplify(block)
    assert stone.solid is block.solid
    assert stone.shape is BlockShape.HEXAHEDRON
    assert stone.sound.tolist() == [True] * 4
    report = stone.report
    assert not report.displacement.any()
    assert (report.volume_change, report.blockiness, report.within) == (0.0, 1.0, True)
    # the upper right corner: the flank leans out by atan(0.15 / 0.6), the top falls by atan(0.05 / 0.45)
    assert report.worst_angle == pytest.approx(np.degrees(np.arctan(0.15 / 0.6) + np.arctan(0.05 / 0.45)))


def test_the_tolerance_is_three_standard_deviations_or_three_times_the_roughness() -> None:
    rng = np.random.default_rng(1)
    precise = simplify(surveyed(TRAPEZIUM, sigma=0.0005)).report.tolerance
    assert precise == SimplifyBounds().least_tolerance
    assert simplify(surveyed(TRAPEZIUM, sigma=0.004)).report.tolerance == pytest.approx(0.012, rel=0.3)
    flat = rng.uniform([0.0, 0.1], [0.2, 0.5], (40, 2))
    rough = np.column_stack([flat, rng.normal(0.0, 0.005, 40)])
    block = surveyed(TRAPEZIUM, points=rough, sigma=0.005)
    assert simplify(block).report.tolerance >= 3.0 * block.face.fit.rms - 1e-15


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 3), st.floats(0.02, 0.05), st.floats(0.02, 0.05), st.integers(0, 4))
def test_a_bevelled_corner_is_restored_and_the_wedge_kept(
    corner: int, back: float, on: float, first: int
) -> None:
    stone = blocky(np.roll(cut_corner(TRAPEZIUM, corner, back, on), first, axis=0))
    assert stone.shape is BlockShape.HEXAHEDRON
    assert apart(stone.solid.vertices[:4, :2], TRAPEZIUM) < 1e-9
    assert stone.report.volume_change > 0
    assert stone.report.within  # the corners of a bevel lie on the sides
    assert stone.sound.all()
    # what was restored stands out of the bevel by its distance from it
    a, b = cut_corner(TRAPEZIUM, corner, back, on)[corner : corner + 2]
    share = np.clip((TRAPEZIUM[corner] - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    rise = np.linalg.norm(TRAPEZIUM[corner] - a - share * (b - a))
    assert stone.report.displacement.max() == pytest.approx(rise, abs=1e-9)


@FEW
@given(SEEDS, st.integers(1, 2), st.integers(0, 2), st.floats(0.0, 0.002))
def test_bevels_and_points_along_sides_go_and_the_true_corners_come_back(
    seed: int, bevels: int, between: int, noise: float
) -> None:
    rng = np.random.default_rng(seed)
    true = random_quad(rng)
    outline = true
    width = min(0.5, *np.linalg.norm(np.roll(true, -1, axis=0) - true, axis=1))
    for corner in sorted(rng.choice([0, 2], bevels, replace=False), reverse=True):
        outline = cut_corner(outline, corner, *rng.uniform(0.05, 0.12, 2) * width)
    for _ in range(between):
        gaps = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
        k = int(gaps.argmax())
        share = rng.uniform(0.3, 0.7)
        middle = (1 - share) * outline[k] + share * outline[(k + 1) % len(outline)]
        outline = np.insert(outline, k + 1, middle, axis=0)
    outline = np.roll(outline + rng.uniform(-noise, noise, outline.shape), rng.integers(9), axis=0)
    block = surveyed(outline)
    stone = simplify(block)
    assert stone.shape is BlockShape.HEXAHEDRON
    # a prolonged side turns by its noise over its length; where two such meet askew, a corner is out by 5 times that
    assert apart(stone.solid.vertices[:4, :2], true) <= 1e-9 + 5.0 * np.sqrt(2.0) * noise
    assert_sound_result(block, stone)


@FEW
@given(SEEDS, st.integers(0, 3))
def test_an_eroded_corner_is_restored_along_the_points_of_an_even_margin(seed: int, corner: int) -> None:
    rng = np.random.default_rng(seed)
    true, margin = random_quad(rng), rng.uniform(0.008, 0.02)
    here, before, after = true[corner], true[corner - 1], true[(corner + 1) % 4]
    cuts = rng.uniform(0.02, 0.03, 2)
    outline = true.copy()
    outline[corner] += sum(
        cut * (to - here) / np.linalg.norm(to - here) for cut, to in zip(cuts, (before, after), strict=True)
    )
    ring = []
    for k in range(4):
        run = true[(k + 1) % 4] - true[k]
        inward = np.array([-run[1], run[0]]) / np.linalg.norm(run)
        ring += [true[k] + share * run + margin * inward for share in (0.15, 0.35, 0.5, 0.65, 0.85)]
    near = np.linalg.norm(np.array(ring) - here, axis=1) < 0.06  # worn away
    points = np.column_stack([np.array(ring)[~near], np.zeros((~near).sum())])
    height = np.where(np.arange(4) == corner, -0.03, 0.0)
    block = surveyed(outline, points=points, height=height, sigma=0.001)
    assume(block.face.rejected_vertices != ())
    stone = simplify(block)
    assert stone.shape is BlockShape.HEXAHEDRON
    bound = SimplifyBounds()
    if "restored" in stone.report.reason:
        # the even margin may be wrong by as much as the tolerance, at a half of the side's length
        assert apart(stone.solid.vertices[:4, :2], true) < 2.0 * stone.report.tolerance
        assert stone.sound.all()
    else:
        assert apart(stone.solid.vertices[:4, :2], outline) < 1e-3
    assert stone.report.displacement.max() <= bound.max_restored
    assert_sound_result(block, stone)


def test_a_worn_corner_without_points_beside_it_stays_and_is_not_sound() -> None:
    quad = np.array([[0, 0], [0.6, 0], [0.57, 0.28], [0, 0.3]])
    inner = np.array([(x, y, 0.0) for x in (0.2, 0.3, 0.4) for y in (0.12, 0.15, 0.18)])
    block = surveyed(quad, points=inner, height=np.array([0, 0, -0.03, 0]), sigma=0.001)
    assert block.face.rejected_vertices == (2,)
    stone = simplify(block)
    assert stone.solid is block.solid
    assert stone.sound.tolist() == [True, True, False, True]


def test_a_bevel_within_the_tolerance_counts_as_a_point_along_the_side() -> None:
    outline = cut_corner(TRAPEZIUM, 1, 0.05, 0.004)
    stone = blocky(outline)
    assert stone.shape is BlockShape.HEXAHEDRON
    assert stone.report.within
    assert apart(stone.solid.vertices[:4, :2], TRAPEZIUM) < stone.report.tolerance


def test_a_triangle_becomes_a_wedge_also_with_a_corner_half_way_along_a_side() -> None:
    for outline in (TRAPEZIUM[:3], np.insert(TRAPEZIUM[:3], 1, [0.1, 0.001], axis=0)):
        block = surveyed(outline)
        stone = simplify(block)
        assert stone.shape is BlockShape.WEDGE
        assert apart(stone.solid.vertices[:3, :2], TRAPEZIUM[:3]) < 1e-12
        assert_sound_result(block, stone)
    # the smallest parallelogram around a triangle is twice as large
    assert blocky(TRAPEZIUM[:3]).report.blockiness == pytest.approx(0.5)


def test_a_crossette_stays_a_pentagon_and_a_deep_notch_a_polyhedron() -> None:
    crossette = np.array([[0, 0], [0.3, 0], [0.42, 0.5], [0.25, 0.6], [-0.05, 0.6]])
    crossette[3] = [0.28, 0.6]
    block = surveyed(crossette)
    stone = simplify(block)
    assert stone.shape is BlockShape.PRISM
    assert stone.solid is block.solid
    assert "five" not in stone.report.reason
    assert 0.9 < stone.report.blockiness < 1.0
    assert_sound_result(block, stone)
    angled = np.array([[0, 0], [0.6, 0], [0.6, 0.2], [0.3, 0.2], [0.3, 0.4], [0, 0.4]])
    block = surveyed(angled)
    stone = simplify(block)
    assert stone.shape is BlockShape.POLYHEDRON
    assert "kept as surveyed" in stone.report.reason
    assert stone.report.worst_angle == pytest.approx(180.0)  # 270° at the fold
    assert stone.sound.tolist() == [True] * 6
    assert_sound_result(block, stone)


def test_bounds_decide_between_a_bevel_and_a_fifth_side() -> None:
    outline = cut_corner(np.array([[0, 0], [0.6, 0], [0.6, 0.3], [0, 0.3]]), 2, 0.06, 0.06)
    block = surveyed(outline)
    assert simplify(block).shape is BlockShape.HEXAHEDRON  # 42 mm restored, less than a quarter of 0.3 m
    assert simplify(block, SimplifyBounds(max_restored=0.04)).shape is BlockShape.PRISM
    assert simplify(block, SimplifyBounds(restored_share=0.1)).shape is BlockShape.PRISM


@FEW
@given(SEEDS, st.integers(3, 9), st.floats(0.3, 1.0), st.booleans(), st.floats(0.03, 3.0))
def test_any_face_gives_a_sound_solid_and_a_true_report(
    seed: int, count: int, tail: float, slanted: bool, depth: float
) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    radii = rng.uniform(0.2, 0.5, count) if rng.random() < 0.5 else np.full(count, 0.4)
    flat = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]) * [
        1.0,
        rng.choice([1.0, 0.3, 0.05]),
    ]
    direction = np.array([*rng.uniform(-0.5, 0.5, 2), -1.0]) if slanted else None
    shift = rng.choice([0.0, 1.0, 5e6]) * rng.normal(size=3)
    try:
        block = surveyed(
            flat,
            depth=depth,
            extrusion=Extrusion(direction, tail),
            sigma=0.001,
            turn=twin.random_turn(rng),
            shift=shift,
        )
    except GeometryError:
        assume(False)
    try:
        stone = simplify(block)
    except GeometryError as error:
        assert "stone A: " in str(error)  # noqa: PT017
        return
    assert_sound_result(block, stone)
    np.testing.assert_allclose(
        stone.solid.vertices[0],
        min(
            stone.solid.vertices[: len(stone.sound)], key=lambda c: np.linalg.norm(c - block.face.outline[0])
        ),
    )


@FEW
@given(SEEDS, st.integers(5, 8))
def test_what_a_convex_stone_and_its_hexahedron_have_in_common_is_its_blockiness(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    assume(np.diff(angles, append=angles[0] + 2 * np.pi).min() > 0.1)
    block = surveyed(0.4 * np.column_stack([np.cos(angles), np.sin(angles)]))
    boundless = SimplifyBounds(np.inf, 1.0, np.inf, 1.0)
    hexahedron, stone = simplify(block, boundless), simplify(block)
    assume(hexahedron.shape is BlockShape.HEXAHEDRON)
    share = twin.common_share(block.solid, hexahedron.solid)
    assert hexahedron.report.blockiness == pytest.approx(share, abs=1e-9)
    if stone.shape is BlockShape.PRISM and len(stone.solid.vertices) == 2 * count:
        assert stone.report.blockiness == pytest.approx(share, abs=1e-9)


@FEW
@given(SEEDS, st.integers(0, 8), st.booleans(), st.booleans(), st.sampled_from([0.0, 1e3, 1e6]))
def test_neither_place_nor_hand_nor_the_way_round_make_a_difference(
    seed: int, first: int, back: bool, mirrored: bool, far: float
) -> None:
    rng = np.random.default_rng(seed)
    flat = cut_corner(random_quad(rng), 1, *rng.uniform(0.02, 0.03, 2))
    flat += rng.uniform(-0.001, 0.001, flat.shape)
    turn, shift = twin.random_turn(rng), far * rng.normal(size=3)
    here = simplify(surveyed(flat))
    hand = np.array([-1.0 if mirrored else 1.0, 1.0, 1.0])
    other = np.roll(flat[::-1] if back else flat, first, axis=0) * hand[:2]
    there = simplify(surveyed(other, turn=turn, shift=shift))
    tolerance = 1e-9 + 20.0 * np.spacing(far)
    assert here.shape is there.shape
    assert apart((there.solid.vertices - shift) @ turn * hand, here.solid.vertices) < tolerance
    assert there.report.volume_change == pytest.approx(here.report.volume_change, abs=1e-8 + 100 * tolerance)
    assert there.report.blockiness == pytest.approx(here.report.blockiness, abs=1e-8 + 100 * tolerance)
    assert np.sort(there.report.displacement) == pytest.approx(
        np.sort(here.report.displacement), abs=10 * tolerance
    )
    assert there.report.reason == here.report.reason


@FEW
@given(SEEDS, st.floats(0.4, 1.0), st.floats(0.02, 1.0))
def test_simplifying_again_changes_nothing(seed: int, tail: float, slender: float) -> None:
    rng = np.random.default_rng(seed)
    flat = cut_corner(random_quad(rng) * [1.0, slender], 3, 0.02 * slender, 0.03 * slender)
    extrusion = Extrusion(None, tail)
    try:
        once = simplify(surveyed(flat, extrusion=extrusion, sigma=0.0005))
    except GeometryError:
        assume(False)
    again = surveyed(once.solid.vertices[: len(once.sound), :2], extrusion=extrusion, sigma=0.0005)
    twice = simplify(again)
    assert twice.shape is once.shape
    assert twice.report.displacement.max() < 1e-12
    np.testing.assert_allclose(twice.solid.vertices, once.solid.vertices, atol=1e-12)
    assert twice.report.blockiness == pytest.approx(
        1.0 if once.shape is BlockShape.HEXAHEDRON else once.report.blockiness
    )


def test_a_flat_stone_is_refused_by_name() -> None:
    with pytest.raises(GeometryError, match=r"stone A: it is flat: .* check the corners of its face"):
        simplify(surveyed(TRAPEZIUM, depth=1e-7))


def inset(corners: np.ndarray, normal: np.ndarray, distances: list[float]) -> np.ndarray:
    """Return corners of a face whose sides are moved inwards: where each two neighbouring sides meet."""
    run = np.roll(corners, -1, axis=0) - corners
    inward = np.cross(normal, run)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    offsets = (inward * corners).sum(axis=1) + distances
    rows = [np.array([inward[k - 1], inward[k], normal]) for k in range(4)]
    heights = corners @ normal
    return np.array([np.linalg.solve(rows[k], [offsets[k - 1], offsets[k], heights[k]]) for k in range(4)])


def test_the_corners_of_the_sample_are_as_accurate_as_documented(
    blocks: list[SurveyedBlock], truth: dict[str, dict[str, Any]]
) -> None:
    found: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for block in blocks:
        true, stone = truth[block.code], simplify(block)
        assert stone.shape is BlockShape.HEXAHEDRON
        assert stone.report.within
        corners = inset(np.array(true["vertices"])[:4], np.array(true["normal"]), true["half_joints"])
        for k, corner in enumerate(corners):
            kind = (true["worn"] or "sound") if true["worn_corner"] == k else "sound"
            if kind == "eroded":
                kind = "by the margin" if "restored" in stone.report.reason else "too few points"
            before = np.linalg.norm(block.face.outline - corner, axis=1).min()
            after = np.linalg.norm(stone.solid.vertices[:4] - corner, axis=1).min()
            found[kind].append((1e3 * before, 1e3 * after))
    page = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    for kind, count in (("sound", 361), ("bevelled", 11), ("by the margin", 11), ("too few points", 9)):
        values = np.array(found[kind])
        said = re.search(rf"^\| [^|]*{kind} \|(.*)\|$", page, re.MULTILINE)
        assert said is not None
        numbers = [float(one) for one in said.group(1).split("|")]
        assert numbers[0] == len(values) == count
        median, largest = np.median(values, axis=0), values.max(axis=0)
        assert numbers[1:] == pytest.approx([median[0], largest[0], median[1], largest[1]], abs=0.06)
    assert max(after for kind in ("sound", "bevelled", "by the margin") for _, after in found[kind]) < 7.0
