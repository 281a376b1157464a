"""Moving walls, MOMA beside LMGC90: `python -m benchmarks.moving [--lmgc90-python PYTHON] [--write] [--json]`.

Walls in running bond are shaken in plane and out of plane with 0.3 g at 5 Hz, and tilted by 0.2 g. Both programs see
the motion from the support, which stays where it is: gravity -g e_z - a(t), the same in each step, taken in its
middle. Every run is a process of its own with one thread, the two programs in turns; `--write` puts the table into
benchmarks/README.md, which says what its columns mean.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.generated import rigid_scenes
from benchmarks.report import (
    Row,
    Table,
    commit,
    environment,
    guarded,
    machine,
    print_json,
    table_lines,
    write_between,
)
from benchmarks.runs import lmgc90_program, moma_program, run_side
from benchmarks.scenes import BlockScene, write_scene
from benchmarks.trace import Trace
from mechanics.arrays import Array
from moma.errors import UsageError

__all__ = ["main"]

_TABLE: Table = (
    ("wall", "wall", ""),
    ("motion", "motion", ""),
    ("run", "run", ""),
    ("steps", "steps", "d"),
    ("contacts", "contacts", "d"),
    ("median", "median ms", ".3g"),
    ("mean", "mean ms", ".3g"),
    ("worst", "worst ms", ".3g"),
    ("spread", "worst / median", ".1f"),
    ("ratio_median", "median of LMGC90's", ".2f"),
    ("ratio_mean", "mean of LMGC90's", ".2f"),
    ("unsolved", "unsolved", "d"),
    ("compliant", "compliant", "d"),
    ("error", "error m", ".1e"),
)
_STEP = 1e-3  # h [s]
_THETA = 0.5  # θ of both programs; gravity is taken in the middle of a step
_GRAVITY = 9.81  # [m/s²], LMGC90's
_SHAKING = 0.3 * _GRAVITY  # amplitude of the acceleration of the support [m/s²]
_FREQUENCY = 5.0  # of the shaking [Hz]
_TILT = 0.2 * _GRAVITY  # constant acceleration in plane [m/s²]
# bricks in a course, and as many courses, with the number of steps that is timed
_STEPS = {10: 100, 20: 60}
_SHIPPED_STEPS = 20  # of LMGC90 as shipped, which takes up to some ten times as long
_ITERATIONS = 2000  # largest number in one step of ours, the engine's default
_FINEST = (
    "1e-10",
    "1e-8",
)  # tolerance and velocity tolerance of the run that errors are measured against [-]
_FINEST_ITERATIONS = 20000  # the finest run may take as many in each step
_DEFAULT = "1e-6"  # the engine's default tolerance [-]
# errors of the motion that we ask for, loosest first, until ours is at most LMGC90's [m]
_MOTION_ERRORS = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6)


def main() -> None:
    """Run the scenes and print."""
    options, measured = _options(), commit()
    walls = {wall.name: wall for wall in rigid_scenes() if wall.name.startswith("wall_")}
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            row
            for size in options.sizes
            for motion in options.motions
            for row in _Moving(walls[f"wall_{size}x{size}"], motion, size, options, Path(folder)).rows()
        ]
    if options.json:
        print_json(rows)
        return
    lines = [
        f"Measured at {measured}: {machine()}; {', '.join(sorted({row['program'] for row in rows}))}, "
        f"{environment('numba', 'numpy')}; h = {_STEP} s, θ = {_THETA}.",
        "",
        *table_lines(rows, _TABLE),
    ]
    print("\n".join(lines))
    if options.write:
        write_between("moving", lines)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.moving", description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[*_STEPS], choices=[*_STEPS], help="bricks")
    parser.add_argument("--motions", nargs="+", default=[*_MOTIONS], choices=[*_MOTIONS])
    parser.add_argument("--steps", type=int, help="time steps of each run (100 of 10 × 10, 60 of 20 × 20)")
    parser.add_argument(
        "--shipped-steps",
        type=int,
        default=_SHIPPED_STEPS,
        help=f"steps of LMGC90 as shipped ({_SHIPPED_STEPS}); 0 leaves it out",
    )
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each row")
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    parser.add_argument(
        "--lmgc90-python", default=sys.executable, help="interpreter that has compas_lmgc90 (this one)"
    )
    parser.add_argument("--ours-only", action="store_true", help="leave LMGC90 out")
    options = parser.parse_args()
    if options.steps is not None and options.steps < 2:
        raise UsageError(f"{options.steps} steps", where="--steps", remedy="give 2 or more")
    return options


def _sine(time: Array) -> Array:
    return _SHAKING * np.sin(2 * np.pi * _FREQUENCY * time)


# acceleration of the support, felt as gravity the other way, by component: x along the wall, y across it
_MOTIONS: dict[str, tuple[int, Callable[[Array], Array]]] = {
    "in plane": (0, _sine),
    "out of plane": (1, _sine),
    "tilted": (0, lambda time: np.full_like(time, _TILT)),
}


def gravity_of(motion: str, steps: int) -> Array:
    """Gravity (steps, 3) in the middle of each step, in the frame of the support [m/s²]."""
    component, acceleration = _MOTIONS[motion]
    gravity = np.tile([0.0, 0.0, -_GRAVITY], (steps, 1))
    middle: Array = _STEP * np.arange(0.5, steps)
    gravity[:, component] -= acceleration(middle)
    return gravity


class _Moving:
    """One wall in one motion: our runs, LMGC90's, and the finest one."""

    def __init__(
        self, wall: BlockScene, motion: str, size: int, options: argparse.Namespace, folder: Path
    ) -> None:
        self._wall, self._motion, self._options = wall, motion, options
        self._steps = options.steps or _STEPS[size]
        self._path, self._gravity = folder / f"{wall.name}.npz", folder / "gravity.npy"
        write_scene(wall, self._path)
        np.save(self._gravity, gravity_of(motion, self._steps))

    def rows(self) -> Iterator[Row]:
        """Our row at the default, LMGC90's, ours at its accuracy, and LMGC90's as shipped."""
        tolerance, velocity = _FINEST
        finest = self._moma(tolerance, "--velocity-tolerance", velocity, iterations=_FINEST_ITERATIONS)
        default = self._moma(_DEFAULT)
        theirs = None if self._options.ours_only else self._lmgc90(self._steps, "--relaxation", "1")
        goal = np.inf if theirs is None else _error(theirs, finest)
        for asked in _MOTION_ERRORS:
            matched = self._moma(_DEFAULT, "--motion-error", repr(asked))
            if exact := _error(matched, finest) <= goal:
                break
        yield self._row("finest", finest, finest, theirs)
        yield self._row("default", default, finest, theirs)
        label = f"motion_error = {asked:g} m" + ("" if exact else ", less exact")
        yield self._row(label, matched, finest, theirs)
        if theirs is not None:
            yield self._row("LMGC90, relaxation 1", theirs, finest, theirs)
            few = min(self._steps, self._options.shipped_steps)
            if few > 0:
                yield self._row("LMGC90 as shipped", self._lmgc90(few), finest, theirs)

    def _moma(self, tolerance: str, *more: str, iterations: int = _ITERATIONS) -> Trace:
        limits = ("--tolerance", tolerance, "--sweeps", str(iterations))
        return run_side("MOMA", moma_program(), self._path, [*self._common(self._steps), *limits, *more])

    def _lmgc90(self, steps: int, *more: str) -> Trace:
        program = lmgc90_program(self._options.lmgc90_python)
        return run_side("LMGC90", program, self._path, [*self._common(steps), *more])

    def _common(self, steps: int) -> list[str]:
        # no contacts are kept, as no judge looks at these runs
        times = ["--steps", str(steps), "--keep", "0", "--step", repr(_STEP), "--theta", repr(_THETA)]
        return [*times, "--gravity", str(self._gravity)]

    def _row(self, run: str, trace: Trace, finest: Trace, theirs: Trace | None) -> Row:
        steps, cpu = len(trace.cpu), 1e3 * trace.cpu
        row: Row = {
            "wall": self._wall.name,
            "motion": self._motion,
            "run": run,
            "steps": steps,
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
            "program": trace.program,
        }
        if theirs is not None:
            same = 1e3 * theirs.cpu[:steps]
            row["ratio_median"] = row["median"] / float(np.median(same))
            row["ratio_mean"] = row["mean"] / float(same.mean())
        return row


def _error(trace: Trace, finest: Trace) -> float:
    """Largest distance of a body's displacement from that of the finest run at the end of the shorter one [m]."""
    last = len(trace.cpu)
    moved = (one.centre[last] - one.centre[0] for one in (trace, finest))
    difference = next(moved) - next(moved)
    return float(np.linalg.norm(difference, axis=1).max())


if __name__ == "__main__":
    guarded(main)
