"""Outlines of GeoJSON: one stone per feature, its polygon or closed line with x, y and z.

The properties of a feature are the columns of a table (`survey.formats.tables.columns`); without a property for the
stone, the ``id`` of the feature is its name. A feature of points (``Point`` with z) is a row of a table of points.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from ground.tables.columns import COORDINATES
from ground.tables.numbers import unreadable
from ground.tables.rows import ListRows, cell_text
from survey.conventions import LEAST
from survey.formats.options import ReadingOptions
from survey.formats.tables.columns import kind_of_column, read_map
from survey.formats.tables.reader import open_table
from survey.formats.tables.wkt import ring_of
from survey.records.survey import Reject, SurveyStream

_DEGREES = LEAST  # extents below which coordinates of stones are degrees, beside heights of metres
_LARGEST = 1 << 29  # bytes


def open_geojson(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read the features of a file and return its stones one by one; see `open_csv` for what columns mean.

    Raises
    ------
    SurveyError
        if the file is not GeoJSON, or its coordinates are degrees or have no z
    """
    path = Path(path)
    features = _features(path)
    named = dict.fromkeys(name for feature in features for name in _properties(feature))
    # the outline has the coordinates; attributes such as x and height of a layer are those of the stone;
    # stations are in a header file
    left_out = {*COORDINATES, *(() if options is not None and options.head is not None else ("station",))}
    names = [name for name in named if kind_of_column(name) not in left_out]
    kinds = {kind_of_column(name) for name in names}
    ids = not kinds & {"block", "description", "name"}
    if ids and not any("id" in feature for feature in features):
        _check_named(path, features, names, options)
    rows: list[tuple[int, list[str]]] = [(0, [*names, *(["block"] if ids else []), "outline"])]
    corners: list[Any] = []
    wrong: list[Reject] = []
    for number, feature in enumerate(features, start=1):
        values = _properties(feature)
        try:
            ring = _ring(feature, f"{path}:{number}")
        except SurveyError as error:
            wrong.append(Reject(None, error, (range(number, number + 1),)))
            continue
        corners.append(ring)
        text = ", ".join(" ".join(map(repr, corner)) for corner in ring.tolist())
        identifier = [cell_text(feature.get("id", ""))] if ids else []
        rows.append(
            (
                number,
                [*(cell_text(values.get(name, "")) for name in names), *identifier, f"POLYGON Z (({text}))"],
            )
        )
    if not corners:
        raise wrong[0].error
    _check_degrees(corners, path)
    remarks = (f"{len(features)} features; places in messages are their numbers",)
    stream = open_table(path, ListRows(str(path), rows, remarks), options or ReadingOptions())
    return replace(stream, blocks=chain(wrong, stream.blocks))


def _check_named(
    path: Path, features: Sequence[Mapping[str, Any]], names: Sequence[str], options: ReadingOptions | None
) -> None:
    """Refuse features without an attribute that names the stones, unless the user says which does."""
    if options is not None and {"block", "description"} & read_map(options.columns).names.keys():
        return
    different = [
        name
        for name in names
        if len({cell_text(_properties(one).get(name, "")) for one in features}) == len(features)
    ]
    raise SurveyError(
        f"no attribute {', '.join(names)[:200]} is known to name the stones",
        where=str(path),
        remedy=f'say which does, e.g. --columns "block={different[0] if different else "…"}"',
    )


def _features(path: Path) -> list[Mapping[str, Any]]:
    try:
        if path.stat().st_size > _LARGEST:
            raise SurveyError(f"more than {_LARGEST} bytes", where=str(path), remedy="export it in parts")
        document = json.loads(path.read_bytes())
    except json.JSONDecodeError as error:
        raise SurveyError(
            f"not JSON: {error.msg}", where=f"{path}:{error.lineno}", remedy="export it again"
        ) from error
    except (OSError, ValueError, RecursionError) as error:
        raise unreadable(path, error, "give an existing GeoJSON file") from error
    features = document.get("features") if isinstance(document, dict) else None
    if not isinstance(features, list) or not all(isinstance(feature, dict) for feature in features):
        raise SurveyError(
            "not a FeatureCollection of GeoJSON", where=str(path), remedy="export a layer as GeoJSON"
        )
    if not features:
        raise SurveyError("the file has no features", where=str(path), remedy="export a layer with outlines")
    return features


def _properties(feature: Mapping[str, Any]) -> Mapping[str, Any]:
    properties = feature.get("properties")
    return properties if isinstance(properties, dict) else {}


def _ring(feature: Mapping[str, Any], where: str) -> Any:
    """Return the corners (n, 3) of the outline of a feature.

    Raises
    ------
    SurveyError
        if it has no single outline with z
    """
    geometry = feature.get("geometry")
    geometry = geometry if isinstance(geometry, dict) else {}
    kind, coordinates = geometry.get("type"), geometry.get("coordinates")
    if not isinstance(coordinates, list):
        raise SurveyError(
            "a feature without coordinates", where=where, remedy="draw one outline around each stone"
        )
    if kind == "MultiPolygon" and len(coordinates) == 1:
        kind, coordinates = "Polygon", coordinates[0]
    if kind == "LineString":
        kind, coordinates = "Polygon", [coordinates]
    if kind != "Polygon" or not _is_nested(coordinates):
        raise SurveyError(
            f"a feature of type {str(kind)[:40]!r}, not one outline", where=where,
            remedy="draw one polygon around each stone; points are read from a table (--format csv)",
        )  # fmt: skip
    return ring_of(coordinates, where)


def _is_nested(coordinates: Any) -> bool:
    return isinstance(coordinates, list) and all(
        isinstance(ring, list) and all(isinstance(position, list) for position in ring)
        for ring in coordinates
    )


def _check_degrees(corners: Sequence[Any], path: Path) -> None:
    """Refuse longitudes and latitudes."""
    extents = np.array([np.ptp(corner, axis=0) for corner in corners if len(corner)]).reshape(-1, 3)
    inside = all((np.abs(corner[:, :2]) <= (180.0, 90.0)).all() for corner in corners)
    if (
        len(extents)
        and inside
        and extents[:, :2].max() < _DEGREES
        and extents[:, 2].max() > 50.0 * extents[:, :2].max()
    ):
        raise SurveyError(
            "the coordinates look like degrees beside heights in metres",
            where=str(path),
            remedy="export the layer in a projected system in metres (in QGIS: CRS of the export)",
        )
