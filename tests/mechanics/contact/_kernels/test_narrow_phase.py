"""The contact points of two faces or two edges, against clipping twins and the moments of their overlap."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.contact._kernels import narrow_phase as kernel
from mechanics.contact.surfaces import surfaces
from mechanics.scene.shapes import BOX_FACES
from tests.mechanics.contact.polygons import clip, moments, overlap
from tests.mechanics.shapes import ellipse, prism
from tests.pipelines.results_by_hand import box

FLAT, THIN = np.cos(np.radians(5.0)), 1e-6
UP = np.array([0.0, 0.0, 1.0])
seeds = st.integers(0, 2**32 - 1)
coordinate = st.integers(-128, 128).map(lambda i: i / 64)


# --- clipping ---


def clipped(ring, a, b, side=99, slack=1e-9):
    """Kept corners (n, 3) and their labels; there is room for one corner more than the ring has."""
    count = len(ring)
    polygon, scratch = (
        kernel.Polygon(*np.zeros((3, count + 1)), np.zeros(count + 1, dtype=np.int64)) for _ in range(2)
    )
    for values, own in zip(polygon, (*ring.T, np.arange(count)), strict=True):
        values[:count] = own
    count = kernel.clip(polygon, count, tuple(map(float, a)), tuple(map(float, b)), side, slack, scratch)
    return np.column_stack(polygon[:3])[:count], polygon.label[:count].tolist()


def test_a_side_without_length_cuts_nothing():
    """Two corners of a face that is seen edge-on may fall together in the plane."""
    ring = np.array([(0.0, 0.0, 0.1), (1.0, 0.0, 0.2), (1.0, 1.0, 0.3), (0.0, 1.0, 0.4)])
    found, labels = clipped(ring, (0.25, 0.5), (0.25, 0.5))
    np.testing.assert_array_equal(found, ring)
    assert labels == [0, 1, 2, 3]


def assert_same_ring(found, expected, atol):
    """The same corners in the same order round, wherever it begins; corners that fall together count once."""

    def distinct(ring):
        apart = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1) > atol
        return ring[apart]

    found, expected = distinct(found), distinct(expected)
    assert len(found) == len(expected)
    if len(found):
        begin = np.linalg.norm(expected - found[0], axis=1).argmin()
        np.testing.assert_allclose(found, np.roll(expected, -begin, axis=0), atol=atol)


@settings(max_examples=150, deadline=None)
@given(st.integers(3, 8), st.tuples(coordinate, coordinate), st.tuples(coordinate, coordinate))
def test_clipping_keeps_what_lies_left_of_the_line(sides, a, b):
    assume(a != b)
    ring = np.column_stack([ellipse(sides, (1.0, 0.7), 0.3), np.linspace(0, 1, sides)])
    found, label = clipped(ring, a, b)
    a, b = np.array([*a, 0.0]), np.array([*b, 0.0])
    assert_same_ring(found, clip(ring, a, np.cross(b - a, UP)), atol=1e-8)
    assert len(set(label)) == len(label)


def test_clipping_along_an_edge_takes_nothing_and_renames_nothing():
    square = np.array([(0, 0, 0.1), (1, 0, 0.2), (1, 1, 0.3), (0, 1, 0.4)])
    for a, b in zip(square[:, :2], np.roll(square[:, :2], -1, axis=0), strict=True):
        for nudge in (-1e-10, 0.0, 1e-10):
            found, label = clipped(square, a + nudge, b + nudge)
            np.testing.assert_array_equal(found, square)
            assert label == [0, 1, 2, 3]


def test_points_are_named_after_the_edge_that_begins_in_them():
    square = np.column_stack([box((0, 0, 0), (1, 1, 0))[:4, :2], np.zeros(4)])
    # what lies left of x = 1/2, upwards: corners 0 and 3, and both cuts
    found, label = clipped(square, (0.5, 0), (0.5, 1), side=7)
    np.testing.assert_allclose(found[:, :2], [(0, 0), (0.5, 0), (0.5, 1), (0, 1)])
    assert label == [0, 7, 2, 3]


# --- the points of two faces ---


def points_of(first, second, kind, feature, axis=UP, points=4, inner=False, limit=0.1, spacing=0.0):
    """Contact points of one pair with a given feature: place, frame, nearest, area."""
    pair = kernel.Pairs(
        *map(np.array, ([[0, 1]], [limit], [False], [kind], [feature], [np.asarray(axis, dtype=float)]))
    )
    return kernel.interface_points(pair, points, inner, False, spacing, FLAT, THIN, packed(first, second))


def packed(*stones):
    """Polyhedra of stones, each given by corners and faces."""
    corners, faces = zip(*stones, strict=True)
    return surfaces(corners, faces, [None] * sum(map(len, faces)), range(len(stones))).shapes


class Stack:
    """A prism on a prism, both random; the upper one may be tilted about a point of its bottom."""

    def __init__(self, seed, degrees=0.0, swap=False):
        rng = np.random.default_rng(seed)
        lower = ellipse(int(rng.integers(3, 9)), rng.uniform(0.5, 1.0, 2), rng.uniform(0, 6))
        upper = ellipse(
            int(rng.integers(3, 9)), rng.uniform(0.3, 1.0, 2), rng.uniform(0, 6), rng.uniform(-0.6, 0.6, 2)
        )
        self.gap = rng.uniform(-0.05, 0.05)
        tilt = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.8, 0.0]))
        lower, (corners, faces) = prism(lower, -1.0, 0.0), prism(upper, 0.0, 0.8)
        upper = tilt.apply(corners) + self.gap * UP, faces
        self.bottom = upper[0][list(faces[0])]  # clockwise seen from above
        self.top = lower[0][list(lower[1][1])]
        self.sides = len(lower[1])
        if swap:
            self.stones, self.kind, self.feature = (upper, lower), kernel.FACE_SECOND, [len(faces) + 1, 0]
        else:
            self.stones, self.kind, self.feature = (lower, upper), kernel.FACE_FIRST, [1, self.sides]

    @property
    def common(self):
        """Corners (n, 3) of the upper face above the lower one, clockwise seen from above."""
        return overlap(self.top, self.bottom, UP)

    def points(self, **settings):
        return points_of(*self.stones, self.kind, self.feature, **settings)


def sorted_rows(rows):
    return rows[np.lexsort(np.round(rows, 9).T)]


def large_enough(stack):
    common = stack.common
    assume(len(common) > 2)
    area = moments(common[:, :2])[0]
    assume(area > 1e-3)
    return area


@settings(max_examples=100, deadline=None)
@given(seeds, st.sampled_from([0.0, 2.0, 4.0, 12.0, 40.0]), st.booleans())
def test_the_points_are_the_corners_of_the_overlap_within_the_alert_distance(seed, degrees, swap):
    stack = Stack(seed, degrees, swap)
    whole, common = large_enough(stack), stack.common
    near = common[common[:, 2] <= 0.1]
    place, frame, nearest, area = stack.points(points=16)
    assert len(place) == len(near)
    np.testing.assert_allclose(sorted_rows(nearest[:, 0]), sorted_rows(near), atol=1e-9)
    np.testing.assert_allclose(nearest[:, 1], nearest[:, 0] * [1, 1, 0], atol=1e-12)  # straight below
    np.testing.assert_allclose(frame[:, 0], np.tile(UP, (len(place), 1)), atol=1e-14)
    np.testing.assert_array_equal(place[:, 0], 0)
    np.testing.assert_array_equal(place[:, 1], 0 if swap else 1)  # the upper one is the candidate
    assert len(set(place[:, 2].tolist())) == len(place)
    if len(near):
        assert area.sum() == pytest.approx(whole, rel=1e-10)


def shares_twin(x, area, centroid):
    """The shares nearest to even ones that add up to the area and have its centroid; see `point_areas`."""
    count, even = len(x), area / len(x)
    rows = np.vstack([np.ones(count), x.T])
    share = (
        even + np.linalg.lstsq(rows, np.array([area, *(area * centroid)]) - rows @ np.full(count, even))[0]
    )
    part = min(1.0, 0.9 * even / max(even - share.min(), 1e-300))
    return even + part * (share - even), part == 1.0


@settings(max_examples=100, deadline=None)
@given(seeds, st.sampled_from([3, 4, 8, 16]))
def test_the_areas_add_up_to_the_overlap_and_have_its_centroid(seed, points):
    stack = Stack(seed)
    large_enough(stack)
    whole, first, _ = moments(stack.common[:, :2])
    _, _, nearest, area = stack.points(points=points)
    assert area.sum() == pytest.approx(whole, rel=1e-12)
    expected, exact = shares_twin(nearest[:, 0, :2], whole, first / whole)
    np.testing.assert_allclose(area, expected, rtol=1e-8, atol=1e-10)
    assert area.min() > 0.0999 * whole / len(area)
    if exact:
        np.testing.assert_allclose(area @ nearest[:, 0, :2], first, atol=1e-11)


def recedes(x, kept):
    """How far the corners left out lie from the edge that remains [m]."""
    far = 0.0
    for a, c in zip(kept, [*kept[1:], kept[0] + len(x)], strict=True):
        chord = x[c % len(x)] - x[a]
        left = [x[p % len(x)] - x[a] for p in range(a + 1, c)]
        far = max([far, *(abs(chord[0] * d[1] - chord[1] * d[0]) / np.linalg.norm(chord) for d in left)])
    return far


def half_width(x):
    """Twice the smaller radius of gyration of a polygon: the radius of a disk [m]."""
    whole, first, second = moments(x)
    central = second / whole - np.outer(first, first) / whole**2
    return 2.0 * np.sqrt(np.linalg.eigvalsh(central)[0])


def spread_twin(x, wanted, recess):
    """Leave out the corner that cuts off the smallest triangle while the edge recedes by less; of equals, the first."""
    chosen = list(range(len(x)))
    while len(chosen) > wanted:
        before, after = x[np.roll(chosen, 1)], x[np.roll(chosen, -1)]
        edges = x[chosen] - before, after - before
        area = np.abs(edges[0][:, 0] * edges[1][:, 1] - edges[0][:, 1] * edges[1][:, 0])
        allowed = [recedes(x, chosen[:p] + chosen[p + 1 :]) <= recess for p in range(len(chosen))]
        if not any(allowed):
            break
        area = np.where(allowed, area, np.inf)
        del chosen[int(np.flatnonzero(area <= area.min() * (1 + 1e-6))[0])]
    return chosen


def test_points_on_an_edge_go_before_corners():
    """Two equally deep stones whose long edges cross by a hair: the crossing is no corner."""
    x = np.array([0.55, 1.0, 1.0, 0.825, 0.55])
    y = np.array([-0.125, -0.125, 0.125, 0.125 + 1e-9, 0.125])
    chosen = np.empty(5, dtype=np.int64)
    assert kernel.spread(x, y, 5, 4, 1e-3, chosen) == 4
    np.testing.assert_array_equal(chosen[:4], [0, 1, 2, 4])


@settings(max_examples=100, deadline=None)
@given(seeds, st.sampled_from([3, 4, 8]))
def test_of_many_corners_those_that_cut_off_least_are_left_out_while_the_edge_stays(seed, points):
    stack = Stack(seed)
    large_enough(stack)
    everything = stack.points(points=32)
    kept = stack.points(points=points)
    x = everything[2][:, 0, :2]
    rows = spread_twin(x, points, 5e-3 * half_width(x))
    np.testing.assert_array_equal(kept[0], everything[0][rows])
    np.testing.assert_array_equal(kept[2], everything[2][rows])


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(3, 200), st.sampled_from([3, 4, 8]), st.floats(0.2, 1.0))
def test_leaving_corners_out_moves_no_edge_by_more_than_the_recess(seed, corners, points, narrow):
    """The corners lie anywhere on an ellipse: often several beside one another."""
    angle = np.sort(np.random.default_rng(seed).uniform(0, 2 * np.pi, corners))
    x = np.column_stack([np.cos(angle), narrow * np.sin(angle)])
    chosen = np.empty(corners, dtype=np.int64)
    kept = chosen[: kernel.spread(*x.T.copy(), corners, points, 0.01, chosen)].tolist()
    assert kept == sorted(set(kept))
    assert len(kept) >= min(points, corners)
    assert recedes(x, kept) <= 0.01 * (1 + 1e-12)


@pytest.mark.parametrize(("sides", "count"), [(3, 3), (5, 5), (16, 16), (32, 32), (64, 32), (400, 63)])
def test_a_regular_face_keeps_the_corners_that_decide_whatever_their_number(sides, count):
    """In each direction the edge lies within 0.5 % of the radius of where it was; 400 corners need no 400 points."""
    ring = ellipse(sides, (1.0, 1.0), 0.3)
    place, _, nearest, area = points_of(
        prism(ring, -1.0, 0.0), prism(ring, 0.0, 1.0), kernel.FACE_FIRST, [1, sides + 2]
    )
    assert min(sides, 32) <= len(place) <= count
    assert len(set(place[:, 2].tolist())) == len(place)
    assert area.sum() == pytest.approx(0.5 * sides * np.sin(2 * np.pi / sides), rel=1e-9)
    angle = np.sort(np.arctan2(nearest[:, 0, 1], nearest[:, 0, 0]))
    widest = np.diff([*angle, angle[0] + 2 * np.pi]).max()
    assert np.cos(widest / 2) >= np.cos(np.pi / sides) - 5e-3


@pytest.mark.parametrize("sides", [4, 7, 40, 800])
def test_names_of_points_stay_below_their_room(sides):
    """All of the corners, cuts by sides, and points inside; the largest face of the largest stone that is allowed."""
    ring = ellipse(sides, (1.0, 1.0), 0.3)
    assert 6 * sides <= kernel.MAX_CORNERS
    for upper in (ring, 1.01 * ring[:: max(sides // 4, 1)], ellipse(sides, (1.0, 0.9), 0.4)):
        stones = prism(ring, -1.0, 0.0), prism(upper, 0.0, 1.0)
        for inner in (False, True):
            place, *_ = points_of(*stones, kernel.FACE_FIRST, [1, sides + 2], points=8, inner=inner)
            assert len(set(place[:, 2].tolist())) == len(place) >= 4
            assert place[:, 2].max() < 1 << kernel.NAME_BITS


@settings(max_examples=100, deadline=None)
@given(seeds, st.sampled_from([3, 4, 8]), st.sampled_from([0.0, 3.0]), st.booleans())
@example(seed=0, points=4, degrees=0.0, swap=False)
def test_inner_points_carry_area_centroid_and_second_moments_exactly(seed, points, degrees, swap):
    stack = Stack(seed, degrees, swap)
    large_enough(stack)
    whole, first, second = moments(stack.common[:, :2])
    place, _, nearest, area = stack.points(points=points, inner=True)
    x = nearest[:, 1, :2]
    assert len(place) == points
    assert len(set(place[:, 2].tolist())) == points
    np.testing.assert_allclose(area, whole / points, rtol=1e-12)
    np.testing.assert_allclose(area @ x, first, atol=1e-12 * whole)
    np.testing.assert_allclose(np.einsum("p,pi,pj->ij", area, x, x), second, atol=1e-12 * whole)
    # on both faces, one straight above the other
    np.testing.assert_allclose(nearest[:, 0, :2], x, atol=1e-13)
    n = np.cross(*(stack.bottom[1:3] - stack.bottom[0]))
    np.testing.assert_allclose((nearest[:, 0] - stack.bottom[0]) @ n, 0.0, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(seeds, st.booleans(), st.sampled_from([0.0, 3.0]))
def test_a_single_point_is_the_centroid_of_the_overlap(seed, inner, degrees):
    stack = Stack(seed, degrees)
    large_enough(stack)
    assume(stack.common[:, 2].max() <= 0.1)  # all corners are watched; otherwise the deepest one counts
    whole, first, _ = moments(stack.common[:, :2])
    place, _, nearest, area = stack.points(points=1, inner=inner)
    assert len(place) == 1
    np.testing.assert_allclose(nearest[0, 1, :2], first / whole, atol=1e-12)
    assert area[0] == pytest.approx(whole, rel=1e-12)


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_a_single_point_of_faces_that_do_not_lie_flat_is_the_deepest(seed):
    stack = Stack(seed, 20.0)
    large_enough(stack)
    lowest = stack.common[stack.common[:, 2].argmin()]
    _, _, nearest, _ = stack.points(points=1)
    if lowest[2] <= 0.1:
        np.testing.assert_allclose(nearest[0, 0], lowest, atol=1e-9)
    else:
        assert len(nearest) == 0


def test_a_face_on_a_smaller_one_touches_in_the_smaller_ones_corners():
    small = prism(ellipse(4, (0.6, 0.6), 0.3), -1.0, 0.0)
    large = prism(ellipse(4, (3.0, 3.0)), 0.02, 1.0)
    place, _, nearest, area = points_of(small, large, kernel.FACE_FIRST, [1, 6])
    np.testing.assert_allclose(sorted_rows(nearest[:, 1]), sorted_rows(small[0][4:]), atol=1e-13)
    np.testing.assert_allclose(area, 0.6**2 / 2, rtol=1e-12)
    assert len(set(place[:, 2].tolist())) == 4


@pytest.mark.parametrize(("shift", "count"), [(0.0, 4), (1 - 2e-6, 4), (1 - 5e-7, 0), (1.0, 0), (1.1, 0)])
def test_flat_faces_that_overlap_by_less_than_a_millionth_do_not_touch(shift, count):
    lower = box((0, 0, -1), (1, 1, 0)), BOX_FACES
    upper = box((shift, 0, 0), (1 + shift, 1, 1)), BOX_FACES
    place, *_ = points_of(lower, upper, kernel.FACE_FIRST, [1, 6])
    assert len(place) == count


def test_frames_turn_with_the_reference_stone():
    """t1 runs along the first edge of its face, and the frame is right-handed."""
    stack = Stack(3)
    _, frame, _, _ = stack.points()
    edge = stack.top[1] - stack.top[0]
    np.testing.assert_allclose(frame[:, 1], np.tile(edge / np.linalg.norm(edge), (len(frame), 1)), atol=1e-13)
    np.testing.assert_allclose(np.cross(frame[:, 0], frame[:, 1]), frame[:, 2], atol=1e-14)


# --- edges ---


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_two_edges_touch_in_the_feet_of_their_common_normal(seed):
    rng = np.random.default_rng(seed)
    first, second = ((box(-half, half) @ Rotation.random(random_state=rng).as_matrix().T, BOX_FACES)
                     for half in rng.uniform(0.3, 0.6, (2, 3)))  # fmt: skip
    both = packed(first, second)
    one, two = int(rng.integers(12)), int(12 + rng.integers(12))
    a, b, c, d = (
        both.vertex[end] for end in (both.edge_a[one], both.edge_b[one], both.edge_a[two], both.edge_b[two])
    )
    axis = np.cross(b - a, d - c)
    assume(np.linalg.norm(axis) > 0.1)
    axis /= np.linalg.norm(axis)
    # brought together so that inner points of both edges lie one over the other, 0.01 apart
    s, t = rng.uniform(0.1, 0.9, 2)
    shift = a + s * (b - a) + 0.01 * axis - (c + t * (d - c))
    second = second[0] + shift, BOX_FACES
    place, frame, nearest, area = points_of(first, second, kernel.EDGES, [one, two], axis)
    assert place[:, :2].tolist() == [[0, 0]]
    np.testing.assert_allclose(nearest[0, 0], a + s * (b - a), atol=1e-12)
    np.testing.assert_allclose(nearest[0, 1], nearest[0, 0] + 0.01 * axis, atol=1e-12)
    np.testing.assert_allclose(frame[0, 0], -axis, atol=1e-14)  # towards the first, which is the candidate
    np.testing.assert_allclose(frame[0] @ frame[0].T, np.eye(3), atol=1e-13)
    assert area[0] == 0.0


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_shares_of_an_area_follow_their_twin(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 9))
    x, share = rng.uniform(-1, 1, (count, 2)), np.zeros(count)
    centroid = rng.dirichlet(np.ones(count)) @ x
    kernel.point_areas(*x.T.copy(), count, 0.7, *centroid, share)
    expected, _ = shares_twin(x, 0.7, centroid)
    assert share.sum() == pytest.approx(0.7, rel=1e-12)
    if count > 2 and np.linalg.matrix_rank(x - x.mean(axis=0), tol=1e-3) == 2:
        np.testing.assert_allclose(share, expected, atol=1e-9)


def test_shares_do_not_jump_where_one_would_vanish():
    """Three corners of a rectangle: its centroid lies on the line between two of them."""
    x, share = np.array([(0.0, 0), (1, 0), (1, 2)]), np.zeros(3)
    for nudge in (-1e-12, 0.0, 1e-12):
        kernel.point_areas(*x.T.copy(), 3, 2.0, 0.5 + nudge, 1.0, share)
        # exact would be 1, 0, 1; a tenth of an even share for the second, the rest as even as before
        np.testing.assert_allclose(share, np.array([29, 2, 29]) / 30, atol=1e-10)


# --- points over the area ---


def cells_twin(stack, spacing, swap):
    """Areas and first moments of the cells of a grid on the smaller face, by clipping, and the corners in each."""
    common = stack.common[:, :2]
    lower, upper = stack.top[:, :2], stack.bottom[:, :2]
    first, second = ((upper, -1.0), (lower, 1.0)) if swap else ((lower, 1.0), (upper, -1.0))
    ring, up = second if moments(second[0])[0] < moments(first[0])[0] * (1 - 1e-6) else first
    sides = np.roll(ring, -1, axis=0) - ring
    lengths = np.linalg.norm(sides, axis=1)
    e1 = sides[np.flatnonzero(lengths > lengths.max() * (1 - 1e-6))[0]]
    e1 = e1 / np.linalg.norm(e1)
    axes = np.array([e1, [-up * e1[1], up * e1[0]]])
    grid = ring @ axes.T
    low, length = grid.min(axis=0), np.ptp(grid, axis=0)
    count = np.maximum(2, np.ceil(length / spacing - 1e-6)).astype(int)
    pitch = length / count
    lines = []
    for axis in range(2):
        across = common @ axes[axis] - low[axis]
        inner = np.arange(1, count[axis]) * pitch[axis]
        reach = 0.25 * pitch[axis]
        inner = inner[(inner - across.min() >= reach) & (across.max() - inner >= reach)]
        if not len(inner):
            inner = np.array([(across.min() + across.max()) / 2])
        lines.append([-np.inf, *inner, np.inf])
    flat = np.column_stack([common, np.zeros(len(common))])
    found, pending, corners, among = [], np.zeros(3), [], set()
    for a in range(len(lines[0]) - 1):
        for b in range(len(lines[1]) - 1):
            cell = flat
            for axis, n in ((0, a), (1, b)):
                normal = np.array([*axes[axis], 0.0])
                for sign, bound in ((1.0, lines[axis][n + 1]), (-1.0, lines[axis][n])):
                    if np.isfinite(bound) and len(cell):
                        cell = clip(cell, (bound + low[axis]) * normal, sign * normal)
            area, first_moment, _ = moments(cell[:, :2]) if len(cell) > 2 else (0.0, np.zeros(2), 0)
            pending = pending + np.array([area, *first_moment])
            among |= {q for q, x in enumerate(common) if len(cell)
                      and np.linalg.norm(cell[:, :2] - x, axis=1).min() < 1e-9}  # fmt: skip
            if pending[0] >= 1e-3 * pitch.prod():
                found.append(pending)
                corners.append(among)
                pending, among = np.zeros(3), set()
    if found:
        found[-1] = found[-1] + pending
        corners[-1] = corners[-1] | among
    else:
        found, corners = [pending], [among]
    return np.array(found), corners


def at_corners(place):
    """Tell which contact points are named after corners of the overlap, not after cells."""
    return place[:, 2] >> 23 & 3 == 3


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from([0.07, 0.3, 2.0]), st.sampled_from([0.0, 3.0]), st.booleans())
def test_points_over_the_area_are_those_of_cells_whose_corners_share_a_quarter(seed, spacing, degrees, swap):
    stack = Stack(seed, degrees, swap)
    large_enough(stack)
    assume(stack.common[:, 2].min() <= 0.1)
    whole, first, _ = moments(stack.common[:, :2])
    place, _, nearest, area = stack.points(spacing=spacing)
    x = nearest[:, 1, :2]
    assert len(set(place[:, 2].tolist())) == len(place) >= 3
    assert area.sum() == pytest.approx(whole, rel=1e-12)
    np.testing.assert_allclose(area @ x, first, atol=1e-12 * whole)
    corner = at_corners(place)
    assert corner.sum() >= 3
    if degrees == 0.0:
        twin, among = cells_twin(stack, spacing, swap)
        common = stack.common[:, :2]
        chosen = {int(np.linalg.norm(common - one, axis=1).argmin()): k for k, one in enumerate(x[corner])}
        np.testing.assert_allclose(common[list(chosen)], x[corner], atol=1e-9)
        expected, shares = twin.copy(), np.zeros(corner.sum())
        for cell, inside in enumerate(among):
            # a corner on a line of the grid lies beyond it
            taken = sorted(inside.difference(*among[cell + 1 :]) & chosen.keys())
            for q in taken:
                shares[chosen[q]] = twin[cell, 0] / (4 * len(taken))
                expected[cell] -= shares[chosen[q]] * np.array([1.0, *common[q]])
        np.testing.assert_allclose(area[corner], shares, atol=1e-11)
        np.testing.assert_allclose(area[~corner], expected[:, 0], atol=1e-11)
        np.testing.assert_allclose((area[:, None] * x)[~corner], expected[:, 1:], atol=1e-11)
    n = np.cross(*(stack.bottom[1:3] - stack.bottom[0]))
    np.testing.assert_allclose((nearest[:, 0] - stack.bottom[0]) @ n, 0.0, atol=1e-12)


def test_cells_stay_with_the_smaller_face_as_it_slides_over_a_larger_one_and_over_its_edge():
    """A stone 0.4 × 0.2 m slides over the edge of a plate: points on it keep names and places."""
    plate = prism(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)]), -1.0, 0.0)
    ring = np.array([(0.0, 0.0), (0.4, 0.0), (0.4, 0.2), (0.0, 0.2)])
    seen = []
    for way in (0.5, 0.513, 1.6, 1.63, 1.75):
        stone = prism(ring + np.array([way, 0.3]), 0.0, 0.3)
        feature = [1, len(plate[1])]
        place, _, nearest, area = points_of(plate, stone, kernel.FACE_FIRST, feature, spacing=0.1)
        assert area.sum() == pytest.approx(0.2 * min(0.4, 2.0 - way), rel=1e-12)
        seen.append(dict(zip(place[:, 2].tolist(), nearest[:, 0, :2] - [way, 0.3], strict=True)))
    # and four corners
    assert [len(one) for one in seen] == [12, 12, 12, 12, 10]
    for one in seen[1:3]:
        assert one.keys() == seen[0].keys()
        np.testing.assert_allclose([one[name] for name in seen[0]], list(seen[0].values()), atol=1e-12)
    # over 0.37 m the last cells are 0.07 m long, over 0.25 m they are halves; corners are named after cells
    cells = [{name for name in one if name >> 23 & 3 == 2} for one in seen]
    assert cells[3] == cells[0] > cells[4]
    assert seen[3].keys() == seen[0].keys()


def test_too_many_cells_are_refused():
    ring = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    with pytest.raises(ValueError, match="too many cells"):
        points_of(prism(ring, -1.0, 0.0), prism(ring, 0.0, 1.0), kernel.FACE_FIRST, [1, 6], spacing=1e-3)
