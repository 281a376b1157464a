"""Time limits on what a session asks of its database."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from sqlalchemy import event, text
from sqlalchemy.orm import Session

_CANCELLED = "57014"  # SQLSTATE of a statement that PostgreSQL gave up, in any language
_INSTRUCTIONS = 2_000  # of SQLite's machine between two looks at the clock: tens of microseconds


class Deadline:
    """Longest time of a statement; `stopped` tells whether an error is that of one which was stopped by it.

    Parameters
    ----------
    seconds : for each statement
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._end = time.monotonic() + seconds
        self._passed = False

    def begin(self, *_: Any) -> None:
        """Give a new statement its time."""
        self._end = time.monotonic() + self._seconds

    def __call__(self) -> int:
        """Return 1 once the time is over, which stops SQLite."""
        self._passed = self._passed or time.monotonic() > self._end
        return int(self._passed)

    def stopped(self, error: BaseException) -> bool:
        """Return whether the database gave up a statement, whose error or its cause this is, as its time was over."""
        reason: BaseException | None = error
        while reason is not None:
            if getattr(getattr(reason, "orig", reason), "sqlstate", None) == _CANCELLED:
                return True
            reason = reason.__cause__
        return self._passed


@contextmanager
def deadline(session: Session, seconds: float) -> Iterator[Deadline]:
    """Let the database give up each statement of a session that is not done after some time.

    SQLite stops by a progress handler, PostgreSQL by ``statement_timeout``. A statement that is stopped raises an error
    as any other that the database refuses.
    """
    limit = Deadline(seconds)
    connection = session.connection()
    if connection.dialect.name == "postgresql":
        connection.execute(text(f"SET LOCAL statement_timeout = {max(1, int(1e3 * seconds))}"))
        yield limit
        return
    driver: Any = connection.connection.driver_connection
    event.listen(connection, "before_cursor_execute", limit.begin)
    driver.set_progress_handler(limit, _INSTRUCTIONS)
    try:
        yield limit
    finally:
        driver.set_progress_handler(None, 0)
        event.remove(connection, "before_cursor_execute", limit.begin)
