"""Phases of units and stones by code, for their order in time."""

from collections.abc import Mapping, Sequence

from sqlalchemy import FromClause, select
from sqlalchemy.orm import Session

from archmodel.query.inherited import statements_of_structures
from archmodel.query.scope import Context, Scope
from archmodel.store.bulk import batches
from archmodel.store.revisions import table_of
from archmodel.stratigraphy.dates import Dated
from archmodel.tables.base import Base
from archmodel.tables.entries import held_at
from archmodel.tables.knowledge import OfPhase, Phase, Statement
from archmodel.tables.opinions import preference, rule_of
from archmodel.tables.structures import Structure


def load_dates(session: Session, codes: Sequence[str]) -> Mapping[str, Dated]:
    """Return the phases of units and stones, by the opinion that holds: their own, or of the nearest structure."""
    wanted = set(codes)
    dated: dict[str, Dated] = {}
    by_structure = _phases_of_structures(session)
    for number, code in session.execute(select(Structure.id, Structure.code).where(held_at(Structure))):
        if code in wanted and number in by_structure:
            dated[code] = by_structure[number]
    rest = sorted(wanted - dated.keys())
    for batch in batches(rest):
        scope = Scope(Context(session))
        phase = scope.phase().c
        stones = scope.joined(select(scope.entity.c.code, phase.name, phase.begins, phase.ends))
        rows = session.execute(stones.where(scope.entity.c.code.in_(batch), phase.name.is_not(None)))
        dated |= {code: Dated(*values) for code, *values in rows}
    return dated


def _alias(cls: type[Base]) -> FromClause:
    return table_of(cls).alias()


def _phases_of_structures(session: Session) -> dict[int, Dated]:
    """Return the phase of each structure, from the first opinion by distance and rule."""
    of_structures = statements_of_structures(_alias, OfPhase.__kind__)
    table, decisions = _alias(Statement), _alias(Statement)
    rows = (
        select(of_structures.c.structure_id, Phase.name, Phase.begins, Phase.ends)
        .select_from(of_structures)
        .join(table, table.c.id == of_structures.c.statement_id)
        .join(Phase, Phase.id == table.c.phase_id)
        .order_by(of_structures.c.distance, *preference(rule_of(session, OfPhase.__kind__), table, decisions))
    )
    phases: dict[int, Dated] = {}
    for number, *values in session.execute(rows):
        phases.setdefault(number, Dated(*values))
    return phases
