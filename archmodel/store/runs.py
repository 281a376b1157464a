"""Storing of runs: records to rows of the tables, with every number checked."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import chain, repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Float, select
from sqlalchemy.orm import Session

from archmodel.arrays import Array, Ints
from archmodel.store.bulk import batches, insert_rows
from archmodel.store.run_record import (
    Columns,
    RunRecord,
    SimplificationRecord,
    StoneResult,
)
from archmodel.store.stone_rows import storable
from archmodel.tables.base import Base
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.runs import (
    FIDELITIES,
    CellResult,
    ContactPoint,
    EntityResult,
    JointResult,
    MechanismStone,
    Run,
    StructureResult,
)
from archmodel.tables.surveys import Simplification
from ground.errors import DatabaseError

_CHUNK = 5_000
"""Rows that are Python objects at a time, so that of a million contact points only the arrays are in memory."""

_MOTION = ("speed", "vx", "vy", "vz", "wx", "wy", "wz")


def run_row(run: RunRecord, place: str) -> dict[str, object]:
    """Return the row of the `run` table, without its keys.

    Parameters
    ----------
    run : the record
    place : names the run in errors
    """
    numbers = {"simulated": run.simulated, "wall": run.wall, **asdict(run.errors)}
    return {
        "scene": storable(run.scene),
        "scene_text": storable(run.scene_text),
        "outcome": str(run.outcome),
        "steps": run.steps,
        "contacts": None if run.contacts is None else len(run.contacts["joint"]),
        "versions": {str(name): str(version) for name, version in run.versions.items()},
        "summary": plain(run.summary, "summary", place),
        **{name: _finite(value, name, place) for name, value in numbers.items()},
    }


def plain(value: Mapping[str, object], name: str, place: str) -> dict[str, Any]:
    """Return the mapping as JSON will give it back.

    Raises
    ------
    DatabaseError
        if JSON cannot hold it
    """
    try:
        copy: dict[str, Any] = json.loads(json.dumps(dict(value), allow_nan=False))
    except (TypeError, ValueError) as error:
        raise DatabaseError(f"the {name} cannot be stored: {error}", where=place) from error
    return copy


def result_row(result: StoneResult, place: str) -> dict[str, object]:
    """Return the row of the `entity_result` table, without its keys."""
    if result.fidelity not in FIDELITIES:
        what = f"fidelity {result.fidelity!r} is none of {', '.join(FIDELITIES)}"
        raise DatabaseError(what, where=place)
    numbers = {
        "von_mises_p99": result.von_mises_p99,
        "von_mises_max": result.von_mises_max,
        "von_mises_mean": result.von_mises_mean,
        "displacement_max": result.displacement_max,
        "contact_force_max": result.contact_force_max,
    }
    values = {str(name): _finite(value, name, place) for name, value in result.values.items()}
    known = {name: _finite(value, name, place) for name, value in numbers.items()}
    return {"fidelity": str(result.fidelity), "values": values, **known}


def simplification_row(record: SimplificationRecord, place: str) -> dict[str, object]:
    """Return the row of the `simplification` table, without its keys."""
    vertices = np.asarray(record.vertices, dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
        raise DatabaseError("the corners of its solid are not (n, 3) finite numbers", where=place)
    return {
        "mode": record.mode,
        "displacement_max": _finite(record.displacement_max, "displacement_max", place),
        "volume_change": _finite(record.volume_change, "volume_change", place),
        "shape": record.shape,
        "blockiness": _finite(record.blockiness, "blockiness", place),
        "worst_angle": _finite(record.worst_angle, "worst_angle", place),
        "within_tolerance": record.within_tolerance,
        "vertices": vertices,
        "faces": [[int(index) for index in face] for face in record.faces],
    }


def table_rows(
    table: type[Base], columns: Columns, entities: Ints, run: int, place: str
) -> Iterator[dict[str, Any]]:
    """Return the rows of a table of results, all checked before the first is yielded.

    Parameters
    ----------
    table : with a column `run_id`
    columns : of the table, without those of the run and, if its rows are numbered, the number; NaN where unknown.
        In place of `first_id` there may be `first`, an index into `entities`; likewise for other stones
    entities : (n,) primary keys of the run's stones
    run : number of the run
    place : names the run in errors

    Raises
    ------
    DatabaseError
        if the columns are not those of the table, a number is not finite, or a stone is not one of the run
    """
    count = len(next(iter(columns.values())))
    given: dict[str, NDArray[Any]] = {"number": np.arange(count), **columns}
    wanted = [column for column in table.__table__.columns if column.name != "run_id"]
    named = {column.name: column.name.removesuffix("_id") for column in wanted}
    if "number" not in named:
        del given["number"]
    if wrong := sorted(set(given) ^ set(named.values())):
        raise DatabaseError(f"the columns are not those of the table: {', '.join(wrong)}", where=place)
    checked = {}
    for column in wanted:
        values = given[named[column.name]]
        if column.foreign_keys:
            values = _entities_of(values, entities, place)
        elif isinstance(column.type, Float):
            check = _known if column.nullable else _all_finite
            values = check(values, column.name, place)
        elif column.nullable:
            values = np.ma.masked_less(values, 0)
        checked[column.name] = values
    return _rows(checked, run)


def cell_rows(cells: Mapping[str, Columns], run: int, place: str) -> Iterator[dict[str, Any]]:
    """Return the rows of the `cell_result` table; as `table_rows`."""
    none = np.zeros(0, dtype=np.int64)
    return chain.from_iterable(
        table_rows(
            CellResult,
            {
                "cell": np.full(len(given["step"]), storable(name)),
                **given,
                "step": np.asarray(given["step"], dtype=np.int64),
            },
            none,
            run,
            f"{place}, cell {name!r}",
        )
        for name, given in cells.items()
    )


def _rows(columns: Mapping[str, NDArray[Any]], run: int) -> Iterator[dict[str, Any]]:
    """Yield one mapping per row, made a chunk at a time, None where masked; columns must be equally long."""
    names, count = ("run_id", *columns), len(next(iter(columns.values())))
    for start in range(0, count, _CHUNK):
        lists = [column[start : start + _CHUNK].tolist() for column in columns.values()]
        for row in zip(repeat(run, len(lists[0])), *lists, strict=True):
            yield dict(zip(names, row, strict=True))


def _entities_of(stones: Ints, entities: Ints, place: str) -> Ints:
    """Return the primary keys of stones by their indices."""
    if len(stones) and not (stones.min() >= 0 and stones.max() < len(entities)):
        raise DatabaseError(f"a stone is not among the {len(entities)} stones of the run", where=place)
    return entities[stones]


def _all_finite(values: Array, name: str, place: str) -> Array:
    """Return the values, each of which must be finite."""
    if not np.isfinite(values).all():
        number = int(np.flatnonzero(~np.isfinite(values))[0])
        what = f"{name} is {values[number]}, not a finite number"
        raise DatabaseError(what, where=f"{place}, number {number}")
    return np.asarray(values, dtype=np.float64)


def _known(values: Array, name: str, place: str) -> NDArray[Any]:
    """Return the values, masked where they are undefined (NaN); refuse infinity."""
    unknown = np.isnan(values)
    known = _all_finite(np.where(unknown, 0.0, values), name, place)
    return np.ma.masked_array(known, unknown)


def _finite(value: float | None, name: str, place: str) -> float | None:
    if value is None:
        return None
    if not math.isfinite(value):
        raise DatabaseError(f"{name} is {value}, not a finite number", where=place)
    return float(value)


def store_run(session: Session, run: RunRecord) -> int:
    """Store a run with its results by stone, by joint and by contact point: all of it or nothing.

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
    _refuse_twice([simplification.code for simplification in run.simplifications], "simplifications", place)
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
        insert_rows(session, StructureResult, _structures(run, stored.id, place))
        insert_rows(session, Simplification, _simplifications(run, numbers, stored.id, place))
        if run.joints is not None:
            rows = table_rows(JointResult, run.joints, entities, stored.id, f"{place}, joints")
            insert_rows(session, JointResult, rows)
        if run.contacts is not None:
            rows = table_rows(ContactPoint, run.contacts, entities, stored.id, f"{place}, contact points")
            insert_rows(session, ContactPoint, rows)
        insert_rows(session, MechanismStone, _moving(session, run, stored.id, place))
        insert_rows(session, CellResult, cell_rows(run.cells, stored.id, f"{place}, cells"))
        return stored.id


def _results(run: RunRecord, numbers: dict[str, int], stored: int, place: str) -> Iterator[dict[str, object]]:
    for result in run.results:
        keys = {"run_id": stored, "entity_id": numbers[result.code]}
        yield keys | result_row(result, f"{place}, stone {result.code}")


def _structures(run: RunRecord, stored: int, place: str) -> Iterator[dict[str, object]]:
    for structure in run.structures:
        where = f"{place}, {structure.code}"
        values = {name: _finite(value, name, where) for name, value in structure.values.items()}
        yield {"structure_id": structure.number, "run_id": stored, "values": values}


def _simplifications(
    run: RunRecord, numbers: dict[str, int], stored: int, place: str
) -> Iterator[dict[str, object]]:
    for simplification in run.simplifications:
        if simplification.code not in numbers:
            raise DatabaseError(f"stone {simplification.code} has a solid and no result", where=place)
        keys = {"run_id": stored, "entity_id": numbers[simplification.code]}
        yield keys | simplification_row(simplification, f"{place}, stone {simplification.code}")


def _moving(session: Session, run: RunRecord, stored: int, place: str) -> Iterator[dict[str, object]]:
    for load, stones in run.mechanisms.items():
        entities = _primary_keys(session, [one.code for one in stones], place)
        for stone, entity in zip(stones, entities.tolist(), strict=True):
            where = f"{place}, {load}, stone {stone.code}"
            numbers = dict(zip(_MOTION, (stone.speed, *stone.velocity, *stone.spin), strict=True))
            yield {"run_id": stored, "load": storable(load), "entity_id": entity} | {
                name: _finite(value, name, where) for name, value in numbers.items()
            }


def _refuse_twice(codes: Sequence[str], what: str, place: str) -> None:
    if len(set(codes)) < len(codes):
        twice = next(code for code in codes if codes.count(code) > 1)
        raise DatabaseError(f"two {what} for stone {twice}", where=place)


def _primary_keys(session: Session, codes: Sequence[str], place: str) -> Ints:
    """Return the (n,) primary keys of the stones, all of which must be stored."""
    numbers: dict[str, int] = {}
    for batch in batches(codes):
        rows = session.execute(select(Entity.code, Entity.id).where(Entity.code.in_(batch)))
        numbers.update((row.code, row.id) for row in rows)
    for code in codes:
        if code not in numbers:
            remedy = "keep the run in the database that its stones were taken from (--db)"
            raise DatabaseError(f"stone {code} is not in the database", where=place, remedy=remedy)
    return np.array([numbers[code] for code in codes], dtype=np.int64)
