"""Declaration of materials, phases and documents; for structures and relations see ``archmodel.assertions.arrange``.

What is declared again as it is changes nothing; what is declared otherwise supersedes what was held; what is left
out (None) stays as it was.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.validation import (
    checked_label,
    checked_number,
    checked_text,
    checked_years,
)
from archmodel.store.find_by_code import held_named, held_or_none
from archmodel.store.lookalikes import Lookalikes, explained
from archmodel.store.revisions import RowCounts, revise, supersede
from archmodel.stratigraphy.edtf import year_bounds
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import Document, Material, MaterialProperty, Phase
from archmodel.tables.structures import Structure
from archmodel.tables.terms import term_for, vocabulary
from ground.errors import UsageError

PROPERTIES: Mapping[str, tuple[str, str]] = {
    "density": ("kg/m³", "mass by volume"),
    "young": ("Pa", "Young's modulus"),
    "poisson": ("-", "Poisson's ratio"),
    "tensile_strength": ("Pa", "tension that it bears"),
    "compressive_strength": ("Pa", "compression that it bears, positive"),
    "friction": ("-", "Coulomb's coefficient of its joints"),
    "cohesion": ("Pa", "shear that its joints bear without pressure"),
    "porosity": ("-", "part of its volume that is pores"),
}
"""Unit and meaning of the properties that every material can have; others need a unit."""

_BELOW = {"poisson": 0.5, "porosity": 1.0}
_ABOVE_ZERO = frozenset({"density", "young", "tensile_strength", "compressive_strength"})


@dataclass(frozen=True)
class PropertyValue:
    """One number of a material.

    Attributes
    ----------
    value, sigma : in `unit`; sigma is None if not known
    unit : SI; None: the one of PROPERTIES
    source : a test, a document, a table; None: that of the entry
    """

    value: float
    sigma: float | None = None
    unit: str | None = None
    source: str | None = None


def declare_material(
    session: Session,
    entry: Entry,
    name: str,
    description: str | None = None,
    properties: Mapping[str, PropertyValue] | None = None,
) -> RowCounts:
    """Declare a stone or a mortar under one name, with its properties; properties not named stay as they are."""
    values = {"description": checked_text("description", description)}
    name = term_for(session, "material", checked_label("name", name))
    outcome = declare_named(session, entry, Material, {"name": name}, values)
    for key, given in (properties or {}).items():
        outcome += declare_property(session, entry, name, key, given)
    return outcome


def declare_property(
    session: Session, entry: Entry, material: str, name: str, given: PropertyValue
) -> RowCounts:
    """Declare one property of a declared material.

    Raises
    ------
    UsageError
        if there is no such material, the number cannot be, or the unit is missing or not the one of PROPERTIES
    """
    owner = held_named(session, Material, material)
    unit = _unit(name, given.unit)
    bounds: dict[str, float] = {"above": 0.0} if name in _ABOVE_ZERO else {}
    if name in PROPERTIES and name not in _ABOVE_ZERO:
        bounds["at_least"] = 0.0
    if name in _BELOW:
        bounds["below"] = _BELOW[name]
    values = {
        "value": checked_number(name, given.value, unit, **bounds),
        "sigma": checked_number(f"sigma of {name}", given.sigma, unit, at_least=0.0),
        "unit": unit,
        "source": checked_text("source", given.source),
    }
    held = session.scalar(
        select(MaterialProperty).where(
            MaterialProperty.material_id == owner.id,
            MaterialProperty.name == name,
            MaterialProperty.superseded_id.is_(None),
        )
    )
    if held is not None and all(one in (None, getattr(held, key)) for key, one in values.items()):
        return RowCounts(unchanged=1)
    values["source"] = values["source"] or entry.source
    new = MaterialProperty(material_id=owner.id, name=checked_label("property", name), **values)
    if held is None:
        new.entry_id = entry.id
        session.add(new)
        session.flush()
        return RowCounts(new=1)
    supersede(session, entry, held, new)
    return RowCounts(replaced=1)


def declare_phase(
    session: Session,
    entry: Entry,
    name: str,
    begins: int | str | None = None,
    ends: int | str | None = None,
    description: str | None = None,
) -> RowCounts:
    """Declare a time of building or repair; years at the earliest and at the latest.

    Parameters
    ----------
    begins, ends : years, or dates as `archmodel.stratigraphy.edtf.year_bounds` takes them; the earliest year of the one
        and the latest of the other count, and what is written stays in the description
    """
    held = held_or_none(session, Phase, name)
    written = [f"{key} {one}" for key, one in (("begins", begins), ("ends", ends)) if isinstance(one, str)]
    begins = None if begins is None else year_bounds("begins", begins)[0]
    ends = None if ends is None else year_bounds("ends", ends)[1]
    if written:
        description = "; ".join(filter(None, (description, ", ".join(written))))
    if held is not None:
        begins = held.begins if begins is None else begins
        ends = held.ends if ends is None else ends
    checked_years(begins, ends)
    values = {"begins": begins, "ends": ends, "description": checked_text("description", description)}
    return declare_named(session, entry, Phase, {"name": checked_label("name", name)}, values)


def declare_document(
    session: Session,
    entry: Entry,
    code: str,
    type: str,
    title: str,
    *,
    place: str | None = None,
    author: str | None = None,
    dated: str | None = None,
) -> RowCounts:
    """Declare a document, drawing or photograph, by reference: `place` is where it can be found."""
    values = {
        "type": vocabulary(session, "document").named(type),
        "title": checked_text("title", title),
        "place": checked_text("place", place),
        "author": checked_text("author", author),
        "dated": checked_text("dated", dated),
    }
    return declare_named(session, entry, Document, {"code": checked_label("code", code)}, values)


def declare_named(
    session: Session,
    entry: Entry,
    cls: type[Material] | type[Phase] | type[Document] | type[Structure],
    key: Mapping[str, str],
    values: Mapping[str, object],
    made: type[Structure] | None = None,
) -> RowCounts:
    """Declare a row under a name: new, unchanged, or with new contents.

    Raises
    ------
    UsageError
        if the name looks like that of another row
    """
    (name,) = key.values()
    held = held_or_none(session, cls, name)  # type: ignore[type-var]
    if held is not None:
        return revise(session, entry, held, {key: one for key, one in values.items() if one is not None})
    (column,) = key
    lookalikes = Lookalikes(session, getattr(cls, column), cls.superseded_id.is_(None))
    if (found := lookalikes.like([name])) is not None:
        remedy = "write both with the same characters"
        raise UsageError(f"the {column} {explained(*found)}", remedy=remedy)
    own = {column: value for column, value in values.items() if column != "kind"}
    session.add((made or cls)(**key, **own, entry_id=entry.id))
    session.flush()
    return RowCounts(new=1)


def _unit(name: str, given: str | None) -> str:
    usual = PROPERTIES[name][0] if name in PROPERTIES else None
    if given is None and usual is None:
        remedy = f"give its unit; without one come {', '.join(PROPERTIES)}"
        raise UsageError(f"the property {name[:40]!r} has no unit", remedy=remedy)
    if usual is not None and given not in (None, usual):
        raise UsageError(f"{name} in {given}", remedy=f"give it in {usual}")
    return checked_label("unit", given or usual or "-")
