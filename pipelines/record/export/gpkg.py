"""Stones as GeoPackage: faces in space and in elevation, with all attributes and a style by kind."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ground.tables.geopackage import Layer, write_geopackage
from mechanics.arrays import Array
from pipelines.record.export.building import Building, Value, plain_values


def write_gpkg(building: Building, path: Path, crs: str | None = None) -> None:
    """Write a building with two layers: `stones` in space, and `elevation` along the wall and upwards.

    Parameters
    ----------
    crs : of the site, e.g. "EPSG:25832"; None: not known
    """
    faces = [_face(building, row) for row in range(len(building.codes))]
    columns: list[tuple[str, str, Sequence[Value]]] = [
        ("code", "TEXT", list(building.codes)),
        ("solid_volume", "DOUBLE", building.volumes.tolist()),
    ]
    for column in building.columns:
        number = isinstance(column.values, np.ndarray)
        columns.append((column.name, "DOUBLE" if number else "TEXT", plain_values(column)))
    title = "stones by kind"
    layers = (
        Layer("stones", faces, columns, "kind", title, system=True),
        Layer("elevation", [_unrolled(face) for face in faces], columns, "kind", title),
    )
    write_geopackage(path, layers, building.date, crs)


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
