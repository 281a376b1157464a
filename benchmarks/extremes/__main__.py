"""Numerical stability at the extremes: `python -m benchmarks.extremes [--only WORD …] [--quick] [--json] [--markdown]`.

Every method of a scene on every row of a matrix: mass ratios, heights, friction, steps, sizes, stiffness, redundant and
contradicting contacts, values that make no sense. Each cell is judged from outside, contact by contact and by what is
known of the solution: *η (iterations)* where it is solved, *no: η* where the method says that it is not, *refused*, or
**WRONG** where it claims what is not so. See docs/accuracy.md.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.extremes.cells import Cell, Outcome, solved_cells
from benchmarks.extremes.problems import rows
from benchmarks.extremes.scenes import run_cells, scene_rows
from benchmarks.report import Row as Line
from benchmarks.report import (
    Table,
    columns,
    environment,
    guarded,
    machine,
    options_of,
    print_json,
    print_table,
    progress,
)
from mechanics.scene.scene import Method

_REFUSED = columns("what what | words said")


@dataclass(frozen=True)
class _Measured:
    """One row of the matrix, as measured.

    Attributes
    ----------
    group, name : of the row
    cells : by method
    """

    group: str
    name: str
    cells: Mapping[str, Cell]

    @property
    def off(self) -> float | None:
        """The largest error of the methods that say they have solved it; None: nothing is known of the solution."""
        errors = [
            cell.error
            for cell in self.cells.values()
            if cell.error is not None and cell.outcome in (Outcome.SOLVED, Outcome.WRONG)
        ]
        return max(errors) if errors else None


def _is_refused(measured: _Measured) -> bool:
    """Return whether every method refuses it, in the same words: it is refused where it is stated."""
    words = {cell.words for cell in measured.cells.values() if cell.outcome is Outcome.REFUSED}
    return len(words) == 1 and all(cell.outcome is Outcome.REFUSED for cell in measured.cells.values())


def _columns(methods: Sequence[str]) -> Table:
    """Columns of `_as_lines`."""
    return [
        ("group", "extreme", ""),
        ("name", "", ""),
        *((name, name, "") for name in methods),
        ("off", "off by", ""),
    ]


def _as_lines(measured: Sequence[_Measured]) -> list[Line]:
    """One line of text cells for each row that is not refused as a whole."""
    return [
        {
            "group": one.group,
            "name": one.name,
            "off": "" if one.off is None else f"{one.off:.0e}",
            **{name: _shown(cell) for name, cell in one.cells.items()},
        }
        for one in measured
        if not _is_refused(one)
    ]


def _as_markdown(lines: Sequence[Line], table: Table) -> str:
    """A table that is not aligned, as it is published."""
    head = [[heading for _, heading, _ in table], ["---"] * len(table)]
    body = [[str(line.get(key, "")) for key, _, _ in table] for line in lines]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (*head, *body))


def _as_objects(measured: Sequence[_Measured]) -> list[Line]:
    """One object for each cell, with everything that is known of it."""
    return [
        {
            "extreme": one.group,
            "name": one.name,
            "method": method,
            "outcome": cell.outcome.value,
            "eta": cell.eta,
            "iterations": cell.iterations,
            "broken": cell.broken,
            "error": cell.error,
            "cpu": cell.seconds,
            "words": cell.words,
        }
        for one in measured
        for method, cell in one.cells.items()
    ]


def _shown(cell: Cell) -> str:
    """η and iterations of what is solved; else what it came to."""
    match cell.outcome:
        case Outcome.SOLVED:
            return f"{cell.eta:.0e} ({cell.iterations})"
        case Outcome.NOT_CONVERGED:
            return f"no: {cell.eta:.0e}" if np.isfinite(cell.eta) else "no"
        case Outcome.REFUSED:
            return "refused"
        case _:
            return f"**{cell.outcome.value}**"


def main() -> None:
    """Measure and print."""
    options = _options()
    methods = tuple(Method(name) for name in options.method)
    problems = _problems(options, methods)
    runs = _runs(options, methods)
    if options.json:
        print_json(_as_objects([*problems, *runs]))
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}")
    table = _columns([method.value for method in methods])
    _show("One problem each", _as_lines(problems), table, options.markdown)
    _show("Whole runs", _as_lines(runs), table[:-1], options.markdown)
    refused = [one for one in problems if _is_refused(one)]
    said = [{"what": f"{one.group}: {one.name}", "words": _words(one)} for one in refused]
    _show("Refused where it is made", said, _REFUSED, options.markdown)


def _options() -> argparse.Namespace:
    parser = options_of("extremes", __doc__)
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="WORD", help="rows that one of them occurs in"
    )
    names = [method.value for method in Method]
    parser.add_argument("--method", nargs="+", choices=names, default=names, help="these alone")
    parser.add_argument("--quick", action="store_true", help="only what every test run does")
    parser.add_argument("--markdown", action="store_true", help="print tables as docs/accuracy.md has them")
    return parser.parse_args()


def _asked(options: argparse.Namespace, name: str, quick: bool = True) -> bool:
    return (quick or not options.quick) and (not options.only or any(word in name for word in options.only))


def _problems(options: argparse.Namespace, methods: tuple[Method, ...]) -> list[_Measured]:
    measured = []
    for row in rows():
        if _asked(options, f"{row.group} {row.name}", row.quick):
            progress(f"{row.group}: {row.name}")
            measured.append(_Measured(row.group, row.name, solved_cells(row, methods)))
    return measured


def _runs(options: argparse.Namespace, methods: tuple[Method, ...]) -> list[_Measured]:
    measured = []
    for row in scene_rows():
        if _asked(options, f"{row.group} {row.name}", row.quick):
            progress(f"{row.group}: {row.name}")
            measured.append(_Measured(row.group, row.name, run_cells(row, methods)))
    return measured


def _words(measured: _Measured) -> str:
    return next(iter(measured.cells.values())).words


def _show(title: str, lines: Sequence[Line], table: Table, markdown: bool) -> None:
    if not lines:
        return
    print(f"\n**{title}**\n")
    if markdown:
        print(_as_markdown(lines, table))
    else:
        print_table(lines, table)


if __name__ == "__main__":
    guarded(main)
