"""Version 3: acts of recording, structures, relations, knowledge, registered kinds; more of measurements and of runs.

Surveys and runs of version 2 become entries in the order in which they were stored. Of a run, what its summary says has
columns now; which entries it had read is not known.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from alembic import op
from sqlalchemy import (
    ColumnElement,
    Connection,
    Row,
    Select,
    Table,
    and_,
    case,
    func,
    insert,
    literal,
    or_,
    select,
)

from archmodel.migrations.layouts import version2, version3
from archmodel.migrations.steps import begin_layout, carry, carry_rows, end_layout, read

__all__ = ["depends_on", "down_revision", "downgrade", "losses", "revision", "upgrade"]

revision = "0003"
down_revision = "0002"
depends_on = None

_UNKNOWN = "unknown"
"""Version of MOMA that took in a survey: not kept by version 2."""

_ERRORS = ("natural_map", "penetration", "balance", "reaction", "energy")

_OLD_KINDS = (
    *("entity", "ashlar", "header", "stretcher", "quoin", "jamb", "sill", "lintel"),
    *("voussoir", "keystone", "springer", "rubble"),
)
"""Kinds that version 2 knows."""

_PARENTS = {
    **dict.fromkeys(("mullion", "corbel", "coping", "cornice", "slab", "rib_segment", "boss"), "ashlar"),
    **dict.fromkeys(("stone", "column_part", "base", "shaft", "capital", "infill", "joint"), "entity"),
}
"""What of those is nearest to each kind that version 3 brought."""

_OWN = ("own", "tail_length", "span", "projection", "ring", "rank", "intrados_angle", "drum", "thickness")
"""Columns of attributes that one kind has."""

_DROPPED = {
    "structure": "structures",
    "membership": "memberships of structures",
    "relation": "relations",
    "statement": "statements: materials, phases, marks, observations, notes",
    "material": "materials",
    "phase": "phases",
    "document": "documents",
    "correction": "corrections, whose new values stay",
    "kind": "registered kinds",
    "joint_result": "results of joints",
    "contact_point": "contact points",
    "simplification": "solids of runs",
}
"""Tables that version 2 has not, and what they hold."""


def upgrade() -> None:
    """From version 2."""
    connection = op.get_bind()
    old = begin_layout(connection, version2.metadata, version3.metadata)
    new = version3.metadata.tables
    entry_of = _record_entries(connection, old, new["entry"])
    rows = read(connection, select(old["survey"]).order_by(old["survey"].c.id))
    carry_rows(connection, new["survey"], (_survey_up(row, entry_of) for row in rows))
    survey, entity, measurement = new["survey"], old["entity"], old["measurement"]
    kept = [column for column in entity.columns if column.name in new["entity"].columns]
    of_survey = entity.join(survey, survey.c.id == entity.c.survey_id)
    carry(connection, new["entity"], select(*kept, survey.c.entry_id).select_from(of_survey))
    carry(
        connection,
        new["measurement"],
        select(measurement, entity.c.survey_id, survey.c.entry_id, entity.c.id).select_from(
            of_survey.join(measurement, measurement.c.entity_id == entity.c.id)
        ),
    )
    rows = read(connection, select(old["run"]).order_by(old["run"].c.id))
    carry_rows(connection, new["run"], (_run_up(row, entry_of) for row in rows))
    carry(connection, new["entity_result"], select(old["entity_result"]))
    end_layout(connection, version2.metadata, version3.metadata, 3)


def downgrade() -> None:
    """To version 2, without what it cannot hold (`losses`)."""
    connection = op.get_bind()
    kinds = {row.kind: _old_kind(connection, row.kind) for row in _kinds(connection)}
    old = begin_layout(connection, version3.metadata, version2.metadata)
    new = version2.metadata.tables
    survey, entity, measurement, run = (old[name] for name in ("survey", "entity", "measurement", "run"))
    stored_at = old["entry"].c.recorded_at.label("stored_at")
    kept = [column for column in survey.columns if column.name in new["survey"].columns]
    of_entry = survey.join(old["entry"], old["entry"].c.id == survey.c.entry_id)
    carry(connection, new["survey"], select(*kept, stored_at).select_from(of_entry))
    held = entity.join(measurement, and_(measurement.c.entity_id == entity.c.id, _held(entity, measurement)))
    kept = [one for one in entity.columns if one.name in new["entity"].columns and one.name != "kind"]
    kind = case(kinds or {"entity": "entity"}, value=entity.c.kind).label("kind")
    carry(connection, new["entity"], select(*kept, kind, measurement.c.survey_id).select_from(held))
    kept = [column for column in measurement.columns if column.name in new["measurement"].columns]
    carry(connection, new["measurement"], select(*kept).select_from(held))
    of_entry = run.join(old["entry"], old["entry"].c.id == run.c.entry_id)
    rows = read(connection, select(run, stored_at).select_from(of_entry).order_by(run.c.id))
    carry_rows(connection, new["run"], map(_run_down, rows))
    result = old["entity_result"]
    of_kept = result.join(new["entity"], new["entity"].c.id == result.c.entity_id)
    carry(connection, new["entity_result"], select(result).select_from(of_kept))
    end_layout(connection, version3.metadata, version2.metadata, 2)


def losses(connection: Connection) -> Iterator[str]:
    """What version 2 cannot hold of this database, in words."""
    tables = version3.metadata.tables
    for name, text in _DROPPED.items():
        if count := _count(connection, select(func.count()).select_from(tables[name])):
            yield f"{text} ({count})"
    entry, run = tables["entry"], tables["run"]
    other = select(func.count()).where(entry.c.action.not_in(["ingest", "run"]))
    if count := _count(connection, other):
        yield f"acts of recording besides surveys and runs ({count})"
    if count := sum(set(versions) != {"moma"} for versions in connection.scalars(select(run.c.versions))):
        yield f"settings of runs, and versions of the libraries ({count})"
    measurement, entity = tables["measurement"], tables["entity"]
    said = or_(*(entity.c[name].is_not(None) for name in _OWN))
    if count := _count(connection, select(func.count()).where(said)):
        yield f"attributes that not every kind has: tail_length, rank, … ({count})"
    old = select(func.count()).where(measurement.c.superseded_id.is_not(None))
    if count := _count(connection, old):
        yield f"measurements that were superseded ({count})"
    held = select(measurement.c.id).where(measurement.c.entity_id == entity.c.id, _held(entity, measurement))
    if count := _count(connection, select(func.count()).select_from(entity).where(~held.exists())):
        yield f"entities that were not measured, with their results ({count})"
    for row in _kinds(connection):
        if (kind := _old_kind(connection, row.kind)) != row.kind:
            yield f"the kind {row.kind}, which becomes {kind} ({row.entities})"


def _record_entries(
    connection: Connection, old: Mapping[str, Table], entry: Table
) -> dict[tuple[str, int], int]:
    """One entry for each survey and each run, as they followed in time; their numbers by table and key."""
    survey, run = old["survey"].c, old["run"].c
    surveys = select(
        survey.stored_at,
        literal("survey").label("table"),
        survey.id,
        survey.path.label("source"),
        literal(_UNKNOWN).label("version"),
    )
    runs = select(run.stored_at, literal("run"), run.id, run.scene, run.version)
    entries = {}
    found = connection.execute(surveys.union_all(runs)).all()
    order = sorted(found, key=lambda row: (row.stored_at, row.table == "run", row.id))
    for number, row in enumerate(order, start=1):
        entries[row.table, row.id] = number
        connection.execute(
            insert(entry).values(
                id=number,
                action="ingest" if row.table == "survey" else "run",
                author=None,
                source=row.source,
                settings={},
                version=row.version,
                recorded_at=row.stored_at,
            )
        )
    return entries


def _survey_up(row: Row[Any], entry_of: Mapping[tuple[str, int], int]) -> dict[str, Any]:
    values = row._asdict() | {"entry_id": entry_of["survey", row.id]}
    del values["stored_at"]
    return values


def _run_up(row: Row[Any], entry_of: Mapping[tuple[str, int], int]) -> dict[str, Any]:
    said: Mapping[str, Any] = row.summary
    time, errors = said.get("time") or {}, said.get("errors") or {}
    numbers = {"steps": said.get("steps"), "contacts": said.get("contacts")}
    numbers |= {name: time.get(name) for name in ("simulated", "wall")}
    numbers |= {name: errors.get(name) for name in _ERRORS}
    return {
        "id": row.id,
        "entry_id": entry_of["run", row.id],
        "as_of_id": None,
        "scene": row.scene,
        "scene_text": row.scene_text,
        "outcome": row.outcome,
        "summary": row.summary,
        "versions": {"moma": row.version},
        **{name: value if isinstance(value, int | float) else None for name, value in numbers.items()},
    }


def _run_down(row: Row[Any]) -> dict[str, Any]:
    names = ("id", "scene", "scene_text", "outcome", "summary", "stored_at")
    return {name: getattr(row, name) for name in names} | {"version": row.versions.get("moma", _UNKNOWN)}


def _kinds(connection: Connection) -> list[Row[Any]]:
    """Kinds of the entities in the database, and how many there are of each."""
    kind = version3.metadata.tables["entity"].c.kind
    query = select(kind, func.count().label("entities")).group_by(kind).order_by(kind)
    return list(connection.execute(query))


def _old_kind(connection: Connection, kind: str) -> str:
    """The kind of version 2 that is nearest to one of version 3, up its parents."""
    registered = version3.metadata.tables["kind"]
    while kind not in _OLD_KINDS:
        parent = _PARENTS.get(kind)
        if parent is None:
            parent = connection.scalar(select(registered.c.parent).where(registered.c.name == kind))
        kind = parent or "entity"
    return kind


def _held(entity: Table, measurement: Table) -> ColumnElement[bool]:
    """The condition that a measurement is the one held now, of an entity that has all that version 2 asks for."""
    asked = [
        column.name for column in version2.metadata.tables["entity"].columns if column.name in entity.columns
    ]
    optional = {"course", "zone", "depth_sigma"}
    return and_(
        measurement.c.superseded_id.is_(None),
        *(entity.c[name].is_not(None) for name in asked if name not in optional),
    )


def _count(connection: Connection, query: Select[Any]) -> int:
    return int(connection.scalar(query) or 0)
