"""Schema of a database as a tree: kinds with their attributes, structures, relations."""

from collections.abc import Mapping, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.query.attributes import ATTRIBUTES
from archmodel.tables.entities import Entity
from archmodel.tables.entries import held_at
from archmodel.tables.hierarchy import Kind, definition_of, kind_among, kind_chain, kind_of, kinds_in
from archmodel.tables.registered import Proportions, canons
from archmodel.tables.structures import Structure
from archmodel.tables.terms import VOCABULARIES, Term

RELATION_DEFINITIONS = {
    "rests_on": "a bed joint brings its load down to the other",
    "supports": "the other rests on it",
    "beside": "a head joint parts the two, neither bears the other",
    "bonded_with": "one reaches over or behind the other, so that they hold together",
    "across_the_wall": "the two are opposite, in the outer and in the inner facing of a wall",
    "member_of": "it is one of the entities that make up a structure",
}
"""The relations as one asks for them: `supports` is `rests_on` from the other side."""


def schema(session: Session | None = None, kind: str | None = None) -> dict[str, object]:
    """Describe the hierarchy in values that JSON can hold.

    Parameters
    ----------
    session : of a database whose registered kinds are shown too
    kind : only this kind, of entities or of structures, and its subkinds

    Returns
    -------
    dict
        ``kinds``: a tree of {kind, definition, registered, canonical, attributes: [{name, unit, definition}], kinds},
        in which attributes and canonical proportions are inherited; and, without `kind`, ``attributes`` of every
        entity, ``structures`` (each {kind, definition, registered, parent, canonical}, general before particular),
        ``relations`` and ``terms`` that the database registers, with their labels;
        of a kind of structure, no ``kinds`` but its ``structures``

    Raises
    ------
    UsageError
        if there is no such kind
    """
    of_entities, of_structures = kinds_in(session, Entity), kinds_in(session, Structure)
    known: dict[str, type[Kind]] = {**of_entities, **of_structures}
    stated = canons(session)
    name = kind_of(Entity if kind is None else kind_among(known, kind))
    tree: dict[str, object] = {"kinds": []}
    if name in of_entities:
        whole = kind is not None
        tree["kinds"] = [_branch(of_entities[name], frozenset(of_entities.values()), stated, whole)]
    else:
        below = [cls for cls in of_structures.values() if issubclass(cls, of_structures[name])]
        tree["structures"] = [_kind_of_structure(cls, stated) for cls in below]
    if kind is not None:
        return tree
    return {
        **tree,
        "attributes": [
            {"name": attribute.name, "unit": attribute.unit, "definition": attribute.definition}
            for attribute in ATTRIBUTES.values()
        ],
        "structures": [_kind_of_structure(cls, stated) for cls in of_structures.values()],
        "relations": [
            {"relation": name, "definition": meaning} for name, meaning in RELATION_DEFINITIONS.items()
        ],
        "terms": [] if session is None else _terms(session),
    }


def _terms(session: Session) -> list[dict[str, object]]:
    """Describe the terms that a database registers."""
    terms = session.scalars(select(Term).where(held_at(Term)).order_by(Term.vocabulary, Term.id))
    return [
        {
            "vocabulary": term.vocabulary,
            "term": term.name,
            "definition": term.definition or VOCABULARIES[term.vocabulary][0].get(term.name),
            "broader": term.broader,
            "labels": term.labels,
        }
        for term in terms
    ]


def _canonical(canon: Proportions | None) -> str | None:
    """Return canonical proportions in words."""
    if canon is None:
        return None
    if canon.tolerance is None:
        return canon.expression
    return f"{canon.expression}, within {100.0 * canon.tolerance:.3g} %"


def _branch(
    cls: type[Entity],
    known: frozenset[type[Entity]],
    stated: Mapping[str, Proportions],
    whole: bool = False,
) -> dict[str, object]:
    """Describe a kind and its subkinds; with inherited attributes if it is the `whole` tree."""
    own: Sequence[type[Entity]] = [one for one in reversed(cls.__mro__) if issubclass(one, Entity)]
    declared = [one for base in (own if whole else own[-1:]) for one in base.__dict__.get("__own__", ())]
    canon = stated.get(kind_of(cls))
    if canon is not None and not whole and canon.kind != kind_of(cls):
        canon = None
    return {
        "kind": kind_of(cls),
        "definition": definition_of(cls),
        "registered": cls.__users__ is not None,
        "canonical": _canonical(canon),
        "attributes": [
            {"name": one.name, "unit": one.unit, "definition": one.definition} for one in declared
        ],
        "kinds": [_branch(sub, known, stated) for sub in cls.__subclasses__() if sub in known],
    }


def _kind_of_structure(cls: type[Structure], stated: Mapping[str, Proportions]) -> dict[str, object]:
    """Describe a kind of structure, with the kind that it is a case of."""
    *above, _ = kind_chain(cls)
    return {
        "kind": kind_of(cls),
        "definition": definition_of(cls),
        "registered": cls.__users__ is not None,
        "parent": kind_of(above[-1]) if above else None,
        "canonical": _canonical(stated.get(kind_of(cls))),
    }
