"""Terms of vocabularies that users extend: types of observations and documents, materials, marks.

A term is a concept in the sense of SKOS: a name, labels in several languages of which the first of each is preferred,
a definition, and the broader term of which it is a case. Labels are other ways to write the name; a broader term
stands for its narrower ones in questions.
"""

import difflib
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from sqlalchemy import ForeignKey, func, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from archmodel.tables.base import JSON_TYPE, Base
from archmodel.tables.entries import Recorded, held_at, held_index
from archmodel.tables.knowledge import OBSERVATIONS
from ground.errors import UsageError

DOCUMENT_TYPES: Mapping[str, str] = {
    "document": "a text: a charter, an account, a report",
    "drawing": "a plan, an elevation, a sketch",
    "photograph": "a picture taken by a camera",
}
"""Types of documents and their definitions."""

VOCABULARIES: Mapping[str, tuple[Mapping[str, str], bool]] = {
    "observation": (OBSERVATIONS, True),
    "document": (DOCUMENT_TYPES, True),
    "material": ({}, False),
    "mark": ({}, False),
}
"""Built-in terms of each vocabulary, and whether words that are no terms are refused there."""


class Term(Recorded, Base):
    """Term of a vocabulary.

    Attributes
    ----------
    vocabulary : one of VOCABULARIES
    name : unique in it among the terms that are held now
    definition : one sentence; None: that of the built-in term, or none
    broader : name of the term that it is a case of; None if there is none
    labels : by language (BCP 47), the preferred one first
    iri : identifier of the concept in the vocabulary that it was read from; None: none
    """

    __tablename__ = "term"
    __table_args__ = (held_index("ix_term_name", "vocabulary", "name"),)

    id: Mapped[int] = mapped_column(primary_key=True)
    vocabulary: Mapped[str]
    name: Mapped[str]
    definition: Mapped[str | None]
    broader: Mapped[str | None]
    labels: Mapped[dict[str, list[str]]] = mapped_column(JSON_TYPE)
    iri: Mapped[str | None]
    supersedes_id: Mapped[int | None] = mapped_column(ForeignKey("term.id"))


@dataclass
class Vocabulary:
    """Terms of a vocabulary, those of the program and those of a database; terms are added as they are declared.

    Attributes
    ----------
    name : one of VOCABULARIES
    definitions : by name of the term
    broader : of each narrower term
    labels : in each language, by name of the term
    closed : whether other words than terms are refused
    """

    name: str
    definitions: dict[str, str | None]
    broader: dict[str, str]
    labels: dict[str, Mapping[str, list[str]]]
    closed: bool
    _spellings: dict[str, str] | None = field(default=None, init=False, repr=False, compare=False)

    def add(
        self, name: str, definition: str | None, broader: str | None, labels: Mapping[str, list[str]]
    ) -> None:
        """Add a term, or put it in the place of what was held of it."""
        spellings = dict(self.spellings()) if self._spellings is None else self._spellings
        for label in _labels(self.labels.get(name, {})):
            if spellings.get(spelling_of(label)) == name:
                del spellings[spelling_of(label)]
        self.definitions[name] = definition
        self.labels[name] = labels
        self.broader.pop(name, None)
        if broader is not None:
            self.broader[name] = broader
        for label in (*_labels(labels), name):
            spellings[spelling_of(label)] = name
        self._spellings = spellings

    def named(self, text: str) -> str:
        """Return the name of the term that is written so: its name or a label in any language; in upper or lower case.

        Raises
        ------
        UsageError
            in a closed vocabulary, if there is none; names the nearest ones. In an open one the text itself is returned
        """
        if text in self.definitions:
            return text
        spellings = self.spellings()
        if (name := spellings.get(spelling_of(text))) is not None or not self.closed:
            return name or text
        likely = difflib.get_close_matches(spelling_of(text[:40]), spellings, n=3, cutoff=0.5)
        names = dict.fromkeys(spellings[term] for term in likely)
        remedy = f"did you mean {' or '.join(names)}?" if names else f"they are {', '.join(self.definitions)}"
        raise UsageError(
            f"unknown type of {self.name} {text[:40]!r}", remedy=f"{remedy} Or add it as a [[term]]"
        )

    def spellings(self) -> Mapping[str, str]:
        """Return the name of the term by each of its labels and by the name, in small letters."""
        if self._spellings is None:
            names = {
                spelling_of(label): name for name, labels in self.labels.items() for label in _labels(labels)
            }
            self._spellings = names | {spelling_of(name): name for name in self.definitions}
        return self._spellings

    def below(self, name: str) -> list[str]:
        """Return a term and all narrower ones."""
        narrower: dict[str, list[str]] = {}
        for term, broader in self.broader.items():
            narrower.setdefault(broader, []).append(term)
        names = {name: None}
        waiting = [name]
        for above in waiting:
            new = [term for term in narrower.get(above, ()) if term not in names]
            names |= dict.fromkeys(new)
            waiting += new
        return list(names)

    def above(self, name: str) -> list[str]:
        """Return a term and all broader ones."""
        names = {name: None}
        while (broader := self.broader.get(name)) is not None and broader not in names:
            names[broader] = None
            name = broader
        return list(names)


def _labels(labels: Mapping[str, list[str]]) -> Iterator[str]:
    return (label for several in labels.values() for label in several)


def spelling_of(text: str) -> str:
    """Return a name or label as it is compared: composed, in small letters, with blanks."""
    return unicodedata.normalize("NFC", text.strip()).casefold().replace("_", " ")


def term_for(session: Session, name: str, text: str) -> str:
    """Return the name of the term that a word stands for in a vocabulary; the word itself where it is none."""
    return vocabulary(session, name).named(text)


def vocabulary(session: Session, name: str) -> Vocabulary:
    """Return a vocabulary as it is held now; it is loaded once in a transaction, until its terms change."""
    session.flush()
    cached: tuple[object, object, Vocabulary] | None = session.info.get((Term, name))
    if cached is not None and cached[:2] == (session.get_transaction(), _stamp(session, name)):
        return cached[2]
    words = _loaded(session, name)
    keep(session, words)
    return words


def keep(session: Session, words: Vocabulary) -> None:
    """Keep a vocabulary, with what was just recorded, for the rest of the transaction."""
    session.flush()
    stamp = _stamp(session, words.name)
    session.info[(Term, words.name)] = (session.get_transaction(), stamp, words)


def _stamp(session: Session, name: str) -> tuple[int | None, int]:
    """Return the number of the last term and how many are superseded: any change changes one of these."""
    last, ended = session.execute(
        select(func.max(Term.id), func.count(Term.superseded_id)).where(Term.vocabulary == name)
    ).one()
    return last, ended


def _loaded(session: Session, name: str) -> Vocabulary:
    built_in, closed = VOCABULARIES[name]
    columns = select(Term.name, Term.definition, Term.broader, Term.labels)
    terms = session.execute(columns.where(Term.vocabulary == name, held_at(Term)).order_by(Term.id)).all()
    return Vocabulary(
        name,
        {**built_in, **{term.name: term.definition or built_in.get(term.name) for term in terms}},
        {term.name: term.broader for term in terms if term.broader is not None},
        {term.name: term.labels for term in terms},
        closed,
    )
