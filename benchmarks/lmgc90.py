"""MOMA and LMGC90 side by side: `python -m benchmarks.lmgc90 [--scenes DIR] [--moving] [--write] [--json]`.

Same blocks, friction, law (gap Signorini and Coulomb, inelastic), time step and θ; every run is a process of its own
with one thread, the two programs in turns. Scenes come to rest, or with `--moving` walls are shaken and tilted. Without
`--scenes` they are made on the way; `--write` puts the tables into benchmarks/README.md, which says what their columns
mean.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.judge import Judge, Trace, read_trace
from benchmarks.report import (
    Row,
    alone,
    columns,
    commit,
    environment,
    guarded,
    machine,
    one_thread,
    options_of,
    print_json,
    progress,
    table_lines,
    write_between,
)
from benchmarks.scenes import engine_scene, list_scenes, read_scene, rigid_scenes, write_scene
from ground.errors import MissingLibraryError, SolverError, UsageError
from mechanics.arrays import Array
from mechanics.contact.contacts import gaps, material_points
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.model.model import build_model
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Scene

_STEP, _THETA = 1e-3, 0.5  # h [s] and θ of both programs
_SETTLED = 20  # steps at the end that count as settled
_SWEEPS = 20_000  # largest number of our iterations in a step

_TIMES = columns(
    "scene scene | setting setting | contacts contacts :d | contacts_theirs LMGC90's :d | "
    "ours_step_ms step ms :.3g | theirs_step_ms LMGC90 :.3g | ratio_step ratio :.1f | "
    "ratio_step_fresh with detection :.1f | ours_first_ms first ms :.3g | theirs_first_ms LMGC90 :.3g | "
    "ratio_first ratio :.1f | ratio_total ratio of all :.1f | ours_sweeps iterations :.0f | "
    "theirs_sweeps LMGC90 :.0f | ours_sweeps_first first :d | theirs_sweeps_first LMGC90 :d"
)
_RELAXED = columns(
    "theirs_step_relaxed_ms LMGC90 relaxed: step ms :.3g | theirs_first_relaxed_ms first ms :.3g"
)
_EXACT = columns(
    "scene scene | setting setting | tolerance tolerance :.0e | ours_eta η :.0e | theirs_eta LMGC90 :.0e | "
    "ours_penetration penetration :.0e | theirs_penetration LMGC90 :.0e | ours_drift drift m/s :.0e | "
    "theirs_drift LMGC90 :.0e | ours_displacement moved m :.0e | theirs_displacement LMGC90 :.0e | "
    "ours_balance balance :.0e | theirs_balance LMGC90 :.0e | ours_reaction reaction :.0e | "
    "theirs_reaction LMGC90 :.0e"
)
_MOVING = columns(
    "wall wall | motion motion | run run | steps steps :d | contacts contacts :d | median median ms :.3g | "
    "mean mean ms :.3g | worst worst ms :.3g | spread worst / median :.1f | "
    "ratio_median median of LMGC90's :.2f | ratio_mean mean of LMGC90's :.2f | unsolved unsolved :d | "
    "compliant compliant :d | error error m :.1e"
)
# in these the run at the same accuracy must be no worse than LMGC90's
_MATCHED = ("eta", "penetration", "drift", "balance")
_TIGHTER, _ACCURATE = 10**0.5, 1e-9

_GRAVITY = 9.81  # [m/s²], LMGC90's
_SHAKING, _FREQUENCY = (
    0.3 * _GRAVITY,
    5.0,
)  # amplitude of the acceleration of the support [m/s²], and its frequency [Hz]
_TILT = 0.2 * _GRAVITY  # constant acceleration in plane [m/s²]
# moving walls, with the number of steps that is timed
_WALLS = {"wall_10x10": 100, "wall_20x20": 60}
_SHIPPED_STEPS = 20  # of LMGC90 as shipped, which takes up to some ten times as long
# the run that errors are measured against, and our default: tolerances [-] and iterations in a step
_FINEST = {"tolerance": 1e-10, "velocity_tolerance": 1e-8, "sweeps": 20_000}
_DEFAULT = {"tolerance": 1e-6, "sweeps": 2000}
# errors of the motion that we ask for, loosest first, until ours is at most LMGC90's [m]
_MOTION_ERRORS = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6)


def main() -> None:
    """Run the scenes and print."""
    options, measured = _options(), commit()
    if options.steps is not None and options.steps < 2:
        raise UsageError(
            f"{options.steps} steps", where="--steps", remedy="give 2 or more: the first and a settled one"
        )
    if not options.ours_only:
        options.lmgc90_python = _with_package(options.lmgc90_python)
    with tempfile.TemporaryDirectory() as made:
        folder = Path(options.scenes or made)
        if options.scenes is None:
            for scene in rigid_scenes():
                write_scene(scene, folder / f"{scene.name}.npz")
        only = options.only or (list(_WALLS) if options.moving else [])
        run = _moved if options.moving else _settled
        rows = [row for path in list_scenes(folder, tuple(only)) for row in run(path, options)]
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    programs = ", ".join(sorted({name for row in rows for name in row["programs"]}))
    lines = [
        f"Measured at {measured}: {machine()}; {programs}, {environment('numba', 'numpy')}; "
        f"h = {_STEP} s, θ = {_THETA}.",
        "",
        *table_lines(rows, _MOVING if options.moving else (*_TIMES, *_RELAXED)),
    ]
    if not options.moving:
        lines += ["", *table_lines(rows, _EXACT)]
    print("\n".join(lines))
    if options.write:
        write_between("moving" if options.moving else "lmgc90", lines)


def _options() -> argparse.Namespace:
    parser = options_of("lmgc90", __doc__)
    parser.add_argument("--scenes", help="folder with .npz scenes (made on the way)")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these scenes alone")
    parser.add_argument("--write", action="store_true", help="put the tables into benchmarks/README.md")
    parser.add_argument("--steps", type=int, help="time steps of each run (60; moving walls 100 and 60)")
    parser.add_argument("--repeats", type=int, default=1, help="runs of each side, the fastest counts (1)")
    parser.add_argument("--tolerance", type=float, help="η of our steps; else as exact as LMGC90's or more")
    parser.add_argument("--accurate", action="store_true", help=f"one more row each, with η ≤ {_ACCURATE:g}")
    parser.add_argument(
        "--relaxation", type=float, default=1.0, help="time LMGC90 with this relaxation too (1; package: 0.1)"
    )
    parser.add_argument("--moving", action="store_true", help="shake and tilt walls")
    parser.add_argument("--motions", nargs="+", default=[*_MOTIONS], choices=[*_MOTIONS])
    parser.add_argument(
        "--shipped-steps", type=int, default=_SHIPPED_STEPS, help="of LMGC90 as shipped, moving (20; 0: none)"
    )
    parser.add_argument("--lmgc90-python", default=sys.executable, help="interpreter that has compas_lmgc90")
    parser.add_argument("--ours-only", action="store_true", help="leave LMGC90 out")
    return parser.parse_args()


def _with_package(python: str) -> str:
    """Return the interpreter's own path, once it is sure that it has the package."""
    found = shutil.which(python)
    if found is None:
        raise UsageError("no such interpreter", where=f"--lmgc90-python {python}")
    asked = "import sys, importlib.util as u; sys.exit(0 if u.find_spec('compas_lmgc90') else 1)"
    if subprocess.run([found, "-c", asked], check=False, capture_output=True).returncode:
        raise MissingLibraryError(
            "compas_lmgc90 is not installed",
            where=python,
            remedy="pip install compas_lmgc90, or name an interpreter that has it with --lmgc90-python, "
            "or use --ours-only",
        )
    # not resolved: a virtual environment's interpreter is a link
    return str(Path(found).absolute())


# --- one run of one program, in a process of its own with one thread ---


def traced(scene: Path, **settings: Any) -> Trace:
    """Run MOMA on a scene; see `run_moma` for the settings."""
    progress(f"{scene.stem}: MOMA {settings}")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "trace.npz"
        alone(run_moma, str(scene.resolve()), str(out), settings)
        return read_trace(out)


def _lmgc90(python: str, scene: Path, **settings: Any) -> Trace:
    """Run LMGC90 on a scene; see benchmarks/lmgc90_child.py for the settings."""
    progress(f"{scene.stem}: LMGC90 {settings}")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "trace.npz"
        child = Path(__file__).with_name("lmgc90_child.py")
        done = subprocess.run(
            [python, str(child), str(scene.resolve()), str(out), json.dumps(settings)],
            env=one_thread(),
            capture_output=True,
            text=True,
            check=False,
        )
        if not out.exists():
            said = (done.stderr or done.stdout).strip().splitlines()
            raise SolverError(
                f"LMGC90 ended with code {done.returncode}: {said[-1] if said else 'no word'}",
                where=scene.stem,
            )
        return read_trace(out)


def run_moma(path: str, out: str, settings: Row) -> Row:
    """Run MOMA on a scene once untimed, then again; leave times, motion, and the contacts of some steps in a file.

    Settings: `steps`, and `keep`, how many of the last are kept; `tolerance`, `velocity_tolerance`, `sweeps`,
    `motion_error` as of the engine; `gravity`, a .npy (steps, 3) [m/s²]; `fresh`, contacts found anew in every step.
    """
    steps = settings["steps"]
    scene = engine_scene(
        read_scene(Path(path)), _STEP, _THETA, settings["tolerance"], settings.get("sweeps", _SWEEPS)
    )
    solver = replace(scene.solver, motion_error=settings.get("motion_error"))
    if "velocity_tolerance" in settings:
        solver = replace(solver, velocity_tolerance=settings["velocity_tolerance"])
    scene = replace(scene, time=replace(scene.time, duration=steps * _STEP), solver=solver)
    if "gravity" in settings:
        scene = replace(scene, loads=Loads((_GravityOfSteps(np.load(settings["gravity"]), _STEP),)))
    trace: Row = {}
    for _ in range(2):  # every kernel that any step needs is compiled, or loaded, before the clock runs
        trace = _run(scene, steps, settings.get("keep", 0), settings.get("fresh", False))
    np.savez(out, **trace)
    return {}


def _run(scene: Scene, steps: int, keep: int, fresh: bool) -> Row:
    simulation = Simulation(*build_model(scene), fresh_contacts=fresh)
    states = [simulation.state]
    kept: dict[int, Row] = {}
    told: Row = {"cpu": [], "sweeps": [], "contacts": [], "solved": [], "compliant": []}
    for n in range(1, steps + 1):
        start = time.process_time()
        step = simulation.step()
        told["cpu"].append(time.process_time() - start)
        told["sweeps"].append(step.solution.iterations)
        told["contacts"].append(len(step.contacts.key))
        told["solved"].append(step.solution.converged)
        told["compliant"].append(step.problem.delassus.joint_compliance is not None)
        states.append(step.after)
        if keep and (n == 1 or n > steps - keep):
            kept[n] = _contacts(step)
    return told | {
        "program": f"moma-masonry {version('moma-masonry')}",
        "centre": [state.centre for state in states],
        "frame": [state.rotation.transpose(0, 2, 1) for state in states],
        "kept": list(kept),
        **{f"{key}_{n}": value for n, contacts in kept.items() for key, value in contacts.items()},
    }


def _contacts(step: Step) -> Row:
    return {
        "body": step.contacts.bodies,
        "point": material_points(step.contacts, step.predicted).mean(axis=1),
        "frame": step.contacts.frame,
        "gap": gaps(step.contacts, step.predicted),
        "force": step.impulse / _STEP,
    }


@dataclass(frozen=True)
class _GravityOfSteps:
    """Gravity given step by step.

    Attributes
    ----------
    values : (n, 3) in the middle of each step [m/s²]
    step : h [s]
    """

    values: Array
    step: float
    course = None

    @property
    def until(self) -> float:
        """End of the table [s]."""
        return len(self.values) * self.step

    def __call__(self, time: float, gravity: Array) -> Array:
        """Return gravity (3,) in the step that contains `time` [m/s²]; that of the scene does not count."""
        row: Array = self.values[min(int(time / self.step), len(self.values) - 1)]
        return row


# --- scenes that come to rest ---


def _settled(path: Path, options: argparse.Namespace) -> Iterator[Row]:
    """Yield one row of a scene, and one more for the accurate setting."""
    steps = options.steps or 60
    keep = min(_SETTLED, steps - 1)
    judge = Judge(read_scene(path), _STEP, _THETA)

    def moma(tolerance: float, **more: Any) -> Trace:
        return traced(path, steps=steps, keep=keep, tolerance=tolerance, **more)

    def lmgc90(**more: Any) -> Trace:
        return _lmgc90(options.lmgc90_python, path, steps=steps, keep=keep, step=_STEP, theta=_THETA, **more)

    theirs = None if options.ours_only else lmgc90()
    tolerance, ours = options.tolerance or 1e-4, None
    if options.tolerance is None and theirs is not None:
        tolerance, ours = _matched(path.stem, moma, judge, theirs)
    ours = ours or moma(tolerance)
    for _ in range(options.repeats - 1):
        theirs = None if theirs is None else _fastest(theirs, lmgc90())
        ours = _fastest(ours, moma(tolerance))
    relaxed = None if theirs is None else lmgc90(relaxation=options.relaxation)
    settings = [("same accuracy" if theirs else "given", tolerance, ours)]
    if options.accurate:
        settings.append(("accurate", _ACCURATE, moma(_ACCURATE)))
    for setting, asked, mine in settings:
        row: Row = {"scene": path.stem, "setting": setting, "tolerance": asked, "size": judge.size}
        for side, trace in (("ours", mine), ("theirs", theirs)):
            row |= {f"{side}_{key}": value for key, value in _figures(trace, judge).items()}
        fresh, slow = _figures(moma(asked, fresh=True), None), _figures(relaxed, None)
        row |= {
            "contacts": row["ours_contacts"],
            "contacts_theirs": row["theirs_contacts"],
            "ours_step_fresh": fresh["step"],
            "theirs_first_relaxed": slow["first"],
            "theirs_step_relaxed": slow["step"],
            "ratio_step_fresh": None if theirs is None else row["theirs_step"] / fresh["step"],
            "programs": [one.program for one in (mine, theirs) if one is not None],
        }
        for key in ("step", "first", "total"):
            row[f"ratio_{key}"] = None if theirs is None else row[f"theirs_{key}"] / row[f"ours_{key}"]
        for key in ("ours_step", "theirs_step", "ours_first", "theirs_first"):
            row[f"{key}_ms"] = None if row[key] is None else 1e3 * row[key]
        for key in ("step", "first"):
            seconds = row[f"theirs_{key}_relaxed"]
            row[f"theirs_{key}_relaxed_ms"] = None if seconds is None else 1e3 * seconds
        yield row


def _matched(name: str, moma: Callable[..., Trace], judge: Judge, theirs: Trace) -> tuple[float, Trace]:
    """Return the loosest tolerance, from LMGC90's η downwards, at which our run is nowhere less exact, and the run."""
    goal = judge(theirs)
    least = min(goal.eta_first, goal.eta)
    unit = 10.0 ** np.floor(np.log10(least))
    tolerance = float(np.floor(least / unit) * unit)
    while True:
        ours = moma(tolerance)
        found = judge(ours)
        worse = [key for key in _MATCHED if getattr(found, key) > getattr(goal, key)]
        if not worse or tolerance < _ACCURATE:
            return tolerance, ours
        progress(f"{name}: at η = {tolerance:.1e} less exact in {', '.join(worse)}")
        tolerance /= _TIGHTER


def _fastest(one: Trace, other: Trace) -> Trace:
    """Return the same work done twice: the smaller times are less disturbed by the rest of the machine."""
    return replace(one, cpu=np.minimum(one.cpu, other.cpu))


def _figures(trace: Trace | None, judge: Judge | None) -> Row:
    """Return what a row says of one side; the same keys whether it ran or not."""
    keys = [*Judge.MEASURES, "first", "step", "total", "sweeps_first", "sweeps"]
    if trace is None:
        return dict.fromkeys(keys)
    settled = min(_SETTLED, len(trace.cpu) - 1)
    return (asdict(judge(trace)) if judge else {}) | {
        "first": float(trace.cpu[0]),
        "step": float(np.median(trace.cpu[-settled:])),
        "total": float(trace.cpu.sum()),
        "sweeps_first": int(trace.sweeps[0]),
        "sweeps": float(np.median(trace.sweeps[-settled:])),
    }


# --- walls that move ---


def _sine(time: Array) -> Array:
    return _SHAKING * np.sin(2 * np.pi * _FREQUENCY * time)


# acceleration of the support, felt as gravity the other way, by component: x along the wall, y across it
_MOTIONS: dict[str, tuple[int, Callable[[Array], Array]]] = {
    "in plane": (0, _sine),
    "out of plane": (1, _sine),
    "tilted": (0, lambda time: np.full_like(time, _TILT)),
}


def gravity_of(motion: str, steps: int) -> Array:
    """Return gravity (steps, 3) in the middle of each step, in the frame of the support [m/s²]."""
    component, acceleration = _MOTIONS[motion]
    gravity = np.tile([0.0, 0.0, -_GRAVITY], (steps, 1))
    middle: Array = _STEP * np.arange(0.5, steps)
    gravity[:, component] -= acceleration(middle)
    return gravity


def _moved(path: Path, options: argparse.Namespace) -> Iterator[Row]:
    """Yield for each motion the finest row, ours at the default and at LMGC90's accuracy, and LMGC90's."""
    steps = options.steps or _WALLS.get(path.stem, min(_WALLS.values()))
    for motion in options.motions:
        with tempfile.TemporaryDirectory() as folder:
            gravity = str(Path(folder) / "gravity.npy")
            np.save(gravity, gravity_of(motion, steps))
            common: Row = {"steps": steps, "gravity": gravity}
            finest = traced(path, **common, **_FINEST)
            runs = {"finest": finest, "default": traced(path, **common, **_DEFAULT)}
            theirs = None
            python, times = options.lmgc90_python, {"step": _STEP, "theta": _THETA}
            if not options.ours_only:
                theirs = _lmgc90(python, path, **common, **times, relaxation=1.0)
            goal = np.inf if theirs is None else _error(theirs, finest)
            for asked in _MOTION_ERRORS:
                matched = traced(path, **common, **_DEFAULT, motion_error=asked)
                if exact := _error(matched, finest) <= goal:
                    break
            runs[f"motion_error = {asked:g} m" + ("" if exact else ", less exact")] = matched
            if theirs is not None:
                runs["LMGC90, relaxation 1"] = theirs
                if few := min(steps, options.shipped_steps):
                    runs["LMGC90 as shipped"] = _lmgc90(python, path, **(common | {"steps": few}), **times)
        for run, trace in runs.items():
            yield {"wall": path.stem, "motion": motion, "run": run} | _moving_row(trace, finest, theirs)


def _moving_row(trace: Trace, finest: Trace, theirs: Trace | None) -> Row:
    cpu = 1e3 * trace.cpu
    row: Row = {
        "steps": len(cpu),
        "contacts": int(trace.contacts[-1]),
        "median": float(np.median(cpu)),
        "mean": float(cpu.mean()),
        "worst": float(cpu.max()),
        "spread": float(cpu.max() / np.median(cpu)),
        "unsolved": int((~trace.solved).sum()),
        "compliant": int(trace.compliant.sum()),
        "error": None if trace is finest else _error(trace, finest),
        "ratio_median": None,
        "ratio_mean": None,
        "programs": [trace.program],
    }
    if theirs is not None:
        same = 1e3 * theirs.cpu[: len(cpu)]
        row["ratio_median"] = row["median"] / float(np.median(same))
        row["ratio_mean"] = row["mean"] / float(same.mean())
    return row


def _error(trace: Trace, finest: Trace) -> float:
    """Return how far a body is at most from where it is in the finest run, at the end of the shorter one [m]."""
    last = len(trace.cpu)
    moved = (one.centre[last] - one.centre[0] for one in (trace, finest))
    difference = next(moved) - next(moved)
    return float(np.linalg.norm(difference, axis=1).max())


if __name__ == "__main__":
    guarded(main)
