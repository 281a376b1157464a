"""Stratigraphy as the database has it: relations by code, units, and their members."""

from collections.abc import Mapping, Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session, aliased

from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.edtf import year_bounds
from archmodel.stratigraphy.graphml import ABSOLUTE, DrawnUnit
from archmodel.stratigraphy.order import Link
from archmodel.stratigraphy.palette import COMMON, UNIT_KINDS
from archmodel.tables.entities import Entity
from archmodel.tables.entries import held_at
from archmodel.tables.knowledge import Note
from archmodel.tables.relations import Membership
from archmodel.tables.stratigraphy import Stratigraphy
from archmodel.tables.structures import StratigraphicUnit, Structure
from ground.errors import UsageError

KIND_NOTE = "unit kind"
"""Key of the notes with the kinds of units in the Extended Matrix."""


def load_links(session: Session, author: str | None = None) -> list[Link]:
    """Return the relations that are stated now, in the order of recording.

    Parameters
    ----------
    author : only those that this author states; None: all
    """
    session.flush()
    stones, targets = aliased(Entity), aliased(Entity)
    units, objects = aliased(Structure), aliased(Structure)
    rows = (
        select(
            func.coalesce(units.code, stones.code),
            Stratigraphy.relation,
            func.coalesce(objects.code, targets.code),
            Stratigraphy.author,
        )
        .outerjoin(units, units.id == Stratigraphy.structure_id)
        .outerjoin(stones, stones.id == Stratigraphy.entity_id)
        .outerjoin(objects, objects.id == Stratigraphy.object_structure_id)
        .outerjoin(targets, targets.id == Stratigraphy.object_entity_id)
        .where(Stratigraphy.superseded_id.is_(None))
        .order_by(Stratigraphy.id)
    )
    if author is not None:
        rows = rows.where(Stratigraphy.author == author)
    return [Link(str(row[0]), row[1] or "", str(row[2]), row[3]) for row in session.execute(rows)]


def load_units(session: Session) -> list[str]:
    """Return the codes of the stratigraphic units, in the order of recording."""
    units = select(Structure.code).where(
        Structure.kind == StratigraphicUnit.__mapper__.polymorphic_identity, held_at(Structure)
    )
    return list(session.scalars(units.order_by(Structure.id)))


def load_drawn(session: Session) -> Mapping[str, DrawnUnit]:
    """Return kinds, descriptions and absolute dates of units and stones that have any, by code; the last ones noted."""
    titles = select(Structure.code, Structure.title).where(held_at(Structure), Structure.title.is_not(None))
    notes = (
        select(func.coalesce(Structure.code, Entity.code), Note.key, Note.text)
        .outerjoin(Structure, Structure.id == Note.structure_id)
        .outerjoin(Entity, Entity.id == Note.entity_id)
        .where(Note.superseded_id.is_(None), Note.key.in_((KIND_NOTE, *ABSOLUTE)))
        .order_by(Note.id)
    )
    named = {row.code: row.title for row in session.execute(titles)}
    noted: dict[str, dict[str, str]] = {}
    for code, key, text in session.execute(notes):
        if key and text and (key != KIND_NOTE or text in UNIT_KINDS):
            noted.setdefault(str(code), {})[key] = text
    return {
        code: DrawnUnit(
            noted.get(code, {}).get(KIND_NOTE, COMMON),
            named.get(code),
            None,
            None,
            *(noted.get(code, {}).get(key) for key in ABSOLUTE),
        )
        for code in dict.fromkeys([*named, *noted])
    }


def with_years(dates: Mapping[str, Dated], drawn: Mapping[str, DrawnUnit]) -> Mapping[str, Dated]:
    """Return the dates of units: absolute ones where they are stated, before the years of phases."""
    dated = dict(dates)
    for code, unit in drawn.items():
        ends = (unit.begins, unit.ends)
        years = [_year(text, end) for end, text in enumerate(ends)]
        if years != [None, None]:
            phase = dates.get(code, Dated("", None, None))
            own = (
                years[0] if years[0] is not None else phase.begins,
                years[1] if years[1] is not None else phase.ends,
            )
            dated[code] = Dated(phase.phase, *own)
    return dated


def _year(text: str | None, end: int) -> int | None:
    """Return the first (0) or last (1) year that a text allows; None for one that is no date."""
    try:
        return None if text is None else year_bounds("date", text)[end]
    except UsageError:
        return None


def load_stones(session: Session, codes: Sequence[str]) -> Mapping[str, tuple[str, ...]]:
    """Return the codes of the members of each unit, those of its parts too."""
    wanted, parents, names = set(codes), dict[int, int | None](), dict[int, str]()
    structures = select(Structure.id, Structure.parent_id, Structure.code).where(held_at(Structure))
    for number, parent, code in session.execute(structures):
        parents[number], names[number] = parent, code
    stones: dict[str, dict[str, None]] = {}
    rows = (
        select(Membership.structure_id, Entity.code)
        .join(Membership.entity)
        .where(held_at(Membership))
        .order_by(Entity.id)
    )
    for number, stone in session.execute(rows):
        step: int | None = number
        while step is not None and step in names:
            if names[step] in wanted:
                stones.setdefault(names[step], {})[stone] = None
            step = parents[step]
    return {code: tuple(members) for code, members in stones.items()}
