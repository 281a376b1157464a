"""What each test costs: `python -m tests.costs` measures all of them, which takes an hour, and renews `dear.txt`.

`dear.txt` lists the tests that take more than 0.7 s of processor time. Those that guard what a user has run in
`.ci/run` (`-m guard`), and so does, where all cases of a function are dear, the cheapest of them (`+` in the list),
if it takes at most 10 s or less than half of the functions of its file would run; the others run with `-m slow`. Never
listed are the cheapest test of a file, and the tests of the folders that `KEPT` names.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

DEAR = Path(__file__).with_name("dear.txt")
"""List of dear tests: their file, then, indented, their names, with `+` those that run in `.ci/run` nevertheless."""

COLLECTED = pytest.StashKey[frozenset[str]]()
"""All tests that a run collected, before any were left out."""

KEPT = (
    *("tests/test_", "tests/ratchets/", "tests/validation/wild/", "tests/validation/one_answer/"),
    "tests/docs/",
)
"""Rules of the source, scenes that were found to break a verdict, and documented commands: they run in every suite."""

GUARDS = (
    *("tests/archmodel/database/", "tests/archmodel/describe/test_history.py"),
    *("tests/archmodel/exchange/test_round_trip.py", "tests/archmodel/migrations/"),
    *("tests/archmodel/store/", "tests/mechanics/dynamics/test_resuming.py"),
    *("tests/mechanics/planar/test_resuming.py", "tests/moma/cli/test_database.py"),
    *("tests/moma/cli/test_read_only.py", "tests/pipelines/ingest/test_crashes.py"),
    *("tests/pipelines/ingest/test_exchange.py", "tests/pipelines/results/test_folder.py"),
    *("tests/pipelines/results/test_vtkhdf.py", "tests/pipelines/run/test_record.py"),
    *("tests/pipelines/run/test_unfinished.py", "tests/validation/elastic/test_laws.py"),
)
"""Files and folders of tests that guard what a user has: kills, locks, resumption, migration, files that come back."""

_STOPPED = "kill|interrupt|ctrl_c|sigterm|resum|goes_on|same_bits"
_STORED = (
    "full_disk|stored|whole_or_not|read_only|read_back|migrat|_lock|is_lost|_lose|replace|leaves_the_database"
)
RISKS = re.compile(rf"::test_\w*({_STOPPED}|{_STORED})")
"""Names of tests that guard the same, wherever they stand."""

_LIMIT = 0.7  # processor time of a test that is not dear [s]
# most that the cheapest case of a function may take in `.ci/run`, which is to end within 25 min [s]
_CHEAP = 10.0
_FOLDER = "MOMA_COSTS"  # variable that names the folder of the measurements


def is_dear(node: str, listed: frozenset[str]) -> bool:
    """Return True for a test that is listed, by its whole name or by that of its function."""
    return node in listed or node.split("[")[0] in listed


def guards(node: str, spared: frozenset[str] = frozenset()) -> bool:
    """Return True for a test that guards what a user has, or is `spared`, and so runs in `.ci/run` though it is dear.

    >>> guards("tests/pipelines/run/test_run.py::test_a_killed_run_goes_on")
    True
    >>> guards("tests/survey/faces/test_planes.py::test_the_rms_is_that_of_the_residuals")
    False
    """
    return node.startswith(GUARDS) or RISKS.search(node) is not None or node in spared


def entries() -> tuple[frozenset[str], frozenset[str]]:
    """Return the names in `dear.txt`: the dear tests, and those of them that are spared for `.ci/run`."""
    names, spared, file = set[str](), set[str](), ""
    for line in DEAR.read_text(encoding="utf-8").splitlines():
        if line.startswith("+ "):
            spared.add(f"{file}::{line[2:]}")
        elif line.startswith("  "):
            names.add(f"{file}::{line[2:]}")
        else:
            file = line
    return frozenset(names), frozenset(spared)


def cheapest(costs: dict[str, float]) -> Iterator[str]:
    """Yield the cheapest case of each function that would not run in `.ci/run` otherwise, as far as these are cheap.

    Of each file, at least half of the functions run.

    >>> costs = {"f.py::a": 0.1, "f.py::b[1]": 11.0, "f.py::b[2]": 12.0, "f.py::c": 15, "g.py::d": 0.1, "g.py::e": 9.0}
    >>> list(cheapest(costs))
    ['f.py::b[1]', 'g.py::e']
    """
    over = {name for name in dear(costs) if "[" not in name}
    files = defaultdict[str, dict[str, list[str]]](lambda: defaultdict(list))
    for node in sorted(costs, key=lambda node: (costs[node], node)):
        files[node.split("::")[0]][node.split("[")[0]].append(node)
    for functions in files.values():
        absent = [cases[0] for function, cases in functions.items() if function in over]
        absent = [case for case in absent if not any(guards(one) for one in functions[case.split("[")[0]])]
        count = len(functions) - len(absent)
        for case in absent:
            if costs[case] <= _CHEAP or 2 * count < len(functions):
                count += 1
                yield case


def dear(costs: dict[str, float]) -> Iterator[str]:
    """Yield the tests to list, whole functions where all of their cases are dear.

    >>> list(dear({"f.py::a": 3.0, "f.py::b[1]": 2.0, "f.py::b[2]": 2.0, "f.py::c[1]": 2.0, "f.py::c[2]": 0.1}))
    ['f.py::a', 'f.py::b', 'f.py::c[1]']
    """
    files, functions = defaultdict[str, list[str]](list), defaultdict[str, list[str]](list)
    for node in sorted(costs, key=lambda one: (costs[one], one)):
        files[node.split("::")[0]].append(node)
        functions[node.split("[")[0]].append(node)
    spared = {nodes[0] for nodes in files.values()}
    over = {
        node
        for node, cost in costs.items()
        if cost > _LIMIT and node not in spared and not node.startswith(KEPT)
    }
    yield from sorted(
        {
            function if over.issuperset(nodes) else node
            for function, nodes in functions.items()
            for node in over.intersection(nodes)
        }
    )


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Note, in a worker, the processor time at the end of each phase of a test."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker is None or _FOLDER not in os.environ:
        return
    now = sum(os.times()[:4])
    with (Path(os.environ[_FOLDER]) / f"{worker}.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps([report.nodeid, now]) + "\n")


def measured(folder: Path) -> dict[str, float]:
    """Return the processor time [s] of each test that a run noted."""
    costs = defaultdict[str, float](float)
    for path in sorted(folder.glob("*.jsonl")):
        before: float | None = None
        for line in path.read_text(encoding="utf-8").splitlines():
            node, now = json.loads(line)
            costs[node] += 0.0 if before is None else now - before
            before = now
    return dict(costs)


def text_of(names: Iterable[str], spared: Iterable[str] = ()) -> str:
    """Return the text of `dear.txt`.

    >>> text_of(["f.py::a", "f.py::b", "g.py::c[1]"], ["f.py::b[2]"]).splitlines()
    ['f.py', '  a', '  b', '+ b[2]', 'g.py', '  c[1]']
    """
    lines, file = list[str](), ""
    for name, mark in sorted([*((name, " ") for name in names), *((name, "+") for name in spared)]):
        path, test = name.split("::", 1)
        if path != file:
            file = path
            lines.append(path)
        lines.append(f"{mark} {test}")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure all tests, and renew the list."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pytest", "-p", "tests.costs", "-m", "slow or not slow"]
        subprocess.run(command, env=os.environ | {_FOLDER: folder}, check=False)
        costs = measured(Path(folder))
    DEAR.write_text(text_of(dear(costs), cheapest(costs)), encoding="utf-8")


if __name__ == "__main__":
    main()
