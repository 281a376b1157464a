"""Stratigraphic relations between units (structures) and stones, as statements of authors.

The subject of `LATER` relations came later than the object; relations of `SYMMETRIC` say the same both ways. A relation
seen from its object has a name of its own, `INVERSE`.
"""

from collections.abc import Mapping

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import Statement
from archmodel.tables.structures import Structure

DEFINITIONS: Mapping[str, str] = {
    "above": "it lies on the object, and came later",
    "cuts": "it was cut into the object",
    "fills": "it fills the object, which is a cut or an opening",
    "abuts": "it was built against the object, which stood there",
    "later_than": "it came later than the object, which it need not touch",
    "bonded_with": "both were built in one course of work",
    "contemporary_with": "both came about at the same time",
    "equal_to": "both are one unit, recorded twice",
}
"""Stratigraphic relations, and what each says of its subject."""

SYMMETRIC = ("bonded_with", "contemporary_with", "equal_to")
"""Relations that hold both ways; stored once."""

LATER = tuple(name for name in DEFINITIONS if name not in SYMMETRIC)
"""Relations whose subject came later than the object."""

INVERSE: Mapping[str, str] = {
    "above": "below",
    "cuts": "cut_by",
    "fills": "filled_by",
    "abuts": "abutted_by",
    "later_than": "earlier_than",
    **{name: name for name in SYMMETRIC},
}
"""Names of the relations seen from their objects."""


class Stratigraphy(Statement):
    """Stratigraphic relation of the subject to another unit or stone.

    Attributes
    ----------
    relation : one of DEFINITIONS
    object_entity, object_structure : what it is a relation to, exactly one of them
    """

    __kind__ = "stratigraphy"

    relation: Mapped[str | None]
    object_entity_id: Mapped[int | None] = mapped_column(ForeignKey("entity.id"))
    object_structure_id: Mapped[int | None] = mapped_column(ForeignKey("structure.id"))

    object_entity: Mapped[Entity | None] = relationship(foreign_keys=[object_entity_id])
    object_structure: Mapped[Structure | None] = relationship(foreign_keys=[object_structure_id])
