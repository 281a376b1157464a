"""The declarative base, column types that SQL lacks (arrays, instants), and declared attributes of stones.

A column made by `attribute` declares what it means, once: rows, records, queries, the exchange document and the
documentation take it from there.
"""

import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import lru_cache
from json import JSONEncoder
from typing import Any, cast, get_args

from sqlalchemy import JSON, Column, DateTime, LargeBinary, String, Table
from sqlalchemy.engine import Dialect
from sqlalchemy.orm import DeclarativeBase, MappedColumn, Mapper, mapped_column
from sqlalchemy.types import TypeDecorator

from archmodel.arrays import Array

TEXT = String().with_variant(String(collation="C"), "postgresql")
"""Text compared by code points on every database, whatever its locale."""

JSON_TYPE = JSON(none_as_null=True)
"""Plain JSON, not JSONB, on PostgreSQL: values come back unchanged, even in the order of their keys."""

LARGEST_INTEGER = 2**31 - 1
"""Largest value of an integer column: PostgreSQL keeps four bytes."""


def json_text(value: object) -> str:
    """Encode a column's value for ``create_engine``; values without a JSON form (NaN) are an error.

    The text of tuples is cached: they hold what does not change, such as the faces of a solid, and many are equal.
    """
    if type(value) is tuple:
        return _text_of_tuple(value)
    if type(value) is dict and not value:
        return "{}"
    return _ENCODER.encode(value)


@lru_cache(maxsize=256)
def _text_of_tuple(value: tuple[object, ...]) -> str:
    return _ENCODER.encode(value)


_ENCODER = JSONEncoder(allow_nan=False, separators=(",", ":"))


class ArrayType(TypeDecorator[Array]):
    """A float64 array of known shape, stored bit for bit as little-endian bytes.

    Arrays come out read-only, since a change in place would never reach the database.

    Parameters
    ----------
    shape : as for ``numpy.reshape``; one axis may be -1
    """

    impl = LargeBinary
    cache_ok = True

    def __init__(self, *shape: int) -> None:
        super().__init__()
        self.shape = shape

    def process_bind_param(self, value: Array | None, dialect: Dialect) -> bytes | None:
        """Convert an array to bytes."""
        if value is None:
            return None
        import numpy as np

        return np.asarray(value, dtype="<f8").reshape(self.shape).tobytes()

    def process_result_value(self, value: bytes | None, dialect: Dialect) -> Array | None:
        """Convert bytes to a read-only array."""
        if value is None:
            return None
        import numpy as np

        return np.frombuffer(value, dtype="<f8").astype(np.float64, copy=False).reshape(self.shape)


class UtcDateTime(TypeDecorator[datetime]):
    """An instant, stored as UTC without a zone and given back with the zone UTC."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Convert a zoned instant to UTC without a zone."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Give a stored instant the zone UTC."""
        return None if value is None else value.replace(tzinfo=UTC)


class Base(DeclarativeBase):
    """Base of every table of the entity database."""

    type_annotation_map = {  # noqa: RUF012  (SQLAlchemy's own way)
        str: TEXT,
        datetime: UtcDateTime(),
        dict[str, object]: JSON_TYPE,
    }


@dataclass(frozen=True)
class StoneAttribute:
    """An attribute of stones, as its column declares it.

    Attributes
    ----------
    name : as users write it
    unit : "m", "rad", …; "-" for counts and numbers without a unit; None for texts and truths
    definition : in a few words
    words : all texts that it can be; None if it can be any
    """

    name: str
    unit: str | None
    definition: str
    words: tuple[str, ...] | None = None


def attribute(
    unit: str | None,
    definition: str,
    *,
    name: str = "",
    words: tuple[str, ...] | None = None,
    **column: Any,
) -> MappedColumn[Any]:
    """Declare a column that is an attribute of stones; the rest is passed to ``mapped_column``.

    Parameters
    ----------
    unit, definition, words : as in `StoneAttribute`
    name : as users write it; "": the name of the column
    """
    return mapped_column(info={"attribute": StoneAttribute(name, unit, definition, words)}, **column)


def declared_attribute(column: Column[Any], name: str | None = None) -> StoneAttribute | None:
    """Return the attribute that a column declares, if any, under the name that users write."""
    stone_attribute: StoneAttribute | None = column.info.get("attribute")
    if stone_attribute is None:
        return None
    return StoneAttribute(
        stone_attribute.name or name or column.name,
        stone_attribute.unit,
        stone_attribute.definition,
        stone_attribute.words,
    )


def declared_attributes(mapper: Mapper[Any]) -> Iterator[tuple[Column[Any], StoneAttribute]]:
    """Yield the columns of a class itself, not of its subclasses, that are attributes of stones."""
    columns = mapper.columns
    for column in cast(Table, mapper.local_table).columns:
        stone_attribute = declared_attribute(column)
        if stone_attribute is not None and columns.contains_column(column):
            yield column, stone_attribute


def annotation_of(column: Column[Any], mapper: Mapper[Any]) -> object:
    """Return the Python type with which a column is declared, without ``Mapped``; object if unknown."""
    for mapper_below in mapper.self_and_descendants:
        for cls in mapper_below.class_.__mro__:
            declared = inspect.get_annotations(cls).get(column.key)
            if declared is not None and get_args(declared):
                return get_args(declared)[0]
    return object
