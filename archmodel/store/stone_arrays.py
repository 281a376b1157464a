"""Stones read as columns instead of objects, for searches among a hundred thousand of them."""

import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from sys import intern
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement, Executable, LargeBinary, Text, cast, func, or_, select, type_coerce
from sqlalchemy.orm import InstrumentedAttribute, Session

from archmodel.arrays import Array, Ints
from archmodel.store.bulk import batches
from archmodel.store.revisions import table_of
from archmodel.tables.entities import Entity
from archmodel.tables.surveys import Measurement

Faces = tuple[tuple[int, ...], ...]

_AT_ONCE = 2000  # rows that are fetched together
_RANGES = 200  # ranges of numbers in one condition, far below SQLite's limit of parameters

ENTITY = table_of(Entity).c
"""Columns of entities, for statements without objects."""

_MEASUREMENT = table_of(Measurement).c


@dataclass(frozen=True)
class StoneColumns:
    """Columns of many stones, in the order of their numbers.

    Attributes
    ----------
    ids : (n,) their primary keys, growing
    kinds, zones, courses : (n,) as in Entity
    centres : (n, 3) centroids of their solids; NaN where not known [m]
    normals : (n, 3) outward unit normals of their faces; NaN where nothing was measured [-]
    """

    ids: Ints
    kinds: Sequence[str]
    zones: Sequence[str | None]
    courses: Sequence[int | None]
    centres: Array
    normals: Array

    def __len__(self) -> int:
        return len(self.ids)


def stone_columns(session: Session, *conditions: ColumnElement[bool]) -> StoneColumns:
    """Return the stones for which the conditions on ENTITY hold."""
    statement = (
        select(
            ENTITY.id,
            ENTITY.kind,
            ENTITY.zone,
            ENTITY.course,
            ENTITY.x,
            ENTITY.y,
            ENTITY.z,
            type_coerce(_MEASUREMENT.normal, LargeBinary),
        )
        .outerjoin(
            table_of(Measurement),
            (_MEASUREMENT.entity_id == ENTITY.id) & _MEASUREMENT.superseded_id.is_(None),
        )
        .where(*conditions)
        .order_by(ENTITY.id)
    )
    return joined([_columns(rows) for rows in _parts(session, statement)])


def _columns(rows: Sequence[Any]) -> StoneColumns:
    """Return the columns of some rows, each name kept in memory once."""
    ids, kinds, zones, courses, x, y, z, normals = zip(*rows, strict=True)
    packed = b"".join(_UNKNOWN if normal is None else normal for normal in normals)
    return StoneColumns(
        ids=np.array(ids, dtype=np.int64),
        kinds=[intern(kind) for kind in kinds],
        zones=[None if zone is None else intern(zone) for zone in zones],
        courses=courses,
        centres=np.array([x, y, z], dtype=np.float64).T,
        normals=np.frombuffer(packed, dtype="<f8").reshape(-1, 3),
    )


_UNKNOWN = np.full(3, np.nan).tobytes()


def joined(parts: Sequence[StoneColumns]) -> StoneColumns:
    """Join columns of stones; each stone comes once, in the order of the numbers."""
    ids = np.concatenate([np.zeros(0, np.int64), *(part.ids for part in parts)])
    ids, order = np.unique(ids, return_index=True)
    kinds = [kind for part in parts for kind in part.kinds]
    zones = [zone for part in parts for zone in part.zones]
    courses = [course for part in parts for course in part.courses]
    return StoneColumns(
        ids,
        [kinds[i] for i in order.tolist()],
        [zones[i] for i in order.tolist()],
        [courses[i] for i in order.tolist()],
        np.concatenate([np.zeros((0, 3)), *(part.centres for part in parts)])[order],
        np.concatenate([np.zeros((0, 3)), *(part.normals for part in parts)])[order],
    )


def stone_shapes(session: Session, *conditions: ColumnElement[bool]) -> Iterator[tuple[int, Array, Faces]]:
    """Yield number, vertices (nv, 3) [m] and faces of the solid of each measured stone that meets the conditions."""
    statement = (
        select(
            ENTITY.id,
            type_coerce(_MEASUREMENT.solid_vertices, LargeBinary),
            cast(_MEASUREMENT.solid_faces, Text),
        )
        .join(
            table_of(Measurement),
            (_MEASUREMENT.entity_id == ENTITY.id) & _MEASUREMENT.superseded_id.is_(None),
        )
        .where(*conditions)
        .order_by(ENTITY.id)
    )
    for number, vertices, faces in chain.from_iterable(_parts(session, statement)):
        yield number, np.frombuffer(vertices, dtype="<f8").reshape(-1, 3), _faces(faces)


@dataclass(frozen=True)
class StoneFace:
    """The measured face of a stone, and its depth.

    Attributes
    ----------
    id : primary key of the entity
    code, kind, course, zone : as in Entity
    outline : (nv, 3) counter-clockwise seen from outside [m]
    normal : (3,) outward unit normal [-]
    sigma : (nv, 3) standard deviations of the outline; NaN where not known [m]
    depth, depth_sigma : [m]; None if not known
    area : [m²]
    """

    id: int
    code: str
    kind: str
    course: int | None
    zone: str | None
    outline: Array
    normal: Array
    sigma: Array
    depth: float | None
    depth_sigma: float | None
    area: float


def stone_faces(session: Session, *conditions: ColumnElement[bool]) -> Iterator[StoneFace]:
    """Yield the faces of the stones that were measured and meet the conditions on ENTITY, by their numbers."""
    statement = (
        select(
            *(
                ENTITY[name]
                for name in ("id", "code", "kind", "course", "zone", "depth", "depth_sigma", "area")
            ),
            *(type_coerce(_MEASUREMENT[name], LargeBinary) for name in ("outline", "normal", "vertex_sigma")),
        )
        .join(
            table_of(Measurement),
            (_MEASUREMENT.entity_id == ENTITY.id) & _MEASUREMENT.superseded_id.is_(None),
        )
        .where(_MEASUREMENT.provenance != "hypothesis", *conditions)
        .order_by(ENTITY.id)
    )
    for number, code, kind, course, zone, depth, depth_sigma, area, *packed in chain.from_iterable(
        _parts(session, statement)
    ):
        outline, normal, sigma = (np.frombuffer(buffer, dtype="<f8") for buffer in packed)
        corners = outline.reshape(-1, 3)
        yield StoneFace(
            id=number,
            code=code,
            kind=kind,
            course=course,
            zone=zone,
            outline=corners,
            normal=normal,
            sigma=sigma.reshape(-1, 3)[: len(corners)],
            depth=depth,
            depth_sigma=depth_sigma,
            area=area,
        )


@lru_cache(maxsize=1024)
def _faces(text: str) -> Faces:
    """Return the faces in a JSON text; most solids have the same."""
    return tuple(tuple(face) for face in json.loads(text))


def _parts(session: Session, statement: Executable) -> Iterator[Sequence[Any]]:
    """Yield the rows of a statement, some at a time."""
    yield from session.execute(statement, execution_options={"yield_per": _AT_ONCE}).partitions()


def id_conditions(
    column: ColumnElement[int] | InstrumentedAttribute[int], numbers: Collection[int]
) -> Iterator[ColumnElement[bool]]:
    """Yield conditions that together hold for these numbers: few where numbers are consecutive."""
    for some in _chunks(_runs(sorted(set(numbers)))):
        yield or_(*(column.between(low, high) for low, high in some))


def _runs(numbers: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield first and last of each run of consecutive numbers."""
    if not numbers:
        return
    first = last = numbers[0]
    for number in numbers[1:]:
        if number != last + 1:
            yield first, last
            first = number
        last = number
    yield first, last


def _chunks(runs: Iterable[tuple[int, int]]) -> Iterator[list[tuple[int, int]]]:
    waiting: list[tuple[int, int]] = []
    for batch in batches(runs):
        for stone in batch:
            waiting.append(stone)
            if len(waiting) == _RANGES:
                yield waiting
                waiting = []
    if waiting:
        yield waiting


def near_box(low: Array, high: Array, reach: float) -> ColumnElement[bool]:
    """Return the condition that a stone may come within a distance of a box.

    No corner of a solid is farther from its centroid than its length, height and depth together.

    Parameters
    ----------
    low, high : (3,) corners of the box [m]
    reach : the distance [m]
    """
    size = (
        func.coalesce(ENTITY.length, 0.0)
        + func.coalesce(ENTITY.height, 0.0)
        + func.coalesce(ENTITY.depth, 0.0)
        + reach
    )
    out: ColumnElement[bool] = ENTITY.x.is_not(None)
    for place, bottom, top in zip((ENTITY.x, ENTITY.y, ENTITY.z), low.tolist(), high.tolist(), strict=True):
        out = out & (place + size >= bottom) & (place - size <= top)
    return out
