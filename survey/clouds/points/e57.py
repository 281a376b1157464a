"""E57 files, read with libE57 (pye57) into buffers of fixed size.

pye57's own `read_scan` loads a whole scan. Here the reader of libE57 fills one set of buffers again and again, and each
scan is moved by its pose. Points whose invalid state is set are left out.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError, UsageError
from survey.arrays import Array
from survey.clouds.extras import optional
from survey.clouds.points.chunks import CHUNK, Chunk, PointCloud, lost_digits
from survey.records.survey import Station

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_UNLIMITED = 1e9  # bounds of a field beyond which a program states none [m]
_COLOURS = ("colorRed", "colorGreen", "colorBlue")


def open_e57(path: Path) -> PointCloud:
    """Open an E57 file, all scans of which are one cloud.

    Raises
    ------
    UsageError
        if pye57 is not installed
    SurveyError
        if it is not such a file, or has no scan with coordinates
    """
    pye57 = optional("pye57", "E57 files")
    try:
        file = pye57.E57(str(path))
        headers = [file.get_header(k) for k in range(file.scan_count)]
        count = sum(int(header.point_count) for header in headers)
        stations = tuple(
            _station(k, header) for k, header in enumerate(headers, start=1) if _is_placed(header)
        )
        near = _near(headers)
        warnings = _warnings(pye57, path, headers)
        for header in headers:
            _fields(path, header)
        file.close()
    except (SurveyError, UsageError):
        raise
    except Exception as error:  # libE57 raises its own class
        raise _damaged(path, error) from error
    if not headers:
        raise SurveyError("has no scan", where=str(path), remedy="export the points, not only pictures")

    def chunks(origin: Array, colours: bool) -> Iterator[Chunk]:
        """Yield chunks of points (n, 3) from `origin` [m], with colours (n, 3) on request."""
        try:
            opened = pye57.E57(str(path))
            for k in range(opened.scan_count):
                yield from _scan(pye57, opened, k, origin, colours)
            opened.close()
        except GeneratorExit:
            raise
        except Exception as error:
            raise _damaged(path, error) from error

    return PointCloud(path, count, near, chunks, stations, warnings)


def _scan(pye57: Any, file: Any, k: int, origin: Array, colours: bool) -> Iterator[Chunk]:
    header = file.get_header(k)
    system = _fields(Path(str(file.path)), header)
    state = "cartesianInvalidState" if system is _CARTESIAN else "sphericalInvalidState"
    fields = [*system, *([state] if state in header.point_fields else [])]
    if colours and set(_COLOURS) <= set(header.point_fields):
        fields += _COLOURS
    buffers, arrays = pye57.libe57.VectorSourceDestBuffer(), {}
    for name in fields:
        kind = np.int8 if name == state else np.uint8 if name in _COLOURS else np.float64
        arrays[name] = np.empty(CHUNK, kind)
        buffers.append(pye57.libe57.SourceDestBuffer(file.image_file, name, arrays[name], CHUNK, True, True))
    rotation, shift = header.rotation_matrix, header.translation - origin
    turned = not np.array_equal(rotation, np.eye(3))
    reader = header.points.reader(buffers)
    while (read := reader.read()) > 0:
        flat = np.empty((read, 3))
        for j, name in enumerate(system):
            flat[:, j] = arrays[name][:read]
        tints = np.column_stack([arrays[name][:read] for name in _COLOURS]) if "colorRed" in arrays else None
        if state in arrays and arrays[state][:read].any():
            good = arrays[state][:read] == 0
            flat, tints = flat[good], None if tints is None else tints[good]
        places = _from_sphere(flat) if system is _SPHERICAL else flat
        if turned:
            places = places @ rotation.T
        places += shift
        yield Chunk(places, tints)
    reader.close()


def _from_sphere(flat: Array) -> Array:
    reach, azimuth, elevation = flat.T
    level = reach * np.cos(elevation)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), reach * np.sin(elevation)])


def _fields(path: Path, header: Any) -> tuple[str, ...]:
    known = set(header.point_fields)
    for system in (_CARTESIAN, _SPHERICAL):
        if known >= set(system):
            return system
    raise SurveyError("a scan has no coordinates", where=str(path), remedy="export it with coordinates")


def _is_placed(header: Any) -> bool:
    """Return whether a scan says where it was made: an identity as its pose is what programs write that do not know."""
    identity = np.array_equal(header.rotation_matrix, np.eye(3)) and not np.any(header.translation)
    return bool(header.has_pose()) and not identity


def _station(number: int, header: Any) -> Station:
    return Station(f"scan{number}", np.array(header.translation, dtype=np.float64))


def _near(headers: list[Any]) -> Array:
    for header in headers:
        try:
            low = [header["cartesianBounds"][f"{axis}Minimum"].value() for axis in "xyz"]
            high = [header["cartesianBounds"][f"{axis}Maximum"].value() for axis in "xyz"]
        except Exception:  # bounds are optional, and libE57 raises its own class where they are missing
            continue
        middle = (np.array(low) + np.array(high)) / 2.0
        # some programs write the bounds in the scan's own frame, others in that of the file
        shift = np.array(header.translation, dtype=np.float64)
        return middle if np.abs(middle).max() > np.abs(shift).max() else shift
    return np.array(headers[0].translation, dtype=np.float64) if headers else np.zeros(3)


def _warnings(pye57: Any, path: Path, headers: list[Any]) -> tuple[str, ...]:
    """Warn of scans whose coordinates are stored in single precision far from their own origin."""
    farthest = 0.0
    for header in headers:
        if not set(_CARTESIAN) <= set(header.point_fields):
            continue
        prototype = pye57.libe57.StructureNode(header.points.prototype())
        for node in map(prototype.get, _CARTESIAN):
            if node.type() != pye57.libe57.NodeType.E57_FLOAT:
                continue
            field = pye57.libe57.FloatNode(node)
            reach = max(abs(field.minimum()), abs(field.maximum()))
            if field.precision() == pye57.libe57.E57_SINGLE and reach < _UNLIMITED:
                farthest = max(farthest, reach)
    return lost_digits(path, farthest) if farthest else ()


def _damaged(path: Path, error: Exception) -> SurveyError:
    return SurveyError(
        f"cannot be read as E57: {' '.join(str(error).split())[:120]}",
        where=str(path),
        remedy="export it again",
    )
