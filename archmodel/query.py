"""Asking the database: which entities, with which attributes, and all that is known of one."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from sqlalchemy import Select, select
from sqlalchemy.orm import Session, object_session

from archmodel.attributes import ATTRIBUTES, Attribute, with_attributes
from archmodel.description import describe
from archmodel.entities import Entity, kind_named, kinds, refuse_unknown_kinds
from archmodel.expressions import condition
from moma.errors import DatabaseError, QueryError

__all__ = ["attributes", "describe", "find", "find_rows", "row_of", "rows_of"]

MAX_EXPRESSIONS = 20
"""Most expressions in one query: together they stay below the number of parameters that SQLite takes."""

BATCH = 500
"""Entities per statement in `rows_of`, below SQLite's limit of parameters."""

S = TypeVar("S", bound=Select[Any])


def attributes() -> tuple[Attribute, ...]:
    """Everything that can be asked of an entity, in the order in which it is shown."""
    return tuple(ATTRIBUTES.values())


def find(session: Session, kind: str, where: Sequence[str] = ()) -> list[Entity]:
    """The entities of a kind and its subkinds that satisfy all expressions, in the order of the survey.

    Raises
    ------
    UsageError
        if there is no such kind
    QueryError
        if an expression cannot be understood
    """
    statement = with_attributes(select(kind_named(kind)))
    return list(session.scalars(_restricted(session, statement, where)))


def find_rows(session: Session, kind: str, where: Sequence[str] = ()) -> list[dict[str, object]]:
    """As `find`, but only the attributes, as by `row_of`: the fast way to a table."""
    cls = kind_named(kind)
    subkinds = [name for name, sub in kinds().items() if issubclass(sub, cls)]
    statement = _select_rows().where(Entity.kind.in_(subkinds))
    return [dict(row) for row in session.execute(_restricted(session, statement, where)).mappings()]


def row_of(entity: Entity) -> dict[str, object]:
    """Every attribute of an entity by name; None where it is not known. The entity's session must be open."""
    return rows_of([entity])[0]


def rows_of(entities: Iterable[Entity]) -> list[dict[str, object]]:
    """As `row_of`, for many entities of one session, in their order."""
    wanted = list(entities)
    found: dict[object, dict[str, object]] = {}
    for start in range(0, len(wanted), BATCH):
        batch = wanted[start : start + BATCH]
        session = object_session(batch[0])
        if session is None:
            remedy = "ask for its row before the session is closed"
            raise DatabaseError("the entity's session is closed", where=batch[0].code, remedy=remedy)
        statement = _select_rows().where(Entity.id.in_([entity.id for entity in batch]))
        found.update((row["code"], dict(row)) for row in session.execute(statement).mappings())
    return [found[entity.code] for entity in wanted]


def _select_rows() -> Select[Any]:
    """Every attribute under its name, from one row per entity."""
    columns = [attribute.column.label(attribute.name) for attribute in ATTRIBUTES.values()]
    return with_attributes(select(*columns).select_from(Entity))


def _restricted(session: Session, statement: S, where: Sequence[str]) -> S:
    """The statement with its conditions and order; every kind in the database must be one that we know."""
    expressions = [where] if isinstance(where, str) else where
    if len(expressions) > MAX_EXPRESSIONS:
        remedy = "join some of them by and"
        raise QueryError(
            f"{len(expressions)} expressions, at most {MAX_EXPRESSIONS}", where="--where", remedy=remedy
        )
    conditions = [condition(expression) for expression in expressions]
    refuse_unknown_kinds(session)
    return statement.where(*conditions).order_by(Entity.id)
