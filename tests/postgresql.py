"""A PostgreSQL server of the tests' own: in a temporary folder, reached through a socket there, gone afterwards."""

import getpass
import itertools
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from psycopg import Connection
    from psycopg.rows import TupleRow

OPTIONS = {
    "listen_addresses": "",
    "fsync": "off",
    "synchronous_commit": "off",
    "full_page_writes": "off",
    "max_connections": "60",
    "shared_buffers": "64MB",
}
"""No network, and nothing that only helps after a power failure."""

ACCESS = "local all guarded scram-sha-256\nlocal all all trust\n"
"""Who may enter: `guarded` with the password "open sesame", everybody else without one."""

KEEPER = '"$@" >"$LOG" 2>&1 & server=$!; cat >/dev/null; kill -INT $server; wait $server; rm -rf "$FOLDER"'
"""A shell that stops the server and removes its folder when our end of its input is closed: also when we are killed."""


class Unavailable(Exception):
    """No server can be started here; the text says why."""


@dataclass
class Server:
    """A running server.

    Attributes
    ----------
    programs : the folder of its tools
    folder : of its data and its socket
    user : who may do everything in it; `guest` may connect, `guarded` needs the password "open sesame"
    """

    programs: Path
    folder: Path
    user: str
    _numbers: Iterator[int] = field(default_factory=itertools.count)

    def url(self, name: str) -> str:
        """The URL of one of its databases."""
        return f"postgresql://{self.user}@/{name}?host={self.folder}"

    def connect(self, name: str = "postgres") -> "Connection[TupleRow]":
        """A connection to one of its databases, beside those of the program; each statement is a transaction."""
        import psycopg

        return psycopg.connect(host=str(self.folder), user=self.user, dbname=name, autocommit=True)

    def execute(self, statement: str) -> None:
        """A statement in the database that is always there."""
        with self.connect() as connection:
            connection.execute(statement.encode())

    @contextmanager
    def database(self, template: str = "template0") -> Iterator[str]:
        """The URL of a new database, which is dropped at the end of the block."""
        name = f"test_{next(self._numbers)}"
        self.execute(f"CREATE DATABASE {name} TEMPLATE {template}")
        try:
            yield self.url(name)
        finally:
            self.execute(f"DROP DATABASE {name} WITH (FORCE)")


@contextmanager
def running_server() -> Iterator[Server]:
    """A server for the time of the block.

    Raises
    ------
    Unavailable
        if none can be started
    """
    try:
        import psycopg  # noqa: F401  (asked first: it is what is missing most often)
    except ImportError as error:
        raise Unavailable(f"psycopg is not installed ({error})") from None
    if os.name != "posix":
        raise Unavailable("the server of the tests is started on Linux and macOS only")
    programs = _programs()
    user = _unprivileged_user()
    folder = Path(
        tempfile.mkdtemp(prefix="moma-pg-", dir="/tmp")
    )  # short: a socket's path has 107 characters
    try:
        if user is not None:
            shutil.chown(folder, user)
        _make_cluster(programs, folder, user)
        keeper = _start(programs, folder, user)
        try:
            server = Server(programs, folder, "moma")
            _wait_until_ready(server, keeper)
            server.execute("CREATE ROLE guest LOGIN")
            server.execute("CREATE ROLE guarded SUPERUSER LOGIN PASSWORD 'open sesame'")
            yield server
        finally:
            keeper.communicate(timeout=30)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _programs() -> Path:
    """The folder of initdb and postgres."""
    candidates = [str(Path(found).resolve().parent) for found in [shutil.which("initdb")] if found]
    candidates += sorted(map(str, Path("/usr/lib/postgresql").glob("*/bin")), reverse=True)
    if (tool := shutil.which("pg_config")) is not None:
        asked = subprocess.run([tool, "--bindir"], capture_output=True, text=True, check=False)
        candidates.append(asked.stdout.strip())
    for folder in candidates:
        if shutil.which("initdb", path=folder) and shutil.which("postgres", path=folder):
            return Path(folder)
    raise Unavailable("PostgreSQL is not installed: neither initdb nor postgres was found")


def _unprivileged_user() -> str | None:
    """Who the server runs as: ourselves, but for root, which PostgreSQL refuses."""
    if os.geteuid() != 0:
        return None
    import pwd

    for name in ("postgres", "nobody"):
        try:
            pwd.getpwnam(name)
        except KeyError:
            continue
        return name
    raise Unavailable("PostgreSQL refuses to run as root, and there is no user postgres or nobody")


def _make_cluster(programs: Path, folder: Path, user: str | None) -> None:
    """A cluster whose texts sort as in a dictionary, so that what needs another order has to say so."""
    plain = ["--username=moma", "--auth=trust", "--encoding=UTF8", "--no-sync", "--no-instructions"]
    for locale in (["--locale=C", "--locale-provider=icu", "--icu-locale=en"], ["--locale=C"]):
        command = [str(programs / "initdb"), f"--pgdata={folder / 'data'}", *plain, *locale]
        made = subprocess.run(command, capture_output=True, text=True, check=False, user=user, cwd=folder)
        if made.returncode == 0:
            (folder / "data" / "pg_hba.conf").write_text(ACCESS)
            return
        shutil.rmtree(folder / "data", ignore_errors=True)
    raise Unavailable(f"initdb failed for user {user or getpass.getuser()}: {made.stderr.strip()[-200:]}")


def _start(programs: Path, folder: Path, user: str | None) -> "subprocess.Popen[bytes]":
    """The keeper of a server that is just starting."""
    server = [str(programs / "postgres"), "-D", str(folder / "data"), "-k", str(folder)]
    for name, value in OPTIONS.items():
        server += ["-c", f"{name}={value}"]
    return subprocess.Popen(
        ["/bin/sh", "-c", KEEPER, "keeper", *server],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "LOG": str(folder / "log"), "FOLDER": str(folder)},
        user=user,
        cwd="/",
        start_new_session=True,
    )


def _wait_until_ready(server: Server, keeper: "subprocess.Popen[bytes]") -> None:
    import psycopg

    deadline = time.monotonic() + 30.0
    while True:
        try:
            server.execute("SELECT 1")
        except psycopg.OperationalError as error:
            if time.monotonic() > deadline or keeper.poll() is not None:
                log = server.folder / "log"
                said = log.read_text()[-300:] if log.exists() else str(error)
                raise Unavailable(f"the server does not start: {said}") from None
            time.sleep(0.05)
        else:
            return
