"""PLY files of points: text, and binary of either byte order; faces and unknown properties are skipped."""

from collections.abc import Iterator
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import unreadable
from survey.arrays import Array
from survey.clouds.points.chunks import CHUNK, Chunk, PointCloud, lost_digits

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_LONGEST_HEAD = 500  # lines


@dataclass(frozen=True)
class _Head:
    """Layout of the points of a file.

    Attributes
    ----------
    text : whether it is a text file
    count : number of points
    names : of their properties
    record : their layout in a binary file
    start : place of the first point in the file
    """

    text: bool
    count: int
    names: tuple[str, ...]
    record: np.dtype[np.void]
    start: int


def open_ply(path: Path) -> PointCloud:
    """Open a PLY file.

    Raises
    ------
    SurveyError
        if it is not such a file, or its points have no coordinates
    """
    try:
        with path.open("rb") as file:
            head = _head(file, path)
    except OSError as error:
        raise unreadable(path, error) from error
    first = next(_rows(path, head, 1), np.zeros((1, 3)))
    place = first[0, :3] if len(first) else np.zeros(3)
    single = head.record["x"] == np.dtype("f4").newbyteorder(head.record["x"].byteorder)
    warnings = lost_digits(path, float(np.abs(place).max())) if single else ()

    def chunks(origin: Array, colours: bool) -> Iterator[Chunk]:
        """Yield chunks of points (n, 3) from `origin` [m], with colours (n, 3) on request."""
        for rows in _rows(path, head, CHUNK):
            tints = rows[:, 3:].astype(np.uint8) if colours and rows.shape[1] == 6 else None
            places = rows[:, :3]
            places -= origin
            yield Chunk(np.ascontiguousarray(places), tints)

    return PointCloud(path, head.count, place, chunks, warnings=warnings)


def _head(file: BufferedReader, path: Path) -> _Head:
    if file.readline().strip() != b"ply":
        raise SurveyError("is not a PLY file", where=str(path), remedy="its first line must be: ply")
    order, count, fields, inside, before = "", -1, [], False, []
    for number in range(2, _LONGEST_HEAD):
        words = file.readline().decode("ascii", "replace").split()
        where = f"{path}:{number}"
        if words[:1] == ["format"]:
            order = {"ascii": "text", "binary_little_endian": "<", "binary_big_endian": ">"}.get(words[1], "")
            if not order:
                raise SurveyError(
                    f"unknown format {words[1]!r}", where=where, remedy="export it as binary PLY"
                )
        elif words[:1] == ["element"]:
            inside = words[1] in ("vertex", "point")
            if inside:
                count = int(words[2])
            elif count < 0 and int(words[2]):
                before.append(words[1])
        elif words[:1] == ["property"] and inside:
            if words[1] == "list" or words[1] not in _TYPES:
                raise SurveyError("a point with a list", where=where, remedy="export plain points")
            fields.append((words[2].lower(), _TYPES[words[1]]))
        elif words == ["end_header"]:
            break
    else:
        raise SurveyError("the head does not end", where=str(path), remedy="export it again")
    names = tuple(name for name, _ in fields)
    if count < 0 or not {"x", "y", "z"} <= set(names) or not order or len(set(names)) < len(names):
        raise SurveyError("its points have no x, y and z", where=str(path), remedy="export the coordinates")
    if before:
        raise SurveyError(
            f"{before[0]} comes before the points", where=str(path), remedy="export points alone"
        )
    swap = "<" if order == "text" else order
    return _Head(
        order == "text", count, names, np.dtype([(name, swap + kind) for name, kind in fields]), file.tell()
    )


def _rows(path: Path, head: _Head, most: int) -> Iterator[Array]:
    """Yield coordinates and colours, (n, 3) or (n, 6), of up to so many points at a time."""
    wanted = ["x", "y", "z"]
    for tints in (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue")):
        if set(tints) <= set(head.names):
            wanted += tints
            break
    left = head.count
    with path.open("rb") as file:
        file.seek(head.start)
        while left > 0:
            if head.text:
                text_rows = _text_rows(file, path, head, min(most, left), head.count - left)
                rows = text_rows[:, [head.names.index(name) for name in wanted]]
            else:
                raw = np.fromfile(file, head.record, min(most, left))
                rows = np.column_stack([raw[name].astype(np.float64) for name in wanted])
            if not len(rows):
                what = f"the file announces {head.count} points and holds {head.count - left}"
                raise SurveyError(what, where=str(path), remedy="export it again")
            left -= len(rows)
            yield rows


def _text_rows(file: BufferedReader, path: Path, head: _Head, most: int, done: int) -> Array:
    lines = [line for _ in range(most) if (line := file.readline())]
    try:
        return np.loadtxt(lines, ndmin=2) if lines else np.empty((0, len(head.names)))
    except ValueError as error:
        where = f"{path}, points {done + 1} to {done + len(lines)}"
        raise SurveyError(str(error).split(";")[0], where=where, remedy="correct the line") from error
