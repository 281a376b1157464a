"""Processor time that a question to a database takes: of this process, and of the server's that works for it."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from sqlalchemy import Connection

__all__ = ["processor_clock"]


def processor_clock(connection: Connection) -> Callable[[], float]:
    """A clock [s] for what is asked through this connection.

    The server's part has a resolution of 10 ms, so ask often; it is zero where the server is on another machine.
    """
    if connection.dialect.name == "sqlite":  # works within this process
        return time.process_time
    number = connection.exec_driver_sql("SELECT pg_backend_pid()").scalar_one()
    server = Path(f"/proc/{number}/stat")
    tick = os.sysconf("SC_CLK_TCK")

    def clock() -> float:
        if not server.exists():
            return time.process_time()
        user, system = server.read_text().rpartition(")")[2].split()[11:13]
        return time.process_time() + (int(user) + int(system)) / tick

    return clock
