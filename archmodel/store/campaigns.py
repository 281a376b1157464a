"""Campaigns: measurements of one stone at different times, compared with their standard deviations.

The place of a stone is the centroid of the area of its face. Across the face it is as certain as the fitted plane is
there, along it as the mean of the corners. Corners of two campaigns need not be the same points of the stone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session, aliased

from archmodel.arrays import Array
from archmodel.store.bulk import batches
from archmodel.tables.surveys import Measurement, Survey
from ground.polygons import area_and_centroid

__all__ = [
    "SIGNIFICANT",
    "Displacement",
    "FacePlace",
    "campaigns",
    "displacement",
    "displacements",
    "face_place",
    "measured_again",
]

SIGNIFICANT = 3.368
"""Displacement over its σ from which a stone has moved [-]: one that has not moved exceeds it once in a hundred
comparisons (chi-square of 3 components, 11.34, its root)."""

_TINY = 1e-12  # m²: a variance below it is that of a measurement said to be exact


@dataclass(frozen=True)
class FacePlace:
    """Place of a face in one campaign.

    Attributes
    ----------
    centroid : (3,) of its area [m]
    covariance : (3, 3) of that [m²]
    """

    centroid: Array
    covariance: Array


@dataclass(frozen=True)
class Displacement:
    """Movement of a stone between two campaigns.

    Attributes
    ----------
    vector : (3,) from the earlier to the later place [m]
    distance : its length [m]
    sigma : standard deviation of that, along its direction [m]; distance over sigma is the significance
    """

    vector: Array
    distance: float
    sigma: float

    @property
    def significant(self) -> bool:
        """True if the stone has moved, by what both campaigns can tell."""
        return self.distance > SIGNIFICANT * self.sigma


def face_place(
    outline: Array, normal: Array, centroid: Array, axes: Array, covariance: Array, corner_sigma: Array
) -> FacePlace:
    """Return the place of a measured face.

    Parameters
    ----------
    outline : (nv, 3) corners [m]
    normal, centroid, axes : (3,), (3,) and (2, 3) of its plane, as of `Measurement`
    covariance : (3, 3) of two tilts [rad] and the height at the centroid [m]
    corner_sigma : (nv, 3) standard deviations of the corners [m]
    """
    _, place = area_and_centroid(outline, normal)
    lever = np.array([*((place - centroid) @ axes.T), 1.0])
    across = float(lever @ covariance @ lever)
    along = np.eye(3) - np.outer(normal, normal)
    corners = np.nansum(corner_sigma**2, axis=0) / len(outline) ** 2
    return FacePlace(place, along @ np.diag(corners) @ along + across * np.outer(normal, normal))


def displacement(earlier: FacePlace, later: FacePlace) -> Displacement:
    """Compare two places of a face.

    Parameters
    ----------
    earlier, later : its places in two campaigns
    """
    vector = later.centroid - earlier.centroid
    covariance = earlier.covariance + later.covariance + _TINY * np.eye(3)
    distance = float(np.linalg.norm(vector))
    direction = vector / distance if distance > 0.0 else np.array([0.0, 0.0, 1.0])
    sigma = float(1.0 / np.sqrt(direction @ np.linalg.solve(covariance, direction)))
    return Displacement(vector, distance, sigma)


def campaigns(session: Session) -> dict[str, list[int]]:
    """Return the surveys by the name of their campaign, in the order in which they were taken in."""
    surveys: dict[str, list[int]] = {}
    for number, name in session.execute(select(Survey.id, Survey.name).order_by(Survey.id)):
        surveys.setdefault(name, []).append(number)
    return surveys


def measured_again(session: Session, surveys: Sequence[int]) -> bool:
    """Return whether a later survey measured any stone of these surveys."""
    now = aliased(Measurement)
    rows = (
        select(Measurement.id)
        .join(now, now.entity_id == Measurement.entity_id)
        .where(Measurement.survey_id.in_(surveys), Measurement.superseded_id.is_not(None))
        .where(now.superseded_id.is_(None), now.survey_id.not_in(surveys))
    )
    return session.scalar(rows.limit(1)) is not None


def displacements(session: Session, surveys: Sequence[int] | None = None) -> Mapping[int, Displacement]:
    """Compare the measurements that are held now with earlier ones of the same stones.

    A corrected depth makes a new measurement of the same survey: the last one of each survey counts.

    Parameters
    ----------
    surveys : numbers of those of the earlier campaign; None: the first measurement of each stone

    Returns
    -------
    Mapping
        by number of the entity; of stones that both campaigns measured
    """
    held = dict(
        session.execute(
            select(Measurement.entity_id, Measurement.survey_id).where(Measurement.superseded_id.is_(None))
        ).all()
    )
    rows = select(Measurement.id, Measurement.entity_id, Measurement.survey_id).order_by(Measurement.id)
    earlier: dict[int, tuple[int, int]] = {}
    for number, entity, survey in session.execute(rows.where(Measurement.superseded_id.is_not(None))):
        if survey == held.get(entity) or (surveys is not None and survey not in surveys):
            continue
        if surveys is not None or entity not in earlier or earlier[entity][1] == survey:
            earlier[entity] = (number, survey)
    before = _places(session, [number for number, _ in earlier.values()])
    now = select(Measurement.id).where(Measurement.superseded_id.is_(None))
    numbers = [
        number
        for batch in batches(list(earlier))
        for number in session.scalars(now.where(Measurement.entity_id.in_(batch)))
    ]
    after = _places(session, numbers)
    return {entity: displacement(before[entity], after[entity]) for entity in before if entity in after}


def _places(session: Session, numbers: Sequence[int]) -> dict[int, FacePlace]:
    """Return the places of measured faces by entity."""
    places: dict[int, FacePlace] = {}
    columns = (
        Measurement.entity_id, Measurement.outline, Measurement.normal, Measurement.centroid, Measurement.axes,
        Measurement.covariance, Measurement.vertex_sigma,
    )  # fmt: skip
    for batch in batches(numbers):
        for row in session.execute(select(*columns).where(Measurement.id.in_(batch))):
            entity, outline, normal, centroid, axes, covariance, sigma = row
            if len(outline) > 2:
                places[entity] = face_place(
                    outline, normal, centroid, axes, covariance, sigma[: len(outline)]
                )
    return places
