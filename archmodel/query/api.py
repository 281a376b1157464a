"""Queries of the database: entities by kind and condition, their attributes and their faces."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, or_, select
from sqlalchemy.orm import Session, object_session

from archmodel.arrays import Array
from archmodel.query.attributes import ATTRIBUTES, Attribute, attributes_of
from archmodel.query.compile import column_named, condition_in
from archmodel.query.grammar import attributes_in, parse
from archmodel.query.names import refuse_unknown_run
from archmodel.query.scope import Context, Scope, StructureScope
from archmodel.query.structures import STRUCTURE_ATTRIBUTES
from archmodel.tables.entities import Entity, kind_named
from archmodel.tables.hierarchy import kind_among, kinds_below
from archmodel.tables.registered import all_kinds, refuse_unknown_kinds
from archmodel.tables.structures import Structure, structure_kinds
from ground.errors import DatabaseError, QueryError, UsageError

MAX_EXPRESSIONS = 20
"""Most expressions in one query: together they stay below the number of parameters that SQLite takes."""

BATCH = 500
"""Entities per statement in `rows_of`, below SQLite's limit of parameters."""


@dataclass(frozen=True)
class FoundFace:
    """Face of an entity that a query found.

    Attributes
    ----------
    outline : (nv, 3) corners, counter-clockwise seen from outside [m]; None if it was not measured
    normal : (3,) unit normal towards the observer; None if it was not measured
    row : attributes by name
    """

    outline: Array | None
    normal: Array | None
    row: dict[str, object]


def attributes(session: Session | None = None, kind: str | None = None) -> tuple[Attribute, ...]:
    """List the attributes that queries can ask for, in the order of display.

    Parameters
    ----------
    session : of a database whose registered kinds count too
    kind : the attributes that entities of this kind and its subkinds have of their own come last; of a kind of
        structure, those of structures; None: only those of every entity
    """
    if kind is None:
        return tuple(ATTRIBUTES.values())
    return tuple(_known(session, kind).values())


def find(session: Session, kind: str, where: Sequence[str] = (), run: int | None = None) -> list[Entity]:
    """Return the entities of a kind and its subkinds that satisfy all expressions, in the order of the survey.

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
    scope, conditions = _asked(session, where, run)
    # Entity, whatever the kind: the columns of all subkinds come with it
    statement = scope.joined(select(Entity)).where(*_of_kind(scope, kind), *conditions)
    return list(session.scalars(statement.order_by(Entity.id)))


def find_rows(
    session: Session,
    kind: str,
    where: Sequence[str] = (),
    run: int | None = None,
    columns: Sequence[str] | None = None,
    limit: int | None = None,
) -> list[dict[str, object]]:
    """Return attributes of entities, or of structures, as rows; the fast way to a table. Arguments as of `find`.

    Parameters
    ----------
    kind : of entities or of structures
    columns : names of the attributes that are wanted, also ``von_mises_max@12``; None: those of ``attributes``
    limit : most rows; None: all
    """
    if _is_of_structures(kind):
        return _find_structures(session, kind, where, run, columns, limit)
    names = list(ATTRIBUTES) if columns is None else columns
    rows = _select(session, kind, where, run, lambda scope: _columns(scope, names), limit)
    return [dict(zip(names, row, strict=True)) for row in rows]


def find_faces(
    session: Session,
    kind: str,
    where: Sequence[str] = (),
    run: int | None = None,
    columns: Sequence[str] = ("code",),
) -> list[FoundFace]:
    """Return rows as `find_rows` does, with the face of each entity."""

    def chosen(scope: Scope) -> list[ColumnElement[Any]]:
        """Return the columns of an outline and its attributes."""
        measurement = scope.measurement()
        return [measurement.c.outline, measurement.c.normal, *_columns(scope, columns)]

    rows = _select(session, kind, where, run, chosen)
    return [
        FoundFace(outline, normal, dict(zip(columns, row, strict=True))) for outline, normal, *row in rows
    ]


def asked_columns(where: Sequence[str], session: Session | None = None, kind: str = "entity") -> list[str]:
    """List the attributes that expressions name, without those of other entities: ``depth``, ``von_mises_max@12``."""
    attribute_names = _known(session, kind)
    expressions = [where] if isinstance(where, str) else where
    named = [token.text.lower() for expression in expressions for token in attributes_in(parse(expression))]
    return [name for name in dict.fromkeys(named) if name.partition("@")[0] in attribute_names]


def row_of(entity: Entity) -> dict[str, object]:
    """Return every attribute of an entity by name; None where it is not known. The entity's session must be open."""
    return rows_of([entity])[0]


def rows_of(entities: Iterable[Entity]) -> list[dict[str, object]]:
    """Return every attribute of many entities of one session, in their order, as `row_of` does."""
    wanted = list(entities)
    names = list(ATTRIBUTES)
    by_code: dict[object, dict[str, object]] = {}
    for start in range(0, len(wanted), BATCH):
        batch = wanted[start : start + BATCH]
        session = object_session(batch[0])
        if session is None:
            remedy = "ask for its row before the session is closed"
            raise DatabaseError("the entity's session is closed", where=batch[0].code, remedy=remedy)
        scope = Scope(Context(session))
        statement = scope.joined(select(*_columns(scope, names)))
        statement = statement.where(scope.entity.c.id.in_([entity.id for entity in batch]))
        rows = (dict(zip(names, row, strict=True)) for row in session.execute(statement))
        by_code.update((row["code"], row) for row in rows)
    return [by_code[entity.code] for entity in wanted]


def _known(session: Session | None, kind: str) -> Mapping[str, Attribute]:
    """Return the attributes of a kind of entities or of structures, by name."""
    return STRUCTURE_ATTRIBUTES if _is_of_structures(kind) else attributes_of(session, kind_named(kind))


def _is_of_structures(kind: str) -> bool:
    """Return whether a kind is one of structures.

    Raises
    ------
    UsageError
        if there is no such kind of entities or of structures
    """
    return issubclass(kind_among(all_kinds(), kind, "kind of stone or structure"), Structure)


def _find_structures(
    session: Session,
    kind: str,
    where: Sequence[str],
    run: int | None,
    columns: Sequence[str] | None,
    limit: int | None,
) -> list[dict[str, object]]:
    """Return attributes of the structures of a kind, as `find_rows` does."""
    context = Context(session, run)
    scope = StructureScope(context, context.alias(Structure))
    refuse_unknown_run(context)
    conditions = [condition_in(scope, parse(text)) for text in _listed(where)]
    refuse_unknown_kinds(session, Structure)
    names = list(STRUCTURE_ATTRIBUTES) if columns is None else columns
    wanted = [column_named(scope, name).label(f"column_{number}") for number, name in enumerate(names)]
    below = list(kinds_below(kind_among(structure_kinds(), kind)))
    rows = scope.structure
    statement = (
        select(*wanted)
        .select_from(rows)
        .where(rows.c.superseded_id.is_(None), rows.c.kind.in_(below), *conditions)
        .order_by(rows.c.id)
        .limit(limit)
    )
    return [dict(zip(names, row, strict=True)) for row in session.execute(statement)]


def _listed(where: Sequence[str]) -> Sequence[str]:
    """Return the expressions of a query, of which there are not too many."""
    expressions = [where] if isinstance(where, str) else where
    if len(expressions) > MAX_EXPRESSIONS:
        what = f"{len(expressions)} expressions, at most {MAX_EXPRESSIONS}"
        raise QueryError(what, where="--where", remedy="join some of them by and")
    return expressions


def _asked(
    session: Session, where: Sequence[str], run: int | None
) -> tuple[Scope, list[ColumnElement[bool]]]:
    """Return the scope of a query and its conditions; refuse kinds that this program does not know."""
    expressions = _listed(where)
    scope = Scope(Context(session, run))
    refuse_unknown_run(scope.context)
    conditions = [condition_in(scope, parse(expression)) for expression in expressions]
    refuse_unknown_kinds(session, Entity)
    return scope, [*conditions, _not_withdrawn(scope.entity.c)]


def _columns(scope: Scope, names: Sequence[str]) -> list[ColumnElement[Any]]:
    """Return the columns of attributes under labels of our own: a name may be the user's."""
    return [column_named(scope, name).label(f"column_{number}") for number, name in enumerate(names)]


def _select(
    session: Session,
    kind: str,
    where: Sequence[str],
    run: int | None,
    chosen: Callable[[Scope], list[ColumnElement[Any]]],
    limit: int | None = None,
) -> Iterable[Sequence[Any]]:
    """Select columns of the entities of a kind that satisfy all expressions, in the order of the survey."""
    scope, conditions = _asked(session, where, run)
    columns = chosen(scope)
    statement = scope.joined(select(*columns)).where(*_of_kind(scope, kind), *conditions)
    return session.execute(statement.order_by(scope.entity.c.id).limit(limit))


def _of_kind(scope: Scope, kind: str) -> list[ColumnElement[bool]]:
    """Return the conditions that restrict entities to a kind and its subkinds; none where every entity is one."""
    try:
        cls = kind_named(kind)
    except UsageError as error:
        if kind not in structure_kinds():
            raise
        remedy = f'ask for its stones: entity, where "member_of(is_a({kind}))"'
        raise UsageError(f"{error.what}: it is a kind of structure", remedy=remedy) from None
    if cls is Entity:
        return []
    return [scope.entity.c.kind.in_(kinds_below(cls))]


def _not_withdrawn(entity: Any) -> ColumnElement[bool]:
    """Return the condition that an entity, as a table or an alias of it, is not a withdrawn hypothesis."""
    return or_(~entity.hypothesis, entity.x.is_not(None))
