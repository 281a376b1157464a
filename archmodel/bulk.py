"""Many rows at once: numbers for them, and statements that are prepared once."""

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import Any, TypeVar

from sqlalchemy import func, insert, select
from sqlalchemy.orm import Session

from archmodel.base import Base

__all__ = ["BATCH", "batches", "first_free_id", "insert_rows"]

BATCH = 500
"""Rows per statement: fewer than SQLite's limit of parameters, and memory does not grow with what is stored."""

T = TypeVar("T")


def first_free_id(session: Session, table: type[Base]) -> int:
    """A primary key from which on all are free, in a writing session, which nobody else writes beside."""
    return int(session.scalar(select(func.coalesce(func.max(table.__table__.c.id), 0))) or 0) + 1


def insert_rows(session: Session, table: type[Base], rows: Iterable[Mapping[str, Any]]) -> int:
    """Insert rows that all have the same columns, primary keys included; how many they were.

    Rows are not kept: the source may be as long as it likes.
    """
    count = 0
    for batch in batches(rows):
        # The table, not the class: rows of many kinds go into one statement.
        session.execute(insert(table.__table__), batch)  # type: ignore[arg-type]
        count += len(batch)
    return count


def batches(items: Iterable[T]) -> Iterator[list[T]]:
    """The items in lists of `BATCH`."""
    source = iter(items)
    while batch := list(islice(source, BATCH)):
        yield batch
