"""Column types of the old layouts; values go through them as they are stored."""

from sqlalchemy import JSON, Index, LargeBinary, String, text

__all__ = ["BYTES", "JSON_TEXT", "TEXT", "current"]

TEXT = String().with_variant(String(collation="C"), "postgresql")
"""Compared by code points."""

JSON_TEXT = JSON(none_as_null=True)

BYTES = LargeBinary()
"""Little-endian float64 arrays."""


def current(name: str, *columns: str) -> Index:
    """A unique index over the rows that are held now."""
    now = text("superseded_id IS NULL")
    return Index(name, *columns, unique=True, sqlite_where=now, postgresql_where=now)
