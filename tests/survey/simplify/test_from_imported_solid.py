"""Simplification of imported solids."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from ground.errors import GeometryError
from survey.extrusion.extrusion import SurveyedBlock
from survey.extrusion.imported_solids import block_of_solid
from survey.formats.solids.reader import open_solids
from survey.geometry.solids import Solid, planes_of_solid
from survey.geometry.watertight import check_watertight, triangulate
from survey.records.survey import SolidRecord
from survey.simplify.result import BlockShape
from survey.simplify.simplify import BlockyStone, simplify
from tests.survey.simplify import report_twin as twin

SEEDS = st.integers(0, 2**32 - 1)
RING = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
ANGLED = np.array([(0, 0), (0.6, 0), (0.6, 0.2), (0.3, 0.2), (0.3, 0.4), (0, 0.4)])
FEW = settings(max_examples=60, deadline=None)


def box(*size: float) -> np.ndarray:
    return np.array([(x, y, z) for z in (0, 1) for x, y in RING]) * size


def made(vertices: np.ndarray, faces: tuple[tuple[int, ...], ...] = SIDES) -> SurveyedBlock:
    return block_of_solid(
        SolidRecord("A", "stone", None, np.asarray(vertices, dtype=float), faces), None, "a.obj"
    )


def prism_of(flat: np.ndarray, depth: float) -> tuple[np.ndarray, tuple[tuple[int, ...], ...]]:
    """Return corners and faces of a prism along y on a polygon (x, z), counter-clockwise seen from -y."""
    n = len(flat)
    front = np.column_stack([flat[:, 0], np.zeros(n), flat[:, 1]])
    sides = [(i, i + n, (i + 1) % n + n, (i + 1) % n) for i in range(n)]
    return np.vstack([front, front + np.array([0, depth, 0])]), (
        tuple(range(n)),
        tuple(range(2 * n - 1, n - 1, -1)),
        *sides,
    )


def random_hexahedron(rng: np.random.Generator) -> np.ndarray:
    """Draw six planes near those of a box, whose corners are where three of them cross; slender up to 1:20."""
    size = np.array([1.0, rng.uniform(0.05, 1.0), rng.uniform(0.05, 1.0)])[rng.permutation(3)]
    normals = np.vstack([np.eye(3), -np.eye(3)]) + rng.uniform(-0.04, 0.04, (6, 3)) * size.min() / size.max()
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offsets = np.array([float(n @ (0.5 * size * np.sign(n.round()))) for n in normals])
    corners = []
    for sx, sy, sz in (box(2, 2, 2) - 1).astype(int):
        three = [0 if sx > 0 else 3, 1 if sy > 0 else 4, 2 if sz > 0 else 5]
        corners.append(np.linalg.solve(normals[three], offsets[three]))
    return np.array(corners)


def assert_sound_result(block: SurveyedBlock, stone: BlockyStone, shape: BlockShape) -> None:
    assert stone.shape is shape, stone.report.reason
    report, new = stone.report, stone.solid
    check_watertight(new, convex=shape is not BlockShape.POLYHEDRON)
    far = 4.0 * np.spacing(np.abs(new.vertices).max())
    assert twin.bend(new) <= 1e-12 + far / float(np.ptp(new.vertices, axis=0).max())
    assert len(stone.sound) == len(new.vertices)
    assert stone.sound.all()
    assert report.displacement.shape == (len(block.solid.vertices),)
    assert report.within == (report.displacement.max() <= report.tolerance)
    # a bent face of four corners is between its two ways of being cut in triangles
    rolled = Solid("A", block.solid.vertices, tuple(face[1:] + face[:1] for face in block.solid.faces))
    old_volume = 0.5 * (twin.volume(block.solid) + twin.volume(rolled))
    assert report.volume_change == pytest.approx(twin.volume(new) / old_volume - 1.0, abs=1e-9 + 1e3 * far)
    if shape is not BlockShape.POLYHEDRON:
        assert report.worst_angle == pytest.approx(twin.worst_angle(new), abs=1e-5)
        count = len(new.vertices) // 2
        normal = np.cross(*(new.vertices[[1, 2]] - new.vertices[0]))
        alike = [f for f in new.faces if len(f) == count]
        most = max(
            plane[:3] @ block.face.fit.normal
            for f, plane in zip(new.faces, twin.planes(new), strict=True)
            if f in alike
        )
        assert normal @ block.face.fit.normal / np.linalg.norm(normal) == pytest.approx(most, abs=1e-9)


@FEW
@given(SEEDS, st.sampled_from([0.0, 1e3, 1e6]))
def test_a_hexahedron_keeps_its_corners_to_the_last_bit_wherever_it_is(seed: int, far: float) -> None:
    rng = np.random.default_rng(seed)
    corners = random_hexahedron(rng) @ twin.random_turn(rng).T + far * rng.normal(size=3)
    block = made(corners)
    stone = simplify(block)
    assert_sound_result(block, stone, BlockShape.HEXAHEDRON)
    rounding = 1e-15 if far == 0.0 else 50.0 * np.spacing(far)
    assert stone.report.displacement.max() <= rounding
    assert stone.report.blockiness == pytest.approx(1.0, abs=1e-12 + 1e4 * rounding)
    moved = np.linalg.norm(stone.solid.vertices[:, None] - corners, axis=2)
    assert moved.min(axis=1).max() <= rounding
    if far == 0.0:
        again = simplify(made(stone.solid.vertices, stone.solid.faces))
        assert again.report.displacement.max() <= 1e-15
        assert {tuple(v) for v in again.solid.vertices} == {tuple(v) for v in stone.solid.vertices}


@FEW
@given(SEEDS, st.booleans())
def test_a_triangulated_and_divided_box_becomes_its_hexahedron(seed: int, rounded: bool) -> None:
    rng = np.random.default_rng(seed)
    true = random_hexahedron(rng) @ twin.random_turn(rng).T
    # a corner in the middle of a face, one in the middle of an edge of it, then triangles
    vertices = np.vstack([true, true[list(SIDES[0])].mean(axis=0), true[[0, 1]].mean(axis=0)])
    a, b, c, d = SIDES[0]
    assert (d, a) == (1, 0)
    faces: list[tuple[int, ...]] = [(a, b, 8), (b, c, 8), (c, d, 8), (d, 9, 8), (9, a, 8)]
    faces += [SIDES[1], (0, 9, 5, 4), (9, 1, 5), *SIDES[3:]]
    solid = Solid("A", vertices, tuple(faces))
    if rounded:
        vertices = vertices.round(4)
    cut = tuple(tuple(int(i) for i in triangle) for triangle in triangulate(solid))
    block = made(vertices, cut)
    stone = simplify(block)
    assert_sound_result(block, stone, BlockShape.HEXAHEDRON)
    tolerance = 2e-4 if rounded else 1e-12
    apart = np.linalg.norm(stone.solid.vertices[:, None] - true, axis=2)
    # planes are fitted to rounded corners, and cross at a slant of 0.08 at most from square
    assert apart.min(axis=0).max() < 3.0 * tolerance
    assert stone.report.displacement.max() < 3.0 * tolerance
    assert stone.report.within
    if not rounded:
        assert stone.report.blockiness == pytest.approx(1.0, abs=1e-9)


def test_a_bent_face_becomes_plane_within_the_tolerance_and_is_kept_bent_no_farther() -> None:
    for rise, shape in ((0.001, BlockShape.HEXAHEDRON), (0.02, BlockShape.POLYHEDRON)):
        corners = box(0.6, 0.4, 0.3)
        corners[6] += [rise, 0, rise]
        block = made(corners)
        stone = simplify(block)
        assert_sound_result(block, stone, shape)
        assert stone.report.displacement.max() < rise
    assert len(stone.solid.faces) == 8  # the corner left the planes of two of its three faces
    assert "folded from 6 that are not plane" in stone.report.reason


@FEW
@given(SEEDS, st.sampled_from(["hexahedron", "prism", "angled"]), st.floats(-6.0, -1.3))
def test_whatever_is_bent_becomes_plane_within_the_tolerance(seed: int, kind: str, exponent: float) -> None:
    rng = np.random.default_rng(seed)
    angles = 2.0 * np.pi * (np.arange(6) + rng.uniform(-0.3, 0.3, 6)) / 6
    vertices, faces = {
        "hexahedron": (random_hexahedron(rng), SIDES),
        "prism": prism_of(0.5 * np.column_stack([np.cos(angles), np.sin(angles)]), 0.4),
        "angled": prism_of(ANGLED, 0.3),
    }[kind]
    noise = 10.0**exponent * np.ptp(vertices, axis=0).min()
    block = made(vertices + rng.normal(0.0, noise, vertices.shape), faces)
    stone = simplify(block)
    check_watertight(stone.solid, convex=stone.shape is not BlockShape.POLYHEDRON)
    assert twin.bend(stone.solid) <= 1e-12
    assert stone.report.within
    assert stone.report.displacement.max() <= stone.report.tolerance
    if noise < 1e-5:
        prisms = {"hexahedron": BlockShape.HEXAHEDRON, "prism": BlockShape.PRISM}
        assert stone.shape is prisms.get(kind, BlockShape.POLYHEDRON)


@FEW
@given(SEEDS, st.sampled_from([3, 5, 6, 8]), st.floats(0.05, 1.0))
def test_a_prism_stays_one(seed: int, count: int, depth: float) -> None:
    rng = np.random.default_rng(seed)
    angles = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    vertices, faces = prism_of(0.5 * np.column_stack([np.cos(angles), np.sin(angles)]), depth)
    block = made(vertices @ twin.random_turn(rng).T, faces)
    stone = simplify(block)
    assert_sound_result(block, stone, BlockShape.WEDGE if count == 3 else BlockShape.PRISM)
    assert stone.report.displacement.max() <= 1e-15
    ends = {frozenset(range(count)), frozenset(range(count, 2 * count))}
    assert {frozenset(face) for face in stone.solid.faces} >= ends
    assert stone.report.blockiness < 0.96  # of no prism more than that of the box around it is full


def test_what_is_no_prism_stays_as_it_was_made_and_says_why() -> None:
    block = made(*prism_of(ANGLED, 0.3))
    stone = simplify(block)
    assert_sound_result(block, stone, BlockShape.POLYHEDRON)
    assert stone.solid is block.solid
    assert "not convex" in stone.report.reason
    assert stone.report.blockiness == pytest.approx(3 / 4)  # of the box around it
    assert stone.report.worst_angle == pytest.approx(180.0)
    pyramid = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 2)], dtype=float)
    block = made(pyramid, ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)))
    stone = simplify(block)
    assert_sound_result(block, stone, BlockShape.POLYHEDRON)
    assert stone.solid is block.solid
    assert "convex, but no prism" in stone.report.reason
    chamfered = np.array([(0, 0), (0.6, 0), (0.6, 0.4), (0.05, 0.4), (0, 0.35)])
    assert simplify(made(*prism_of(chamfered, 0.3))).shape is BlockShape.PRISM


@FEW
@given(SEEDS, st.integers(5, 20))
def test_any_convex_hull_is_taken(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    hull = ConvexHull(points)
    faces = []
    for simplex, equation in zip(hull.simplices, hull.equations, strict=True):
        a, b, c = points[simplex]
        outward = np.cross(b - a, c - a) @ equation[:3] > 0
        faces.append(tuple(int(i) for i in (simplex if outward else simplex[::-1])))
    used = sorted({i for face in faces for i in face})
    faces = [tuple(used.index(i) for i in face) for face in faces]
    block = made(points[used], tuple(faces))
    stone = simplify(block)
    assert_sound_result(block, stone, stone.shape)
    if stone.shape is BlockShape.POLYHEDRON:
        assert stone.solid is block.solid
        box_axes = block.face.fit.normal
        assert 0.0 < stone.report.blockiness < 1.0
        deep = np.ptp(points[used] @ box_axes)
        assert stone.report.blockiness <= twin.volume(block.solid) / (deep * block.face.measures.area) + 1e-12


def test_what_a_rounded_hexahedron_shares_with_its_plane_one_is_its_blockiness() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        corners = random_hexahedron(rng)
        # a triangle of each face bulges or dents: the surveyed solid is that of its triangles
        bent = corners.round(3)
        block = made(bent)
        stone = simplify(block)
        assert stone.shape is BlockShape.HEXAHEDRON
        inside = Solid("", bent, SIDES)
        hull = ConvexHull(np.vstack([bent, stone.solid.vertices])).volume
        least = twin.volume(stone.solid) / hull - abs(twin.volume(inside) / hull - 1.0)
        assert least - 1e-9 <= stone.report.blockiness <= 1.0
        assert stone.report.blockiness > 1.0 - 6.0 * 0.0015 / min(np.ptp(corners, axis=0))


def warped_pair(rng: np.random.Generator, warp: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners of two neighbouring hexahedra of a lattice, which share a face; each corner is moved up to `warp`."""
    lattice = np.array([[[(x, y, z) for z in (0, 0.3)] for y in (0, 0.4)] for x in (0, 0.5, 1.0)])
    lattice = lattice + rng.uniform(-warp, warp, lattice.shape)
    order = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    one, other = (np.array([lattice[x + at, y, z] for x, y, z in order]) for at in (0, 1))
    return one, other


def read(tmp_path: Path, corners: np.ndarray, faces: tuple[tuple[int, ...], ...] = SIDES) -> SurveyedBlock:
    """The stone as the reader of solids folds its faces."""
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in corners]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    path = tmp_path / "stone.obj"
    path.write_text("\n".join(["o A", *lines, ""]))
    (record,) = open_solids(path).blocks
    assert isinstance(record, SolidRecord)
    return block_of_solid(record, None, "stone.obj")


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("warp", [0.003, 0.01, 0.02])
def test_stones_with_warped_faces_are_one_convex_stone_and_share_a_plane(
    tmp_path: Path, seed: int, warp: float
) -> None:
    """Corners out of place by up to 7 % of the width of 0.3 m: each face becomes the mean plane of its corners."""
    pair = warped_pair(np.random.default_rng(seed), warp)
    stones = []
    for corners in pair:
        block = read(tmp_path, corners)
        assert len(block.solid.faces) > 6
        stone = simplify(block)
        assert stone.shape is BlockShape.HEXAHEDRON
        assert twin.bend(stone.solid) < 1e-9
        assert twin.highest(stone.solid) < 1e-9
        moved = stone.report.displacement.max()
        assert moved <= 0.1 * 0.34
        assert stone.report.volume_change == pytest.approx(
            twin.volume(stone.solid) / twin.volume(block.solid) - 1.0,
            abs=1e-4,  # faces that rounding may have warped are not folded
        )
        assert abs(stone.report.volume_change) < warp / 0.3
        stones.append(stone)
    # the face of four corners that both have
    shared = pair[0][[1, 2, 6, 5]]
    planes = [
        min(planes_of_solid(one.solid), key=lambda row: np.abs(shared @ row[:3] - row[3]).max())
        for one in stones
    ]
    np.testing.assert_allclose(planes[0], -planes[1], atol=1e-9)


def test_faces_warped_by_more_than_a_tenth_of_the_width_stay_folded(tmp_path: Path) -> None:
    corners = box(0.5, 0.4, 0.3)
    corners[6] += [0.0, 0.0, 0.25]
    stone = simplify(read(tmp_path, corners))
    assert stone.shape is BlockShape.POLYHEDRON
    assert len(stone.solid.faces) > 6
    assert stone.report.volume_change == 0.0


def test_a_curved_face_of_several_strips_stays_curved(tmp_path: Path) -> None:
    """Its sagitta is 4 % of its width, but its strips are faces, and meet those of a neighbour."""
    arc = [(x, 1.0 + 0.04 * (1.0 - (x - 0.5) ** 2 * 4)) for x in np.linspace(1.0, 0.0, 6)]
    corners, faces = prism_of(np.array([(0.0, 0.0), (1.0, 0.0), *arc]), 1.0)
    stone = simplify(read(tmp_path, corners, faces))
    assert len(stone.solid.faces) == len(faces)
    assert stone.report.volume_change == pytest.approx(0.0, abs=1e-9)


def test_a_solid_seen_from_inside_or_flat_is_refused_by_name() -> None:
    block = made(box(1.0, 0.5, 0.4))
    turned = Solid("A", block.solid.vertices, tuple(face[::-1] for face in SIDES))
    flat = Solid("A", block.solid.vertices * [1.0, 1e-13, 1.0], SIDES)
    for solid in (turned, flat):
        wrong = SurveyedBlock(
            *(getattr(block, name) for name in ("code", "kind", "course", "face", "depth", "extrusion")),
            solid,
            block.vertex_sigma,
        )
        with pytest.raises(GeometryError, match=r"stone A: its faces enclose .* check its corners"):
            simplify(wrong)
