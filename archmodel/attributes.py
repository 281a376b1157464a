"""What can be asked of an entity, and where in the tables it is found."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Select, and_, func, select
from sqlalchemy.orm import InstrumentedAttribute, aliased

from archmodel.entities import Entity
from archmodel.run_records import STONE_VALUES
from archmodel.runs import EntityResult
from archmodel.surveys import Measurement, Survey

__all__ = ["ATTRIBUTES", "Attribute", "with_attributes"]

S = TypeVar("S", bound=Select[Any])


@dataclass(frozen=True)
class Attribute:
    """One thing that can be asked of every entity.

    Attributes
    ----------
    name : as users write it
    unit : "m", "Pa", …; "-" for counts and numbers without a unit; None for texts
    definition : what it is, in a few words
    column : where it is stored
    """

    name: str
    unit: str | None
    definition: str
    column: InstrumentedAttribute[Any] | ColumnElement[Any]

    @property
    def is_number(self) -> bool:
        """Whether it is a number, and not a text."""
        return self.unit is not None


_ALL = (
    Attribute("code", None, "name of the stone in the survey", Entity.code),
    Attribute("kind", None, "its own kind, e.g. keystone", Entity.kind),
    Attribute("course", "-", "number of its course, from the ground", Entity.course),
    Attribute("zone", None, "part of the building", Entity.zone),
    Attribute("depth", "m", "how far it reaches into the wall", Entity.depth),
    Attribute("depth_sigma", "m", "standard deviation of the depth", Entity.depth_sigma),
    Attribute("depth_origin", None, "evidence: stone, rule, kind, structure or solid", Entity.depth_origin),
    Attribute("length", "m", "horizontal extent of its face", Entity.length),
    Attribute("height", "m", "extent of its face upwards", Entity.height),
    Attribute("area", "m²", "area of its face", Entity.area),
    Attribute("volume", "m³", "volume of its solid", Entity.volume),
    Attribute("x", "m", "centroid of its solid", Entity.x),
    Attribute("y", "m", "centroid of its solid", Entity.y),
    Attribute("z", "m", "centroid of its solid", Entity.z),
    Attribute("rms", "m", "root mean square distance of its points from the fitted plane", Measurement.rms),
    Attribute("redundancy", "-", "accepted points minus 3", Measurement.redundancy),
    Attribute("points", "-", "measured points on its face", Measurement.point_count),
    Attribute("rejected", "-", "points left out as blunders", Measurement.rejected_count),
    Attribute("shape", None, "of its face: plane, bevelled, curved, rough, untested", Measurement.shape),
    Attribute("provenance", None, "of its face: points, photograph or solid", Measurement.provenance),
    Attribute("von_mises_max", "Pa", "largest Von Mises stress, latest run", EntityResult.von_mises_max),
    Attribute("von_mises_mean", "Pa", "mean Von Mises stress, latest run", EntityResult.von_mises_mean),
    Attribute("displacement_max", "m", "largest displacement, latest run", EntityResult.displacement_max),
    Attribute("contact_force_max", "N", "largest contact force, latest run", EntityResult.contact_force_max),
    *(
        Attribute(name, unit, f"{meaning}, latest run", EntityResult.values[name].as_float())
        for name, (unit, meaning) in STONE_VALUES.items()
    ),
    Attribute("fidelity", None, "fixed, rigid or deformable, latest run", EntityResult.fidelity),
    Attribute("survey", None, "name of the survey that measured it", Survey.name),
)

ATTRIBUTES: Mapping[str, Attribute] = {attribute.name: attribute for attribute in _ALL}
"""Every attribute by name. "Latest run" is the latest one that holds the entity."""


def with_attributes(statement: S) -> S:
    """The select on entities, joined to the tables that the attributes' columns are in.

    Each join finds at most one row by a primary key, so that it adds no rows, and SQLite leaves out those
    that the rest of the statement does not use.
    """
    result = aliased(EntityResult)
    latest = (
        select(func.max(result.run_id))
        .where(result.entity_id == Entity.id)
        .correlate(Entity)
        .scalar_subquery()
    )
    return (
        statement.outerjoin(
            Measurement, and_(Measurement.entity_id == Entity.id, Measurement.superseded_id.is_(None))
        )
        .outerjoin(Survey, Survey.id == Measurement.survey_id)
        .outerjoin(EntityResult, and_(EntityResult.entity_id == Entity.id, EntityResult.run_id == latest))
    )
