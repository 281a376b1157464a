"""Knowledge of an entity or a structure: its own, and that of the structures to which it belongs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload

from archmodel.assertions.plain_values import entry_values, statement_values
from archmodel.describe.as_of import version_at
from archmodel.tables.entries import held_at
from archmodel.tables.knowledge import MadeOf, Material, MaterialProperty, OfPhase, Phase, Statement
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure

__all__ = ["Owner", "knowledge", "memberships", "owners_of", "owners_of_structure"]

Values = dict[str, object]

_LISTS: Mapping[str, str] = {
    "marks": "mason_mark",
    "observations": "observation",
    "depth_evidence": "depth",
    "documents": "reference",
    "notes": "note",
}
"""Statements that add up: under what name they are listed, and of which kind they are."""


@dataclass(frozen=True)
class Owner:
    """Structure whose statements hold for everything within it.

    Attributes
    ----------
    structure : as it was at the entry asked for
    number : that statements refer to
    distance : 1 for a structure of which it is a member, 2 for what that is a part of
    """

    structure: Structure
    number: int
    distance: int


def memberships(session: Session, entity: int, at: int | None) -> list[Membership]:
    """Select the memberships of an entity."""
    statement = (
        select(Membership)
        .where(Membership.entity_id == entity, held_at(Membership, at))
        .options(joinedload(Membership.structure), joinedload(Membership.entry))
        .order_by(Membership.id)
    )
    return list(session.scalars(statement))


def owners_of(session: Session, members: Iterable[Membership], at: int | None) -> list[Owner]:
    """List the structures to which a stone belongs, nearest first, each once."""
    owners: dict[int, Owner] = {}
    for membership in members:
        _ascend(session, membership.structure_id, 1, at, owners)
    return sorted(owners.values(), key=lambda one: one.distance)


def owners_of_structure(session: Session, parent: int | None, at: int | None) -> list[Owner]:
    """List the structures of which a structure is a part, nearest first."""
    owners: dict[int, Owner] = {}
    _ascend(session, parent, 1, at, owners)
    return list(owners.values())


def _ascend(
    session: Session, number: int | None, distance: int, at: int | None, owners: dict[int, Owner]
) -> None:
    """Add a structure and the structures that contain it; entries at no greater distance stay."""
    while number is not None and (number not in owners or owners[number].distance > distance):
        structure = version_at(session, session.get_one(Structure, number), at)
        owners[number] = Owner(structure, number, distance)
        number, distance = structure.parent_id, distance + 1


def knowledge(session: Session, column: str, number: int, owners: Sequence[Owner], at: int | None) -> Values:
    """Describe material, phase, marks, observations and so on of one entity or structure.

    Parameters
    ----------
    column : "entity_id" or "structure_id"
    number : its own
    owners : the structures that it belongs to; what is said of those says so (`phase_or_material_of`)
    at : number of the entry at which it is asked for; None: now
    """
    own = _statements(session, column, [number], at)
    inherited = _statements(session, "structure_id", [owner.number for owner in owners], at)
    far = {owner.number: owner for owner in owners}
    ranked = [(0, one) for one in own]
    ranked += sorted(((far[_of(one)].distance, one) for one in inherited), key=lambda pair: pair[0])
    told: Values = {
        "material": _nearest(session, ranked, MadeOf, far, at),
        "phase": _nearest(session, ranked, OfPhase, far, at),
    }
    for name, kind in _LISTS.items():
        told[name] = [_told(one, far) for _, one in ranked if one.kind == kind]
    return told


def _of(statement: Statement) -> int:
    return statement.structure_id or 0


def _statements(session: Session, column: str, numbers: Sequence[int], at: int | None) -> list[Statement]:
    if not numbers:
        return []
    statement = (
        select(Statement)
        .where(getattr(Statement, column).in_(numbers), held_at(Statement, at))
        .options(joinedload(Statement.document), joinedload(Statement.entry))
        .order_by(Statement.id)
    )
    return list(session.scalars(statement))


def _told(statement: Statement, far: Mapping[int, Owner]) -> Values:
    """Describe a statement with its provenance, and its structure if that is another one."""
    values = statement_values(statement)
    owner = far.get(_of(statement))
    if owner is not None:
        values["said_of"] = owner.structure.code
    return values | entry_values(statement.entry)


def _nearest(
    session: Session,
    ranked: Sequence[tuple[int, Statement]],
    cls: type[MadeOf] | type[OfPhase],
    far: Mapping[int, Owner],
    at: int | None,
) -> Values | None:
    """Return the nearest statements: its own, or those of the nearest structure."""
    said: Any = next((one for _, one in ranked if isinstance(one, cls)), None)
    if said is None:
        return None
    of_material = isinstance(said, MadeOf)
    about = _material(session, said.material, at) if of_material else _phase(session, said.phase, at)
    rest = {name: value for name, value in _told(said, far).items() if name not in ("material", "phase")}
    return about | rest


def _material(session: Session, row: Material | None, at: int | None) -> Values:
    if row is None:
        return {}
    held = version_at(session, row, at)
    properties = session.scalars(
        select(MaterialProperty)
        .where(MaterialProperty.material_id == row.id, held_at(MaterialProperty, at))
        .order_by(MaterialProperty.id)
    )
    return {
        "name": held.name,
        "description": held.description,
        "properties": {
            one.name: {"value": one.value, "sigma": one.sigma, "unit": one.unit, "source": one.source}
            for one in properties
        },
    }


def _phase(session: Session, row: Phase | None, at: int | None) -> Values:
    if row is None:
        return {}
    held = version_at(session, row, at)
    return {
        "name": held.name,
        "begins": held.begins,
        "ends": held.ends,
        "description": held.description,
    }
