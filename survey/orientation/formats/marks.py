"""Marks on photographs as tables: photograph, point, x, y, and the standard deviation of a mark if it has one.

Columns stand in this order unless they are named; places are in pixels, to the right and down from the upper left
corner. Lines that begin with # are comments. The Damped Bundle Adjustment Toolbox reads the same columns.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.columns import POINT, SIGMA, length_scale
from ground.tables.numbers import is_number
from ground.tables.table import Table, read_table
from survey.arrays import Array
from survey.conventions import CORNERS
from survey.orientation.network import Camera, Network, Photo, listed

_COLUMNS: Mapping[str, Sequence[str]] = {
    "photograph": (
        *("photograph", "photo", "image", "img", "picture", "file", "camera", "Bild", "Foto", "Aufnahme"),
        *(
            *("photograph name", "photo name", "image name", "file name", "camera name"),
            *("camera label", "Bildname"),
        ),
        *("cliché", "immagine", "fotografia", "imagen", "fotografía"),
    ),
    "point": (
        *POINT,
        *("mark", "marker", "target", "gcp", "name", "mark name", "marker name", "marker label"),
        "gcp name",
    ),
    "x": ("x", "u", "column", "col", "x px", "px", "pixel x", "Spalte"),
    "y": ("y", "v", "row", "line", "y px", "py", "pixel y", "Zeile"),
    "sigma": SIGMA,
}
_PLACES = {column: k for k, column in enumerate(_COLUMNS)}
_REMEDY = "write: photograph, point, x, y, sigma if it has one"


@dataclass(frozen=True)
class MarkRow:
    """One line of such a file.

    Attributes
    ----------
    photo, point : names
    x, y : [px]
    sigma : standard deviation of either coordinate [px]; None: not stated
    line : of the file
    """

    photo: str
    point: str
    x: float
    y: float
    sigma: float | None
    line: int


def read_marks(path: Path) -> tuple[MarkRow, ...]:
    """Read a file of marks.

    Raises
    ------
    SurveyError
        naming file and line, if a line is wrong, or a point is marked twice on a photograph
    """
    table = read_table(path, _is_row, _REMEDY)
    table.check_titles(_REMEDY)
    header, places = table.columns(_COLUMNS, least=3)
    if header is not None:
        where = table.where(header.line)
        missing = [place for place in _PLACES if place not in places and place != "sigma"]
        if missing:
            what = f"no column {missing[0]} among {', '.join(header.cells)[:200]}"
            raise SurveyError(what, where=where, remedy=_REMEDY)
        if any(length_scale(header.cells[places[axis]].replace("[px]", ""), where) for axis in "xy"):
            raise SurveyError("marks in a unit of length", where=where, remedy="give marks in pixels")
    return tuple(_rows(table, places or _PLACES, len(header.cells) if header in table.titles else 0))


def _is_row(cells: Sequence[str], commas: bool) -> bool:
    """Return whether a line has two names and two numbers, in any order of its columns."""
    return len(cells) >= 4 and sum(is_number(cell, commas) for cell in cells) >= 2


def _rows(table: Table, places: Mapping[str, int], count: int) -> Iterator[MarkRow]:
    """Yield the marks; `count` is the number of named columns, 0 where they are not named."""
    seen: dict[tuple[str, str], int] = {}
    for row in table.rows:
        if len(row.cells) <= max(places[axis] for axis in "xy") or len(row.cells) > (count or len(_PLACES)):
            what = f"a mark of {len(row.cells)} values"
            raise SurveyError(what, where=table.where(row.line), remedy=_REMEDY)
        photo = table.name(row, places["photograph"], "the photograph of a mark")
        point = table.name(row, places["point"], "the point of a mark")
        x, y = (table.number(row.cells[places[axis]], axis, row.line) for axis in "xy")
        at = places.get("sigma", len(row.cells))
        sigma = None
        if at < len(row.cells) and row.cells[at]:
            sigma = table.decimals.length(row.cells[at], "sigma", row.line)
        if (first := seen.setdefault((photo, point), row.line)) != row.line:
            raise SurveyError(
                f"point {point} is marked twice on photograph {photo}, first in line {first}",
                where=table.where(row.line),
                remedy="keep one",
            )
        yield MarkRow(photo, point, x, y, sigma, row.line)


def network_of(
    path: str,
    rows: tuple[MarkRow, ...],
    cameras: tuple[Camera, ...],
    photos: tuple[Photo, ...],
    sigma: float,
    start: Mapping[str, Array] | None = None,
) -> Network:
    """Make a network of marks.

    Parameters
    ----------
    path : of the marks
    cameras, photos : all photographs that take part
    sigma : standard deviation of marks without one of their own [px]
    start : places of points to start from [m]

    Raises
    ------
    SurveyError
        if a mark is on another photograph
    """
    photo_of = {photo.name: k for k, photo in enumerate(photos)}
    index: dict[str, int] = {name: k for k, name in enumerate(start or {})}
    for row in rows:
        if row.photo not in photo_of:
            raise SurveyError(
                f"no photograph {row.photo}",
                where=f"{path}:{row.line}",
                remedy=f"known are {listed(list(photo_of))}",
            )
        index.setdefault(row.point, len(index))
    places = np.full((len(index), 3), np.nan)
    for name, place in (start or {}).items():
        places[index[name]] = place
    return Network(
        path,
        cameras,
        photos,
        tuple(index),
        places,
        (),
        np.array([photo_of[row.photo] for row in rows], dtype=np.int64),
        np.array([index[row.point] for row in rows], dtype=np.int64),
        np.array([(row.x, row.y) for row in rows]).reshape(-1, 2),
        np.array([(row.sigma or sigma,) * 2 for row in rows]).reshape(-1, 2),
        np.array([row.line for row in rows], dtype=np.int64),
    )


def numbered(network: Network, table: Path) -> tuple[str, ...]:
    """Return numbers for the points of a network, for formats in which they have no names.

    Names that are all numbers are kept; otherwise points are counted from 1, and `table` gets number and name of each.
    """
    if all(name.isdigit() for name in network.names):
        return network.names
    numbers = tuple(str(k) for k in range(1, len(network.names) + 1))
    pairs = zip(numbers, network.names, strict=True)
    text = ["# number, name", *(f"{number}, {name}" for number, name in pairs), ""]
    table.write_text("\n".join(text), encoding="utf-8", newline="\n")
    return numbers


def marked_well(network: Network) -> Network:
    """Leave out photographs with too few marks to be oriented, with a remark that names them."""
    counts = np.bincount(network.photo, minlength=len(network.photos))
    enough = counts >= CORNERS
    if enough.all() or not enough.any():
        return network
    place, rays = np.cumsum(enough) - 1, enough[network.photo]
    names = [photo.name for photo, stays in zip(network.photos, enough, strict=True) if not stays]
    return replace(
        network,
        photos=tuple(photo for photo, stays in zip(network.photos, enough, strict=True) if stays),
        photo=place[network.photo[rays]],
        point=network.point[rays],
        image=network.image[rays],
        sigma=network.sigma[rays],
        lines=network.lines[rays],
        remarks=(
            *network.remarks,
            f"photographs with fewer than {CORNERS} marks are left out: {listed(names)}",
        ),
    )


def marks_of_points(network: Network) -> list[list[int]]:
    """Return the indices of the marks of each point."""
    order = np.argsort(network.point, kind="stable")
    bounds = np.searchsorted(network.point[order], np.arange(1, len(network.names)))
    return [word.tolist() for word in np.split(order, bounds)]
