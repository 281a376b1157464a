"""Sections of a building document, one for each table, derived from the table's metadata.

A new column or table needs nothing here, unless its type has no form in JSON yet.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from sqlalchemy import Column, Table
from sqlalchemy.orm import Mapper

from archmodel.exchange.values import Value, value_of
from archmodel.tables.base import Base, annotation_of
from archmodel.tables.entities import Entity
from archmodel.tables.layout import SchemaVersion
from archmodel.tables.registered import RegisteredKind
from archmodel.tables.structures import Structure

_READING_ORDER = (
    *("entries", "registered", "surveys", "entities", "structures", "relations", "knowledge", "terms"),
    *("opinions", "runs"),
)
"""Modules of `archmodel.tables`, in the order in which a reader wants their tables, as far as references allow."""


@dataclass(frozen=True)
class Label:
    """Code or name of the row that a reference is to, written beside the number for human readers.

    Attributes
    ----------
    name : of its key in the document
    column : of the reference
    target : what it refers to: the column of the code or name
    number : the column of the target that `column` holds
    """

    name: str
    column: Column[Any]
    target: Column[Any]
    number: Column[Any]


@dataclass(frozen=True)
class Field:
    """One column.

    Attributes
    ----------
    name : of its key in the document, that of the column
    column : of the table
    value : how it is written
    required : it cannot be null
    label : of what it refers to, if that has a code or a name
    within : it refers to another row of the same table
    """

    name: str
    column: Column[Any]
    value: Value
    required: bool
    label: Label | None
    within: bool


@dataclass(frozen=True)
class Section:
    """One table.

    Attributes
    ----------
    name : of its key in the document, that of the table
    table : its table
    mapper : of its most general class
    fields : its columns, the primary key first
    key : names of the primary key's columns; rows are in its order
    """

    name: str
    table: Table
    mapper: Mapper[Any]
    fields: tuple[Field, ...]
    key: tuple[str, ...]

    @property
    def labels(self) -> tuple[Label, ...]:
        """Labels of all fields."""
        return tuple(field.label for field in self.fields if field.label is not None)


@cache
def sections() -> tuple[Section, ...]:
    """Return all sections, in an order in which every row comes after what it refers to."""
    mappers = {mapper.local_table: mapper.base_mapper for mapper in Base.registry.mappers}
    return tuple(_section(table, mappers[table]) for table in _ordered(mappers))


def _ordered(mappers: dict[Any, Mapper[Any]]) -> Iterator[Table]:
    """Yield tables after what they refer to; of those that could come next, the first in reading order."""

    def rank(table: Table) -> tuple[int, int]:
        """Return the place of a table in the order of reading."""
        module = mappers[table].class_.__module__.rpartition(".")[2]
        known = module in _READING_ORDER
        return _READING_ORDER.index(module) if known else len(_READING_ORDER), declared.index(table)

    # The version of the layout is in the head.
    declared = [table for table in Base.metadata.tables.values() if table is not SchemaVersion.__table__]
    waiting = sorted(declared, key=rank)
    while waiting:
        ready = next(table for table in waiting if not _needs(table) & {*waiting})
        waiting.remove(ready)
        yield ready


def _needs(table: Table) -> set[Table]:
    """Return the tables that must come before this one."""
    needed = {key.column.table for key in table.foreign_keys} - {table}
    # Kinds are known by name, without a foreign key.
    of_kinds = table in (Entity.__table__, Structure.__table__)
    return needed | {RegisteredKind.__table__} if of_kinds else needed  # type: ignore[arg-type]


def _section(table: Table, mapper: Mapper[Any]) -> Section:
    key = [column.name for column in table.primary_key]
    columns = sorted(table.columns, key=lambda column: column.name not in key)
    fields = tuple(_field(column, mapper) for column in columns)
    return Section(table.name, table, mapper, fields, tuple(key))


def _field(column: Column[Any], mapper: Mapper[Any]) -> Field:
    target = next((key.column for key in column.foreign_keys), None)
    within = target is not None and target.table is column.table
    label = None if target is None or within else _label(column, target)
    value = value_of(column, annotation_of(column, mapper))
    return Field(column.name, column, value, not column.nullable, label, within)


def _label(column: Column[Any], target: Column[Any]) -> Label | None:
    column_shown = next(
        (target.table.columns[name] for name in ("code", "name") if name in target.table.columns), None
    )
    if column_shown is None:
        return None
    name = column.name.removesuffix("_id")
    if name in column.table.columns:
        raise TypeError(
            f"{column.table.name} has a column {name} where the document has the {column_shown.name} of {column}"
        )
    return Label(name, column, column_shown, target)
