"""The hierarchy of entities: one word, one role, indivisible.

::

    Entity
    ├── Ashlar
    │   ├── Header
    │   ├── Stretcher
    │   ├── Quoin
    │   ├── Jamb
    │   ├── Sill
    │   ├── Lintel
    │   └── Voussoir
    │       ├── Keystone
    │       └── Springer
    └── Rubble

To add a kind, write one class with a docstring; it needs no change of the database, since all kinds live in
one table and differ in the column `kind` (single-table inheritance). A query of a kind finds its subkinds
too.
"""

import difflib
from collections.abc import Iterator, Mapping

from sqlalchemy import ForeignKey, Index, String, select
from sqlalchemy.orm import Mapped, Session, declared_attr, mapped_column, relationship

from archmodel.base import Base
from archmodel.tables import EntityResult, Measurement, Survey
from moma.errors import DatabaseError, UsageError

__all__ = [
    "Ashlar",
    "Entity",
    "Header",
    "Jamb",
    "Keystone",
    "Lintel",
    "Quoin",
    "Rubble",
    "Sill",
    "Springer",
    "Stretcher",
    "Voussoir",
    "definition_of",
    "kind_chain",
    "kind_named",
    "kind_of",
    "kinds",
    "refuse_unknown_kinds",
]


def kind_of(cls: type["Entity"]) -> str:
    """Name of a kind as users write it: the class's name in lower case."""
    return cls.__name__.lower()


class Entity(Base):
    """A part of the building that has one role and is not divided further.

    Attributes
    ----------
    code : the name that the survey gave it, unique in the database
    kind : name of its class in lower case
    course : number of its course, counted from the ground; None if it belongs to none
    zone : part of the building, as the survey names it; None if it does not
    depth : how far it reaches into the wall [m], with its standard deviation, its evidence, and what kind of
        evidence that is
    length, height : of its face, horizontally and upwards in the face's plane [m]
    area : of its face [m²]
    volume : of its solid [m³]
    x, y, z : centroid of its solid [m]
    """

    __tablename__ = "entity"
    __table_args__ = (Index("ix_entity_kind_course", "kind", "course"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str] = mapped_column(String)
    code: Mapped[str] = mapped_column(String, unique=True)
    survey_id: Mapped[int] = mapped_column(ForeignKey("survey.id"), index=True)
    course: Mapped[int | None]
    zone: Mapped[str | None] = mapped_column(String)
    depth: Mapped[float]
    depth_sigma: Mapped[float | None]
    depth_source: Mapped[str] = mapped_column(String)
    depth_origin: Mapped[str] = mapped_column(String)
    length: Mapped[float]
    height: Mapped[float]
    area: Mapped[float]
    volume: Mapped[float]
    x: Mapped[float]
    y: Mapped[float]
    z: Mapped[float]

    survey: Mapped[Survey] = relationship(back_populates="entities")
    measurement: Mapped[Measurement] = relationship(back_populates="entity")
    results: Mapped[list[EntityResult]] = relationship(back_populates="entity", order_by=EntityResult.run_id)

    @declared_attr.directive
    @classmethod
    def __mapper_args__(cls) -> dict[str, object]:
        identity: dict[str, object] = {"polymorphic_identity": kind_of(cls)}
        return identity | {"polymorphic_on": "kind"} if cls.__name__ == "Entity" else identity

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.code}>"


class Ashlar(Entity):
    """A stone cut to planar faces and laid in the masonry."""


class Header(Ashlar):
    """An ashlar laid across the wall, so that its short side is seen and its length binds the wall."""


class Stretcher(Ashlar):
    """An ashlar laid along the wall, so that its long side is seen."""


class Quoin(Ashlar):
    """An ashlar at the corner of two walls, seen on two sides."""


class Jamb(Ashlar):
    """An ashlar at the upright side of an opening."""


class Sill(Ashlar):
    """An ashlar that closes an opening below."""


class Lintel(Ashlar):
    """An ashlar that spans an opening and carries what is above by bending."""


class Voussoir(Ashlar):
    """A wedge-shaped ashlar of an arch, which carries by pressing on its neighbours."""


class Keystone(Voussoir):
    """The voussoir at the crown of an arch, set last."""


class Springer(Voussoir):
    """The lowest stone on either side of an arch, whose sloped side takes the arch's thrust."""


class Rubble(Entity):
    """A stone laid as it was found, without cut faces."""


def kinds() -> Mapping[str, type[Entity]]:
    """Every kind by its name, general before particular."""
    return {kind_of(cls): cls for cls in _descend(Entity)}


def _descend(cls: type[Entity]) -> Iterator[type[Entity]]:
    yield cls
    for child in cls.__subclasses__():
        yield from _descend(child)


def kind_named(name: str) -> type[Entity]:
    """The kind of this name, in upper or lower case.

    Raises
    ------
    UsageError
        if there is none; names the nearest ones
    """
    known = kinds()
    if (cls := known.get(name.strip().lower())) is not None:
        return cls
    near = difflib.get_close_matches(name[:40].strip().lower(), known, n=3, cutoff=0.5)
    remedy = f"did you mean {' or '.join(near)}?" if near else f"the kinds are {', '.join(known)}"
    raise UsageError(f"unknown kind {name[:40]!r}", remedy=remedy)


def kind_chain(cls: type[Entity]) -> tuple[type[Entity], ...]:
    """The kind and what it inherits from, most general first: Entity, Ashlar, Voussoir, Keystone."""
    return tuple(base for base in reversed(cls.__mro__) if issubclass(base, Entity))


def definition_of(cls: type[Entity]) -> str:
    """The one sentence that defines a kind."""
    return (cls.__doc__ or "").strip().split("\n", 1)[0]


def refuse_unknown_kinds(session: Session) -> None:
    """Check that every kind in the database is declared, as it is not if another program added its own.

    Raises
    ------
    DatabaseError
        naming such a kind
    """
    unknown = session.scalar(select(Entity.kind).where(Entity.kind.not_in(list(kinds()))).limit(1))
    if unknown is not None:
        remedy = "import the module that declares it, or use the version of MOMA that stored it"
        raise DatabaseError(f"the database holds a kind {unknown!r} that is not declared", remedy=remedy)
