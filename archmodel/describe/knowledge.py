"""Knowledge of an entity or a structure: its own, and that of the structures to which it belongs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import inspect, select
from sqlalchemy.orm import Session, aliased, joinedload

from archmodel.assertions.plain_values import entry_values, statement_values
from archmodel.tables.entries import held_at
from archmodel.tables.knowledge import Decision, MadeOf, Material, MaterialProperty, OfPhase, Phase, Statement
from archmodel.tables.opinions import DISPUTABLE, OpinionRule, preference, rule_of
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure

Values = dict[str, object]

_LISTS: Mapping[str, str] = {
    "marks": "mason_mark",
    "observations": "observation",
    "depth_evidence": "depth",
    "documents": "reference",
    "notes": "note",
    "stratigraphy": "stratigraphy",
}
"""Statements that add up: under what name they are listed, and of which kind they are."""


@dataclass(frozen=True)
class Owner:
    """Structure whose statements hold for everything within it.

    Attributes
    ----------
    structure : the structure
    distance : 1 for a structure of which it is a member, 2 for what that is a part of
    """

    structure: Structure
    distance: int


def memberships(session: Session, entity: int) -> list[Membership]:
    """Select the memberships of an entity."""
    statement = (
        select(Membership)
        .where(Membership.entity_id == entity, held_at(Membership))
        .options(joinedload(Membership.structure), joinedload(Membership.entry))
        .order_by(Membership.id)
    )
    return list(session.scalars(statement))


def owners_of(session: Session, members: Iterable[Membership]) -> list[Owner]:
    """List the structures to which a stone belongs, nearest first, each once."""
    owners: dict[int, Owner] = {}
    for membership in members:
        _ascend(session, membership.structure_id, owners)
    return sorted(owners.values(), key=lambda owner: owner.distance)


def owners_of_structure(session: Session, parent: int | None) -> list[Owner]:
    """List the structures of which a structure is a part, nearest first."""
    owners: dict[int, Owner] = {}
    _ascend(session, parent, owners)
    return list(owners.values())


def _ascend(session: Session, number: int | None, owners: dict[int, Owner]) -> None:
    """Add a structure and the structures that contain it; entries at no greater distance stay."""
    distance = 1
    while number is not None and (number not in owners or owners[number].distance > distance):
        structure = session.get_one(Structure, number)
        owners[number] = Owner(structure, distance)
        number, distance = structure.parent_id, distance + 1


def ancestors(session: Session, number: int) -> dict[int, str]:
    """Return the codes of a structure and of those that contain it, by number."""
    owners: dict[int, Owner] = {}
    _ascend(session, number, owners)
    return {key: owner.structure.code for key, owner in owners.items()}


def knowledge(session: Session, column: str, number: int, owners: Sequence[Owner]) -> Values:
    """Describe material, phase, marks, observations and so on of one entity or structure.

    Parameters
    ----------
    column : "entity_id" or "structure_id"
    number : its own
    owners : the structures that it belongs to; a statement about one of those names it
    """
    statements = _statements(session, column, [number])
    inherited = _statements(session, "structure_id", [owner.structure.id for owner in owners])
    owner_of = {owner.structure.id: owner for owner in owners}
    ranked = [(0, statement) for statement in statements]
    ranked += sorted(
        ((owner_of[_of(statement)].distance, statement) for statement in inherited), key=lambda pair: pair[0]
    )
    values: Values = {
        "material": _holding(session, ranked, MadeOf, owner_of),
        "phase": _holding(session, ranked, OfPhase, owner_of),
    }
    for name, kind in _LISTS.items():
        values[name] = [_told(statement, owner_of) for _, statement in ranked if statement.kind == kind]
    return values


def _of(statement: Statement) -> int:
    return statement.structure_id or 0


def _statements(session: Session, column: str, numbers: Sequence[int]) -> list[Statement]:
    if not numbers:
        return []
    statement = (
        select(Statement)
        .where(getattr(Statement, column).in_(numbers), held_at(Statement))
        .options(joinedload(Statement.document), joinedload(Statement.entry))
        .order_by(Statement.id)
    )
    return list(session.scalars(statement))


def _told(statement: Statement, owners: Mapping[int, Owner]) -> Values:
    """Describe a statement with its provenance, and its structure if that is another one."""
    values = statement_values(statement)
    owner = owners.get(_of(statement))
    if owner is not None:
        values["said_of"] = owner.structure.code
    return values | entry_values(statement.entry)


def _holding(
    session: Session,
    ranked: Sequence[tuple[int, Statement]],
    cls: type[MadeOf] | type[OfPhase],
    owners: Mapping[int, Owner],
) -> Values | None:
    """Describe the opinion that holds, of its own or of the nearest structure, and those beside it."""
    opinions = [(distance, opinion) for distance, opinion in ranked if isinstance(opinion, cls)]
    if not opinions:
        return None
    nearest = [opinion for distance, opinion in opinions if distance == opinions[0][0]]
    rule = rule_of(session, cls.__kind__) if len(nearest) > 1 else None
    preferred: Any = nearest[0] if rule is None else _preferred(session, rule, nearest)
    about = (
        _material(session, preferred.material) if isinstance(preferred, MadeOf) else _phase(preferred.phase)
    )
    rest = {
        name: value for name, value in _told(preferred, owners).items() if name not in ("material", "phase")
    }
    if rule is None:
        return about | rest
    others = [_opinion(opinion, owners) for opinion in nearest if opinion is not preferred]
    column = DISPUTABLE[cls.__kind__]
    disputed = any(getattr(opinion, column) != getattr(preferred, column) for opinion in nearest)
    return about | rest | {"disputed": disputed, "rule": _rule(session, preferred, rule), "others": others}


def _preferred(session: Session, rule: OpinionRule, opinions: Sequence[Statement]) -> Statement:
    """Return the opinion of several at one distance that holds."""
    table, decisions = aliased(Statement), aliased(Statement)
    order = preference(rule, inspect(table).selectable, inspect(decisions).selectable)
    first = (
        select(table.id).where(table.id.in_([opinion.id for opinion in opinions])).order_by(*order).limit(1)
    )
    number = session.scalar(first)
    return next(opinion for opinion in opinions if opinion.id == number)


def _opinion(statement: Statement, owners: Mapping[int, Owner]) -> Values:
    """Describe an opinion beside the one that holds, with its author and date."""
    seen = statement.stated_on
    author = {"author": statement.author, "stated_on": None if seen is None else seen.isoformat()}
    return _told(statement, owners) | author


def _rule(session: Session, opinion: Statement, rule: OpinionRule) -> str:
    """Return in words why an opinion holds: a decision, or the rule."""
    decision = session.scalar(select(Decision).where(Decision.chosen_id == opinion.id, held_at(Decision)))
    if decision is not None:
        return f"decided by {decision.author or 'an unnamed author'} in entry {decision.entry_id}"
    return {
        "latest": "the latest opinion holds",
        "certainty": "the most certain opinion holds",
        "author": f"the authors count in the order {', '.join(rule.authors)}",
    }[rule.rule]


def _material(session: Session, row: Material | None) -> Values:
    if row is None:
        return {}
    properties = session.scalars(
        select(MaterialProperty)
        .where(MaterialProperty.material_id == row.id, held_at(MaterialProperty))
        .order_by(MaterialProperty.id)
    )
    return {
        "name": row.name,
        "description": row.description,
        "properties": {
            property_row.name: {
                "value": property_row.value,
                "sigma": property_row.sigma,
                "unit": property_row.unit,
                "source": property_row.source,
            }
            for property_row in properties
        },
    }


def _phase(row: Phase | None) -> Values:
    if row is None:
        return {}
    return {"name": row.name, "begins": row.begins, "ends": row.ends, "description": row.description}
