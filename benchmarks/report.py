"""Parts that benchmarks share: options, tables and JSON, the machine, time and memory, and processes of their own."""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

import numpy as np
from scipy.sparse import issparse

from ground.errors import MomaError, SolverError, UsageError
from mechanics.dynamics.progress import Clock

ROOT = Path(__file__).resolve().parents[1]
"""Root of the project."""

Row = dict[str, Any]
# per column: key of the row, heading, format
Table = Sequence[tuple[str, str, str]]

# time between two lines on an error stream that is no terminal [s], and when the last one was written
_PAUSE = 10.0
_said = [time.monotonic()]
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def columns(text: str) -> Table:
    """Return the columns that a text describes: `key heading :format`, with bars between them."""
    table = []
    for column in text.split(" | "):
        words, _, form = column.partition(" :")
        key, _, heading = words.strip().partition(" ")
        table.append((key, heading.strip(), form.strip()))
    return table


def options_of(name: str, description: str | None) -> argparse.ArgumentParser:
    """Return the options of a benchmark, to which it adds its own."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks.{name}", description=description)
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each row")
    return parser


def show(rows: Sequence[Row], *tables: Table, as_json: bool) -> None:
    """Print rows as JSON, or in one table after the other, with the machine."""
    if as_json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{commit()}; {machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}")
    for table in tables:
        print()
        print_table(rows, table)


def print_json(rows: Sequence[Row]) -> None:
    """Print one array of objects, nothing else."""
    json.dump([{key: _plain(value) for key, value in row.items()} for row in rows], sys.stdout, indent=1)
    print()


def _plain(value: Any) -> Any:
    """JSON knows no infinity and no NaN."""
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value.item() if hasattr(value, "item") else value


def print_table(rows: Sequence[Row], table: Table) -> None:
    """Print a table in Markdown, aligned; – where a row has no value."""
    print("\n".join(table_lines(rows, table)))


def table_lines(rows: Sequence[Row], table: Table) -> list[str]:
    """Return the lines of a table in Markdown, aligned; – where a row has no value."""
    cells = [[heading for _, heading, _ in table]]
    cells += [[_cell(row.get(key), form) for key, _, form in table] for row in rows]
    widths = [max(len(line[k]) for line in cells) for k in range(len(table))]
    lines = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in cells
    ]
    return [lines[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *lines[1:]]


def _cell(value: Any, form: str) -> str:
    if value is None or (isinstance(value, float) and value != value):
        return "–"
    return format(value, form)


def spread(values: Iterable[float], digits: int) -> str:
    """Return mean ± standard deviation; one value has none."""
    found = list(values)
    deviation = f" ± {stdev(found):.{digits}f}" if len(found) > 1 else ""
    return f"{fmean(found):.{digits}f}{deviation}"


def write_between(name: str, lines: Sequence[str], path: Path = ROOT / "benchmarks" / "README.md") -> None:
    """Replace what stands in a file between the comments `<!-- NAME -->` and `<!-- /NAME -->`.

    Raises
    ------
    UsageError : if the file does not have both, once each and in this order
    """
    text = path.read_text(encoding="utf-8")
    begin, end = f"<!-- {name} -->", f"<!-- /{name} -->"
    head, found, rest = text.partition(begin)
    _, closed, tail = rest.partition(end)
    if not found or not closed or begin in tail or end in tail:
        raise UsageError(
            f"no place for the tables of {name}", where=str(path), remedy=f"put {begin} and {end} there"
        )
    path.write_text("\n".join([head + begin, "", *lines, "", end + tail]), encoding="utf-8")


def commit() -> str:
    """Return the short name of the commit that is measured, and whether files have changed since."""

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    name = git("rev-parse", "--short=9", "HEAD")
    if not name:
        return "no commit"
    return f"commit {name}" + (
        " with changes" if git("status", "--porcelain", "--untracked-files=no") else ""
    )


def machine() -> str:
    """Return the processor, its number of cores, and the system."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if "model name" in line
        ]
        name = models[0] if models else name
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def environment(*packages: str) -> str:
    """Return the versions of packages, as installed."""
    found = []
    for package in packages:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            found.append(f"{package} –")
    return ", ".join(found)


def progress(text: str) -> None:
    """Say on the error stream what is going on: all of it on a terminal, elsewhere a line now and then."""
    now = time.monotonic()
    if sys.stderr.isatty() or now >= _said[0] + _PAUSE:
        _said[0] = now
        print(text, file=sys.stderr, flush=True)


def guarded(run: Callable[[], None]) -> None:
    """Run a benchmark; a foreseen failure becomes one line and its exit code."""
    try:
        run()
    except MomaError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.exit_code)


def one_thread() -> dict[str, str]:
    """Return the environment of a process with one thread."""
    return os.environ | dict.fromkeys(_THREADS, "1")


def alone(function: Callable[..., Row], *arguments: Any, threads: int = 1) -> Row:
    """Call a function of a module in a process of its own, with arguments and a result that JSON can carry.

    Parameters
    ----------
    threads : that numba may use; BLAS has one

    Raises
    ------
    SolverError : if it fails, with the last line of what it said
    """
    module = function.__module__
    if module == "__main__":
        module = sys.modules["__main__"].__spec__.name  # type: ignore[union-attr]
    name = function.__name__
    call = (
        f"import json, sys\nfrom {module} import {name}\nprint(json.dumps({name}(*json.loads(sys.argv[1]))))"
    )
    done = subprocess.run(
        [sys.executable, "-c", call, json.dumps(arguments)],
        cwd=ROOT,
        env=one_thread() | {"NUMBA_NUM_THREADS": str(threads)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        said = done.stderr.strip().splitlines()
        raise SolverError(said[-1] if said else "no word", where=f"{name}{arguments}")
    row: Row = json.loads(done.stdout.splitlines()[-1])
    return row


class ProcessorClock(Clock):
    """Processor seconds by stage of a run: the machine may have other work."""

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Add the time of a with-block to a stage."""
        start = time.process_time()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.process_time() - start


def peak_bytes() -> int:
    """Return the most memory that this process ever had; 0 where the system does not say."""
    try:
        import resource
    except ImportError:  # Windows
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def arrays_bytes(root: Any) -> int:
    """Return the bytes of all numpy arrays that can be reached from an object, each buffer once."""
    seen: set[int] = set()
    buffers: dict[int, int] = {}
    waiting = [root]
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, np.ndarray):
            owner = one
            while isinstance(owner.base, np.ndarray):
                owner = owner.base
            buffers[id(owner)] = owner.nbytes
            waiting += [owner]
        elif issparse(one):
            waiting += [one.data, *(getattr(one, key) for key in ("indices", "indptr") if hasattr(one, key))]
        elif isinstance(one, dict):
            waiting += list(one.values())
        elif isinstance(one, list | tuple):
            waiting += list(one)
        elif is_dataclass(one) and not isinstance(one, type):
            waiting += [getattr(one, field.name) for field in fields(one)]
            waiting += list(getattr(one, "__dict__", {}).values())
        elif type(one).__module__.startswith("mechanics"):
            waiting += list(getattr(one, "__dict__", {}).values())
    return sum(buffers.values())
