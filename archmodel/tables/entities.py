"""Hierarchy of entities: one word, one role, indivisible.

::

    Entity
    ├── Stone
    │   ├── Ashlar
    │   │   ├── Header
    │   │   ├── Stretcher
    │   │   ├── Quoin
    │   │   ├── Jamb
    │   │   ├── Sill
    │   │   ├── Lintel
    │   │   ├── Mullion
    │   │   ├── Corbel
    │   │   ├── Coping
    │   │   ├── Cornice
    │   │   ├── Slab
    │   │   ├── Voussoir
    │   │   │   ├── Keystone
    │   │   │   └── Springer
    │   │   ├── RibSegment
    │   │   │   ├── Boss
    │   │   │   └── RibSpringer
    │   │   └── WebStone
    │   ├── ColumnPart
    │   │   ├── ColumnBase (base)
    │   │   ├── Shaft
    │   │   └── Capital
    │   ├── Rubble
    │   └── Support
    ├── Infill
    └── Joint

To add a kind, write one class with a docstring. To add an attribute of a kind, and of its subkinds, write one column
with `attribute`. All kinds live in one table and differ in the column `kind` (single-table inheritance, see
``docs/design/architectural-model.md``). A query of a kind finds its subkinds too. Kinds that a user registers
in a database (``archmodel.tables.registered``) become classes of this hierarchy while it is open.
"""

from collections.abc import Mapping
from typing import Any, ClassVar

from sqlalchemy import ForeignKey, Index
from sqlalchemy.orm import Mapped, MappedColumn, declared_attr, mapped_column, relationship

from archmodel.tables.base import Base, StoneAttribute, attribute, declared_attribute
from archmodel.tables.entries import Entry
from archmodel.tables.hierarchy import Kind, kind_among, kind_chain, kind_of, kinds_below
from archmodel.tables.surveys import Measurement

CORRECTABLE = ("kind", "code", "course", "zone")
"""Attributes of every entity that can be corrected, besides those of its kind; the others follow from its survey."""


class Entity(Kind, Base):
    """A part of the building that has one role and is not divided further.

    The columns made by `attribute` say what they are.

    Attributes
    ----------
    own : values of the attributes of a registered kind, by name
    entry : the act of recording that it came with; later changes are `knowledge.Correction`

    Class attributes, for those who write kinds, besides those of `Kind`
    --------------------------------------------------------------------
    __own__ : the attributes that the kind has and its parents have not; taken from its columns
    __canon__ : canonical proportions, as a query expression; None: those of the parent
    """

    __tablename__ = "entity"
    __table_args__ = (
        Index("ix_entity_kind_course", "kind", "course"),
        Index("ix_entity_kind_depth", "kind", "depth"),
        Index("ix_entity_zone_course", "zone", "course"),
        Index("ix_entity_place", "x", "y", "z"),
    )
    __own__: ClassVar[tuple[StoneAttribute, ...]] = ()
    __canon__: ClassVar[str | None] = None

    id: Mapped[int] = mapped_column(primary_key=True)
    code: Mapped[str] = attribute(None, "name of the stone in the survey", unique=True)
    kind: Mapped[str] = attribute(None, "its own kind, e.g. keystone")
    entry_id: Mapped[int] = mapped_column(ForeignKey("entry.id"))
    course: Mapped[int | None] = attribute("-", "number of its course, from the ground")
    zone: Mapped[str | None] = attribute(None, "part of the building")
    depth: Mapped[float | None] = attribute("m", "how far it reaches into the wall")
    depth_sigma: Mapped[float | None] = attribute("m", "standard deviation of the depth")
    depth_origin: Mapped[str | None] = attribute(None, "evidence: stone, rule, kind, structure or solid")
    depth_source: Mapped[str | None] = attribute(None, "that evidence in words")
    length: Mapped[float | None] = attribute("m", "horizontal extent of its face")
    height: Mapped[float | None] = attribute("m", "extent of its face upwards")
    area: Mapped[float | None] = attribute("m²", "area of its face")
    volume: Mapped[float | None] = attribute("m³", "volume of its solid")
    x: Mapped[float | None] = attribute("m", "centroid of its solid")
    y: Mapped[float | None] = attribute("m", "centroid of its solid")
    z: Mapped[float | None] = attribute("m", "centroid of its solid")
    hypothesis: Mapped[bool] = attribute(
        None,
        "nobody has seen it, missing or hidden in the wall, or looked at its proposed outline",
        default=False,
    )
    own: Mapped[dict[str, object] | None]

    entry: Mapped[Entry] = relationship()
    measurement: Mapped[Measurement | None] = relationship(
        primaryjoin="and_(Measurement.entity_id == Entity.id, Measurement.superseded_id.is_(None))",
        viewonly=True,
    )
    measurements: Mapped[list[Measurement]] = relationship(order_by=Measurement.entry_id)

    def __init_subclass__(cls, **options: Any) -> None:
        columns = [(name, var.column) for name, var in vars(cls).items() if isinstance(var, MappedColumn)]
        declared = [declared_attribute(column, name) for name, column in columns]
        if declared:
            cls.__own__ = tuple(one for one in declared if one is not None)
        super().__init_subclass__(**options)

    @declared_attr.directive
    @classmethod
    def __mapper_args__(cls) -> dict[str, object]:
        # A query of a general kind loads the attributes of its subkinds at once, not one entity after another.
        identity: dict[str, object] = {"polymorphic_identity": kind_of(cls)}
        if cls.__name__ != "Entity":
            return identity
        # Columns of all kinds come with a query of Entity. Of Entity alone: an alias of a class takes an alias of
        # each subclass that comes with it, and where these do the same, their number doubles with every level.
        return identity | {"polymorphic_on": "kind", "with_polymorphic": "*"}

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.code}>"


class Stone(Entity):
    """A single block of stone in its place."""

    minimum_trace: Mapped[float | None] = attribute(
        "-", "of its wall: shortest way up through the joints of the face, over the straight distance"
    )
    section_trace: Mapped[float | None] = attribute(
        "-", "of its wall: shortest way down through the joints between both faces, over the height"
    )
    mqi_vertical_low: Mapped[float | None] = attribute(
        "-", "of its wall: masonry quality index for vertical loads, at least"
    )
    mqi_vertical_high: Mapped[float | None] = attribute(
        "-", "of its wall: masonry quality index for vertical loads, at most"
    )
    mqi_in_plane_low: Mapped[float | None] = attribute(
        "-", "of its wall: masonry quality index for loads in the plane, at least"
    )
    mqi_in_plane_high: Mapped[float | None] = attribute(
        "-", "of its wall: masonry quality index for loads in the plane, at most"
    )
    mqi_out_of_plane_low: Mapped[float | None] = attribute(
        "-", "of its wall: masonry quality index for loads out of the plane, at least"
    )
    mqi_out_of_plane_high: Mapped[float | None] = attribute(
        "-", "of its wall: masonry quality index for loads out of the plane, at most"
    )


class Ashlar(Stone):
    """A stone cut to planar faces and laid in the masonry."""


class Header(Ashlar):
    """An ashlar laid across the wall, so that its short side is seen and its length binds the wall."""

    __canon__ = "depth >= length"

    tail_length: Mapped[float | None] = attribute("m", "how far it reaches behind the stretchers beside it")


class Stretcher(Ashlar):
    """An ashlar laid along the wall, so that its long side is seen."""

    __canon__ = "length >= depth and length >= height"


class Quoin(Ashlar):
    """An ashlar at the corner of two walls, seen on two sides."""


class Jamb(Ashlar):
    """An ashlar at the upright side of an opening."""


class Sill(Ashlar):
    """An ashlar that closes an opening below."""

    __canon__ = "length >= height"


class Lintel(Ashlar):
    """An ashlar that spans an opening and carries what is above by bending."""

    __canon__ = "length >= height"

    span: Mapped[float | None] = attribute("m", "clear width of the opening below it")


class Mullion(Ashlar):
    """An upright ashlar that divides an opening."""

    __canon__ = "height >= length"


class Corbel(Ashlar):
    """An ashlar built into the wall whose free end carries what projects from it."""

    projection: Mapped[float | None] = attribute("m", "how far it projects from the face of the wall")


class Coping(Ashlar):
    """An ashlar that covers the top of a wall and sheds the water."""


class Cornice(Ashlar):
    """An ashlar of a projecting, moulded course."""


class Slab(Ashlar):
    """A flat ashlar of a floor, a landing or a roof."""


class Voussoir(Ashlar):
    """A wedge-shaped ashlar of an arch, which carries by pressing on its neighbours."""

    ring: Mapped[int | None] = attribute("-", "number of its ring of the arch, from the intrados outwards")
    rank: Mapped[int | None] = attribute("-", "its place in the ring, from 1 at one springer to the other")
    intrados_angle: Mapped[float | None] = attribute(
        "rad", "angle between its two joints, seen along the arch's axis"
    )


class Keystone(Voussoir):
    """The voussoir at the crown of an arch, set last."""


class Springer(Voussoir):
    """The lowest stone on either side of an arch, whose sloped side takes the arch's thrust."""


class RibSegment(Ashlar):
    """A moulded ashlar of the rib of a vault."""

    rank: Mapped[int | None] = attribute(
        "-", "its place in the rib, from 1 at the springing", use_existing_column=True
    )


class Boss(RibSegment):
    """The rib segment where ribs meet at the crown of a vault."""


class RibSpringer(RibSegment):
    """The lowest stone of the ribs at a corner, bonded into the walls: the tas-de-charge, which bears the webs too."""


class WebStone(Ashlar):
    """An ashlar of the web of a vault, the shell between its ribs, laid in a course."""


class ColumnPart(Stone):
    """A stone of a column."""


class ColumnBase(ColumnPart):
    """The lowest part of a column, wider than the shaft."""

    __kind__ = "base"


class Shaft(ColumnPart):
    """A drum of a column, or the whole of it between base and capital."""

    drum: Mapped[int | None] = attribute("-", "number of the drum, from the base upwards")


class Capital(ColumnPart):
    """The head of a column, which spreads to take what it carries."""


class Rubble(Stone):
    """A stone laid as it was found, without cut faces."""


class Support(Stone):
    """A block that carries the masonry and does not move: a foundation, an abutment."""


class Infill(Entity):
    """The core of mortar and small stones between the two facings of a wall."""


class Joint(Entity):
    """The mortar between two entities."""

    thickness: Mapped[float | None] = attribute("m", "distance of the two faces that it fills")


def kinds() -> Mapping[str, type[Entity]]:
    """Return every kind by its name, general before particular."""
    return kinds_below(Entity)


def kind_named(name: str) -> type[Entity]:
    """Return the kind of this name; see `kind_among`."""
    return kind_among(kinds(), name)


def own_attributes(cls: type[Entity]) -> Mapping[str, StoneAttribute]:
    """Return the attributes that a kind has besides those of every entity: its parents' and its own."""
    return {one.name: one for base in kind_chain(cls) for one in base.__own__}


def canon_of(cls: type[Entity]) -> str | None:
    """Return the canonical proportions of a kind as a query expression; None if it has none."""
    return cls.__canon__
