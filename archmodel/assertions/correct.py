"""Correction of entities: the new values hold, and the correction keeps both.

Kind, code, course, zone and the attributes of its kind are corrected by `correct`. Depth is no plain attribute,
since the solid follows from it: `replace_measurement` takes the solid that was made anew.
"""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import insert, select, update
from sqlalchemy.orm import Session
from sqlalchemy.orm.util import identity_key

from archmodel.assertions.validation import (
    checked_choice,
    checked_label,
    checked_number,
    checked_text,
    checked_whole,
)
from archmodel.store.find_by_code import no_such_code
from archmodel.store.lookalikes import Lookalikes, explained
from archmodel.store.remeasuring import MEASURED
from archmodel.store.revisions import RowCounts, table_of
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stone_rows import entity_rows, measurement_row
from archmodel.tables.base import StoneAttribute
from archmodel.tables.entities import CORRECTABLE, Entity, kind_named, own_attributes
from archmodel.tables.entries import Entry
from archmodel.tables.hierarchy import kind_of
from archmodel.tables.knowledge import Correction
from archmodel.tables.surveys import Measurement
from ground.errors import DatabaseError, UsageError

_GEOMETRY = ("depth", "depth_sigma", "depth_source", "depth_origin", "volume", "x", "y", "z")


def correct(session: Session, entry: Entry, code: str, values: Mapping[str, object]) -> RowCounts:
    """Give an entity other values of its attributes.

    Parameters
    ----------
    code : of the entity, before the correction
    values : by name of the attribute; None: not known. Where the kind changes, attributes that the new kind has
        not become unknown.

    Raises
    ------
    UsageError
        if there is no such entity or attribute, a value is not of its type, or the new code is taken
    """
    row = _row(session, code)
    kind = _kind(values.get("kind", row["kind"]))
    stone_attributes = own_attributes(kind_named(kind))
    checked = {name: _checked(name, value, stone_attributes, code) for name, value in values.items()}
    checked |= dict.fromkeys(_lost(row, stone_attributes) - checked.keys()) if kind != row["kind"] else {}
    changes = {name: (old, new) for name, new in checked.items() if (old := _value(row, name)) != new}
    if not changes:
        return RowCounts(unchanged=1)
    if "code" in changes:
        _refuse_taken(session, str(checked["code"]), row["id"])
    after = {name: new for name, (_, new) in changes.items()}
    columns = {name: new for name, new in after.items() if name in table_of(Entity).c}
    registered = {name: new for name, new in after.items() if name not in columns}
    if registered:
        kept = {**(row["own"] or {}), **registered}
        columns["own"] = {name: value for name, value in kept.items() if value is not None} or None
    _change(session, entry, row["id"], columns, changes)
    return RowCounts(replaced=1)


def replace_measurement(session: Session, entry: Entry, stone: StoneRecord, place: str) -> RowCounts:
    """Replace an entity's solid, depth and what follows from them with those of a record.

    Parameters
    ----------
    stone : as ``store.load_stones`` gave it, but for what was made anew
    place : for errors
    """
    row = _row(session, stone.code)
    measured = session.scalar(
        select(Measurement).where(Measurement.entity_id == row["id"], Measurement.superseded_id.is_(None))
    )
    if measured is None:
        raise DatabaseError(f"{stone.code} was not measured", where=place)
    made = entity_rows([stone], [place])[0]
    changes = {name: (row[name], made[name]) for name in _GEOMETRY if row[name] != made[name]}
    if not changes:
        return RowCounts(unchanged=1)
    measured.superseded_id = entry.id
    session.flush()
    values = measurement_row(stone, place)
    owner = {"entity_id": row["id"], "survey_id": measured.survey_id, "entry_id": entry.id}
    session.execute(insert(table_of(Measurement)).values({**values, **owner, "superseded_id": None}))
    _change(session, entry, row["id"], {name: new for name, (_, new) in changes.items()}, changes)
    return RowCounts(replaced=1)


def _row(session: Session, code: str) -> Mapping[str, Any]:
    """Return the entity's columns; not an object, whose class may be about to change."""
    session.flush()
    table = table_of(Entity)
    row = None
    if code.isprintable():
        row = session.execute(select(table).where(table.c.code == code)).mappings().one_or_none()
    if row is None:
        raise no_such_code(session, code, Entity.code)
    return dict(row)


def _kind(value: object) -> str:
    if not isinstance(value, str):
        raise UsageError(f"kind is {str(value)[:40]}", remedy="give the name of a kind")
    return kind_of(kind_named(value))


def _checked(name: str, value: object, stone_attributes: Mapping[str, StoneAttribute], code: str) -> object:
    """Check a value against its column."""
    if name == "kind":
        return _kind(value)
    if name in stone_attributes:
        return _own_value(stone_attributes[name], value)
    if name in MEASURED and not name.startswith("depth"):
        raise UsageError(
            f"{name} of {code} follows from its survey", remedy="measure it again, or give its depth"
        )
    if name.startswith("depth"):
        raise UsageError(f"{name} is no plain attribute", remedy="record it as a depth: the solid follows")
    checked_choice("attribute", name, (*CORRECTABLE, *stone_attributes))
    if name == "course":
        return checked_whole(name, value, -1000)  # type: ignore[arg-type]
    if value is None and name == "zone":
        return None
    if not isinstance(value, str):
        raise UsageError(f"{name} is {str(value)[:40]}", remedy="give a text")
    return checked_label(name, value)


def _own_value(attribute: StoneAttribute, value: object) -> object:
    """Check a value of a kind's attribute: an integer for an integer column, a number with a unit, or a text."""
    if value is None:
        return None
    if attribute.unit is None:
        if not isinstance(value, str):
            raise UsageError(f"{attribute.name} is {str(value)[:40]}", remedy="give a text")
        return checked_text(attribute.name, value)
    column = table_of(Entity).c.get(attribute.name)
    if column is not None and column.type.python_type is int:
        return checked_whole(attribute.name, value, 0)  # type: ignore[arg-type]
    return checked_number(attribute.name, value, attribute.unit)  # type: ignore[arg-type]


def _value(row: Mapping[str, Any], name: str) -> object:
    """Return the present value: from a column, or from the attributes of its registered kind."""
    return row[name] if name in row else (row["own"] or {}).get(name)


def _lost(row: Mapping[str, Any], stone_attributes: Mapping[str, StoneAttribute]) -> set[str]:
    """List attributes of the old kind that have a value and that the new kind lacks."""
    before = own_attributes(kind_named(row["kind"]))
    return {name for name in before if name not in stone_attributes and _value(row, name) is not None}


def _refuse_taken(session: Session, code: str, number: int) -> None:
    if session.scalar(select(Entity.id).where(Entity.code == code)) is not None:
        raise UsageError(f"the code {code} is taken by another stone", remedy="give it a code of its own")
    if (like := Lookalikes(session, Entity.code, Entity.id != number).like([code])) is not None:
        raise UsageError(f"the code {explained(*like)}", remedy="write both with the same characters")


def _change(
    session: Session,
    entry: Entry,
    number: int,
    columns: Mapping[str, object],
    changes: Mapping[str, tuple[object, object]],
) -> None:
    """Write the new values, and a correction for each."""
    table = table_of(Entity)
    session.execute(update(table).where(table.c.id == number).values(dict(columns)))
    rows = [
        {"entity_id": number, "entry_id": entry.id, "attribute": name, "before": before, "after": after}
        for name, (before, after) in changes.items()
    ]
    session.execute(insert(table_of(Correction)), rows)
    loaded = session.identity_map.get(identity_key(Entity, number))
    if loaded is not None:
        # it may be of another class now
        session.expunge(loaded)
