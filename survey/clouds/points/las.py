"""LAS and LAZ files, read with laspy and lazrs."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from survey.arrays import Array
from survey.clouds.extras import optional
from survey.clouds.points.chunks import CHUNK, Chunk, PointCloud

# sizes of structures of the format [bytes]: the head before version 1.4, what 1.4 adds up to the number of points, and
# the heads of a variable-length record and of an extended one
_LEAST_HEAD = struct.calcsize("<4sHHIHH8sBB32s32sHHHIIBHI5I12d")
_HEAD = _LEAST_HEAD + struct.calcsize("<QQIQ")
_RECORD, _EXTENDED = struct.calcsize("<H16sHH32s"), struct.calcsize("<H16sHQ32s")
_COMPRESSED = 0x80  # bit of the format of points in LAZ


def open_las(path: Path) -> PointCloud:
    """Open a LAS or LAZ file.

    Raises
    ------
    UsageError
        if laspy or lazrs is not installed
    SurveyError
        if it is not such a file
    """
    laspy = optional("laspy", "LAS and LAZ files")
    if path.suffix.lower() == ".laz":
        optional("lazrs", "LAZ files")
    _check_counts(path)
    try:
        with laspy.open(path) as file:
            header = file.header
            count, middle = int(header.point_count), (np.array(header.mins) + np.array(header.maxs)) / 2.0
    except BaseException as error:  # laspy lets through what lazrs, struct and numpy raise
        raise _damaged(path, error) from error
    if count and not np.isfinite(middle).all():
        middle = np.zeros(3)

    def chunks(origin: Array, colours: bool) -> Iterator[Chunk]:
        """Yield chunks of points (n, 3) from `origin` [m], with colours (n, 3) on request."""
        try:
            with laspy.open(path, **_selection(laspy, path, colours)) as file:
                read = 0
                for points in file.chunk_iterator(CHUNK):
                    read += len(points)
                    yield Chunk(_places(points, file.header, origin), _colours(points) if colours else None)
        except BaseException as error:
            raise _damaged(path, error) from error
        if read != count:
            raise SurveyError(
                f"the file announces {count} points and holds {read}",
                where=str(path),
                remedy="export it again",
            )

    return PointCloud(path, count, middle, chunks)


def _places(points: Any, header: Any, origin: Array) -> Array:
    """Scale the integers of a file, and shift them before they are rounded to the digits of a large coordinate."""
    out = np.empty((len(points), 3))
    for k, name in enumerate("XYZ"):
        np.multiply(points.array[name], header.scales[k], out=out[:, k])
        out[:, k] += header.offsets[k] - origin[k]
    return out


def _colours(points: Any) -> Any:
    names = set(points.array.dtype.names)
    if {"red", "green", "blue"} <= names:
        colours = np.column_stack([points.array[name] for name in ("red", "green", "blue")])
        return (colours >> 8 if colours.max(initial=0) > 255 else colours).astype(np.uint8)
    colours = points.array["intensity"].astype(np.float64)
    top = max(float(np.quantile(colours, 0.99)) if len(colours) else 1.0, 1.0)
    return np.repeat(np.clip(colours * (255.0 / top), 0.0, 255.0).astype(np.uint8)[:, None], 3, axis=1)


def _selection(laspy: Any, path: Path, colours: bool) -> dict[str, Any]:
    """Return options that keep lazrs from decompressing fields that nobody asked for (point formats 6 to 10)."""
    if path.suffix.lower() != ".laz":
        return {}
    wanted = laspy.DecompressionSelection.base() | laspy.DecompressionSelection.Z
    if colours:
        wanted |= laspy.DecompressionSelection.RGB | laspy.DecompressionSelection.INTENSITY
    return {"decompression_selection": wanted}


def _check_counts(path: Path) -> None:
    """Refuse a file that announces more records or points than it has room for, before memory is reserved for them."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if head[:4] != b"LASF" or len(head) < _LEAST_HEAD:
        return  # laspy says what it is not
    length, start, records, form, point, count = struct.unpack_from("<HIIBHI", head, 94)
    extended = 0
    if head[25] >= 4 and len(head) >= _HEAD:
        extended, count = struct.unpack_from("<IQ", head, 243)
    room = (start - length) // _RECORD + (size - start) // _EXTENDED
    for what, many, most in (
        ("records in its head", records, (min(start, size) - length) // _RECORD),
        ("extended records", extended, room),
        ("points", count, (size - start) // point if point and not form & _COMPRESSED else count),
    ):
        if many > max(most, 0):
            raise SurveyError(
                f"the file announces {many} {what} and has room for {max(most, 0)}",
                where=str(path),
                remedy="export it again",
            )


def _damaged(path: Path, error: BaseException) -> BaseException:
    """Return what to raise: a panic of lazrs, which is written in Rust, is no `Exception`; others of these pass."""
    if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
        return error
    return SurveyError(
        f"cannot be read as LAS or LAZ: {' '.join(str(error).split())[:120]}",
        where=str(path),
        remedy="export it again, as LAZ 1.2 or later",
    )
