"""A simulation run into the database: all of it or nothing."""

from collections.abc import Iterator, Sequence

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.arrays import Ints
from archmodel.store.bulk import batches, insert_rows
from archmodel.store.run_record import RunRecord
from archmodel.store.runs import contact_rows, joint_rows, plain, result_row, run_row, simplification_row
from archmodel.store.stone_rows import storable
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.runs import ContactPoint, EntityResult, JointResult, Run
from archmodel.tables.surveys import Simplification
from moma.errors import DatabaseError

__all__ = ["store_run"]


def store_run(session: Session, run: RunRecord) -> int:
    """Keep a run with its results by stone, by joint and by contact point: all of it or nothing.

    Parameters
    ----------
    session : a writing session; it stays usable after an error
    run : the record; arrays of joints and contact points become rows a few at a time

    Returns
    -------
    int
        number of the run, larger than that of every earlier one

    Raises
    ------
    DatabaseError
        if a stone of the run is not in the database or comes twice, or a number is not finite
    """
    place = f"run of {run.scene}"
    codes = [result.code for result in run.results]
    _refuse_twice(codes, "results", place)
    _refuse_twice([one.code for one in run.simplifications], "simplifications", place)
    with session.begin_nested():
        if run.as_of is not None and session.get(Entry, run.as_of) is None:
            raise DatabaseError(f"there is no entry {run.as_of}", where=place)
        entry = new_entry(
            session, "run", storable(run.scene), settings=plain(run.settings, "settings", place)
        )
        stored = Run(entry_id=entry.id, as_of_id=run.as_of, **run_row(run, place))
        session.add(stored)
        session.flush()
        entities = _primary_keys(session, codes, place)
        numbers = dict(zip(codes, entities.tolist(), strict=True))
        insert_rows(session, EntityResult, _results(run, numbers, stored.id, place))
        insert_rows(session, Simplification, _simplifications(run, numbers, stored.id, place))
        if run.joints is not None:
            insert_rows(session, JointResult, joint_rows(run.joints, entities, stored.id, f"{place}, joints"))
        if run.contacts is not None:
            rows = contact_rows(run.contacts, entities, stored.id, f"{place}, contact points")
            insert_rows(session, ContactPoint, rows)
        return stored.id


def _results(run: RunRecord, numbers: dict[str, int], stored: int, place: str) -> Iterator[dict[str, object]]:
    for result in run.results:
        keys = {"run_id": stored, "entity_id": numbers[result.code]}
        yield keys | result_row(result, f"{place}, stone {result.code}")


def _simplifications(
    run: RunRecord, numbers: dict[str, int], stored: int, place: str
) -> Iterator[dict[str, object]]:
    for one in run.simplifications:
        if one.code not in numbers:
            raise DatabaseError(f"stone {one.code} has a solid and no result", where=place)
        keys = {"run_id": stored, "entity_id": numbers[one.code]}
        yield keys | simplification_row(one, f"{place}, stone {one.code}")


def _refuse_twice(codes: Sequence[str], what: str, place: str) -> None:
    if len(set(codes)) < len(codes):
        twice = next(code for code in codes if codes.count(code) > 1)
        raise DatabaseError(f"two {what} for stone {twice}", where=place)


def _primary_keys(session: Session, codes: Sequence[str], place: str) -> Ints:
    """(n,) primary keys of the stones; every one must be there."""
    numbers: dict[str, int] = {}
    for batch in batches(codes):
        rows = session.execute(select(Entity.code, Entity.id).where(Entity.code.in_(batch)))
        numbers.update((row.code, row.id) for row in rows)
    for code in codes:
        if code not in numbers:
            remedy = "keep the run in the database that its stones were taken from (--db)"
            raise DatabaseError(f"stone {code} is not in the database", where=place, remedy=remedy)
    return np.array([numbers[code] for code in codes], dtype=np.int64)
