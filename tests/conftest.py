"""How tests run: byte code, threads, kernels, seeds; and the databases that tests of several packages share."""

import importlib
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from hypothesis import settings

from tests.costs import COLLECTED, entries, guards, is_dear
from tests.kernel_locks import compile_once
from tests.postgresql import Server, Unavailable, running_server

# Without byte code a worker needs 30 s to import the tests and what they test, with it 9 s. It is kept beside the
# sources, where numba keeps its compiled kernels in any case.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

if "PYTEST_XDIST_WORKER" in os.environ:
    # workers share the cores: threads of one would only take them from another
    threads = max(1, (os.cpu_count() or 1) // int(os.environ["PYTEST_XDIST_WORKER_COUNT"]))
    for library in ("NUMBA", "OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", str(threads))
    compile_once()

if "MOMA_ROUNDING" in os.environ:
    from tests.rounding import perturb

    perturb(int(os.environ["MOMA_ROUNDING"]))

# deadlines would fail on a processor that is busy or slow
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("free", deadline=None)
FREE = pytest.StashKey[bool]()
# files of these folders take longest; begun last, one of them would run alone while other cores wait
FIRST = ("tests/validation/wild/", "tests/validation/", "tests/docs/", "tests/mechanics/")


def pytest_configure(config: pytest.Config) -> None:
    """Try the same examples of properties in every run; where slow tests are asked for, others each time.

    What draws is replaced before any test module imports it.
    """
    importlib.import_module("tests.drawing")
    config.stash[FREE] = "slow" in config.getoption("markexpr").replace("not slow", "")
    settings.load_profile("free" if config.stash[FREE] else "fixed")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with the files that take longest; mark dear tests as guards or slow, with slow ones also properties."""
    items.sort(key=lambda item: [not item.nodeid.startswith(folder) for folder in FIRST])
    dear, spared = entries()
    config.stash[COLLECTED] = frozenset(item.nodeid for item in items)
    for item in items:
        free = config.stash[FREE] and getattr(getattr(item, "obj", None), "is_hypothesis_test", False)
        costly = is_dear(item.nodeid, dear)
        if costly and guards(item.nodeid, spared):
            item.add_marker("guard")
        if free or (costly and not guards(item.nodeid, spared)):
            item.add_marker("slow")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Leave pictures blank, but where a test is marked `draws`."""
    from tests.drawing import allow

    allow(item)


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
