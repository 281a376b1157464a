"""The kernels of contact detection against slow, readable twins."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay

from mechanics.contact import _kernels as kernel
from mechanics.contact.surfaces import surfaces
from tests.mechanics.shapes import TURN, hexahedra
from tests.pipelines.handmade import BOX_FACES, box

coordinate = st.integers(-128, 128).map(lambda i: i / 64)


def close_pairs(low, high, fixed):
    """Try all pairs."""
    return {
        (i, j)
        for i, j in itertools.combinations(range(len(low)), 2)
        if not (fixed[i] and fixed[j]) and (low[i] <= high[j]).all() and (low[j] <= high[i]).all()
    }


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[coordinate] * 3, *[st.floats(0.0, 1.5)] * 3, st.booleans()), min_size=1, max_size=40)
)
def test_broad_phase_finds_the_pairs_that_trying_all_finds(boxes):
    table = np.array(boxes, dtype=float)
    low, fixed = table[:, :3].copy(), table[:, 6].astype(bool)
    high = low + table[:, 3:6]
    found = kernel.close_pairs(low, high, fixed)
    assert len(found) == len({tuple(p) for p in found.tolist()})
    assert {tuple(p) for p in found.tolist()} == close_pairs(low, high, fixed)


def test_broad_phase_makes_room_for_many_pairs():
    low = np.zeros((60, 3))
    assert len(kernel.close_pairs(low, low + 1, np.zeros(60, dtype=bool))) == 60 * 59 // 2


def clip(polygon, origin, normal):
    """Sutherland–Hodgman, one edge after another."""
    kept = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        da, db = normal @ (a - origin), normal @ (b - origin)
        if da <= 0:
            kept.append(a)
        if da * db < 0:
            kept.append(a + da / (da - db) * (b - a))
    return np.array(kept).reshape(-1, 3)


def padded(polygon):
    room, label = np.zeros((kernel.MAX_POINTS, 3)), np.zeros(kernel.MAX_POINTS, dtype=np.int64)
    room[: len(polygon)], label[: len(polygon)] = polygon, np.arange(len(polygon))
    return room, label


@settings(max_examples=60, deadline=None)
@given(st.tuples(coordinate, coordinate, coordinate), st.tuples(coordinate, coordinate))
def test_clipping_a_polygon_by_a_plane(normal, place):
    angle = np.arange(6) * np.pi / 3
    hexagon = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    normal, origin = np.array(normal), np.array([*place, 0.0])
    polygon, label = padded(hexagon)
    count = kernel.clip_polygon(polygon, label, 6, origin, normal, 2)
    np.testing.assert_allclose(polygon[:count], clip(hexagon, origin, normal), atol=1e-12)
    assert len(set(label[:count].tolist())) == count


def turned_square(half, angle, centre=(0.0, 0.0), height=0.0):
    c, s = np.cos(angle), np.sin(angle)
    ring = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) @ np.array([[c, s], [-s, c]]) + centre
    return np.column_stack([ring, np.full(4, height)])


def face_points(reference, incident, alert=0.1):
    """The points in which a face that looks up carries one that looks down."""
    vertices = np.vstack([reference, incident[::-1]])
    n = np.array([0.0, 0.0, 1.0])
    count, *rest = kernel.face_points(0, 1, n, np.array([0, 4, 8]), np.arange(8), vertices, alert, True, 1e-6)
    return [part[:count] for part in rest]


@settings(max_examples=60, deadline=None)
@given(st.floats(0.3, 2.0), st.floats(-0.8, 0.8), st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_face_points_are_the_corners_of_the_overlap_each_with_a_name_of_its_own(half, angle, centre):
    reference, incident = turned_square(1.0, 0.1), turned_square(half, 0.1 + angle, centre, 0.01)
    polygon, gap, area, label = face_points(reference, incident)
    expected = incident[::-1]
    for a, b in zip(reference, np.roll(reference, -1, axis=0), strict=True):
        expected = clip(expected, a, np.cross(b - a, [0, 0, 1])) if len(expected) else expected
    whole = ConvexHull(expected[:, :2], qhull_options="QJ").volume if len(expected) > 2 else 0.0
    if whole < 1e-5:
        return
    np.testing.assert_allclose(gap, 0.01, atol=1e-14)
    assert area.sum() == pytest.approx(whole, rel=1e-6)
    assert (area > -1e-15).all()
    assert len(polygon) == len(expected)
    assert len(set(label.tolist())) == len(label)


def test_a_face_on_a_smaller_one_touches_in_the_smaller_ones_corners():
    small = turned_square(0.5, 0.3)
    polygon, _, area, label = face_points(small, turned_square(2.0, 0.0, height=-0.02))
    order = np.lexsort(polygon[:, :2].T)
    np.testing.assert_allclose(polygon[order][:, :2], small[np.lexsort(small[:, :2].T)][:, :2], atol=1e-14)
    np.testing.assert_allclose(area, 0.25, rtol=1e-12)
    assert len(set(label.tolist())) == 4


# --- mortar integrals ---


def barycentric(x, tri):
    return np.linalg.solve(np.vstack([tri.T, np.ones(3)]), [*x, 1.0])


def clip_flat(polygon, cutter):
    cutter = np.column_stack([cutter, np.zeros(len(cutter))])
    result = np.column_stack([polygon, np.zeros(len(polygon))])
    for a, b in zip(cutter, np.roll(cutter, -1, axis=0), strict=True):
        if len(result):
            result = clip(result, a, np.cross(b - a, [0, 0, 1.0]))
    return result[:, :2]


def mortar_integrals(xc, tc, xa, ta, outline):
    """Cut each candidate triangle by each antagonist polygon; seven-point Radon quadrature, exact to degree 5."""
    root = np.sqrt(15.0)
    points = [(1 / 3, 1 / 3, 1 / 3, 9 / 40)]
    for sign in (1, -1):
        near, weight = (6 + sign * root) / 21, (155 + sign * root) / 1200
        far = 1 - 2 * near
        points += [(near, near, far, weight), (near, far, near, weight), (far, near, near, weight)]
    area, own = np.zeros(len(xc)), np.zeros((len(xc),) * 2)
    other, centre = np.zeros((len(xc), len(xa))), np.zeros((len(xc), 2))
    for t in tc:
        for s in ta if len(ta) else [None]:
            cutter = outline if s is None else xa[s]
            if np.cross(np.append(cutter[1] - cutter[0], 0), np.append(cutter[2] - cutter[0], 0))[2] < 0:
                cutter = cutter[::-1]
            polygon = clip_flat(xc[t], cutter)
            for k in range(1, len(polygon) - 1):
                tri = polygon[[0, k, k + 1]]
                size = 0.5 * abs(np.linalg.det(tri[1:] - tri[0]))
                for *bary, weight in points:
                    x = np.array(bary) @ tri
                    n_c, w = barycentric(x, xc[t]), size * weight
                    area[t] += w * n_c
                    centre[t] += w * np.outer(n_c, x)
                    own[np.ix_(t, t)] += w * np.outer(n_c, n_c)
                    if s is not None:
                        other[np.ix_(t, s)] += w * np.outer(n_c, barycentric(x, xa[s]))
    return area, own, other, centre


def patch(width, height, count, angle=0.0, shift=(0.0, 0.0), seed=0, flip=False):
    """A triangulated rectangle with uneven nodes inside."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0, 1, count)
    edge = np.array([p for p in itertools.product(s, s) if 0 in p or 1 in p])
    x = np.vstack([edge, rng.uniform(0.15, 0.85, (count, 2))])
    triangles = Delaunay(x).simplices.astype(np.int64)
    flat = np.abs(np.linalg.det(x[triangles[:, 1:]] - x[triangles[:, :1]])) < 1e-9
    c, s = np.cos(angle), np.sin(angle)
    triangles = triangles[~flat]
    return (x * [width, height]) @ np.array([[c, s], [-s, c]]) + shift, (
        triangles[:, ::-1].copy() if flip else triangles
    )


NOTHING = np.zeros((0, 3), dtype=np.int64)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.3])
def test_mortar_integrals_between_two_meshes_are_those_of_their_twin(angle, flip):
    xc, tc = patch(1.0, 0.7, 4)
    xa, ta = patch(0.8, 1.1, 3, angle, (0.3, -0.2), seed=1, flip=flip)
    found = kernel.mortar_integrals(xc, tc, xa, ta, np.zeros((0, 2)))
    for ours, twin in zip(found, mortar_integrals(xc, tc, xa, ta, None), strict=True):
        np.testing.assert_allclose(ours, twin, atol=1e-13)


@settings(max_examples=25, deadline=None)
@given(st.floats(-1.5, 1.5), st.tuples(st.floats(-0.4, 0.9), st.floats(-0.4, 0.6)), st.booleans())
def test_mortar_integrals_share_out_the_overlap(angle, shift, rigid):
    xc, tc = patch(1.0, 0.7, 4)
    outline, _ = patch(0.8, 0.6, 2, angle, shift)
    outline = outline[[0, 2, 3, 1]]
    xa, ta = (outline, NOTHING) if rigid else patch(0.8, 0.6, 3, angle, shift, seed=2)
    area, own, other, centre = kernel.mortar_integrals(xc, tc, xa, ta, outline if rigid else np.zeros((0, 2)))
    overlap = clip_flat(np.array([(0, 0), (1, 0), (1, 0.7), (0, 0.7)], dtype=float), outline)
    local = overlap - overlap.mean(axis=0) if len(overlap) else np.zeros((1, 2))
    nxt = np.roll(local, -1, axis=0)
    whole = 0.5 * (local[:, 0] * nxt[:, 1] - local[:, 1] * nxt[:, 0]).sum()
    assert area.sum() == pytest.approx(whole, abs=1e-12)  # the N_i add up to 1
    np.testing.assert_allclose(own.sum(axis=1), area, atol=1e-13)
    np.testing.assert_allclose(own, own.T, atol=1e-15)
    if not rigid:
        np.testing.assert_allclose(other.sum(axis=1), area, atol=1e-13)
        np.testing.assert_allclose(other @ xa, centre, atol=1e-13)  # shape functions reproduce x
    np.testing.assert_allclose(own @ xc, centre, atol=1e-13)


def test_mortar_integrals_of_two_triangles_on_a_larger_rectangle_have_their_closed_form():
    # ∫N = A/3, ∫N² = A/6, ∫N_i N_k = A/12 on each triangle of area A = ab/2
    a, b = 0.8, 0.3
    xc, tc = np.array([(0, 0), (a, 0), (a, b), (0, b)]), np.array([(0, 1, 2), (0, 2, 3)])
    outline = np.array([(-1, -1), (2, -1), (2, 2), (-1, 2)], dtype=float)
    area, own, _, centre = kernel.mortar_integrals(xc, tc, outline, NOTHING, outline)
    part = a * b / 2
    np.testing.assert_allclose(area, part * np.array([2, 1, 2, 1]) / 3, rtol=1e-13)
    np.testing.assert_allclose(own[0], part / 12 * np.array([4, 1, 2, 1]), rtol=1e-13)
    np.testing.assert_allclose(own[1], part / 12 * np.array([1, 2, 1, 0]), atol=1e-16)
    np.testing.assert_allclose(centre.sum(axis=0), a * b * np.array([a / 2, b / 2]), rtol=1e-13)


# --- separating axes ---


def separating(first, second, alert=0.1):
    packed = surfaces([first, second], [BOX_FACES, BOX_FACES], [None] * 12)
    kind, feature, axis = kernel.separating_axes(
        np.array([[0, 1]]),
        np.array([alert]),
        packed.vptr,
        packed.vertex,
        packed.fptr,
        packed.cptr,
        packed.corner,
        packed.normal,
        packed.eptr,
        packed.edge_a,
        packed.edge_b,
        np.array([first.mean(axis=0), second.mean(axis=0)]),
        packed.size,
    )
    return int(kind[0]), feature[0].tolist(), axis[0]


CUBE = box((0, 0, 0), (1, 1, 1))
# a bar along y that stands on one of its long edges
ROOF = (
    box((-0.5, -2, -0.5), (0.5, 2, 0.5)) @ np.array([[1, 0, -1], [0, np.sqrt(2), 0], [1, 0, 1]]) / np.sqrt(2)
)


def test_box_on_box_is_parted_by_the_first_ones_face():
    kind, feature, axis = separating(CUBE, CUBE + np.array([0.2, 0.1, 1.01]))
    assert kind == kernel.FACE_FIRST
    assert feature == [1, 6]  # top face of the first, bottom face of the second
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-15)


def test_corner_on_face_is_parted_by_the_face_whichever_body_has_it():
    tip = box((-0.5,) * 3, (0.5,) * 3) @ TURN.T
    tip = tip + np.array([0.5, 0.5, 1.02 - tip[:, 2].min()])
    kind, feature, axis = separating(CUBE, tip)
    assert (kind, feature[0]) == (kernel.FACE_FIRST, 1)
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-12)
    kind, feature, axis = separating(tip, CUBE)
    assert (kind, feature[0]) == (kernel.FACE_SECOND, 7)
    np.testing.assert_allclose(axis, [0, 0, -1], atol=1e-12)


@pytest.mark.parametrize(
    ("lift", "expected"), [(0.05, kernel.EDGES), (-0.05, kernel.EDGES), (0.2, kernel.SEPARATED)]
)
def test_crossed_edges_are_parted_by_their_common_normal(lift, expected):
    bar = ROOF @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # the same, along x
    top = ROOF[:, 2].max()
    kind, _, axis = separating(ROOF, bar + np.array([0, 0, 2 * top + lift]))
    assert kind == expected
    if kind:
        np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(hexahedra(), hexahedra(), st.tuples(coordinate, coordinate, coordinate))
def test_the_axis_keeps_the_stones_as_far_apart_as_any_axis_does(first, second, direction):
    """By the separating-axis theorem no other direction may show a larger gap."""
    first, second = first - first.mean(axis=0), second - second.mean(axis=0) + 0.8 * np.array(direction)
    kind, _, axis = separating(first, second, alert=1e3)
    if not kind:
        return
    found = (second @ axis).min() - (first @ axis).max()
    rng = np.random.default_rng(0)
    trial = rng.normal(size=(4000, 3))
    trial /= np.linalg.norm(trial, axis=1)[:, None]
    best = ((second @ trial.T).min(axis=0) - (first @ trial.T).max(axis=0)).max()
    if (
        best <= 0
    ):  # overlapping: the depth; apart, a corner pair may be farther apart than any face or edge axis
        assert best <= found + 2e-3
    else:
        assert found > -1e-9
