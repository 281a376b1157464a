"""Version 1: the tables that `archmodel.tables` declares.

Nobody holds a database of an earlier layout, so the first version needs no copy of the tables: a copy would be a
second declaration to keep equal to the first. With version 2 comes the need for one. Whoever declares it first writes
the tables of version 1 into this module, because from then on they must not change with the program.
"""

from alembic import op
from sqlalchemy import insert

from archmodel.tables.layout import SchemaVersion, metadata

__all__ = ["depends_on", "down_revision", "downgrade", "revision", "upgrade"]

revision = "0001"
down_revision = None
depends_on = None


def upgrade() -> None:
    """Lay out an empty database."""
    connection = op.get_bind()
    metadata.create_all(connection, checkfirst=False)
    connection.execute(insert(SchemaVersion).values(version=1))


def downgrade() -> None:
    """Drop all tables."""
    metadata.drop_all(op.get_bind(), checkfirst=False)
