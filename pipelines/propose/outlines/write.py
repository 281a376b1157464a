"""Outlines as GeoPackage, GeoJSON and DXF, in the plane of the wall."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ground.tables.geopackage import Layer, write_geopackage
from pipelines.propose.outlines.features import Feature
from survey.clouds.extras import optional

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
    """Write one layer, styled by kind."""
    names = [name for name in _COLUMNS if name == "kind" or any(name in feature.said for feature in features)]
    columns = [("code", "TEXT", [feature.code for feature in features])]
    for name in names:
        kind = "INTEGER" if name in _WHOLE else "DOUBLE" if name in _REAL else "TEXT"
        columns.append((name, kind, [_value(feature.said.get(name), kind) for feature in features]))
    rings = [np.asarray(feature.ring, dtype=np.float64) for feature in features]
    path.unlink(missing_ok=True)
    write_geopackage(path, [Layer("outlines", rings, columns, "kind", "outlines by kind")])


def _value(value: Any, kind: str) -> Any:
    """Return an attribute as its column stores it."""
    if value is None:
        return None
    return int(value) if kind == "INTEGER" else float(value) if kind == "DOUBLE" else str(value)


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
