"""Numerical stability at the extremes: `python -m benchmarks.extremes [--only WORD …] [--quick] [--json] [--markdown]`.

Every method of a scene on every row of a matrix: mass ratios, heights, friction, steps, sizes, stiffness, redundant and
contradicting contacts, values that make no sense. Each cell is judged from outside, contact by contact and by what is
known of the solution: *η (iterations)* where it is solved, *no: η* where the method says that it is not, *refused*, or
**WRONG** where it claims what is not so. See docs/accuracy.md.
"""

import argparse
from collections.abc import Sequence

from benchmarks.extremes.cells import Outcome, refused_cell, solved_cells
from benchmarks.extremes.problems import rows
from benchmarks.extremes.refusals import refusals
from benchmarks.extremes.scenes import run_cells, scene_rows
from benchmarks.extremes.tables import Measured, as_lines, as_markdown, as_objects, columns, is_refused
from benchmarks.report import Row as Line
from benchmarks.report import Table, environment, guarded, machine, print_json, print_table, progress
from mechanics.scene.scene import Method

__all__ = ["main"]

_REFUSED: Table = (("what", "what", ""), ("words", "said", ""))


def main() -> None:
    """Measure and print."""
    options = _options()
    methods = tuple(Method(name) for name in options.method)
    problems = _problems(options, methods)
    runs = _runs(options, methods)
    if options.json:
        print_json(as_objects([*problems, *runs]))
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}")
    table = columns([method.value for method in methods])
    _show("One problem each", as_lines(problems), table, options.markdown)
    _show("Whole runs", as_lines(runs), table[:-1], options.markdown)
    refused = [one for one in problems if is_refused(one)]
    said = [{"what": f"{one.group}: {one.name}", "words": _words(one)} for one in refused]
    _show("Refused where it is made", [*said, *_senseless(options)], _REFUSED, options.markdown)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.extremes", description=__doc__)
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="WORD", help="rows that one of them occurs in"
    )
    names = [method.value for method in Method]
    parser.add_argument("--method", nargs="+", choices=names, default=names, help="these alone")
    parser.add_argument("--quick", action="store_true", help="only what every test run does")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each cell")
    parser.add_argument("--markdown", action="store_true", help="print tables as docs/accuracy.md has them")
    return parser.parse_args()


def _asked(options: argparse.Namespace, name: str, quick: bool = True) -> bool:
    return (quick or not options.quick) and (not options.only or any(word in name for word in options.only))


def _problems(options: argparse.Namespace, methods: tuple[Method, ...]) -> list[Measured]:
    measured = []
    for row in rows():
        if _asked(options, f"{row.group} {row.name}", row.quick):
            progress(f"{row.group}: {row.name}")
            measured.append(Measured(row.group, row.name, solved_cells(row, methods)))
    return measured


def _runs(options: argparse.Namespace, methods: tuple[Method, ...]) -> list[Measured]:
    measured = []
    for row in scene_rows():
        if _asked(options, f"{row.group} {row.name}", row.quick):
            progress(f"{row.group}: {row.name}")
            measured.append(Measured(row.group, row.name, run_cells(row, methods)))
    return measured


def _senseless(options: argparse.Namespace) -> list[Line]:
    lines = []
    for name, run in refusals().items():
        if _asked(options, name):
            cell = refused_cell(run)
            refused = cell.outcome is Outcome.REFUSED
            lines.append(
                {"what": name, "words": cell.words if refused else f"**{cell.outcome}** {cell.words}"}
            )
    return lines


def _words(measured: Measured) -> str:
    return next(iter(measured.cells.values())).words


def _show(title: str, lines: Sequence[Line], table: Table, markdown: bool) -> None:
    if not lines:
        return
    print(f"\n**{title}**\n")
    if markdown:
        print(as_markdown(lines, table))
    else:
        print_table(lines, table)


if __name__ == "__main__":
    guarded(main)
