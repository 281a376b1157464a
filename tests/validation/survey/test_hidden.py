"""Standard deviations of a stone's corners, visible and hidden, against Monte Carlo of the whole chain.

Errors are drawn for every coordinate of every point and corner and for the depth; plane, outline and hidden side are
then found as from any survey. What `vertex_sigma` predicts is held against the scatter of 2,500 such stones about the
true corners, axis by axis: 10 %, where the scatter itself is known to 1/√5000 = 1.4 %. Source of the propagation: the
law of errors, first order (ISO/IEC Guide 98-3, 5.1.2), so depth times tilt must stay small: σ = 3 mm on 0.6 × 0.3 m.
"""

import numpy as np
import pytest

from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.records.survey import BlockRecord, Extrusion
from tests.validation.survey.stone_faces import face, turned

STONES = 2500
DEPTH, DEPTH_SIGMA = 0.5, 0.02
EACH = 0.003 * np.array([0.5, 1, 2, 1, 0.5, 1, 2, 1, 0.5, 1, 1, 2, 0.5, 3])


def true_hidden(corners, normal, extrusion):
    """By the definition in docs/formats.md: shrunk about the mean of the corners, moved by the depth."""
    way = (
        -normal if extrusion.direction is None else extrusion.direction / np.linalg.norm(extrusion.direction)
    )
    middle = corners.mean(axis=0)
    return middle + extrusion.tail * (corners - middle) + DEPTH * way


def scatter(true, extrusion, sigmas, chip=0.0, depth_sigma=DEPTH_SIGMA, stones=STONES):
    """(found - true corners (stones, 8, 3), predicted σ (stones, 8, 3)), in the order of the record."""
    rng = np.random.default_rng(41)
    chipped = np.zeros((14, 3))
    chipped[12] = -chip * true.normal
    errors, predicted = [], []
    expected = np.vstack([true.points[10:], true_hidden(true.points[10:], true.normal, extrusion)])
    for _ in range(stones):
        points = true.points + chipped + rng.normal(size=(14, 3)) * np.reshape(sigmas, (-1, 1))
        record = BlockRecord(
            code="S1",
            kind="header",
            course=1,
            vertices=points[10:],
            points=points[:10],
            sigma=float(np.sqrt(np.mean(np.square(sigmas)))),
            sigmas=sigmas if np.ndim(sigmas) else None,
        )
        depth = Depth(DEPTH + rng.normal() * (depth_sigma or 0.0), depth_sigma, "a rule", "kind", 1)
        block = extrude(outline_face(record, true.observer), depth, extrusion)
        place = np.argsort(block.face.corner_of)
        order = [*place, *(place + 4)]
        errors.append(block.solid.vertices[order] - expected)
        predicted.append(block.vertex_sigma[order])
    return np.array(errors), np.array(predicted)


def agree(errors, predicted):
    found = np.sqrt(np.mean(np.square(errors), axis=0))
    said = np.sqrt(np.mean(np.square(predicted), axis=0))
    print(f"found over predicted: {(found / said).min():.3f} to {(found / said).max():.3f}")
    np.testing.assert_allclose(found, said, rtol=0.1)
    # and no bias: the mean of so many is known to σ/√n
    assert np.abs(np.mean(errors, axis=0) / said).max() < 4.5 / np.sqrt(len(errors))


WAYS = {
    "straight": Extrusion(),
    "directed": Extrusion(direction=np.array([0.3, 0.8, -0.2])),
    "tapered": Extrusion(tail=0.6),
    "both": Extrusion(direction=np.array([0.3, 0.8, -0.2]), tail=0.7),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("sigmas", [pytest.param(0.003, marks=pytest.mark.slow), EACH], ids=["equal", "each"])
def test_corners_scatter_as_predicted(way, sigmas):
    # in the wall's own axes: x along, y into it, z up
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    true = face(np.random.default_rng(5), turn=turn, place=(12.0, 30.0, 6.0))
    agree(*scatter(true, WAYS[way], sigmas))


def test_corners_of_a_leaning_face_far_away_scatter_as_predicted():
    rng = np.random.default_rng(6)
    true = face(rng, turn=turned(rng), place=(650_000.0, 6_860_000.0, 300.0))
    agree(*scatter(true, Extrusion(tail=0.8), 0.003))


def test_a_chipped_corner_is_as_well_known_as_the_plane_says():
    # 50 mm behind the face: left out of the fit, moved onto the plane; the tilt is known less well without it
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    true = face(np.random.default_rng(7), turn=turn)
    whole, chipped = (scatter(true, Extrusion(), 0.003, chip) for chip in (0.0, 0.05))
    agree(*chipped)
    assert chipped[1][0, 2, 1] > 1.1 * whole[1][0, 2, 1]


def test_hidden_corners_are_not_known_better_than_the_depth():
    true = face(np.random.default_rng(8), turn=np.eye(3))
    _, predicted = scatter(true, Extrusion(), 0.003, depth_sigma=None, stones=1)
    assert np.isfinite(predicted[0, :4]).all()
    assert np.isnan(predicted[0, 4:]).all()
