"""Databases on the server of the tests that are used again: emptying one takes a tenth of making one."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from archmodel.database.session import open_database
from archmodel.tables.layout import SCHEMA_VERSION, metadata
from tests.postgresql import Server

_TABLES = [table.name for table in metadata.sorted_tables if table.name != "moma_schema"]


class Recycled:
    """Databases that are laid out and empty.

    Parameters
    ----------
    server : where they are
    held : drops them all at its end
    """

    def __init__(self, server: Server, held: ExitStack) -> None:
        self._server, self._held = server, held
        self._idle: list[str] = []

    @contextmanager
    def url(self) -> Iterator[str]:
        """The URL of one that is nobody else's during the block."""
        url = self._idle.pop() if self._idle else self._new()
        yield url
        if self._emptied(url):
            self._idle.append(url)

    def _new(self) -> str:
        url = self._held.enter_context(self._server.database())
        open_database(url).close()
        return url

    def _emptied(self, url: str) -> bool:
        """Empty a database; False if it is no longer as it was laid out, or somebody still works in it."""
        from psycopg.errors import LockNotAvailable

        name = url.split("?")[0].rpartition("/")[2]
        try:
            with self._server.connect(name) as connection:
                connection.execute("SET lock_timeout = '1s'; SET session_replication_role = replica")
                tables = connection.execute("SELECT tablename FROM pg_tables WHERE schemaname = 'public'")
                if {row[0] for row in tables} != {*_TABLES, "moma_schema"}:
                    return False
                used = " UNION ALL ".join(
                    f"SELECT '{one}' WHERE EXISTS (SELECT FROM {one})" for one in _TABLES
                )
                for (table,) in connection.execute(used.encode()).fetchall():
                    connection.execute(f"DELETE FROM {table}".encode())
                connection.execute("UPDATE moma_schema SET version = %s", [SCHEMA_VERSION])
                connection.execute(
                    "SELECT setval(format('%I', sequencename)::regclass, 1, false) FROM pg_sequences"
                )
        except LockNotAvailable:
            return False
        return True
