"""Relations between entities, and their membership of structures."""

from sqlalchemy import ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column, relationship

from archmodel.tables.base import Base
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Recorded
from archmodel.tables.structures import Structure

RELATIONS = ("rests_on", "beside", "bonded_with", "across_the_wall")
"""The relations that are stored. `supports` is `rests_on` seen from the other side."""

SYMMETRIC = frozenset({"beside", "bonded_with", "across_the_wall"})
"""Relations that hold both ways; stored once, the entity with the lower id first."""

INVERSE = {"rests_on": "supports", "supports": "rests_on", **{name: name for name in SYMMETRIC}}
"""The same relation seen from its object."""


class Relation(Recorded, Base):
    """Relation of one entity to another: subject rests on object, say.

    Attributes
    ----------
    kind : one of RELATIONS
    subject, object : the two entities
    declared : a person recorded it; otherwise it was computed from the geometry
    area : that the two faces share; None if declared [m²]
    gap : mean width of the joint between them; None if declared [m]
    x, y, z : centroid of the shared area; None if declared [m]
    nx, ny, nz : its unit normal, from object to subject; None if declared
    """

    __tablename__ = "relation"
    __table_args__ = (
        Index("ix_relation_subject", "subject_id", "kind"),
        Index("ix_relation_object", "object_id", "kind"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    subject_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    object_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    declared: Mapped[bool]
    area: Mapped[float | None]
    gap: Mapped[float | None]
    x: Mapped[float | None]
    y: Mapped[float | None]
    z: Mapped[float | None]
    nx: Mapped[float | None]
    ny: Mapped[float | None]
    nz: Mapped[float | None]

    subject: Mapped[Entity] = relationship(foreign_keys=[subject_id])
    object: Mapped[Entity] = relationship(foreign_keys=[object_id])


class Membership(Recorded, Base):
    """Membership of an entity in a structure.

    Attributes
    ----------
    rank : its place in the structure, from 1; None if there is no order
    declared : a person recorded it; otherwise it follows from the survey or from the geometry
    """

    __tablename__ = "membership"
    __table_args__ = (
        Index("ix_membership_entity_id", "entity_id"),
        Index("ix_membership_structure_id", "structure_id"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    entity_id: Mapped[int] = mapped_column(ForeignKey("entity.id"))
    structure_id: Mapped[int] = mapped_column(ForeignKey("structure.id"))
    rank: Mapped[int | None]
    declared: Mapped[bool]

    entity: Mapped[Entity] = relationship()
    structure: Mapped[Structure] = relationship()
