"""Output of every benchmark: a table or JSON, and the machine."""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from moma.errors import MomaError, UsageError

__all__ = [
    "Row",
    "Table",
    "commit",
    "environment",
    "guarded",
    "machine",
    "options_of",
    "print_json",
    "print_table",
    "progress",
    "spread",
    "table_lines",
    "write_between",
]

Row = dict[str, Any]
# per column: key of the row, heading, format
Table = Sequence[tuple[str, str, str]]

_ROOT = Path(__file__).resolve().parents[1]
# time between two lines on an error stream that is no terminal [s], and when the last one was written
_PAUSE = 10.0
_said = [time.monotonic()]


def print_json(rows: Sequence[Row]) -> None:
    """One array of objects, nothing else."""
    json.dump([{key: _plain(value) for key, value in row.items()} for row in rows], sys.stdout, indent=1)
    print()


def _plain(value: Any) -> Any:
    """JSON knows no infinity and no NaN."""
    if isinstance(value, float) and (value != value or value in (float("inf"), float("-inf"))):
        return None
    return value.item() if hasattr(value, "item") else value


def print_table(rows: Sequence[Row], table: Table) -> None:
    """Markdown, aligned; – where a row has no value."""
    print("\n".join(table_lines(rows, table)))


def table_lines(rows: Sequence[Row], table: Table) -> list[str]:
    """Lines of a table in Markdown, aligned; – where a row has no value."""
    cells = [[heading for _, heading, _ in table]]
    cells += [[_cell(row.get(key), form) for key, _, form in table] for row in rows]
    widths = [max(len(line[k]) for line in cells) for k in range(len(table))]
    lines = [
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in cells
    ]
    return [lines[0], "|" + "|".join("-" * (width + 2) for width in widths) + "|", *lines[1:]]


def spread(values: Iterable[float], digits: int) -> str:
    """Mean ± standard deviation; one value has none."""
    found = list(values)
    deviation = f" ± {stdev(found):.{digits}f}" if len(found) > 1 else ""
    return f"{fmean(found):.{digits}f}{deviation}"


def write_between(name: str, lines: Sequence[str], path: Path = _ROOT / "benchmarks" / "README.md") -> None:
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
    """Short name of the commit that is measured, and whether files have changed since."""

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", *arguments], cwd=_ROOT, capture_output=True, text=True, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    name = git("rev-parse", "--short=9", "HEAD")
    if not name:
        return "no commit"
    return f"commit {name}" + (
        " with changes" if git("status", "--porcelain", "--untracked-files=no") else ""
    )


def _cell(value: Any, form: str) -> str:
    if value is None or (isinstance(value, float) and value != value):
        return "–"
    return format(value, form)


def options_of(name: str, description: str | None) -> argparse.ArgumentParser:
    """Return the options of a benchmark of disks, to which it adds its own."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks.{name}", description=description)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument(
        "--json", action="store_true", help="print an array of objects, one for each row or run"
    )
    return parser


def machine() -> str:
    """Processor, its number of cores, and the system."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if "model name" in line
        ]
        name = models[0] if models else name
    return f"{name}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def environment(*packages: str) -> str:
    """Versions of packages, as installed."""
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
