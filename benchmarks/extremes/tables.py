"""The matrix as tables: one line for each row, one column for each method."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.extremes.cells import Cell, Outcome
from benchmarks.report import Row as Line
from benchmarks.report import Table

__all__ = ["Measured", "as_lines", "as_markdown", "as_objects", "columns", "is_refused"]


@dataclass(frozen=True)
class Measured:
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


def is_refused(measured: Measured) -> bool:
    """Whether every method refuses it, in the same words: it is refused where it is stated."""
    words = {cell.words for cell in measured.cells.values() if cell.outcome is Outcome.REFUSED}
    return len(words) == 1 and all(cell.outcome is Outcome.REFUSED for cell in measured.cells.values())


def columns(methods: Sequence[str]) -> Table:
    """Columns of `as_lines`, for `print_table`."""
    return [
        ("group", "extreme", ""),
        ("name", "", ""),
        *((name, name, "") for name in methods),
        ("off", "off by", ""),
    ]


def as_lines(measured: Sequence[Measured]) -> list[Line]:
    """One line of text cells for each row that is not refused as a whole."""
    return [
        {
            "group": one.group,
            "name": one.name,
            "off": "" if one.off is None else f"{one.off:.0e}",
            **{name: _shown(cell) for name, cell in one.cells.items()},
        }
        for one in measured
        if not is_refused(one)
    ]


def as_markdown(lines: Sequence[Line], table: Table) -> str:
    """A table that is not aligned, as it is published."""
    head = [[heading for _, heading, _ in table], ["---"] * len(table)]
    body = [[str(line.get(key, "")) for key, _, _ in table] for line in lines]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (*head, *body))


def as_objects(measured: Sequence[Measured]) -> list[Line]:
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
