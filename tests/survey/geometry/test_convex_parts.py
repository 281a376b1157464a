"""Convex parts of non-convex stones; the truth is counted in cubes, or known from the construction."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from ground.errors import GeometryError
from survey.geometry.convex_parts import convex_parts
from survey.geometry.convexity import is_convex, reflex_edges
from survey.geometry.solids import Solid, planes_of_solid
from survey.geometry.watertight import check_watertight
from tests.survey.plain_blocks import drawn

Cell = tuple[int, ...]


def turned(solid: Solid, seed: int, far: float = 0.0) -> Solid:
    """Return the same solid elsewhere, in any direction."""
    random = np.random.default_rng(seed)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    return Solid(solid.code, solid.vertices @ turn.T + far * random.normal(size=3), solid.faces)


def cubes(cells: set[Cell]) -> Solid:
    """Return the surface of unit cubes, square by square."""
    number: dict[Cell, int] = {}
    faces = []
    for cell in sorted(cells):
        for axis, side in product(range(3), (0, 1)):
            step = [0, 0, 0]
            step[axis] = 2 * side - 1
            if tuple(np.add(cell, step).tolist()) in cells:
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            ring = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))[:: 1 if side else -1]:
                corner = list(cell)
                corner[axis] += side
                corner[u] += a
                corner[v] += b
                ring.append(number.setdefault(tuple(corner), len(number)))
            faces.append(tuple(ring))
    return Solid("A", np.array(list(number), dtype=float), tuple(faces))


def hull_volume(solid: Solid) -> float:
    return float(ConvexHull(solid.vertices - solid.vertices.mean(axis=0)).volume)


def check_parts(solid: Solid, volume: float) -> tuple[Solid, ...]:
    """Check that the parts are convex, closed, and as large as the whole; return them."""
    parts = convex_parts(solid)
    size = float(np.ptp(solid.vertices, axis=0).max())
    far = 4 * np.spacing(np.abs(solid.vertices).max()) / size
    for part in parts:
        check_watertight(part)
        planes = planes_of_solid(part)
        assert (part.vertices @ planes[:, :3].T - planes[:, 3]).max() <= (1e-12 + 8 * far) * size
    assert sum(map(hull_volume, parts)) == pytest.approx(volume, rel=1e-12 + 20 * far)
    return parts


L = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
PORTAL = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (2.5, 1.0), (2.5, 0.0), (3.0, 0.0), (3.0, 1.5), (0.0, 1.5)]
# a wedge whose upper side is folded in along the middle
FOLDED = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 0.8), (0.0, 1.0)]
SAW = [(0.0, 0.0), (5.0, 0.0), (5.0, 2.0), (4.0, 1.0), (3.0, 2.0), (2.0, 1.0), (1.0, 2.0), (0.0, 1.0)]


@pytest.mark.parametrize(
    ("outline", "area", "folds", "count"),
    [(L, 3.0, 1, 2), (PORTAL, 2.5, 2, 3), (FOLDED, 1.8, 1, 2), (SAW, 7.5, 2, 3)],
    ids=["L", "portal", "folded", "saw"],
)
@pytest.mark.parametrize(("seed", "far"), [(None, 0.0), (1, 0.0), (2, 1e4)])
def test_prisms_fall_into_as_few_parts_as_they_can(
    outline: list[tuple[float, float]], area: float, folds: int, count: int, seed: int | None, far: float
) -> None:
    solid = drawn("A", outline, far=1.0)
    solid = solid if seed is None else turned(solid, seed, far)
    assert len(reflex_edges(solid)) == folds
    assert len(check_parts(solid, area)) == count


def test_an_angle_falls_into_boxes_and_keeps_its_own_corners() -> None:
    parts = convex_parts(drawn("A", L, far=1.0))
    assert sorted(len(part.vertices) for part in parts) == [8, 8]
    places = {tuple(place) for part in parts for place in part.vertices.tolist()}
    assert {tuple(place) for place in drawn("A", L, far=1.0).vertices.tolist()} <= places


def test_a_groin_stone_is_cut_through_both_folds_at_once() -> None:
    """Two arms at a right angle, mitred: the cut along the mitre gives the arms back."""
    profile = np.array([(0.0, 1.0), (0.3, 1.1), (0.2, 1.5), (-0.1, 1.4)])  # width across, and height
    mitre = np.array([(w, w, z) for w, z in profile])
    arm, other = mitre.copy(), mitre.copy()
    arm[:, 0], other[:, 1] = 2.0, 2.0
    vertices = np.concatenate([mitre, arm, other])
    sides = [(i, (i + 1) % 4) for i in range(4)]
    faces = [(4, 5, 6, 7), (11, 10, 9, 8)]
    faces += [(i, j, 4 + j, 4 + i) for i, j in sides] + [(j, i, 8 + i, 8 + j) for i, j in sides]
    solid = Solid("G", vertices, tuple(faces))
    if _signed(solid) < 0.0:
        solid = Solid("G", vertices, tuple(face[::-1] for face in faces))
    check_watertight(solid)
    parts = check_parts(solid, _signed(solid))
    assert sorted(len(part.vertices) for part in parts) == [8, 8]


def _signed(solid: Solid) -> float:
    total = 0.0
    for face in solid.faces:
        a = solid.vertices[face[0]]
        for i, j in pairwise(face[1:]):
            total += float(np.linalg.det([a, solid.vertices[i], solid.vertices[j]])) / 6.0
    return total


@st.composite
def heaps(draw: st.DrawFn) -> set[Cell]:
    """Draw cubes connected by faces, without edges or corners that are their only contact."""
    cells: set[Cell] = {(0, 0, 0)}
    for _ in range(draw(st.integers(1, 5))):
        start = draw(st.sampled_from(sorted(cells)))
        step = draw(st.sampled_from([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]))
        cells.add(tuple(a + b for a, b in zip(start, step, strict=True)))
    for corner in {
        tuple(np.add(cell, step).tolist()) for cell in cells for step in product((0, 1), repeat=3)
    }:
        around = [
            step for step in product((-1, 0), repeat=3) if tuple(np.add(corner, step).tolist()) in cells
        ]
        assume(
            _hang_together(around)
            and _hang_together([s for s in product((-1, 0), repeat=3) if s not in around])
        )
    return cells


def _hang_together(steps: list[Cell]) -> bool:
    """Return whether octants about a corner are connected."""
    if not steps:
        return True
    reached, waiting = {steps[0]}, [steps[0]]
    while waiting:
        one = waiting.pop()
        for other in steps:
            if other not in reached and np.abs(np.subtract(one, other)).sum() == 1:
                reached.add(other)
                waiting.append(other)
    return len(reached) == len(steps)


@settings(max_examples=60, deadline=None)
@given(heaps(), st.integers(0, 100))
def test_heaps_of_cubes_are_filled_by_their_parts(cells: set[Cell], seed: int) -> None:
    straight = cubes(cells)
    parts = check_parts(straight, len(cells))
    assert len(parts) <= len(cells)
    random = np.random.default_rng(seed)
    for part in parts:  # within a part, everything is within some cube
        weights = random.dirichlet(np.ones(len(part.vertices)), 20)
        inside = np.floor(weights @ part.vertices).astype(int)
        assert {tuple(one) for one in inside.tolist()} <= cells
    check_parts(turned(straight, seed, 10.0), len(cells))


def test_a_ring_is_cut_open() -> None:
    ring = {(x, y, 0) for x in range(3) for y in range(3)} - {(1, 1, 0)}
    assert 4 <= len(check_parts(turned(cubes(ring), 3), 8)) <= 8


def test_a_stone_with_a_cavity_is_filled_around_it() -> None:
    shell: set[Cell] = set(product(range(3), repeat=3)) - {(1, 1, 1)}
    assert len(check_parts(cubes(shell), 26)) <= 12


def test_what_is_convex_stays_itself_and_parts_are_the_same_again() -> None:
    box = drawn("A", [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], far=1.0)
    assert convex_parts(box) == (box,)
    first, second = (convex_parts(turned(drawn("A", PORTAL, far=1.0), 5)) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        assert one.faces == other.faces
        np.testing.assert_array_equal(one.vertices, other.vertices)
    assert all(is_convex(one) for one in first)


def test_what_takes_too_many_parts_is_refused() -> None:
    with pytest.raises(
        GeometryError, match="stone A: it is not convex, and would take more than 2 convex parts"
    ):
        convex_parts(drawn("A", PORTAL, far=1.0), most=2)


def test_faces_that_are_not_plane_are_named_as_the_reason() -> None:
    solid = drawn("A", L, far=1.0)
    bent = solid.vertices.copy()
    bent[0] += [0.0, 0.02, -0.02]
    with pytest.raises(GeometryError, match="its faces are not quite planar"):
        convex_parts(Solid("A", bent, solid.faces))
