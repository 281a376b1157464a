"""Statements that hold for an entity: its own, or inherited from the structures of which it is a member.

Statements about a structure hold for its members and for the members of its parts, unless the entity, or a structure
nearer to it, has a statement of its own. Of several at the same distance the one holds that
`archmodel.tables.opinions.preference` puts first.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import (
    CTE,
    ColumnElement,
    CompoundSelect,
    FromClause,
    Select,
    and_,
    case,
    distinct,
    func,
    literal,
    not_,
    or_,
    select,
    union_all,
)

from archmodel.tables.base import Base
from archmodel.tables.knowledge import Statement
from archmodel.tables.opinions import DISPUTABLE, OpinionRule, preference
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure

MAX_LEVELS = 40
"""Deepest structure within structures; ends the search where structures contain one another in a circle."""

Alias = Callable[[type[Base]], FromClause]
"""A new alias of the table of a class, see ``scope.Context.alias``."""


def held(rows: FromClause) -> ColumnElement[bool]:
    """Keep the rows that are held to be true now."""
    return rows.c.superseded_id.is_(None)


def statements_of_structures(alias: Alias, *kinds: str) -> CTE:
    """Select held statements of some kinds about structures, for each structure and all parts of it.

    Returns
    -------
    CTE
        of structure_id, statement_id, distance (0: said of the structure itself)
    """
    statement, child = alias(Statement), alias(Structure)
    # > 0, and not "is not null", since SQLite has an index for it
    seeds = select(
        statement.c.structure_id.label("structure_id"),
        statement.c.id.label("statement_id"),
        literal(0).label("distance"),
    ).where(statement.c.structure_id > 0, statement.c.kind.in_(kinds), held(statement))
    reach = seeds.cte(recursive=True)
    return reach.union_all(
        select(child.c.id, reach.c.statement_id, reach.c.distance + 1)
        .join_from(reach, child, child.c.parent_id == reach.c.structure_id)
        .where(held(child), reach.c.distance < MAX_LEVELS)
    )


@dataclass(frozen=True)
class Opinions:
    """Opinions of a kind about an entity, of which one holds.

    Attributes
    ----------
    alias : of tables
    entity : the table of entities
    rule : for this kind of statements
    of_structures : `statements_of_structures` of this kind
    """

    alias: Alias
    entity: FromClause
    rule: OpinionRule
    of_structures: CTE

    def holding(self, column: str) -> ColumnElement[Any]:
        """Return a column of the statement that holds: its own opinions come before those of its structures."""
        statement, (inherited, joined) = self.alias(Statement), self._inherited()
        by_itself = (
            self._own(select(statement.c[column]), statement).order_by(*self._preference(statement)).limit(1)
        )
        by_structure = (
            joined(select(inherited.c[column]))
            .order_by(self.of_structures.c.distance, *self._preference(inherited))
            .limit(1)
        )
        # by number of rows and not by coalesce: a column of the statement that holds may be null
        return case(
            (
                self._own(select(statement.c.id), statement).correlate(self.entity).exists(),
                self._of_entity(by_itself),
            ),
            else_=self._of_entity(by_structure),
        )

    def disputed(self) -> ColumnElement[bool]:
        """Return whether the opinions that come first by distance differ."""
        subject = DISPUTABLE[self.rule.about]
        statement, (inherited, joined) = self.alias(Statement), self._inherited()
        _, of_nearest = self._inherited()
        of_itself = self._own(select(func.count(distinct(statement.c[subject]))), statement)
        least = of_nearest(select(func.min(self.of_structures.c.distance)))
        of_structures = joined(select(func.count(distinct(inherited.c[subject])))).where(
            self.of_structures.c.distance == self._of_entity(least)
        )
        number = self._of_entity(of_itself)
        return case((number > 0, number > 1), else_=self._of_entity(of_structures) > 1)

    def _own(self, statement: Select[Any], source_rows: FromClause) -> Select[Any]:
        return statement.where(
            source_rows.c.entity_id == self.entity.c.id,
            source_rows.c.kind == self.rule.about,
            held(source_rows),
        )

    def _inherited(self) -> tuple[FromClause, Callable[[Select[Any]], Select[Any]]]:
        """Return an alias of statements, and what joins it to the structures of the entity."""
        inherited, member = self.alias(Statement), self.alias(Membership)

        def joined(statement: Select[Any]) -> Select[Any]:
            """Join the structures of a stone, and the statements about them."""
            return (
                statement.select_from(member)
                .join(self.of_structures, self.of_structures.c.structure_id == member.c.structure_id)
                .join(inherited, inherited.c.id == self.of_structures.c.statement_id)
                .where(member.c.entity_id == self.entity.c.id, held(member))
            )

        return inherited, joined

    def _preference(self, opinions: FromClause) -> Sequence[ColumnElement[Any]]:
        return preference(self.rule, opinions, self.alias(Statement))

    def _of_entity(self, statement: Select[Any]) -> ColumnElement[Any]:
        return statement.correlate(self.entity).scalar_subquery()


def statements_of(
    alias: Alias, entity: FromClause, candidate: FromClause, of_structures: CTE, *kinds: str
) -> ColumnElement[bool]:
    """Return the condition that a statement `candidate` is one of the entity or of a structure that it is a member of.

    Parameters
    ----------
    of_structures : `statements_of_structures` of these kinds
    """
    statement, member = alias(Statement), alias(Membership)
    by_itself = select(statement.c.id).where(
        statement.c.entity_id == entity.c.id, statement.c.kind.in_(kinds), held(statement)
    )
    by_structure = (
        select(of_structures.c.statement_id)
        .join(member, member.c.structure_id == of_structures.c.structure_id)
        .where(member.c.entity_id == entity.c.id, held(member))
    )
    # one list of numbers and not two conditions joined by "or", for which PostgreSQL reads all statements
    return candidate.c.id.in_(union_all(by_itself.correlate(entity), by_structure.correlate(entity)))


def entities_with_statement(
    alias: Alias,
    of_structures: CTE,
    wanted: Callable[[FromClause], list[ColumnElement[bool]]],
    *kinds: str,
    own_type_first: bool = False,
) -> CompoundSelect[int]:
    """Select the numbers of all entities for which a statement holds, in one search.

    Parameters
    ----------
    of_structures : `statements_of_structures` of these kinds
    wanted : what is asked of the statement
    own_type_first : a statement about a structure gives way to one of the same type about the entity
    """
    statement, inherited, member = alias(Statement), alias(Statement), alias(Membership)
    by_themselves = select(statement.c.entity_id).where(
        statement.c.entity_id > 0, statement.c.kind.in_(kinds), held(statement), *wanted(statement)
    )
    by_structures = (
        select(member.c.entity_id)
        .select_from(of_structures)
        .join(inherited, inherited.c.id == of_structures.c.statement_id)
        .join(member, member.c.structure_id == of_structures.c.structure_id)
        .where(held(member), *wanted(inherited))
    )
    if own_type_first:
        by_structures = by_structures.where(not_(_of_same_type(alias, member.c.entity_id, inherited, member)))
    return union_all(by_themselves, by_structures)


def observations_of(
    alias: Alias, entity: FromClause, of_structures: CTE
) -> tuple[FromClause, ColumnElement[bool]]:
    """Select the observations that hold for an entity: its own, and those of its structures of types that it lacks.

    Returns
    -------
    tuple
        an alias of the statements, and the condition on it, which speaks of the `entity` around it
    """
    statement = alias(Statement)
    same = _of_same_type(alias, entity.c.id, statement, entity)
    seen = and_(
        statements_of(alias, entity, statement, of_structures, "observation"),
        or_(statement.c.entity_id.is_not(None), not_(same)),
    )
    return statement, seen


def _of_same_type(
    alias: Alias, entity_id: ColumnElement[int], candidate: FromClause, around: FromClause
) -> ColumnElement[bool]:
    """Test for an observation about the entity itself of the type of `candidate`."""
    statement = alias(Statement)
    same = select(statement.c.id).where(
        statement.c.entity_id == entity_id,
        statement.c.kind == "observation",
        statement.c.type == candidate.c.type,
        held(statement),
    )
    return same.correlate(around, candidate).exists()
