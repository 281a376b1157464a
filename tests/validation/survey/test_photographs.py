"""Stones measured on a photograph, lifted into space: Monte Carlo of marks, pixels, neighbours and their relief.

A wall of stones stands in the plane y = 0, each face a little proud or back (3 mm) and a little tilted (4 mrad), as
masons left them. A pinhole camera sees it; the middle stone is measured on the photograph alone, its neighbours in
space. The corners found are held against the true ones, along the plane and square to it, in predicted standard
deviations (variance 1 ± 0.15; the scatter of eight neighbours is itself known to a quarter).
"""

import numpy as np
import pytest

from survey.faces.faces import outline_face
from survey.records.survey import BlockRecord, Photograph, PhotoMark, Station, SurveyHead
from survey.registration.photographed_stones import LiftedFace, lift_faces

SIGMA, PIXEL, RELIEF, TILT = 0.002, 1.0, 0.003, 0.004
CAMERA = np.array([-1.5, -7.0, 1.7])  # seen 12° from square
MIDDLE = np.array([0.9, 0.0, 0.45])
STATIONS = (Station("observer", np.array([0.0, -20.0, 2.0])), Station("S1", CAMERA))


def photographed(points):
    """Pinhole camera that looks at the middle of the wall; 4000 px focal length, 100 m of pixels clear of zero."""
    ahead = (MIDDLE - CAMERA) / np.linalg.norm(MIDDLE - CAMERA)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    seen = (points - CAMERA) @ np.array([right, np.cross(ahead, right), ahead]).T
    return 4000 * seen[:, :2] / seen[:, 2:] + [3000.0, 2000.0]


def laid(rng, column, row):
    """A stone's true face: four corners and ten points, (14, 3), at its own height and tilt."""
    flat = np.vstack([rng.uniform(0, 1, (10, 2)), [[0, 0], [1, 0], [1, 1], [0, 1]]]) * [0.59, 0.29]
    x, z = flat[:, 0] + 0.6 * column, flat[:, 1] + 0.3 * row
    middle = np.array([0.6 * column + 0.3, 0.3 * row + 0.15])
    a, b = rng.normal(0, TILT, 2)
    return np.column_stack([x, rng.normal(0, RELIEF) + a * (x - middle[0]) + b * (z - middle[1]), z])


def one_wall(rng, marks=8, station="S1", extra=0):
    """(true corners of the middle stone, what is lifted)."""
    faces, record, true = [], None, None
    for column in range(3):
        for row in range(3):
            points = laid(rng, column, row)
            noisy = points + rng.normal(0, SIGMA, points.shape)
            if (column, row) == (1, 1):
                true = points[10:]
                record = BlockRecord(
                    code="X",
                    kind="header",
                    course=2,
                    vertices=np.empty((0, 3)),
                    points=noisy[:extra],
                    sigma=SIGMA,
                    photograph="P1",
                    image=photographed(true) + rng.normal(0, PIXEL, (4, 2)),
                )
            else:
                stone = BlockRecord(f"W{row}-{column}", "header", row + 1, noisy[10:], noisy[:10], SIGMA)
                faces.append(outline_face(stone, STATIONS[0].position))
    sides = [
        [-0.2, -0.1],
        [2.0, -0.1],
        [2.0, 1.1],
        [-0.2, 1.1],
        [0.9, -0.2],
        [0.9, 1.2],
        [-0.3, 0.5],
        [2.1, 0.5],
    ]
    places = np.array([(x, 0.0, z) for x, z in sides[:marks]])
    image = photographed(places) + rng.normal(0, PIXEL, (len(places), 2))
    known = places + rng.normal(0, SIGMA, places.shape)
    photograph = Photograph(
        "P1", PIXEL, tuple(PhotoMark(u, p, SIGMA) for u, p in zip(image, known, strict=True)), station
    )
    head = SurveyHead("wall", "wall.moma", STATIONS, photographs=(photograph,))
    ((_, lifted),) = lift_faces([record], [photograph], faces, head)
    assert isinstance(lifted, LiftedFace), lifted
    return true, lifted


@pytest.mark.parametrize("extra", [0, 2, 5], ids=["no points", "two points", "five points"])
@pytest.mark.parametrize("trials", [100, pytest.param(1500, marks=pytest.mark.slow)])
def test_lifted_corners_are_as_precise_as_they_say(extra, trials):
    rng = np.random.default_rng(91)
    along, square = [], []
    for _ in range(trials):
        true, lifted = one_wall(rng, extra=extra)
        errors = lifted.outline - true
        height = errors @ lifted.fit.normal
        inside = errors - np.outer(height, lifted.fit.normal)
        along.append((inside**2).sum(axis=1) / 2 / lifted.sigma**2)
        # how far the plane is from the true corner, square to it
        square.append((height / lifted.fit.height_sigma(lifted.outline)) ** 2)
    found = np.mean(along), np.mean(square)
    print(f"variance along the plane {found[0]:.3f}, square to it {found[1]:.3f}")
    few = 3 * np.sqrt(2 / trials)
    assert found[0] == pytest.approx(1.0, abs=max(0.15, few / 2))
    assert found[1] == pytest.approx(1.0, abs=max(0.15, few))


def test_what_a_lifted_face_says_of_itself():
    _, lifted = one_wall(np.random.default_rng(92))
    assert "photograph P1" in lifted.text
    assert "W0-1" in lifted.text  # the stone below it
    assert lifted.fit.normal[1] < -0.99


def test_without_noise_corners_are_exact(monkeypatch):
    monkeypatch.setattr(__name__ + ".RELIEF", 0.0)
    monkeypatch.setattr(__name__ + ".TILT", 0.0)

    class Silent:
        """Draws places, but no errors."""

        def __init__(self):
            self._rng = np.random.default_rng(93)

        def uniform(self, *given):
            return self._rng.uniform(*given)

        def normal(self, mean, _, size=None):
            return np.full(size, float(mean)) if size is not None else float(mean)

    for marks in (4, 8):
        true, lifted = one_wall(Silent(), marks)
        np.testing.assert_allclose(lifted.outline, true, atol=1e-10)
