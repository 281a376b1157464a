"""Arches in the database: found among the voussoirs that touch, kept as structures."""

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import count
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session, aliased

from archmodel.relations.arch_rings import ArchJoint, ArchRings, arches_among
from archmodel.relations.zones_and_courses import StructurePart
from archmodel.store.stone_arrays import stone_columns
from archmodel.tables.entities import Entity, Springer, Voussoir
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.relations import Membership, Relation
from archmodel.tables.structures import Structure, structure_kind_named


def find_arches(session: Session) -> list[ArchRings]:
    """Find the arches that the relations of the voussoirs form, by the smallest number of their stones."""
    stones = stone_columns(session, Entity.kind.in_(kinds_below(Voussoir)))
    if len(stones) == 0:
        return []
    place = {number: i for i, number in enumerate(stones.ids.tolist())}
    springers = kinds_below(Springer)
    joints = (
        ArchJoint(place[first], place[two], np.array(normal))
        for first, two, *normal in _touching_voussoirs(session)
    )
    return arches_among(stones, [kind in springers for kind in stones.kinds], joints)


def _touching_voussoirs(session: Session) -> Iterable[Any]:
    """Select subject, object and normal of the joints between voussoirs."""
    subject, neighbour = aliased(Entity), aliased(Entity)
    names = kinds_below(Voussoir)
    return session.execute(
        select(Relation.subject_id, Relation.object_id, Relation.nx, Relation.ny, Relation.nz)
        .join(subject, subject.id == Relation.subject_id)
        .join(neighbour, neighbour.id == Relation.object_id)
        .where(
            subject.kind.in_(names),
            neighbour.kind.in_(names),
            Relation.kind.in_(("rests_on", "beside")),
            Relation.superseded_id.is_(None),
            Relation.nx.is_not(None),
        )
        .order_by(Relation.subject_id, Relation.object_id)
    )


def arch_parts(session: Session, arches: Sequence[ArchRings]) -> list[StructurePart]:
    """Return the arches as structures; one that shares most of its stones with a stored arch keeps its code."""
    number = {stone.entity: i for i, arch in enumerate(arches) for stone in arch.stones}
    votes: Counter[tuple[int, str]] = Counter()
    query = (
        select(Membership.entity_id, Structure.code)
        .join(Structure, Structure.id == Membership.structure_id)
        .where(
            Structure.kind.in_(kinds_below(structure_kind_named("arch"))),
            Structure.superseded_id.is_(None),
            Membership.superseded_id.is_(None),
            Membership.declared.is_(False),
        )
    )
    for entity, code in session.execute(query):
        if entity in number:
            votes[number[entity], code] += 1
    codes: dict[int, str] = {}
    for (i, code), _ in sorted(votes.items(), key=lambda vote: (-vote[1], vote[0])):
        if i not in codes and code not in codes.values():
            codes[i] = code
    taken = {*codes.values(), *session.scalars(select(Structure.code).where(Structure.code.like("arch %")))}
    fresh = (code for k in count(1) if (code := f"arch {k}") not in taken)
    return [
        StructurePart(
            "arch",
            codes[i] if i in codes else next(fresh),
            None,
            None,
            tuple(stone.entity for stone in arch.stones),
            tuple(stone.rank for stone in arch.stones),
        )
        for i, arch in enumerate(arches)
    ]
