"""Fixtures that tests of several packages share: databases of each kind; and kernels that are compiled once."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.kernel_locks import compile_once
from tests.postgresql import Server, Unavailable, running_server

if "PYTEST_XDIST_WORKER" in os.environ:
    compile_once()


@pytest.fixture(scope="session")
def postgresql() -> Iterator[Server]:
    """A PostgreSQL server; tests that need it are skipped where none can be started."""
    with ExitStack() as held:
        try:
            server = held.enter_context(running_server())
        except Unavailable as reason:
            pytest.skip(f"no PostgreSQL server: {reason}")
        yield server


@pytest.fixture(params=["sqlite", "postgresql"])
def backend(request: pytest.FixtureRequest) -> str:
    """The kind of database that a test runs on: each in turn."""
    return str(request.param)


@pytest.fixture
def new_url(backend: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[[], str]]:
    """A function that gives URLs of databases that nobody has laid out yet."""
    if backend == "sqlite":
        files = iter(("new.db", *(f"new{number}.db" for number in range(1, 100))))
        yield lambda: f"sqlite:///{tmp_path / next(files)}"
        return
    server = request.getfixturevalue("postgresql")
    with ExitStack() as held:
        yield lambda: held.enter_context(server.database())
