"""Frictional contact problems: `python -m benchmarks.fc3d [--problems DIR] [--siconos-python PYTHON] [--write]`.

Problems of rigid scenes, which are made on the way, or stored ones. Each .npz holds W in block-sparse rows, q and μ of
u = W r + q with Coulomb's law. Beside our figures stand those of Siconos: live where an interpreter that has it is
named, else those of the file siconos.csv beside the problems.

Both sides are timed alike. Each solve is called once, and again up to five times while all calls take less than a
second together, every time from a problem of which nothing is known: the first call is cold, the median of the others
warm. A file tells cold calls alone, so only first calls are compared with it.
"""

import argparse
import csv
import json
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.sparse import block_diag, bsr_array

from benchmarks.report import (
    Row,
    columns,
    commit,
    environment,
    guarded,
    machine,
    options_of,
    print_json,
    progress,
    table_lines,
    write_between,
)
from benchmarks.scenes import BlockScene, engine_scene, rigid_scenes
from benchmarks.siconos_child import timed
from benchmarks.stored import StoredDelassus, read_problem
from ground.errors import MissingLibraryError, SolverError, UsageError
from mechanics.arrays import Array
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import project_on_cone
from mechanics.scene.scene import Method, SolverSettings
from mechanics.solvers.choice import choose_solver

# η begins at this, or at the tolerance times that, and goes down by this factor, to rounding at most
_LOOSEST, _LOOSER, _TIGHTER, _SMALLEST = 1e-2, 1e5, 10.0, 1e-14
# solves between an η that suffices and one that does not
_BISECTIONS = 3
# methods before the automatic choice, with their iterations: sweeps suffice for few contacts
_CHAIN = ((Method.NSGS, 60), (Method.NEWTON, 100))
# scene, angle by which gravity is tilted along it [°], step whose problem is kept
_PROBLEMS = (
    ("column_10", 0.0, 1),
    ("column_50", 0.0, 1),
    ("arch_15", 0.0, 1),
    ("arch_15", 30.0, 1),
    ("arch_15", 30.0, 40),
    ("arch_45", 0.0, 1),
    ("arch_45", 25.0, 10),
    ("wall_10x10", 0.0, 1),
)
_TABLE = columns(
    "problem problem | nc contacts :d | solved solved | error error :.1e | eta η :.1e | "
    "iterations iterations :d | cpu_ms cpu ms :.3g | cpu_first_ms first call :.3g | "
    "ns ns per contact and iteration :.0f | solved_eta η too | iterations_eta iterations :d | "
    "cpu_eta_ms cpu ms :.3g | siconos_nsgs_iterations Siconos' NSGS: iterations :d | "
    "siconos_nsgs_cpu_ms cpu ms :.3g | siconos_nsgs_cpu_first_ms first call :.3g | "
    "siconos_best best of Siconos | siconos_best_cpu_ms cpu ms :.3g | "
    "siconos_best_cpu_first_ms first call :.3g | ratio_best best of Siconos / ours :.2g | "
    "ratio_first first calls :.2g"
)


def main() -> None:
    """Solve every problem and print."""
    options, measured = _options(), commit()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(options.problems or made)
        if options.problems is None:
            _write_own_problems(folder)
        elif not folder.is_dir():
            raise UsageError(
                "no such folder", where=str(folder), remedy="name the folder with the .npz problems"
            )
        paths = sorted(path for path in folder.glob("*.npz") if not options.only or path.stem in options.only)
        if not paths:
            raise UsageError(
                "no .npz problems", where=str(folder), remedy="see benchmarks/README.md for what one holds"
            )
        known = _Siconos(folder / "siconos.csv", options)
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
    parser = options_of("fc3d", __doc__)
    parser.add_argument("--problems", help="folder with .npz problems (own ones, made on the way)")
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these problems alone")
    parser.add_argument("--tolerance", type=float, default=1e-8, help="of Siconos' error and of η (1e-8)")
    parser.add_argument("--solver", choices=[one.value for one in Method], default="auto", help="ours (auto)")
    parser.add_argument("--max-iterations", type=int, default=100_000, help="of each solver (100000)")
    parser.add_argument("--siconos-python", metavar="PYTHON", help="interpreter that has Siconos: run it too")
    parser.add_argument("--siconos-limit", type=float, default=60.0, help="seconds for a problem there (60)")
    return parser.parse_args()


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

    def prepared() -> Callable[[], ContactSolution]:
        # a new operator knows no factor
        known = problem.delassus
        assert isinstance(known, StoredDelassus)
        fresh = replace(problem, delassus=StoredDelassus(known.block, known.indices, known.indptr))
        return lambda: _by(Method(options.solver), fresh, eta, options.max_iterations)

    solution, first, cpu = timed(prepared)
    return _Solved(solution, siconos_error(problem, solution.impulse), cpu, first)


def _by(method: Method, problem: ContactProblem, eta: float, most: int) -> ContactSolution:
    """Solve from nothing by a method of scenes; before the automatic choice by quick ones, each from the last."""
    chain = _CHAIN if method is Method.AUTO else ()
    impulse, count = np.zeros_like(problem.u_free), 0
    for each, limit in (*chain, (method, most)):
        # the velocity criterion of time steps is no part of these problems
        solver = choose_solver(SolverSettings(each, eta, np.inf, limit), deformable=False)
        found = solver(problem, ContactStart(impulse, np.zeros_like(impulse)))
        impulse, count = found.impulse, count + found.iterations
        if found.converged:
            break
    return replace(found, iterations=count)


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


def _row(path: Path, options: argparse.Namespace, known: "_Siconos") -> Row:
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


class _Siconos:
    """Results of Siconos: live, or as the file beside the problems says."""

    def __init__(self, table: Path, options: argparse.Namespace) -> None:
        self._options = options
        self._rows: list[dict[str, str]] = []
        self.source = "not there"
        if options.siconos_python:
            self._check()
            self.source = f"live, {options.siconos_python}"
        elif table.exists():
            with table.open(newline="", encoding="utf-8") as file:
                self._rows = [row for row in csv.DictReader(file) if float(row["tol"]) == options.tolerance]
            self.source = f"{table.name}, one cold call each on another machine"

    def figures(self, path: Path) -> Row:
        """The fastest method that solved the problem, and the fastest NSGS."""
        methods = self._live(path) if self._options.siconos_python else self._stored(path.stem)
        solved = sorted(
            (one for one in methods if one["solved"]), key=lambda one: one["cpu"] or one["cpu_first"]
        )
        sweeping = [one for one in solved if one["method"].startswith("NSGS")]
        best, nsgs = next(iter(solved), None), next(iter(sweeping), None)
        return {
            "siconos_solved": len(solved),
            "siconos_tried": len(methods),
            "siconos_best": best and best["method"],
            "siconos_best_cpu": best and best["cpu"],
            "siconos_best_cpu_first": best and best["cpu_first"],
            "siconos_best_iterations": best and best["iterations"],
            "siconos_nsgs": nsgs and nsgs["method"],
            "siconos_nsgs_cpu": nsgs and nsgs["cpu"],
            "siconos_nsgs_cpu_first": nsgs and nsgs["cpu_first"],
            "siconos_nsgs_iterations": nsgs and nsgs["iterations"],
        }

    def _stored(self, name: str) -> list[Row]:
        return [
            {
                "method": row["solver"],
                "solved": row["solved"] == "1",
                "iterations": int(row["iterations"] or 0),
                "cpu": None,  # a file tells one cold call
                "cpu_first": float(row["cpu_s"] or "nan"),
            }
            for row in self._rows
            if row["problem"] == name
        ]

    def _live(self, path: Path) -> list[Row]:
        options, child = self._options, Path(__file__).with_name("siconos_child.py")
        command = [options.siconos_python, "-W", "ignore", str(child), str(path.resolve())]
        command += [repr(options.tolerance), str(options.max_iterations)]
        said: bytes
        complaint = b""
        try:
            done = subprocess.run(command, check=False, capture_output=True, timeout=options.siconos_limit)
            said, complaint = done.stdout, done.stderr
        except subprocess.TimeoutExpired as late:  # what had been solved by then counts
            said = late.stdout or b""
        lines = said.decode(errors="replace").splitlines()
        rows = [json.loads(line.removeprefix("ROW ")) for line in lines if line.startswith("ROW ")]
        if not rows and complaint:
            raise SolverError(
                complaint.decode(errors="replace").splitlines()[-1], where=f"Siconos on {path.stem}"
            )
        return rows

    def _check(self) -> None:
        python = self._options.siconos_python
        asked = [python, "-c", "import scipy.sparse, siconos.numerics"]
        try:
            found = subprocess.run(asked, check=False, capture_output=True).returncode == 0
        except OSError:
            raise UsageError("no such interpreter", where=f"--siconos-python {python}") from None
        if not found:
            remedy = "on Debian and Ubuntu, apt-get install python3-siconos python3-scipy"
            raise MissingLibraryError("siconos.numerics cannot be imported", where=python, remedy=remedy)


# --- problems of rigid scenes, written as stored ones ---


def _write_own_problems(folder: Path) -> None:
    """Write one .npz for each, named after the scene, the tilt and the step."""
    scenes = {scene.name: scene for scene in rigid_scenes()}
    for name, tilt, step in _PROBLEMS:
        _write(_problem(scenes[name], tilt, step), folder / f"{name} at {tilt:.0f}°, step {step}.npz")


def _problem(scene: BlockScene, tilt: float, step: int) -> ContactProblem:
    engine = engine_scene(scene, 1e-3, 0.5, 1e-6, 2000)
    g, angle = scene.gravity, np.radians(tilt)
    tilted = replace(engine, gravity=(float(g * np.sin(angle)), 0.0, float(-g * np.cos(angle))))
    simulation = Simulation(*build_model(tilted))
    for _ in range(step - 1):
        simulation.step()
    return simulation.step().problem


def _write(problem: ContactProblem, path: Path) -> None:
    """Write W in block-sparse rows, q with the bias in it, and μ."""
    form = problem.delassus.form
    assert form is not None
    lift, mass = form.lift, form.inertia  # type: ignore[attr-defined]
    # six unknowns of each body stand together
    blocks = [
        np.linalg.inv(mass[6 * k : 6 * k + 6, 6 * k : 6 * k + 6].toarray()) for k in range(mass.shape[0] // 6)
    ]
    w = bsr_array(lift.T @ block_diag(blocks, format="csc") @ lift, blocksize=(3, 3))
    w.sort_indices()
    np.savez(
        path,
        data=w.data,
        indices=w.indices,
        indptr=w.indptr,
        q=problem.biased.ravel(),
        mu=problem.friction,
        nc=len(problem.friction),
    )


if __name__ == "__main__":
    guarded(main)
