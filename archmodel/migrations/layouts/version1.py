"""Version 1 of the layout: its tables, columns, keys and indexes as they were declared then."""

from typing import Any

from sqlalchemy import (
    JSON,
    Boolean,
    Column,
    Date,
    DateTime,
    Double,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    text,
)
from sqlalchemy.types import TypeEngine

TEXT = String().with_variant(String(collation="C"), "postgresql")
metadata = MetaData(naming_convention={"ix": "ix_%(column_0_label)s"})
"""All tables."""


def _columns(
    kind: TypeEngine[Any] | type[TypeEngine[Any]], names: str, nullable: bool = True
) -> list[Column[Any]]:
    """Return columns of one type, by their names with blanks between."""
    return [Column(name, kind, nullable=nullable) for name in names.split()]


def _held() -> tuple[Column[Any], Column[Any]]:
    """Return the entry that made a row, and the one that superseded it."""
    made = Column("entry_id", Integer, ForeignKey("entry.id"), nullable=False)
    return made, Column("superseded_id", Integer, ForeignKey("entry.id"))


def _revised(table: str) -> tuple[Column[Any], ...]:
    """Return the row that a row supersedes, and the columns of `_held`."""
    return Column("supersedes_id", Integer, ForeignKey(f"{table}.id")), *_held()


Table(
    "entry",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("action", TEXT, nullable=False),
    Column("author", TEXT),
    Column("source", TEXT, nullable=False),
    Column("settings", JSON, nullable=False),
    Column("version", TEXT, nullable=False),
    Column("recorded_at", DateTime, nullable=False),
)
Table(
    "moma_schema",
    metadata,
    Column("version", Integer, primary_key=True),
)
Table(
    "document",
    metadata,
    Column("id", Integer, primary_key=True),
    *_columns(TEXT, "code type title", nullable=False),
    *_columns(TEXT, "place author dated"),
    *_revised("document"),
    Index("ix_document_code", "code", unique=True, sqlite_where=text("superseded_id IS NULL")),
)
Table(
    "entity",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("code", TEXT, nullable=False, unique=True),
    Column("kind", TEXT, nullable=False),
    Column("entry_id", Integer, ForeignKey("entry.id"), nullable=False),
    Column("course", Integer),
    Column("zone", TEXT),
    *_columns(Double, "depth depth_sigma"),
    *_columns(TEXT, "depth_origin depth_source"),
    *_columns(Double, "length height area volume x y z"),
    Column("hypothesis", Boolean, nullable=False),
    Column("own", JSON),
    *_columns(Double, "tail_length span projection"),
    *_columns(Integer, "ring rank"),
    Column("intrados_angle", Double),
    Column("drum", Integer),
    Column("thickness", Double),
    Index("ix_entity_kind_course", "kind", "course"),
    Index("ix_entity_kind_depth", "kind", "depth"),
    Index("ix_entity_place", "x", "y", "z"),
    Index("ix_entity_zone_course", "zone", "course"),
)
Table(
    "kind",
    metadata,
    Column("name", TEXT, primary_key=True),
    *_columns(TEXT, "parent definition", nullable=False),
    Column("canon", TEXT),
    Column("attributes", JSON, nullable=False),
    Column("entry_id", Integer, ForeignKey("entry.id"), nullable=False),
)
Table(
    "material",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("name", TEXT, nullable=False),
    Column("description", TEXT),
    *_revised("material"),
    Index("ix_material_name", "name", unique=True, sqlite_where=text("superseded_id IS NULL")),
)
Table(
    "phase",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("name", TEXT, nullable=False),
    *_columns(Integer, "begins ends"),
    Column("description", TEXT),
    *_revised("phase"),
    Index("ix_phase_name", "name", unique=True, sqlite_where=text("superseded_id IS NULL")),
)
Table(
    "run",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("entry_id", Integer, ForeignKey("entry.id"), nullable=False),
    Column("as_of_id", Integer, ForeignKey("entry.id")),
    *_columns(TEXT, "scene scene_text outcome", nullable=False),
    *_columns(Integer, "steps contacts"),
    *_columns(Double, "simulated wall natural_map penetration balance reaction energy"),
    *_columns(JSON, "versions summary", nullable=False),
)
Table(
    "structure",
    metadata,
    Column("id", Integer, primary_key=True),
    *_columns(TEXT, "kind code", nullable=False),
    Column("title", TEXT),
    Column("parent_id", Integer, ForeignKey("structure.id")),
    Column("number", Integer),
    Column("side", TEXT),
    *_revised("structure"),
    Index("ix_structure_code", "code", unique=True, sqlite_where=text("superseded_id IS NULL")),
    Index("ix_structure_parent_id", "parent_id"),
)
Table(
    "survey",
    metadata,
    Column("id", Integer, primary_key=True),
    *_columns(TEXT, "name path", nullable=False),
    Column("sha256", TEXT, nullable=False, unique=True),
    Column("entry_id", Integer, ForeignKey("entry.id"), nullable=False),
    Column("stations", JSON, nullable=False),
    Column("frame", JSON),
)
Table(
    "cell_result",
    metadata,
    Column("run_id", Integer, ForeignKey("run.id"), primary_key=True),
    Column("cell", TEXT, primary_key=True),
    Column("step", Integer, primary_key=True),
    Column("time", Double, nullable=False),
    *_columns(
        Double,
        "x y lambda_x lambda_y volume shear turned sigma_xx sigma_yy sigma_xy p q direction anisotropy "
        "fabric_direction coordination porosity",
    ),
)
Table(
    "contact_point",
    metadata,
    Column("run_id", Integer, ForeignKey("run.id"), primary_key=True),
    Column("number", Integer, primary_key=True),
    Column("joint", Integer),
    Column("candidate_id", Integer, ForeignKey("entity.id"), nullable=False),
    Column("antagonist_id", Integer, ForeignKey("entity.id"), nullable=False),
    *_columns(Double, "x y z nx ny nz fx fy fz area gap opening slide", nullable=False),
    Column("status", TEXT, nullable=False),
    Index("ix_contact_point_antagonist", "antagonist_id", "run_id"),
    Index("ix_contact_point_candidate", "candidate_id", "run_id"),
)
Table(
    "correction",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("entity_id", Integer, ForeignKey("entity.id"), nullable=False),
    Column("entry_id", Integer, ForeignKey("entry.id"), nullable=False),
    Column("attribute", TEXT, nullable=False),
    *_columns(JSON, "before after"),
    Index("ix_correction_entity_id", "entity_id"),
)
Table(
    "entity_result",
    metadata,
    Column("entity_id", Integer, ForeignKey("entity.id"), primary_key=True),
    Column("run_id", Integer, ForeignKey("run.id"), primary_key=True),
    *_columns(Double, "von_mises_max von_mises_mean"),
    Column("displacement_max", Double, nullable=False),
    Column("contact_force_max", Double),
    Column("values", JSON, nullable=False),
    Column("fidelity", TEXT, nullable=False),
    Index("ix_entity_result_run_id", "run_id"),
)
Table(
    "joint_result",
    metadata,
    Column("run_id", Integer, ForeignKey("run.id"), primary_key=True),
    Column("number", Integer, primary_key=True),
    Column("first_id", Integer, ForeignKey("entity.id"), nullable=False),
    Column("second_id", Integer, ForeignKey("entity.id"), nullable=False),
    *_columns(Double, "x y z nx ny nz area", nullable=False),
    Column("parted", Boolean, nullable=False),
    *_columns(Double, "force_normal force_shear", nullable=False),
    *_columns(Double, "pressure_mean pressure_max kern friction_use slipping open"),
    *_columns(Double, "gap opening sliding", nullable=False),
    Column("width", Double),
    Index("ix_joint_result_first", "first_id", "run_id"),
    Index("ix_joint_result_second", "second_id", "run_id"),
)
Table(
    "material_property",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("material_id", Integer, ForeignKey("material.id"), nullable=False),
    Column("name", TEXT, nullable=False),
    Column("value", Double, nullable=False),
    Column("sigma", Double),
    *_columns(TEXT, "unit source", nullable=False),
    *_revised("material_property"),
    Index(
        "ix_material_property_name",
        "material_id",
        "name",
        unique=True,
        sqlite_where=text("superseded_id IS NULL"),
    ),
)
Table(
    "measurement",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("entity_id", Integer, ForeignKey("entity.id"), nullable=False),
    Column("survey_id", Integer, ForeignKey("survey.id"), nullable=False),
    Column("line", Integer, nullable=False),
    *_columns(Double, "sigma offset rms", nullable=False),
    *_columns(Integer, "redundancy point_count rejected_count", nullable=False),
    *_columns(JSON, "rejected rejected_vertices", nullable=False),
    *_columns(TEXT, "shape shape_text provenance provenance_text", nullable=False),
    *_columns(TEXT, "station photograph"),
    Column("tail", Double, nullable=False),
    Column("direction", LargeBinary),
    *_columns(
        LargeBinary, "normal centroid axes covariance vertices points outline solid_vertices", nullable=False
    ),
    Column("solid_faces", JSON, nullable=False),
    *_columns(LargeBinary, "vertex_sigma image", nullable=False),
    Column("sigmas", LargeBinary),
    *_columns(JSON, "names remarks notes", nullable=False),
    *_held(),
    Index("ix_measurement_current", "entity_id", unique=True, sqlite_where=text("superseded_id IS NULL")),
    Index("ix_measurement_entity_id", "entity_id"),
    Index("ix_measurement_survey_id", "survey_id"),
)
Table(
    "mechanism_stone",
    metadata,
    Column("run_id", Integer, ForeignKey("run.id"), primary_key=True),
    Column("load", TEXT, primary_key=True),
    Column("entity_id", Integer, ForeignKey("entity.id"), primary_key=True),
    *_columns(Double, "speed vx vy vz wx wy wz", nullable=False),
    Index("ix_mechanism_stone_entity_id", "entity_id"),
)
Table(
    "membership",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("entity_id", Integer, ForeignKey("entity.id"), nullable=False),
    Column("structure_id", Integer, ForeignKey("structure.id"), nullable=False),
    Column("rank", Integer),
    Column("declared", Boolean, nullable=False),
    *_held(),
    Index("ix_membership_entity_id", "entity_id"),
    Index("ix_membership_structure_id", "structure_id"),
)
Table(
    "relation",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("kind", TEXT, nullable=False),
    Column("subject_id", Integer, ForeignKey("entity.id"), nullable=False),
    Column("object_id", Integer, ForeignKey("entity.id"), nullable=False),
    Column("declared", Boolean, nullable=False),
    *_columns(Double, "area gap x y z nx ny nz"),
    *_held(),
    Index("ix_relation_object", "object_id", "kind"),
    Index("ix_relation_subject", "subject_id", "kind"),
)
Table(
    "simplification",
    metadata,
    Column("entity_id", Integer, ForeignKey("entity.id"), primary_key=True),
    Column("run_id", Integer, ForeignKey("run.id"), primary_key=True),
    Column("mode", TEXT, nullable=False),
    *_columns(Double, "displacement_max volume_change", nullable=False),
    Column("shape", TEXT),
    *_columns(Double, "blockiness worst_angle"),
    Column("within_tolerance", Boolean),
    Column("vertices", LargeBinary, nullable=False),
    Column("faces", JSON, nullable=False),
    Index("ix_simplification_run_id", "run_id"),
)
Table(
    "statement",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("kind", TEXT, nullable=False),
    Column("entity_id", Integer, ForeignKey("entity.id")),
    Column("structure_id", Integer, ForeignKey("structure.id")),
    Column("text", TEXT),
    Column("document_id", Integer, ForeignKey("document.id")),
    Column("locator", TEXT),
    Column("observed_on", Date),
    *_revised("statement"),
    Column("material_id", Integer, ForeignKey("material.id")),
    Column("phase_id", Integer, ForeignKey("phase.id")),
    *_columns(TEXT, "sign place type"),
    Column("severity", Integer),
    *_columns(Double, "x y z value sigma"),
    Column("key", TEXT),
    Index("ix_statement_entity", "entity_id", "kind"),
    Index("ix_statement_structure", "structure_id", "kind", sqlite_where=text("structure_id IS NOT NULL")),
)
