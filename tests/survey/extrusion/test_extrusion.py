"""The hidden side: volumes in closed form, and standard deviations derived by hand for an axis-parallel face.

The face is in the plane y = 0, seen from -y: its normal is (0, -1, 0), the wall lies behind it at y > 0.
"""

from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.geometry.solids import volume_of
from survey.geometry.watertight import check_watertight
from survey.records.survey import BlockRecord, Extrusion

OBSERVER = np.array([0.3, -5.0, 0.2])
S = 0.003
LENGTH, HEIGHT = 0.6, 0.3
CORNERS = np.array([[0, 0, 0], [LENGTH, 0, 0], [LENGTH, 0, HEIGHT], [0, 0, HEIGHT]])
AREA = LENGTH * HEIGHT


def face_of(corners=CORNERS, points=(), sigma=S, sigmas=None):
    given = np.array(points, dtype=float).reshape(-1, 3)
    record = BlockRecord("A", "header", 1, np.array(corners, float), given, sigma, line=12, sigmas=sigmas)
    return outline_face(record, OBSERVER)


def deep(value=0.5, sigma=0.02):
    return Depth(value, sigma, "guess", "kind", 3)


def behind(block):
    """Return the hidden corner behind each measured corner, in the order of CORNERS."""
    order = np.argsort(block.face.corner_of)
    return block.solid.vertices[4:][order], block.vertex_sigma[:4][order], block.vertex_sigma[4:][order]


def test_square_to_the_face_the_volume_is_area_times_depth():
    block = extrude(face_of(), deep())
    assert volume_of(block.solid) == pytest.approx(AREA * 0.5)
    np.testing.assert_allclose(behind(block)[0], CORNERS + np.array([0.0, 0.5, 0.0]), atol=1e-12)
    check_watertight(block.solid, convex=True)


@pytest.mark.parametrize("angle", [0.0, 20.0, -45.0, 59.0])
@pytest.mark.parametrize("size", [1e-3, 1.0, 40.0])
def test_along_a_direction_the_depth_is_measured_along_it(angle, size):
    towards = np.array([sin(radians(angle)), cos(radians(angle)), 0.0])
    block = extrude(face_of(), deep(), Extrusion(size * towards))
    np.testing.assert_allclose(behind(block)[0], CORNERS + 0.5 * towards, atol=1e-12)
    assert volume_of(block.solid) == pytest.approx(AREA * 0.5 * cos(radians(angle)))
    check_watertight(block.solid, convex=True)


@given(st.floats(0.05, 1.0), st.floats(0.05, 2.0), st.floats(-55.0, 55.0))
@settings(deadline=None)
def test_a_tapered_stone_is_a_frustum(tail, depth, angle):
    # V = h (A + sqrt(A A') + A') / 3 with A' = tail² A, h square to the face
    towards = np.array([0.0, cos(radians(angle)), sin(radians(angle))])
    block = extrude(face_of(), deep(depth), Extrusion(towards, tail))
    high = depth * cos(radians(angle))
    assert volume_of(block.solid) == pytest.approx(high * AREA * (1.0 + tail + tail**2) / 3.0, rel=1e-9)
    hidden = behind(block)[0]
    np.testing.assert_allclose(hidden.mean(axis=0), CORNERS.mean(axis=0) + depth * towards, atol=1e-12)
    np.testing.assert_allclose(hidden[1] - hidden[0], [tail * LENGTH, 0.0, 0.0], atol=1e-12)


def test_an_l_shaped_face_tapers_as_a_whole():
    flat = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=float)
    corners = np.column_stack([flat[:, 0], np.zeros(6), flat[:, 1]])
    block = extrude(face_of(corners), deep(0.9), Extrusion(tail=0.5))
    assert volume_of(block.solid) == pytest.approx(0.9 * 3.0 * (1.0 + 0.5 + 0.25) / 3.0)
    check_watertight(block.solid)


@pytest.mark.parametrize(("angle", "said"), [(61.0, "61°"), (90.0, "90°"), (120.0, "120°"), (180.0, "180°")])
def test_a_direction_that_does_not_lead_into_the_wall_is_refused(angle, said):
    towards = np.array([sin(radians(angle)), cos(radians(angle)), 0.0])
    with pytest.raises(GeometryError, match=f"direction of extrusion is {said} from square") as caught:
        extrude(face_of(), deep(), Extrusion(towards))
    assert "60°" in caught.value.remedy


def hand_made(x, z, turn, sigma):
    """Standard deviations of a place (x, z) of the face of four corners of the same σ, by hand.

    Σ(x - x̄)² = L² and Σ(z - z̄)² = H²: tilts about z and x have variances σ²/L² and σ²/H², the height at the
    centroid σ²/4. `turn` is how far behind the face a place moves along when the normal turns.
    """
    u, w = x - LENGTH / 2, z - HEIGHT / 2
    along, up = sigma**2 / LENGTH**2, sigma**2 / HEIGHT**2
    across = sigma**2 / 4 + along * u**2 + up * w**2
    return np.array([along * turn**2, across, up * turn**2])  # variances along x, y, z


def test_visible_corners_are_as_precise_as_measured_along_the_face_and_as_the_plane_across():
    _, visible, _ = behind(extrude(face_of(), deep()))
    for (x, _, z), sigma in zip(CORNERS, visible, strict=True):
        expected = hand_made(x, z, 0.0, S) + np.array([S**2, 0.0, S**2])
        np.testing.assert_allclose(sigma**2, expected, rtol=1e-9)
    # of four corners, each is 3/4 checked by the plane: σ² (1/4 + 1/4 + 1/4)
    np.testing.assert_allclose(visible[:, 1], S * np.sqrt(0.75), rtol=1e-9)


@pytest.mark.parametrize("depth_sigma", [0.0, 0.02, 0.1])
def test_hidden_corners_have_the_errors_of_corner_tilt_and_depth(depth_sigma):
    _, _, hidden = behind(extrude(face_of(), deep(0.5, depth_sigma)))
    for (x, _, z), sigma in zip(CORNERS, hidden, strict=True):
        expected = hand_made(x, z, 0.5, S) + np.array([S**2, depth_sigma**2, S**2])
        np.testing.assert_allclose(sigma**2, expected, rtol=1e-9)


def test_a_given_direction_does_not_turn_with_the_face():
    towards = np.array([0.6, 0.8, 0.0])
    _, _, hidden = behind(extrude(face_of(), deep(0.5, 0.02), Extrusion(towards)))
    for (x, _, z), sigma in zip(CORNERS, hidden, strict=True):
        expected = hand_made(x, z, 0.0, S) + np.array([S**2, 0.0, S**2]) + 0.02**2 * towards**2
        np.testing.assert_allclose(sigma**2, expected, rtol=1e-9)


def test_corners_of_a_tail_also_move_with_the_mean_of_all():
    # x' = x̄ + t (x - x̄): the corner's own share is t + (1-t)/4, that of each of the others (1-t)/4
    tail = 0.6
    own, others = tail + (1 - tail) / 4, (1 - tail) / 4
    _, _, hidden = behind(extrude(face_of(), deep(0.5, 0.0), Extrusion(tail=tail)))
    middle = CORNERS.mean(axis=0)
    for corner, sigma in zip(CORNERS, hidden, strict=True):
        x, _, z = middle + tail * (corner - middle)
        shaken = S**2 * (own**2 + 3 * others**2)
        np.testing.assert_allclose(
            sigma**2, hand_made(x, z, 0.5, S) + np.array([shaken, 0.0, shaken]), rtol=1e-9
        )


def test_each_corner_has_the_precision_that_it_was_measured_with():
    # points that fix the plane as well as one likes leave the corners' own precision in the face
    grid = [(x, 0.0, z) for x in np.linspace(0.05, 0.55, 10) for z in np.linspace(0.02, 0.28, 5)]
    own = np.array([0.002, 0.004, 0.006, 0.008])
    sigmas = np.concatenate([np.full(len(grid), 1e-7), own])
    listed = CORNERS[::-1]  # the outline runs the other way: each keeps its own
    block = extrude(face_of(listed, grid, sigma=0.003, sigmas=sigmas), deep(0.5, 0.02))
    _, visible, hidden = behind(block)
    np.testing.assert_allclose(visible[:, 0], own, rtol=1e-5)
    np.testing.assert_allclose(visible[:, 2], own, rtol=1e-5)
    np.testing.assert_allclose(visible[:, 1], 0.0, atol=1e-6)
    np.testing.assert_allclose(hidden, np.column_stack([own, np.full(4, 0.02), own]), rtol=1e-4)


def test_of_corners_measured_twice_the_first_gives_its_precision():
    rows = [0, 1, 1, 2, 3]
    sigmas = np.array([0.001, 0.002, 0.009, 0.003, 0.004])
    block = extrude(face_of(CORNERS[rows], sigmas=sigmas), deep())
    assert sorted(block.face.corner_of) == [0, 1, 3, 4]
    np.testing.assert_allclose(behind(block)[1][:, 0], [0.001, 0.002, 0.003, 0.004], rtol=1e-2)


@pytest.mark.parametrize(
    "extrusion", [Extrusion(), Extrusion(np.array([0.0, 2.0, 0.0])), Extrusion(tail=0.5)]
)
def test_where_the_depth_s_precision_is_not_known_that_of_hidden_corners_is_not(extrusion):
    known = extrude(face_of(), deep(0.5, 0.0), extrusion)
    unknown = extrude(face_of(), deep(0.5, None), extrusion)
    np.testing.assert_array_equal(unknown.vertex_sigma[:4], known.vertex_sigma[:4])
    assert np.isnan(unknown.vertex_sigma[4:]).all()
    assert np.isfinite(known.vertex_sigma).all()


def test_far_from_the_origin_nothing_is_lost():
    far = np.array([650_000.0, 6_860_000.0, 300.0])
    record = BlockRecord("A", "header", 1, CORNERS + far, np.empty((0, 3)), S, line=12)
    near, moved = extrude(face_of(), deep()), extrude(outline_face(record, OBSERVER + far), deep())
    np.testing.assert_allclose(moved.solid.vertices - far, near.solid.vertices, atol=3e-9)
    np.testing.assert_allclose(moved.vertex_sigma, near.vertex_sigma, rtol=1e-7)


def twin_of(block):
    """Compute the result of the kernel in matrices."""
    face, fit, tail, count = block.face, block.face.fit, block.extrusion.tail, len(block.face.outline)
    hidden, direction = block.solid.vertices[count:], block.extrusion.direction
    into = -fit.normal if direction is None else direction / np.linalg.norm(direction)
    corners = face.record.vertex_sigmas[list(face.corner_of)]
    measured = corners[:, None] ** 2 * (fit.axes**2).sum(axis=0)
    own, others = tail + (1.0 - tail) / count, (1.0 - tail) / count
    tails = own**2 * measured + others**2 * (measured.sum(axis=0) - measured)
    behind = hidden if direction is None else hidden - block.depth.value * into
    places = (np.concatenate([face.outline, behind]) - fit.centroid) @ fit.axes.T
    turned = np.zeros(2 * count)
    turned[count:] = block.depth.value if direction is None else 0.0
    variance = np.concatenate([measured, tails]) + fit.covariance[2, 2] * fit.normal**2
    for k in range(2):
        moved = places[:, k, None] * fit.normal + turned[:, None] * fit.axes[k]
        variance += fit.covariance[k, k] * moved**2
    variance[count:] += block.depth.sigma**2 * into**2
    return np.sqrt(variance)


@pytest.mark.parametrize("tail", [1.0, 0.6])
@pytest.mark.parametrize("direction", [None, (0.3, 1.0, -0.2), (-0.1, 2.0, 0.4)])
@given(seed=st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=20)
def test_the_kernel_of_deviations_is_its_twin(direction, tail, seed):
    rng = np.random.default_rng(seed)
    corners = CORNERS + rng.normal(0.0, 0.02, CORNERS.shape) * [1.0, 0.1, 1.0]
    sigmas = rng.uniform(1e-3, 5e-3, len(corners))
    towards = None if direction is None else np.array(direction)
    block = extrude(face_of(corners, sigmas=sigmas), deep(), Extrusion(towards, tail))
    np.testing.assert_allclose(block.vertex_sigma, twin_of(block), rtol=1e-12)
