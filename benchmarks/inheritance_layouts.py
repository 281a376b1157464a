"""The hierarchy of entities in four layouts of tables, with the same attributes, for `benchmarks.inheritance`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import JSON, Float, ForeignKey, Index, Integer, MetaData, String
from sqlalchemy.orm import DeclarativeBase, mapped_column

from archmodel.tables.base import StoneAttribute
from archmodel.tables.entities import Entity, kinds
from archmodel.tables.hierarchy import kind_of

__all__ = ["LAYOUTS", "Layout", "make_layout"]

LAYOUTS = {
    "one table": "typed columns for all attributes, null where a kind has not got them",
    "one table, own in JSON": "attributes of single kinds in one JSON column",
    "joined": "a table for each kind",
    "joined, where needed": "a table for each kind that has attributes of its own",
}

COMMON = {
    "code": String,
    "course": Integer,
    "zone": String,
    "depth": Float,
    "depth_sigma": Float,
    "depth_source": String,
    "length": Float,
    "height": Float,
    "area": Float,
    "volume": Float,
    "x": Float,
    "y": Float,
    "z": Float,
}
"""Attributes of every entity, as in `archmodel.tables.entities.Entity`."""


@dataclass(frozen=True)
class Layout:
    """One way to lay out the hierarchy.

    Attributes
    ----------
    name : one of LAYOUTS
    metadata : its tables
    classes : mapped, by kind
    """

    name: str
    metadata: MetaData
    classes: Mapping[str, Any]

    @property
    def is_joined(self) -> bool:
        """Whether attributes of single kinds have tables of their own."""
        return self.name.startswith("joined")

    def own(self, kind: str, attribute: str) -> Any:
        """An attribute of a single kind, as a column."""
        cls = self.classes[kind]
        if "JSON" in self.name:
            return cls.own[attribute].as_integer() if attribute == "rank" else cls.own[attribute].as_float()
        return getattr(cls, attribute)


def make_layout(name: str) -> Layout:
    """Map classes of all kinds in one layout."""

    class Base(DeclarativeBase):
        pass

    root: dict[str, Any] = {
        "__tablename__": "entity",
        "__mapper_args__": {"polymorphic_on": "kind", "polymorphic_identity": "entity"}
        | ({} if name.startswith("joined") else {"with_polymorphic": "*"}),
        "id": mapped_column(Integer, primary_key=True),
        "kind": mapped_column(String, nullable=False),
        "own": mapped_column(JSON(none_as_null=True)),
        **{attribute: mapped_column(kind) for attribute, kind in COMMON.items()},
        "__table_args__": _indices(),
    }
    made: dict[str, Any] = {"entity": type("Entity", (Base,), root)}
    tables = {"entity": "entity"}  # that a kind's key refers to
    for kind, cls in kinds().items():
        if cls is Entity:
            continue
        parent = kind_of(cls.__mro__[1])
        tables[kind] = tables[parent]
        inside: dict[str, Any] = {"__mapper_args__": {"polymorphic_identity": kind}}
        if not name.startswith("joined"):  # all attributes at once, as in archmodel.entities
            inside["__mapper_args__"]["with_polymorphic"] = "*"
        if name == "joined" or (name == "joined, where needed" and cls.__dict__.get("__own__")):
            inside["__tablename__"] = tables[kind] = kind
            inside["id"] = mapped_column(ForeignKey(f"{tables[parent]}.id"), primary_key=True)
            inside["__mapper_args__"]["polymorphic_load"] = "selectin"
        if "JSON" not in name:
            inside |= {one.name: _column(one, name) for one in cls.__dict__.get("__own__", ())}
        made[kind] = type(cls.__name__, (made[parent],), inside)
    if "JSON" not in name:
        header = made["header"].__table__
        Index("ix_tail_length", *([header.c.kind] if name == "one table" else []), header.c.tail_length)
    return Layout(name, Base.metadata, made)


def _column(one: StoneAttribute, layout: str) -> Any:
    kind = Integer if one.unit == "-" else Float
    return mapped_column(kind, use_existing_column=layout == "one table", nullable=True)


def _indices() -> tuple[Index, ...]:
    """Indices of the real table."""
    return (
        Index("ix_code", "code", unique=True),
        Index("ix_kind_course", "kind", "course"),
        Index("ix_kind_depth", "kind", "depth"),
    )
