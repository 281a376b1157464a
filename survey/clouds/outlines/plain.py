"""Outlines in plain JSON or in tables: corners in metres of the wall's plane, to the right and upwards, or in space."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from ground.tables import table as tables
from ground.tables.columns import COORDINATES, length_scale, places_of, unit_of
from ground.tables.numbers import is_number
from survey.arrays import Array
from survey.clouds.outlines.outline import Outline, attributes_of, columns_of, joined_code, made_code

_JSON = 'give a list of objects such as {"code": "S1", "outline": [[0.1, 0.2], …]}'
_CSV = "give a header with code, x and y, and a row for each corner, in order around its stone"
_CORNERS = {**COORDINATES, "x": (*COORDINATES["x"], "s", "u"), "y": (*COORDINATES["y"], "t", "v")}


def is_plain(content: object) -> bool:
    """Return whether JSON is a list of outlines, or outlines by code, and not e.g. GeoJSON or COCO."""
    if isinstance(content, Mapping):
        return bool(content) and all(_is_ring(one) for one in content.values())
    return isinstance(content, list) and bool(content) and all(_ring_of(one) is not None for one in content)


def _is_ring(value: object) -> bool:
    return (
        isinstance(value, list)
        and len(value) > 2
        and all(
            isinstance(place, list) and len(place) == 2 and all(isinstance(one, int | float) for one in place)
            for place in value
        )
    )


def _ring_of(point: object) -> list[Any] | None:
    """Return the corners in an entry of a list: itself, or the one value of an object that is a list of places."""
    if isinstance(point, Mapping):
        rings = [value for value in point.values() if _is_ring(value)]
        return rings[0] if len(rings) == 1 else None
    return point if isinstance(point, list) and _is_ring(point) else None


def read_plain_json(path: Path, content: Any, chosen: Mapping[str, str]) -> tuple[Outline, ...]:
    """Read a list of outlines with their attributes, or outlines by code.

    Parameters
    ----------
    path : the file
    content : its JSON, for which `is_plain` holds
    chosen : names of attributes that the user has given, by meaning

    Raises
    ------
    SurveyError
        naming the stone that is wrong
    """
    if isinstance(content, Mapping):
        content = [{"code": code, "outline": ring} for code, ring in content.items()]
    return tuple(_entries(path, content, chosen))


def _entries(path: Path, content: list[Any], chosen: Mapping[str, str]) -> Iterator[Outline]:
    for number, entry in enumerate(content, start=1):
        where = f"{path}, stone {number}"
        values = dict(entry) if isinstance(entry, Mapping) else {}
        ring = _ring_of(entry)
        if ring is None:
            raise SurveyError("has no outline", where=where, remedy=_JSON)
        attributes = attributes_of(
            {name: value for name, value in values.items() if isinstance(value, str | int | float)},
            chosen,
            where,
        )
        yield Outline(number, _code(attributes.code, number), _open(ring), attributes, where)


def read_table(
    path: Path, chosen: Mapping[str, str], unit: float | None = None, sheet: str | None = None
) -> tuple[tuple[Outline, ...], tuple[str, ...]]:
    """Read a table with a row for each corner, in the plane of the wall, or in space where it has three coordinates.

    Parameters
    ----------
    path : text or a workbook, with names of columns, which may state a unit of length
    chosen : names of columns that the user has given, by meaning
    unit : length of the unit of corners, where columns state none [m]; None: metres
    sheet : of a workbook with several

    Returns
    -------
    the outlines, one for each name in a course, and the names of the columns

    Raises
    ------
    SurveyError
        naming the line that is wrong
    """
    table = tables.read_table(path, _is_row, _CSV, sheet)
    header = table.titles[-1] if table.titles else tables.TableRow(1, ())
    titles, where = header.cells, table.where(header.line)
    at = places_of(titles, _CORNERS, where)
    columns = columns_of(titles, chosen, where) if titles else {}
    name = columns.get("code")
    sides = [at[axis] for axis in "xyz" if axis in at]
    if "x" not in at or len(sides) < 2 or name is None:
        names = ", ".join(titles or table.rows[0].cells)
        raise SurveyError(f"columns {names}", where=where, remedy=_CSV)
    scales = [length_scale(titles[k], where) or unit or 1.0 for k in sides]
    corners: dict[tuple[str, str], list[list[float]]] = {}
    first: dict[tuple[str, str], tuple[int, dict[str, Any]]] = {}
    for row in table.rows:
        cells = [*row.cells, *[""] * (len(titles) - len(row.cells))]
        place = [
            scale * table.number(cells[k], unit_of(titles[k])[0], row.line)
            for scale, k in zip(scales, sides, strict=True)
        ]
        stone = (
            table.name(row, titles.index(name), "the stone of a corner")
            if name in titles
            else joined_code(dict(zip(titles, cells, strict=False)), name) or ""
        )
        course = cells[titles.index(columns["course"])] if "course" in columns else ""
        corners.setdefault((stone, course), []).append(place)
        others = {
            title: cell
            for k, (title, cell) in enumerate(zip(titles, cells, strict=False))
            if title and cell and k not in sides
        }
        first.setdefault((stone, course), (row.line, others))
    return tuple(_of_rows(path, corners, first, chosen)), tuple(titles)


def _is_row(cells: Sequence[str], commas: bool) -> bool:
    return sum(is_number(cell, commas) for cell in cells) >= len("xy")


def _of_rows(
    path: Path,
    corners: Mapping[tuple[str, str], list[list[float]]],
    first: Mapping[tuple[str, str], tuple[int, dict[str, Any]]],
    chosen: Mapping[str, str],
) -> Iterator[Outline]:
    """Make outlines of the corners of each name and course."""
    for number, ((name, course), places) in enumerate(corners.items(), start=1):
        line, values = first[name, course]
        where = f"{path}:{line}"
        attributes = attributes_of(values, chosen, where)
        yield Outline(number, _code(name, number), _open(places), attributes, where)


def _code(said: str | None, number: int) -> str:
    code = made_code(said or "") or f"S{number:03d}"
    return f"S{int(code):03d}" if code.isdigit() else code


def _open(places: list[Any]) -> Array:
    """Return the corners (n, 2), without repetitions."""
    ring = np.array(places, dtype=np.float64)
    distinct = np.any(ring != np.roll(ring, 1, axis=0), axis=1)
    return ring[distinct] if distinct.any() else ring[:1]
