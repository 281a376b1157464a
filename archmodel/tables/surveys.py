"""What was measured: survey files, measurements of entities, and the solids that stood for them in runs."""

from typing import TYPE_CHECKING

import numpy as np
from sqlalchemy import ForeignKey, Index, text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from archmodel.arrays import Array
from archmodel.tables.base import JSON_TYPE, ArrayType, Base
from archmodel.tables.entries import Entry, Recorded

if TYPE_CHECKING:
    from archmodel.tables.entities import Entity

__all__ = ["Measurement", "Simplification", "Survey"]


class Survey(Base):
    """One survey file as it was taken in.

    Attributes
    ----------
    name : given by the surveyor
    path : of the file, as the user wrote it
    sha256 : of the file's bytes, in hexadecimal; a file is taken in once
    entry : the act of recording that took it in
    stations : where instruments and observers stood, by name, (x, y, z) [m]
    frame : how the survey was carried into the frame of the site, with its precision; None if it was there
    """

    __tablename__ = "survey"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    path: Mapped[str]
    sha256: Mapped[str] = mapped_column(unique=True)
    entry_id: Mapped[int] = mapped_column(ForeignKey("entry.id"))
    stations: Mapped[dict[str, list[float]]] = mapped_column(JSON_TYPE)
    frame: Mapped[dict[str, object] | None]

    entry: Mapped[Entry] = relationship()
    measurements: Mapped[list["Measurement"]] = relationship(back_populates="survey")


class Measurement(Recorded, Base):
    """What was measured of one entity, the plane fitted to it, and the solid made of it.

    An entity that is measured again, or whose depth is corrected, gets a new measurement; the old one is
    superseded and kept.

    Attributes
    ----------
    line : of the survey file, where the record begins
    vertices, points : (n, 3) as measured [m]
    sigma : standard deviation of a measured coordinate [m]
    normal, offset : the fitted plane n·x = d [-], [m]
    centroid, axes : point of the plane [m], directions in it
    covariance : (3, 3) of two tilts [rad] and the height at the centroid [m]
    rms : root mean square of the residuals [m]
    redundancy : number of accepted points minus 3
    point_count, rejected_count : sizes of `points` and `rejected`, for queries
    rejected : indices into `points` of the blunders
    rejected_vertices : indices into `outline` of broken or eroded corners
    outline : (nv, 3) corners on the plane [m]
    solid_vertices, solid_faces : the extruded stone [m]
    vertex_sigma : standard deviations of `solid_vertices` [m]; NaN where not known
    provenance, provenance_text, shape, shape_text, station, photograph, image, sigmas, names, direction, tail,
        remarks : as in ``records.StoneRecord``
    notes : the surveyor's observations
    """

    __tablename__ = "measurement"
    __table_args__ = (
        Index(
            "ix_measurement_current",
            "entity_id",
            unique=True,
            sqlite_where=text("superseded_id IS NULL"),
            postgresql_where=text("superseded_id IS NULL"),
        ),
        Index("ix_measurement_entity_id", "entity_id"),
        Index("ix_measurement_survey_id", "survey_id"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    survey_id: Mapped[int] = mapped_column(ForeignKey("survey.id"))
    line: Mapped[int]
    sigma: Mapped[float]
    offset: Mapped[float]
    rms: Mapped[float]
    redundancy: Mapped[int]
    point_count: Mapped[int]
    rejected_count: Mapped[int]
    rejected: Mapped[list[int]] = mapped_column(JSON_TYPE)
    rejected_vertices: Mapped[list[int]] = mapped_column(JSON_TYPE)
    provenance: Mapped[str]
    provenance_text: Mapped[str]
    shape: Mapped[str]
    shape_text: Mapped[str]
    station: Mapped[str | None]
    photograph: Mapped[str | None]
    tail: Mapped[float]
    direction: Mapped[Array | None] = mapped_column(ArrayType(3))
    normal: Mapped[Array] = mapped_column(ArrayType(3))
    centroid: Mapped[Array] = mapped_column(ArrayType(3))
    axes: Mapped[Array] = mapped_column(ArrayType(2, 3))
    covariance: Mapped[Array] = mapped_column(ArrayType(3, 3))
    vertices: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    points: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    outline: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    solid_vertices: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    solid_faces: Mapped[list[list[int]]] = mapped_column(JSON_TYPE)
    vertex_sigma: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    image: Mapped[Array] = mapped_column(ArrayType(-1, 2))
    sigmas: Mapped[Array | None] = mapped_column(ArrayType(-1))
    names: Mapped[list[str]] = mapped_column(JSON_TYPE)
    remarks: Mapped[list[str]] = mapped_column(JSON_TYPE)
    notes: Mapped[dict[str, str]] = mapped_column(JSON_TYPE)

    survey: Mapped[Survey] = relationship(back_populates="measurements")
    entity: Mapped["Entity"] = relationship(back_populates="measurements")

    @property
    def residuals(self) -> Array:
        """(np,) distances of the measured points from the fitted plane, positive towards the observer [m]."""
        return np.asarray((self.points - self.centroid) @ self.normal)


class Simplification(Base):
    """The solid that stood for an entity in one run, and how far it is from the surveyed one.

    Attributes
    ----------
    mode : what became of the joints: close, mortar or as-surveyed
    displacement_max : farthest that a corner was moved [m]
    volume_change : relative to the surveyed solid [-]
    shape, blockiness, worst_angle, within_tolerance : as in ``run_records.SimplificationRecord``
    vertices, faces : the solid [m]
    """

    __tablename__ = "simplification"
    __table_args__ = (Index("ix_simplification_run_id", "run_id"),)

    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    mode: Mapped[str]
    displacement_max: Mapped[float]
    volume_change: Mapped[float]
    shape: Mapped[str | None]
    blockiness: Mapped[float | None]
    worst_angle: Mapped[float | None]
    within_tolerance: Mapped[bool | None]
    vertices: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    faces: Mapped[list[list[int]]] = mapped_column(JSON_TYPE)
