"""Contents of a database as other programs take them: solids, attributes, groups, materials, and results of a run."""

import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from archmodel.query.api import find_rows
from archmodel.query.attributes import attributes_of
from archmodel.store.stone_arrays import ENTITY, Faces, stone_faces, stone_shapes
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import Material
from archmodel.tables.relations import Membership
from archmodel.tables.runs import Run
from archmodel.tables.structures import Structure
from archmodel.tables.surveys import Survey
from ground.errors import UsageError
from mechanics.arrays import Array, Ints
from mechanics.stones.polyhedra import alike, mass_properties_alike
from pipelines.reports.page.known import column_of
from pipelines.reports.page.model import Column, Stones
from pipelines.reports.page.surfaces import stones_of

_NAMESPACE = uuid.UUID("6a3c2f0e-6c1b-5e0b-9d52-2f6b7a4c9e11")
"""Of all identifiers that are derived from codes; it never changes."""

_OMITTED = ("code", "x", "y", "z")

Value = float | str | None


@dataclass(frozen=True)
class Group:
    """A structure, such as a course or a wall.

    Attributes
    ----------
    code, kind, title : of the structure
    parent : code of the structure that it is a part of; None if it is of none
    members : rows of its stones
    """

    code: str
    kind: str
    title: str | None
    parent: str | None
    members: tuple[int, ...]


@dataclass(frozen=True)
class Building:
    """A building for other programs; stones are in the order of their numbers in the database.

    Attributes
    ----------
    title : of the first survey
    date : of the latest entry, in UTC
    codes, kinds : (n,) of the stones
    shapes : (n,) vertices (nv, 3) [m] and faces of each solid, in the frame of the site
    mesh : triangles of all solids
    outlines, normals : (n,) corners (nc, 3) of the surveyed face [m] and its outward unit normal; None: no face
    volumes, centroids : (n,), (n, 3) of the solids [m³, m]
    columns : attributes, and results of the run
    groups : structures
    materials : by name the value and the unit of each property
    run, outcome : number of the run and its outcome; None: no run
    """

    title: str
    date: datetime
    codes: Sequence[str]
    kinds: Sequence[str]
    shapes: Sequence[tuple[Array, Faces]]
    mesh: Stones
    outlines: Sequence[Array | None]
    normals: Sequence[Array | None]
    volumes: Array
    centroids: Array
    columns: tuple[Column, ...]
    groups: tuple[Group, ...]
    materials: dict[str, dict[str, tuple[float, str]]]
    run: int | None
    outcome: str | None

    def values(self, name: str) -> Sequence[Value]:
        """Return the values of an attribute by stone; None where not known."""
        for column in self.columns:
            if column.name == name:
                return plain_values(column)
        return [None] * len(self.codes)

    def starts(self) -> Ints:
        """Return the first vertex of each stone in the mesh, and their number at the end; (n + 1,)."""
        return np.searchsorted(self.mesh.owner, np.arange(len(self.codes) + 1))


def plain_values(column: Column) -> list[Value]:
    """Return numbers or texts; None where not known."""
    if isinstance(column.values, np.ndarray):
        return [value if np.isfinite(value) else None for value in column.values.tolist()]
    return list(column.values)


def stable_uuid(*words: str) -> uuid.UUID:
    """Return the identifier that belongs to these words, the same in every export."""
    return uuid.uuid5(_NAMESPACE, "\x1f".join(words))


def read_building(session: Session, run: int | None = None) -> Building:
    """Read all stones with a solid, and what is known of them now.

    Parameters
    ----------
    run : whose results come along; None: no results

    Raises
    ------
    UsageError : there is no such run, or no stone with a solid
    """
    outcome = None
    if run is not None:
        outcome = session.scalar(select(Run.outcome).where(Run.id == run))
        if outcome is None:
            raise UsageError(
                f"there is no run {run}", where="--run", remedy="moma runs lists those there are"
            )
    solids = [shape for shape in stone_shapes(session) if len(shape[2])]
    if not solids:
        raise UsageError("no stone has a solid", where="export", remedy="take in a survey first: moma ingest")
    ids = {number: row for row, (number, _, _) in enumerate(solids)}
    names = session.execute(select(ENTITY.id, ENTITY.code, ENTITY.kind)).all()
    named = {number: (str(code), str(kind)) for number, code, kind in names}
    codes, kinds = zip(*(named[number] for number in ids), strict=True)
    shapes = [(np.asarray(vertices), faces) for _, vertices, faces in solids]
    mesh, _ = stones_of(codes, shapes)
    volumes, centroids = _volumes_and_centroids(codes, shapes)
    outlines: list[Array | None] = [None] * len(codes)
    normals: list[Array | None] = [None] * len(codes)
    for face in stone_faces(session):
        row = ids[face.id]
        outlines[row], normals[row] = face.outline, face.normal
    return Building(
        title=session.scalar(select(Survey.name).order_by(Survey.id)) or "MOMA",
        date=session.scalar(select(func.max(Entry.recorded_at))) or datetime(1970, 1, 1),
        codes=codes,
        kinds=kinds,
        shapes=shapes,
        mesh=mesh,
        outlines=outlines,
        normals=normals,
        volumes=volumes,
        centroids=centroids,
        columns=_columns(session, codes, run),
        groups=_groups(session, ids),
        materials=_materials(session),
        run=run,
        outcome=outcome,
    )


def _volumes_and_centroids(
    codes: Sequence[str], shapes: Sequence[tuple[Array, Faces]]
) -> tuple[Array, Array]:
    """Return volumes (n,) [m³] and centroids (n, 3) [m] of the solids."""
    volumes, centroids = np.empty(len(shapes)), np.empty((len(shapes), 3))
    vertices, faces = zip(*shapes, strict=True)
    for shared, rows in alike(vertices, faces):
        corners = np.stack([vertices[row] for row in rows])
        names = [f"stone {codes[row]}" for row in rows]
        volumes[rows], centroids[rows], _ = mass_properties_alike(corners, shared, names)
    return volumes, centroids


def _columns(session: Session, codes: Sequence[str], run: int | None) -> tuple[Column, ...]:
    """Return the attributes of which any stone has a value."""
    asked = {
        name: attribute
        for name, attribute in attributes_of(session).items()
        if name not in _OMITTED and (run is not None or not (attribute.of_run or name in ("run", "runs")))
    }
    place = {code: row for row, code in enumerate(codes)}
    rows: list[dict[str, object]] = [{} for _ in codes]
    for values in find_rows(session, "entity", run=run, columns=["code", *asked]):
        if (row := place.get(str(values["code"]))) is not None:
            rows[row] = values
    columns = (
        column_of(attribute, [values.get(name) for values in rows]) for name, attribute in asked.items()
    )
    return tuple(column for column in columns if column is not None)


def _groups(session: Session, ids: dict[int, int]) -> tuple[Group, ...]:
    """Return the structures that are held now, with their stones."""
    groups = session.scalars(
        select(Structure).where(Structure.superseded_id.is_(None)).order_by(Structure.code)
    ).all()
    codes = {group.id: group.code for group in groups}
    members: dict[int, list[int]] = {}
    rows = session.execute(
        select(Membership.structure_id, Membership.entity_id)
        .where(Membership.superseded_id.is_(None))
        .order_by(Membership.structure_id, Membership.entity_id)
    )
    for structure, entity in rows:
        if entity in ids:
            members.setdefault(structure, []).append(ids[entity])
    return tuple(
        Group(
            group.code,
            group.kind,
            group.title,
            None if group.parent_id is None else codes.get(group.parent_id),
            tuple(sorted(set(members.get(group.id, ())))),
        )
        for group in groups
    )


def _materials(session: Session) -> dict[str, dict[str, tuple[float, str]]]:
    """Return the properties of the materials that are held now."""
    materials = session.scalars(
        select(Material).where(Material.superseded_id.is_(None)).order_by(Material.name)
    )
    return {
        material.name: {
            each.name: (each.value, each.unit)
            for each in sorted(material.properties, key=lambda each: each.name)
            if each.superseded_id is None
        }
        for material in materials
    }
