"""Version 2: quality of masonry, joint and evidence, cells of disks, opinions, stratigraphy, canons, terms.

Statements of phase and material that those of other authors superseded are held again beside them. Programs between
both versions made databases that have some of these columns and say that they are of version 1; what they have stays.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from alembic import op
from sqlalchemy import (
    JSON,
    Column,
    Connection,
    Date,
    Double,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    func,
    inspect,
    select,
    table,
    text,
    update,
)
from sqlalchemy.sql.expression import column

from archmodel.migrations.layouts.version1 import TEXT, metadata

revision = "0002"
down_revision = "0001"
depends_on = None

_HELD = "statement.kind IN ('of_phase', 'made_of') AND statement.superseded_id IS NULL"
_NEWER = (
    "SELECT {} FROM statement AS n WHERE n.kind = statement.kind AND n.superseded_id IS NULL AND n.id > statement.id "
    "AND COALESCE(n.entity_id, 0) = COALESCE(statement.entity_id, 0) "
    "AND COALESCE(n.structure_id, 0) = COALESCE(statement.structure_id, 0)"
)
"""Statements that later ones about the same subject stand beside."""

_OF_ENTRIES = "SELECT COUNT(*) FROM statement JOIN entry ON entry.id = statement.entry_id WHERE {}"
_OTHER_AUTHOR = "COALESCE(statement.author, '') <> COALESCE(entry.author, '')"
_OTHER_DATE = "statement.stated_on <> date(entry.recorded_at)"
"""What the first layout has of a statement only by its entry."""

_OBJECTS = {"object_entity_id": "entity", "object_structure_id": "structure"}
"""References of stratigraphic relations, and what they are to."""

_NEW = ("opinion_rule", "canon", "term", "structure_result")

_QUALITY = [f"mqi_{way}_{end}" for way in ("vertical", "in_plane", "out_of_plane") for end in ("low", "high")]


def _added() -> Mapping[str, tuple[Column[object], ...]]:
    """Return the new columns by table; a column belongs to one table, so they are made at each call."""
    evidence = Column("evidence", JSON, nullable=False, server_default="[]")
    return {
        "entity": tuple(Column(name, Double) for name in ("minimum_trace", "section_trace", *_QUALITY)),
        "measurement": (Column("joint", LargeBinary), evidence),
        "entity_result": (Column("von_mises_p99", Double),),
        "cell_result": tuple(Column(name, Double) for name in ("spread_x", "spread_y", "a")),
        "statement": (
            Column("author", TEXT),
            Column("stated_on", Date),
            Column("certainty", Double),
            Column("about", TEXT),
            Column("relation", TEXT),
        ),
    }


def _tables() -> MetaData:
    """Return the new tables, beside those that they refer to."""
    layout = MetaData()
    for name in ("entry", "run", "structure"):
        metadata.tables[name].to_metadata(layout)
    contents: dict[str, tuple[tuple[str, ...], tuple[Column[Any], ...]]] = {
        "opinion_rule": (
            ("ix_opinion_rule_about", "about"),
            (
                Column("about", TEXT, nullable=False),
                Column("rule", TEXT, nullable=False),
                Column("authors", JSON, nullable=False),
            ),
        ),
        "canon": (
            ("ix_canon_kind", "kind"),
            (
                Column("kind", TEXT, nullable=False),
                Column("proportions", TEXT),
                Column("tolerance", Double),
                Column("supersedes_id", Integer, ForeignKey("canon.id")),
            ),
        ),
        "term": (
            ("ix_term_name", "vocabulary", "name"),
            (
                Column("vocabulary", TEXT, nullable=False),
                Column("name", TEXT, nullable=False),
                Column("definition", TEXT),
                Column("broader", TEXT),
                Column("labels", JSON, nullable=False),
                Column("iri", TEXT),
                Column("supersedes_id", Integer, ForeignKey("term.id")),
            ),
        ),
    }
    for name, (index, columns) in contents.items():
        Table(
            name,
            layout,
            Column("id", Integer, primary_key=True),
            *columns,
            Column("entry_id", Integer, ForeignKey("entry.id"), nullable=False),
            Column("superseded_id", Integer, ForeignKey("entry.id")),
            Index(
                *index,
                unique=True,
                sqlite_where=text("superseded_id IS NULL"),
                postgresql_where=text("superseded_id IS NULL"),
            ),
        )
    Table(
        "structure_result",
        layout,
        Column("structure_id", Integer, ForeignKey("structure.id"), primary_key=True),
        Column("run_id", Integer, ForeignKey("run.id"), primary_key=True),
        Column("values", JSON, nullable=False),
        Index("ix_structure_result_run_id", "run_id"),
    )
    return layout


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
    if not inspect(connection).has_table("opinion_rule"):
        where = " WHERE chosen_id IS NOT NULL" if connection.dialect.name == "sqlite" else ""
        for sql in (
            "ALTER TABLE statement ADD COLUMN chosen_id INTEGER REFERENCES statement (id)",
            f"CREATE INDEX ix_statement_chosen ON statement (chosen_id){where}",
        ):
            connection.execute(text(sql))
    tables = _tables().tables
    for name in _NEW:
        if not inspect(connection).has_table(name):
            tables[name].create(connection)
    there = {one["name"] for one in inspect(connection).get_columns("statement")}
    for name, target in _OBJECTS.items():
        if name not in there:
            sql = f"ALTER TABLE statement ADD COLUMN {name} INTEGER REFERENCES {target} (id)"
            connection.execute(text(sql))
    credit_statements(connection)
    state_percentile(connection)
    connection.execute(update(metadata.tables["moma_schema"]).values(version=2))


def downgrade() -> None:
    """Drop the columns and the table; of several opinions the latest stays."""
    connection = op.get_bind()
    for sql in (
        "DELETE FROM statement WHERE kind IN ('decision', 'stratigraphy')",
        f"UPDATE statement SET superseded_id = ({_NEWER.format('MAX(n.entry_id)')}) "
        f"WHERE {_HELD} AND EXISTS ({_NEWER.format('1')})",
        *(f"DROP TABLE {name}" for name in _NEW),
        "DROP INDEX ix_statement_chosen",
    ):
        connection.execute(text(sql))
    with op.batch_alter_table("statement") as batch:
        for name in ("chosen_id", *_OBJECTS):
            batch.drop_column(name)
    put_back = (
        "json_set(\"values\", '$.von_mises_p99', von_mises_p99)"
        if connection.dialect.name == "sqlite"
        else "(\"values\"::jsonb || jsonb_build_object('von_mises_p99', von_mises_p99))::json"
    )
    connection.execute(
        text(f'UPDATE entity_result SET "values" = {put_back} WHERE von_mises_p99 IS NOT NULL')
    )
    for name, columns in _added().items():
        for one in columns:
            op.drop_column(name, one.name)
    op.get_bind().execute(update(metadata.tables["moma_schema"]).values(version=1))


def credit_statements(connection: Connection) -> None:
    """Give statements the author and date of their entries, and hold what only other authors' superseded.

    Statements of documents of version 1 are credited by it too.
    """
    connection.execute(
        text(
            "UPDATE statement SET author = (SELECT author FROM entry WHERE entry.id = statement.entry_id), "
            "stated_on = (SELECT date(recorded_at) FROM entry WHERE entry.id = statement.entry_id) "
            "WHERE stated_on IS NULL"
        )
    )
    rows = connection.execute(
        text(
            "SELECT id, kind, entity_id, structure_id, author, entry_id, superseded_id, supersedes_id "
            "FROM statement WHERE kind IN ('of_phase', 'made_of') ORDER BY id"
        )
    ).all()
    followed = {row.supersedes_id for row in rows}
    last: dict[tuple[object, ...], int] = {}
    chain: dict[int, list[int | None]] = {}  # superseded_id and supersedes_id
    for row in rows:
        key = (row.kind, row.entity_id, row.structure_id, row.author)
        before = last.get(key)
        if before is not None:
            chain[before][0] = row.entry_id
        chain[row.id] = [None if row.id in followed else row.superseded_id, before]
        withdrawn = row.superseded_id is not None and row.id not in followed
        last[key] = row.id
        if withdrawn:
            del last[key]
    changed = [
        {"key": row.id, "superseded": chain[row.id][0], "supersedes": chain[row.id][1]}
        for row in rows
        if chain[row.id] != [row.superseded_id, row.supersedes_id]
    ]
    if changed:
        sql = "UPDATE statement SET superseded_id = :superseded, supersedes_id = :supersedes WHERE id = :key"
        connection.execute(text(sql), changed)


def state_percentile(connection: Connection) -> None:
    """Move the Von Mises stress that 1 % of a stone's volume exceeds from the further values to its column.

    Results of documents of version 1 are moved by it too.
    """
    number, rest = (
        ("json_extract(\"values\", '$.von_mises_p99')", "json_remove(\"values\", '$.von_mises_p99')")
        if connection.dialect.name == "sqlite"
        else (
            "(\"values\"->>'von_mises_p99')::double precision",
            "(\"values\"::jsonb - 'von_mises_p99')::json",
        )
    )
    sql = f'UPDATE entity_result SET von_mises_p99 = {number}, "values" = {rest} WHERE {number} IS NOT NULL'
    connection.execute(text(sql))


def losses(connection: Connection) -> Iterator[str]:
    """Yield what version 1 cannot hold."""
    for name, columns in _added().items():
        for one in columns:
            if one.name in ("author", "stated_on", "about", "relation", "von_mises_p99"):
                continue
            values = select(func.count()).select_from(table(name)).where(column(one.name).is_not(None))
            if not one.nullable:
                values = values.where(text(f"CAST({one.name} AS TEXT) <> '[]'"))
            if count := connection.scalar(values):
                yield f"{one.name} of {count} rows of {name}"
    for what, sql in (
        ("decisions", "SELECT COUNT(*) FROM statement WHERE kind = 'decision'"),
        ("stratigraphic relations", "SELECT COUNT(*) FROM statement WHERE kind = 'stratigraphy'"),
        ("rules of opinions", "SELECT COUNT(*) FROM opinion_rule"),
        ("canonical proportions", "SELECT COUNT(*) FROM canon"),
        ("terms", "SELECT COUNT(*) FROM term"),
        ("results of structures", "SELECT COUNT(*) FROM structure_result"),
        ("authors of statements other than those of their entries", _OF_ENTRIES.format(_OTHER_AUTHOR)),
        ("dates of statements other than those of their entries", _OF_ENTRIES.format(_OTHER_DATE)),
        (
            "opinions beside later ones",
            f"SELECT COUNT(*) FROM statement WHERE {_HELD} AND EXISTS ({_NEWER.format('1')})",
        ),
    ):
        if count := connection.scalar(text(sql)):
            yield f"{count} {what}"
