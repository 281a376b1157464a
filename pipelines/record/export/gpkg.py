"""GeoPackage: faces in space and in elevation, with attributes and styles, in an SQLite file."""

import sqlite3
import struct
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from mechanics.arrays import Array
from pipelines.record.export.building import Building, Value, plain_values

__all__ = ["write_gpkg"]

_APPLICATION, _VERSION = int.from_bytes(b"GPKG"), 10300  # 1.3
_WGS84 = 4326
_CARTESIAN = -1  # number of the reference system that is not known

_TABLES = """
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
"""

_SYSTEMS = (
    ("Undefined Cartesian", -1, "NONE", -1, "undefined", "not known"),
    ("Undefined geographic", 0, "NONE", 0, "undefined", "not known"),
    ("WGS 84", _WGS84, "EPSG", _WGS84, "undefined", "longitude and latitude"),
)

_COLOURS = ("#c8b48c", "#a3b18a", "#8fa6b8", "#c99a86", "#b8a5c0", "#d2c56b", "#86b3a8", "#b0a79f")
"""Fills of the kinds in turn."""


def write_gpkg(building: Building, path: Path, crs: str | None = None) -> None:
    """Write a building with two layers: `stones` in space, and `elevation` along the wall and upwards.

    Parameters
    ----------
    crs : of the site, e.g. "EPSG:25832"; None: not known
    """
    moment = building.date.strftime("%Y-%m-%dT%H:%M:%S.000Z")
    with sqlite3.connect(path) as db:
        db.execute(f"PRAGMA application_id = {_APPLICATION}")
        db.execute(f"PRAGMA user_version = {_VERSION}")
        db.executescript(_TABLES)
        db.executemany("INSERT INTO gpkg_spatial_ref_sys VALUES (?,?,?,?,?,?)", _SYSTEMS)
        number = _CARTESIAN
        if crs is not None:
            name, _, digits = crs.partition(":")
            number = int(digits)
            if number != 4326:
                row = (crs, number, name, number, "undefined", None)
                db.execute("INSERT INTO gpkg_spatial_ref_sys VALUES (?,?,?,?,?,?)", row)
        faces = [_face(building, row) for row in range(len(building.codes))]
        style = _style(sorted(set(building.kinds)))
        _layer(db, building, "stones", faces, number, moment, style)
        _layer(db, building, "elevation", [_unrolled(face) for face in faces], _CARTESIAN, moment, style)
    db.close()


def _face(building: Building, row: int) -> Array:
    """Return the surveyed face of a stone; where there is none, the largest one of its solid. (nc, 3) [m]."""
    outline = building.outlines[row]
    if outline is not None:
        return outline
    vertices, faces = building.shapes[row]
    polygons = [vertices[list(face)] for face in faces]
    return max(polygons, key=lambda corners: float(np.linalg.norm(_area_vector(corners))))


def _area_vector(corners: Array) -> Array:
    """Return the vector area (3,) of a polygon [m²]."""
    arms = corners - corners[0]
    return np.asarray(np.cross(arms[1:-1], arms[2:]).sum(axis=0) / 2)


def _unrolled(corners: Array) -> Array:
    """Return the corners (nc, 2) along the horizontal of their plane and upwards [m]."""
    normal = _area_vector(corners)
    along = np.array([-normal[1], normal[0]])
    length = float(np.linalg.norm(along))
    along = np.array([1.0, 0.0]) if length <= 0.5 * np.linalg.norm(normal) else along / length
    return np.column_stack([corners[:, :2] @ along, corners[:, 2]])


def _layer(
    db: sqlite3.Connection,
    building: Building,
    name: str,
    faces: Sequence[Array],
    system: int,
    moment: str,
    style: str,
) -> None:
    """Add a layer of polygons with all attributes."""
    columns: list[tuple[str, str, Sequence[Value]]] = [
        ("code", "TEXT", list(building.codes)),
        ("solid_volume", "DOUBLE", building.volumes.tolist()),
    ]
    for column in building.columns:
        number = isinstance(column.values, np.ndarray)
        columns.append((column.name, "DOUBLE" if number else "TEXT", plain_values(column)))
    declared = ", ".join(f'"{label}" {kind}' for label, kind, _ in columns)
    db.execute(f'CREATE TABLE "{name}" (fid INTEGER PRIMARY KEY AUTOINCREMENT, geom BLOB, {declared})')
    flat = np.concatenate([face[:, :2] for face in faces])
    box = (*flat.min(axis=0).tolist(), *flat.max(axis=0).tolist())
    contents = (name, "features", name, "", moment, *box, system)
    db.execute("INSERT INTO gpkg_contents VALUES (?,?,?,?,?,?,?,?,?,?)", contents)
    deep = faces[0].shape[1] == 3
    db.execute(
        "INSERT INTO gpkg_geometry_columns VALUES (?,'geom','POLYGON',?,?,0)", (name, system, int(deep))
    )
    marks = ",".join("?" * (len(columns) + 2))
    db.executemany(
        f'INSERT INTO "{name}" VALUES ({marks})',
        (
            (row + 1, _geometry(face, system), *(values[row] for _, _, values in columns))
            for row, face in enumerate(faces)
        ),
    )
    db.execute(
        "INSERT INTO layer_styles VALUES (NULL,'','',?,'geom','kind',?,'',1,'stones by kind','',NULL,?)",
        (name, style, moment),
    )


def _geometry(corners: Array, system: int) -> bytes:
    """Return a polygon as GeoPackage stores it: a head with its box, then well-known binary."""
    ring = np.vstack([corners, corners[:1]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    head = struct.pack("<2sBBi4d", b"GP", 0, 0b11, system, low[0], high[0], low[1], high[1])
    kind = 1003 if corners.shape[1] == 3 else 3  # with z, or without
    return head + struct.pack("<BIII", 1, kind, 1, len(ring)) + ring.astype("<f8").tobytes()


def _style(kinds: Sequence[str]) -> str:
    """Return a style of QGIS that fills each kind with a colour of its own."""
    categories, symbols = [], []
    for place, kind in enumerate(kinds):
        red, green, blue = (int(_COLOURS[place % len(_COLOURS)][at : at + 2], 16) for at in (1, 3, 5))
        label = quoteattr(kind)
        categories.append(f'<category value={label} label={label} symbol="{place}" render="true"/>')
        symbols.append(
            f'<symbol type="fill" name="{place}" alpha="1"><layer class="SimpleFill" enabled="1">'
            f'<Option type="Map"><Option type="QString" name="color" value="{red},{green},{blue},255"/>'
            '<Option type="QString" name="outline_color" value="60,60,60,255"/>'
            '<Option type="QString" name="outline_width" value="0.2"/></Option></layer></symbol>'
        )
    return (
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
        '<qgis version="3.28" styleCategories="Symbology">'
        '<renderer-v2 type="categorizedSymbol" attr="kind" symbollevels="0" enableorderby="0">'
        f"<categories>{''.join(categories)}</categories><symbols>{''.join(symbols)}</symbols>"
        "</renderer-v2></qgis>\n"
    )
