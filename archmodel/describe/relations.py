"""Relations of one entity from both sides, and its joints in the latest run."""

from sqlalchemy import or_, select
from sqlalchemy.orm import Session, joinedload

from archmodel.tables.entries import held_at
from archmodel.tables.relations import INVERSE, Relation
from archmodel.tables.runs import JointResult

__all__ = ["joints", "relations"]

Values = dict[str, object]


def relations(session: Session, entity: int, at: int | None) -> dict[str, list[Values]]:
    """List the relations of an entity by kind as seen from it: rests on, supports, beside, …

    Returns
    -------
    dict
        of lists of code, declared, area [m²], gap [m], entry
    """
    statement = (
        select(Relation)
        .where(or_(Relation.subject_id == entity, Relation.object_id == entity), held_at(Relation, at))
        .options(joinedload(Relation.subject), joinedload(Relation.object))
        .order_by(Relation.id)
    )
    told: dict[str, dict[str, Values]] = {name: {} for name in INVERSE}
    for one in session.scalars(statement):
        name = one.kind if one.subject_id == entity else INVERSE[one.kind]
        other = one.object if one.subject_id == entity else one.subject
        values = {
            "code": other.code,
            "declared": one.declared,
            "area": one.area,
            "gap": one.gap,
            "entry": one.entry_id,
        }
        # computed and declared: one relation, of which the geometry gives the numbers
        before = told[name].get(other.code)
        if before is not None:
            numbers = before if before["area"] is not None else values
            values = {**numbers, "declared": True}
        told[name][other.code] = values
    return {name: [ones[code] for code in sorted(ones)] for name, ones in told.items() if ones}


def joints(session: Session, entity: int, run: int) -> list[Values]:
    """List the results of a run for the joints of an entity; forces in N, pressures in Pa, lengths in m."""
    statement = (
        select(JointResult)
        .where(
            or_(JointResult.first_id == entity, JointResult.second_id == entity), JointResult.run_id == run
        )
        .options(joinedload(JointResult.first), joinedload(JointResult.second))
        .order_by(JointResult.number)
    )
    return [
        {
            "neighbour": (one.second if one.first_id == entity else one.first).code,
            "area": one.area,
            "width": one.width,
            "force_normal": one.force_normal,
            "force_shear": one.force_shear,
            "pressure_max": one.pressure_max,
            "kern": one.kern,
            "friction_use": one.friction_use,
            "opening": one.opening,
            "sliding": one.sliding,
        }
        for one in session.scalars(statement)
    ]
