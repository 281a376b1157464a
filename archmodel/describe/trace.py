"""Trace from a result of a stone back to the points that were measured."""

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session, joinedload

from archmodel.store.find_by_code import no_such_code
from archmodel.tables.base import LARGEST_INTEGER
from archmodel.tables.entities import Entity
from archmodel.tables.entries import held_at
from archmodel.tables.runs import EntityResult, Run
from archmodel.tables.surveys import Measurement, Simplification
from ground.errors import UsageError


@dataclass(frozen=True)
class Trace:
    """Evidence behind a result of one stone, step by step.

    Attributes
    ----------
    entity : the stone
    result : what the run computed for it, e.g. ``result.von_mises_max`` [Pa]
    run : the simulation, with its entry
    simplification : the solid that stood for it; None if the run kept none
    measurement : what was held to be measured when the run read the stone: ``points`` [m], ``residuals`` [m],
        the plane, and the survey; None if it was never measured
    """

    entity: Entity
    result: EntityResult
    run: Run
    simplification: Simplification | None
    measurement: Measurement | None

    @property
    def place(self) -> str | None:
        """``file:line`` of the survey where the stone's record begins."""
        return None if self.measurement is None else f"{self.measurement.survey.path}:{self.measurement.line}"

    @property
    def is_outdated(self) -> bool:
        """True if the stone has been measured again, or its depth corrected, since the run read it."""
        return self.measurement is not None and self.measurement.superseded_id is not None


def trace(session: Session, code: str, run: int | None = None) -> Trace:
    """Trace a result of the stone back to its measurement.

    Parameters
    ----------
    session : the values stay readable when it is closed
    code : of the stone
    run : number of the run; None: the latest that holds the stone

    Raises
    ------
    UsageError
        if there is no such stone, or it was in no such run
    """
    entity = session.scalar(select(Entity).where(Entity.code == code)) if code.isprintable() else None
    if entity is None:
        raise no_such_code(session, code, Entity.code)
    results = select(EntityResult).where(EntityResult.entity_id == entity.id)
    # no run has a number that the column cannot hold
    wanted = (
        results
        if run is None
        else results.where(EntityResult.run_id == (run if abs(run) <= LARGEST_INTEGER else 0))
    )
    result = session.scalar(
        wanted.options(joinedload(EntityResult.run).joinedload(Run.entry))
        .order_by(EntityResult.run_id.desc())
        .limit(1)
    )
    if result is None:
        raise _not_run(session, entity, run)
    return Trace(
        entity=entity,
        result=result,
        run=result.run,
        simplification=session.get(Simplification, (entity.id, result.run_id)),
        measurement=session.scalar(_measurement(entity, result.run)),
    )


def _measurement(entity: Entity, run: Run) -> Select[Any]:
    """Return the measurement that held when the run read the stone."""
    as_of = run.entry_id if run.as_of_id is None else run.as_of_id
    return (
        select(Measurement)
        .where(Measurement.entity_id == entity.id, held_at(Measurement, as_of))
        .options(joinedload(Measurement.survey))
        .order_by(Measurement.id.desc())
        .limit(1)
    )


def _not_run(session: Session, entity: Entity, run: int | None) -> UsageError:
    """Make the error for a stone without the requested result."""
    runs = session.scalars(
        select(EntityResult.run_id)
        .where(EntityResult.entity_id == entity.id)
        .order_by(EntityResult.run_id.desc())
        .limit(12)
    ).all()
    if not runs:
        return UsageError(
            f"stone {entity.code} was in no run", remedy="simulate it first: moma run SCENE.toml"
        )
    return UsageError(
        f"stone {entity.code} was not in run {run}",
        remedy=f"it was in {', '.join(map(str, reversed(runs)))}",
    )
