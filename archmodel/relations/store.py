"""Storage of computed relations: unchanged ones stay, new ones enter, those no longer found are superseded."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement, select, update
from sqlalchemy.orm import Session

from archmodel.arrays import Array, Bools, Ints
from archmodel.relations.classify import FoundRelations, RelationSettings
from archmodel.store.bulk import batches, insert_rows
from archmodel.store.revisions import table_of
from archmodel.store.stone_arrays import id_conditions
from archmodel.tables.base import Base
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.relations import RELATIONS, Relation

_NUMBER_ROUNDING = 1e-6
"""Numbers of a joint that differ by less [m, m²] are those of the same joint, computed about another place."""

_NUMBERS = ("area", "gap", "x", "y", "z", "nx", "ny", "nz")


class Act:
    """Act of recording that is made when the first row needs it, so that no change leaves no entry."""

    def __init__(
        self, session: Session, source: str, settings: Mapping[str, object], action: str = "geometry"
    ) -> None:
        self._make: Callable[[], Entry] = lambda: new_entry(session, action, source, settings=settings)
        self._entry: Entry | None = None

    @property
    def id(self) -> int:
        """Number of the entry."""
        if self._entry is None:
            self._entry = self._make()
        return self._entry.id

    @property
    def made(self) -> int | None:
        """Number of the entry; None as long as nothing needed it."""
        return None if self._entry is None else self._entry.id


def held_settings(session: Session) -> RelationSettings:
    """Return the tolerances of the last computed relations; the defaults if there are none.

    Relations that are computed later, of stones that come or change, are so to the same measure.
    """
    last = select(Entry.settings).where(Entry.action == "geometry").order_by(Entry.id.desc()).limit(1)
    names = {field.name for field in fields(RelationSettings)}
    stored_values: dict[str, Any] = {
        name: value for name, value in (session.scalar(last) or {}).items() if name in names
    }
    return RelationSettings(**stored_values)


@dataclass(frozen=True)
class Changes:
    """Counts of changed rows of one table.

    Attributes
    ----------
    added : that are new
    kept : that were found again
    superseded : that were not
    """

    added: int = 0
    kept: int = 0
    superseded: int = 0

    def __add__(self, other: "Changes") -> "Changes":
        return Changes(self.added + other.added, self.kept + other.kept, self.superseded + other.superseded)


def store_relations(
    session: Session,
    ids: Ints,
    found_relations: FoundRelations,
    act: Act,
    only: Collection[int] | None = None,
) -> dict[str, Changes]:
    """Replace the computed relations of the database with those that were found.

    A declared relation is left as it is, and no computed one comes beside it.

    Parameters
    ----------
    session : a writing session
    ids : (n,) numbers of the entities that the indices of `found_relations` mean, growing
    found_relations : relations
    act : that they come with
    only : numbers of entities; relations of which neither side is one of them are left alone. None: all

    Returns
    -------
    Changes by kind of relation
    """
    stored = _held(session, only)
    keys = _keys(found_relations.kind, ids[found_relations.subject], ids[found_relations.object])
    declared = np.isin(keys, stored.keys[stored.declared])
    place = np.searchsorted(stored.keys, keys) if len(stored.keys) else np.zeros(len(keys), np.int64)
    unchanged = np.zeros(len(keys), np.bool_)
    if len(stored.keys):
        place = np.minimum(place, len(stored.keys) - 1)
        unchanged = (stored.keys[place] == keys) & ~stored.declared[place]
        unchanged[unchanged] &= (
            np.abs(stored.numbers[place[unchanged]] - _numbers(found_relations)[unchanged])
            <= _NUMBER_ROUNDING
        ).all(axis=1)
    stays = stored.declared.copy()
    stays[place[unchanged]] = True
    new = np.flatnonzero(~declared & ~unchanged)
    supersede(session, Relation, stored.ids[~stays].tolist(), act)
    if len(new):
        insert_rows(session, Relation, _rows(ids, found_relations, new, act.id))
    return {
        name: Changes(
            int((found_relations.kind[new] == number).sum()),
            int((found_relations.kind[unchanged] == number).sum()),
            int((stored.kinds[~stays] == number).sum()),
        )
        for number, name in enumerate(RELATIONS)
    }


def supersede(session: Session, table: type[Base], numbers: list[int], act: Act) -> None:
    """End rows that are held now."""
    target = table_of(table)
    for batch in batches(numbers):
        session.execute(update(target).where(target.c.id.in_(batch)).values(superseded_id=act.id))


@dataclass(frozen=True)
class _Held:
    """Relations that are held now, in the order of their keys; a computed one before a declared one."""

    ids: Ints
    keys: Ints
    kinds: Ints
    declared: Bools
    numbers: Array


def _held(session: Session, only: Collection[int] | None) -> _Held:
    rows = {row[0]: row for condition in _concerning(only) for row in _select(session, condition)}
    count = len(rows)
    ids, subject, target = (np.array([row[k] for row in rows.values()], dtype=np.int64) for k in (0, 2, 3))
    kind = np.array([row[1] for row in rows.values()], dtype="U16")
    declared = np.array([row[4] for row in rows.values()], dtype=np.bool_)
    kinds = np.zeros(count, np.int64)
    for number, name in enumerate(RELATIONS):
        kinds[kind == name] = number
    numbers = np.array([row[5:] for row in rows.values()], dtype=np.float64).reshape(count, len(_NUMBERS))
    keys = _keys(kinds, subject, target)
    order = np.lexsort((ids, declared, keys))
    return _Held(ids[order], keys[order], kinds[order], declared[order], numbers[order])


def _select(session: Session, condition: ColumnElement[bool]) -> list[Any]:
    columns = table_of(Relation).c
    numbers = [columns[name] for name in _NUMBERS]
    return list(
        session.execute(
            select(
                columns.id, columns.kind, columns.subject_id, columns.object_id, columns.declared, *numbers
            ).where(columns.superseded_id.is_(None), condition)
        )
    )


def _concerning(only: Collection[int] | None) -> Iterator[ColumnElement[bool]]:
    """Return conditions that together hold for the relations of some entities."""
    if only is None:
        yield table_of(Relation).c.id.is_not(None)
        return
    for condition in id_conditions(table_of(Relation).c.subject_id, only):
        yield condition
    for condition in id_conditions(table_of(Relation).c.object_id, only):
        yield condition


def _keys(kind: Ints, subject: Ints, target: Ints) -> Ints:
    """Return one number for kind, subject and object; each entity's number is below 2³⁰."""
    return (kind << 60) | (subject << 30) | target


def _numbers(found_relations: FoundRelations) -> Array:
    return np.column_stack(
        [found_relations.area, found_relations.gap, found_relations.centroid, found_relations.normal]
    )


def _rows(ids: Ints, found_relations: FoundRelations, new: Ints, entry: int) -> Iterator[dict[str, Any]]:
    numbers = _numbers(found_relations)
    for batch in batches(new.tolist()):
        rows = np.array(batch)
        subjects, others = (
            ids[found_relations.subject[rows]].tolist(),
            ids[found_relations.object[rows]].tolist(),
        )
        kinds = [RELATIONS[kind] for kind in found_relations.kind[rows].tolist()]
        for kind, subject, target, values in zip(
            kinds, subjects, others, numbers[rows].tolist(), strict=True
        ):
            yield {
                "kind": kind,
                "subject_id": subject,
                "object_id": target,
                "declared": False,
                "entry_id": entry,
                "superseded_id": None,
                **dict(zip(_NUMBERS, values, strict=True)),
            }
