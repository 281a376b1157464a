"""Outlines in plain JSON or CSV: corners in metres of the wall's plane, to the right and upwards."""

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from moma.errors import SurveyError
from survey.arrays import Array
from survey.clouds.outlines.outline import FIELDS, Outline, attributes_of, made_code

__all__ = ["is_plain", "read_plain_json", "read_table"]

_JSON = 'give a list of objects such as {"code": "S1", "outline": [[0.1, 0.2], …]}'
_CSV = "give a header with code, x and y, and a row for each corner, in order around its stone"
_ACROSS, _UPWARD = ("x", "s", "u"), ("y", "z", "t", "v")


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


def _ring_of(one: object) -> list[Any] | None:
    """Return the corners in an entry of a list: itself, or the one value of an object that is a list of places."""
    if isinstance(one, Mapping):
        rings = [value for value in one.values() if _is_ring(value)]
        return rings[0] if len(rings) == 1 else None
    return one if isinstance(one, list) and _is_ring(one) else None


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
    for number, one in enumerate(content, start=1):
        where = f"{path}, stone {number}"
        values = dict(one) if isinstance(one, Mapping) else {}
        ring = _ring_of(one)
        if ring is None:
            raise SurveyError("has no outline", where=where, remedy=_JSON)
        said = attributes_of(
            {name: value for name, value in values.items() if isinstance(value, str | int | float)},
            chosen,
            where,
        )
        yield Outline(number, _code(said.code, number), _open(ring), said, where)


def read_table(path: Path, chosen: Mapping[str, str]) -> tuple[Outline, ...]:
    """Read a table with a row for each corner.

    Parameters
    ----------
    path : CSV with commas or semicolons, and a header
    chosen : names of columns that the user has given, by meaning

    Raises
    ------
    SurveyError
        naming the line that is wrong
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        raise SurveyError(f"cannot be read: {error}", where=str(path), remedy="save it as UTF-8") from error
    semicolons = ";" in text.split("\n", 1)[0]
    rows = csv.DictReader(text.splitlines(), delimiter=";" if semicolons else ",")
    names = {name.strip().lower(): name for name in rows.fieldnames or ()}
    across = next((names[one] for one in _ACROSS if one in names), None)
    upward = next((names[one] for one in _UPWARD if one in names), None)
    code = chosen.get("code") or next((names[one] for one in FIELDS["code"] if one in names), None)
    if across is None or upward is None or code is None:
        raise SurveyError(f"columns {', '.join(names) or 'none'}", where=f"{path}:1", remedy=_CSV)
    corners: dict[str, list[list[float]]] = {}
    first: dict[str, tuple[int, dict[str, Any]]] = {}
    for line, row in enumerate(rows, start=2):
        try:
            place = [float(str(row[name]).replace(",", ".")) for name in (across, upward)]
        except ValueError as error:
            raise SurveyError("a coordinate is no number", where=f"{path}:{line}", remedy=_CSV) from error
        name = str(row[code]).strip()
        corners.setdefault(name, []).append(place)
        others = {key: value for key, value in row.items() if key not in (across, upward, None) and value}
        first.setdefault(name, (line, others))
    return tuple(_of_rows(path, corners, first, chosen))


def _of_rows(
    path: Path,
    corners: Mapping[str, list[list[float]]],
    first: Mapping[str, tuple[int, dict[str, Any]]],
    chosen: Mapping[str, str],
) -> Iterator[Outline]:
    for number, (name, places) in enumerate(corners.items(), start=1):
        line, values = first[name]
        where = f"{path}:{line}"
        said = attributes_of(values, chosen, where)
        yield Outline(number, _code(name, number), _open(places), said, where)


def _code(said: str | None, number: int) -> str:
    code = made_code(said or "") or f"S{number:03d}"
    return f"S{int(code):03d}" if code.isdigit() else code


def _open(places: list[Any]) -> Array:
    """Return the corners (n, 2), without repetitions."""
    ring = np.array(places, dtype=np.float64)
    kept = np.any(ring != np.roll(ring, 1, axis=0), axis=1)
    return ring[kept] if kept.any() else ring[:1]
