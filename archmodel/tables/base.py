"""The declarative base, and the column types that SQL does not have: arrays and instants."""

from datetime import UTC, datetime
from functools import lru_cache
from json import JSONEncoder

import numpy as np
from sqlalchemy import JSON, DateTime, LargeBinary, String
from sqlalchemy.engine import Dialect
from sqlalchemy.orm import DeclarativeBase
from sqlalchemy.types import TypeDecorator

from archmodel.arrays import Array

__all__ = ["JSON_TYPE", "TEXT", "ArrayType", "Base", "UtcDateTime", "json_text"]

TEXT = String().with_variant(String(collation="C"), "postgresql")
"""Texts compare by their characters' code points on every database, whatever its locale."""

JSON_TYPE = JSON(none_as_null=True)
"""Not JSONB on PostgreSQL: what comes out is what went in, to the order of the keys."""


def json_text(value: object) -> str:
    """JSON of a column's value, for ``create_engine``; what JSON cannot say (NaN) is an error.

    Tuples are of what does not change, like the faces of a solid, and mostly alike: their text is kept.
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
        """Array to bytes."""
        if value is None:
            return None
        return np.asarray(value, dtype="<f8").reshape(self.shape).tobytes()

    def process_result_value(self, value: bytes | None, dialect: Dialect) -> Array | None:
        """Bytes to a read-only array."""
        if value is None:
            return None
        return np.frombuffer(value, dtype="<f8").astype(np.float64, copy=False).reshape(self.shape)


class UtcDateTime(TypeDecorator[datetime]):
    """An instant: stored as UTC without a zone, given back with the zone UTC."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Zoned instant to UTC without a zone."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Stored instant to one in UTC."""
        return None if value is None else value.replace(tzinfo=UTC)


class Base(DeclarativeBase):
    """Base of every table of the entity database."""

    type_annotation_map = {  # noqa: RUF012  (SQLAlchemy's own way)
        str: TEXT,
        datetime: UtcDateTime(),
        dict[str, object]: JSON_TYPE,
    }
