"""Tables of control points, and their place in a network.

One point per row: with names of columns in any order and unit, also as a comment, or without names as the Damped Bundle
Adjustment Toolbox reads them: number, name, X, Y, Z and, if the place is not fixed, its standard deviations (one, or
three) or its covariance (nine, row by row). The name may be left out.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.columns import COORDINATES, POINT, SIGMA, length_scale, plain, unit_of
from ground.tables.grids import exchanged_grid
from ground.tables.numbers import EMPTY, is_number, shown
from ground.tables.table import Table, TableRow, read_table
from survey.arrays import Array
from survey.orientation.network import Control, Network, listed

_COLUMNS: Mapping[str, Sequence[str]] = {
    **COORDINATES,
    "number": POINT,
    "name": ("name", "label", "description", "desc", "code", "type", "Bezeichnung", "nom", "nome", "nombre"),
    "sigma": SIGMA,
    **{
        f"s{a}": (f"s{a}", *(f"{synonym} {a}" for synonym in SIGMA), *(f"{a} {synonym}" for synonym in SIGMA))
        for a in "xyz"
    },
}
_GEOGRAPHIC = (
    ("longitude", "latitude"),
    ("lon", "lat"),
    ("long", "lat"),
    ("lng", "lat"),
    ("länge", "breite"),
)
_RESULTS = re.compile(r"(error|residual|estimate|enable).*|.*(error|residual|est|estimated)")
"""Names of columns of a result: errors and adjusted places are no standard deviations."""
_REMEDY = "write: number, name, X, Y, Z, and deviations: none, one, three, or nine covariances, with commas"
# mean offset between two lists of the same points over its spread, from which it is a shift of the origin
_MAX_SHIFT = 10.0


@dataclass(frozen=True)
class ControlRow:
    """One line of such a file.

    Attributes
    ----------
    number : of the point, as in the marks
    name : label; empty if it has none
    place : (3,) [m]
    covariance : (3, 3) [m²]; zero: the place is fixed
    where : ``file:line``
    """

    number: str
    name: str
    place: Array
    covariance: Array
    where: str = ""


def read_control(path: Path) -> tuple[ControlRow, ...]:
    """Read a table of control points.

    Raises
    ------
    SurveyError
        naming file and line, if a row is wrong, or a number is there twice
    """
    table = read_table(path, _is_row, _REMEDY)
    table.check_titles(_REMEDY)
    _check_degrees(table)
    header, places = table.columns(_COLUMNS, least=3)
    if header is not None and header in table.comments and not _fits(table, places):
        header = None  # a comment that names fewer columns than there are
    if header is not None:
        _check_header(table, header, places)
    rows: dict[str, ControlRow] = {}
    for line in table.rows:
        where = table.where(line.line)
        row = _by_place(table, line) if header is None else _by_name(table, line, header, places)
        if row.number in rows:
            raise SurveyError(
                f"point {row.number} is there twice, first at {rows[row.number].where}",
                where=where,
                remedy="keep one",
            )
        rows[row.number] = row
    _check_grid(table, tuple(rows.values()), header)
    return tuple(rows.values())


def _check_degrees(table: Table) -> None:
    """Refuse control points whose columns are named longitude and latitude."""
    for header in (*table.titles, *table.comments):
        names = {plain(unit_of(cell.partition("/")[0])[0]) for cell in header.cells}
        if any({plain(name) for name in pair} <= names for pair in _GEOGRAPHIC):
            raise SurveyError(
                "its columns are longitudes and latitudes",
                where=table.where(header.line),
                remedy="export control points in a projected system in metres; XML of Metashape may have degrees",
            )


def _check_grid(table: Table, rows: Sequence[ControlRow], header: TableRow | None) -> None:
    """Refuse control points of a national grid whose northing is read as x: they would form a left-handed frame."""
    if grid := exchanged_grid(np.array([row.place for row in rows]).reshape(-1, 3)):
        raise SurveyError(
            f"coordinates are those of {grid} only if X is the northing and Y the easting; as they are they would "
            "mirror the control points",
            where=rows[0].where if header is None else table.where(header.line),
            remedy="name the columns in the first line, e.g.: number, northing, easting, height",
        )


def _fits(table: Table, places: Mapping[str, int]) -> bool:
    """Return whether the columns of coordinates hold numbers in every row."""
    columns = [places[axis] for axis in "xyz" if axis in places]
    return all(
        column < len(row.cells) and is_number(row.cells[column], table.commas)
        for row in table.rows
        for column in columns
    )


def _is_row(cells: Sequence[str], commas: bool) -> bool:
    return sum(is_number(cell, commas) for cell in cells[1:]) >= len("xyz")


def _check_header(table: Table, header: TableRow, places: dict[str, int]) -> None:
    """Refuse names without a coordinate; the names, or else the first other column, are numbers if none are."""
    if "number" not in places:
        taken = set(places.values())
        places["number"] = (
            places.pop("name")
            if "name" in places
            else next(k for k in range(len(taken) + 1) if k not in taken)
        )
    missing = [axis for axis in "xyz" if axis not in places]
    if missing:
        raise SurveyError(
            f"no column {missing[0]} among {', '.join(header.cells)[:200]}",
            where=table.where(header.line),
            remedy="name the columns, e.g.: number, name, x, y, z, sigma",
        )


def _by_name(table: Table, row: TableRow, header: TableRow, places: Mapping[str, int]) -> ControlRow:
    """Read a row by the names of the columns; those behind a comment that names them are deviations."""
    where = table.where(row.line)
    commented = header in table.comments

    def length(column: int, what: str) -> float:
        """Return the length [m] in a column, converted from the unit that its title names."""
        name = header.cells[min(column, len(header.cells) - 1)]
        return (length_scale(name, where) or 1.0) * table.number(row.cells[column], what, row.line)

    last = max(places.values())
    if last >= len(row.cells) and max(places[axis] for axis in "xyz") >= len(row.cells):
        what = f"a control point of {len(row.cells)} values"
        raise SurveyError(what, where=where, remedy=f"the columns are {', '.join(header.cells)[:200]}")
    known = {
        what: k
        for what, k in places.items()
        if k < len(row.cells) and row.cells[k].lower() not in ("", *EMPTY)
    }
    rest = [
        k
        for k in range(len(row.cells))
        if k not in places.values()
        and is_number(row.cells[k], table.commas)
        and not (k < len(header.cells) and _RESULTS.fullmatch(plain(unit_of(header.cells[k])[0])))
    ]
    if rest and not (commented and len(header.cells) < len(row.cells)):
        name = header.cells[rest[0]] if rest[0] < len(header.cells) else ""
        raise SurveyError(
            f"column {shown(name)} is not known",
            where=table.where(header.line),
            remedy="name it sigma, or sx, sy and sz, if it holds standard deviations; otherwise take it out",
        )
    columns = [known[name] for name in ("sx", "sy", "sz") if name in known] or [
        known[name] for name in ("sigma",) if name in known
    ]
    return ControlRow(
        table.name(row, places["number"], "the number of a control point"),
        row.cells[known["name"]] if "name" in known else "",
        np.array([length(places[axis], f"coordinate {axis}") for axis in "xyz"]),
        _covariance([length(k, "a standard deviation") for k in columns or rest], where),
        where,
    )


def _by_place(table: Table, row: TableRow) -> ControlRow:
    """Read a row by the order of its values."""
    where, count = table.where(row.line), len(row.cells)
    labelled = count in (5, 6, 8, 14)
    if not (labelled or count in (4, 7, 13)):
        raise SurveyError(f"a control point of {count} values", where=where, remedy=_REMEDY)
    number = table.name(row, 0, "the number of a control point")
    first = 2 if labelled else 1
    values = [table.number(cell, "a coordinate", row.line) for cell in row.cells[first:]]
    label = row.cells[1] if labelled else ""
    return ControlRow(number, label, np.array(values[:3]), _covariance(values[3:], where), where)


def _covariance(values: Sequence[float], where: str) -> Array:
    """Return the covariance (3, 3) of a place from no, one or three deviations, or nine covariances."""
    rest = np.array(values)
    if len(rest) not in (0, 1, 3, 9):
        raise SurveyError(f"{len(rest)} standard deviations", where=where, remedy=_REMEDY)
    if len(rest) <= 3:
        if (rest < 0.0).any():
            raise SurveyError(
                f"a standard deviation of {rest.min():g}", where=where, remedy="it must not be negative"
            )
        if rest.any() and not rest.all():
            raise SurveyError(
                "a standard deviation of 0 beside others",
                where=where,
                remedy="give all of them, or none for a fixed point",
            )
        return np.diag(np.broadcast_to(rest, 3).astype(float) ** 2) if len(rest) else np.zeros((3, 3))
    covariance = rest.reshape(3, 3)
    if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance).min() <= 0.0:
        raise SurveyError(
            "its covariance is not symmetric and positive",
            where=where,
            remedy="give nine values row by row",
        )
    return covariance


def with_control(
    network: Network, rows: Sequence[ControlRow], *, fixed: bool = False, check: Sequence[str] = ()
) -> Network:
    """Give a network its control points, in place of those that it has.

    A program may have moved the origin for its own file. Where the file's own control points differ from the given ones
    by the same vector, within a tenth of its length, the given ones are moved by it, with a remark.

    Parameters
    ----------
    fixed : the places are not adjusted, whatever their precision
    check : numbers or names of the points that check the adjustment only

    Raises
    ------
    SurveyError
        if none of the points is marked on a photograph, or a point to check is unknown
    """
    marked = set(network.point.tolist())
    index = {name: k for k, name in enumerate(network.names) if k in marked}
    usable = [row for row in rows if row.number in index]
    if not usable:
        raise SurveyError(
            f"none of the {len(rows)} control points is marked on a photograph: {listed([row.number for row in rows])}",
            where=rows[0].where.rpartition(":")[0] if rows else network.path,
            remedy=f"marked points: {listed(list(index))}",
        )
    names = {row.number for row in usable} | {row.name for row in usable if row.name}
    for wanted in check:
        if wanted not in names:
            raise SurveyError(
                f"no control point {shown(wanted)} to check",
                where=network.path,
                remedy=f"known: {listed(sorted(names))}",
            )
    places = {one.point: one.place for one in network.control}
    pairs = [(places[index[row.number]], row.place) for row in usable if index[row.number] in places]
    shift, remarks = np.zeros(3), list(network.remarks)
    if len(pairs) >= 2:
        off = np.array([a - b for a, b in pairs])
        if np.linalg.norm(off.mean(axis=0)) > _MAX_SHIFT * np.ptp(off, axis=0).max():
            shift = off.mean(axis=0)
            place = ", ".join(f"{coordinate:.3f}" for coordinate in shift)
            remarks.append(f"{network.path} has another origin: control points are moved by ({place}) m")
    control = tuple(
        Control(
            index[row.number],
            row.place + shift,
            np.zeros((3, 3)) if fixed else row.covariance,
            row.number in check or (row.name != "" and row.name in check),
            row.where,
        )
        for row in usable
    )
    left = [row.number for row in rows if row.number not in index]
    if left:
        remarks.append(f"control points that are marked nowhere: {listed(left)}")
    start = network.start.copy()
    for gcp in control:
        if not np.isfinite(start[gcp.point]).all():
            start[gcp.point] = gcp.place
    return replace(network, control=control, start=start, remarks=tuple(remarks))


def write_control(rows: Sequence[ControlRow], path: Path) -> None:
    """Write control points with all digits."""
    text = ["# number, name, X, Y, Z, covariance row by row where the place is not fixed"]
    for row in rows:
        values = [*row.place.tolist(), *(row.covariance.ravel().tolist() if row.covariance.any() else ())]
        text.append(", ".join([row.number, row.name or row.number, *map(repr, values)]))
    path.write_text("\n".join([*text, ""]), encoding="utf-8", newline="\n")
