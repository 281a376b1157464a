"""List of the acts of recording."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.plain_values import entry_values
from archmodel.tables.entries import Entry


def list_entries(session: Session) -> list[dict[str, object]]:
    """Return number, action, author, source and time of every act of recording, oldest first."""
    return [entry_values(entry) for entry in session.scalars(select(Entry).order_by(Entry.id))]
