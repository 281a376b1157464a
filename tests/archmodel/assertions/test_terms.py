"""Terms extend vocabularies: with labels in several languages, and broader terms that stand for narrower ones."""

import pytest
from sqlalchemy.orm import Session

from archmodel.assertions.declare import declare_document, declare_material
from archmodel.assertions.statements import say_made_of, say_mason_mark, say_observation
from archmodel.assertions.terms import declare_term, withdraw_term
from archmodel.database.as_known import as_known
from archmodel.database.session import Database, open_database
from archmodel.describe.entity import describe
from archmodel.describe.schema_tree import schema
from archmodel.query.api import find
from archmodel.store.find_by_code import Subjects, subjects
from archmodel.store.revisions import RowCounts
from archmodel.tables import terms
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.terms import vocabulary
from ground.errors import QueryError, UsageError

GROWTH = "growth of plants on the face"


def entry_of(session: Session) -> Entry:
    return new_entry(session, "declaration", "glossary", author="A. Mason")


def codes(session: Session, expression: str) -> list[str]:
    return [one.code for one in find(session, "entity", [expression])]


def of(session: Session, *stones: str) -> Subjects:
    return subjects(session, stones)


def test_a_type_of_damage_is_named_in_any_language_and_asked_with_its_narrower_ones(filled: Database) -> None:
    with filled.session() as session:
        with pytest.raises(UsageError, match=r"unknown type of observation .Flechten.*as a"):
            say_observation(session, entry_of(session), of(session, "V1"), "Flechten")
        declare_term(session, entry_of(session), "observation", "growth", GROWTH, broader="stain")
        labels = {"de": ["Flechten", "Flechtenbewuchs"], "fr": "lichens"}
        declare_term(
            session, entry_of(session), "observation", "lichen", GROWTH, broader="growth", labels=labels
        )
        for word, stone in (("flechtenbewuchs", "V1"), ("lichens", "V2"), ("lichen", "V3")):
            say_observation(session, entry_of(session), of(session, stone), word, severity=1)
        assert (
            codes(session, "observed(lichen)") == codes(session, "observed(Flechten)") == ["V1", "V2", "V3"]
        )
        assert codes(session, "observed(stain, 1)") == ["V1", "V2", "V3"]
        assert codes(session, "observed(crack)") == []
        with pytest.raises(QueryError, match="unknown type of observation 'Flechte'; did you mean lichen"):
            codes(session, "observed(Flechte)")
        types = [one["type"] for one in describe(session, "V1")["knowledge"]["observations"]]  # type: ignore[index]
        assert types == ["lichen"]
        (first, second) = schema(session)["terms"]  # type: ignore[misc]
        assert (first["term"], second["term"], second["labels"]["fr"]) == ("growth", "lichen", ["lichens"])


def test_materials_marks_and_documents_have_terms_too(filled: Database) -> None:
    with filled.session() as session:
        declare_term(session, entry_of(session), "material", "limestone", labels={"de": "Kalkstein"})
        declare_term(session, entry_of(session), "material", "tufa", broader="Kalkstein")
        declare_term(session, entry_of(session), "mark", "key", labels={"de": "Schlüssel"})
        declare_term(
            session, entry_of(session), "document", "account", "a list of payments", broader="document"
        )
        declare_document(session, entry_of(session), "R7", "account", "the lodge's payments")
        for material, stone in (("Kalkstein", "V1"), ("tufa", "V2")):
            declare_material(session, entry_of(session), material)
            say_made_of(session, entry_of(session), of(session, stone), material)
        # one letter typed as two characters
        say_mason_mark(session, entry_of(session), of(session, "V1"), "Schlu\u0308ssel")
        assert (
            codes(session, "material = limestone")
            == codes(session, "material in (Kalkstein)")
            == ["V1", "V2"]
        )
        assert codes(session, "material != tufa") == ["V1"]
        assert codes(session, "material = tufa") == ["V2"]
        assert codes(session, "has_mark(Schlüssel)") == codes(session, "mark = key") == ["V1"]
        # a name that is no term means itself
        assert codes(session, "material = granite") == []


def test_terms_are_changed_and_withdrawn(filled: Database) -> None:
    with filled.session() as session:
        first = entry_of(session)
        assert declare_term(session, first, "observation", "lichen", GROWTH, broader="stain") == RowCounts(
            new=1
        )
        assert declare_term(session, entry_of(session), "observation", "lichen") == RowCounts(unchanged=1)
        again = declare_term(session, entry_of(session), "observation", "lichen", labels={"de": "Flechten"})
        assert again == RowCounts(replaced=1)
        assert vocabulary(session, "observation").broader == {"lichen": "stain"}
        say_observation(session, entry_of(session), of(session, "V1"), "Flechten")
        with pytest.raises(UsageError, match="the term lichen cannot be withdrawn: it is the type"):
            withdraw_term(session, entry_of(session), "observation", "lichen")
        with as_known(session, first.id) as then:
            assert vocabulary(then, "observation").labels == {"lichen": {}}
        declare_term(session, entry_of(session), "observation", "crack", labels={"de": "Riss"})
        assert vocabulary(session, "observation").named("riss") == "crack"
        assert withdraw_term(session, entry_of(session), "observation", "crack") == RowCounts(withdrawn=1)
        assert vocabulary(session, "observation").named("crack") == "crack"


def test_terms_that_contradict_others_are_refused(filled: Database) -> None:
    with filled.session() as session:
        declare_term(session, entry_of(session), "observation", "lichen", GROWTH, labels={"de": "Flechten"})
        declare_term(session, entry_of(session), "observation", "moss", GROWTH, broader="lichen")
        cases: list[tuple[dict[str, object], str]] = [
            ({"name": "algae"}, "the term algae has no definition"),
            (
                {"name": "algae", "definition": "x", "broader": "plants"},
                "unknown type of observation 'plants'",
            ),
            ({"name": "lichen", "broader": "moss"}, "lichen would be a case of itself, through moss"),
            ({"name": "algae", "definition": "x", "labels": {"de": "flechten"}}, "means lichen already"),
            (
                {"name": "algae", "definition": "x", "labels": {"Deutsch": "Algen"}},
                "'Deutsch' is no language",
            ),
            ({"name": "algae", "of": "plants"}, "unknown vocabulary 'plants'"),
        ]
        for given, message in cases:
            arguments: dict[str, object] = {"of": "observation", **given}
            with pytest.raises(UsageError, match=message):
                declare_term(session, entry_of(session), **arguments)  # type: ignore[arg-type]
        with pytest.raises(UsageError, match="moss are cases of it"):
            withdraw_term(session, entry_of(session), "observation", "lichen")
        with pytest.raises(UsageError, match="there has never been a term 'algae'"):
            withdraw_term(session, entry_of(session), "observation", "algae")


def test_a_vocabulary_is_loaded_once_however_many_terms_are_declared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lists of thousands of concepts are recorded in seconds; what was declared is known at once."""
    loads: list[str] = []
    load = terms._loaded
    monkeypatch.setattr(terms, "_loaded", lambda session, name: loads.append(name) or load(session, name))
    with open_database("sqlite://") as database, database.session() as session:
        entry = entry_of(session)
        for k in range(30):
            broader = f"t{(k - 1) // 2}" if k else None
            declare_term(session, entry, "mark", f"t{k}", labels={"de": f"Zeichen {k}"}, broader=broader)
        assert terms.term_for(session, "mark", "zeichen 29") == "t29"
        assert set(terms.vocabulary(session, "mark").below("t13")) == {"t13", "t27", "t28"}
        assert loads == ["mark"]
        # labels that were replaced mean nothing any more
        declare_term(session, entry, "mark", "t29", labels={"de": "Fisch"})
        assert terms.term_for(session, "mark", "Zeichen 29") == "Zeichen 29"
        withdraw_term(session, entry, "mark", "t29")
        assert terms.term_for(session, "mark", "Fisch") == "Fisch"
