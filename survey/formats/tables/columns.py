"""Columns of tables: what each is, by its name in five languages, and in which unit.

Names are compared without case, accents, blanks and punctuation. A unit may follow in brackets, after ``in``, or after
an underscore: ``x [mm]``, ``Tiefe (cm)``, ``Höhe in m``, ``x_mm``. A column without a name is skipped: spreadsheets and
pandas write their index so.
"""

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain

from ground.errors import SurveyError, UsageError
from ground.tables.columns import (
    COORDINATES,
    POINT,
    SIGMA,
    length_scale,
    meaning_of,
    plain,
    spellings,
    unit_of,
)
from ground.tables.numbers import shown
from survey.conventions import CORNERS, NEARLY

ALIASES: Mapping[str, Sequence[str]] = {
    # English; German; French; Italian; Spanish
    "block": (
        *("block", "stone", "block id", "stone id", "stone no", "stone number", "stone code", "block code"),
        *(
            *("Stein", "Steinnummer", "Stein Nr", "Quader", "Stein ID", "Steincode"),
            *("Steinbezeichnung", "Stein Bez"),
        ),
        *("pierre", "bloc", "numéro de pierre", "n° pierre", "id pierre", "code pierre"),
        *("pietra", "blocco", "concio", "sasso", "numero pietra", "n pietra", "id pietra"),
        *("piedra", "bloque", "sillar", "dovela", "número de piedra", "n piedra", "id piedra"),
    ),
    "kind": (
        *("kind", "type", "stone type", "stone kind", "block type", "Art", "Typ", "Steinart", "Steintyp"),
        *("genre", "type de pierre", "nature", "tipo", "tipo di pietra", "genere", "tipo de piedra", "clase"),
    ),
    "course": (
        *("course", "course no", "layer", "row", "Schicht", "Steinlage", "Lage", "Steinschicht", "Reihe"),
        *("assise", "rang", "lit", "corso", "filare", "fila", "hilada"),
    ),
    "role": (
        *("role", "point type", "point role", "point kind", "Rolle", "Punktart", "Punkttyp", "Punktrolle"),
        *("type point", "type pt"),
        *("rôle", "type de point", "ruolo", "tipo punto", "tipo di punto", "rol", "papel", "tipo de punto"),
    ),
    **COORDINATES,
    "sigma": SIGMA,
    "depth": (
        *("depth", "stone depth", "block depth", "Tiefe", "Steintiefe", "Einbindetiefe"),
        *("profondeur", "profondità", "profundidad"),
    ),
    "depth_sigma": (
        *("depth sigma", "sigma depth", "depth std", "Sigma Tiefe", "Tiefe Sigma", "Genauigkeit Tiefe"),
        *("sigma profondeur", "sigma profondità", "sigma profundidad"),
    ),
    "depth_source": (
        *("depth source", "source depth", "Quelle Tiefe", "Tiefe Quelle", "source profondeur"),
        *("fonte profondità", "fuente profundidad"),
    ),
    "depth_origin": (
        "depth origin",
        "origin depth",
        "Herkunft Tiefe",
        "Tiefe Herkunft",
        "origine profondeur",
    ),
    "zone": (
        *("zone", "part", "sector", "bay", "wall", "facade", "Bereich", "Zone", "Bauteil", "Wand"),
        *("Joch", "Fassade", "secteur", "mur", "façade", "travée", "zona", "settore", "muro", "facciata"),
        *("campata", "sector", "fachada", "tramo"),
    ),
    "station": (
        *("station", "setup", "instrument station", "Standpunkt", "Stationierung"),
        *("stazione", "estación"),
    ),
    "name": POINT,
    "description": (
        *("description", "desc", "point code", "feature code", "code", "Beschreibung", "Punktcode", "text"),
        *("codice", "descrizione", "código", "descripción", "codigo punto"),
    ),
    "outline": (
        *("wkt", "wkt geom", "geometry", "geom", "the geom", "outline", "shape wkt", "Umriss"),
        "contour",
    ),
}
"""Names of columns by what they are; in doubt the first."""

_FALLBACK = ("name", "description")  # of the stone, if it has no column of its own: `ID`, `Nr`, `Code`
_LENGTHS = ("x", "y", "z", "sigma", "depth", "depth_sigma")
_MISSPELT = (
    *("course", "depth", "depth sigma", "depth source", "sigma", "station", "Tiefe", "Schicht", "profondeur"),
    *("profondità", "profundidad", "assise", "filare", "hilada"),
)
_ALIKE = NEARLY  # similarity from which an unknown name is taken for a misspelt one


@dataclass(frozen=True)
class ColumnMap:
    """Columns named by the user, before all aliases.

    Attributes
    ----------
    names : name of the column, or its number from 1, by what it is
    ignored : names of columns to leave out; "*": all that are not known
    """

    names: Mapping[str, str] = field(default_factory=dict)
    ignored: frozenset[str] = frozenset()

    @property
    def numbered(self) -> bool:
        """True if all columns are given by number, so that the table may have no names."""
        return bool(self.names) and all(name.isascii() and name.isdigit() for name in self.names.values())


@dataclass(frozen=True)
class Columns:
    """The columns of one table.

    Attributes
    ----------
    count : number of fields in a row
    at : place of each column that is known, from 0
    scales : unit [m] of those that state one
    notes : place and name of the columns that are kept as notes
    joined : places of those that name a stone together, joined by hyphens in a further field; none: it has its own
    corners : places of x, y and z of each corner, in a table with a row for each stone: x1, y1, z1, x2, …
    """

    count: int
    at: Mapping[str, int]
    scales: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[tuple[int, str], ...] = ()
    joined: tuple[int, ...] = ()
    corners: tuple[tuple[int, int, int], ...] = ()


def read_map(text: str | None) -> ColumnMap:
    """Read a map such as ``block=Stein,x=Rechts [m],ignore=Datum``; a name may be of several, ``block=Lage+Nr``.

    Raises
    ------
    UsageError
        if it is wrong
    """
    names: dict[str, str] = {}
    ignored: set[str] = set()
    for part in (text or "").split(","):
        if not part.strip():
            continue
        what, equals, name = (word.strip() for word in part.partition("="))
        allowed = ", ".join((*ALIASES, "ignore"))
        if not equals or not name:
            raise UsageError(f"{part.strip()!r} is not of the form WHAT=COLUMN", where="--columns",
                             remedy="write e.g. block=Stein,x=Rechts,ignore=Datum")  # fmt: skip
        if what == "ignore":
            ignored.add(plain(name) or name)
        elif what not in ALIASES:
            alike = difflib.get_close_matches(what, ALIASES, n=1)
            raise UsageError(f"unknown column {what!r}", where="--columns",
                             remedy=f"did you mean {alike[0]}?" if alike else f"write one of {allowed}")  # fmt: skip
        elif what in names:
            raise UsageError(f"{what} is given twice", where="--columns", remedy="give it once")
        else:
            names[what] = name
    return ColumnMap(names, frozenset(ignored))


_MEANINGS: Mapping[str, str] = {
    spelling: what
    for what, names in reversed(list(ALIASES.items()))
    for name in (*names, what)
    for spelling in spellings(name)
}


def find_columns(names: Sequence[str], column_map: ColumnMap, where: str, codes: bool) -> Columns:
    """Find out what the columns of a table are.

    Parameters
    ----------
    names : of the columns, in order
    column_map : by the user
    where : place of the names, for errors
    codes : whether a template is given for descriptions, so that ``Code`` is one, not the name of the stone

    Raises
    ------
    SurveyError
        naming a column that is missing, there twice, or misspelt
    """
    names = list(names)
    while names and not names[-1]:
        del names[-1]
    at: dict[str, int] = {}
    scales: dict[str, float] = {}
    free: list[int] = []
    mine, joined = _mine(names, column_map, where)
    for what, k in mine.items():
        _take(what, k, names, at, scales, where)
    corners = () if {"x", "y", "z"} & mine.keys() else _corners(names)
    taken = {*mine.values(), *chain(*corners)}
    for k, name in enumerate(names):
        if k in taken or not name or re.fullmatch(r"(?i)unnamed: \d+", name):
            continue
        kind = kind_of_column(name)
        if k in joined and kind in (None, *_FALLBACK, *mine):
            continue
        if {plain(name), plain(unit_of(name)[0])} & column_map.ignored or (
            kind is None and "*" in column_map.ignored
        ):
            continue
        if kind is None or kind in mine or (kind in _FALLBACK and kind in at):
            free.append(k)
        elif kind in at:
            raise SurveyError(
                f"columns {shown(names[at[kind]])} and {shown(name)} are both {kind}",
                where=where,
                remedy=f'say which with --columns "{kind}=…", and leave out others with ignore=…',
            )
        else:
            _take(kind, k, names, at, scales, where)
    if corners:
        at["outline"] = len(names)
        for axis, k in zip("xyz", corners[0], strict=True):
            if (scale := length_scale(names[k], where)) is not None:
                scales[axis] = scale
    free += _fall_back(at, codes)
    _check_missing(names, at, where)
    for k in free:
        _check_spelling(names[k], at, where)
    return Columns(len(names), at, scales, tuple((k, names[k]) for k in sorted(free)), joined, corners)


def kind_of_column(name: str) -> str | None:
    """Return what a column of this name is; None if it is not known."""
    return meaning_of(name, _MEANINGS)


def _corners(names: Sequence[str]) -> tuple[tuple[int, int, int], ...]:
    """Return the places of x, y and z of numbered corners, three at least, X1, Y1, Z1, X2, …; or nothing."""
    places: dict[int, dict[str | None, int]] = {}
    for k, name in enumerate(names):
        if match := re.fullmatch(r"(.*\D)[ _]?([0-9]{1,2})", unit_of(name)[0]):
            places.setdefault(int(match[2]), {})[kind_of_column(match[1])] = k
    whole = [places[number] for number in sorted(places) if {"x", "y", "z"} <= places[number].keys()]
    return tuple((one["x"], one["y"], one["z"]) for one in whole) if len(whole) >= CORNERS else ()


def _mine(names: Sequence[str], column_map: ColumnMap, where: str) -> tuple[dict[str, int], tuple[int, ...]]:
    """Return the places of columns that the user gives, and of those that name a stone together, in a further field."""
    columns = column_map.names.get("block", "").split("+")
    joined: tuple[int, ...] = ()
    if len(columns) > 1 and column_map.names["block"] not in names:
        joined = tuple(_place(names, name, "block", where, column_map.numbered) for name in columns)
    mine = {
        what: len(names)
        if what == "block" and joined
        else _place(names, name, what, where, column_map.numbered)
        for what, name in column_map.names.items()
    }
    return mine, joined


def _place(names: Sequence[str], name: str, what: str, where: str, numbered: bool) -> int:
    """Return the place of a column that the user gives by name, or by number if all are."""
    if numbered and 1 <= int(name) <= len(names):
        return int(name) - 1
    wanted = plain(name)
    for spelling in (str, plain, lambda text: plain(unit_of(text)[0])):
        places = [
            k for k, title in enumerate(names) if spelling(title) == (name if spelling is str else wanted)
        ]
        if len(places) == 1:
            return places[0]
    shown_names = ", ".join(name or "(none)" for name in names)
    raise SurveyError(
        f"no column {shown(name)} for {what}", where=where, remedy=f"the columns are: {shown_names[:300]}"
    )


def _take(
    what: str, k: int, names: Sequence[str], at: dict[str, int], scales: dict[str, float], where: str
) -> None:
    at[what] = k
    if what in _LENGTHS and (scale := length_scale(names[k], where)) is not None:
        scales[what] = scale


def _fall_back(at: dict[str, int], codes: bool) -> list[int]:
    """Let ``Code``, ``ID`` or ``Nr`` be the stone if no other column is; return columns that become notes."""
    if codes and "description" in at:
        return []
    if "block" not in at:
        for what in ("description", "name"):
            if what in at:
                at["block"] = at.pop(what)
                break
    return [at.pop("description")] if "description" in at else []


def _check_missing(names: Sequence[str], at: Mapping[str, int], where: str) -> None:
    needed = ("outline",) if "outline" in at else ("x", "y", "z")
    if "block" not in at and "description" not in at:
        needed = ("block", *needed)
    for what in needed:
        if what not in at:
            raise SurveyError(
                f"no column {what!r} among {', '.join(name or '(none)' for name in names)[:200]}",
                where=where,
                remedy=f'name it with --columns "{what}=…", or begin the table with e.g. '
                "block,kind,course,role,x,y,z",
            )


def _check_spelling(name: str, at: Mapping[str, int], where: str) -> None:
    """Refuse a column that is nearly one that is missing, rather than keep it as a note."""
    spelled = [spelling for misspelt in _MISSPELT if _MEANINGS[spelling := plain(misspelt)] not in at]
    close_matches = difflib.get_close_matches(plain(unit_of(name)[0]), spelled, n=1, cutoff=_ALIKE)
    if close_matches:
        what = _MEANINGS[close_matches[0]]
        raise SurveyError(
            f"unknown column {shown(name)}, nearly {what}",
            where=where,
            remedy=f'say what it is: --columns "{what}={name[:40]}", or --columns "ignore={name[:40]}"',
        )
