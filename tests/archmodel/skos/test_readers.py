"""Turtle and RDF/XML: one vocabulary in both, the corners of both grammars, and what is refused at its line."""

from pathlib import Path

import pytest

from archmodel.skos.concepts import SKOS, Concept, read_scheme
from ground.errors import UsageError

TURTLE = """\
@prefix skos: <http://www.w3.org/2004/02/skos/core#> .
@prefix : <http://stone.example.org/> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
:scheme a skos:ConceptScheme ; skos:prefLabel "Stones"@en .
:176 a skos:Concept ; skos:inScheme :scheme ; # a comment; not a statement.
  skos:prefLabel "limestone"@EN , "Kalkstein"@de , "calcare"@it ;
  skos:altLabel "limestones"@en , "pierre calcaire"@fr-FR ; skos:hiddenLabel "lime stone"@en ;
  skos:broader :175 ; skos:exactMatch <http://other.example.org/1> ; skos:scopeNote :n .
:n rdf:value \"\"\"Rock of
"calcite".\"\"\"@en .
:175 a skos:Concept ; skos:prefLabel 'sedimentary rock'@en ; skos:narrower :177 .
:177 a skos:Concept ; skos:prefLabel "tuff"@en .
"""
XML = """\
<?xml version="1.0" encoding="UTF-8"?>
<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:skos="http://www.w3.org/2004/02/skos/core#"
    xml:base="http://stone.example.org/">
  <skos:ConceptScheme rdf:about="scheme"><skos:prefLabel xml:lang="en">Stones</skos:prefLabel></skos:ConceptScheme>
  <skos:Concept rdf:about="176" xml:lang="en">
    <skos:inScheme rdf:resource="scheme"/>
    <skos:prefLabel xml:lang="EN">limestone</skos:prefLabel>
    <skos:prefLabel xml:lang="de">Kalkstein</skos:prefLabel>
    <skos:prefLabel xml:lang="it">calcare</skos:prefLabel>
    <skos:altLabel>limestones</skos:altLabel>
    <skos:altLabel xml:lang="fr-FR">pierre calcaire</skos:altLabel>
    <skos:hiddenLabel>lime stone</skos:hiddenLabel>
    <skos:broader><rdf:Description rdf:about="175" skos:prefLabel="sedimentary rock"><rdf:type
      rdf:resource="http://www.w3.org/2004/02/skos/core#Concept"/></rdf:Description></skos:broader>
    <skos:exactMatch rdf:resource="http://other.example.org/1"/>
    <skos:scopeNote rdf:parseType="Resource"><rdf:value>Rock of
      "calcite".</rdf:value></skos:scopeNote>
  </skos:Concept>
  <skos:Concept rdf:about="177" skos:prefLabel="tuff" xml:lang="en"><skos:broader rdf:resource="175"/></skos:Concept>
</rdf:RDF>
"""


@pytest.mark.parametrize(("name", "text"), [("v.ttl", TURTLE), ("v.rdf", XML), ("v.rdf", TURTLE)])
def test_a_vocabulary_as_heritage_data_is_published_is_read(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    scheme = read_scheme(path)
    base = "http://stone.example.org/"
    limestone = Concept(
        f"{base}176",
        {
            "en": ("limestone", "limestones", "lime stone"),
            "de": ("Kalkstein",),
            "it": ("calcare",),
            "fr-FR": ("pierre calcaire",),
        },
        'Rock of "calcite".',
        (f"{base}175",),
    )
    tuff = Concept(f"{base}177", {"en": ("tuff",)}, broader=(f"{base}175",))
    rock = Concept(f"{base}175", {"en": ("sedimentary rock",)})
    assert sorted(scheme.concepts, key=lambda one: one.iri) == [rock, limestone, tuff]
    assert (limestone.name, tuff.name) == ("limestone", "tuff")
    assert scheme.ignored == {"skos:exactMatch": 1}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<a> <b> <c>", "ends within a statement"),
        ("\n<a> <b> x:c .", ':2: it is not Turtle: Prefix "x:" not bound'),
        ("<a> <b> <c> .\n<d> <e> ~ .", ":2: it is not Turtle"),
        ("<a> <b> " + "[ <p> " * 2000, "brackets within brackets"),
        ('<a> <b> "open .', "ends within a statement or a text"),
        ("<a> <b> <c> .", "no concepts of SKOS"),
        ("", "no concepts of SKOS"),
    ],
)
def test_what_is_no_turtle_is_refused_at_its_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "v.ttl"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError) as refused:
        read_scheme(path)
    assert said in str(refused.value)


@pytest.mark.parametrize("text", ["<rdf", '<!DOCTYPE x [<!ENTITY a "b">]><x/>', "<x/>"])
def test_xml_that_is_no_vocabulary_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "v.rdf"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError):
        read_scheme(path)


def test_labels_that_are_nodes_are_read(tmp_path: Path) -> None:
    path = tmp_path / "v.ttl"
    path.write_text(
        f"@prefix s: <{SKOS}> . @prefix x: <http://www.w3.org/2008/05/skos-xl#> .\n"
        '<http://e/1> x:prefLabel [ x:literalForm "tuff"@en ] ; x:altLabel [ x:literalForm "tufa"@en ] ;'
        ' s:notation "7" .'
    )
    concept = read_scheme(path).concepts[0]
    assert (concept.labels, concept.notation, concept.name) == ({"en": ("tuff", "tufa")}, "7", "tuff")
