"""Knowledge besides the geometry: materials, phases, documents, and statements about entities and structures.

A statement is one fact that somebody records of one entity or structure, on stated grounds: its material, its phase,
a mason mark, erosion, a depth, a document. Statements are never changed; a better one of the same author supersedes
them (`supersedes_id`), or they are withdrawn (`superseded_id` without a successor). Statements of different authors
stand side by side; `archmodel.tables.opinions` says which of them holds.
"""

from datetime import date

from sqlalchemy import Date, ForeignKey, Index, text
from sqlalchemy.orm import Mapped, declared_attr, mapped_column, relationship

from archmodel.tables.base import JSON_TYPE, Base
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, Recorded, held_index
from archmodel.tables.structures import Structure

OBSERVATIONS = {
    "erosion": "surface or edges are worn away",
    "crack": "it is broken through or in part",
    "bevel": "an edge is cut or broken off at an angle",
    "displaced": "it no longer lies as it was laid",
    "spalling": "pieces of its face have come off",
    "open_joint": "mortar of its joints is lost",
    "stain": "discoloured by water, soot or growth",
    "replaced": "it was put there in a repair",
    "reused": "it was cut for another place",
    "remark": "anything else",
}
"""Types of observations and their definitions."""


class Material(Recorded, Base):
    """A stone or a mortar, under one name.

    Attributes
    ----------
    name : unique among the materials that are held now
    description : in words; None if the name says enough
    """

    __tablename__ = "material"
    __table_args__ = (held_index("ix_material_name", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    description: Mapped[str | None]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("material.id"))

    properties: Mapped[list["MaterialProperty"]] = relationship(back_populates="material")


class MaterialProperty(Recorded, Base):
    """One number of a material, with its source.

    Attributes
    ----------
    name : density, young, poisson, tensile_strength, compressive_strength, friction, …
    value, sigma : in `unit`; sigma is None if not known
    unit : SI, e.g. "kg/m³"
    source : a test, a document, a table
    """

    __tablename__ = "material_property"
    __table_args__ = (held_index("ix_material_property_name", "material_id", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    material_id: Mapped[int] = mapped_column(ForeignKey("material.id"))
    name: Mapped[str]
    value: Mapped[float]
    sigma: Mapped[float | None]
    unit: Mapped[str]
    source: Mapped[str]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("material_property.id"))

    material: Mapped[Material] = relationship(back_populates="properties")


class Phase(Recorded, Base):
    """A time of building or repair.

    Attributes
    ----------
    name : unique among the phases that are held now, e.g. "2" or "repair of 1860"
    begins, ends : years, at the earliest and at the latest; None if not known
    description : in words
    """

    __tablename__ = "phase"
    __table_args__ = (held_index("ix_phase_name", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    begins: Mapped[int | None]
    ends: Mapped[int | None]
    description: Mapped[str | None]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("phase.id"))


class Document(Recorded, Base):
    """A document, drawing or photograph, by reference.

    Attributes
    ----------
    code : unique among the documents that are held now
    type : document, drawing or photograph
    title : in words
    place : where it can be found: a path, a URL, an archive's number
    author, dated : of the document itself; None if not known
    """

    __tablename__ = "document"
    __table_args__ = (held_index("ix_document_code", "code"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    code: Mapped[str]
    type: Mapped[str]
    title: Mapped[str]
    place: Mapped[str | None]
    author: Mapped[str | None]
    dated: Mapped[str | None]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("document.id"))


class Statement(Recorded, Base):
    """Statement about one entity or one structure.

    Attributes
    ----------
    kind : name of its class
    entity, structure : its subject, exactly one of them
    text : in words; None if the rest says enough
    document, locator : the document that says so, and where in it (page, number of the figure)
    observed_on : date on which it was seen; None if not known
    author : whose opinion it is; None for a program, or if not known
    stated_on : date of the opinion: its own, that of its record, or that of the recording
    certainty : how sure the author is, from 0 to 1; None if not stated
    supersedes : the statement that it replaces
    """

    __tablename__ = "statement"
    __table_args__ = (
        Index("ix_statement_entity", "entity_id", "kind"),
        Index(
            "ix_statement_structure",
            "structure_id",
            "kind",
            sqlite_where=text("structure_id IS NOT NULL"),
        ),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    entity_id: Mapped[int | None] = mapped_column(ForeignKey("entity.id"))
    structure_id: Mapped[int | None] = mapped_column(ForeignKey("structure.id"))
    text: Mapped[str | None]
    document_id: Mapped[int | None] = mapped_column(ForeignKey("document.id"))
    locator: Mapped[str | None]
    observed_on: Mapped[date | None] = mapped_column(Date)
    author: Mapped[str | None]
    stated_on: Mapped[date | None] = mapped_column(Date)
    certainty: Mapped[float | None]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("statement.id"))

    entity: Mapped[Entity | None] = relationship(foreign_keys=[entity_id])
    structure: Mapped[Structure | None] = relationship(foreign_keys=[structure_id])
    document: Mapped[Document | None] = relationship()

    @declared_attr.directive
    @classmethod
    def __mapper_args__(cls) -> dict[str, object]:
        if cls.__name__ == "Statement":
            return {"polymorphic_on": "kind", "polymorphic_abstract": True}
        return {"polymorphic_identity": cls.__kind__}

    __kind__ = "statement"


class MadeOf(Statement):
    """Material of the subject."""

    __kind__ = "made_of"

    material_id: Mapped[int | None] = mapped_column(ForeignKey("material.id"))

    material: Mapped[Material | None] = relationship()


class OfPhase(Statement):
    """Phase in which the subject was built or put into its place."""

    __kind__ = "of_phase"

    phase_id: Mapped[int | None] = mapped_column(ForeignKey("phase.id"))

    phase: Mapped[Phase | None] = relationship()


class MasonMark(Statement):
    """Mason's mark on the subject.

    Attributes
    ----------
    sign : name of the mark, the same for the same mark
    place : on the stone, in words
    """

    __kind__ = "mason_mark"

    sign: Mapped[str | None]
    place: Mapped[str | None] = mapped_column(use_existing_column=True)


class Observation(Statement):
    """Observation of damage or change on the subject.

    Attributes
    ----------
    type : one of OBSERVATIONS
    severity : from 0 (traces) to 4 (lost, or about to be); None if not stated
    place : on the stone, in words
    x, y, z : where, in the frame of the site [m]; None if not measured
    """

    __kind__ = "observation"

    type: Mapped[str | None]
    severity: Mapped[int | None]
    place: Mapped[str | None] = mapped_column(use_existing_column=True)
    x: Mapped[float | None]
    y: Mapped[float | None]
    z: Mapped[float | None]


class DepthEvidence(Statement):
    """Recorded depth of the subject, with its evidence.

    Attributes
    ----------
    value, sigma : [m]; sigma is None if not known
    """

    __kind__ = "depth"

    value: Mapped[float | None]
    sigma: Mapped[float | None]


class Reference(Statement):
    """Document or photograph that treats or shows the subject."""

    __kind__ = "reference"


class Note(Statement):
    """Note of the surveyor, under a key.

    Attributes
    ----------
    key : as in the survey, e.g. "edge"
    """

    __kind__ = "note"

    key: Mapped[str | None]


class Decision(Statement):
    """Choice among the statements of several authors about the subject.

    Attributes
    ----------
    about : kind of the statements, e.g. "of_phase"
    chosen : the one that holds, as long as its author holds it
    """

    __kind__ = "decision"

    about: Mapped[str | None]
    chosen_id: Mapped[int | None] = mapped_column(ForeignKey("statement.id"))

    chosen: Mapped[Statement | None] = relationship(foreign_keys=[chosen_id], remote_side="Statement.id")


Index("ix_statement_chosen", Decision.chosen_id, sqlite_where=Decision.chosen_id.is_not(None))


class Correction(Base):
    """Change of one attribute of an entity; the entity has the new value, this row has both.

    Attributes
    ----------
    attribute : name of a column of Entity, or of an attribute of its kind
    before, after : the values; None if not known
    entry : who, when, on what grounds
    """

    __tablename__ = "correction"
    __table_args__ = (Index("ix_correction_entity_id", "entity_id"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    entry_id: Mapped[int] = mapped_column(ForeignKey("entry.id"))
    attribute: Mapped[str]
    before: Mapped[float | int | str | None] = mapped_column(JSON_TYPE)
    after: Mapped[float | int | str | None] = mapped_column(JSON_TYPE)

    entity: Mapped[Entity] = relationship()
    entry: Mapped[Entry] = relationship()
