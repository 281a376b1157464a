"""Knowledge in tables and layers: a row for each stone, or several, with its phase, material, mark or remark.

Tables are text or workbooks, layers GeoJSON or GeoPackage, of which the attributes are read. Other columns are left
out and listed. A layer that MOMA wrote holds what the database knew then: values that hold still are nobody's new
opinion.
"""

import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session

from archmodel.assertions.declare import declare_material, declare_phase
from archmodel.assertions.statements import (
    PLAIN,
    Remark,
    say_made_of,
    say_mason_mark,
    say_note,
    say_observation,
    say_of_phase,
    without_replaced,
)
from archmodel.assertions.stratigraphy import subjects_named, subjects_of
from archmodel.query.api import find_rows
from archmodel.store.find_by_code import Subjects, held_or_none, no_such_code
from archmodel.store.revisions import NOTHING, RowCounts
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import (
    MadeOf,
    MasonMark,
    Material,
    Note,
    Observation,
    OfPhase,
    Phase,
    Statement,
)
from archmodel.tables.structures import Structure
from archmodel.tables.terms import term_for
from ground.errors import UsageError
from ground.tables.columns import places_of, plain
from ground.tables.table import read_table

COLUMNS: Mapping[str, Sequence[str]] = {
    # English; German
    "code": (
        *("code", "stone", "block", "stone no", "stone number", "stone id", "id", "unit", "structure"),
        *("Stein", "Steinnummer", "Stein Nr", "Quader", "Befund", "Struktur", "Bezeichnung", "Nr"),
    ),
    "phase": (
        *("phase", "building phase", "construction phase"),
        *("Bauphase", "Bauabschnitt", "Bauperiode", "Phase"),
    ),
    "material": (
        *("material", "stone type", "rock", "lithology"),
        *("Gestein", "Steinmaterial", "Baustoff", "Gesteinsart", "Steinart"),
    ),
    "mark": (
        *("mark", "mason mark", "masons mark", "mason's mark"),
        *("Steinmetzzeichen", "Zeichen", "Marke", "SMZ"),
    ),
    "observation": (
        *("observation", "damage", "type of damage", "damage type"),
        *("Schaden", "Schadensart", "Schadensbild", "Schadbild", "Beobachtung"),
    ),
    "remark": ("remark", "remarks", "note", "comment", "Bemerkung", "Bemerkungen", "Anmerkung", "Notiz"),
}
"""Names of columns by what they state; in doubt the first."""

_LAYERS = (".geojson", ".json", ".gpkg")
_MOMA_ATTRIBUTES = frozenset({"code", "depth_origin", "measurements"})
"""Attributes by which a layer is one that MOMA wrote."""

_NOTHING = frozenset({"", "-", "–", "?", "n/a", "null", "none"})
_STATED: Mapping[str, type[Statement]] = {
    "phase": OfPhase,
    "material": MadeOf,
    "mark": MasonMark,
    "observation": Observation,
    "remark": Note,
}
_REMEDY = "name the columns in the first line: stone;phase;material;mark"


@dataclass(frozen=True)
class AttributeList:
    """Statements of a table or layer about stones and structures.

    Attributes
    ----------
    path : of the file
    values : of each kind of statement, value and code, with the first line that states it
    left_out : names of the columns that are not recorded
    own : MOMA wrote it
    """

    path: str
    values: Mapping[str, Mapping[tuple[str, str], int]]
    left_out: tuple[str, ...]
    own: bool

    @property
    def codes(self) -> dict[str, int]:
        """Codes with the first line of each."""
        lines: dict[str, int] = {}
        for stated in self.values.values():
            for (_, code), line in stated.items():
                lines[code] = min(line, lines.get(code, line))
        return lines


def read_attribute_list(path: Path, columns: str | None = None, sheet: str | None = None) -> AttributeList:
    """Read a table or layer.

    Parameters
    ----------
    columns : map of columns with other names, e.g. "phase=Zeitstellung,code=Inventar"
    sheet : of a workbook

    Raises
    ------
    UsageError, SurveyError
        if the file cannot be read, or names no stones, or nothing that can be recorded
    """
    names, rows, where = _layer(path) if path.suffix.lower() in _LAYERS else _table(path, columns, sheet)
    places = _places(names, columns, where)
    if "code" not in places or len(places) < 2:
        what = "no column names the stones" if "code" not in places else "no column that can be recorded"
        remedy = f"columns are {', '.join(COLUMNS)}; name others by --columns phase=NAME,code=NAME"
        raise UsageError(f"{what}: {', '.join(names)[:200]}", where=where, remedy=remedy)
    values: dict[str, dict[tuple[str, str], int]] = {what: {} for what in places if what != "code"}
    for line, cells in rows:
        code = _text(cells, places["code"])
        if not code and any(_text(cells, k) for k in places.values()):
            raise UsageError("a row without the code of a stone", where=f"{path}:{line}", remedy="fill it in")
        for what, stated in values.items():
            text = _text(cells, places[what])
            if text.casefold() not in _NOTHING:
                stated.setdefault((text, code), line)
    _refuse_two(path, values)
    left_out = tuple(name for k, name in enumerate(names) if name and k not in places.values())
    return AttributeList(str(path), values, left_out, set(names) >= _MOMA_ATTRIBUTES)


def _refuse_two(path: Path, values: Mapping[str, Mapping[tuple[str, str], int]]) -> None:
    """Refuse two phases, or materials, of one stone."""
    for what in ("phase", "material"):
        before: dict[str, tuple[str, int]] = {}
        for (value, code), line in values.get(what, {}).items():
            if code in before:
                other, first = before[code]
                raise UsageError(
                    f"{what} of {code} is {value[:40]!r}, but {other[:40]!r} in line {first}",
                    where=f"{path}:{line}",
                    remedy=f"give each stone one {what}",
                )
            before[code] = (value, line)


def _text(cells: Sequence[str], place: int) -> str:
    return cells[place].strip() if place < len(cells) else ""


def _places(names: Sequence[str], columns: str | None, where: str) -> dict[str, int]:
    chosen: dict[str, int] = {}
    for part in filter(None, (text.strip() for text in (columns or "").split(","))):
        what, _, name = (text.strip() for text in part.partition("="))
        at = [k for k, known in enumerate(names) if known == name or plain(known) == plain(name) != ""]
        if what not in COLUMNS or len(at) != 1:
            problem = f"no column {name!r}" if what in COLUMNS else f"unknown column {what!r}"
            remedy = f"write WHAT=NAME with {', '.join(COLUMNS)}; the file has {', '.join(names)[:200]}"
            raise UsageError(problem, where="--columns", remedy=remedy)
        chosen[what] = at[0]
    taken = set(chosen.values())
    rest = ["" if k in taken else name for k, name in enumerate(names)]
    wanted = {what: alike for what, alike in COLUMNS.items() if what not in chosen}
    return places_of(rest, wanted, where, "leave one out, or choose by --columns") | chosen


_Rows = Iterator[tuple[int, Sequence[str]]]


def _table(path: Path, columns: str | None, sheet: str | None) -> tuple[Sequence[str], _Rows, str]:
    chosen = {plain(part.partition("=")[2]) for part in (columns or "").split(",") if "=" in part}

    def is_row(cells: Sequence[str], commas: bool) -> bool:
        """Return whether cells are values, not names of columns."""
        if len(cells) < 2:
            return False
        known = sum(_names_column(cell) or plain(cell) in chosen for cell in cells)
        return known < 2

    table = read_table(path, is_row, _REMEDY, sheet)
    if not table.titles:
        raise UsageError("no line names the columns", where=table.where(table.rows[0].line), remedy=_REMEDY)
    head = table.titles[-1]
    return head.cells, ((row.line, row.cells) for row in table.rows), table.where(head.line)


def _names_column(cell: str) -> bool:
    return bool(places_of([cell], COLUMNS, ""))


def _layer(path: Path) -> tuple[Sequence[str], _Rows, str]:
    features = _features_of_geopackage(path) if path.suffix.lower() == ".gpkg" else _features(path)
    names = list(dict.fromkeys(name for _, values in features for name in values))
    rows = (
        (number, ["" if values.get(name) is None else str(values.get(name)) for name in names])
        for number, values in features
    )
    return names, rows, str(path)


def _features(path: Path) -> list[tuple[int, Mapping[str, Any]]]:
    try:
        document = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        remedy = "export the layer again"
        raise UsageError(f"cannot be read: {error}", where=str(path), remedy=remedy) from error
    features = document.get("features") if isinstance(document, dict) else None
    if not isinstance(features, list) or not features or not all(isinstance(one, dict) for one in features):
        raise UsageError("no features of GeoJSON", where=str(path), remedy="export a layer as GeoJSON")
    rows: list[tuple[int, Mapping[str, Any]]] = []
    for number, feature in enumerate(features, start=1):
        values = feature.get("properties")
        values = dict(values) if isinstance(values, dict) else {}
        if not any(
            _names_column(str(name)) and "code" in places_of([str(name)], COLUMNS, "") for name in values
        ):
            values["code"] = feature.get("id")
        rows.append((number, values))
    return rows


def _features_of_geopackage(path: Path) -> list[tuple[int, Mapping[str, Any]]]:
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as connection:
            connection.row_factory = sqlite3.Row
            layers = [
                row[0]
                for row in connection.execute(
                    "SELECT table_name FROM gpkg_contents WHERE data_type IN ('features', 'attributes')"
                )
            ]
            if len(layers) > 1 and all(_is_own(connection, layer) for layer in layers):
                del layers[1:]  # the same stones in space and in elevation, with the same attributes
            if len(layers) != 1:
                remedy = "export the layer that is meant into a file of its own"
                names = ", ".join(layers) or "none"
                raise UsageError(f"{len(layers)} layers: {names}", where=str(path), remedy=remedy)
            quoted = layers[0].replace('"', '""')
            rows = connection.execute(f'SELECT * FROM "{quoted}"').fetchall()
    except sqlite3.Error as error:
        remedy = "export the layer again as GeoPackage"
        raise UsageError(f"cannot be read: {error}", where=str(path), remedy=remedy) from error
    return [
        (
            number,
            {
                name: row[name]
                for name in tuple(row.keys())
                if not isinstance(row[name], bytes) and name != "fid"
            },
        )
        for number, row in enumerate(rows, start=1)
    ]


def _is_own(connection: sqlite3.Connection, layer: str) -> bool:
    """Return whether MOMA wrote a layer of a GeoPackage."""
    names = {row[0] for row in connection.execute("SELECT name FROM pragma_table_info(?)", (layer,))}
    return names >= _MOMA_ATTRIBUTES


def record_attribute_list(
    session: Session, entry: Entry, listed: AttributeList, again: bool = False
) -> dict[str, RowCounts]:
    """Record what a table or layer states; phases and materials that are new get their names only.

    Parameters
    ----------
    again : the same file was recorded before: what its author replaced since stays replaced

    Returns
    -------
    dict
        outcome by name of the column, and of the new phases and materials by "new phase", "new material"

    Raises
    ------
    UsageError
        at the line that names no stone or structure
    """
    lines = listed.codes
    things = subjects_named(session, lines)
    for code, line in lines.items():
        if code not in things:
            error = no_such_code(session, code, Entity.code, Structure.code)
            raise UsageError(error.what, where=f"{listed.path}:{line}", remedy=error.remedy)
    outcome: dict[str, RowCounts] = {}
    for what, stated in listed.values.items():
        codes: dict[str, list[str]] = {}
        known = _known(session, what) if listed.own and what not in ("observation", "remark") else {}
        same = 0
        for value, code in stated:
            if known.get(code) == value:
                same += 1
            else:
                codes.setdefault(value, []).append(code)
        counts = RowCounts(unchanged=same)
        for value, named in codes.items():
            declared = _declare(session, entry, what, value)
            if declared.changes:
                outcome[f"new {what}"] = outcome.get(f"new {what}", NOTHING) + declared
            about = subjects_of(things[code] for code in named)
            if again:
                about = without_replaced(session, _STATED[what], about, entry.author)
            counts += _say(session, entry, what, value, about)
        outcome[what] = counts
    return outcome


def _known(session: Session, what: str) -> dict[str, str]:
    """Return what holds of each stone."""
    rows = find_rows(session, "entity", columns=["code", what])
    return {str(row["code"]): str(row[what]) for row in rows if row[what] is not None}


def _declare(session: Session, entry: Entry, what: str, value: str) -> RowCounts:
    if what == "phase" and held_or_none(session, Phase, value) is None:
        return declare_phase(session, entry, value)
    if what == "material" and held_or_none(session, Material, term_for(session, what, value)) is None:
        return declare_material(session, entry, value)
    return NOTHING


def _say(session: Session, entry: Entry, what: str, value: str, about: Subjects) -> RowCounts:
    match what:
        case "phase":
            return say_of_phase(session, entry, about, value, PLAIN)
        case "material":
            return say_made_of(session, entry, about, value, PLAIN)
        case "mark":
            return say_mason_mark(session, entry, about, value, remark=PLAIN)
        case "observation":
            return say_observation(session, entry, about, value, remark=PLAIN)
        case _:
            return say_note(session, entry, about, "remark", Remark(text=value))
