"""The matrix of extremes: whatever a method claims to have solved obeys its laws; nothing is silently wrong.

Case S05 and beyond; `python -m benchmarks.extremes` prints the same rows, docs/accuracy.md §14 shows them.
"""

from functools import cache

import numpy as np
import pytest

from benchmarks.extremes.cells import Outcome, refused_cell, solved_cells
from benchmarks.extremes.problems import Row, rows
from benchmarks.extremes.scenes import run_cells, scene_rows
from benchmarks.stored import read_problem
from ground.errors import SolverError
from mechanics.scene.scene import Method
from tests.paths import ROOT
from tests.validation.extremes.published import published
from tests.validation.extremes.refusals import refusals
from tests.validation.extremes.wild import wild_problem

# a row that no method solves, whatever it tries, has no solution or is refused where it is stated
UNSOLVABLE = ("conflict", "no number", "negative", "no compliance", "shape", "mass", "velocity")
# solved, but the search for the equilibrium in which it is to begin ends above its tolerance, and says so
NOT_FOUND = ("E = 1e+12 Pa rests",)


PAGE = ROOT / "docs/accuracy.md"


@cache
def page():
    return published(PAGE.read_text(encoding="utf-8"))


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
        # what is published as solved is
        said = page().get((row.group, row.name), {}).get(name, "no")
        assert cell.outcome is Outcome.SOLVED or said.startswith(("no", "refused")), (name, said, cell)
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


WILD = [
    pytest.param(seed, decades, marks=[] if seed < 2 else [pytest.mark.slow])
    for decades in (0, 2, 6)
    for seed in range(20)
]


@pytest.mark.parametrize(("seed", "decades"), WILD)
def test_problems_at_random_are_solved_or_their_failure_is_told(seed, decades):
    """Masses, sizes, friction, cohesion, velocities over so many decades; contacts redundant, and contradicting."""
    row = Row("wild", str(seed), lambda: wild_problem(seed, decades))
    check(row, solved_cells(row, tuple(Method)))


def test_the_published_matrix_has_every_row_and_method():
    """And no cell in it is silently wrong; what is refused as a whole stands in a table of its own."""
    told = page()
    text = PAGE.read_text(encoding="utf-8")
    for row in [*rows(), *scene_rows()]:
        cells = told.get((row.group, row.name))
        if cells is None:
            assert f"| {row.group}: {row.name} | " in text
            continue
        assert {method.value for method in Method} <= set(cells)
        assert not any("*" in cell for cell in cells.values())
    assert set(told) <= {(row.group, row.name) for row in [*rows(), *scene_rows()]}


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["data", "q", "mu"])
def test_stored_problems_with_what_is_no_number_are_refused(tmp_path, name, value):
    arrays = {
        "data": np.tile(np.eye(3), (2, 1, 1)),
        "indices": np.arange(2),
        "indptr": np.arange(3),
        "q": np.full(6, -1.0),
        "mu": np.full(2, 0.5),
    }
    arrays[name].flat[-1] = value
    np.savez(tmp_path / "bad.npz", **arrays)
    with pytest.raises(SolverError, match=r"contact 1.*(nan|inf|not finite)"):
        read_problem(tmp_path / "bad.npz")
