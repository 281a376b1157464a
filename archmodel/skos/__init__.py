"""Vocabularies as SKOS files: read from Turtle, N-Triples and RDF/XML, written as Turtle.

Public: `Concept`, `Scheme`, `read_scheme` (concepts); `write_turtle` (writer).
"""
