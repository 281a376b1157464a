"""Head of a building document: its format, its writer, units and frame."""

import re
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

from sqlalchemy import Column, func, select
from sqlalchemy.orm import Session

from archmodel.exchange.values import INSTANT, Schema, quoted, value_of
from archmodel.tables.base import UtcDateTime
from archmodel.tables.entries import Entry
from archmodel.tables.layout import SCHEMA_VERSION
from ground.errors import ExchangeError

FORMAT = "moma building"
FORMAT_VERSION = 1
"""Version of the document's grammar; that of the tables is `SCHEMA_VERSION`."""

TABLES = "tables"
"""Key of the object that holds the sections; it comes last."""

READ = (1, SCHEMA_VERSION)
"""Versions of the layout whose documents are read."""

SINCE: Mapping[int, Mapping[str, Mapping[str, Any]]] = {1: {"measurement": {"evidence": []}}}
"""Values that rows of older documents lack and must have, by version and table; what may be null is null."""

ADDED: Mapping[int, frozenset[str]] = {1: frozenset({"canon", "opinion_rule", "structure_result", "term"})}
"""Tables that older documents do not have, by version."""

UNITS = {
    "length": "m",
    "angle": "rad",
    "time": "s",
    "mass": "kg",
    "force": "N",
    "stress": "Pa",
    "others": "SI, without prefixes; a property of a material names its unit",
}
FRAME = "right-handed, z upwards, that of the site; survey.frame says how each survey was carried into it"

HEAD = ("format", "format_version", "moma", "schema_version", "recorded_until", "units", "frame")
"""Keys that come before `TABLES`."""


def head_of(session: Session) -> dict[str, Any]:
    """Return the head of a document; it holds no time of writing, so that an unchanged database gives the same."""
    latest = session.scalar(select(func.max(Entry.recorded_at)))
    instant = value_of(Column("recorded_at", UtcDateTime()))
    values = (
        FORMAT,
        FORMAT_VERSION,
        version("moma-masonry"),
        SCHEMA_VERSION,
        None if latest is None else instant.encode(latest),
        UNITS,
        FRAME,
    )
    return dict(zip(HEAD, values, strict=True))


def check_head(head: dict[str, Any], name: str) -> None:
    """Refuse documents of other programs, layouts of the tables, or units.

    Raises
    ------
    ExchangeError
        with the JSON path
    """
    expected = {"format": FORMAT, "format_version": FORMAT_VERSION, "schema_version": SCHEMA_VERSION}
    if type(older := head.get("schema_version")) is int and older in READ:
        expected["schema_version"] = older
    remedies = {
        "format": "give a document that `moma export` wrote",
        "format_version": "use the version of MOMA that wrote it",
        "schema_version": f"use the version of MOMA that wrote it; this one reads {' and '.join(map(str, READ))}",
        "units": "convert the numbers, then say these units",
        "frame": "carry the coordinates into that frame, then say it",
    }
    expected |= {"units": UNITS, "frame": FRAME}
    for key in HEAD:
        place = f"{name} $.{key}"
        if key not in head:
            raise ExchangeError("is missing", where=place, remedy=remedies.get(key))
        given = head[key]
        if key in expected and (type(given), given) != (type(expected[key]), expected[key]):
            what = f"is {quoted(given)}, expected {expected[key]!r}"
            raise ExchangeError(what, where=place, remedy=remedies[key])
    until = head["recorded_until"]
    if until is not None and not (type(until) is str and re.match(INSTANT, until)):
        what = f"is {quoted(until)}, expected the instant of the latest entry, or null"
        raise ExchangeError(what, where=f"{name} $.recorded_until")
    if type(head["moma"]) is not str:
        raise ExchangeError(
            f"is {quoted(head['moma'])}, expected the version of MOMA", where=f"{name} $.moma"
        )


def head_schema() -> dict[str, Schema]:
    """Return the JSON Schema of each key of the head."""
    return {
        "format": {"const": FORMAT, "description": "what the document is"},
        "format_version": {"const": FORMAT_VERSION, "description": "of the document's grammar"},
        "moma": {"type": "string", "description": "version of MOMA that wrote it"},
        "schema_version": {"const": SCHEMA_VERSION, "description": "of the layout of the tables"},
        "recorded_until": {
            "anyOf": [{"type": "string", "pattern": INSTANT}, {"type": "null"}],
            "description": "when the latest entry was recorded; null if there is none",
        },
        "units": {"const": UNITS, "description": "of all numbers"},
        "frame": {"const": FRAME, "description": "of all coordinates"},
    }
