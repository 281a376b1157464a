"""Version 4: hypotheses, what solids were simplified to, widths of joints as surveyed, supports.

What was surveyed is no hypothesis, so no entity of version 3 is one. What became of joints that stayed as they were
measured has another name: as-surveyed was open. A kind or an attribute of a user's own whose name has a meaning in
version 4 is called own_NAME from then on.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from alembic import op
from sqlalchemy import ColumnElement, Connection, Row, Select, Table, case, false, func, null, or_, select

from archmodel.migrations.layouts import version3, version4
from archmodel.migrations.steps import begin_layout, carry, carry_rows, end_layout, read

__all__ = ["depends_on", "down_revision", "downgrade", "losses", "revision", "upgrade"]

revision = "0004"
down_revision = "0003"
depends_on = None

_SUPPORT = "support"
"""The kind that version 4 brought."""

_ATTRIBUTES = ("hypothesis", "solid_shape", "blockiness", "worst_angle", "within_tolerance")
"""The attributes that it brought."""

_SIMPLIFIED = ("shape", "blockiness", "worst_angle", "within_tolerance")
"""Columns of solids of runs that it brought."""

_MODES = {"open": "as-surveyed"}
"""What becomes of joints: as version 3 and as version 4 names it."""

Names = Mapping[str, str]
Values = dict[str, Any]


def upgrade() -> None:
    """From version 3."""
    connection = op.get_bind()
    old = begin_layout(connection, version3.metadata, version4.metadata)
    registered = connection.execute(select(old["kind"]).order_by(old["kind"].c.entry_id)).all()
    kinds = _own_names([_SUPPORT], [row.name for row in registered])
    own = _own_names(_ATTRIBUTES, [name for row in registered for name in row.attributes])
    brought: dict[str, dict[str, ColumnElement[Any]]] = {
        "entity": {"hypothesis": false(), "kind": _renamed(old["entity"].c.kind, kinds)},
        "joint_result": {"width": null()},
        "simplification": {
            "mode": _renamed(old["simplification"].c.mode, _MODES),
            **{name: null() for name in _SIMPLIFIED},
        },
    }
    worked: dict[str, Callable[[Row[Any]], Values]] = {"entry": lambda row: _entry(row, _MODES)}
    if kinds or own:
        worked["kind"] = lambda row: _kind(row, kinds, own)
        worked["correction"] = lambda row: _correction(row, kinds, own)
        worked["entity"] = lambda row: row._asdict() | {"own": _keys(row.own, own)}
    _carry_all(connection, old, version4.metadata.sorted_tables, brought, worked)
    end_layout(connection, version3.metadata, version4.metadata, 4)


def downgrade() -> None:
    """To version 3, without what it cannot hold (`losses`)."""
    connection = op.get_bind()
    old = begin_layout(connection, version4.metadata, version3.metadata)
    modes = {after: before for before, after in _MODES.items()}
    plain = {_SUPPORT: "stone"}
    changed: dict[str, dict[str, ColumnElement[Any]]] = {
        "entity": {"kind": _renamed(old["entity"].c.kind, plain)},
        "kind": {"parent": _renamed(old["kind"].c.parent, plain)},
        "simplification": {"mode": _renamed(old["simplification"].c.mode, modes)},
    }
    worked: dict[str, Callable[[Row[Any]], Values]] = {"entry": lambda row: _entry(row, modes)}
    _carry_all(connection, old, version3.metadata.sorted_tables, changed, worked)
    end_layout(connection, version4.metadata, version3.metadata, 3)


def losses(connection: Connection) -> Iterator[str]:
    """What version 3 cannot hold of this database, in words."""
    tables = version4.metadata.tables
    entity, joint, solid = (tables[name].c for name in ("entity", "joint_result", "simplification"))
    conditions = {
        "that entities are hypotheses": entity.hypothesis,
        "what solids of runs were simplified to": or_(*(solid[name].is_not(None) for name in _SIMPLIFIED)),
        "widths of joints as surveyed": joint.width.is_not(None),
        f"the kind {_SUPPORT}, which becomes stone": entity.kind == _SUPPORT,
    }
    for text, condition in conditions.items():
        if count := connection.scalar(select(func.count()).where(condition)):
            yield f"{text} ({count})"


def _carry_all(
    connection: Connection,
    old: Mapping[str, Table],
    tables: Iterable[Table],
    changed: Mapping[str, Mapping[str, ColumnElement[Any]]],
    worked: Mapping[str, Callable[[Row[Any]], Values]],
) -> None:
    """The rows of all tables: columns as they were but for those changed, and rows that Python works on."""
    for table in tables:
        if table.name == "moma_schema":
            continue
        columns = _columns(old[table.name], table, changed.get(table.name, {}))
        if (work := worked.get(table.name)) is None:
            carry(connection, table, columns)
        else:
            carry_rows(connection, table, map(work, read(connection, columns)))


def _columns(old: Table, new: Table, changed: Mapping[str, ColumnElement[Any]]) -> Select[Any]:
    """What the columns of a new table take from the old one."""
    values = {**old.c, **changed}
    return select(*(values[column.name].label(column.name) for column in new.c)).select_from(old)


def _renamed(column: ColumnElement[Any], names: Names) -> ColumnElement[Any]:
    return case(dict(names), value=column, else_=column) if names else column


def _own_names(taken: Iterable[str], registered: Iterable[str]) -> dict[str, str]:
    """New names for what a user registered under names that are taken now."""
    known = set(registered)
    found = {}
    for name in taken:
        if name in known:
            other = f"own_{name}"
            while other in known:
                other = f"own_{other}"
            found[name] = other
    return found


def _entry(row: Row[Any], modes: Names) -> Values:
    """An act of recording; that of a run says in its settings what became of joints."""
    values: Values = row._asdict()
    joints = values["settings"].get("joints") if row.action == "run" else None
    if isinstance(joints, dict) and joints.get("mode") in modes:
        joints = joints | {"mode": modes[joints["mode"]]}
        values["settings"] = values["settings"] | {"joints": joints}
    return values


def _kind(row: Row[Any], kinds: Names, own: Names) -> Values:
    """A registered kind under the name that it has now."""
    canon = row.canon
    for before, after in {**kinds, **own}.items():
        canon = canon and re.sub(rf"\b{before}\b", after, canon)
    return row._asdict() | {
        "name": kinds.get(row.name, row.name),
        "parent": kinds.get(row.parent, row.parent),
        "attributes": _keys(row.attributes, own),
        "canon": canon,
    }


def _correction(row: Row[Any], kinds: Names, own: Names) -> Values:
    """A correction of an attribute under the name that this has now, or from a kind to another."""
    values: Values = row._asdict()
    if row.attribute == "kind":
        values |= {name: kinds.get(values[name], values[name]) for name in ("before", "after")}
    return values | {"attribute": own.get(row.attribute, row.attribute)}


def _keys(values: Mapping[str, Any] | None, names: Names) -> dict[str, Any] | None:
    return None if values is None else {names.get(name, name): value for name, value in values.items()}
