"""Members of structures: stones of courses, arches and walls by code."""

from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.tables.entities import Entity
from archmodel.tables.hierarchy import kind_chain, kind_of
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure


@dataclass(frozen=True)
class StructureMembers:
    """A structure with some of its stones.

    Attributes
    ----------
    number : its primary key
    code : of the structure
    kinds : names of its kind and of the more general ones, the most general first
    members : codes of its stones, with those of its parts
    """

    number: int
    code: str
    kinds: tuple[str, ...]
    members: frozenset[str]


def members_of_structures(session: Session, codes: Collection[str]) -> tuple[StructureMembers, ...]:
    """Return the structures that are held now and have any of some stones, in the order of recording."""
    structures = {
        row.id: row
        for row in session.scalars(
            select(Structure).where(Structure.superseded_id.is_(None)).order_by(Structure.id)
        )
    }
    statement = (
        select(Membership.structure_id, Entity.code)
        .join(Entity, Entity.id == Membership.entity_id)
        .where(Membership.superseded_id.is_(None))
    )
    members: dict[int, set[str]] = defaultdict(set)
    wanted = frozenset(codes)
    for number, code in session.execute(statement):
        whole = structures.get(number) if code in wanted else None
        while whole is not None and code not in members[whole.id]:
            members[whole.id].add(code)
            whole = structures.get(whole.parent_id or 0)
    return tuple(
        StructureMembers(
            number,
            row.code,
            tuple(kind_of(kind) for kind in kind_chain(type(row))),
            frozenset(members[number]),
        )
        for number, row in structures.items()
        if members.get(number)
    )
