"""Query function that searches all texts."""

from collections.abc import Callable
from typing import Any

from sqlalchemy import ColumnElement, FromClause, Select, String, cast, or_, select

from archmodel.query.columns import DOCUMENTING
from archmodel.query.functions.usages import Ask, Condition, tokens
from archmodel.query.grammar import Call
from archmodel.query.inherited import entities_with_statement, held
from archmodel.query.scope import Scope
from archmodel.tables.knowledge import Document, Material, Phase
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure
from archmodel.tables.surveys import Measurement

Has = Callable[..., Condition]
"""Test for the words in any of some columns."""


def text(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for words in the texts on the entity, its structures, and the documents that treat them."""
    (words,) = tokens(call, 1)
    context = scope.context

    def has(*columns: ColumnElement[str]) -> Condition:
        """Return the condition that the words stand in a column."""
        return or_(*(column.icontains(words.text, autoescape=True) for column in columns))

    documents, phases, materials = (
        context.alias(entity_class) for entity_class in (Document, Phase, Material)
    )
    named = {
        "document_id": select(documents.c.id).where(
            held(documents), has(documents.c.title, documents.c.code, documents.c.place, documents.c.author)
        ),
        "phase_id": select(phases.c.id).where(held(phases), has(phases.c.name, phases.c.description)),
        "material_id": select(materials.c.id).where(
            held(materials), has(materials.c.name, materials.c.description)
        ),
    }

    def wanted(statement: FromClause) -> list[Condition]:
        """Return the condition that the words stand in a statement, or in what it cites."""
        condition = has(
            statement.c.text,
            statement.c.place,
            statement.c.locator,
            statement.c.sign,
            statement.c.type,
            statement.c.key,
        )
        return [or_(condition, *(statement.c[column].in_(numbers) for column, numbers in named.items()))]

    of_structures = context.statements_of_structures(*DOCUMENTING)
    stated = entities_with_statement(context.alias, of_structures, wanted, *DOCUMENTING)
    measured = context.alias(Measurement)
    noted = select(measured.c.entity_id).where(held(measured), has(cast(measured.c.notes, String)))
    number = scope.entity.c.id
    return or_(number.in_(stated), number.in_(noted), number.in_(_in_titled(scope, has)))


def _in_titled(scope: Scope, has: Has) -> Select[Any]:
    """Select the members of structures whose title or code has the words, and those of their parts."""
    context = scope.context
    whole, child, member = context.alias(Structure), context.alias(Structure), context.alias(Membership)
    parts = select(whole.c.id).where(held(whole), has(whole.c.title, whole.c.code)).cte(recursive=True)
    parts = parts.union(
        select(child.c.id).join_from(parts, child, child.c.parent_id == parts.c.id).where(held(child))
    )
    return select(member.c.entity_id).where(held(member), member.c.structure_id.in_(select(parts.c.id)))
