"""Rows of knowledge as plain values under the names that users know, for descriptions, histories and matching."""

from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import (
    Decision,
    DepthEvidence,
    MadeOf,
    MasonMark,
    Note,
    Observation,
    OfPhase,
    Statement,
)
from archmodel.tables.stratigraphy import Stratigraphy

Values = dict[str, object]


def statement_values(statement: Statement) -> Values:
    """Return the known values of a statement; the session must be open.

    Returns
    -------
    dict
        material, phase, sign, place, type, severity, at [m], value, sigma [m], relation, to or key, as its
        kind has them; then
        by (author, where that is not who recorded it), certainty, text, document (code), locator, observed_on
    """
    document = statement.document
    seen, author = statement.observed_on, statement.author
    values = {
        **_own(statement),
        "by": author if author != statement.entry.author else None,
        "certainty": statement.certainty,
        "text": statement.text,
        "document": None if document is None else document.code,
        "locator": statement.locator,
        "observed_on": None if seen is None else seen.isoformat(),
    }
    return {name: value for name, value in values.items() if value is not None}


def entry_values(entry: Entry) -> Values:
    """Describe an act of recording: number, action, author, source, time."""
    return {
        "entry": entry.id,
        "action": entry.action,
        "author": entry.author,
        "source": entry.source,
        "recorded_at": entry.recorded_at.isoformat(timespec="seconds"),
    }


def _own(statement: Statement) -> Values:
    match statement:
        case MadeOf(material=material):
            return {"material": None if material is None else material.name}
        case OfPhase(phase=phase):
            return {"phase": None if phase is None else phase.name}
        case MasonMark(sign=sign, place=place):
            return {"sign": sign, "place": place}
        case Observation(x=None):
            return {"type": statement.type, "severity": statement.severity, "place": statement.place}
        case Observation(x=x, y=y, z=z):
            rest = {"severity": statement.severity, "place": statement.place}
            return {"type": statement.type, **rest, "at": [x, y, z]}
        case DepthEvidence(value=value, sigma=sigma):
            return {"value": value, "sigma": sigma}
        case Stratigraphy(relation=relation):
            target = statement.object_structure or statement.object_entity
            return {"relation": relation, "to": None if target is None else target.code}
        case Note(key=key):
            return {"key": key}
        case Decision(about=about, chosen=chosen):
            choice = {} if chosen is None else {**_own(chosen), "of": chosen.author}
            return {"about": about, **choice}
        case _:
            return {}
