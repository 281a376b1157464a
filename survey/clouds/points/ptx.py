"""PTX files of Leica: scans in a row, each with its size, its scanner's place, and the transform of its points.

columns
rows
X Y Z                 place of the scanner
three lines           its axes
four lines            transform of points as rows: (x, y, z, 1) times the matrix
columns × rows lines  x y z intensity, or x y z intensity red green blue; 0 0 0 where nothing came back
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError
from survey.arrays import Array
from survey.clouds.points.chunks import LINES, Chunk, PointCloud
from survey.conventions import PER_MILLE
from survey.records.survey import Station

_WORDS = "1133334444"  # how many numbers stand on each line before the points of a scan
_HEAD = len(_WORDS)
_SHORTEST = 8  # bytes of a line of a point: "0 0 0 0" with its end
_AFFINE = PER_MILLE  # by which a rotation may differ from one, as its numbers are rounded


@dataclass(frozen=True)
class _Scan:
    count: int
    transform: Array  # (4, 4)
    first: int  # line of its first point, from 1
    near: Array | None  # its first point, moved


def open_ptx(path: Path) -> PointCloud:
    """Open a PTX file, all scans of which are one cloud.

    Raises
    ------
    SurveyError
        if a head is wrong, or the file has fewer points than it announces
    """
    with path.open(encoding="ascii", errors="replace") as file:
        scans = tuple(_scans(file, path))
    place = next((scan.near for scan in scans if scan.near is not None), None)
    if place is None:
        raise SurveyError("has no point", where=str(path), remedy="export the scans again")
    stations = tuple(
        Station(f"scan{k}", scan.transform[3, :3].copy())
        for k, scan in enumerate(scans, start=1)
        if not np.array_equal(
            scan.transform, np.eye(4)
        )  # an identity says nothing of where the scanner stood
    )

    def chunks(origin: Array, colours: bool) -> Iterator[Chunk]:
        """Yield chunks of points (n, 3) from `origin` [m], with colours (n, 3) on request."""
        with path.open(encoding="ascii", errors="replace") as file:
            for scan in scans:
                for _ in range(_HEAD):
                    file.readline()
                left = scan.count
                while left > 0:
                    rows = _rows(list(islice(file, min(left, LINES))), path, scan.first + scan.count - left)
                    left -= min(left, LINES)
                    yield _chunk(rows, scan, origin, colours)

    return PointCloud(path, None, place, chunks, stations)


def is_ptx(path: Path) -> bool:
    """Return whether a file begins as a PTX, whatever its ending: size, axes of the scanner, and its pose."""
    with path.open("rb") as file:
        return "".join(str(len(line.split())) for line in islice(file, _HEAD)) == _WORDS


def _scans(file: TextIO, path: Path) -> Iterator[_Scan]:
    line, size = 0, path.stat().st_size
    while head := list(islice(file, _HEAD)):
        where = f"{path}:{line + 1}"
        if not any(map(str.strip, head)):
            return
        try:
            columns, rows = (int(one) for one in head[:2])
            matrix = np.array([[float(word) for word in one.split()] for one in head[6:]]).reshape(4, 4)
        except ValueError as error:
            raise SurveyError(
                "the head of a scan cannot be read", where=where, remedy="export it again"
            ) from error
        count = columns * rows
        if min(columns, rows) < 0 or count * _SHORTEST > size:
            what = f"a scan announces {columns} × {rows} points, more than the file has room for"
            raise SurveyError(what, where=where, remedy="export it again")
        turn = matrix[:3, :3]
        if not np.isfinite(matrix).all() or np.abs(turn @ turn.T - np.eye(3)).max() > _AFFINE:
            raise SurveyError("the transform of a scan is no rotation", where=where, remedy="export it again")
        place, read = None, 0
        for text in islice(file, count):
            read += 1
            if place is None and not text.startswith(("0 0 0 ", "0.0")):
                places = _rows([text], path, line + _HEAD + read)[:, :3]
                place = places[0] @ turn + matrix[3, :3] if places.any() else None
        if read < count:
            what = f"a scan announces {count} points and holds {read}"
            raise SurveyError(what, where=where, remedy="export it again")
        yield _Scan(count, matrix, line + _HEAD + 1, place)
        line += _HEAD + count


def _rows(lines: list[str], path: Path, first: int) -> Array:
    try:
        block = np.loadtxt(lines, ndmin=2)
        if block.shape[1] in (3, 4, 7):
            return block
        what = f"{block.shape[1]} values of a point"
    except ValueError as error:
        what = str(error).split(";")[0]
    raise SurveyError(
        what, where=f"{path}, lines {first} to {first + len(lines) - 1}", remedy="export it again"
    )


def _chunk(rows: Array, scan: _Scan, origin: Array, colours: bool) -> Chunk:
    rows = rows[rows[:, :3].any(axis=1)]
    places = rows[:, :3] @ scan.transform[:3, :3] + (scan.transform[3, :3] - origin)
    tints: NDArray[np.uint8] | None = None
    if colours and rows.shape[1] == 7:
        tints = np.clip(rows[:, 4:], 0.0, 255.0).astype(np.uint8)
    return Chunk(places, tints)
