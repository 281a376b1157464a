"""Concepts of SKOS: labels by language, definition, broader concepts; and what of a file is none of these."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import unquote
from xml.sax import SAXParseException

from archmodel.tables.terms import VOCABULARIES
from ground.errors import UsageError

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
"""Namespace of RDF."""

_XML = (".rdf", ".owl")


@dataclass(frozen=True)
class Literal:
    """Text of a statement.

    Attributes
    ----------
    text : without escapes
    language : tag (BCP 47), its first part in small letters; None for a text without one, a number, or a value of
        another type
    """

    text: str
    language: str | None = None


Node = str | Literal
"""IRI, name of a blank node, or text."""

Triple = tuple[str, str, Node]
"""Subject, predicate, object."""


def read_triples(path: Path) -> list[Triple]:
    """Return the statements of a file of Turtle, N-Triples or RDF/XML, in its order.

    Raises
    ------
    UsageError
        if it cannot be read, is not UTF-8, or not RDF
    """
    import rdflib  # takes half a second
    from rdflib.exceptions import ParserError
    from rdflib.plugins.parsers.notation3 import BadSyntax

    found: list[Triple] = []

    class Statements(rdflib.Graph):
        """Graph that notes its statements as they come: those of a graph have no order."""

        def add(self, triple: Any) -> "Statements":
            """Note a statement."""
            subject, predicate, target = triple
            text = isinstance(target, rdflib.Literal)
            node = Literal(str(target), _tag(target.language)) if text else str(target)
            found.append((str(subject), str(predicate), node))
            return self

    try:
        text = path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        refuse(str(path), f"cannot be read: {error}", "save it as UTF-8")
    xml = path.suffix.lower() in _XML and text.lstrip().startswith("<")
    try:
        Statements().parse(data=text, format="xml" if xml else "turtle", publicID=f"file:///{path.name}")
    except BadSyntax as error:
        refuse(f"{path}:{error.lines + 1}", f"it is not Turtle: {error._why}")
    except RecursionError:
        refuse(str(path), "it has brackets within brackets without end")
    except (ParserError, SAXParseException) as error:
        refuse(str(path), f"it is not RDF/XML: {error}")
    except (AssertionError, IndexError):
        refuse(str(path), "it ends within a statement or a text")
    return found


def _tag(language: str | None) -> str | None:
    """Return a language tag with its first part in small letters, as they are compared without regard to case."""
    first, dash, rest = (language or "").partition("-")
    return f"{first.lower()}{dash}{rest}" or None


def refuse(where: str, what: str, remedy: str = "save it again as Turtle by another program") -> NoReturn:
    """Refuse a file, at its line."""
    raise UsageError(what, where=where, remedy=remedy)


SKOS = "http://www.w3.org/2004/02/skos/core#"
"""Namespace of SKOS."""

SCHEME = "urn:moma:vocabulary:"
"""Beginning of the IRIs of the vocabularies."""

ENDINGS = (".ttl", ".nt", ".rdf", ".owl")
"""Endings of the files that are read: Turtle, N-Triples, RDF/XML."""

_XL = "http://www.w3.org/2008/05/skos-xl#"
_FORMS = (f"{_XL}literalForm", f"{RDF}value")  # of a label, and of a note, that is a node
_UNTAGGED = "und"  # language that is not said (BCP 47)
_LABELS = ("prefLabel", "altLabel", "hiddenLabel")
_NOTES = ("definition", "scopeNote", "note")
_READ = {f"{SKOS}{name}" for name in (*_LABELS, *_NOTES, "broader", "narrower", "inScheme", "notation")} | {
    *(f"{_XL}{name}" for name in _LABELS),
    *(f"{SKOS}{name}" for name in ("topConceptOf", "broaderTransitive", "narrowerTransitive")),
    f"{RDF}type",
}


@dataclass(frozen=True)
class Concept:
    """Concept of a file.

    Attributes
    ----------
    iri : its identifier
    labels : by language, the preferred one first
    definition : in English, or else in the first language; None: none
    broader : IRIs of broader concepts
    notation : its code in the scheme; None: none
    vocabulary : one of VOCABULARIES, where the file is of this program; None: not said
    """

    iri: str
    labels: Mapping[str, Sequence[str]]
    definition: str | None = None
    broader: tuple[str, ...] = ()
    notation: str | None = None
    vocabulary: str | None = None

    @property
    def name(self) -> str:
        """Notation in files of this program; else the preferred label in English or the first language."""
        if self.vocabulary is not None and self.notation is not None:
            return self.notation
        for language in ("en", *(tag for tag in self.labels if tag.startswith("en-")), *self.labels):
            if self.labels.get(language):
                return self.labels[language][0]
        return unquote(self.iri.rstrip("/#").replace("#", "/").rpartition("/")[2])


@dataclass(frozen=True)
class Scheme:
    """Concepts of a file, in its order, and how many statements about them are not read, by predicate."""

    concepts: tuple[Concept, ...]
    ignored: Mapping[str, int] = field(default_factory=dict)


def read_scheme(path: Path) -> Scheme:
    """Read a vocabulary.

    Raises
    ------
    UsageError
        if the file is not RDF, or has no concepts
    """
    objects = _objects(read_triples(path))
    numbers = [
        node
        for node, known in objects.items()
        if f"{SKOS}Concept" in known.get(f"{RDF}type", ())
        or f"{SKOS}prefLabel" in known
        or f"{_XL}prefLabel" in known
    ]
    schemes = {
        node for node, known in objects.items() if f"{SKOS}ConceptScheme" in known.get(f"{RDF}type", ())
    }
    numbers = [node for node in numbers if node not in schemes]
    if not numbers:
        refuse(str(path), "no concepts of SKOS", "name a file with skos:Concept")
    below: dict[str, list[str]] = {}
    for node in numbers:
        for target in objects[node].get(f"{SKOS}narrower", ()):
            if isinstance(target, str):
                below.setdefault(target, []).append(node)
    concepts = tuple(_concept(node, objects, below.get(node, ())) for node in numbers)
    ignored = Counter(
        _short(predicate)
        for node in numbers
        for predicate, targets in objects[node].items()
        if predicate not in _READ
        for _ in targets
    )
    return Scheme(concepts, dict(ignored.most_common()))


_Objects = Mapping[str, Mapping[str, Sequence[Node]]]


def _objects(graph: Iterable[Triple]) -> _Objects:
    """Return the objects of each subject by predicate, in the order of the file, each once."""
    found: dict[str, dict[str, dict[Node, None]]] = {}
    for subject, predicate, target in graph:
        found.setdefault(subject, {}).setdefault(predicate, {})[target] = None
    return {node: {name: tuple(values) for name, values in known.items()} for node, known in found.items()}


def _concept(node: str, objects: _Objects, above: Sequence[str]) -> Concept:
    known = objects[node]
    labels: dict[str, dict[str, None]] = {}
    for name in _LABELS:
        for text in _texts(known, objects, f"{SKOS}{name}", f"{_XL}{name}"):
            if text.text.strip():
                labels.setdefault(text.language or _UNTAGGED, {})[" ".join(text.text.split())] = None
    notes = [text for name in _NOTES for text in _texts(known, objects, f"{SKOS}{name}")]
    chosen = next(
        (note for note in notes if (note.language or "en").startswith("en")), next(iter(notes), None)
    )
    broader = [target for target in known.get(f"{SKOS}broader", ()) if isinstance(target, str)]
    notation = next((code.text for code in _texts(known, objects, f"{SKOS}notation")), None)
    schemes = (
        target.removeprefix(SCHEME) for target in known.get(f"{SKOS}inScheme", ()) if isinstance(target, str)
    )
    vocabulary = next((name for name in schemes if name in VOCABULARIES), None)
    if vocabulary is not None and notation is not None and list(labels.get(_UNTAGGED, ())) == [notation]:
        del labels[_UNTAGGED]  # a term without labels, as this program writes it
    return Concept(
        node,
        {language: tuple(several) for language, several in labels.items()},
        None if chosen is None else " ".join(chosen.text.split()) or None,
        tuple(dict.fromkeys([*broader, *above])),
        notation,
        vocabulary,
    )


def _texts(known: Mapping[str, Sequence[Node]], objects: _Objects, *predicates: str) -> list[Literal]:
    """Return the texts of a node, also those that are nodes of their own with a text."""
    found: list[Literal] = []
    for predicate in predicates:
        for target in known.get(predicate, ()):
            inner = [target] if isinstance(target, Literal) else [
                text for form in _FORMS for text in objects.get(target, {}).get(form, ())
            ]  # fmt: skip
            found += [text for text in inner if isinstance(text, Literal)]
    return found


def _short(predicate: str) -> str:
    """Return a predicate in the words that people write."""
    if predicate.startswith(SKOS):
        return f"skos:{predicate.removeprefix(SKOS)}"
    return predicate.rstrip("/#").replace("#", "/").rpartition("/")[2] or predicate
