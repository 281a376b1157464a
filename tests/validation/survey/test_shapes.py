"""Faces that are not plane: rate of recognition, accuracy of the numbers, and rate of false alarms on planes.

A sphere or cylinder of radius R stands h = l²/8R proud of its chord l; its principal curvatures are 1/R. A bevel is a
second plane beyond an edge, at a known angle. Bounds are shares of some hundred simulated faces of 0.6 × 0.3 m with
noise of 3 mm, 20 points and four corners; α = 0.1 % of the tests is small beside them.
"""

import numpy as np
import pytest

from survey.faces.planes import fit_plane
from survey.faces.shapes import ShapeKind, judge_shape
from tests.validation.survey.stone_faces import turned

SIGMA, FACES = 0.003, 400
CORNERS = np.array([[-0.3, -0.15], [0.3, -0.15], [0.3, 0.15], [-0.3, 0.15]])


def verdicts(shape, count=FACES, inner=20, blunders=0, seed=111):
    """Shapes found of faces whose height is `shape(u, v)` [m]."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        u, v = np.vstack([rng.uniform(-0.5, 0.5, (inner, 2)) * [0.6, 0.3], CORNERS]).T
        points = np.column_stack([u, v, shape(u, v)]) + rng.normal(0, SIGMA, (inner + 4, 3))
        bad = rng.choice(inner + 4, blunders, replace=False)
        points[bad, 2] += rng.choice([-1, 1], blunders) * rng.uniform(0.03, 0.3, blunders)
        turn = turned(rng)
        fit = fit_plane(points @ turn.T, SIGMA, observer=turn[:, 2] * 30)
        found.append(judge_shape(fit, points @ turn.T, SIGMA))
    return found


def share(found, kind):
    return np.mean([one.kind == kind for one in found])


@pytest.mark.parametrize(
    ("inner", "blunders", "least"), [(6, 0, 0.99), (20, 0, 0.99), (20, 2, 0.98), (20, 5, 0.95)]
)
def test_planes_are_called_planes(inner, blunders, least):
    found = verdicts(lambda u, v: 0 * u, inner=inner, blunders=blunders)
    print(f"{inner} points, {blunders} blunders: {share(found, ShapeKind.PLANE):.1%} planes")
    assert share(found, ShapeKind.PLANE) >= least


@pytest.mark.parametrize("radius", [1.5, -1.5])
def test_drums_of_columns_are_curved(radius):
    # 0.6 m across: 30 mm proud, as the drum of a column or the intrados of a narrow vault
    found = verdicts(lambda u, v: -np.sign(radius) * (abs(radius) - np.sqrt(radius**2 - u**2)))
    curved = [one for one in found if one.kind == ShapeKind.CURVED]
    print(f"R = {radius} m: {len(curved) / FACES:.1%} curved")
    assert len(curved) >= 0.95 * FACES
    errors = np.array([one.curvature[0] - 1 / radius for one in curved])
    sigmas = np.array([one.curvature_sigma[0] for one in curved])
    # a quadric is not a circle, by (u/R)²/4 of its height at the ends: 1 % of the curvature, and the larger in size
    # of two estimates is a little too large
    assert np.mean((errors / sigmas) ** 2) == pytest.approx(1.0, abs=0.35)
    assert abs(np.mean(errors)) < 0.05 / abs(radius)


def bevel(degrees):
    """Beyond a line along the face, 0.11 m from its edge, the surface falls back."""
    return verdicts(lambda u, v: -np.maximum(v - 0.04, 0.0) * np.tan(np.radians(degrees)))


@pytest.mark.parametrize("degrees", [30, 45])
def test_bevels_are_two_planes(degrees):
    found = bevel(degrees)
    bevelled = [one for one in found if one.kind == ShapeKind.BEVELLED]
    print(f"{degrees}°: {len(bevelled) / FACES:.1%} bevelled")
    assert len(bevelled) >= 0.85 * FACES
    angles = [one.bevel_angle for one in bevelled if one.bevel_angle is not None]
    assert np.degrees(np.median(angles)) == pytest.approx(degrees, abs=3)


@pytest.mark.parametrize("degrees", [15, 20])
def test_shallow_bevels_are_no_planes(degrees):
    # 29 and 40 mm at the edge: with nine points beyond the line a bend through them all may say as much
    found = bevel(degrees)
    print(
        f"{degrees}°: {share(found, ShapeKind.PLANE):.1%} called plane, {share(found, ShapeKind.CURVED):.1%} curved"
    )
    assert share(found, ShapeKind.PLANE) <= 0.03


def test_numbers_are_in_the_words():
    found = verdicts(lambda u, v: -(u**2) / 3.0, count=10)[0]
    assert any(character.isdigit() for character in found.text)
    assert str(found.kind.value) in found.text
