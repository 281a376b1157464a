"""Registration of terms, which extend the vocabularies of observations, documents, materials and marks."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.validation import checked_choice, checked_label, checked_text
from archmodel.store.revisions import RowCounts, end_rows, supersede
from archmodel.tables.entries import Entry, held_at
from archmodel.tables.knowledge import Document, Observation
from archmodel.tables.terms import VOCABULARIES, Term, Vocabulary, keep, spelling_of, vocabulary
from ground.errors import UsageError

_LANGUAGE = re.compile(r"[a-z]{2,3}(-[A-Za-z0-9]{1,8})*")

Labels = Mapping[str, str | Sequence[str]]


def declare_term(
    session: Session,
    entry: Entry,
    of: str,
    name: str,
    definition: str | None = None,
    *,
    broader: str | None = None,
    labels: Labels | None = None,
    iri: str | None = None,
    words: Vocabulary | None = None,
) -> RowCounts:
    """Declare a term; what is declared otherwise supersedes what was held, what is left out stays.

    Parameters
    ----------
    of : vocabulary: observation, document, material or mark
    name : of the term; that of a built-in term gives that one labels
    definition : one sentence; types of observations and documents that are new need it
    broader : name of the term that it is a case of
    labels : by language, e.g. {"de": "Riss", "fr": ["fissure", "lézarde"]}; the first one is preferred
    iri : of the concept in a vocabulary, e.g. "http://vocab.getty.edu/aat/300011176"
    words : the vocabulary as it is held now, to which the term is added; None: it is loaded, which takes as long as it
        has terms

    Raises
    ------
    UsageError
        if the vocabulary, a language or the broader term is not known, a label means another term already, or the
        term would be broader than itself
    """
    checked_choice("vocabulary", of, VOCABULARIES)
    alone = words is None
    words = words or vocabulary(session, of)
    name = checked_label("term", name)
    current = _held(session, of, name) if name in words.labels else None
    meaning = checked_text("definition", definition) or (None if current is None else current.definition)
    if words.closed and name not in words.definitions and meaning is None:
        raise UsageError(f"the term {name} has no definition", remedy="give definition = …, one sentence")
    if broader is None and current is not None:
        broader = current.broader
    values: dict[str, Any] = {
        "definition": meaning,
        "broader": None if broader is None else _broader(words, name, broader),
        "labels": {
            **({} if current is None else current.labels),
            **_checked_labels(words, name, labels or {}),
        },
        "iri": checked_text("iri", iri) or (None if current is None else current.iri),
    }
    if current is not None and all(getattr(current, key) == value for key, value in values.items()):
        return RowCounts(unchanged=1)
    row = Term(vocabulary=of, name=name, **values)
    words.add(name, meaning or VOCABULARIES[of][0].get(name), values["broader"], values["labels"])
    outcome = _store(session, entry, current, row)
    if alone:
        keep(session, words)
    return outcome


def _store(session: Session, entry: Entry, current: Term | None, row: Term) -> RowCounts:
    if current is not None:
        supersede(session, entry, current, row)
        return RowCounts(replaced=1)
    row.entry_id = entry.id
    session.add(row)
    return RowCounts(new=1)


def _held(session: Session, of: str, name: str) -> Term | None:
    session.flush()
    return session.scalar(select(Term).where(Term.vocabulary == of, Term.name == name, held_at(Term)))


def withdraw_term(session: Session, entry: Entry, of: str, name: str) -> RowCounts:
    """Withdraw a term, with its labels; its history stays.

    Raises
    ------
    UsageError
        if there has never been such a term, others are cases of it, or observations are of a type that would be unknown
    """
    checked_choice("vocabulary", of, VOCABULARIES)
    rows = select(Term).where(Term.vocabulary == of, Term.name == name)
    current = session.scalar(rows.where(held_at(Term)))
    if current is None:
        if session.scalar(rows.limit(1)) is None:
            raise UsageError(f"there has never been a term {name[:40]!r} of {of}", remedy="check its name")
        return RowCounts(unchanged=1)
    narrower = [term for term, broader in vocabulary(session, of).broader.items() if broader == name]
    if narrower:
        what = f"the term {name} cannot be withdrawn: {', '.join(narrower)} are cases of it"
        raise UsageError(what, remedy="withdraw them first")
    used: dict[str, Any] = {
        "observation": select(Observation.id).where(Observation.type == name, held_at(Observation)),
        "document": select(Document.id).where(Document.type == name, held_at(Document)),
    }
    if of in used and name not in VOCABULARIES[of][0] and session.scalar(used[of].limit(1)) is not None:
        what = f"the term {name} cannot be withdrawn: it is the type of what is recorded as {of}"
        raise UsageError(what, remedy="withdraw it first")
    end_rows(session, entry, Term, [current.id])
    return RowCounts(withdrawn=1)


def _broader(words: Vocabulary, name: str, broader: str) -> str:
    """Return the name of the broader term, which must not be a case of the term itself."""
    above = words.named(broader)
    if words.closed is False and above not in words.definitions:
        raise UsageError(f"there is no term {broader[:40]!r} of {words.name}", remedy="declare it before")
    if name in words.above(above):
        raise UsageError(f"{name} would be a case of itself, through {above}", remedy="leave out broader")
    return above


def _checked_labels(words: Vocabulary, name: str, labels: Labels) -> dict[str, list[str]]:
    checked: dict[str, list[str]] = {}
    spellings = words.spellings()
    for language, names in labels.items():
        if not _LANGUAGE.fullmatch(language):
            raise UsageError(
                f"{language[:40]!r} is no language", remedy="write it as de, fr or pt-BR (BCP 47)"
            )
        several = [names] if isinstance(names, str) else list(names)
        checked[language] = [checked_label(f"label in {language}", term) for term in several]
        for label in checked[language]:
            meant = spellings.get(spelling_of(label), name)
            if meant != name:
                raise UsageError(f"the label {label!r} means {meant} already", remedy="choose another one")
    return checked
