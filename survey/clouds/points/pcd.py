"""PCD files of the Point Cloud Library, as text or binary; compressed ones are named with the way out."""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BufferedReader
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError
from ground.tables.columns import LONGEST_HEAD
from survey.arrays import Array
from survey.clouds.points.chunks import CHUNK, Chunk, PointCloud, lost_digits
from survey.records.survey import Station

_TYPES = {
    (kind.kind.upper(), kind.itemsize): f"{kind.kind}{kind.itemsize}"
    for kind in map(np.dtype, f"{np.typecodes['AllInteger']}fd")
}


@dataclass(frozen=True)
class _Head:
    kind: str  # ascii or binary
    count: int
    record: np.dtype[np.void]
    start: int


def open_pcd(path: Path) -> PointCloud:
    """Open a PCD file.

    Raises
    ------
    SurveyError
        if its head is wrong, it is compressed, or it has fewer points than it announces
    """
    with path.open("rb") as file:
        head, words = _head(file, path)
    single = head.record["x"].itemsize == 4
    first = next((rows for rows in _rows(path, head, CHUNK) if len(rows)), None)
    if first is None:
        raise SurveyError("has no point", where=str(path), remedy="export it again")
    place = _places(first)[0]

    def chunks(origin: Array, colours: bool) -> Iterator[Chunk]:
        """Yield chunks of points (n, 3) from `origin` [m], with colours (n, 3) on request."""
        for rows in _rows(path, head, CHUNK):
            yield Chunk(_places(rows) - origin, _tints(rows) if colours else None)

    warnings = lost_digits(path, float(np.abs(place).max())) if single else ()
    return PointCloud(path, None, place, chunks, _stations(words), warnings)


def _head(file: BufferedReader, path: Path) -> tuple[_Head, Mapping[str, list[str]]]:
    words = dict[str, list[str]]()
    for _ in range(LONGEST_HEAD):
        name, *values = file.readline().decode("ascii", "replace").split() or [""]
        words[name] = values
        if name == "DATA":
            break
    else:
        raise SurveyError("the head does not end", where=str(path), remedy="export it again")
    where = f"{path}:{len(words)}"
    kind = (words["DATA"] or [""])[0]
    if kind not in ("ascii", "binary"):
        remedy = "save it uncompressed, e.g. pcl_convert_pcd_ascii_binary IN.pcd OUT.pcd 1"
        raise SurveyError(f"points as {kind!r} are not read", where=where, remedy=remedy)
    try:
        counts = words.get("COUNT") or ["1"] * len(words["FIELDS"])
        fields = [
            (name.lower(), "<" + _TYPES[letter, int(size)], (int(many),))
            for name, size, letter, many in zip(
                words["FIELDS"], words["SIZE"], words["TYPE"], counts, strict=True
            )
        ]
        # names of padding repeat
        named = [(f"{k} {name}" if name == "_" else name, *rest) for k, (name, *rest) in enumerate(fields)]
        record = np.dtype([(name, kind_, () if many == (1,) else many) for name, kind_, many in named])
        count = (
            int(words["POINTS"][0]) if "POINTS" in words else int(words["WIDTH"][0]) * int(words["HEIGHT"][0])
        )
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise SurveyError("the head cannot be read", where=str(path), remedy="export it again") from error
    if not {"x", "y", "z"} <= set(record.names or ()):
        raise SurveyError("its points have no x, y and z", where=str(path), remedy="export the coordinates")
    room = path.stat().st_size - file.tell()
    need = count * record.itemsize if kind == "binary" else 2 * count * len(fields)
    if count < 0 or need > room + 1:
        what = f"the file announces {count} points, more than it has room for"
        raise SurveyError(what, where=str(path), remedy="export it again")
    return _Head(kind, count, record, file.tell()), words


def _rows(path: Path, head: _Head, most: int) -> Iterator[NDArray[np.void]]:
    """Yield the points that have a place."""
    left = head.count
    with path.open("rb") as file:
        file.seek(head.start)
        while left > 0:
            if head.kind == "binary":
                rows = np.fromfile(file, head.record, min(most, left))
            else:
                rows = _text_rows(list(islice(file, min(most, left))), head, path, head.count - left)
            if not len(rows):
                what = f"the file announces {head.count} points and holds {head.count - left}"
                raise SurveyError(what, where=str(path), remedy="export it again")
            left -= len(rows)
            yield rows[np.isfinite(_places(rows)).all(axis=1)]


def _text_rows(lines: list[bytes], head: _Head, path: Path, done: int) -> NDArray[np.void]:
    try:
        flat = (
            np.loadtxt([line.decode("ascii", "replace") for line in lines], ndmin=2)
            if lines
            else np.empty((0, 0))
        )
        out, column = np.zeros(len(flat), head.record), 0
        for name in head.record.names or ():
            many = int(np.prod(head.record[name].shape, dtype=int))
            values = flat[:, column : column + many] if len(flat) else flat
            if len(flat):
                out[name] = values.reshape(out[name].shape)
            column += many
    except (ValueError, IndexError) as error:
        where = f"{path}, points {done + 1} to {done + len(lines)}"
        raise SurveyError(str(error).split(";")[0], where=where, remedy="correct the line") from error
    return out


def _places(rows: NDArray[np.void]) -> Array:
    return np.column_stack([rows[name].astype(np.float64) for name in "xyz"])


def _tints(rows: NDArray[np.void]) -> NDArray[np.uint8] | None:
    """Return colours, which are packed into four bytes of a number: blue, green, red."""
    name = next((name for name in ("rgb", "rgba") if name in (rows.dtype.names or ())), None)
    if name is None or rows.dtype[name].itemsize != struct.calcsize("I"):
        return None
    packed = np.ascontiguousarray(rows[name]).view(np.uint32)
    return np.column_stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255]).astype(np.uint8)


def _stations(words: Mapping[str, list[str]]) -> tuple[Station, ...]:
    try:
        place = np.array([float(one) for one in words.get("VIEWPOINT", [])[:3]])
    except ValueError:
        return ()
    # the origin is what programs write that do not know
    return (Station("scan1", place),) if len(place) == 3 and place.any() else ()
