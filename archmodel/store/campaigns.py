"""Campaigns: measurements of one stone at different times, compared with their standard deviations.

The place of a stone is the centroid of the area of its face. Across the face it is as certain as the fitted plane is
there, along it as the mean of the corners. Corners of two campaigns need not be the same points of the stone, and the
frames of two campaigns need not be one: what places along the faces scatter beyond their standard deviations is
estimated from all stones that both measured, and allowed for.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session, aliased

from archmodel.arrays import Array
from archmodel.store.bulk import batches
from archmodel.tables.surveys import Measurement, Survey
from ground.polygons import area_and_centroid

Key = TypeVar("Key", bound=Hashable)

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
    normal : (3,) of the face [-]
    """

    centroid: Array
    covariance: Array
    normal: Array


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


@dataclass(frozen=True)
class Comparison(Generic[Key]):
    """Places of stones in two campaigns.

    Attributes
    ----------
    displacements : of each stone that both measured
    scatter : of one coordinate along the face, beyond the stated standard deviations [m]: it is allowed for, so that at
        most half of the stones may have moved
    common : (3,) median displacement [m]: of all stones alike, it is that of the frame or of the whole structure
    """

    displacements: Mapping[Key, Displacement]
    scatter: float
    common: Array

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on what the places of all stones together tell, in words."""
        moved = list(self.displacements.values())
        texts = []
        if self.scatter > 0.0:
            texts.append(
                f"places along the face scatter by {1e3 * self.scatter:.1f} mm beyond the stated sigma, which is "
                "allowed for, unless more than half of the stones moved"
            )
        common = float(np.linalg.norm(self.common))
        if moved and common > np.median([stone.sigma for stone in moved]):
            texts.append(
                f"half of all stones are {1e3 * common:.1f} mm from their earlier places: the frames of both campaigns "
                "differ, or the whole moved"
            )
        return tuple(texts)


def compare(places: Mapping[Key, tuple[FacePlace, FacePlace]]) -> Comparison[Key]:
    """Compare the places of all stones that two campaigns measured.

    Parameters
    ----------
    places : the earlier and the later place of each stone
    """
    scatter = _scatter(list(places.values()))
    moved = {
        key: displacement(*(_allowing(place, scatter, later.normal) for place in (earlier, later)))
        for key, (earlier, later) in places.items()
    }
    vectors = np.array([stone.vector for stone in moved.values()]).reshape(-1, 3)
    return Comparison(moved, scatter, np.median(vectors, axis=0) if len(vectors) else np.zeros(3))


def _allowing(place: FacePlace, scatter: float, normal: Array) -> FacePlace:
    """Return a place that is less certain along the face by a standard deviation [m]."""
    along = np.eye(3) - np.outer(normal, normal)
    return replace(place, covariance=place.covariance + scatter**2 * along)


def _scatter(places: Sequence[tuple[FacePlace, FacePlace]]) -> float:
    """Return the scatter of one coordinate along the faces beyond the stated standard deviations [m]."""
    # imports scipy, which the movement of single stones does without
    from ground.statistics.scale import scatter_beyond

    values, variances = [], []
    for earlier, later in places:
        covariance = earlier.covariance + later.covariance
        for direction in _along(later.normal):
            values.append(float((later.centroid - earlier.centroid) @ direction))
            variances.append(float(direction @ covariance @ direction))
    return scatter_beyond(np.array(values), np.array(variances), 2.0)[0]


def _along(normal: Array) -> Array:
    """Return two directions square to a unit normal and to each other, (2, 3)."""
    first = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first)])


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
    covariance_of_place = along @ np.diag(corners) @ along + across * np.outer(normal, normal)
    return FacePlace(place, covariance_of_place, normal)


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


def displacements(session: Session, surveys: Sequence[int] | None = None) -> Comparison[int]:
    """Compare the measurements that are held now with earlier ones of the same stones.

    A corrected depth makes a new measurement of the same survey: the last one of each survey counts.

    Parameters
    ----------
    surveys : numbers of those of the earlier campaign; None: the first measurement of each stone

    Returns
    -------
    Comparison
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
    return compare({entity: (before[entity], after[entity]) for entity in before if entity in after})


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
