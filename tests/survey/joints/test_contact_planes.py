"""Contact planes of joints: the kernel's fit against numpy, and the grouping of joints by plane."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from survey.geometry.solids import Solid
from survey.joints._kernels import FaceCorners, continuing_faces, fit_middle_planes
from survey.joints.bounded_closing import as_building, close_within_bounds
from survey.joints.contact_planes import contact_planes
from survey.joints.facing import find_facing
from survey.joints.settings import JointSettings
from survey.simplify.simplify import simplify
from tests.survey.plain_blocks import as_stone, bond, cuboid, drawn, moved

USUAL = JointSettings()
SQUARE = np.array([(-0.5, -0.2), (0.5, -0.2), (0.5, 0.2), (-0.5, 0.2)])


def corners(plane, width, opening=(0.0, 0.0), noise=0.0, rng=None, faces=2):
    """Return points (k, 3) and sides (k,) of faces on both sides of a middle plane (a, b, c)."""
    points, hands = [], []
    for face in range(faces):
        for hand in (1.0, -1.0):
            at = SQUARE + np.array([face, 0.0])
            half = width + at @ np.array(opening)
            points.append(np.column_stack([at, plane[0] + at @ np.array(plane[1:]) + 0.5 * hand * half]))
            hands.append(np.full(4, hand))
    out = np.concatenate(points)
    if noise:
        out[:, 2] += rng.normal(0.0, noise, len(out))
    return out, np.concatenate(hands)


def scale_of(points):
    return max(1.0, np.abs(points[:, :2]).max())


def fit(points, hands, sound=None, usual=-1.0, straightness=0.02):
    """Fit one joint by the kernel: plane (3,) and values (5,)."""
    sound = np.ones(len(points), np.bool_) if sound is None else np.asarray(sound)
    planes, values = np.zeros((1, 3)), np.zeros((1, 5))
    starts, scales = np.array([0, len(points)]), np.array([scale_of(points)])
    corners = FaceCorners(points, hands, sound, starts, scales)
    fit_middle_planes(corners, usual, straightness, planes, values)
    return planes[0], values[0]


def solved(design, heights, weight, prior=0.0, usual=0.0):
    """Solve weighted least squares with the usual width as one more observation; unknowns without data stay zero."""
    pull = np.diag(np.r_[np.zeros(3), prior, np.zeros(design.shape[1] - 4)])
    matrix = design.T @ (weight[:, None] * design) + pull + 1e-12 * weight.sum() * np.eye(design.shape[1])
    return np.linalg.solve(matrix, design.T @ (weight * heights) + pull.sum(axis=0) * usual)


def weights(residual, sound):
    """Return Huber's weights, against the spread of sound corners; a hundredth for the others up to 30 mm."""
    spread = max(1.4826 * np.median(residual[sound]), 1e-4) if sound.any() else 1e-4
    residual = np.maximum(residual, 1e-300)
    worn = 0.01 * np.minimum(1.0, 0.03 / residual)
    return np.where(sound, np.minimum(1.0, 1.5 * spread / residual), worn)


def robust(design, heights, sound, prior, usual):
    """Return Huber's estimate and the weighted mean square residual, from the least sum if there are many corners."""
    weight, previous = np.where(sound, 1.0, 0.01), 0.0
    if design.shape[1] == 4 and sound.sum() >= 12:
        weight = weights(np.abs(heights - design @ least_sum(design, heights, sound)), sound)
    for _ in range(100):
        solution = solved(design, heights, weight, prior, usual)
        residual = np.abs(heights - design @ solution)
        left = (weight * residual**2).sum() / weight.sum()
        weight = weights(residual, sound)
        if np.abs(solution - previous).max() < 1e-12:
            break
        previous = solution
    return np.append(solution, np.zeros(6 - len(solution))), left


def least_sum(design, heights, sound):
    """Return the solution with the least sum of residuals of sound corners, those below 0.1 mm squared."""
    weight = np.where(sound, 1.0, 0.0)
    for _ in range(300):
        solution = solved(design, heights, weight)
        weight = np.where(sound, 1.0 / np.maximum(np.abs(heights - design @ solution), 1e-4), 0.0)
    return solution


def twin_fit(points, hands, sound, usual, straightness, scale):
    """Fit in numpy: with parallel faces, with faces that open, and without outliers."""
    (x, y), z = points[:, :2].T / scale, points[:, 2]
    above = int((sound & (hands > 0.0)).sum())
    below = int(sound.sum()) - above
    design = np.column_stack([np.ones(len(x)), x, y, hands / 2, hands / 2 * x, hands / 2 * y])
    prior = 0.25 if usual >= 0.0 and min(above, below) < 3 else 0.0

    def off(solution):
        residual = np.abs(z - design @ solution)[sound]
        return (
            residual.max(initial=0.0),
            (residual > straightness).sum() / max(len(residual), 1),
            np.minimum(residual, straightness).sum(),
        )

    unknowns, (solution, left) = 4, robust(design[:, :4], z, sound, prior, usual)
    if min(above, below) >= 4:
        wedge, less = robust(design, z, sound, prior, usual)
        opening = np.hypot(*wedge[4:]) / scale
        if opening > math.radians(2.0) and less < 0.1 * left and np.sqrt(less) < 0.25 * straightness:
            unknowns, solution = 6, wedge
    if off(solution)[1] > 0.0:
        start, flat = solution, np.append(least_sum(design[:, :4], z, sound), [0.0, 0.0])
        if off(flat)[1:] < off(solution)[1:]:  # fewer are off, or as many and the others lie closer
            unknowns, start = 4, flat
        near = sound & (np.abs(z - design @ start) <= straightness)
        again, _ = robust(design[:, :unknowns], z, near, prior, usual)
        if off(again)[1] <= off(solution)[1]:
            solution = again
    weight = np.where(sound, 1.0, 0.01)
    residual = np.abs(z - design @ solution)
    rms = np.sqrt((weight * residual**2).sum() / weight.sum())
    near_ones = residual[sound & (residual <= straightness)]
    return solution[:3] / [1.0, scale, scale], [
        solution[3],
        rms,
        *off(solution)[:2],
        near_ones.max(initial=0.0),
    ]


small = st.floats(-0.05, 0.05)


@settings(max_examples=80, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    plane=st.tuples(small, small, small),
    width=st.floats(-0.02, 0.04),
    opening=st.sampled_from([(0.0, 0.0), (0.01, 0.0), (0.2, 0.0), (0.0, 0.3), (-0.1, 0.15)]),
    faces=st.integers(1, 5),
    worn=st.floats(0.0, 0.6),
    usual=st.sampled_from([-1.0, 0.0, 0.011]),
    odd=st.booleans(),
)
def test_the_kernel_agrees_with_its_slow_twin(seed, plane, width, opening, faces, worn, usual, odd):
    rng = np.random.default_rng(seed)
    points, hands = corners(plane, width, opening, 0.0015, rng, faces)
    sound = rng.random(len(points)) >= worn
    points[~sound, 2] += rng.uniform(0.0, 0.03, (~sound).sum()) * hands[~sound]
    if odd and faces > 2 and np.hypot(*opening) < 0.05:  # a face that lies too low in a bed
        points[:4, 2] -= 0.05
    fitted, values = fit(points, hands, sound, usual)
    expected, others = twin_fit(points, hands, sound, usual, 0.02, scale_of(points))
    np.testing.assert_allclose(fitted, expected, atol=1e-6)
    np.testing.assert_allclose(values[:3], others[:3], atol=1e-6)
    assert values[3] == pytest.approx(others[3])
    assert values[4] == pytest.approx(others[4], abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.tuples(small, small, small), st.floats(-0.02, 0.05), st.integers(1, 4))
def test_parallel_faces_give_the_plane_half_way_and_their_width(plane, width, faces):
    fitted, values = fit(*corners(plane, width, faces=faces))
    np.testing.assert_allclose(fitted, plane, atol=1e-9)
    np.testing.assert_allclose(values, [width, 0.0, 0.0, 0.0, 0.0], atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.tuples(small, small, small))
def test_small_noise_gives_least_squares(seed, plane):
    # below 0.1 mm no residual loses weight: plain least squares for a, b, c and the width
    points, hands = corners(plane, 0.01, noise=3e-5, rng=np.random.default_rng(seed), faces=3)
    design = np.column_stack([np.ones(len(points)), points[:, :2], hands / 2])
    expected, left, *_ = np.linalg.lstsq(design, points[:, 2], rcond=None)
    fitted, values = fit(points, hands)
    np.testing.assert_allclose(fitted, expected[:3], atol=1e-8)
    assert values[0] == pytest.approx(expected[3], abs=1e-8)
    assert values[1] == pytest.approx(np.sqrt(left[0] / len(points)), abs=1e-8)


@settings(max_examples=40, deadline=None)
@given(st.tuples(small, small, small), st.floats(0.1, 0.4), st.floats(0.0, 2.0 * np.pi))
def test_a_wedge_gives_the_plane_half_way_between_its_faces(plane, slope, way):
    # the mean of both faces' heights; with parallel faces it could not be hit at both ends
    opening = slope * np.array([np.cos(way), np.sin(way)])
    points, hands = corners(plane, 0.02, opening, faces=1)
    fitted, values = fit(points, hands)
    np.testing.assert_allclose(fitted, plane, atol=1e-9)
    assert values[2] < 1e-9


def test_a_worn_corner_hardly_moves_the_plane():
    points, hands = corners((0.0, 0.0, 0.0), 0.01)
    sound = np.ones(len(points), np.bool_)
    points[2, 2] += 0.025
    sound[2] = False
    fitted, values = fit(points, hands, sound)
    assert np.abs(fitted).max() < 2e-4
    assert values[2] < 5e-4  # a worn corner's own residual is not reported


def test_the_usual_width_applies_where_one_side_is_worn():
    points, hands = corners((0.0, 0.0, 0.0), 0.01, faces=1)
    sound = hands < 0.0
    points[hands > 0, 2] += 0.025  # all corners above are lost
    _, unknown = fit(points, hands, sound)
    assert unknown[0] == pytest.approx(0.035, abs=1e-6)
    fitted, known = fit(points, hands, sound, usual=0.01)
    # four corners of weight 0.01 against a weight of 0.25 on the width: most of the way back
    assert 0.010 < known[0] < 0.015
    assert abs(fitted[0]) < 0.0025


def bed_with_an_outlier(seed, off):
    """Return a bed of 32 corners with errors of 1 mm, and the number of the corner that is off."""
    rng = np.random.default_rng(seed)
    points, hands = corners((0.0, 0.0, 0.0), 0.01, noise=0.001, rng=rng, faces=4)
    odd = rng.integers(8, 24)
    points[odd, 2] += off
    return points, hands, odd


def deviations(points, hands):
    """Return the standard deviations (3,) of Huber's plane: √(1/0.95) of those of least squares, 1 mm √(N⁻¹)."""
    design = np.column_stack([np.ones(len(points)), points[:, :2], hands / 2])
    return 0.001 * np.sqrt(np.diag(np.linalg.inv(design.T @ design))[:3] / 0.95)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.03, 0.3))
@example(seed=315, off=0.25)
def test_one_outlier_is_reported_and_ignored(seed, off):
    points, hands, odd = bed_with_an_outlier(seed, off)
    fitted, values = fit(points, hands)
    assert values[3] == pytest.approx(1 / 32)
    assert values[2] == pytest.approx(off, abs=0.008)
    # 31 corners with errors of 1 mm: six standard deviations are exceeded once in 5·10⁸ beds
    rest = np.arange(len(points)) != odd
    assert (np.abs(fitted) < 6.0 * deviations(points[rest], hands[rest])).all()


@pytest.mark.parametrize("off", [0.03, 0.25, 10.0])
def test_an_outlier_shifts_a_plane_by_less_than_a_tenth_of_its_deviation(off):
    # however far off: less than 1 % of the variance that the errors of the other corners cause
    shifts = []
    for seed in range(200):
        points, hands, odd = bed_with_an_outlier(seed, off)
        rest = np.arange(len(points)) != odd
        shift = fit(points, hands)[0] - fit(points[rest], hands[rest])[0]
        shifts.append(shift / deviations(points[rest], hands[rest]))
    assert (np.sqrt(np.mean(np.square(shifts), axis=0)) < 0.1).all()


def closed(solids, limits=USUAL):
    building = as_building([simplify(as_stone(one)) for one in solids])
    facing = find_facing(building.faces.solids, building.faces.planes, limits)
    return building, facing, contact_planes(building.faces, facing, limits)


def by_pair(building, facing, contact):
    owners = building.faces.planes.owner[facing.faces]
    codes = [stone.code for stone in building.stones]
    return {(codes[i], codes[j]): int(k) for (i, j), k in zip(owners, contact.of_link, strict=True)}


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_a_running_bond_has_one_plane_per_bed_and_one_per_head_joint(seed, turned):
    turn = Rotation.from_rotvec(turned).as_matrix()
    solids = [moved(one, turn, np.zeros(3)) for one in bond(4, 4, 0.01, 0.002, seed)]
    planes = by_pair(*closed(solids))
    beds, heads = {}, []
    for (one, two), plane in planes.items():
        if one[1] == two[1]:
            heads.append(plane)
        else:
            beds.setdefault((one[1], two[1]), set()).add(plane)
    assert sorted(beds) == [("0", "1"), ("1", "2"), ("2", "3")]
    assert all(len(own) == 1 for own in beds.values())
    assert len(heads) == 3 + 4 + 3 + 4 == len(set(heads))
    assert set.union(*beds.values()).isdisjoint(heads)


def test_at_a_cross_opposite_joints_have_one_plane():
    cross = [
        cuboid(code, (x, 0.0, z), (x + 0.49, 0.4, z + 0.29))
        for code, (x, z) in zip("ABCD", [(0, 0), (0.5, 0), (0, 0.3), (0.5, 0.3)], strict=True)
    ]
    planes = by_pair(*closed(cross))
    assert planes["A", "C"] == planes["B", "D"] != planes["A", "B"] == planes["C", "D"]


def test_two_piers_that_stand_apart_have_beds_of_their_own():
    piers = [
        cuboid(f"{x}{z}", (x, 0.0, 0.3 * z), (x + 0.5, 0.4, 0.3 * z + 0.29)) for x in (0, 2) for z in range(2)
    ]
    planes = by_pair(*closed(piers))
    assert len(set(planes.values())) == len(planes) == 2


def test_a_stone_that_keeps_its_shape_gives_the_plane_of_its_face():
    notched = drawn("L", [(0, 0), (1, 0), (1, 0.3), (0.4, 0.3), (0.4, 0.6), (0, 0.6)])
    # a roof of four sides on its arm: where these meet, planes cannot be moved one by one
    top = next(face for face in notched.faces if (notched.vertices[list(face), 2] > 0.599).all())
    sides = [(a, b, len(notched.vertices)) for a, b in zip(top, (*top[1:], top[0]), strict=True)]
    roofed = np.vstack([notched.vertices, [[0.2, 0.2, 0.7]]])
    notched = Solid("L", roofed, (*(face for face in notched.faces if face != top), *sides))
    building, facing, contact = closed([notched, cuboid("N", (0.41, 0.0, 0.312), (1.0, 0.4, 0.6))])
    for (first, second), plane, side in zip(facing.faces, contact.of_link, contact.side, strict=True):
        face = first if building.faces.kept[first] else second
        sign = side if face == first else -side
        assert (sign * contact.normals[plane]).tobytes() == building.faces.planes.normals[face].tobytes()
        assert sign * contact.offsets[plane] == building.faces.planes.offsets[face]


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_both_stones_of_a_joint_hold_its_plane_to_the_last_bit(seed, turned):
    turn = Rotation.from_rotvec(turned).as_matrix()
    solids = [moved(one, turn, np.zeros(3)) for one in bond(3, 3, 0.01, 0.002, seed)]
    building, facing, _ = closed(solids)
    cut = close_within_bounds(building, facing, USUAL, building.solids)
    assert not any(cut.reasons)
    owners = building.faces.planes.owner[facing.faces]
    for (i, j), plane, side in zip(owners.tolist(), cut.contact.of_link, cut.contact.side, strict=True):
        row = np.array([*cut.contact.normals[plane], cut.contact.offsets[plane]])
        for stone, sign in ((i, side), (j, -side)):
            assert any(np.array_equal(own, sign * row) for own in cut.planes[stone])
            off = np.abs(cut.solids[stone].vertices @ row[:3] - row[3])
            assert (np.sort(off)[:4] < 1e-12).all()


def slowly_continuing(pairs, building, joined, cosine, near):
    """Return faces of neighbours that lie in one plane, pair by pair."""
    planes, out = building.faces.planes, []
    for one, two in pairs.tolist():
        for f in np.flatnonzero(joined & (planes.owner == one)).tolist():
            for g in np.flatnonzero(joined & (planes.owner == two)).tolist():
                off = [
                    np.abs(
                        building.faces.solids.vertices[building.faces.corners(a)] @ planes.normals[b]
                        - planes.offsets[b]
                    ).max()
                    for a, b in ((f, g), (g, f))
                ]
                if planes.normals[f] @ planes.normals[g] >= cosine and max(off) <= near:
                    out.append((f, g))
    return out


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.02), st.floats(0.001, 0.05))
def test_continuing_faces_are_those_found_slowly(seed, noise, near):
    building, facing, _ = closed(bond(2, 3, 0.01, noise, seed))
    rng, planes, solids = np.random.default_rng(seed), building.faces.planes, building.faces.solids
    joined = rng.random(len(planes.areas)) < 0.8
    pairs = planes.owner[facing.faces]
    found = continuing_faces(
        pairs,
        (solids.vertices, solids.corners, solids.face_starts, solids.solid_starts),
        planes.normals,
        planes.offsets,
        joined,
        0.985,
        near,
    )
    assert list(map(tuple, found.tolist())) == slowly_continuing(pairs, building, joined, 0.985, near)
