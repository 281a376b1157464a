"""Outlines as GeoPackage, GeoJSON and DXF, in the plane of the wall."""

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.propose.outlines.features import Feature
from survey.clouds.extras import optional

__all__ = ["NAMES", "geojson_text", "write_outlines"]

NAMES = ("outlines.geojson", "outlines.gpkg", "outlines.dxf")
"""Files of outlines."""

_DIGITS = 5  # of a coordinate [m]: a hundredth of a millimetre
_COLUMNS = ("kind", "course", "place", "score", "sigma", "evidence", "cut", "zone", "depth", "depth_sigma")
_WHOLE = ("course", "place")
_REAL = ("score", "sigma", "depth", "depth_sigma")
_LETTER = 0.04  # height of the codes in a drawing [m]


def geojson_text(features: Sequence[Feature], about: str) -> str:
    """Return outlines as GeoJSON, a line for each."""
    lines = []
    for feature in features:
        ring = (np.round(feature.ring, _DIGITS) + 0.0).tolist()
        shape = {"type": "Polygon", "coordinates": [[*ring, ring[0]]]}
        said = {"code": feature.code, **feature.said}
        lines.append(
            json.dumps({"type": "Feature", "properties": said, "geometry": shape}, ensure_ascii=False)
        )
    head = json.dumps({"type": "FeatureCollection", "about": about}, ensure_ascii=False)[:-1]
    return head + ', "features": [\n' + ",\n".join(lines) + "\n]}\n"


def write_outlines(features: Sequence[Feature], folder: Path, about: str) -> None:
    """Write outlines into a folder: `NAMES`.

    Raises
    ------
    UsageError
        if a package is missing
    """
    (folder / NAMES[0]).write_text(geojson_text(features, about), encoding="utf-8")
    _write_geopackage(features, folder / NAMES[1])
    _write_dxf(features, folder / NAMES[2])


def _write_geopackage(features: Sequence[Feature], path: Path) -> None:
    pyogrio = optional("pyogrio", "GeoPackages")
    shapely = optional("shapely", "GeoPackages")
    shapes = np.array([shapely.polygons(feature.ring) for feature in features], dtype=object)
    names = ["code", *(name for name in _COLUMNS if any(name in feature.said for feature in features))]
    columns = [np.array([feature.code for feature in features], dtype=object)]
    masks: list[NDArray[np.bool_] | None] = [None]
    for name in names[1:]:
        lacking = np.array([feature.said.get(name) is None for feature in features])
        values = [feature.said.get(name) for feature in features]
        if name in _WHOLE:
            column = np.array([0 if value is None else int(value) for value in values], dtype=np.int64)
        elif name in _REAL:
            column = np.array([0.0 if value is None else float(value) for value in values])
        else:
            column = np.array([None if value is None else str(value) for value in values], dtype=object)
        columns.append(column)
        masks.append(None if column.dtype == object else lacking)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")  # the plane of a wall has none
        _raw(pyogrio, path, shapely.to_wkb(shapes), columns, names, masks)


def _raw(
    pyogrio: Any, path: Path, shapes: Any, columns: list[Any], names: list[str], masks: list[Any]
) -> None:
    pyogrio.raw.write(
        path, shapes, columns, np.array(names, dtype=object), field_mask=masks,
        layer="outlines", driver="GPKG", geometry_type="Polygon",
    )  # fmt: skip


def _write_dxf(features: Sequence[Feature], path: Path) -> None:
    """Write closed polylines, and the code of each stone as a text inside it."""
    ezdxf = optional("ezdxf", "outlines as DXF")
    shapely = optional("shapely", "outlines as DXF")
    drawing = ezdxf.new("R2000", units=6)  # metres
    drawing.layers.add("stones")
    space = drawing.modelspace()
    for feature in features:
        space.add_lwpolyline(feature.ring.tolist(), close=True, dxfattribs={"layer": "stones"})
        inside = shapely.point_on_surface(shapely.make_valid(shapely.polygons(feature.ring)))
        text = space.add_text(feature.code, height=_LETTER, dxfattribs={"layer": "stones"})
        text.set_placement((inside.x, inside.y))
    drawing.saveas(path)
