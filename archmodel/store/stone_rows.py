"""From plain records to rows of the tables and back, with every value checked on the way in."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from archmodel.arrays import Array
from archmodel.store.stone_record import StoneRecord
from archmodel.tables.entities import Entity, kind_named, kind_of
from archmodel.tables.surveys import Measurement
from moma.errors import DatabaseError, GeometryError, SurveyError, UsageError

__all__ = ["entity_rows", "measurement_row", "solid_volume", "solid_volumes", "stone_record", "storable"]


def entity_rows(stones: Sequence[StoneRecord], places: Sequence[str]) -> list[dict[str, object]]:
    """Rows of the `entity` table, without their keys.

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
    depth_sigma = None if stone.depth_sigma is None else _number(stone.depth_sigma, "depth_sigma", place)
    x, y, z = centroid
    return {
        "code": _text(stone.code, "code", place),
        "course": None if stone.course is None else int(stone.course),
        "depth": _number(stone.depth, "depth", place),
        "depth_sigma": depth_sigma,
        "depth_source": storable(stone.depth_source),
        "depth_origin": stone.depth_origin,
        "zone": None if stone.zone is None else _text(stone.zone, "zone", place),
        "hypothesis": bool(stone.hypothesis),
        "length": _number(stone.length, "length", place),
        "height": _number(stone.height, "height", place),
        "area": _number(stone.area, "area", place),
        "volume": volume,
        "x": x,
        "y": y,
        "z": z,
    }


def measurement_row(stone: StoneRecord, place: str) -> dict[str, object]:
    """Row of the `measurement` table, without its key."""
    rejected = [int(index) for index in stone.rejected]
    points = _array(stone.points, (-1, 3), "points", place)
    if any(not 0 <= index < len(points) for index in rejected):
        raise SurveyError(f"rejected point {max(rejected)} of {len(points)} points", where=place)
    return {
        "line": int(stone.line),
        "sigma": _number(stone.sigma, "sigma", place),
        "offset": _number(stone.offset, "offset", place),
        "rms": _number(stone.rms, "rms", place),
        "redundancy": int(stone.redundancy),
        "point_count": len(points),
        "rejected_count": len(rejected),
        "rejected": tuple(rejected),
        "rejected_vertices": tuple(int(index) for index in stone.rejected_vertices),
        "provenance": stone.provenance,
        "provenance_text": storable(stone.provenance_text),
        "shape": stone.shape,
        "shape_text": stone.shape_text,
        "station": stone.station,
        "photograph": stone.photograph,
        "tail": _number(stone.tail, "tail", place),
        "direction": None if stone.direction is None else _array(stone.direction, (3,), "direction", place),
        "centroid": _array(stone.centroid, (3,), "centroid", place),
        "axes": _array(stone.axes, (2, 3), "axes", place),
        "vertex_sigma": np.asarray(stone.vertex_sigma, dtype=np.float64).reshape(-1, 3),
        "image": _array(stone.image, (-1, 2), "image", place),
        "sigmas": None if stone.sigmas is None else _array(stone.sigmas, (-1,), "sigmas", place),
        "names": stone.names,
        "remarks": stone.remarks,
        "normal": _array(stone.normal, (3,), "normal", place),
        "covariance": _array(stone.covariance, (3, 3), "covariance", place),
        "vertices": _array(stone.vertices, (-1, 3), "vertices", place),
        "points": points,
        "outline": _array(stone.outline, (-1, 3), "outline", place),
        "solid_vertices": _array(stone.solid_vertices, (-1, 3), "solid_vertices", place),
        "solid_faces": _plain_faces(stone.solid_faces),
        "notes": {str(key): str(value) for key, value in stone.notes.items()},
    }


def stone_record(entity: Entity, measured: Measurement) -> StoneRecord:
    """The record that was stored, with arrays of its own."""
    return StoneRecord(
        code=entity.code,
        kind=entity.kind,
        course=entity.course,
        line=measured.line,
        vertices=measured.vertices.copy(),
        points=measured.points.copy(),
        sigma=measured.sigma,
        normal=measured.normal.copy(),
        offset=measured.offset,
        centroid=measured.centroid.copy(),
        axes=measured.axes.copy(),
        covariance=measured.covariance.copy(),
        rms=measured.rms,
        redundancy=measured.redundancy,
        rejected=tuple(measured.rejected),
        outline=measured.outline.copy(),
        length=_known("length", entity),
        height=_known("height", entity),
        area=_known("area", entity),
        depth=_known("depth", entity),
        depth_sigma=entity.depth_sigma,
        depth_source=entity.depth_source or "",
        solid_vertices=measured.solid_vertices.copy(),
        solid_faces=tuple(tuple(face) for face in measured.solid_faces),
        vertex_sigma=measured.vertex_sigma.copy(),
        notes=dict(measured.notes),
        zone=entity.zone,
        depth_origin=entity.depth_origin or "stone",
        provenance=measured.provenance,
        provenance_text=measured.provenance_text,
        station=measured.station,
        photograph=measured.photograph,
        image=measured.image.copy(),
        sigmas=None if measured.sigmas is None else measured.sigmas.copy(),
        names=tuple(measured.names),
        rejected_vertices=tuple(measured.rejected_vertices),
        shape=measured.shape,
        shape_text=measured.shape_text,
        direction=None if measured.direction is None else measured.direction.copy(),
        tail=measured.tail,
        remarks=tuple(measured.remarks),
        hypothesis=entity.hypothesis,
    )


def _known(name: str, entity: Entity) -> float:
    """A number that every measured entity has."""
    value: float | None = getattr(entity, name)
    if value is None:
        raise DatabaseError(f"the {name} of {entity.code} is not known", where=f"entity {entity.id}")
    return value


def storable(text: str) -> str:
    """The text with undecodable bytes (of a file's name, say) spelled out, since no database takes them."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _kind(name: str, place: str) -> str:
    """The kind's own spelling; a kind of the hierarchy or an error at its place in the survey."""
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
    """`value` as floats; an error unless it has the shape (first -1: any length) and only finite numbers."""
    array = np.asarray(value, dtype=np.float64)
    found = array.shape
    if found != shape and (shape[0] != -1 or len(found) != len(shape) or found[1:] != shape[1:]):
        raise SurveyError(f"{name} has shape {array.shape}, expected {shape}", where=place)
    # a sum that is finite has finite terms; the other way round it need not be so
    if not math.isfinite(array.sum()) and not np.isfinite(array).all():
        raise SurveyError(f"{name} has a coordinate that is not a finite number", where=place)
    return array


@lru_cache(maxsize=256)
def _plain_faces(faces: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
    """The faces in Python's own integers; those of most stones are alike."""
    return tuple(tuple(int(index) for index in face) for face in faces)


def _check_solid(stone: StoneRecord, place: str) -> None:
    """The solid is made of polygons on its vertices."""
    vertices = _array(stone.solid_vertices, (-1, 3), "solid_vertices", place)
    count = len(vertices)
    if not stone.solid_faces:
        raise GeometryError("the volume of the solid is 0 m³", where=place, remedy="give it faces")
    if any(len(face) < 3 or min(face) < 0 or max(face) >= count for face in stone.solid_faces):
        what = f"a face of the solid is not a polygon on its {count} vertices"
        raise GeometryError(what, where=place)


Faces = Sequence[Sequence[int]]


def solid_volume(vertices: Array, faces: Faces) -> tuple[float, Array]:
    """Volume [m³] and centroid (3,) [m] of a closed polyhedron, by the divergence theorem.

    The volume is negative if the faces are clockwise seen from outside.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    faces : vertex indices of each planar face, counter-clockwise seen from outside
    """
    volumes, centroids = _alike(vertices[None], faces)
    return float(volumes[0]), centroids[0]


def solid_volumes(solids: Sequence[tuple[Array, tuple[tuple[int, ...], ...]]]) -> tuple[Array, Array]:
    """As `solid_volume` of many solids, (n,) and (n, 3); those with the same faces are computed together.

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
    """Volumes (n,) and centroids (n, 3) of solids that differ in their vertices (n, nv, 3) only."""
    origin = vertices.mean(axis=1)  # sums of small numbers, wherever the site's frame has its origin
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
