"""Version 1: the tables of the first layout."""

from alembic import op
from sqlalchemy import insert

from archmodel.migrations.layouts.version1 import metadata

revision = "0001"
down_revision = None
depends_on = None


def upgrade() -> None:
    """Lay out an empty database."""
    connection = op.get_bind()
    metadata.create_all(connection, checkfirst=False)
    connection.execute(insert(metadata.tables["moma_schema"]).values(version=1))


def downgrade() -> None:
    """Drop all tables."""
    metadata.drop_all(op.get_bind(), checkfirst=False)
