"""Structures: the divisible parts of a building, from the building itself to a course.

::

    Structure
    ├── Building
    ├── Tower
    ├── Storey
    ├── Wall
    ├── WallFacing
    ├── Course
    ├── Arch
    ├── BarrelVault
    ├── RibVault
    ├── Rib
    ├── Web
    ├── Buttress
    ├── Column
    ├── Window
    ├── Door
    ├── Machicolation
    ├── Crenelation
    └── StratigraphicUnit

Structures contain structures (`parent`), and entities are members of structures (`relations.Membership`); an entity
can be a member of several, of a course and of a window, say. Kinds that a user registers in a database
(``archmodel.tables.registered``) become classes of this hierarchy while it is open; no name is in both hierarchies.
"""

from collections.abc import Mapping

from sqlalchemy import ForeignKey, Index
from sqlalchemy.orm import Mapped, declared_attr, mapped_column, relationship

from archmodel.tables.base import Base
from archmodel.tables.entries import Recorded, held_index
from archmodel.tables.hierarchy import Kind, kind_among, kind_of, kinds_below


class Structure(Kind, Recorded, Base):
    """A part of the building that is made of entities and of other structures.

    Attributes
    ----------
    code : its name, unique among the structures that are held now
    kind : name of its own kind
    title : in words; None if the code says enough
    parent : the structure that it is a part of
    number : its place among its like: a course counted from the ground, a storey from the lowest
    side : outer or inner, of a wall facing
    supersedes : the row that it replaces, if it is a correction
    """

    __tablename__ = "structure"
    __table_args__ = (
        held_index("ix_structure_code", "code"),
        Index("ix_structure_parent_id", "parent_id"),
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    code: Mapped[str]
    title: Mapped[str | None]
    parent_id: Mapped[int | None] = mapped_column(ForeignKey("structure.id"))
    number: Mapped[int | None]
    side: Mapped[str | None]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("structure.id"))

    parent: Mapped["Structure | None"] = relationship(
        foreign_keys=[parent_id], remote_side=[id], back_populates="parts"
    )
    parts: Mapped[list["Structure"]] = relationship(foreign_keys=[parent_id], back_populates="parent")

    @declared_attr.directive
    @classmethod
    def __mapper_args__(cls) -> dict[str, object]:
        identity: dict[str, object] = {"polymorphic_identity": kind_of(cls)}
        return identity | {"polymorphic_on": "kind"} if cls.__name__ == "Structure" else identity

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.code}>"


class Building(Structure):
    """The whole, under one name."""


class Tower(Structure):
    """A part that is taller than wide and stands out of the rest."""


class Storey(Structure):
    """The part of a building between two floors."""


class Wall(Structure):
    """An upright part that closes or divides, with its facings and its core."""


class WallFacing(Structure):
    """The layer of stones on one side of a wall: the outer or the inner."""


class Course(Structure):
    """A row of stones laid on one bed."""


class Arch(Structure):
    """A curved row of wedge-shaped stones over an opening."""


class BarrelVault(Structure):
    """A vault of one curvature: an arch drawn out along its axis."""


class RibVault(Structure):
    """A vault of webs carried by ribs."""


class Rib(Structure):
    """An arch of the skeleton of a rib vault, with a curve of its own."""


class Web(Structure):
    """The shell of a rib vault between its ribs, laid in courses: a cell, or severy."""


class Buttress(Structure):
    """A pier built against a wall to take a thrust."""


class Column(Structure):
    """An upright support of base, shaft and capital."""


class Window(Structure):
    """An opening for light, with the stones that frame it."""


class Door(Structure):
    """An opening to go through, with the stones that frame it."""


class Machicolation(Structure):
    """A gallery on corbels with openings in its floor."""


class Crenelation(Structure):
    """A parapet of merlons and embrasures."""


class StratigraphicUnit(Structure):
    """The result of one act of building, cutting or decay: a layer, a wall of one build, a cut, a filling."""


def structure_kinds() -> Mapping[str, type[Structure]]:
    """Return every kind of structure by its name, general before particular."""
    return kinds_below(Structure)


def structure_kind_named(name: str) -> type[Structure]:
    """Return the kind of structure of this name; see `kind_among`."""
    return kind_among(structure_kinds(), name, "kind of structure")
