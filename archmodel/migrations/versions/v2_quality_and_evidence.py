"""Version 2: quality of masonry, joint and evidence of measurements, spread and anisotropy of cells of disks.

Programs between both versions made databases that have some of these columns and say that they are of version 1; what
they have stays.
"""

from collections.abc import Iterator, Mapping

from alembic import op
from sqlalchemy import (
    JSON,
    Column,
    Connection,
    Double,
    LargeBinary,
    func,
    inspect,
    select,
    table,
    text,
    update,
)
from sqlalchemy.sql.expression import column

from archmodel.migrations.layouts.version1 import metadata

__all__ = ["depends_on", "down_revision", "downgrade", "losses", "revision", "upgrade"]

revision = "0002"
down_revision = "0001"
depends_on = None

_QUALITY = [f"mqi_{way}_{end}" for way in ("vertical", "in_plane", "out_of_plane") for end in ("low", "high")]


def _added() -> Mapping[str, tuple[Column[object], ...]]:
    """Return the new columns by table; a column belongs to one table, so they are made at each call."""
    evidence = Column("evidence", JSON, nullable=False, server_default="[]")
    return {
        "entity": tuple(Column(name, Double) for name in ("minimum_trace", "section_trace", *_QUALITY)),
        "measurement": (Column("joint", LargeBinary), evidence),
        "cell_result": tuple(Column(name, Double) for name in ("spread_x", "spread_y", "a")),
    }


def upgrade() -> None:
    """Add the columns that are not there."""
    connection = op.get_bind()
    for name, columns in _added().items():
        there = {one["name"] for one in inspect(connection).get_columns(name)}
        for one in columns:
            if one.name not in there:
                op.add_column(name, one)
    if connection.dialect.name == "postgresql":
        connection.execute(text("ALTER TABLE measurement ALTER COLUMN evidence DROP DEFAULT"))
    connection.execute(update(metadata.tables["moma_schema"]).values(version=2))


def downgrade() -> None:
    """Drop the columns."""
    for name, columns in _added().items():
        for one in columns:
            op.drop_column(name, one.name)
    op.get_bind().execute(update(metadata.tables["moma_schema"]).values(version=1))


def losses(connection: Connection) -> Iterator[str]:
    """Yield what version 1 cannot hold."""
    for name, columns in _added().items():
        for one in columns:
            values = select(func.count()).select_from(table(name)).where(column(one.name).is_not(None))
            if not one.nullable:
                values = values.where(text(f"CAST({one.name} AS TEXT) <> '[]'"))
            if count := connection.scalar(values):
                yield f"{one.name} of {count} rows of {name}"
