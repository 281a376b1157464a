"""Survey files, measurements of entities, and the solids that stood for them in runs."""

from sqlalchemy import ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column, relationship

from archmodel.arrays import Array
from archmodel.tables.base import JSON_TYPE, ArrayType, Base, attribute
from archmodel.tables.entries import Entry, Recorded, held_index


class Survey(Base):
    """One survey file as it was taken in.

    Attributes
    ----------
    name : given by the surveyor
    path : of the file, as the user wrote it
    sha256 : of the file's bytes, in hexadecimal; of a file read again with other options, of its entry and these
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
    """Measurement of one entity, the plane fitted to it, and the solid made of it.

    An entity that is measured again, or whose depth is corrected, gets a new measurement; the old one is
    superseded and kept.

    The columns made by `attribute` say what they are.

    Attributes
    ----------
    line : of the survey file, where the record begins
    vertices, points : (n, 3) measured face corners, in order, and points on the face [m]
    sigma : standard deviation of a measured coordinate [m]
    sigmas : (np + nv,) standard deviations of the points, then of the corners [m]; None: all `sigma`
    names : of the points, then of the corners, as the instrument numbers them; () if they have none
    joint : (9n²,) covariance of the coordinates of the n points, then corners, by rows [m²]; None: they are independent
    evidence : of each point, then of each corner, how it was located on photographs: photographs, marks, rays
    normal : (3,) unit normal n of the fitted plane n·x = d, towards the observer
    offset : signed distance d of the plane from the origin [m]
    centroid : (3,) mean of the accepted points, on the plane [m]
    axes : (2, 3) unit directions in the plane
    covariance : (3, 3) of two tilts [rad] and the height at the centroid [m]; tilt i turns the normal towards
        -axes[i]
    rejected : indices into `points` of the outliers
    rejected_vertices : indices into `outline` of broken or eroded corners
    outline : (nv, 3) the corners moved onto the plane, counter-clockwise seen from outside [m]
    image : (nv, 2) corners on the photograph [px]
    solid_vertices, solid_faces : the extruded stone [m]
    vertex_sigma : (nv, 3) standard deviations of `solid_vertices` [m]; NaN where not known
    direction : (3,) of the extrusion; None: square to the face
    tail : size of the hidden face over that of the visible one
    shape_text, provenance_text : shape and provenance in words, with numbers
    remarks : what was changed to make the outline a polygon
    notes : observations of the surveyor, e.g. {"edge": "eroded"}
    """

    __tablename__ = "measurement"
    __table_args__ = (
        held_index("ix_measurement_current", "entity_id"),
        Index("ix_measurement_entity_id", "entity_id"),
        Index("ix_measurement_survey_id", "survey_id"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    survey_id: Mapped[int] = mapped_column(ForeignKey("survey.id"))
    line: Mapped[int]
    sigma: Mapped[float]
    offset: Mapped[float]
    rms: Mapped[float] = attribute("m", "root mean square distance of its points from the fitted plane")
    redundancy: Mapped[int] = attribute("-", "accepted points minus 3")
    point_count: Mapped[int] = attribute("-", "measured points on its face", name="points")
    rejected_count: Mapped[int] = attribute("-", "points left out as blunders", name="rejected")
    rejected: Mapped[list[int]] = mapped_column(JSON_TYPE)
    rejected_vertices: Mapped[list[int]] = mapped_column(JSON_TYPE)
    shape: Mapped[str] = attribute(None, "of its face: plane, bevelled, curved, rough, untested")
    shape_text: Mapped[str]
    provenance: Mapped[str] = attribute(None, "of its face: points, photograph, solid or hypothesis")
    provenance_text: Mapped[str]
    station: Mapped[str | None] = attribute(None, "where the instrument stood")
    photograph: Mapped[str | None] = attribute(None, "on which its face was drawn")
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
    joint: Mapped[Array | None] = mapped_column(ArrayType(-1))
    names: Mapped[list[str]] = mapped_column(JSON_TYPE)
    evidence: Mapped[list[dict[str, object]]] = mapped_column(JSON_TYPE)
    remarks: Mapped[list[str]] = mapped_column(JSON_TYPE)
    notes: Mapped[dict[str, str]] = mapped_column(JSON_TYPE)

    survey: Mapped[Survey] = relationship(back_populates="measurements")

    @property
    def residuals(self) -> Array:
        """Distances (np,) of the measured points from the fitted plane, positive towards the observer [m]."""
        import numpy as np

        return np.asarray((self.points - self.centroid) @ self.normal)


class Simplification(Base):
    """Solid that stood for an entity in one run, and its distance from the surveyed one.

    Attributes
    ----------
    mode : what became of the joints: close, mortar or as-surveyed
    volume_change : volume over that of the surveyed solid, minus 1 [-]
    vertices, faces : the solid [m]
    """

    __tablename__ = "simplification"
    __table_args__ = (Index("ix_simplification_run_id", "run_id"),)

    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"), primary_key=True)
    run_id: Mapped[int] = mapped_column(ForeignKey("run.id"), primary_key=True)
    mode: Mapped[str]
    displacement_max: Mapped[float] = attribute(
        "m", "farthest that a corner of its solid was moved for the run", name="simplified_by"
    )
    volume_change: Mapped[float]
    shape: Mapped[str | None] = attribute(
        None, "of its simplified solid, e.g. hexahedron", name="solid_shape"
    )
    blockiness: Mapped[float | None] = attribute(
        "-", "what it and a hexahedron have in common, over what they fill together"
    )
    worst_angle: Mapped[float | None] = attribute(
        "rad", "largest departure from a right angle between two faces of that solid"
    )
    within_tolerance: Mapped[bool | None] = attribute(
        None, "simplifying kept within what the survey can tell"
    )
    vertices: Mapped[Array] = mapped_column(ArrayType(-1, 3))
    faces: Mapped[list[list[int]]] = mapped_column(JSON_TYPE)
