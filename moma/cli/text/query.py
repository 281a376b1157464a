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

        doubts = _disputes(session, question, names)
        return as_geojson(feature_collection(flattened(faces) if question.flat else faces)), doubts
    rows = find_rows(session, *asked)
    doubts = _disputes(session, question, names)
    if format == "json":
        return as_json(rows), doubts
    if format == "csv":
        return as_csv(names, rows), doubts
    if not rows:
        return "", f"no {question.kind} found" + "".join(f", where {one}" for one in question.where)
    if not question.everything and question.columns is None:
        names = shown_columns(names, rows, asked_columns(question.where, session, question.kind))
    units = {name: known[name.partition("@")[0]].unit for name in names}
    return as_table(units, rows), "; ".join(filter(None, (f"{len(rows)} found", doubts)))


def _disputes(session: "Session", question: Question, names: Sequence[str]) -> str:
    """Say of how many entities the answer rests on an opinion beside which there is another one."""
    asked = {*names, *asked_columns(question.where, session, question.kind)}
    notes = []
    for subject, resting in RESTS_ON.items():
        if not asked.isdisjoint(resting):
            where = (*question.where, f"disputed({subject})")
            rows = find_rows(session, question.kind, where, question.run, ["code"])
            if rows:
                some = f"{rows[0]['code']}{', …' if len(rows) > 1 else ''}"
                notes.append(f"the {subject} of {len(rows)} is disputed ({some})")
    return "; ".join(notes)


RESTS_ON = {
    "phase": ("phase", "phase_author", "phase_begins", "phase_ends"),
    "material": ("material", "material_author", "density", "tensile_strength", "compressive_strength"),
}
"""Attributes that rest on an opinion."""


def _names(session: "Session", question: Question, known: Mapping[str, Attribute], format: str) -> list[str]:
    """Choose the columns to read from the database: no more than shown, since some need a search of their own."""
    if question.columns is not None:
        return list(dict.fromkeys(question.columns))
    if format != "table" or question.everything:
        return list(known)
    named = asked_columns(question.where, session, question.kind)
    usual = [name for name in known if name in USUAL_COLUMNS or name in named]
    return [*usual, *(name for name in named if name not in usual)]
