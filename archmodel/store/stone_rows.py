"""Records of stones to rows of the tables and back, with every value checked on the way in.

A field of `StoneRecord` is stored in the column of its name, of `Entity` or `Measurement`; the type of the column says
how it is checked and converted. A new field needs a column, and nothing here.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from functools import lru_cache
from typing import Any

import numpy as np
from sqlalchemy import JSON, Column, Float
from sqlalchemy.orm import Mapper

from archmodel.arrays import Array
from archmodel.store.stone_record import StoneRecord
from archmodel.tables.base import ArrayType, Base, annotation_of
from archmodel.tables.entities import Entity, kind_named
from archmodel.tables.hierarchy import kind_of
from archmodel.tables.surveys import Measurement
from ground.errors import DatabaseError, GeometryError, SurveyError, UsageError


def entity_rows(stones: Sequence[StoneRecord], places: Sequence[str]) -> list[dict[str, object]]:
    """Return the rows of the `entity` table, without their keys.

    Parameters
    ----------
    stones : the records
    places : ``file:line stone CODE`` of each, for errors
    """
    kinds: dict[str, str] = {}
    for stone, place in zip(stones, places, strict=True):
        _check_solid(stone, place)
        if stone.kind not in kinds:
            kinds[stone.kind] = _kind(stone.kind, place)
    volumes, centroids = solid_volumes([(stone.solid_vertices, stone.solid_faces) for stone in stones])
    return [
        {"kind": kinds[stone.kind], **_entity_row(stone, place, volume, centroid)}
        for stone, place, volume, centroid in zip(
            stones, places, volumes.tolist(), centroids.tolist(), strict=True
        )
    ]


def _entity_row(stone: StoneRecord, place: str, volume: float, centroid: list[float]) -> dict[str, object]:
    if not volume > 0.0:
        remedy = "its faces must be counter-clockwise seen from outside, and its depth above zero"
        raise GeometryError(f"the volume of the solid is {volume:g} m³", where=place, remedy=remedy)
    return _row(_ENTITY, stone, place) | {"volume": volume, **dict(zip("xyz", centroid, strict=True))}


def measurement_row(stone: StoneRecord, place: str) -> dict[str, object]:
    """Return the row of the `measurement` table, without its key."""
    count = len(stone.points)
    if any(not 0 <= index < count for index in stone.rejected):
        raise SurveyError(f"rejected point {max(stone.rejected)} of {count} points", where=place)
    return _row(_MEASUREMENT, stone, place) | {
        "point_count": count,
        "rejected_count": len(stone.rejected),
    }


def _row(columns: Mapping[str, "Converter"], stone: StoneRecord, place: str) -> dict[str, object]:
    return {name: convert(getattr(stone, name), place) for name, convert in columns.items()}


def stone_record(entity: Entity, measured: Measurement) -> StoneRecord:
    """Return the record that was stored, with arrays of its own."""
    values = {name: getattr(entity, name) for name in _OF_ENTITY}
    values |= {name: getattr(measured, name) for name in _OF_MEASUREMENT}
    for name, restore in _RESTORERS:
        values[name] = restore(values[name], entity)
    return StoneRecord(**values)


def _kind(name: str, place: str) -> str:
    """Return a kind in its own spelling; an unknown one is an error at its place in the survey."""
    try:
        return kind_of(kind_named(name))
    except UsageError as error:
        raise SurveyError(error.what, where=place, remedy=error.remedy) from None


def _text(value: str, name: str, place: str) -> str:
    if not value or not value.isprintable() or value != value.strip():
        what = f"{name} {value[:40]!r} has no visible character, or some that cannot be typed"
        raise SurveyError(what, where=place)
    return value


def _number(value: float, name: str, place: str) -> float:
    if not (math.isfinite(value) and (value >= 0.0 or name == "offset")):
        raise SurveyError(f"{name} is {value}", where=place, remedy="a finite number, not negative")
    return float(value)


def _array(value: Array, shape: tuple[int, ...], name: str, place: str) -> Array:
    """Return `value` as floats; refuse other shapes (-1 first: any length) and numbers that are not finite."""
    array = np.asarray(value, dtype=np.float64)
    actual = array.shape
    if actual != shape and (shape[0] != -1 or len(actual) != len(shape) or actual[1:] != shape[1:]):
        raise SurveyError(f"{name} has shape {array.shape}, expected {shape}", where=place)
    # a finite sum has finite terms; the converse need not hold
    if not math.isfinite(array.sum()) and not np.isfinite(array).all():
        raise SurveyError(f"{name} has a coordinate that is not a finite number", where=place)
    return array


def _check_solid(stone: StoneRecord, place: str) -> None:
    """Refuse a solid that is not made of polygons on its vertices."""
    vertices = _array(stone.solid_vertices, (-1, 3), "solid_vertices", place)
    count = len(vertices)
    if not stone.solid_faces:
        raise GeometryError("the volume of the solid is 0 m³", where=place, remedy="give it faces")
    if any(len(face) < 3 or min(face) < 0 or max(face) >= count for face in stone.solid_faces):
        what = f"a face of the solid is not a polygon on its {count} vertices"
        raise GeometryError(what, where=place)


Converter = Callable[[Any, str], object]
Restorer = Callable[[Any, Entity], Any]

_TYPED = frozenset({"code", "zone"})
"""Texts that users type, and that must therefore be visible."""

_WITH_GAPS = frozenset({"vertex_sigma"})
"""Arrays in which NaN stands for what is not known."""


def _converter(column: Column[Any], mapper: Mapper[Any]) -> Converter:
    """Return the function from a value of a record, and its place, to the checked value of a column."""
    convert = _strict_converter(column.name, column.type, annotation_of(column, mapper))
    if not column.nullable:
        return convert
    return lambda value, place: None if value is None else convert(value, place)


def _strict_converter(name: str, kind: Any, annotation: object) -> Converter:
    if isinstance(kind, ArrayType):
        if name in _WITH_GAPS:
            return lambda value, place: np.asarray(value, dtype=np.float64).reshape(kind.shape)
        return lambda value, place: _array(value, kind.shape, name, place)
    if isinstance(kind, Float):
        return lambda value, place: _number(value, name, place)
    if name in _TYPED:
        return lambda value, place: _text(value, name, place)
    plain = _PLAIN.get(annotation) or _PLAIN[kind.python_type]
    return lambda value, place: plain(value)


def storable(text: str) -> str:
    """Return the text with undecodable bytes (of a file's name, say), which no database takes, spelled out."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


@lru_cache(maxsize=256)
def _plain_faces(faces: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
    """Return the faces in Python's own integers; most stones have the same faces."""
    return tuple(tuple(int(index) for index in face) for face in faces)


_PLAIN: dict[object, Callable[[Any], object]] = {
    bool: bool,
    int: int,
    str: storable,
    list[int]: lambda values: tuple(int(value) for value in values),
    list[str]: lambda values: values,
    list[list[int]]: _plain_faces,
    list[dict[str, object]]: list,
    dict[str, str]: lambda notes: {str(key): str(value) for key, value in notes.items()},
}
"""Values of a column by its annotation or, without a special one, by its type in Python."""


def _restorer(field: Field[Any], column: Column[Any]) -> Restorer | None:
    """Return the function from a value of a column, and its entity, to that of a record; None where they are equal."""
    kind, optional = column.type, "None" in str(field.type)
    if isinstance(kind, ArrayType):
        return lambda value, entity: None if value is None else value.copy()
    if isinstance(kind, JSON):
        return lambda value, entity: dict(value) if isinstance(value, dict) else _tuples(value)
    if optional or not column.nullable:
        return None
    if isinstance(kind, Float):
        return lambda value, entity: _known(value, field.name, entity)
    default = "" if field.default is MISSING else field.default
    return lambda value, entity: value or default


def _tuples(value: Any) -> Any:
    return tuple(_tuples(item) for item in value) if isinstance(value, list | tuple) else value


def _known(value: object, name: str, entity: Entity) -> object:
    """Return a number that every measured entity has."""
    if value is None:
        raise DatabaseError(f"the {name} of {entity.code} is not known", where=f"entity {entity.id}")
    return value


def _columns_of(cls: type[Base]) -> dict[str, Column[Any]]:
    """Return the columns of a class that records have too, by name."""
    names = {field.name for field in fields(StoneRecord)}
    mapper = cls.__mapper__
    return {column.name: column for column in mapper.columns if column.name in names}


_OF_ENTITY, _OF_MEASUREMENT = _columns_of(Entity), _columns_of(Measurement)
_ENTITY = {
    name: _converter(column, Entity.__mapper__) for name, column in _OF_ENTITY.items() if name != "kind"
}
_MEASUREMENT = {name: _converter(column, Measurement.__mapper__) for name, column in _OF_MEASUREMENT.items()}
_RESTORERS = [
    (field.name, restore)
    for field in fields(StoneRecord)
    if (restore := _restorer(field, {**_OF_MEASUREMENT, **_OF_ENTITY}[field.name])) is not None
]

ENTITY_COLUMNS = ("kind", *_ENTITY, "volume", "x", "y", "z")
"""Columns of `entity_rows`."""


Faces = Sequence[Sequence[int]]


def solid_volume(vertices: Array, faces: Faces) -> tuple[float, Array]:
    """Return volume [m³] and centroid (3,) [m] of a closed polyhedron, by the divergence theorem.

    The volume is negative if the faces are clockwise seen from outside.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    faces : vertex indices of each planar face, counter-clockwise seen from outside

    Examples
    --------
    >>> corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 6.0]])
    >>> volume, centroid = solid_volume(corners, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    >>> round(volume, 12), centroid.tolist()
    (1.0, [0.25, 0.25, 1.5])
    """
    volumes, centroids = _alike(vertices[None], faces)
    return float(volumes[0]), centroids[0]


def solid_volumes(solids: Sequence[tuple[Array, tuple[tuple[int, ...], ...]]]) -> tuple[Array, Array]:
    """Return `solid_volume` of many solids, (n,) and (n, 3); those with equal faces are computed together.

    Parameters
    ----------
    solids : (vertices, faces) of each
    """
    groups: dict[tuple[int, tuple[tuple[int, ...], ...]], list[int]] = {}
    for number, (vertices, faces) in enumerate(solids):
        groups.setdefault((len(vertices), faces), []).append(number)
    volumes, centroids = np.empty(len(solids)), np.empty((len(solids), 3))
    for (_, faces), members in groups.items():
        volumes[members], centroids[members] = _alike(np.stack([solids[i][0] for i in members]), faces)
    return volumes, centroids


def _alike(vertices: Array, faces: Faces) -> tuple[Array, Array]:
    """Return volumes (n,) and centroids (n, 3) of solids that differ in their vertices (n, nv, 3) only."""
    origin = vertices.mean(axis=1)  # keeps the sums small, wherever the origin of the site lies
    fans = np.array([(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)])
    local = vertices - origin[:, None]
    a, b, c = (local[:, fans[:, k]] for k in range(3))
    ux, uy, uz = np.moveaxis(b, 2, 0)
    vx, vy, vz = np.moveaxis(c, 2, 0)
    signed = a[..., 0] * (uy * vz - uz * vy)
    signed += a[..., 1] * (uz * vx - ux * vz)
    signed += a[..., 2] * (ux * vy - uy * vx)
    volume = signed.sum(axis=1) / 6.0
    moment = np.einsum("ij,ijk->ik", signed, a + b + c) / 24.0
    with np.errstate(invalid="ignore", divide="ignore"):
        offset = np.where(volume[:, None] != 0.0, moment / volume[:, None], 0.0)
    return volume, origin + offset
