"""What tests of several packages share: databases of each kind that there is."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.postgresql import Server, Unavailable, running_server


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
def new_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Callable[[], str]]:
    """URLs of databases that nobody has laid out yet; a test that uses it runs on SQLite and on PostgreSQL."""
    if request.param == "sqlite":
        names = ("moma.db", *(f"moma{number}.db" for number in range(1, 100)))
        files = iter(names)
        yield lambda: f"sqlite:///{tmp_path / next(files)}"
        return
    server = request.getfixturevalue("postgresql")
    with ExitStack() as held:
        yield lambda: held.enter_context(server.database())
