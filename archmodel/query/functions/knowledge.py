"""Query functions on knowledge: marks, observations, documents, corrections, mechanisms, kinds, proportions."""

from collections.abc import Mapping

from sqlalchemy import FromClause, case, exists, func, literal, null, or_, select

from archmodel.query.attributes import attributes_of
from archmodel.query.columns import DOCUMENTING
from archmodel.query.functions.usages import Ask, Condition, tokens
from archmodel.query.grammar import Call, parse
from archmodel.query.inherited import entities_with_statement, held
from archmodel.query.names import author_named, document_named, marks_named, meant, terms_named
from archmodel.query.scope import Scope, StructureScope
from archmodel.query.tokens import Token, complaint
from archmodel.tables.entities import Entity, kind_named
from archmodel.tables.entries import Entry
from archmodel.tables.hierarchy import kinds_below, kinds_in
from archmodel.tables.knowledge import Correction, Statement
from archmodel.tables.opinions import DISPUTABLE
from archmodel.tables.registered import Proportions, canons
from archmodel.tables.runs import MechanismStone
from archmodel.tables.structures import Structure, structure_kind_named
from ground.errors import QueryError, UsageError

MAX_SEVERITY = 4

OPINIONS: Mapping[str, str] = {
    "phase": "of_phase",
    "material": "made_of",
    "mark": "mason_mark",
    "observation": "observation",
    "depth": "depth",
    "document": "reference",
    "note": "note",
}
"""Kinds of statements by the names that users write."""


def has_mark(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for mason marks. A mark of a structure is somewhere on it, on no stone in particular."""
    mark = scope.context.alias(Statement)
    conditions: list[Condition] = [
        held(mark),
        mark.c.entity_id == scope.entity.c.id,
        mark.c.kind == "mason_mark",
    ]
    conditions += [mark.c.sign.in_(marks_named(scope.context, sign)) for sign in tokens(call, 0, 1)]
    return _any_row(scope, *conditions)


def observed(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for observations of the stone, and of its structures if it has none of their type."""
    values = tokens(call, 0, 1, 2)
    types = terms_named(scope.context, "observation", values[0]) if values else []
    least = _severity(values[1]) if len(values) == 2 else None

    def conditions(statement: FromClause) -> list[Condition]:
        """Return the conditions on type and severity."""
        of_type: list[Condition] = [statement.c.type.in_(types)] if types else []
        return of_type if least is None else [*of_type, statement.c.severity >= least]

    context = scope.context
    of_structures = context.statements_of_structures("observation")
    with_observation = entities_with_statement(
        context.alias, of_structures, conditions, "observation", own_type_first=True
    )
    return scope.entity.c.id.in_(with_observation)


def _severity(token: Token) -> int:
    if token.text not in map(str, range(MAX_SEVERITY + 1)):
        remedy = "write a number from 0 (traces) to 4 (lost, or about to be)"
        raise complaint(token, f"{token.text[:40]!r} is not a severity", remedy)
    return int(token.text)


def documented(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for documents that any statement about the stone, or its structures, names."""
    numbers = [document_named(scope.context, code) for code in tokens(call, 0, 1)]

    def conditions(statement: FromClause) -> list[Condition]:
        """Return the conditions on the document."""
        return [statement.c.document_id > 0, *(statement.c.document_id == number for number in numbers)]

    context = scope.context
    of_structures = context.statements_of_structures(*DOCUMENTING)
    return scope.entity.c.id.in_(
        entities_with_statement(context.alias, of_structures, conditions, *DOCUMENTING)
    )


def by(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for statements of an author about the stone, or its structures, that are held."""
    values = tokens(call, 1, 2)
    kinds = tuple(OPINIONS.values())
    if len(values) == 2:
        kinds = (_opinion(values[1], OPINIONS),)
    author = author_named(scope.context, values[0])

    def conditions(statement: FromClause) -> list[Condition]:
        """Return the condition on the author."""
        return [statement.c.author == author]

    context = scope.context
    of_structures = context.statements_of_structures(*kinds)
    return scope.entity.c.id.in_(entities_with_statement(context.alias, of_structures, conditions, *kinds))


def disputed(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for opinions that differ: of the stone itself or, if it has none, of its nearest structures."""
    values = tokens(call, 0, 1)
    named = {name: kind for name, kind in OPINIONS.items() if kind in DISPUTABLE}
    kinds = [_opinion(values[0], named)] if values else list(named.values())
    return or_(*(scope.opinions(kind).disputed() for kind in kinds))


def _opinion(token: Token, named: Mapping[str, str]) -> str:
    if (kind := named.get(token.text.lower())) is None:
        remedy = meant(token.text, named, "they")
        raise complaint(token, f"there are no opinions on {token.text[:40]!r}", remedy)
    return kind


def corrected(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for corrections of its attributes by a person; what was measured again is none."""
    rows, entries = scope.context.alias(Correction), scope.context.alias(Entry)
    conditions: list[Condition] = [
        rows.c.entity_id == scope.entity.c.id,
        entries.c.id == rows.c.entry_id,
        entries.c.action.in_(("correction", "declaration")),
    ]
    for token in tokens(call, 0, 1):
        attributes = attributes_of(scope.context.session)
        if (name := token.text.lower()) not in attributes:
            raise complaint(
                token, f"unknown attribute {token.text[:40]!r}", meant(name, attributes, "the attributes")
            )
        conditions.append(rows.c.attribute == name)
    return _any_row(scope, *conditions)


def _any_row(scope: Scope, *conditions: Condition) -> Condition:
    """Test for a row that satisfies the conditions, for each entity."""
    return exists().where(*conditions).correlate(scope.entity)


def in_mechanism(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for motion in a mechanism of the latest assessment."""
    rows, all_rows = scope.context.alias(MechanismStone), scope.context.alias(MechanismStone)
    latest = select(func.max(all_rows.c.run_id)).scalar_subquery()
    conditions: list[Condition] = [rows.c.entity_id == scope.entity.c.id, rows.c.run_id == latest]
    conditions += [rows.c.load == load.text for load in tokens(call, 0, 1)]
    return _any_row(scope, *conditions)


def is_a(scope: Scope | StructureScope, call: Call, ask: Ask) -> Condition:
    """Test for a kind, or one of its subkinds."""
    (name,) = tokens(call, 1)
    try:
        if isinstance(scope, StructureScope):
            return scope.structure.c.kind.in_(kinds_below(structure_kind_named(name.text)))
        return scope.entity.c.kind.in_(kinds_below(kind_named(name.text)))
    except UsageError as error:
        raise complaint(name, error.what, error.remedy) from None


def canonical(scope: Scope | StructureScope, call: Call, ask: Ask) -> Condition:
    """Test for the proportions that theory asks of its kind, within their tolerance where one is stated."""
    tokens(call, 0)
    context, kind = scope.context, scope.entity.c.kind if isinstance(scope, Scope) else scope.structure.c.kind
    root = Entity if isinstance(scope, Scope) else Structure
    if context.within_canon:
        raise complaint(call.function, "canonical proportions cannot refer to canonical()")
    classes = kinds_in(context.session, root)
    with_canon: dict[Proportions, list[str]] = {}
    for name, canon in context.once("canons", lambda: canons(context.session)).items():
        if name in classes:
            with_canon.setdefault(canon, []).append(name)
    cases = []
    for canon, names in with_canon.items():
        try:
            if canon.tolerance is None:
                context.within_canon = True
                met = ask(scope, parse(canon.expression))
            else:
                context.within_canon = False
                met = ask(scope, parse("departs_from_canon <= 1"))
            cases.append((kind.in_(names), met))
        except QueryError as error:
            what = f"the canonical proportions of {' and '.join(names)} cannot be understood: {error}"
            raise complaint(call.function, what) from None
    context.within_canon = False
    # Neither true nor false for kinds that have none.
    return case(*cases, else_=null()) if cases else null().is_(literal(True))
