"""Alembic environment: migrates on the connection that it is given, in the transaction that is open there."""

from alembic import context

__all__: list[str] = []

context.configure(connection=context.config.attributes["connection"])
with context.begin_transaction():
    context.run_migrations()
