"""Integrals over the overlap of two triangulated faces, against a slow twin and closed forms."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from mechanics.contact import _kernels_mortar as kernel
from tests.mechanics.polygons import overlap


def barycentric(x, tri):
    return np.linalg.solve(np.vstack([tri.T, np.ones(3)]), [*x, 1.0])


def clip_flat(polygon, cutter):
    """The part of a plane polygon inside another, counter-clockwise."""
    flat = [np.column_stack([points, np.zeros(len(points))]) for points in (cutter, polygon)]
    return overlap(*flat, np.array([0.0, 0.0, 1.0]))[:, :2]


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
