"""What every benchmark prints: a table or JSON, and on which machine."""

import json
import os
import platform
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from moma.errors import MomaError

__all__ = ["Row", "Table", "environment", "guarded", "machine", "print_json", "print_table", "progress"]

Row = dict[str, Any]
# per column: key of the row, heading, format
Table = Sequence[tuple[str, str, str]]


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
    cells = [[heading for _, heading, _ in table]]
    cells += [[_cell(row.get(key), form) for key, _, form in table] for row in rows]
    widths = [max(len(line[k]) for line in cells) for k in range(len(table))]
    for n, line in enumerate(cells):
        print("| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |")
        if n == 0:
            print("|" + "|".join("-" * (width + 2) for width in widths) + "|")


def _cell(value: Any, form: str) -> str:
    if value is None or (isinstance(value, float) and value != value):
        return "–"
    return format(value, form)


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
    """Say on the error stream what is going on, where somebody watches."""
    if sys.stderr.isatty():
        print(text, file=sys.stderr, flush=True)


def guarded(run: Callable[[], None]) -> None:
    """Run a benchmark; a foreseen failure becomes one line and its exit code."""
    try:
        run()
    except MomaError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
