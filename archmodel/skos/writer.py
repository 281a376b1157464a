"""Vocabularies written as Turtle: a concept scheme for each, and a concept for each of its terms."""

from collections.abc import Iterator, Mapping
from urllib.parse import quote

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.skos.concepts import SCHEME, SKOS
from archmodel.tables.entries import held_at
from archmodel.tables.terms import VOCABULARIES, Term

_TERM = "urn:moma:term:"
_ESCAPES = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"})
_UNSAFE = '<>"{}|^`\\'


def write_turtle(session: Session) -> str:
    """Return all terms of a database as Turtle, those of the program too."""
    terms: dict[str, dict[str, Term]] = {name: {} for name in VOCABULARIES}
    for term in session.scalars(select(Term).where(held_at(Term)).order_by(Term.id)):
        terms[term.vocabulary][term.name] = term
    blocks = [f"@prefix skos: <{SKOS}> ."]
    for vocabulary, stated in terms.items():
        built_in, _ = VOCABULARIES[vocabulary]
        if not built_in and not stated:
            continue
        scheme = f"<{SCHEME}{vocabulary}>"
        blocks.append(_block(scheme, ["a skos:ConceptScheme", f"skos:prefLabel {_text(vocabulary, 'en')}"]))
        iris = {name: _iri(vocabulary, name, stated.get(name)) for name in (*built_in, *stated)}
        for name in dict.fromkeys([*built_in, *stated]):
            lines = _lines(name, stated.get(name), built_in.get(name), iris)
            blocks.append(_block(iris[name], ["a skos:Concept", f"skos:inScheme {scheme}", *lines]))
    return "\n\n".join(blocks) + "\n"


def _lines(name: str, term: Term | None, meaning: str | None, iris: Mapping[str, str]) -> Iterator[str]:
    """Yield predicates with their objects."""
    yield f"skos:notation {_text(name)}"
    labels = {} if term is None else term.labels
    if not any(labels.values()):
        yield f"skos:prefLabel {_text(name)}"
    for language, several in labels.items():
        for k, label in enumerate(several):
            yield f"skos:{'altLabel' if k else 'prefLabel'} {_text(label, language)}"
    definition = term.definition if term is not None and term.definition is not None else meaning
    if definition is not None:
        yield f"skos:definition {_text(definition)}"
    if term is not None and term.broader is not None and term.broader in iris:
        yield f"skos:broader {iris[term.broader]}"


def _block(subject: str, lines: list[str]) -> str:
    return f"{subject}\n    " + " ;\n    ".join(lines) + " ."


def _iri(vocabulary: str, name: str, term: Term | None) -> str:
    if (
        term is not None
        and term.iri is not None
        and not any(sign in _UNSAFE or sign <= " " for sign in term.iri)
    ):
        return f"<{term.iri}>"
    return f"<{_TERM}{vocabulary}:{quote(name)}>"


def _text(text: str, language: str | None = None) -> str:
    tag = "" if language is None else f"@{language}"
    return f'"{text.translate(_ESCAPES)}"{tag}'
