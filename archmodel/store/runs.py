"""Storing of runs: records to rows of the tables, with every number checked."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import chain, repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.arrays import Array, Ints
from archmodel.store.bulk import batches, insert_rows
from archmodel.store.run_record import (
    ContactArrays,
    JointArrays,
    RunRecord,
    SimplificationRecord,
    StoneResult,
)
from archmodel.store.stone_rows import storable
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
)
from archmodel.tables.surveys import Simplification
from ground.errors import DatabaseError

__all__ = [
    "cell_rows",
    "contact_rows",
    "joint_rows",
    "plain",
    "result_row",
    "run_row",
    "simplification_row",
    "store_run",
]

_CHUNK = 5_000
"""Rows that are Python objects at a time, so that of a million contact points only the arrays are in memory."""

_JOINT_NUMBERS = ("area", "force_normal", "force_shear", "gap", "opening", "sliding")
_JOINT_UNKNOWNS = ("pressure_mean", "pressure_max", "kern", "friction_use", "slipping", "open")
_MOTION = ("speed", "vx", "vy", "vz", "wx", "wy", "wz")
_CONTACT_NUMBERS = ("area", "gap", "opening", "slide")


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
        "contacts": None if run.contacts is None else len(run.contacts.joint),
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


def joint_rows(joints: JointArrays, entities: Ints, run: int, place: str) -> Iterator[dict[str, Any]]:
    """Return the rows of the `joint_result` table, all checked before the first is yielded.

    Parameters
    ----------
    joints : the arrays
    entities : (n,) primary keys of the run's stones
    run : number of the run
    place : names the run in errors
    """
    columns: dict[str, NDArray[Any]] = {"number": np.arange(len(joints.area))}
    columns |= _stones(joints.stones, entities, ("first_id", "second_id"), place)
    columns |= _vectors(joints.centroid, ("x", "y", "z"), place)
    columns |= _vectors(joints.normal, ("nx", "ny", "nz"), place)
    columns |= {name: _all_finite(getattr(joints, name), name, place) for name in _JOINT_NUMBERS}
    columns |= {name: _known(getattr(joints, name), name, place) for name in _JOINT_UNKNOWNS}
    width = np.full(len(joints.area), np.nan) if joints.width is None else joints.width
    columns["width"] = _known(width, "width", place)
    return _rows(columns | {"parted": np.asarray(joints.parted, dtype=bool)}, run)


def contact_rows(contacts: ContactArrays, entities: Ints, run: int, place: str) -> Iterator[dict[str, Any]]:
    """Return the rows of the `contact_point` table; as `joint_rows`."""
    joint = np.ma.masked_less(contacts.joint, 0)
    columns: dict[str, NDArray[Any]] = {"number": np.arange(len(joint)), "joint": joint}
    columns |= _stones(contacts.stones, entities, ("candidate_id", "antagonist_id"), place)
    columns |= _vectors(contacts.point, ("x", "y", "z"), place)
    columns |= _vectors(contacts.normal, ("nx", "ny", "nz"), place)
    columns |= _vectors(contacts.force, ("fx", "fy", "fz"), place)
    columns |= {name: _all_finite(getattr(contacts, name), name, place) for name in _CONTACT_NUMBERS}
    return _rows(columns | {"status": np.asarray(contacts.status)}, run)


def cell_rows(cells: Mapping[str, Mapping[str, Array]], run: int, place: str) -> Iterator[dict[str, Any]]:
    """Return the rows of the `cell_result` table; as `joint_rows`."""
    known = [column.name for column in CellResult.__table__.columns if column.name not in ("run_id", "cell")]
    chains = []
    for name, given in cells.items():
        if wrong := sorted(set(given) ^ set(known)):
            raise DatabaseError(
                f"cell {name!r} has not the columns of the table: {', '.join(wrong)}", where=place
            )
        columns: dict[str, NDArray[Any]] = {"cell": np.full(len(given["step"]), storable(name))}
        columns["step"] = np.asarray(given["step"], dtype=np.int64)
        columns["time"] = _all_finite(given["time"], "time", place)
        columns |= {one: _known(given[one], one, place) for one in known if one not in ("step", "time")}
        chains.append(_rows(columns, run))
    return chain.from_iterable(chains)


def _rows(columns: Mapping[str, NDArray[Any]], run: int) -> Iterator[dict[str, Any]]:
    """Yield one mapping per row, made a chunk at a time, None where masked; columns must be equally long."""
    names, count = ("run_id", *columns), len(next(iter(columns.values())))
    for start in range(0, count, _CHUNK):
        lists = [column[start : start + _CHUNK].tolist() for column in columns.values()]
        for row in zip(repeat(run, len(lists[0])), *lists, strict=True):
            yield dict(zip(names, row, strict=True))


def _stones(stones: Ints, entities: Ints, names: tuple[str, str], place: str) -> dict[str, NDArray[Any]]:
    """Replace the indices of the two stones by their primary keys."""
    if len(stones) and not (stones.min() >= 0 and stones.max() < len(entities)):
        raise DatabaseError(
            f"a pair of stones is not among the {len(entities)} stones of the run", where=place
        )
    return {name: entities[stones[:, side]] for side, name in enumerate(names)}


def _vectors(values: Array, names: tuple[str, str, str], place: str) -> dict[str, NDArray[Any]]:
    """Return the three components by name."""
    return {name: _all_finite(values[:, axis], name, place) for axis, name in enumerate(names)}


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
        insert_rows(session, Simplification, _simplifications(run, numbers, stored.id, place))
        if run.joints is not None:
            insert_rows(session, JointResult, joint_rows(run.joints, entities, stored.id, f"{place}, joints"))
        if run.contacts is not None:
            rows = contact_rows(run.contacts, entities, stored.id, f"{place}, contact points")
            insert_rows(session, ContactPoint, rows)
        insert_rows(session, MechanismStone, _moving(session, run, stored.id, place))
        insert_rows(session, CellResult, cell_rows(run.cells, stored.id, f"{place}, cells"))
        return stored.id


def _results(run: RunRecord, numbers: dict[str, int], stored: int, place: str) -> Iterator[dict[str, object]]:
    for result in run.results:
        keys = {"run_id": stored, "entity_id": numbers[result.code]}
        yield keys | result_row(result, f"{place}, stone {result.code}")


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
