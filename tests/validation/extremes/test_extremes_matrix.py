"""The matrix of extremes: whatever a method claims to have solved obeys its laws; nothing is silently wrong.

Case S05 and beyond; `python -m benchmarks.extremes` prints the same rows, docs/accuracy.md §14 shows them.
"""

import pytest

from benchmarks.extremes.cells import Outcome, refused_cell, solved_cells
from benchmarks.extremes.problems import rows
from benchmarks.extremes.refusals import refusals
from benchmarks.extremes.scenes import run_cells, scene_rows
from mechanics.scene import Method

# a row that no method solves, whatever it tries, has no solution or is refused where it is stated
UNSOLVABLE = ("conflict", "no number", "negative", "no compliance", "shape", "mass", "velocity")
# solved, but the search for the equilibrium in which they are to begin ends a little above its tolerance, and says so
NOT_FOUND = ("E = 1e+12 Pa rests", "1 mm, E = 1e+12 Pa rests, h = 1e-05 s")


def parameters(all_rows):
    return [
        pytest.param(row, id=f"{row.group}: {row.name}", marks=[] if row.quick else [pytest.mark.slow])
        for row in all_rows
    ]


def check(row, cells):
    silent = {name: cell for name, cell in cells.items() if cell.silent}
    assert not silent, silent
    for name, cell in cells.items():
        if cell.outcome is Outcome.REFUSED:
            assert cell.words, name
    return [name for name, cell in cells.items() if cell.outcome is Outcome.SOLVED]


@pytest.mark.parametrize("row", parameters(rows()))
def test_a_problem_is_solved_or_its_failure_is_told(row):
    """By every method; where there is a solution, one finds it."""
    solved = check(row, solved_cells(row, tuple(Method)))
    assert solved or row.group in UNSOLVABLE or row.start != row.start


@pytest.mark.parametrize("row", parameters(scene_rows()))
def test_a_run_is_solved_or_its_failure_is_told(row):
    """By every method; where there is a motion or an equilibrium, one finds it."""
    solved = check(row, run_cells(row, tuple(Method)))
    assert solved or row.group == "conflict" or row.name in NOT_FOUND


@pytest.mark.parametrize("name", refusals())
def test_what_makes_no_sense_is_refused_with_a_reason(name):
    cell = refused_cell(refusals()[name])
    assert cell.outcome is Outcome.REFUSED, cell.words
    where, _, rest = cell.words.partition(": ")
    what, _, remedy = rest.partition("; ")
    assert where
    assert what
    assert remedy or "used twice" in what
