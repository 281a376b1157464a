"""Vocabularies of SKOS: a published one becomes terms, terms come back as they were, and nothing is lost in silence."""

from collections.abc import Callable
from pathlib import Path

import pytest

from archmodel.database.session import open_database
from archmodel.query.api import find_rows
from archmodel.store.revisions import RowCounts
from archmodel.tables.terms import Term, vocabulary
from ground.errors import UsageError
from pipelines.record.export.export import export_file
from pipelines.record.record import record
from tests.archmodel.skos.test_readers import TURTLE
from tests.archmodel.stones import box_stone, store

TERMS = """
[record]
author = "A"

[[term]]
vocabulary = "observation"
name = "lichen"
broader = "stain"
definition = "growth of \\"lichen\\" on the face"
labels = { de = ["Flechten", "Flechtenbewuchs"], pt-BR = "líquen" }

[[term]]
vocabulary = "observation"
name = "crack"
labels = { de = "Riss" }

[[term]]
vocabulary = "mark"
name = "star of six points"
iri = "http://marks.example.org/6"
"""


@pytest.fixture
def url(new_url: Callable[[], str]) -> str:
    made = new_url()
    store(made, [box_stone("S1", "header", course=1, at=(0.0, 0.0, 0.0))])
    return made


def file(tmp_path: Path, name: str, text: str) -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def terms(url: str) -> list[tuple[object, ...]]:
    with open_database(url) as database, database.session(read_only=True) as session:
        rows = session.query(Term).filter(Term.superseded_id.is_(None))
        return sorted(
            (row.vocabulary, row.name, row.definition, row.broader, str(row.labels), row.iri) for row in rows
        )


def test_a_published_vocabulary_becomes_terms_that_questions_understand(url: str, tmp_path: Path) -> None:
    path = file(tmp_path, "stones.ttl", TURTLE)
    report = record([path], url, author="A", source="stones.example.org", vocabulary="material").files[0]
    assert report.tables == {"term": RowCounts(new=3)}
    assert report.notes == ("left out, as a term has no such statements: 1 skos:exactMatch",)
    table = file(tmp_path, "t.csv", "code;Gestein\nS1;Kalkstein\n")
    record([table], url, author="A", source="seen")
    with open_database(url) as database, database.session(read_only=True) as session:
        assert find_rows(session, "entity", ["material = 'sedimentary rock'"], columns=["material"]) == [
            {"material": "limestone"}
        ]
    again = record([path], url, author="B", source="stones.example.org", vocabulary="material").files[0]
    assert again.outcome.changes == 0


def test_terms_come_back_as_they_were(url: str, tmp_path: Path, new_url: Callable[[], str]) -> None:
    record([file(tmp_path, "terms.toml", TERMS)], url)
    export_file(url, tmp_path / "terms.ttl")
    other = new_url()
    report = record([tmp_path / "terms.ttl"], other, author="A", source="terms.ttl").files[0]
    assert report.notes == ()
    assert terms(other) == terms(url)
    export_file(other, tmp_path / "again.ttl")
    assert (tmp_path / "again.ttl").read_bytes() == (tmp_path / "terms.ttl").read_bytes()


def test_a_label_that_means_another_term_is_left_out_and_counted(url: str, tmp_path: Path) -> None:
    path = file(
        tmp_path,
        "v.ttl",
        "@prefix s: <http://www.w3.org/2004/02/skos/core#> . @prefix : <http://e/> .\n"
        ':1 s:prefLabel "cracks"@en ; s:altLabel "crack"@en , "fissure"@fr ; s:broader :2 , :3 , :4 .\n'
        ':2 s:prefLabel "damage"@en . :3 s:prefLabel "Damage"@en , "dégât"@fr .\n',
    )
    report = record([path], url, author="A", source="v", vocabulary="observation").files[0]
    assert report.tables == {"term": RowCounts(new=3)}
    assert report.notes == (
        "left out: 2 labels that mean another term already",
        "left out: 1 broader concepts that are not in the file",
        "left out: 1 further broader concepts of a term",
    )
    with open_database(url) as database, database.session(read_only=True) as session:
        words = vocabulary(session, "observation")
    assert words.broader == {"cracks": "damage"}
    assert words.named("fissure") == "cracks"
    assert words.named("dégât") == "Damage (3)"
    assert words.definitions["cracks"] == "as http://e/1 defines it"


@pytest.mark.parametrize(
    ("body", "options", "said"),
    [
        (':1 s:prefLabel "a"@en .', {}, "does not say which vocabulary"),
        (
            ':1 s:prefLabel "a"@en ; s:broader :2 . :2 s:prefLabel "b"@en ; s:broader :1 .',
            {"vocabulary": "material"},
            "would be a case of itself, through",
        ),
        (':1 s:prefLabel "a"@en ; s:broader :1 .', {"vocabulary": "material"}, "would be a case of itself"),
    ],
)
def test_what_cannot_be_a_vocabulary_is_refused_and_changes_nothing(
    url: str, tmp_path: Path, body: str, options: dict[str, str], said: str
) -> None:
    prefixes = "@prefix s: <http://www.w3.org/2004/02/skos/core#> . @prefix : <http://e/> .\n"
    path = file(tmp_path, "v.ttl", prefixes + body)
    with pytest.raises(UsageError, match=said):
        record([path], url, author="A", source="v", **options)
    assert terms(url) == []
