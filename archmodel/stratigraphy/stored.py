"""Stratigraphy as the database has it: relations by code, units, and the dates of their phases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import FromClause, func, select
from sqlalchemy.orm import Session, aliased

from archmodel.query.api import find_rows
from archmodel.query.inherited import statements_of_structures
from archmodel.store.bulk import batches
from archmodel.store.revisions import table_of
from archmodel.stratigraphy.order import Link
from archmodel.tables.base import Base
from archmodel.tables.entities import Entity
from archmodel.tables.entries import held_at
from archmodel.tables.knowledge import OfPhase, Phase, Statement
from archmodel.tables.opinions import preference, rule_of
from archmodel.tables.relations import Membership
from archmodel.tables.stratigraphy import Stratigraphy
from archmodel.tables.structures import StratigraphicUnit, Structure

__all__ = ["Dated", "load_dates", "load_links", "load_stones", "load_units"]


@dataclass(frozen=True)
class Dated:
    """Phase of a unit.

    Attributes
    ----------
    phase : its name
    begins, ends : years; None if not known
    """

    phase: str
    begins: int | None
    ends: int | None

    def __str__(self) -> str:
        years = "–".join("?" if year is None else str(year) for year in (self.begins, self.ends))
        return f"phase {self.phase}" if years == "?–?" else f"phase {self.phase}, {years}"


def load_links(session: Session, author: str | None = None) -> list[Link]:
    """Return the relations that are stated now, in the order of recording.

    Parameters
    ----------
    author : only those that this author states; None: all
    """
    session.flush()
    stones, targets = aliased(Entity), aliased(Entity)
    units, objects = aliased(Structure), aliased(Structure)
    rows = (
        select(
            func.coalesce(units.code, stones.code),
            Stratigraphy.relation,
            func.coalesce(objects.code, targets.code),
            Stratigraphy.author,
        )
        .outerjoin(units, units.id == Stratigraphy.structure_id)
        .outerjoin(stones, stones.id == Stratigraphy.entity_id)
        .outerjoin(objects, objects.id == Stratigraphy.object_structure_id)
        .outerjoin(targets, targets.id == Stratigraphy.object_entity_id)
        .where(Stratigraphy.superseded_id.is_(None))
        .order_by(Stratigraphy.id)
    )
    if author is not None:
        rows = rows.where(Stratigraphy.author == author)
    return [Link(str(row[0]), row[1] or "", str(row[2]), row[3]) for row in session.execute(rows)]


def load_units(session: Session) -> list[str]:
    """Return the codes of the stratigraphic units, in the order of recording."""
    units = select(Structure.code).where(
        Structure.kind == StratigraphicUnit.__mapper__.polymorphic_identity, held_at(Structure)
    )
    return list(session.scalars(units.order_by(Structure.id)))


def load_dates(session: Session, codes: Sequence[str]) -> Mapping[str, Dated]:
    """Return the phases of units and stones, by the opinion that holds: their own, or of the nearest structure."""
    wanted = set(codes)
    dated: dict[str, Dated] = {}
    by_structure = _phases_of_structures(session)
    for number, code in session.execute(select(Structure.id, Structure.code).where(held_at(Structure))):
        if code in wanted and number in by_structure:
            dated[code] = by_structure[number]
    rest = sorted(wanted - dated.keys())
    stones = {
        code
        for batch in batches(rest)
        for code in session.scalars(select(Entity.code).where(Entity.code.in_(batch)))
    }
    if stones:
        dated |= _phases_of_stones(session, stones)
    return dated


def load_stones(session: Session, codes: Sequence[str]) -> Mapping[str, tuple[str, ...]]:
    """Return the codes of the members of each unit, those of its parts too."""
    wanted, parents, names = set(codes), dict[int, int | None](), dict[int, str]()
    structures = select(Structure.id, Structure.parent_id, Structure.code).where(held_at(Structure))
    for number, parent, code in session.execute(structures):
        parents[number], names[number] = parent, code
    stones: dict[str, dict[str, None]] = {}
    rows = (
        select(Membership.structure_id, Entity.code)
        .join(Membership.entity)
        .where(held_at(Membership))
        .order_by(Entity.id)
    )
    for number, stone in session.execute(rows):
        step: int | None = number
        while step is not None and step in names:
            if names[step] in wanted:
                stones.setdefault(names[step], {})[stone] = None
            step = parents[step]
    return {code: tuple(members) for code, members in stones.items()}


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


def _phases_of_stones(session: Session, codes: set[str]) -> dict[str, Dated]:
    rows = find_rows(session, "entity", columns=["code", "phase", "phase_begins", "phase_ends"])
    dated: dict[str, Dated] = {}
    for row in rows:
        code, phase, begins, ends = row.values()
        if code in codes and phase is not None:
            years = [year if isinstance(year, int) else None for year in (begins, ends)]
            dated[str(code)] = Dated(str(phase), *years)
    return dated
