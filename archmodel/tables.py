"""What is known of the entities besides their kind: surveys, measurements, runs and results."""

from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import JSON, ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column, relationship

from archmodel.base import ArrayType, Base, UtcDateTime

if TYPE_CHECKING:
    from archmodel.entities import Entity

__all__ = ["FIDELITIES", "EntityResult", "Measurement", "Run", "SchemaVersion", "Survey"]

Array = NDArray[np.float64]

FIDELITIES = ("fixed", "rigid", "deformable")
"""How a stone can be modelled in a run."""


class SchemaVersion(Base):
    """One row that says that this is a MOMA database, and how its tables are laid out."""

    __tablename__ = "moma_schema"

    version: Mapped[int] = mapped_column(primary_key=True)


class Survey(Base):
    """One survey file as it was taken in.

    Attributes
    ----------
    name : given by the surveyor
    path : of the file, as the user wrote it
    sha256 : of the file's bytes, in hexadecimal; a file is taken in once
    stored_at : when (UTC)
    stations : where instruments and observers stood, by name, (x, y, z) [m]
    frame : how the survey was carried into the frame of the site, with its precision; None if it was there
    """

    __tablename__ = "survey"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String)
    path: Mapped[str] = mapped_column(String)
    sha256: Mapped[str] = mapped_column(String(64), unique=True)
    stored_at: Mapped[datetime] = mapped_column(UtcDateTime)
    stations: Mapped[dict[str, list[float]]] = mapped_column(JSON)
    frame: Mapped[dict[str, object] | None] = mapped_column(JSON(none_as_null=True))

    entities: Mapped[list["Entity"]] = relationship(back_populates="survey")


class Measurement(Base):
    """What was measured of one entity, the plane fitted to it, and the solid made of it.

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

    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"), primary_key=True)
    line: Mapped[int]
    sigma: Mapped[float]
    offset: Mapped[float]
    rms: Mapped[float]
    redundancy: Mapped[int]
    point_count: Mapped[int]
    rejected_count: Mapped[int]
    rejected: Mapped[list[int]] = mapped_column(JSON)
    rejected_vertices: Mapped[list[int]] = mapped_column(JSON)
    provenance: Mapped[str] = mapped_column(String)
    provenance_text: Mapped[str] = mapped_column(String)
    shape: Mapped[str] = mapped_column(String)
    shape_text: Mapped[str] = mapped_column(String)
    station: Mapped[str | None] = mapped_column(String)
    photograph: Mapped[str | None] = mapped_column(String)
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
    solid_faces: Mapped[list[list[int]]] = mapped_column(JSON)
    vertex_sigma: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    image: Mapped[Array] = mapped_column(ArrayType(-1, 2))
    sigmas: Mapped[Array | None] = mapped_column(ArrayType(-1))
    names: Mapped[list[str]] = mapped_column(JSON)
    remarks: Mapped[list[str]] = mapped_column(JSON)
    notes: Mapped[dict[str, str]] = mapped_column(JSON)

    entity: Mapped["Entity"] = relationship(back_populates="measurement")


class Run(Base):
    """One simulation run.

    Attributes
    ----------
    scene, scene_text : the scene's name, and its file as it was run
    outcome : equilibrium, moving or collapsed
    summary : the contents of summary.json
    version : of MOMA
    stored_at : when (UTC)
    """

    __tablename__ = "run"

    id: Mapped[int] = mapped_column(primary_key=True)
    scene: Mapped[str] = mapped_column(String)
    scene_text: Mapped[str] = mapped_column(String)
    outcome: Mapped[str] = mapped_column(String)
    summary: Mapped[dict[str, object]] = mapped_column(JSON)
    version: Mapped[str] = mapped_column(String)
    stored_at: Mapped[datetime] = mapped_column(UtcDateTime)

    results: Mapped[list["EntityResult"]] = relationship(back_populates="run")


class EntityResult(Base):
    """What one run computed for one entity; units and meaning as in ``records.StoneResult``.

    The primary key begins with the entity: "its latest run" is one step in that index.
    """

    __tablename__ = "entity_result"
    __table_args__ = (Index("ix_entity_result_run_id", "run_id"),)

    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    fidelity: Mapped[str] = mapped_column(String)
    von_mises_max: Mapped[float | None]
    von_mises_mean: Mapped[float | None]
    displacement_max: Mapped[float]
    contact_force_max: Mapped[float | None]
    values: Mapped[dict[str, float]] = mapped_column(JSON)

    entity: Mapped["Entity"] = relationship(back_populates="results")
    run: Mapped[Run] = relationship(back_populates="results")
