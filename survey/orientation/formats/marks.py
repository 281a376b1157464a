"""Marks on photographs as plain text, one per line: photograph, point, x, y, and its standard deviation if it has one.

Values are separated by commas, semicolons, tabs or blanks; places are in pixels, to the right and down from the
upper left corner. Lines that begin with # are comments. The Damped Bundle Adjustment Toolbox reads the same columns.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from moma.errors import SurveyError
from survey.arrays import Array
from survey.formats.fields import parse_length, parse_number
from survey.formats.text_lines import TextLines
from survey.orientation.network import Camera, Network, Photo, listed

__all__ = ["MarkRow", "marks_of_points", "network_of", "numbered", "read_marks", "write_marks"]

_BETWEEN = re.compile(r"\s*[,;\t]\s*|\s+")


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
    lines = TextLines(path)
    rows = tuple(_rows(lines))
    if not rows:
        raise SurveyError("the file has no marks", where=lines.path, remedy="write: photograph, point, x, y")
    return rows


def _rows(lines: TextLines) -> Iterator[MarkRow]:
    seen: dict[tuple[str, str], int] = {}
    for number, line in lines.rows():
        where = f"{lines.path}:{number}"
        words = _BETWEEN.split(line.strip())
        if len(words) not in (4, 5):
            raise SurveyError(
                f"a mark of {len(words)} values",
                where=where,
                remedy="write: photograph, point, x, y, sigma if it has one",
            )
        x, y = (parse_number(word, name, where) for word, name in zip(words[2:4], "xy", strict=True))
        sigma = parse_length(words[4], "sigma", where) if len(words) == 5 else None
        if (first := seen.setdefault((words[0], words[1]), number)) != number:
            raise SurveyError(
                f"point {words[1]} is marked twice on photograph {words[0]}, first in line {first}",
                where=where,
                remedy="keep one",
            )
        yield MarkRow(words[0], words[1], x, y, sigma, number)


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
    photo_of = {one.name: k for k, one in enumerate(photos)}
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


def write_marks(network: Network, path: Path) -> None:
    """Write the marks of a network with all digits; of unequal deviations of x and y, the root mean square."""
    text = ["# photograph, point, x, y, sigma [px]"]
    for k in range(len(network.photo)):
        x, y = network.image[k].tolist()
        sigma = float(np.sqrt((network.sigma[k] ** 2).mean()))
        text.append(
            f"{network.photos[network.photo[k]].name}, {network.names[network.point[k]]}, {x!r}, {y!r}, {sigma!r}"
        )
    path.write_text("\n".join([*text, ""]), encoding="utf-8", newline="\n")


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


def marks_of_points(network: Network) -> list[list[int]]:
    """Return the indices of the marks of each point."""
    order = np.argsort(network.point, kind="stable")
    bounds = np.searchsorted(network.point[order], np.arange(1, len(network.names)))
    return [one.tolist() for one in np.split(order, bounds)]
