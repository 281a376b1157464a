"""Text files of points, one to a line: XYZ, PTS, ASC, CSV of coordinates.

The first three numbers of a line are x, y and z. They are separated by blanks, tabs, semicolons or commas; decimals
have a point or, where columns are not separated by commas, a comma. A line that does not begin with a number is skipped
at the head of the file, as is the number of points that PTS files begin with. The last three of six or seven columns
are red, green and blue.
"""

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from moma.errors import SurveyError
from survey.arrays import Array
from survey.clouds.points.chunks import CHUNK, Chunk, PointCloud
from survey.formats.fields import unreadable

__all__ = ["open_text"]

_NUMBER = re.compile(r"\s*[-+]?[\d.]")
_LONGEST_HEAD = 100  # lines
_LINES = CHUNK // 4  # lines in memory at a time: Python's strings take 70 bytes each
_COLOURED = (6, 7)  # columns of x y z r g b, without or with an intensity before the colours


def open_text(path: Path) -> PointCloud:
    """Open a text file of points.

    Raises
    ------
    SurveyError
        if it has no line with three numbers
    """
    try:
        with _open(path) as file:
            skipped, first = _head(file, path)
    except OSError as error:
        raise unreadable(path, error) from error
    separator, comma = _style(first)
    near = _parsed([first], separator, comma, path, skipped)[0, :3]

    def chunks(origin: Array, colours: bool) -> Iterator[Chunk]:
        with _open(path) as file:
            for _ in range(skipped):
                file.readline()
            done = skipped
            while lines := list(islice(file, _LINES)):
                # each scan of a PTS file begins with its number of points
                plain = ["" if line.strip().isdigit() else line for line in lines]
                rows = _parsed(plain, separator, comma, path, done) if any(map(str.strip, plain)) else None
                done += len(lines)
                if rows is None:
                    continue
                tinted = colours and rows.shape[1] in _COLOURED
                tints = np.clip(rows[:, -3:], 0.0, 255.0).astype(np.uint8) if tinted else None
                yield Chunk(rows[:, :3] - origin, tints)

    return PointCloud(path, None, near, chunks)


def _open(path: Path) -> TextIO:
    return path.open(encoding="utf-8-sig", errors="replace")


def _head(file: TextIO, path: Path) -> tuple[int, str]:
    """Return the number of lines before the first point, and its line."""
    for number, line in enumerate(islice(file, _LONGEST_HEAD)):
        if _NUMBER.match(line) and not line.strip().isdigit():
            return number, line
    raise SurveyError(
        f"no line with x, y and z among the first {_LONGEST_HEAD}",
        where=str(path),
        remedy="a point cloud in text has one point to a line: x y z",
    )


def _style(line: str) -> tuple[str | None, bool]:
    """Return the separator, None for blanks, and whether decimals have a comma."""
    if ";" in line:
        return ";", "," in line
    if "\t" in line.strip() or len(line.split()) >= 3:
        blank = len([one for one in line.split() if one.strip(",")]) >= 3
        ends = all(one.endswith(",") for one in line.split()[:2])
        return (",", False) if ends else (None, blank and "," in line)
    return ",", False


def _parsed(lines: list[str], separator: str | None, comma: bool, path: Path, before: int) -> Array:
    if comma:
        lines = [line.replace(",", ".") for line in lines]
    try:
        rows = np.loadtxt(lines, delimiter=separator, comments="#", ndmin=2)
    except ValueError as error:
        raise _wrong(lines, separator, path, before) from error
    if rows.shape[1] < 3:
        raise _wrong(lines, separator, path, before)
    return rows


def _wrong(lines: list[str], separator: str | None, path: Path, before: int) -> SurveyError:
    """Make the error of the first line that is not a point like the others."""
    remedy = "write: x y z, with equal columns in all lines"
    width = 0
    for number, line in enumerate(lines, start=before + 1):
        parts = [part for part in line.split("#")[0].split(separator) if part.strip()]
        width = width or len(parts)
        if parts and (len(parts) != width or width < 3 or not all(map(_is_number, parts))):
            what = f"{line.strip()[:60]!r} is not a point like the others"
            return SurveyError(what, where=f"{path}:{number}", remedy=remedy)
    return SurveyError("lines that are no points", where=f"{path}:{before + 1}", remedy=remedy)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
