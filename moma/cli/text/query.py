"""Answers of ``moma query`` in each of its formats."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from archmodel.query.api import asked_columns, attributes, find_faces, find_rows
from archmodel.query.attributes import Attribute
from archmodel.query.tally import count_by, sorted_rows
from ground.errors import UsageError
from moma.cli.text.formats import USUAL_COLUMNS, as_csv, as_geojson, as_json, as_table, shown_columns

if TYPE_CHECKING:
    from sqlalchemy.orm import Session


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
    sort : attributes by which rows are ordered, with - before those whose largest value comes first
    top : most rows; None: all
    count_by : attributes by whose values entities are counted; None: they are listed
    share_of : number whose share each group of a count is given
    only_in : expression that is true throughout each group of a count
    """

    kind: str
    where: tuple[str, ...] = ()
    run: int | None = None
    columns: Sequence[str] | None = None
    everything: bool = False
    flat: bool = False
    sort: Sequence[str] = ()
    top: int | None = None
    count_by: Sequence[str] | None = None
    share_of: str | None = None
    only_in: str | None = None


def listed(names: str | None) -> list[str] | None:
    """Split names that commas separate; None stays None."""
    return None if names is None else [name.strip() for name in names.split(",")]


def answer(session: "Session", question: Question, format: str) -> tuple[str, str]:
    """Answer a query in a format (table, csv, excel, json, geojson), with a note for the person at the terminal."""
    attribute_of = {attribute.name: attribute for attribute in attributes(session, question.kind)}
    if question.count_by is not None:
        return _counts(session, question, attribute_of, format)
    names = _names(session, question, attribute_of, format)
    asked = (question.kind, question.where, question.run, names)
    if format == "geojson":
        if question.sort or question.top is not None:
            raise UsageError(
                "faces have no order", remedy="leave out --sort and --top, or give another format"
            )
        faces = find_faces(session, *asked)
        from archmodel.query.geojson import feature_collection, flattened  # and with it numpy

        doubts = _disputes(session, question, attribute_of, names)
        return as_geojson(feature_collection(flattened(faces) if question.flat else faces)), doubts
    order = [name.removeprefix("-") for name in question.sort]
    fetched = [*names, *(name for name in dict.fromkeys(order) if name not in names)]
    rows = sorted_rows(find_rows(session, *asked[:-1], fetched), question.sort)
    count, rows = len(rows), rows[: question.top]
    if format == "table":
        names = fetched
    rows = [{name: row[name] for name in names} for row in rows]
    doubts = _disputes(session, question, attribute_of, names)
    if format != "table":
        return _written(names, rows, format), doubts
    if not rows:
        where = "".join(f", where {condition}" for condition in question.where)
        return "", "; ".join(filter(None, (f"no {question.kind} found{where}", doubts)))
    if not question.everything and question.columns is None:
        asked_for = [*asked_columns(question.where, session, question.kind), *order]
        names = shown_columns(names, rows, asked_for)
    units = {name: attribute_of[name.partition("@")[0].lower()].unit for name in names}
    first = "" if count == len(rows) else f", of which the first {len(rows)} are shown"
    return as_table(units, rows), "; ".join(filter(None, (f"{count} found{first}", doubts)))


def _counts(
    session: "Session", question: Question, attribute_of: Mapping[str, Attribute], format: str
) -> tuple[str, str]:
    """Answer a query with counts of groups."""
    if format == "geojson":
        raise UsageError("counts have no faces", remedy="give --format csv or json")
    by = question.count_by or ()
    counted = count_by(
        session,
        question.kind,
        question.where,
        by,
        share_of=question.share_of,
        only_in=question.only_in,
        run=question.run,
    )
    names, rows = list(counted.units), list(counted.rows)
    if wrong := [name for name in question.sort if name.removeprefix("-") not in names]:
        raise UsageError(f"{wrong[0]} is not counted", remedy=f"sort by {', '.join(names)}")
    rows = sorted_rows(rows, question.sort)[: question.top]
    note = "; ".join(filter(None, (*counted.notes, _disputes(session, question, attribute_of, by))))
    if format != "table":
        return _written(names, rows, format), note
    if not rows:
        return "", "; ".join(filter(None, (f"no such group of {question.kind}", note)))
    return as_table(counted.units, rows), note


def _written(names: Sequence[str], rows: Sequence[Mapping[str, object]], format: str) -> str:
    """Write rows as JSON, or as CSV for programs or for spreadsheets."""
    if format == "json":
        return as_json(rows)
    return as_csv(names, rows, spreadsheet=format == "excel")


def _of_structures(attribute_of: Mapping[str, Attribute]) -> bool:
    """Return whether these are the attributes of structures, which have no zone."""
    return "zone" not in attribute_of


def _disputes(
    session: "Session", question: Question, attribute_of: Mapping[str, Attribute], names: Sequence[str]
) -> str:
    """Say of how many entities the answer rests on a disputed opinion, and what all stones of two campaigns tell."""
    if _of_structures(attribute_of):
        return ""
    asked = {*names, *asked_columns(question.where, session, question.kind)}
    notes = [*_campaigns(session, question, asked)]
    for subject, resting in RESTS_ON.items():
        if not asked.isdisjoint(resting):
            where = (*question.where, f"disputed({subject})")
            rows = find_rows(session, question.kind, where, question.run, ["code"])
            if rows:
                some = f"{rows[0]['code']}{', …' if len(rows) > 1 else ''}"
                notes.append(f"the {subject} of {len(rows)} is disputed ({some})")
    return "; ".join(notes)


def _campaigns(session: "Session", question: Question, asked: Collection[str]) -> Sequence[str]:
    """Say what displacements since an earlier campaign allow for, where the answer rests on them."""
    named = _CAMPAIGN.search(" ".join(question.where))
    if named is None and {"moved", "moved_sigma"}.isdisjoint(asked):
        return ()
    from archmodel.store.campaigns import campaigns, displacements  # and with it numpy

    surveys = None if named is None else campaigns(session).get(named[2])
    return displacements(session, surveys).remarks


_CAMPAIGN = re.compile(r"""moved_since\s*\(\s*(['"])(.*?)\1""", re.IGNORECASE)

RESTS_ON = {
    "phase": ("phase", "phase_author", "phase_begins", "phase_ends"),
    "material": ("material", "material_author", "density", "tensile_strength", "compressive_strength"),
}
"""Attributes that rest on an opinion."""


def _names(
    session: "Session", question: Question, attribute_of: Mapping[str, Attribute], format: str
) -> list[str]:
    """Choose the columns to read from the database: no more than shown, since some need a search of their own."""
    if question.columns is not None:
        return list(dict.fromkeys(question.columns))
    if format != "table" or question.everything:
        return list(attribute_of)
    named = asked_columns(question.where, session, question.kind)
    if _of_structures(attribute_of):  # they have few
        return list(attribute_of)
    usual = [name for name in attribute_of if name in USUAL_COLUMNS or name in named]
    return [*usual, *(name for name in named if name not in usual)]
