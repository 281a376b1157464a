"""Answers of ``moma query`` in each of its formats."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from archmodel.query.api import asked_columns, attributes, find_faces, find_rows
from archmodel.query.attributes import Attribute
from moma.cli.text.formats import USUAL_COLUMNS, as_csv, as_geojson, as_json, as_table, shown_columns

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

__all__ = ["Question", "answer"]


@dataclass(frozen=True)
class Question:
    """Query of a database.

    Attributes
    ----------
    kind : of the entities, with its subkinds
    where : expressions, all of which hold
    run : run whose results count where an attribute names none; None: each stone's latest
    columns : attributes to show; None: those usual in the format
    everything : whether a table has every attribute
    flat : whether faces are given in the plane of the wall
    """

    kind: str
    where: tuple[str, ...] = ()
    run: int | None = None
    columns: Sequence[str] | None = None
    everything: bool = False
    flat: bool = False


def answer(session: "Session", question: Question, format: str) -> tuple[str, str]:
    """Answer a query in a format (table, csv, json, geojson), with a note for the person at the terminal."""
    known = {one.name: one for one in attributes(session, question.kind)}
    names = _names(session, question, known, format)
    asked = (question.kind, question.where, question.run, names)
    if format == "geojson":
        faces = find_faces(session, *asked)
        from archmodel.query.geojson import feature_collection, flattened  # and with it numpy

        return as_geojson(feature_collection(flattened(faces) if question.flat else faces)), ""
    rows = find_rows(session, *asked)
    if format == "json":
        return as_json(rows), ""
    if format == "csv":
        return as_csv(names, rows), ""
    if not rows:
        return "", f"no {question.kind} found" + "".join(f", where {one}" for one in question.where)
    if not question.everything and question.columns is None:
        names = shown_columns(names, rows, asked_columns(question.where, session, question.kind))
    units = {name: known[name.partition("@")[0]].unit for name in names}
    return as_table(units, rows), f"{len(rows)} found"


def _names(session: "Session", question: Question, known: Mapping[str, Attribute], format: str) -> list[str]:
    """Choose the columns to read from the database: no more than shown, since some need a search of their own."""
    if question.columns is not None:
        return list(dict.fromkeys(question.columns))
    if format != "table" or question.everything:
        return list(known)
    named = asked_columns(question.where, session, question.kind)
    usual = [name for name in known if name in USUAL_COLUMNS or name in named]
    return [*usual, *(name for name in named if name not in usual)]
