"""Descriptions of simulation runs: a list of all, one in full, and a comparison of two."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased, joinedload

from archmodel.quantities import quantities_of
from archmodel.tables.base import LARGEST_INTEGER
from archmodel.tables.entities import Entity
from archmodel.tables.runs import CellResult, EntityResult, JointResult, Run, StructureResult
from archmodel.tables.structures import Structure, structure_kinds
from archmodel.tables.surveys import Simplification
from ground.errors import UsageError

ERRORS = tuple(name for name in quantities_of("run") if name in Run.__table__.c)
"""Columns of a run that say how far it can be trusted [-]."""

JOINT_VALUES = (
    "width", "force_normal", "force_shear", "pressure_max", "kern", "friction_use", "opening", "sliding",
)  # fmt: skip
"""Values of a joint that descriptions show."""

_SHOWN = 12
"""Numbers that an error lists."""


def list_runs(session: Session) -> list[dict[str, object]]:
    """List all runs, oldest first.

    Of each: run, scene, stored_at, outcome, cautions (without which it misleads), stones, contacts, the error
    measures, wall [s].
    """
    stones = select(func.count()).where(EntityResult.run_id == Run.id).correlate(Run).scalar_subquery()
    statement = select(Run, stones).options(joinedload(Run.entry)).order_by(Run.id)
    return [
        {
            "run": run.id,
            "scene": run.scene,
            "stored_at": run.entry.recorded_at.isoformat(timespec="seconds"),
            "outcome": run.outcome,
            "cautions": run.summary.get("cautions", []),
            "stones": count,
            "contacts": run.contacts,
            **{name: getattr(run, name) for name in ERRORS},
            "wall": run.wall,
        }
        for run, count in session.execute(statement)
    ]


def describe_run(session: Session, number: int, count: int = 5) -> dict[str, Any]:
    """Describe one run in full, in plain values that JSON can hold.

    Parameters
    ----------
    session : any
    number : of the run
    count : how many of the worst stones and joints

    Returns
    -------
    dict
        as in `list_runs`, and: steps, simulated [s], fidelities, headline, cautions, peaks (largest values of the run),
        stages of building as in summary.json, as_of, author, versions, settings, scene_text;
        of a run of disks: measures by name, cells at the last instant;
        simplification (mode; how many stones of each shape, and how many outside of the survey's tolerance; the largest
        displacement of a corner and its stone; None where solids are not kept),
        largest_stresses (by stone), and joints by what is worst of them: largest_openings, least_centred
        (outside of the kern), most_used_friction; SI units

    Raises
    ------
    UsageError
        if there is no such run; names those that there are
    """
    run, stones = _run(session, number), _fidelities(session, number)
    return {
        "run": run.id,
        "scene": run.scene,
        "stored_at": run.entry.recorded_at.isoformat(timespec="seconds"),
        "outcome": run.outcome,
        "cautions": run.summary.get("cautions", []),
        "stones": sum(stones.values()),
        "fidelities": stones,
        "contacts": run.contacts,
        "steps": run.steps,
        "simulated": run.simulated,
        "wall": run.wall,
        "errors": {name: getattr(run, name) for name in ERRORS},
        "headline": run.summary.get("headline"),
        "peaks": _peaks(run.summary),
        "stages": run.summary.get("stages", []),
        "measures": run.summary.get("measures", {}),
        "cells": _cells(session, number),
        "as_of": run.as_of_id,
        "author": run.entry.author,
        "versions": dict(run.versions),
        "settings": dict(run.entry.settings),
        "simplification": _simplification(session, number),
        "largest_stresses": _stresses(session, number, count),
        "largest_openings": _joints(session, number, JointResult.opening, 0.0, count),
        "least_centred": _joints(session, number, JointResult.kern, 1.0, count),
        "most_used_friction": _joints(session, number, JointResult.friction_use, 0.0, count),
        "structures": _structures(session, number, count),
        "scene_text": run.scene_text,
    }


def _fidelities(session: Session, number: int) -> dict[str, int]:
    """Return the number of stones of each fidelity in a run."""
    counted = session.execute(
        select(EntityResult.fidelity, func.count().label("stones"))
        .where(EntityResult.run_id == number)
        .group_by(EntityResult.fidelity)
        .order_by(EntityResult.fidelity)
    )
    return {row.fidelity: row.stones for row in counted}


def compare_runs(session: Session, number: int, against: int, count: int = 10) -> dict[str, Any]:
    """Compare run `number` with run `against`.

    Returns
    -------
    dict
        run, against, outcomes (of both), settings (those that differ: [of the run, of the other]), only_in_run and
        only_against (how many stones), stresses and displacements (the stones that changed most, with the value in
        both runs and the difference)
    """
    one, other = _run(session, number), _run(session, against)
    mine, theirs = _flat(one.entry.settings), _flat(other.entry.settings)
    return {
        "run": one.id,
        "against": other.id,
        "outcomes": [one.outcome, other.outcome],
        "settings": {
            name: [mine.get(name), theirs.get(name)]
            for name in sorted({*mine, *theirs})
            if mine.get(name) != theirs.get(name)
        },
        "only_in_run": _alone(session, number, against),
        "only_against": _alone(session, against, number),
        "stresses": _changes(session, number, against, "von_mises_p99", count),
        "displacements": _changes(session, number, against, "displacement_max", count),
        "structures": _structure_changes(session, number, against, count),
    }


def _run(session: Session, number: int) -> Run:
    """Return the run of a number; an error that names the latest if there is none."""
    found = None
    if 0 < number <= LARGEST_INTEGER:
        found = session.get(Run, number, options=[joinedload(Run.entry)])
    if found is not None:
        return found
    known = session.scalars(select(Run.id).order_by(Run.id.desc()).limit(_SHOWN + 1)).all()
    if not known:
        raise UsageError(
            f"there is no run {number}", remedy="there is none yet; simulate with moma run SCENE.toml"
        )
    named = ", ".join(map(str, sorted(known[:_SHOWN])))
    earlier = " and earlier ones" if len(known) > _SHOWN else ""
    raise UsageError(f"there is no run {number}", remedy=f"there are {named}{earlier}")


def _stresses(session: Session, run: int, count: int) -> list[dict[str, object]]:
    """List the stones with the largest Von Mises stress that 1 % of their volume exceeds [Pa].

    Runs without it are ordered by the largest, which is that of a corner and depends on the mesh.
    """
    order = func.coalesce(EntityResult.von_mises_p99, EntityResult.von_mises_max)
    # the largest first, all else of them then: what is sorted should be short
    largest = (
        select(EntityResult.entity_id)
        .where(EntityResult.run_id == run, EntityResult.von_mises_max.is_not(None))
        .order_by(order.desc(), EntityResult.entity_id)
        .limit(count)
        .subquery()
    )
    statement = (
        select(
            Entity.code,
            Entity.kind,
            EntityResult.von_mises_p99,
            EntityResult.von_mises_mean,
            EntityResult.von_mises_max,
        )
        .join(EntityResult.entity)
        .join(largest, largest.c.entity_id == Entity.id)
        .where(EntityResult.run_id == run)
        .order_by(order.desc(), Entity.id)
    )
    return [dict(row) for row in session.execute(statement).mappings()]


def _peaks(summary: Mapping[str, Any]) -> list[dict[str, object]]:
    """List the largest values of the run: peak, value and value at the end, unit, time [s], stone or joint."""
    return [
        {"peak": name.replace("_", " "), **one, "stones": " – ".join(one["stones"]) or None}
        for name, one in (summary.get("peaks") or {}).items()
        if one is not None
    ]


def _cells(session: Session, run: int) -> list[dict[str, object]]:
    """List the cells of a run of disks at its last instant, in the order of their names."""
    last = select(func.max(CellResult.step)).where(CellResult.run_id == run).scalar_subquery()
    statement = (
        select(*(column for column in CellResult.__table__.columns if column.name != "run_id"))
        .where(CellResult.run_id == run, CellResult.step == last)
        .order_by(CellResult.cell)
    )
    return [dict(row) for row in session.execute(statement).mappings()]


def _simplification(session: Session, run: int) -> dict[str, object] | None:
    """Describe the simplification of the stones' solids."""
    of_run = Simplification.run_id == run
    farthest = session.execute(
        select(Entity.code, Simplification.displacement_max, Simplification.mode)
        .join(Entity, Entity.id == Simplification.entity_id)
        .where(of_run)
        .order_by(Simplification.displacement_max.desc(), Entity.id)
        .limit(1)
    ).first()
    if farthest is None:
        return None
    shape, count = Simplification.shape, func.count().label("stones")
    shapes = session.execute(
        select(shape, count).where(of_run, shape.is_not(None)).group_by(shape).order_by(shape)
    )
    outside = select(func.count()).where(of_run, Simplification.within_tolerance.is_(False))
    return {
        "mode": farthest.mode,
        "shapes": {row.shape: row.stones for row in shapes},
        "outside_tolerance": session.scalar(outside),
        "displacement_max": farthest.displacement_max,
        "farthest": farthest.code,
    }


def _joints(
    session: Session, run: int, worst: InstrumentedAttribute[Any], above: float, count: int
) -> list[dict[str, object]]:
    """List the joints with the largest of one value, among those above a bound."""
    chosen = (
        select(JointResult.number)
        .where(JointResult.run_id == run, worst > above)
        .order_by(worst.desc(), JointResult.number)
        .limit(count)
        .subquery()
    )
    first, second = aliased(Entity), aliased(Entity)
    statement = (
        select(
            first.code.label("first"),
            second.code.label("second"),
            *(getattr(JointResult, name) for name in JOINT_VALUES),
        )
        .join(chosen, chosen.c.number == JointResult.number)
        .join(first, JointResult.first_id == first.id)
        .join(second, JointResult.second_id == second.id)
        .where(JointResult.run_id == run)
        .order_by(worst.desc(), JointResult.number)
    )
    return [dict(row) for row in session.execute(statement).mappings()]


def _values_of_structures(session: Session, run: int) -> dict[str, dict[str, float]]:
    """Return the results of the structures of a run by code, in the order of recording."""
    statement = (
        select(Structure.code, StructureResult.values)
        .join(StructureResult.structure)
        .where(StructureResult.run_id == run)
        .order_by(Structure.id)
    )
    return {code: dict(values) for code, values in session.execute(statement)}


def _structures(session: Session, run: int, count: int) -> list[dict[str, object]]:
    """List for each result of structures those with the largest values."""
    results, rows = _values_of_structures(session, run), list[dict[str, object]]()
    for name, quantity in quantities_of(*structure_kinds()).items():
        known = {code: values[name] for code, values in results.items() if name in values}
        rows += [
            {"structure": code, "result": name, "value": known[code], "unit": quantity.unit}
            for code in sorted(known, key=known.__getitem__, reverse=True)[:count]
        ]
    return rows


def _structure_changes(session: Session, run: int, other: int, count: int) -> list[dict[str, object]]:
    """List for each result of structures those that changed most, largest change first."""
    now, then = _values_of_structures(session, run), _values_of_structures(session, other)
    rows: list[dict[str, object]] = []
    for name, quantity in quantities_of(*structure_kinds()).items():
        both = [code for code in now if name in now[code] and name in then.get(code, {})]
        changes = {code: now[code][name] - then[code][name] for code in both}
        sizes = {code: abs(change) for code, change in changes.items()}
        rows += [
            {
                "structure": code,
                "result": name,
                "run": now[code][name],
                "against": then[code][name],
                "change": changes[code],
                "unit": quantity.unit,
            }
            for code in sorted(changes, key=sizes.__getitem__, reverse=True)[:count]
            if changes[code]
        ]
    return rows


def _flat(settings: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    """Flatten nested settings to {"time.step": …}."""
    flat: dict[str, object] = {}
    for name, value in settings.items():
        inner = _flat(value, f"{prefix}{name}.") if isinstance(value, Mapping) else {f"{prefix}{name}": value}
        flat.update(inner)
    return flat


def _alone(session: Session, run: int, other: int) -> int:
    """Count the stones that are in one run and not in the other."""
    there = select(EntityResult.entity_id).where(EntityResult.run_id == other)
    alone = select(func.count()).where(EntityResult.run_id == run, EntityResult.entity_id.not_in(there))
    return int(session.scalar(alone) or 0)


def _changes(session: Session, run: int, other: int, value: str, count: int) -> list[dict[str, object]]:
    """List the stones whose value changed most, largest change first."""
    mine, theirs = aliased(EntityResult), aliased(EntityResult)
    now, then = getattr(mine, value), getattr(theirs, value)
    statement = (
        select(
            Entity.code,
            now.label("run"),
            then.label("against"),
            (now - then).label("change"),
        )
        .join(mine, mine.entity_id == Entity.id)
        .join(theirs, theirs.entity_id == Entity.id)
        .where(mine.run_id == run, theirs.run_id == other, now != then)
        .order_by(func.abs(now - then).desc(), Entity.id)
        .limit(count)
    )
    return [dict(row) for row in session.execute(statement).mappings()]
