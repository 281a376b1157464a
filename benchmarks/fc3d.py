"""Frictional contact problems: `python -m benchmarks.fc3d [--problems DIR] [--siconos-python PYTHON] [--write]`.

Problems of rigid scenes, which are made on the way, or stored ones. Each .npz holds W in block-sparse rows, q and μ of
u = W r + q with Coulomb's law. Beside our figures stand those of Siconos: live where an interpreter that has it is
named, else those of the file siconos.csv beside the problems.

Both sides are timed alike. Each solve is called once, and again up to five times while all calls take less than a
second together, every time from a problem of which nothing is known: the first call is cold, the median of the others
warm. A file tells cold calls alone, so only first calls are compared with it.
"""

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.reference import Siconos
from benchmarks.report import (
    Row,
    Table,
    commit,
    environment,
    guarded,
    machine,
    print_json,
    progress,
    table_lines,
    write_between,
)
from benchmarks.siconos_child import timed
from benchmarks.stored.operator import StoredDelassus
from benchmarks.stored.own_problems import write_own_problems
from benchmarks.stored.portfolio import StoredAuto
from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import project_on_cone
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.first_order.nsgs import NSGS
from moma.errors import UsageError

__all__ = ["main", "read_problem", "siconos_error"]


_SOLVERS = {"auto": StoredAuto, "nsgs": NSGS, "admm": ADMM}
# η begins at this, or at the tolerance times that, and goes down by this factor, to rounding at most
_LOOSEST, _LOOSER, _TIGHTER, _SMALLEST = 1e-2, 1e5, 10.0, 1e-14
# solves between an η that suffices and one that does not
_BISECTIONS = 3
_TABLE: Table = (
    ("problem", "problem", ""),
    ("nc", "contacts", "d"),
    ("solved", "solved", ""),
    ("error", "error", ".1e"),
    ("eta", "η", ".1e"),
    ("iterations", "iterations", "d"),
    ("cpu_ms", "cpu ms", ".3g"),
    ("cpu_first_ms", "first call", ".3g"),
    ("ns", "ns per contact and iteration", ".0f"),
    ("solved_eta", "η too", ""),
    ("iterations_eta", "iterations", "d"),
    ("cpu_eta_ms", "cpu ms", ".3g"),
    ("siconos_nsgs_iterations", "Siconos' NSGS: iterations", "d"),
    ("siconos_nsgs_cpu_ms", "cpu ms", ".3g"),
    ("siconos_nsgs_cpu_first_ms", "first call", ".3g"),
    ("siconos_best", "best of Siconos", ""),
    ("siconos_best_cpu_ms", "cpu ms", ".3g"),
    ("siconos_best_cpu_first_ms", "first call", ".3g"),
    ("ratio_best", "best of Siconos / ours", ".2g"),
    ("ratio_first", "first calls", ".2g"),
)


def main() -> None:
    """Solve every problem and print."""
    options, measured = _options(), commit()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(options.problems or made)
        if options.problems is None:
            write_own_problems(folder)
        elif not folder.is_dir():
            raise UsageError(
                "no such folder", where=str(folder), remedy="name the folder with the .npz problems"
            )
        paths = sorted(path for path in folder.glob("*.npz") if not options.only or path.stem in options.only)
        if not paths:
            raise UsageError(
                "no .npz problems", where=str(folder), remedy="see benchmarks/README.md for what one holds"
            )
        known = Siconos(folder / "siconos.csv", options)
        _warm_up(options.solver)
        rows = [_row(path, options, known) for path in paths]
    if options.json:
        print_json(rows)
        return
    for row in rows:
        keys = (
            "cpu",
            "cpu_first",
            "cpu_eta",
            "siconos_nsgs_cpu",
            "siconos_nsgs_cpu_first",
            "siconos_best_cpu",
            "siconos_best_cpu_first",
        )
        row |= {f"{key}_ms": None if row[key] is None else 1e3 * row[key] for key in keys}
        row |= {key: "yes" if row[key] else "no" for key in ("solved", "solved_eta")}
    lines = [
        f"Measured at {measured}: {machine()}; {rows[0]['versions']}; {options.solver}, "
        f"tolerance {options.tolerance:g}.",
        f"Siconos: {known.source}.",
        "",
        *table_lines(rows, _TABLE),
    ]
    print("\n".join(lines))
    if options.write:
        write_between("fc3d, stored" if options.problems else "fc3d, own", lines)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fc3d", description=__doc__)
    parser.add_argument("--problems", help="folder with .npz problems (own ones, made on the way)")
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these problems alone")
    parser.add_argument("--tolerance", type=float, default=1e-8, help="of Siconos' error and of η (1e-8)")
    parser.add_argument("--solver", choices=sorted(_SOLVERS), default="auto", help="ours (auto)")
    parser.add_argument("--max-iterations", type=int, default=100_000, help="of each solver (100000)")
    parser.add_argument(
        "--siconos-python", metavar="PYTHON", help="interpreter that has Siconos: run it side by side"
    )
    parser.add_argument(
        "--siconos-limit", type=float, default=60.0, help="seconds for a problem in Siconos (60)"
    )
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each problem")
    return parser.parse_args()


def read_problem(path: Path) -> ContactProblem:
    """Read `data` (nnz, 3, 3), `indices`, `indptr`, `q` (3 nc), `mu` (nc).

    Raises
    ------
    UsageError : if one of them is missing
    """
    with np.load(path) as data:
        try:
            operator = StoredDelassus(
                np.ascontiguousarray(data["data"], dtype=float),
                data["indices"].astype(np.int64),
                data["indptr"].astype(np.int64),
            )
            q, mu = data["q"].astype(float).reshape(-1, 3), data["mu"].astype(float)
        except KeyError as missing:
            remedy = "see benchmarks/README.md for what a problem holds"
            raise UsageError(str(missing.args[0]), where=str(path), remedy=remedy) from None
    none = np.zeros(len(mu))
    return ContactProblem(operator, q, none, mu, none)


def siconos_error(problem: ContactProblem, impulse: Array) -> float:
    """The number that Siconos 4.4 prints: the natural map with ρ = 1, over max(‖q‖, ‖r‖, ‖u‖); not free of units."""
    u = problem.delassus.apply(impulse) + problem.u_free
    dual = u.copy()
    dual[:, 0] += problem.friction * np.linalg.norm(u[:, 1:], axis=1)
    left = impulse - project_on_cone(impulse - dual, problem.friction, problem.cohesion)
    scale = max(np.linalg.norm(problem.u_free), np.linalg.norm(impulse), np.linalg.norm(u))
    return float(np.linalg.norm(left) / scale) if scale > 0 else 0.0


@dataclass(frozen=True)
class _Solved:
    """One solve from nothing: its processor time in calls after the first, their median, and in the first [s]."""

    solution: ContactSolution
    error: float
    cpu: float
    first: float


def _solve(problem: ContactProblem, options: argparse.Namespace, eta: float) -> _Solved:
    """Solve to a natural map, timed as Siconos is."""
    # the velocity criterion of time steps is no part of these problems
    solver = _SOLVERS[options.solver](eta, velocity_tolerance=np.inf, max_iterations=options.max_iterations)
    nothing = np.zeros_like(problem.u_free)

    def prepared() -> Callable[[], ContactSolution]:
        # a new operator knows no factor
        known = problem.delassus
        assert isinstance(known, StoredDelassus)
        fresh = replace(problem, delassus=StoredDelassus(known.block, known.indices, known.indptr))
        return lambda: solver(fresh, ContactStart(nothing, nothing))

    solution, first, cpu = timed(prepared)
    return _Solved(solution, siconos_error(problem, solution.impulse), cpu, first)


def _both(problem: ContactProblem, options: argparse.Namespace) -> tuple[_Solved, _Solved]:
    """To Siconos' error ≤ tolerance, and to η ≤ tolerance.

    Our solvers stop by η, which for the same number is mostly the stricter measure. So the first is the solve to the
    loosest η, more or less, that brings Siconos' error within the tolerance.
    """
    goal = options.tolerance
    eta, failed, found, strict = min(_LOOSEST, _LOOSER * goal), np.inf, None, None
    while found is None or strict is None:
        one = _solve(problem, options, eta)
        gave_up = not one.solution.converged or eta < _SMALLEST
        if found is None and (one.error <= goal or gave_up):
            found = _loosened(problem, options, one, eta, failed)
        if one.solution.natural_map <= goal or gave_up:
            strict = one
        failed = eta
        # once Siconos' error is small enough, only η is left to be reached
        eta = goal if found is not None and eta > goal else eta / _TIGHTER
    return found, strict


def _loosened(
    problem: ContactProblem, options: argparse.Namespace, found: _Solved, eta: float, failed: float
) -> _Solved:
    """The cheapest of some solves to an η between one that sufficed and one that did not."""
    if found.error > options.tolerance or not np.isfinite(failed):
        return found
    for _ in range(_BISECTIONS):
        middle = (eta * failed) ** 0.5
        one = _solve(problem, options, middle)
        if one.error > options.tolerance:
            failed = middle
            continue
        eta, found = middle, min(found, one, key=lambda solved: solved.cpu)
    return found


def _warm_up(solver: str) -> None:
    """Compile, or load, every kernel on two contacts that slide on one body."""
    block = np.tile(np.array([[2.0, 0.3, -0.2], [0.3, 1.5, 0.1], [-0.2, 0.1, 1.0]]), (4, 1, 1)) * 0.1
    block[[0, 3]] *= 10.0
    operator = StoredDelassus(block, np.array([0, 1, 0, 1]), np.array([0, 2, 4]))
    u_free, none = np.array([[-1.0, 2.0, 3.0], [-1.0, 0.1, 0.0]]), np.zeros(2)
    problem = ContactProblem(operator, u_free, none, np.array([0.3, 0.3]), none)
    _solve(problem, argparse.Namespace(solver=solver, max_iterations=200), 1e-10)


def _row(path: Path, options: argparse.Namespace, known: Siconos) -> Row:
    progress(path.stem)
    problem = read_problem(path)
    found, strict = _both(problem, options)
    nc = len(problem.friction)
    row: Row = {
        "problem": path.stem,
        "nc": nc,
        "solver": options.solver,
        "tolerance": options.tolerance,
        "solved": found.error <= options.tolerance,
        "error": found.error,
        "eta": found.solution.natural_map,
        "iterations": found.solution.iterations,
        "cpu": found.cpu,
        "cpu_first": found.first,
        "solved_eta": strict.solution.natural_map <= options.tolerance,
        "error_eta": strict.error,
        "eta_eta": strict.solution.natural_map,
        "iterations_eta": strict.solution.iterations,
        "cpu_eta": strict.cpu,
        "ns": 1e9 * strict.cpu / (nc * max(strict.solution.iterations, 1)),
    }
    row |= known.figures(path)
    for ratio, theirs, ours in (
        ("ratio_best", row["siconos_best_cpu"], found.cpu),
        ("ratio_first", row["siconos_best_cpu_first"], found.first),
    ):
        row[ratio] = theirs / ours if theirs is not None and row["solved"] else None
    return row | {
        "siconos_source": known.source,
        "machine": machine(),
        "versions": environment("moma-masonry", "numba", "numpy", "scipy"),
    }


if __name__ == "__main__":
    guarded(main)
