"""Text files of points, one to a line: XYZ, PTS, ASC, CSV of coordinates.

Coordinates and colours are the columns of these names, in the unit that they state; without names, the first three
numbers are x, y and z in metres, and the last three of six or seven are red, green and blue if whole. Points without
a place (NaN) are left out.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ground.tables.columns import COORDINATES, length_scale
from ground.tables.number_stream import NumberStream, open_numbers
from survey.arrays import Array
from survey.clouds.points.chunks import LINES, Chunk, PointCloud

_COLOURED = (6, 7)  # columns of x y z r g b, without or with an intensity before the colours
_RGB = ("red", "green", "blue")
_COLUMNS: Mapping[str, Sequence[str]] = {
    **COORDINATES,
    **{name: (name, name[0], f"color {name}", f"colour {name}") for name in _RGB},
}


def open_text(path: Path) -> PointCloud:
    """Open a text file of points.

    Raises
    ------
    SurveyError
        if it has no line with three numbers
    """
    stream = open_numbers(path, _COLUMNS)
    places, coloured = _columns(stream)
    names = stream.names or ("", "", "")
    scales = np.array([length_scale(names[k], f"{path}:{stream.head}") or 1.0 for k in places])
    columns = (*places, *coloured)

    def rows(lines: int) -> Iterator[Array]:
        """Yield rows of numbers (n, columns) whose coordinates are finite, up to `lines` at a time."""
        for numbers in stream.chunks(lines, columns):
            yield (
                numbers
                if np.isfinite(numbers[:, :3]).all()
                else numbers[np.isfinite(numbers[:, :3]).all(axis=1)]
            )

    def chunks(origin: Array, colours: bool) -> Iterator[Chunk]:
        """Yield chunks of points (n, 3) from `origin` [m], with colours (n, 3) on request."""
        for numbers in rows(LINES):
            tinted = colours and coloured
            tints = np.clip(numbers[:, 3:], 0.0, 255.0).astype(np.uint8) if tinted else None
            yield Chunk(scales * numbers[:, :3] - origin, tints)

    first = next(row for row in rows(1) if len(row))[0, :3]
    return PointCloud(path, None, scales * first, chunks)


def _columns(stream: NumberStream) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the places of x, y and z, and of red, green and blue; () without colours."""
    places = stream.places
    if {*"xyz"} <= set(places):
        coloured = tuple(places[one] for one in _RGB) if set(_RGB) <= set(places) else ()
        return tuple(places[one] for one in "xyz"), coloured
    count = len(stream.first)
    whole = all(one.isdigit() for one in stream.first[-3:])
    return (0, 1, 2), tuple(range(count - 3, count)) if count in _COLOURED and whole else ()
