"""Lists of stratigraphic relations: a table of unit, relation, unit, or GraphML of the Extended Matrix."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from sqlalchemy.orm import Session

from archmodel.assertions.declare import declare_phase
from archmodel.assertions.statements import PLAIN, Remark, say_note, say_of_phase
from archmodel.assertions.stratigraphy import (
    Thing,
    declare_units,
    say_stratigraphy,
    subjects_named,
    subjects_of,
)
from archmodel.query.dated import load_dates
from archmodel.store.revisions import NOTHING, RowCounts
from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.graphml import ABSOLUTE, DrawnUnit, read_graphml
from archmodel.stratigraphy.palette import COMMON
from archmodel.stratigraphy.stored import KIND_NOTE, load_drawn, load_links
from archmodel.tables.entries import Entry
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE, SYMMETRIC
from ground.errors import MomaError, SurveyError, UsageError
from ground.tables.columns import plain, spellings
from ground.tables.table import TableRow, read_table

_WORDS: Mapping[str, Sequence[str]] = {
    # English; German; Italian, as in the palette of the Extended Matrix
    "above": (
        *("copre", "sta sopra"),
        *("over", "overlies", "covers", "über", "liegt über", "überlagert", "liegt auf", "rests on"),
        "bedeckt",
    ),
    "below": (
        *("coperto da", "è coperto da", "sta sotto"),
        *("under", "underlies", "covered by", "unter", "liegt unter", "überlagert von", "supports"),
        "bedeckt von",
    ),
    "cuts": ("cut", "schneidet", "stört", "taglia"),
    "cut_by": (
        *("is cut by", "tagliato da", "è tagliato da", "geschnitten von", "wird geschnitten von"),
        "gestört von",
    ),
    "fills": ("fill of", "riempie", "füllt", "verfüllt", "Verfüllung von"),
    "filled_by": (
        *("is filled by", "riempito da", "è riempito da", "verfüllt von", "gefüllt von"),
        "wird verfüllt von",
    ),
    "abuts": ("butts against", "si appoggia a", "stößt an", "lehnt an", "läuft an", "setzt an", "zieht an"),
    "abutted_by": ("is abutted by", "gli si appoggia", "angebaut von", "gestoßen von"),
    "later_than": ("after", "is after", "jünger als", "nach"),
    "earlier_than": ("before", "is before", "älter als", "vor"),
    "bonded_with": (
        *("bonded", "si lega a", "bonds with", "im Verband mit", "verzahnt mit", "bindet in"),
        "Verband",
    ),
    "contemporary_with": ("same time as", "contemporary", "gleichzeitig mit", "zeitgleich", "zeitgleich mit"),
    "equal_to": (
        *("equal", "uguale a", "equals", "same as", "=", "gleich", "identisch mit", "ist gleich"),
        "entspricht",
    ),
}
"""Words for relations in tables, besides their names."""

_RELATIONS = {
    spelling: name
    for name in (*DEFINITIONS, *INVERSE.values())
    for word in (name, *_WORDS.get(name, ()))
    for spelling in (*spellings(word), word)
    if spelling
}
_REMEDY = "write three columns, unit, relation, unit: 101;above;102"


@dataclass(frozen=True)
class RelationList:
    """Relations of a file.

    Attributes
    ----------
    path : of the file
    units : that it names
    relations : line (0 without lines), unit, name of the relation, unit
    ignored : number of nodes and lines of a drawing that are no stratigraphy, by kind
    epochs : those of a drawing
    drawn : kind, title, epoch and parent of the units of a drawing
    own : this program wrote the drawing
    """

    path: str
    units: tuple[str, ...]
    relations: tuple[tuple[int, str, str, str], ...]
    ignored: Mapping[str, int] = field(default_factory=dict)
    epochs: tuple[Dated, ...] = ()
    drawn: Mapping[str, DrawnUnit] = field(default_factory=dict)
    own: bool = False


def relation_of(text: str) -> str | None:
    """Return the name of a relation, whatever the language; None if the word is not known."""
    return _RELATIONS.get(plain(text)) or _RELATIONS.get(text.strip())


def read_relation_list(path: Path, sheet: str | None = None) -> RelationList | None:
    """Read relations; None if the file is a table of something else.

    Raises
    ------
    UsageError, SurveyError
        at the line of the mistake
    """
    if path.suffix.lower() == ".graphml":
        drawn = read_graphml(path, relation_of)
        relations = tuple((0, link.subject, link.relation, link.target) for link in drawn.links)
        names = tuple(drawn.units)
        return RelationList(str(path), names, relations, drawn.ignored, drawn.epochs, drawn.units, drawn.own)
    try:
        table = read_table(path, _is_row, _REMEDY, sheet)
    except SurveyError as error:
        if "row of this table" in error.what:
            return None
        raise
    column = next(k for k, cell in enumerate(table.rows[0].cells) if k and relation_of(cell))
    relations = tuple(
        (
            row.line,
            table.name(row, column - 1, "the unit"),
            _relation(row, column, table.where(row.line)),
            table.name(row, column + 1, "the second unit"),
        )
        for row in table.rows
    )
    units = dict.fromkeys(code for _, unit, _, target in relations for code in (unit, target))
    return RelationList(str(path), tuple(units), relations)


def _is_row(cells: Sequence[str], commas: bool) -> bool:
    return any(relation_of(cell) for cell in cells[1:-1])


def _relation(row: TableRow, column: int, where: str) -> str:
    text = row.cells[column] if column < len(row.cells) else ""
    name = relation_of(text)
    if name is None:
        names = ", ".join((*DEFINITIONS, *dict.fromkeys(INVERSE.values())))
        raise UsageError(f"unknown relation {text[:40]!r}", where=where, remedy=f"relations are {names}")
    return name


def record_relation_list(session: Session, entry: Entry, listed: RelationList) -> dict[str, RowCounts]:
    """Record the relations of a list; units that are neither stones nor structures become stratigraphic units.

    Returns
    -------
    dict
        outcome by name: "unit", "stratigraphy"; of a drawing "note", of one with epochs "phase" and "of_phase"

    Raises
    ------
    UsageError
        for a unit in relation to itself, at its line; for a loop
    """
    if listed.own:
        listed = _without_known(session, listed)
    things = subjects_named(session, listed.units)
    missing = [code for code in listed.units if code not in things]
    outcome = {"unit": declare_units(session, entry, missing, listed.drawn)} if missing else {}
    things |= subjects_named(session, missing)
    for line, unit, relation, target in listed.relations:
        if unit == target:
            where = f"{listed.path}:{line}" if line else listed.path
            raise UsageError(f"{unit} is {relation} itself", where=where, remedy="name two units")
    relations = [(things[unit], relation, things[target]) for _, unit, relation, target in listed.relations]
    try:
        outcome["stratigraphy"] = say_stratigraphy(session, entry, relations, PLAIN)
    except UsageError as error:
        raise _at_lines(listed, error) from None
    outcome |= _record_notes(session, entry, listed, things)
    return outcome | _record_epochs(session, entry, listed, things)


def _without_known(session: Session, listed: RelationList) -> RelationList:
    """Leave out what a drawing that this program wrote shows of what holds already: it is nobody's new opinion."""
    stated = {(link.subject, link.relation, link.target) for link in load_links(session)}
    stated |= {(target, relation, unit) for unit, relation, target in stated if relation in SYMMETRIC}
    dates, kinds = load_dates(session, listed.units), load_drawn(session)
    drawn = {}
    for code, unit in listed.drawn.items():
        known, date = kinds.get(code, DrawnUnit()), dates.get(code)
        drawn[code] = replace(
            unit,
            kind=COMMON if unit.kind == known.kind else unit.kind,
            begins=None if unit.begins == known.begins else unit.begins,
            ends=None if unit.ends == known.ends else unit.ends,
            epoch=None if date is not None and date.phase == unit.epoch else unit.epoch,
        )
    relations = tuple(row for row in listed.relations if row[1:] not in stated)
    return replace(listed, relations=relations, drawn=drawn)


def _record_notes(
    session: Session, entry: Entry, listed: RelationList, things: Mapping[str, Thing]
) -> dict[str, RowCounts]:
    """Note the kinds of units that are not common ones, and their absolute dates."""
    by_note: dict[tuple[str, str], list[Thing]] = {}
    for code, unit in listed.drawn.items():
        kind = None if unit.kind == COMMON else unit.kind
        for key, text in zip((KIND_NOTE, *ABSOLUTE), (kind, unit.begins, unit.ends), strict=True):
            if text is not None:
                by_note.setdefault((key, text), []).append(things[code])
    counts = [
        say_note(session, entry, subjects_of(units), key, Remark(text=text))
        for (key, text), units in by_note.items()
    ]
    return {"note": sum(counts, NOTHING)} if counts else {}


def _record_epochs(
    session: Session, entry: Entry, listed: RelationList, things: Mapping[str, Thing]
) -> dict[str, RowCounts]:
    """Declare the epochs of a drawing as phases, and state them of its units."""
    outcome: dict[str, RowCounts] = {}
    for epoch in listed.epochs:
        declared = declare_phase(session, entry, epoch.phase, epoch.begins, epoch.ends)
        outcome["phase"] = outcome.get("phase", NOTHING) + declared
        units = [things[code] for code, unit in listed.drawn.items() if unit.epoch == epoch.phase]
        if units:
            stated = say_of_phase(session, entry, subjects_of(units), epoch.phase, PLAIN)
            outcome["of_phase"] = outcome.get("of_phase", NOTHING) + stated
    return outcome


def _at_lines(listed: RelationList, error: MomaError) -> UsageError:
    return UsageError(error.what, where=error.where or listed.path, remedy=error.remedy)
