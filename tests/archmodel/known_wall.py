"""All that can be known of the small wall besides its geometry, as plain values and in the tables.

Every table has rows that are no longer held, which no query may find.
"""

from sqlalchemy.orm import Session

from archmodel.database.session import Database
from archmodel.store.runs import store_run
from archmodel.tables.entities import Entity, Voussoir
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import (
    Correction,
    Document,
    MadeOf,
    MasonMark,
    Material,
    MaterialProperty,
    Note,
    Observation,
    OfPhase,
    Phase,
    Reference,
    Statement,
)
from archmodel.tables.relations import Membership, Relation
from archmodel.tables.structures import Structure, structure_kind_named
from tests.archmodel.stones import run_record

RELATIONS = (
    ("rests_on", "W02-01", "W01-01", 0.075),
    ("rests_on", "W02-01", "W01-02", 0.05),
    ("rests_on", "V1", "W02-01", 0.04),
    ("rests_on", "V2", "V1", 0.1),
    ("rests_on", "V3", "V2", 0.1),
    ("beside", "W01-01", "W01-02", 0.095),
    ("bonded_with", "W01-01", "W02-01", None),
    ("across_the_wall", "W01-02", "R1", None),
)
"""Kind, subject, object, shared area [m²]; symmetric ones with the lower id first."""

STRUCTURES = (
    ("castle", "building", None, None, None, "Castle of the test"),
    ("T1", "tower", "castle", None, None, "West tower"),
    ("F1", "wall_facing", "T1", None, "outer", None),
    ("C1", "course", "F1", 1, None, None),
    ("A1", "arch", "T1", None, None, None),
)
"""Code, kind, parent, number, side, title."""

MEMBERS = (
    ("W01-01", "C1"),
    ("W01-02", "C1"),
    ("W02-01", "F1"),
    ("V1", "A1"),
    ("V2", "A1"),
    ("V3", "A1"),
)

PHASES = (("1", 1190, 1210), ("2", 1350, None))
OF_PHASE = (("T1", "1"), ("A1", "2"), ("W02-01", "2"))
"""Structures or stones, and their phase."""

MATERIALS = {"tuff": {"density": 1600.0, "tensile_strength": 8e5}, "marble": {"density": 2700.0}}
MADE_OF = (("castle", "tuff"), ("V3", "marble"))
MARKS = (("W01-01", "A"), ("W01-01", "fish"), ("V2", "fish"), ("A1", "star"))
OBSERVED = (("T1", "erosion", 2), ("W01-01", "erosion", 0), ("V1", "crack", 3), ("V3", "crack", None))
DOCUMENTS = ("D1", "P7", "P8")
REFERENCES = (("A1", "D1"), ("W01-01", "P7"))
CORRECTED = (("W02-01", "kind", "ashlar", "jamb"), ("V1", "depth", 0.4, 0.45))

VOUSSOIRS = {"V1": (1, 1, 0.2), "V2": (1, 2, 0.21), "V3": (1, 3, None)}
"""Ring, rank, angle of the intrados [rad]."""


def simulate(database: Database) -> None:
    """Run 1 had every stone of the arch deformable; run 2 had V3 rigid."""
    with database.session() as session:
        first = {"V1": 9e5, "V2": 8e5, "V3": 7e5}
        store_run(session, run_record(first, scene="first"))
        store_run(
            session,
            run_record(
                {"V1": 3e5, "V2": 1.5e5, "V3": None},
                scene="second",
                values={
                    "V1": {"utilisation": 0.2},
                    "V2": {"utilisation": 0.8, "tension_zone": 0.05},
                },
            ),
        )


def furnish(database: Database) -> None:
    """Put everything of this module into a database that holds the wall."""
    with database.session() as session:
        entry = new_entry(session, "declaration", "field book", author="A. Mason")
        later = new_entry(session, "correction", "second visit", author="A. Mason")
        stones = {one.code: one for one in session.query(Entity)}
        for code, (ring, rank, angle) in VOUSSOIRS.items():
            voussoir = stones[code]
            assert isinstance(voussoir, Voussoir)
            voussoir.ring, voussoir.rank, voussoir.intrados_angle = ring, rank, angle
        structures = _structures(session, entry, later, stones)
        _relations(session, entry, later, stones)
        _knowledge(session, entry, later, {**stones, **structures})
    simulate(database)


def _structures(
    session: Session, entry: Entry, later: Entry, stones: dict[str, Entity]
) -> dict[str, Structure]:
    structures: dict[str, Structure] = {}
    for code, kind, parent, number, side, title in STRUCTURES:
        above = structures[parent].id if parent else None
        structures[code] = structure_kind_named(kind)(
            code=code, parent_id=above, number=number, side=side, title=title, entry_id=entry.id
        )
        session.add(structures[code])
        session.flush()
    arch, ended = structures["A1"], {"entry_id": entry.id, "superseded_id": later.id}
    # a part of the arch that is held no longer, with a member
    gone = structure_kind_named("course")(code="old", parent_id=arch.id, number=9, **ended)
    session.add(gone)
    session.flush()
    session.add(Membership(entity=stones["R1"], structure_id=gone.id, declared=True, entry_id=entry.id))
    session.add(Membership(entity=stones["R1"], structure_id=arch.id, declared=True, **ended))
    for stone, code in MEMBERS:
        member = Membership(
            entity=stones[stone], structure=structures[code], declared=True, entry_id=entry.id
        )
        session.add(member)
    return structures


def _relations(session: Session, entry: Entry, later: Entry, stones: dict[str, Entity]) -> None:
    for kind, subject, other, area in RELATIONS:
        numbers = {"subject_id": stones[subject].id, "object_id": stones[other].id}
        session.add(Relation(kind=kind, declared=area is None, area=area, entry_id=entry.id, **numbers))
    for kind in ("rests_on", "beside", "bonded_with", "across_the_wall"):
        numbers = {"subject_id": stones["V3"].id, "object_id": stones["R1"].id}
        ended = {"entry_id": entry.id, "superseded_id": later.id}
        session.add(Relation(kind=kind, declared=True, area=5.0, **numbers, **ended))


def _knowledge(session: Session, entry: Entry, later: Entry, subjects: dict[str, Entity | Structure]) -> None:
    now, ended = {"entry_id": entry.id}, {"entry_id": entry.id, "superseded_id": later.id}

    def said(cls: type[Statement], code: str, when: dict[str, int], **values: object) -> None:
        subject = subjects[code]
        owner = "entity_id" if isinstance(subject, Entity) else "structure_id"
        session.add(cls(**{owner: subject.id}, **values, **when))

    phases = {name: Phase(name=name, begins=begins, ends=ends, **now) for name, begins, ends in PHASES}
    materials = {name: Material(name=name, **now) for name in MATERIALS}
    documents = {
        code: Document(code=code, type="drawing", title=f"Title of {code}", **now) for code in DOCUMENTS
    }
    session.add_all([*phases.values(), *materials.values(), *documents.values()])
    session.flush()
    for name, properties in MATERIALS.items():
        for key, value in properties.items():
            common = {"material": materials[name], "name": key, "unit": "-", "source": "test"}
            session.add(MaterialProperty(value=-1.0, **common, **ended))
            session.add(MaterialProperty(value=value, **common, **now))
    for code, name in OF_PHASE:
        said(OfPhase, code, now, phase_id=phases[name].id)
    for code, name in MADE_OF:
        said(MadeOf, code, now, material_id=materials[name].id)
    for code, sign in MARKS:
        said(MasonMark, code, now, sign=sign)
    for code, type_, severity in OBSERVED:
        said(Observation, code, now, type=type_, severity=severity)
    for code, document in REFERENCES:
        said(Reference, code, now, document_id=documents[document].id)
    said(Note, "V2", now, key="edge", text="a word", document_id=documents["P7"].id)
    for code in ("R1", "castle"):
        said(OfPhase, code, ended, phase_id=phases["1"].id)
        said(MadeOf, code, ended, material_id=materials["marble"].id)
        said(MasonMark, code, ended, sign="gone")
        said(Observation, code, ended, type="stain", severity=4)
        said(Reference, code, ended, document_id=documents["P8"].id)
    for code, attribute, before, after in CORRECTED:
        number = subjects[code].id
        session.add(Correction(entity_id=number, attribute=attribute, before=before, after=after, **now))
