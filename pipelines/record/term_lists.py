"""Files of SKOS as terms: each concept one term, broader ones first."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.terms import declare_term
from archmodel.assertions.validation import checked_choice
from archmodel.skos.concepts import Concept, Scheme, read_scheme
from archmodel.store.revisions import NOTHING, RowCounts
from archmodel.tables.entries import Entry, held_at
from archmodel.tables.terms import VOCABULARIES, Term, Vocabulary, spelling_of, vocabulary
from ground.errors import UsageError


@dataclass(frozen=True)
class TermList:
    """Concepts of a file, and the vocabulary that those extend which do not name one."""

    path: str
    scheme: Scheme
    vocabulary: str | None


def read_term_list(path: Path, vocabulary: str | None) -> TermList:
    """Read concepts.

    Raises
    ------
    UsageError
        if the file is wrong, or does not say which vocabulary it extends
    """
    if vocabulary is not None:
        checked_choice("vocabulary", vocabulary, VOCABULARIES)
    scheme = read_scheme(path)
    if vocabulary is None and any(concept.vocabulary is None for concept in scheme.concepts):
        names = ", ".join(VOCABULARIES)
        remedy = f"give --vocabulary NAME: {names}"
        raise UsageError("the file does not say which vocabulary it extends", where=str(path), remedy=remedy)
    return TermList(str(path), scheme, vocabulary)


def record_term_list(
    session: Session, entry: Entry, listed: TermList
) -> tuple[dict[str, RowCounts], tuple[str, ...]]:
    """Declare the concepts as terms; return the outcome by name, and what was left out in words.

    Raises
    ------
    UsageError
        if a concept is broader than itself
    """
    recorder = _Recorder(session, entry, listed)
    counts = NOTHING
    for concept in _ordered(listed):
        try:
            counts += recorder.declare(concept)
        except UsageError as error:
            where = f"{listed.path}, {concept.iri}"
            raise UsageError(error.what, where=where, remedy=error.remedy) from None
    return {"term": counts}, tuple(_notes(listed, recorder.left_out))


class _Recorder:
    """Terms by the IRIs of their concepts, and counts of what no term can hold."""

    def __init__(self, session: Session, entry: Entry, listed: TermList) -> None:
        self._session, self._entry, self._listed = session, entry, listed
        terms = select(Term.iri, Term.name).where(Term.iri.is_not(None), held_at(Term))
        self._names = {str(row.iri): row.name for row in session.execute(terms)}
        self._taken = set(self._names.values())
        self._words: dict[str, Vocabulary] = {}
        self.left_out: Counter[str] = Counter()

    def declare(self, concept: Concept) -> RowCounts:
        """Declare one concept."""
        of = concept.vocabulary or self._listed.vocabulary or ""
        if of not in self._words:
            self._words[of] = vocabulary(self._session, of)
        words = self._words[of]
        spellings = words.spellings()
        name = self._names.get(concept.iri) or self._name(concept, words, spellings)
        published = (
            None if concept.vocabulary is not None and concept.iri.startswith("urn:moma:") else concept.iri
        )
        definition = concept.definition
        if definition is None and words.closed and name not in words.definitions:
            definition = f"as {concept.iri} defines it"
        labels = self._labels(concept, name, spellings)
        broader = [self._names[iri] for iri in concept.broader if iri in self._names]
        self.left_out["broader concepts that are not in the file"] += len(concept.broader) - len(broader)
        self.left_out["further broader concepts of a term"] += max(0, len(broader) - 1)
        self._names[concept.iri] = name
        self._taken.add(name)
        built_in = VOCABULARIES[of][0].get(name)
        if built_in is not None and definition == built_in:
            definition = None
        if built_in is not None and not (definition or labels or broader or published):
            return RowCounts(unchanged=1)
        return declare_term(
            self._session,
            self._entry,
            of,
            name,
            definition,
            broader=next(iter(broader), None),
            labels=labels,
            iri=published,
            words=words,
        )

    def _name(self, concept: Concept, words: Vocabulary, spellings: Mapping[str, str]) -> str:
        """Return the term that a preferred label names; a new name where that is another concept's."""
        preferred = [concept.name, *(several[0] for several in concept.labels.values() if several)]
        meant = next((spellings[key] for text in preferred if (key := spelling_of(text)) in spellings), None)
        if meant is None:
            return concept.name
        if meant not in self._taken:
            return meant
        last = concept.iri.rstrip("/#").replace("#", "/").rpartition("/")[2]
        return f"{concept.name} ({last})"

    def _labels(self, concept: Concept, name: str, spellings: Mapping[str, str]) -> dict[str, list[str]]:
        """Return the labels that mean no other term."""
        labels: dict[str, list[str]] = {}
        for language, several in concept.labels.items():
            free = [label for label in several if spellings.get(spelling_of(label), name) == name]
            self.left_out["labels that mean another term already"] += len(several) - len(free)
            if free:
                labels[language] = free
        return labels


def _ordered(listed: TermList) -> Iterator[Concept]:
    """Yield the concepts, broader ones before narrower ones."""
    concepts = {concept.iri: concept for concept in listed.scheme.concepts}
    done: dict[str, bool] = {}  # by IRI, False while its broader concepts are looked up
    for first in concepts:
        stack = [first]
        while stack:
            iri = stack[-1]
            if iri not in done:
                done[iri] = False
                for above in reversed(concepts[iri].broader):
                    if done.get(above) is False:
                        what = (
                            f"{concepts[iri].name} would be a case of itself, through {concepts[above].name}"
                        )
                        raise UsageError(
                            what, where=listed.path, remedy="leave out one of the broader concepts"
                        )
                    if above in concepts and above not in done:
                        stack.append(above)
                continue
            stack.pop()
            if not done[iri]:
                done[iri] = True
                yield concepts[iri]


def _notes(listed: TermList, left_out: Mapping[str, int]) -> Iterator[str]:
    """Yield what no term can hold."""
    yield from (f"left out: {count} {what}" for what, count in left_out.items() if count)
    if listed.scheme.ignored:
        counts = ", ".join(f"{count} {predicate}" for predicate, count in listed.scheme.ignored.items())
        yield f"left out, as a term has no such statements: {counts}"
