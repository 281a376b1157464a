"""Roughness of stone, estimated over all faces: errors of planes are as large as their standard deviations say."""

import numpy as np
import pytest

from survey.faces.faces import outline_face
from survey.faces.roughness import estimate_roughness
from survey.records.survey import BlockRecord, DepthRule, Station, SurveyHead, SurveyStream
from survey.registration.stones import survey_stones

OBSERVER = np.array([5.0, -20.0, 1.0])


def faces(
    seed: int,
    rough: float,
    sigma: float = 0.0001,
    *,
    count: int = 40,
    wrong: float = 0.0,
    radius: float = np.inf,
) -> list[BlockRecord]:
    """Return faces in the plane y = 0 of five points and four corners, some of them in front or behind by centimetres.

    Parameters
    ----------
    rough : standard deviation across the face [m]
    sigma : of a coordinate, as measured and as stated [m]
    wrong : part of the points that is wrong
    radius : of the cylinder on which faces lie [m]
    """
    rng = np.random.default_rng(seed)
    records = []
    for k in range(count):
        flat = np.vstack([rng.uniform(0.05, 0.95, (5, 2)), [[0, 0], [1, 0], [1, 1], [0, 1]]]) * [0.5, 0.3]
        bulge = (flat[:, 0] - 0.25) ** 2 / (2.0 * radius)
        places = np.column_stack([flat[:, 0] + 0.6 * k, bulge, flat[:, 1]])
        places[:, 1] += rng.normal(0.0, rough, 9)
        places += rng.normal(0.0, sigma, (9, 3))
        places[:, 1] += (rng.random(9) < wrong) * rng.uniform(0.02, 0.1, 9)
        records.append(BlockRecord(f"S{k}", "ashlar", 1, places[5:], places[:5], sigma))
    return records


def head(roughness: float | None = None) -> SurveyHead:
    rule = DepthRule(None, 0.4, 0.02, "guess")
    return SurveyHead(
        "wall", "wall.moma", (Station("observer", OBSERVER),), depth_rules=(rule,), roughness=roughness
    )


def errors_of(records: list[BlockRecord], roughness: float | None = None) -> tuple[float, float, int]:
    """Return the root mean squares of tilts and heights over their σ, and the number of points left out."""
    tilts, heights, lost = [], [], 0
    for stone in survey_stones(SurveyStream(head(roughness), iter(records))).stones:
        fit = stone.face.fit  # type: ignore[union-attr]
        off = fit.axes @ (fit.normal - [0.0, -1.0, 0.0])
        tilts += (off / np.sqrt(fit.covariance.diagonal()[:2])).tolist()
        heights.append(fit.centroid[1] / np.sqrt(fit.covariance[2, 2]))
        lost += len(fit.rejected)
    return float(np.sqrt(np.mean(np.square(tilts)))), float(np.sqrt(np.mean(np.square(heights)))), lost


@pytest.mark.parametrize("rough", [0.0, 0.0005, 0.001, 0.002, 0.005])
def test_errors_over_sigma_are_those_of_a_normal_variable(rough: float) -> None:
    """Of marks good to 0.1 mm, on stone of any roughness."""
    tilt, height, lost = errors_of(faces(1, rough))
    assert 0.8 < tilt < 1.3
    assert 0.75 < height < 1.35
    assert lost <= 7  # of 360


def test_the_roughness_is_that_of_the_stone_with_wrong_points_too() -> None:
    assert estimate_roughness(faces(2, 0.002)) == pytest.approx(0.002, rel=0.15)
    assert estimate_roughness(faces(2, 0.002, wrong=0.1)) == pytest.approx(0.002, rel=0.3)


def test_a_survey_whose_sigma_is_right_has_none() -> None:
    for seed in range(3):
        records = faces(seed, 0.0, 0.003)
        assert estimate_roughness(records) == 0.0
        assert estimate_roughness(faces(seed, 0.0, 0.003, wrong=0.08)) < 0.0015


def test_a_round_tower_is_not_a_rough_one() -> None:
    """Faces of a cylinder of 3 m bulge by 10 mm."""
    assert estimate_roughness(faces(3, 0.001, 0.0005, radius=3.0)) == pytest.approx(0.001, rel=0.35)


def test_a_stated_roughness_is_taken_as_it_is() -> None:
    tilt, _, _ = errors_of(faces(4, 0.001), roughness=0.002)
    assert 0.4 < tilt < 0.65
    *_, lost = errors_of(faces(4, 0.001), roughness=0.0)
    assert lost > 40


def test_a_total_station_with_too_small_a_sigma_has_corners_as_uncertain() -> None:
    """Its scatter is that of the measurement, in all directions."""
    records = faces(5, 0.0, 0.003)
    sharp = [BlockRecord(one.code, one.kind, 1, one.vertices, one.points, 0.0005) for one in records]
    tilt, _, _ = errors_of(sharp)
    assert 0.8 < tilt < 1.3
    (first, *_) = survey_stones(SurveyStream(head(), iter(sharp))).stones
    assert first.vertex_sigma[:4].mean() == pytest.approx(0.003, rel=0.25)  # type: ignore[union-attr]
    assert first.face.record.sigma == 0.0005  # type: ignore[union-attr]


def test_a_face_alone_is_as_precise_as_its_points_say() -> None:
    record = faces(6, 0.0)[0]
    face = outline_face(record, OBSERVER)
    assert face.record.roughness == 0.0
