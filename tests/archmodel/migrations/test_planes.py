"""Planes between versions 1 and 2 of the layout, against the formulas of the fit that version 1 stored."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from archmodel.arrays import Array
from archmodel.migrations.planes import covariance_of_offset, plane_of_version_1

SIGMA = 0.002


def stored_by_version_1(accepted: Array) -> tuple[Array, float, Array]:
    """Normal, offset and covariance, written down from the fit of then: tilts σ²/sᵢ², levers eᵢ·c."""
    centroid = accepted[0] + (accepted - accepted[0]).mean(axis=0)
    _, singular, vectors = np.linalg.svd((accepted - centroid) / SIGMA, full_matrices=False)
    levers, tilts = vectors[:2] @ centroid, 1.0 / singular[:2] ** 2
    covariance = np.diag([*tilts, SIGMA**2 / len(accepted) + float(tilts @ levers**2)])
    covariance[:2, 2] = covariance[2, :2] = -tilts * levers
    return vectors[2], float(vectors[2] @ centroid), covariance


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 10**6),
    far=st.sampled_from([0.0, 30.0, 1e6]),
    rejected=st.integers(0, 3),
    broken=st.sampled_from([(), (1,), (0, 3)]),
    reverse=st.booleans(),
)
def test_a_plane_is_that_of_the_fit(
    seed: int, far: float, rejected: int, broken: tuple[int, ...], reverse: bool
) -> None:
    draw = np.random.default_rng(seed)
    turn = np.linalg.qr(draw.normal(size=(3, 3)))[0]
    points = draw.uniform(-1.0, 1.0, (12, 3)) * [0.4, 0.2, SIGMA]
    corners = np.array([[-0.4, -0.2, 0.0], [0.4, -0.2, 0.0], [0.4, 0.2, 0.0], [-0.4, 0.2, 0.0]])
    corners[:, 2] = draw.uniform(-SIGMA, SIGMA, 4)
    left_out = sorted(draw.choice(12, rejected, replace=False).tolist())
    points[left_out, 2] += 0.1
    corners[list(broken), 2] -= 0.05
    points, vertices = (places @ turn.T + far * np.array([0.3, 1.0, 0.2]) for places in (points, corners))
    accepted = np.vstack([np.delete(points, left_out, axis=0), np.delete(vertices, broken, axis=0)])
    normal, offset, covariance = stored_by_version_1(accepted)
    outline = vertices - np.outer(vertices @ normal - offset, normal)
    plane = plane_of_version_1(
        points,
        vertices,
        outline[::-1] if reverse else outline,
        left_out,
        len(accepted) - 3,
        normal,
        offset,
        covariance,
    )
    assert plane.rejected_vertices == tuple(sorted(3 - i if reverse else i for i in broken))
    near = max(far, 1.0)
    np.testing.assert_allclose(plane.centroid, accepted.mean(axis=0), rtol=0, atol=1e-13 * near)
    singular = np.linalg.svd(accepted - plane.centroid, compute_uv=False)
    diagonal = [*(SIGMA / singular[:2]) ** 2, SIGMA**2 / len(accepted)]
    np.testing.assert_allclose(plane.covariance, np.diag(diagonal), rtol=1e-7, atol=0)
    frame = np.vstack([plane.axes, normal])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), rtol=0, atol=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    spread = np.linalg.norm((accepted - plane.centroid) @ plane.axes.T, axis=0)
    np.testing.assert_allclose(spread, singular[:2], rtol=1e-6)
    again = covariance_of_offset(plane.centroid, plane.axes, plane.covariance)
    np.testing.assert_allclose(np.abs(again), np.abs(covariance), rtol=1e-6, atol=1e-12 * near**2)


def test_numbers_that_no_fit_gave_are_carried_all_the_same() -> None:
    """The library stored what it was given; nothing may stop the migration of a database."""
    corners = np.zeros((3, 3))
    plane = plane_of_version_1(
        np.empty((0, 3)), corners, corners, [], 40, np.array([0.0, 0.0, 1.0]), 0.0, np.eye(3)
    )
    assert np.isfinite(plane.axes).all()
    assert plane.rejected_vertices == ()
