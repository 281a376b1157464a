"""Relations of stones: from the solids in the database to its relations, courses and arches."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, field

import numpy as np
from sqlalchemy import ColumnElement, func, or_, select
from sqlalchemy.orm import Session

from archmodel.relations.arches import arch_parts, find_arches
from archmodel.relations.classify import (
    FoundRelations,
    RelationSettings,
    StoneContacts,
    StonesOf,
    relations_between,
)
from archmodel.relations.derived_attributes import arch_values, give_values, tail_lengths
from archmodel.relations.store import Act, Changes, held_settings, store_relations
from archmodel.relations.zones_and_courses import parts_of_survey, store_parts, whole_courses
from archmodel.store.stone_arrays import (
    ENTITY,
    StoneColumns,
    StoneFace,
    id_conditions,
    near_box,
    stone_columns,
    stone_faces,
    stone_shapes,
)
from archmodel.tables.entities import Entity
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.structures import structure_kind_named, structure_kinds
from mechanics.arrays import Array, Ints
from survey.geometry.adjacency import PolyhedraBuilder, SolidArrays, find_touching
from survey.quality.facades import facades_of
from survey.quality.masonry.walls import MasonryQuality, WallStone, judge_masonry


def masonry_values(
    session: Session, among: Collection[int] | None = None
) -> dict[int, dict[str, float | None]]:
    """Return the traces and the masonry quality index of their wall, by entity.

    A wall is what looks one way within a zone; its other face is looked for in the same zone. The state of the stones
    and the mortar are not known, so that the index has a lower and an upper end.

    Parameters
    ----------
    session : a session
    among : numbers of the entities of whose zones the walls are judged; None: all
    """
    zones: dict[str | None, list[StoneFace]] = defaultdict(list)
    for condition in _of_zones(session, among):
        for face in stone_faces(session, condition):
            zones[face.zone].append(face)
    found: dict[int, dict[str, float | None]] = {}
    for faces in zones.values():
        for wall in judge_masonry([_stone(face) for face in faces], facades_of(faces)):
            values = _values(wall)
            found.update((faces[i].id, values) for i in wall.stones.tolist())
    return found


def _of_zones(session: Session, among: Collection[int] | None) -> Iterable[ColumnElement[bool]]:
    """Return conditions for all stones of the zones of some."""
    if among is None:
        return [ENTITY.id.is_not(None)]
    zones: set[str | None] = set()
    for condition in id_conditions(ENTITY.id, among):
        zones.update(session.scalars(select(ENTITY.zone).where(condition).distinct()))
    if not zones:
        return []
    named = ENTITY.zone.in_([zone for zone in zones if zone is not None])
    return [or_(named, ENTITY.zone.is_(None)) if None in zones else named]


def _stone(face: StoneFace) -> WallStone:
    finite = face.sigma[np.isfinite(face.sigma)]
    return WallStone(
        code=face.code,
        kind=face.kind,
        course=face.course,
        zone=face.zone,
        outline=face.outline,
        normal=face.normal,
        sigma=float(np.median(finite)) if len(finite) else 0.0,
        depth=face.depth,
        depth_sigma=face.depth_sigma,
        area=face.area,
    )


def _values(wall: MasonryQuality) -> dict[str, float | None]:
    values: dict[str, float | None] = {"minimum_trace": wall.trace, "section_trace": wall.section}
    for direction, (low, high) in wall.indices.items():
        values[f"mqi_{direction}_low"], values[f"mqi_{direction}_high"] = low, high
    return values


Faces = tuple[tuple[int, ...], ...]


@dataclass
class KnownSolids:
    """Solids at hand, filled stone by stone, so that they need not be read back from the database."""

    ids: list[int] = field(default_factory=list)
    _builder: PolyhedraBuilder = field(default_factory=PolyhedraBuilder)

    def add(self, entity: int, vertices: Array, faces: Faces) -> None:
        """Add the solid of an entity, by its number: vertices (nv, 3) [m] and faces; ignore one without faces."""
        if not faces:
            return
        self.ids.append(entity)
        self._builder.add(vertices, faces)

    def __len__(self) -> int:
        return len(self.ids)

    def build(self) -> SolidArrays:
        """Assemble all solids in the order of `ids`."""
        return self._builder.build()

    def box(self, entities: Collection[int]) -> tuple[Array, Array] | None:
        """Return the lower and upper corner (3,) of the box around some of the solids; None without any of them [m]."""
        shapes, wanted = self.build(), np.isin(np.array(self.ids, dtype=np.int64), list(entities))
        if not wanted.any():
            return None
        counts = np.diff(shapes.solid_starts)
        faces = np.repeat(wanted, counts)
        corners = shapes.corners[np.repeat(faces, np.diff(shapes.face_starts))]
        return shapes.vertices[corners].min(axis=0), shapes.vertices[corners].max(axis=0)


@dataclass(frozen=True)
class RelationReport:
    """Changes of the computed relations of a database.

    Attributes
    ----------
    stones : number of stones considered
    relations : changes by kind of relation
    structures, memberships : changes of zones, courses and arches, and of their members
    values : number of attributes of stones that were added or corrected
    entry : number of the act of recording; None if nothing changed
    """

    stones: int
    relations: Mapping[str, Changes]
    structures: Changes
    memberships: Changes
    values: int
    entry: int | None


def relate(
    session: Session,
    settings: RelationSettings | None = None,
    only: Collection[int] | None = None,
    solids: KnownSolids | None = None,
) -> RelationReport:
    """Compute the relations of stones and what follows from them: courses, arches, tails of headers, masonry quality.

    Rows found again stay, rows no longer found are superseded, and declared ones are left alone.
    A repeated call changes nothing.

    Parameters
    ----------
    session : a writing session
    settings : tolerances; None: those of the last call on this database, initially RelationSettings()
    only : numbers of entities whose relations, with all stones near them, are computed; None: all
    solids : solids at hand; missing ones are read from the database and added
    """
    settings = settings or held_settings(session)
    act = Act(session, "the solids of the stones", asdict(settings))
    session.flush()
    chosen = None if only is None else _chosen(session, only)
    stones, shapes = _stones(session, settings, chosen, solids or KnownSolids())
    found, ids = _relations(stones, shapes, settings, chosen)
    relations = store_relations(session, ids, found, act, chosen)
    courses = stones if chosen is None else whole_courses(session, chosen)
    arch_kinds = kinds_below(structure_kind_named("arch"))
    # zones and courses stay what they are when their kind is corrected, a zone as a tower, say
    other_kinds = structure_kinds().keys() - arch_kinds
    changes = [store_parts(session, parts_of_survey(courses), act, kinds=other_kinds, among=chosen)]
    touched = (
        None if chosen is None else chosen.union(ids[found.subject].tolist(), ids[found.object].tolist())
    )
    tails = {number: {"tail_length": tail} for number, tail in tail_lengths(session, touched).items()}
    values = give_values(session, tails, act)
    values += give_values(session, masonry_values(session, chosen), act)
    arches = find_arches(session)
    changes.append(store_parts(session, arch_parts(session, arches), act, kinds=arch_kinds))
    values += give_values(session, arch_values(arches), act)
    session.expire_all()  # objects loaded earlier hold outdated values
    return RelationReport(
        stones=len(ids),
        relations=relations,
        structures=changes[0][0] + changes[1][0],
        memberships=changes[0][1] + changes[1][1],
        values=values,
        entry=act.made,
    )


def _chosen(session: Session, only: Collection[int]) -> set[int] | None:
    """Return the entities whose relations are computed; None if these are all."""
    chosen = set(only)
    count = session.scalar(select(func.count()).select_from(Entity))
    return None if count == len(chosen) else chosen


def _stones(
    session: Session, settings: RelationSettings, only: set[int] | None, solids: KnownSolids
) -> tuple[StoneColumns, KnownSolids]:
    """Load all stones, or those near the chosen ones, and their solids."""
    if only is None:
        stones = stone_columns(session)
    else:
        _read_missing(session, only, solids)
        box = solids.box(only)
        if box is None:
            return stone_columns(session, ENTITY.id.is_(None)), solids
        stones = stone_columns(session, near_box(*box, settings.width))
    _read_missing(session, None if only is None and not len(solids) else set(stones.ids.tolist()), solids)
    return stones, solids


def _read_missing(session: Session, wanted: set[int] | None, solids: KnownSolids) -> None:
    """Read the solids of some entities, or of all, that are not at hand."""
    conditions: Iterable[ColumnElement[bool]] = [ENTITY.id.is_not(None)]
    if wanted is not None:
        conditions = id_conditions(ENTITY.id, wanted.difference(solids.ids))
    for condition in conditions:
        for number, vertices, faces in stone_shapes(session, condition):
            solids.add(number, vertices, faces)


def _relations(
    stones: StoneColumns, solids: KnownSolids, settings: RelationSettings, only: set[int] | None
) -> tuple[FoundRelations, Ints]:
    """Find the relations of the stones; return them with the numbers of the entities, ascending."""
    ids = np.array(solids.ids, dtype=np.int64)
    wanted = np.isin(ids, stones.ids)
    among = wanted if only is None else wanted & np.isin(ids, list(only))
    touching = find_touching(
        solids.build(),
        settings.width,
        settings.angle,
        overlap=settings.overlap,
        share=settings.share,
        among=among,
    )
    order = np.argsort(ids)
    rank = np.empty(len(ids), np.int64)
    rank[order] = np.arange(len(ids))
    ids = ids[order]
    chosen_pairs = wanted[touching.pairs].all(axis=1)
    contacts = StoneContacts(
        rank[touching.pairs[chosen_pairs]],
        touching.area[chosen_pairs],
        touching.gap[chosen_pairs],
        touching.normal[chosen_pairs],
        touching.centroid[chosen_pairs],
    )
    place = np.minimum(np.searchsorted(stones.ids, ids), max(len(stones) - 1, 0))
    kinds = [stones.kinds[i] for i in place.tolist()]
    facts = StonesOf(kinds, stones.normals[place])
    return relations_between(contacts, facts, settings), ids
