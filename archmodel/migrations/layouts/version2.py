"""Tables of version 2: frames and stations of surveys, shapes of faces, precision of hidden sides."""

from sqlalchemy import Column, DateTime, Double, ForeignKey, Index, Integer, MetaData, String, Table

from archmodel.migrations.layouts.columns import BYTES, JSON_TEXT, TEXT

__all__ = ["metadata"]

metadata = MetaData()

Table("moma_schema", metadata, Column("version", Integer(), primary_key=True))
Table(
    "run",
    metadata,
    Column("id", Integer(), primary_key=True),
    Column("scene", TEXT, nullable=False),
    Column("scene_text", TEXT, nullable=False),
    Column("outcome", TEXT, nullable=False),
    Column("summary", JSON_TEXT, nullable=False),
    Column("version", TEXT, nullable=False),
    Column("stored_at", DateTime(), nullable=False),
)
Table(
    "survey",
    metadata,
    Column("id", Integer(), primary_key=True),
    Column("name", TEXT, nullable=False),
    Column("path", TEXT, nullable=False),
    Column("sha256", String(64), nullable=False, unique=True),
    Column("stored_at", DateTime(), nullable=False),
    Column("stations", JSON_TEXT, nullable=False),
    Column("frame", JSON_TEXT),
)
Table(
    "entity",
    metadata,
    Column("id", Integer(), primary_key=True),
    Column("kind", TEXT, nullable=False),
    Column("code", TEXT, nullable=False, unique=True),
    Column("survey_id", Integer(), ForeignKey("survey.id"), nullable=False),
    Column("course", Integer()),
    Column("zone", TEXT),
    Column("depth", Double(), nullable=False),
    Column("depth_sigma", Double()),
    Column("depth_source", TEXT, nullable=False),
    Column("depth_origin", TEXT, nullable=False),
    Column("length", Double(), nullable=False),
    Column("height", Double(), nullable=False),
    Column("area", Double(), nullable=False),
    Column("volume", Double(), nullable=False),
    Column("x", Double(), nullable=False),
    Column("y", Double(), nullable=False),
    Column("z", Double(), nullable=False),
    Index("ix_entity_kind_course", "kind", "course"),
    Index("ix_entity_survey_id", "survey_id"),
)
Table(
    "entity_result",
    metadata,
    Column("entity_id", Integer(), ForeignKey("entity.id"), primary_key=True),
    Column("run_id", Integer(), ForeignKey("run.id"), primary_key=True),
    Column("fidelity", TEXT, nullable=False),
    Column("von_mises_max", Double()),
    Column("von_mises_mean", Double()),
    Column("displacement_max", Double(), nullable=False),
    Column("contact_force_max", Double()),
    Column("values", JSON_TEXT, nullable=False),
    Index("ix_entity_result_run_id", "run_id"),
)
Table(
    "measurement",
    metadata,
    Column("entity_id", Integer(), ForeignKey("entity.id"), primary_key=True),
    Column("line", Integer(), nullable=False),
    Column("sigma", Double(), nullable=False),
    Column("offset", Double(), nullable=False),
    Column("rms", Double(), nullable=False),
    Column("redundancy", Integer(), nullable=False),
    Column("point_count", Integer(), nullable=False),
    Column("rejected_count", Integer(), nullable=False),
    Column("rejected", JSON_TEXT, nullable=False),
    Column("rejected_vertices", JSON_TEXT, nullable=False),
    Column("provenance", TEXT, nullable=False),
    Column("provenance_text", TEXT, nullable=False),
    Column("shape", TEXT, nullable=False),
    Column("shape_text", TEXT, nullable=False),
    Column("station", TEXT),
    Column("photograph", TEXT),
    Column("tail", Double(), nullable=False),
    Column("direction", BYTES),
    Column("normal", BYTES, nullable=False),
    Column("centroid", BYTES, nullable=False),
    Column("axes", BYTES, nullable=False),
    Column("covariance", BYTES, nullable=False),
    Column("vertices", BYTES, nullable=False),
    Column("points", BYTES, nullable=False),
    Column("outline", BYTES, nullable=False),
    Column("solid_vertices", BYTES, nullable=False),
    Column("solid_faces", JSON_TEXT, nullable=False),
    Column("vertex_sigma", BYTES, nullable=False),
    Column("image", BYTES, nullable=False),
    Column("sigmas", BYTES),
    Column("names", JSON_TEXT, nullable=False),
    Column("remarks", JSON_TEXT, nullable=False),
    Column("notes", JSON_TEXT, nullable=False),
)
