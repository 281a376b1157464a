"""Outlines in vector formats of GDAL, read with pyogrio, and in tables as well-known text; both with shapely."""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError, UsageError
from ground.tables.table import Table, read_table
from survey.arrays import Array
from survey.clouds.extras import optional
from survey.clouds.outlines.outline import Attributes, Outline, WrongOutline, attributes_of, made_code
from survey.conventions import LEAST, NEGLIGIBLE
from survey.formats.tables.wkt import is_wkt
from survey.records.plausible import LENGTH

_DEGREES = LEAST  # extent of the largest outline below which coordinates are degrees: no stone is 1 mm wide
_PIXELS = LENGTH.possible[1]  # width of the usual outline from which it is of pixels: no stone is 30 m wide
_SMALL = NEGLIGIBLE  # share of the area of the largest part up to which other parts are specks [-]


def read_vector(
    path: Path, layer: str | None, chosen: Mapping[str, str], scaled: bool = False
) -> tuple[tuple[Outline | WrongOutline, ...], tuple[str, ...]]:
    """Read the polygons of a file; an unclosed ring is closed.

    Parameters
    ----------
    path : the file
    layer : its name; None: the only one
    chosen : names of attributes that the user has given, by meaning
    scaled : whether the user has stated the unit of its coordinates

    Returns
    -------
    the features, and the names of their attributes

    Raises
    ------
    UsageError
        if pyogrio or shapely is not installed, or there are several layers
    SurveyError
        if the file cannot be read, or holds longitudes and latitudes, or pixels
    """
    pyogrio = optional("pyogrio", f"{path.suffix} files")
    shapely = optional("shapely", f"{path.suffix} files")
    try:
        layers = [str(name) for name, kind in pyogrio.list_layers(path) if kind is not None]
        if layer is None and len(layers) != 1:
            remedy = f"name one with --layer: {', '.join(layers) or 'none has geometry'}"
            raise UsageError(f"{len(layers)} layers", where=str(path), remedy=remedy)
        if layer is not None and layer not in layers:
            raise UsageError(
                f"no layer {layer!r}", where=str(path), remedy=f"layers are: {', '.join(layers)}"
            )
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):  # GDAL's, of unclosed rings
            meta, fids, geometries, columns = pyogrio.raw.read(
                path, layer=layer or layers[0], return_fids=True
            )
    except UsageError:
        raise
    except Exception as error:  # pyogrio lets GDAL's errors through under several classes
        what = f"cannot be read: {' '.join(str(error).split())[:120]}"
        raise SurveyError(what, where=str(path), remedy="export it again, e.g. as GeoPackage") from error
    names = [str(name) for name in meta["fields"]]
    values = [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)] or [{}] * len(fids)
    wheres = [f"{path}, feature {int(fid)}" for fid in fids]
    shapes = shapely.from_wkb(geometries, on_invalid="fix")
    return _features(path, shapes, fids, values, wheres, chosen, scaled), tuple(names)


def wkt_table(path: Path, sheet: str | None) -> Table | None:
    """Read a table that has an outline as well-known text in a field of each row; None if it has not."""
    try:
        table = read_table(path, _is_row, "", sheet)
    except SurveyError:
        return None
    return table if table.names else None


def read_wkt_table(
    path: Path, table: Table, chosen: Mapping[str, str], scaled: bool = False
) -> tuple[tuple[Outline | WrongOutline, ...], tuple[str, ...]]:
    """Read the outlines of a table, one in each row, in any column; otherwise as `read_vector`."""
    shapely = optional("shapely", "outlines as well-known text")
    at = next(k for k, cell in enumerate(table.rows[0].cells) if is_wkt(cell))
    names = tuple(name for k, name in enumerate(table.names) if k != at and name)
    values, texts, wheres = [], [], []
    for row in table.rows:
        cells = [*row.cells, *[""] * (len(table.names) - len(row.cells))]
        texts.append(cells[at] or None)
        values.append({name: cell for name, cell in zip(table.names, cells, strict=False) if name in names})
        wheres.append(table.where(row.line))
    shapes = shapely.from_wkt(texts, on_invalid="fix")
    numbers = range(1, len(texts) + 1)
    return _features(path, shapes, numbers, values, wheres, chosen, scaled), names


def _is_row(cells: Sequence[str], commas: bool) -> bool:
    return any(map(is_wkt, cells))


def _features(
    path: Path,
    shapes: Any,
    fids: Sequence[int],
    values: Sequence[Mapping[str, Any]],
    wheres: Sequence[str],
    chosen: Mapping[str, str],
    scaled: bool,
) -> tuple[Outline | WrongOutline, ...]:
    """Make outlines of shapes with their attributes."""
    shapely = optional("shapely", f"{path.suffix} files")
    bounds = shapely.bounds(shapes)
    _check_degrees(path, bounds)
    if not scaled:
        _check_pixels(path, bounds)
    return tuple(
        _outline(k + 1, int(fids[k]), shape, attributes_of(values[k], chosen, wheres[k]), wheres[k])
        for k, shape in enumerate(shapes)
    )


def _check_degrees(path: Path, bounds: Array) -> None:
    """Refuse longitudes and latitudes, in which all outlines are specks far from zero."""
    finite = bounds[np.isfinite(bounds).all(axis=1)]
    if not len(finite) or np.abs(finite[:, [0, 2]]).max() > 180.0 or np.abs(finite[:, [1, 3]]).max() > 90.0:
        return
    extent = float((finite[:, 2:] - finite[:, :2]).max())
    if 0.0 < extent < _DEGREES and np.abs(finite).max() > 1.0:
        raise SurveyError(
            f"its coordinates are longitudes and latitudes: the largest outline is {extent:.1g} wide",
            where=str(path),
            remedy="export it in a projected system in metres (in QGIS: Export, Save Features As, CRS)",
        )


def _check_pixels(path: Path, bounds: Array) -> None:
    """Refuse outlines that were drawn on a picture without a world file, which GIS show below zero, by pixels."""
    finite = bounds[np.isfinite(bounds).all(axis=1)]
    if not len(finite) or finite[:, 0].min() < -1.0 or finite[:, 3].max() > 1.0:
        return
    size = float(np.median(finite[:, 2:] - finite[:, :2]))
    if size > _PIXELS:
        raise SurveyError(
            f"its outlines lie below zero and are {size:.0f} wide: pixels of a picture without a world file, it seems",
            where=str(path),
            remedy="scale them by the size of a pixel in metres (in QGIS: Affine transform, the same scale for x and "
            "y); if it is a millimetre, give --unit mm",
        )


def _outline(number: int, fid: int, shape: Any, attributes: Attributes, where: str) -> Outline | WrongOutline:
    code = made_code(attributes.code or f"S{fid}") or f"S{fid}"
    what, corners = "", np.empty((0, 2))
    if shape is None or shape.is_empty or shape.geom_type not in ("Polygon", "MultiPolygon", "LineString"):
        what = "no geometry" if shape is None or shape.is_empty else f"a {shape.geom_type}"
        what += ", not a polygon"
    elif shape.geom_type == "LineString" and not shape.is_closed:
        what, corners = "the line is not closed", np.array(shape.coords)
    if what:
        error = SurveyError(what, where=where, remedy="draw each stone as a polygon")
        return WrongOutline(number, code, corners, error)
    if shape.geom_type == "LineString":
        rings, doubts = [_ring(shape.coords)], []
    else:
        parts = [shape] if shape.geom_type == "Polygon" else sorted(shape.geoms, key=lambda geom: -geom.area)
        rings = [_ring(one.exterior.coords) for one in parts]
        large = [polygon for polygon in parts[1:] if polygon.area > _SMALL * parts[0].area]
        doubts = [("in pieces", f"{len(large) + 1} pieces; the largest is taken")] if large else []
        if any(parts[0].interiors):
            doubts.append(("holes", f"{len(parts[0].interiors)} holes, which are ignored"))
    return Outline(number, code, rings[0], attributes, where, tuple(doubts))


def _ring(coordinates: Any) -> Array:
    ring = np.array(coordinates, dtype=np.float64)
    if len(ring) > 1 and np.array_equal(ring[0], ring[-1]):
        ring = ring[:-1]
    keep = np.any(ring != np.roll(ring, 1, axis=0), axis=1)
    return ring[keep] if keep.any() else ring[:1]
