"""Asking the database: which entities, with which attributes, and all that is known of one."""

from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Select, select
from sqlalchemy.orm import Session, object_session

from archmodel.attributes import ATTRIBUTES, Attribute, attributes_of
from archmodel.description import describe
from archmodel.entities import Entity, kind_named, kinds, refuse_unknown_kinds
from archmodel.expressions import column_named, condition, condition_in
from archmodel.grammar import parse
from archmodel.lookups import refuse_unknown_run
from archmodel.scope import Context, Scope
from moma.errors import DatabaseError, QueryError

__all__ = ["attributes", "condition", "describe", "find", "find_rows", "row_of", "rows_of"]

MAX_EXPRESSIONS = 20
"""Most expressions in one query: together they stay below the number of parameters that SQLite takes."""

BATCH = 500
"""Entities per statement in `rows_of`, below SQLite's limit of parameters."""


def attributes(session: Session | None = None, kind: str | None = None) -> tuple[Attribute, ...]:
    """What can be asked, in the order in which it is shown.

    Parameters
    ----------
    session : of a database whose registered kinds count too
    kind : the attributes that entities of this kind and its subkinds have of their own come last; None: only
        those of every entity
    """
    if kind is None:
        return tuple(ATTRIBUTES.values())
    return tuple(attributes_of(session, kind_named(kind)).values())


def find(session: Session, kind: str, where: Sequence[str] = (), run: int | None = None) -> list[Entity]:
    """The entities of a kind and its subkinds that satisfy all expressions, in the order of the survey.

    Parameters
    ----------
    session : of the database that is asked
    kind : name of a kind
    where : expressions, see docs/query.md; one need not be in a list
    run : whose results are meant where an expression names no run; None: the latest that holds the entity

    Raises
    ------
    UsageError
        if there is no such kind
    QueryError
        if an expression cannot be understood, or there is no such run
    """
    cls = kind_named(kind)
    scope, conditions = _asked(session, where, run)
    statement = scope.joined(select(cls)).where(*conditions).order_by(cls.id)
    return list(session.scalars(statement))


def find_rows(
    session: Session,
    kind: str,
    where: Sequence[str] = (),
    run: int | None = None,
    columns: Sequence[str] | None = None,
) -> list[dict[str, object]]:
    """As `find`, but attributes by name instead of entities: the fast way to a table.

    Parameters
    ----------
    columns : names of the attributes that are wanted, also ``von_mises_max@12``; None: those of ``attributes``
    """
    cls = kind_named(kind)
    scope, conditions = _asked(session, where, run)
    names = columns if columns is not None else list(ATTRIBUTES)
    subkinds = [name for name, sub in kinds().items() if issubclass(sub, cls)]
    kind_of_it = scope.entity.c.kind
    chosen = _columns(scope, names)
    statement = scope.joined(select(*chosen))
    statement = statement.where(
        kind_of_it == subkinds[0] if len(subkinds) == 1 else kind_of_it.in_(subkinds), *conditions
    )
    return _rows(session, statement.order_by(scope.entity.c.id), names)


def row_of(entity: Entity) -> dict[str, object]:
    """Every attribute of an entity by name; None where it is not known. The entity's session must be open."""
    return rows_of([entity])[0]


def rows_of(entities: Iterable[Entity]) -> list[dict[str, object]]:
    """As `row_of`, for many entities of one session, in their order."""
    wanted = list(entities)
    names = list(ATTRIBUTES)
    found: dict[object, dict[str, object]] = {}
    for start in range(0, len(wanted), BATCH):
        batch = wanted[start : start + BATCH]
        session = object_session(batch[0])
        if session is None:
            remedy = "ask for its row before the session is closed"
            raise DatabaseError("the entity's session is closed", where=batch[0].code, remedy=remedy)
        scope = Scope(Context(session))
        chosen = _columns(scope, names)
        statement = scope.joined(select(*chosen))
        statement = statement.where(scope.entity.c.id.in_([entity.id for entity in batch]))
        found.update((row["code"], row) for row in _rows(session, statement, names))
    return [found[entity.code] for entity in wanted]


def _asked(
    session: Session, where: Sequence[str], run: int | None
) -> tuple[Scope, list[ColumnElement[bool]]]:
    """The scope of a query and its conditions; every kind in the database must be one that we know."""
    expressions = [where] if isinstance(where, str) else where
    if len(expressions) > MAX_EXPRESSIONS:
        remedy = "join some of them by and"
        raise QueryError(
            f"{len(expressions)} expressions, at most {MAX_EXPRESSIONS}", where="--where", remedy=remedy
        )
    scope = Scope(Context(session, run))
    refuse_unknown_run(scope.context)
    conditions = [condition_in(scope, parse(expression)) for expression in expressions]
    refuse_unknown_kinds(session)
    return scope, conditions


def _columns(scope: Scope, names: Sequence[str]) -> list[ColumnElement[Any]]:
    """The attributes of these names, as columns without them: a name may be the user's."""
    return [column_named(scope, name).label(f"column_{number}") for number, name in enumerate(names)]


def _rows(session: Session, statement: Select[Any], names: Sequence[str]) -> list[dict[str, object]]:
    return [dict(zip(names, row, strict=True)) for row in session.execute(statement)]
