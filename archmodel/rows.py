"""From plain records to rows of the tables and back, with every value checked on the way in."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from archmodel.entities import Entity, kind_named, kind_of
from archmodel.measures import face_area, face_extent, solid_volume
from archmodel.records import StoneRecord
from archmodel.surveys import Measurement
from moma.errors import DatabaseError, GeometryError, SurveyError, UsageError

__all__ = ["entity_row", "measurement_row", "stone_record", "storable"]

Array = NDArray[np.float64]


def entity_row(stone: StoneRecord, place: str) -> dict[str, object]:
    """Row of the `entity` table, without its keys.

    Parameters
    ----------
    stone : the record
    place : ``file:line stone CODE``, for errors
    """
    vertices = _array(stone.solid_vertices, (-1, 3), "solid_vertices", place)
    volume, centroid = _solid(vertices, stone.solid_faces, place)
    outline = _array(stone.outline, (-1, 3), "outline", place)
    length, height = face_extent(outline, _array(stone.normal, (3,), "normal", place))
    depth_sigma = None if stone.depth_sigma is None else _number(stone.depth_sigma, "depth_sigma", place)
    return {
        "kind": _kind(stone.kind, place),
        "code": _text(stone.code, "code", place),
        "course": None if stone.course is None else int(stone.course),
        "depth": _number(stone.depth, "depth", place),
        "depth_sigma": depth_sigma,
        "depth_source": storable(stone.depth_source),
        "depth_origin": stone.depth_origin,
        "zone": None if stone.zone is None else _text(stone.zone, "zone", place),
        "length": length,
        "height": height,
        "area": face_area(outline),
        "volume": volume,
        "x": float(centroid[0]),
        "y": float(centroid[1]),
        "z": float(centroid[2]),
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
        "rejected": rejected,
        "rejected_vertices": [int(index) for index in stone.rejected_vertices],
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
        "names": list(stone.names),
        "remarks": list(stone.remarks),
        "normal": _array(stone.normal, (3,), "normal", place),
        "covariance": _array(stone.covariance, (3, 3), "covariance", place),
        "vertices": _array(stone.vertices, (-1, 3), "vertices", place),
        "points": points,
        "outline": _array(stone.outline, (-1, 3), "outline", place),
        "solid_vertices": _array(stone.solid_vertices, (-1, 3), "solid_vertices", place),
        "solid_faces": [[int(index) for index in face] for face in stone.solid_faces],
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
        depth=_known(entity.depth, entity),
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
    )


def _known(depth: float | None, entity: Entity) -> float:
    if depth is None:
        raise DatabaseError(f"the depth of {entity.code} is not known", where=f"entity {entity.id}")
    return depth


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
    """`value` as floats; an error unless it has the shape (-1: any length) and only finite numbers."""
    array = np.asarray(value, dtype=np.float64)
    fits = array.ndim == len(shape) and all(
        want in (-1, got) for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits:
        raise SurveyError(f"{name} has shape {array.shape}, expected {shape}", where=place)
    if not np.isfinite(array).all():
        raise SurveyError(f"{name} has a coordinate that is not a finite number", where=place)
    return array


def _solid(vertices: Array, faces: Sequence[Sequence[int]], place: str) -> tuple[float, Array]:
    """Volume and centroid of the stone's solid, which must be the right way out."""
    if any(len(face) < 3 or not all(0 <= index < len(vertices) for index in face) for face in faces):
        what = f"a face of the solid is not a polygon on its {len(vertices)} vertices"
        raise GeometryError(what, where=place)
    volume, centroid = solid_volume(vertices, faces) if faces else (0.0, vertices.sum(axis=0))
    if not volume > 0.0:
        remedy = "its faces must be counter-clockwise seen from outside, and its depth above zero"
        raise GeometryError(f"the volume of the solid is {volume:g} m³", where=place, remedy=remedy)
    return volume, centroid
