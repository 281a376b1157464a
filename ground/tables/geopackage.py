"""GeoPackage: layers of polygons with attributes and a style for QGIS, in an SQLite file."""

import sqlite3
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

_CARTESIAN = -1  # number of the reference system that is not known

_TABLES = """
PRAGMA application_id = 1196444487;  -- "GPKG"
PRAGMA user_version = 10300;  -- GeoPackage 1.3
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT PRIMARY KEY, data_type TEXT NOT NULL, identifier TEXT UNIQUE,
  description TEXT DEFAULT '', last_change DATETIME NOT NULL, min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE,
  srs_id INTEGER REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (table_name TEXT PRIMARY KEY REFERENCES gpkg_contents(table_name),
  column_name TEXT NOT NULL, geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL
  REFERENCES gpkg_spatial_ref_sys(srs_id), z TINYINT NOT NULL, m TINYINT NOT NULL);
CREATE TABLE layer_styles (id INTEGER PRIMARY KEY AUTOINCREMENT, f_table_catalog TEXT, f_table_schema TEXT,
  f_table_name TEXT, f_geometry_column TEXT, styleName TEXT, styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN,
  description TEXT, owner TEXT, ui TEXT, update_time DATETIME);
INSERT INTO gpkg_spatial_ref_sys VALUES
  ('Undefined Cartesian', -1, 'NONE', -1, 'undefined', 'not known'),
  ('Undefined geographic', 0, 'NONE', 0, 'undefined', 'not known'),
  ('WGS 84', 4326, 'EPSG', 4326, 'undefined', 'longitude and latitude');
"""

_COLOURS = ("#c8b48c", "#a3b18a", "#8fa6b8", "#c99a86", "#b8a5c0", "#d2c56b", "#86b3a8", "#b0a79f")
"""Fills of the values in turn."""


@dataclass(frozen=True)
class Layer:
    """Polygons with attributes.

    Attributes
    ----------
    name : of its table
    polygons : (n,) corners (nc, 2) or (nc, 3) of each, not closed; all with as many coordinates
    columns : name, type (TEXT, INTEGER or DOUBLE) and n values of each attribute; None where not known
    style_by : attribute whose values are drawn in colours of their own
    title : of the style
    system : whether the coordinates are those of the reference system, not of a plane of their own
    """

    name: str
    polygons: Sequence[NDArray[np.float64]]
    columns: Sequence[tuple[str, str, Sequence[Any]]]
    style_by: str
    title: str
    system: bool = False


def write_geopackage(
    path: Path, layers: Sequence[Layer], moment: datetime | None = None, crs: str | None = None
) -> None:
    """Write layers into a new file.

    Parameters
    ----------
    moment : of the last change; None: now
    crs : reference system, e.g. "EPSG:25832"; None: not known
    """
    stamp = (moment or datetime.now(UTC)).strftime("%Y-%m-%dT%H:%M:%S.000Z")
    with sqlite3.connect(path) as db:
        db.executescript(_TABLES)
        number = _CARTESIAN
        if crs is not None:
            name, _, digits = crs.partition(":")
            number = int(digits)
            row = (crs, number, name, number, "undefined", None)
            db.execute("INSERT OR IGNORE INTO gpkg_spatial_ref_sys VALUES (?,?,?,?,?,?)", row)
        for layer in layers:
            _add_layer(db, layer, number if layer.system else _CARTESIAN, stamp)
    db.close()


def _add_layer(db: sqlite3.Connection, layer: Layer, system: int, stamp: str) -> None:
    name = layer.name
    declared = ", ".join(f'"{label}" {kind}' for label, kind, _ in layer.columns)
    db.execute(f'CREATE TABLE "{name}" (fid INTEGER PRIMARY KEY AUTOINCREMENT, geom BLOB, {declared})')
    flat = np.concatenate([polygon[:, :2] for polygon in layer.polygons])
    box = (*flat.min(axis=0).tolist(), *flat.max(axis=0).tolist())
    contents = (name, "features", name, "", stamp, *box, system)
    db.execute("INSERT INTO gpkg_contents VALUES (?,?,?,?,?,?,?,?,?,?)", contents)
    deep = int(layer.polygons[0].shape[1] == 3)
    db.execute("INSERT INTO gpkg_geometry_columns VALUES (?,'geom','POLYGON',?,?,0)", (name, system, deep))
    marks = ",".join("?" * (len(layer.columns) + 2))
    db.executemany(
        f'INSERT INTO "{name}" VALUES ({marks})',
        (
            (row + 1, _geometry(polygon, system), *(values[row] for _, _, values in layer.columns))
            for row, polygon in enumerate(layer.polygons)
        ),
    )
    style = _style(layer)
    db.execute(
        "INSERT INTO layer_styles VALUES (NULL,'','',?,'geom',?,?,'',1,?,'',NULL,?)",
        (name, layer.style_by, style, layer.title, stamp),
    )


def _geometry(corners: NDArray[np.float64], system: int) -> bytes:
    """Return a polygon as GeoPackage stores it: a head with its box, then well-known binary."""
    ring = np.vstack([corners, corners[:1]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    head = struct.pack("<2sBBi4d", b"GP", 0, 0b11, system, low[0], high[0], low[1], high[1])
    kind = 1003 if corners.shape[1] == 3 else 3  # with z, or without
    return head + struct.pack("<BIII", 1, kind, 1, len(ring)) + ring.astype("<f8").tobytes()


def _style(layer: Layer) -> str:
    """Return a style of QGIS (QML) that fills each value of an attribute with a colour of its own."""
    column = next(values for label, _, values in layer.columns if label == layer.style_by)
    categories, symbols = [], []
    for place, value in enumerate(sorted({str(value) for value in column if value is not None})):
        red, green, blue = (int(_COLOURS[place % len(_COLOURS)][at : at + 2], 16) for at in (1, 3, 5))
        label = quoteattr(value)
        categories.append(f'<category value={label} label={label} symbol="{place}" render="true"/>')
        symbols.append(
            f'<symbol type="fill" name="{place}" alpha="1"><layer class="SimpleFill" enabled="1">'
            f'<Option type="Map"><Option type="QString" name="color" value="{red},{green},{blue},255"/>'
            '<Option type="QString" name="outline_color" value="60,60,60,255"/>'
            '<Option type="QString" name="outline_width" value="0.2"/></Option></layer></symbol>'
        )
    attribute = quoteattr(layer.style_by)
    return (
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
        '<qgis version="3.28" styleCategories="Symbology">'
        f'<renderer-v2 type="categorizedSymbol" attr={attribute} symbollevels="0" enableorderby="0">'
        f"<categories>{''.join(categories)}</categories><symbols>{''.join(symbols)}</symbols>"
        "</renderer-v2></qgis>\n"
    )
