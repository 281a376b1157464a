"""Concepts of SKOS: labels by language, definition, broader concepts; and what of a file is none of these."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import unquote

from archmodel.skos.triples import RDF, Literal, Node, Triple, read_triples, refuse
from archmodel.tables.terms import VOCABULARIES

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
