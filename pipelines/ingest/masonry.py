"""Quality of the masonry of each wall, as attributes of its stones."""

from collections import defaultdict
from collections.abc import Collection, Iterable

import numpy as np
from sqlalchemy import ColumnElement, or_, select
from sqlalchemy.orm import Session

from archmodel.store.stone_arrays import ENTITY, StoneFace, id_conditions, stone_faces
from survey.quality.facades import find_facades
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
        facades = find_facades(
            np.array([face.normal for face in faces]),
            np.array([face.area for face in faces]),
            np.array([face.outline.mean(axis=0) for face in faces]),
        )
        for wall in judge_masonry([_stone(face) for face in faces], facades):
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
