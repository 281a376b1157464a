"""Version 2: stations and frames of surveys, zones, kinds of evidence of depths, planes about their centroids, shapes.

What version 1 did not keep is said to be unknown, but for two things that follow from it: the plane's centroid and
axes (`migrations.planes`), and whether a depth was measured on the stone or is that of its kind. It is that of the kind
where several stones of the kind share it in one survey, or where the stone is the only one of its kind.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from alembic import op
from sqlalchemy import Connection, Row, Select, Table, func, select

from archmodel.arrays import Array
from archmodel.migrations.layouts import version1, version2
from archmodel.migrations.planes import covariance_of_offset, plane_of_version_1
from archmodel.migrations.steps import begin_layout, carry, carry_rows, end_layout, read

__all__ = ["depends_on", "down_revision", "downgrade", "losses", "revision", "upgrade"]

revision = "0002"
down_revision = "0001"
depends_on = None

_NEW: dict[str, object] = {
    "provenance": "points",
    "provenance_text": "points measured on the face",
    "shape": "untested",
    "shape_text": "not tested: taken in before shapes were",
    "station": None,
    "photograph": None,
    "tail": 1.0,
    "direction": None,
    "image": b"",
    "sigmas": None,
    "names": [],
    "remarks": [],
}
"""What is said of every measurement of version 1."""


def upgrade() -> None:
    """From version 1."""
    connection = op.get_bind()
    old = begin_layout(connection, version1.metadata, version2.metadata)
    new = version2.metadata.tables
    carry_rows(connection, new["survey"], map(_survey_up, read(connection, _ordered(old["survey"]))))
    origin = _depth_origins(connection, old["entity"])
    rows = read(connection, _ordered(old["entity"]))
    carry_rows(
        connection,
        new["entity"],
        (row._asdict() | {"zone": None, "depth_origin": origin(row)} for row in rows),
    )
    rows = read(connection, select(old["measurement"]).order_by(old["measurement"].c.entity_id))
    carry_rows(connection, new["measurement"], map(_measurement_up, rows))
    for name in ("run", "entity_result"):
        carry(connection, new[name], select(old[name]))
    end_layout(connection, version1.metadata, version2.metadata, 2)


def downgrade() -> None:
    """To version 1, without what it cannot hold (`losses`)."""
    connection = op.get_bind()
    old = begin_layout(connection, version2.metadata, version1.metadata)
    new = version1.metadata.tables
    carry_rows(connection, new["survey"], map(_survey_down, read(connection, _ordered(old["survey"]))))
    carry(connection, new["entity"], _kept_columns(old["entity"], new["entity"]))
    rows = read(connection, select(old["measurement"]).order_by(old["measurement"].c.entity_id))
    names = [column.name for column in new["measurement"].columns]
    carry_rows(connection, new["measurement"], (_measurement_down(row, names) for row in rows))
    for name in ("run", "entity_result"):
        carry(connection, new[name], select(old[name]))
    end_layout(connection, version2.metadata, version1.metadata, 1)


def losses(connection: Connection) -> Iterator[str]:
    """What version 1 cannot hold of this database, in words."""
    tables = version2.metadata.tables
    measured, entity, survey = tables["measurement"].c, tables["entity"].c, tables["survey"].c
    conditions = {
        "frames of surveys": survey.frame.is_not(None),
        "zones of stones": entity.zone.is_not(None),
        "what kind of evidence depths have": entity.id.is_not(None),
        "shapes of faces, broken corners, precision of hidden sides": measured.line.is_not(None),
        "that faces were measured in photographs or on solids": measured.provenance != "points",
    }
    for text, condition in conditions.items():
        if count := connection.scalar(select(func.count()).where(condition)):
            yield f"{text} ({count})"


def _ordered(table: Table) -> Select[Any]:
    return select(table).order_by(table.c.id)


def _kept_columns(old: Table, new: Table) -> Select[Any]:
    return select(*(column for column in old.columns if column.name in new.columns))


def _survey_up(row: Row[Any]) -> dict[str, Any]:
    values = row._asdict()
    observer = values.pop("observer")
    stations = {} if observer is None else {"observer": _array(observer, 3).tolist()}
    return values | {"stations": stations, "frame": None}


def _survey_down(row: Row[Any]) -> dict[str, Any]:
    """The observer, or else the only station: from there the faces were seen that say nothing else."""
    values = row._asdict()
    stations: Mapping[str, list[float]] = values.pop("stations")
    del values["frame"]
    only = next(iter(stations.values())) if len(stations) == 1 else None
    place = stations.get("observer", only)
    return values | {"observer": None if place is None else _bytes(np.array(place))}


def _depth_origins(connection: Connection, entity: Table) -> Callable[[Row[Any]], str]:
    """A function from an entity to the kind of evidence of its depth."""
    depth = (entity.c.depth, entity.c.depth_sigma, entity.c.depth_source)
    query = select(entity.c.survey_id, entity.c.kind, *depth, func.count().label("stones"))
    alike: dict[tuple[Any, ...], int] = {}
    of_kind: dict[tuple[int, str], int] = {}
    for *key, stones in connection.execute(query.group_by(entity.c.survey_id, entity.c.kind, *depth)):
        alike[tuple(key)] = stones
        of_kind[key[0], key[1]] = of_kind.get((key[0], key[1]), 0) + stones

    def origin(row: Row[Any]) -> str:
        key = (row.survey_id, row.kind, row.depth, row.depth_sigma, row.depth_source)
        return "kind" if alike[key] > 1 or of_kind[key[:2]] == 1 else "stone"

    return origin


def _measurement_up(row: Row[Any]) -> dict[str, Any]:
    plane = plane_of_version_1(
        points=_array(row.points, -1, 3),
        vertices=_array(row.vertices, -1, 3),
        outline=_array(row.outline, -1, 3),
        rejected=row.rejected,
        redundancy=row.redundancy,
        normal=_array(row.normal, 3),
        offset=row.offset,
        covariance=_array(row.covariance, 3, 3),
    )
    return row._asdict() | {
        **_NEW,
        "rejected_vertices": list(plane.rejected_vertices),
        "centroid": _bytes(plane.centroid),
        "axes": _bytes(plane.axes),
        "covariance": _bytes(plane.covariance),
        "vertex_sigma": _bytes(np.full_like(_array(row.solid_vertices, -1, 3), np.nan)),
    }


def _measurement_down(row: Row[Any], names: list[str]) -> dict[str, Any]:
    covariance = covariance_of_offset(
        _array(row.centroid, 3), _array(row.axes, 2, 3), _array(row.covariance, 3, 3)
    )
    values = row._asdict() | {"covariance": _bytes(covariance)}
    return {name: values[name] for name in names}


def _array(stored: bytes, *shape: int) -> Array:
    return np.frombuffer(stored, dtype="<f8").reshape(shape)


def _bytes(array: Array) -> bytes:
    return array.astype("<f8").tobytes()
