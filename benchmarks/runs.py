"""One run of one program on one scene, in a process of its own with one thread."""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.judge import Judge, Verdict
from benchmarks.report import Row, progress
from benchmarks.scenes import read_scene
from benchmarks.trace import Trace, read_trace
from moma.errors import MissingLibraryError, SolverError, UsageError

__all__ = ["Run", "Runner", "fastest", "figures", "lmgc90_program", "moma_program", "run_side"]

_INSTALL = (
    "pip install compas_lmgc90, or name an interpreter that has it with --lmgc90-python, or use --ours-only"
)


@dataclass(frozen=True)
class Run:
    """One side of a scene.

    Attributes
    ----------
    first, step, total : processor time of the first step, median of the settled ones, and of all [s]
    sweeps_first, sweeps : of the first step, median of the settled ones
    verdict : how exact it was; None if only times were asked for
    program : its name and version
    """

    first: float
    step: float
    total: float
    sweeps_first: int
    sweeps: float
    verdict: Verdict | None
    program: str


class Runner:
    """Runs either program on a scene, and has it judged.

    Parameters
    ----------
    path : the scene
    options : of benchmarks.lmgc90
    """

    def __init__(self, path: Path, options: argparse.Namespace) -> None:
        self._path, self._options = path, options
        self.scene = read_scene(path)
        self.judge = Judge(self.scene, options.step, options.theta)

    def moma(self, tolerance: float, fresh: bool = False) -> Run:
        """Ours, to a tolerance of η; `fresh`: with detection in every step."""
        options = self._options
        more = ["--tolerance", repr(tolerance), "--sweeps", str(options.sweeps)]
        more += ["--fresh"] if fresh else []
        return self._run(self._child(moma_program(), more, "MOMA"))

    def lmgc90(self, relaxation: float | None = None) -> Run:
        """LMGC90 as its package drives it; or times alone, with another relaxation."""
        more = [] if relaxation is None else ["--relaxation", repr(relaxation)]
        return self._run(self._child(lmgc90_program(self._options.lmgc90_python), more, "LMGC90"))

    def _child(self, program: list[str], more: list[str], name: str) -> Trace:
        """Run one side in its own process, single-threaded."""
        options = self._options
        common = ["--steps", str(options.steps), "--keep", str(min(options.settled, options.steps - 1))]
        common += ["--step", repr(options.step), "--theta", repr(options.theta)]
        return run_side(name, program, self._path, common + more)

    def _run(self, trace: Trace) -> Run:
        settled = min(self._options.settled, len(trace.cpu) - 1)
        return Run(
            first=float(trace.cpu[0]),
            step=float(np.median(trace.cpu[-settled:])),
            total=float(trace.cpu.sum()),
            sweeps_first=int(trace.sweeps[0]),
            sweeps=float(np.median(trace.sweeps[-settled:])),
            verdict=self.judge(trace) if trace.kept else None,
            program=trace.program,
        )


def moma_program() -> list[str]:
    """How a child of ours begins its command line."""
    return [sys.executable, "-m", "benchmarks.moma_child"]


def lmgc90_program(python: str) -> list[str]:
    """How LMGC90's child begins its command line, with an interpreter that has the package."""
    return [_with_package(python), str(Path(__file__).with_name("lmgc90_child.py"))]


def run_side(name: str, program: list[str], scene: Path, options: list[str]) -> Trace:
    """Run one program on a scene in a process of its own with one thread; return what it leaves.

    Raises
    ------
    SolverError : if it leaves nothing
    """
    progress(f"{scene.stem}: {name} {' '.join(options)}")
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "trace.npz"
        done = subprocess.run(
            [*program, str(scene.resolve()), str(out), *options],
            cwd=Path(__file__).resolve().parents[1],
            env=os.environ | _single_threaded(),
            capture_output=True,
            text=True,
            check=False,
        )
        if not out.exists():
            said = (done.stderr or done.stdout).strip().splitlines()
            raise SolverError(
                f"{name} ended with code {done.returncode}: {said[-1] if said else 'no word'}",
                where=scene.stem,
            )
        return read_trace(out)


def figures(run: Run | None) -> Row:
    """What a row says of one side; the same keys whether it ran or not."""
    keys = [key for key in Verdict.__dataclass_fields__ if key != "contacts"]
    exact = asdict(run.verdict) if run and run.verdict else {}
    figures: Row = {
        key: getattr(run, key) if run else None
        for key in ("step", "first", "total", "sweeps", "sweeps_first")
    }
    return figures | {key: exact.get(key) for key in keys}


def fastest(one: Run, other: Run) -> Run:
    """The same work done twice: the smaller times are less disturbed by the rest of the machine."""
    return replace(
        one,
        first=min(one.first, other.first),
        step=min(one.step, other.step),
        total=min(one.total, other.total),
    )


def _single_threaded() -> dict[str, str]:
    names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return dict.fromkeys(names, "1")


def _with_package(python: str) -> str:
    """The interpreter's own path, once it is sure that it has the package."""
    found = shutil.which(python)
    if found is None:
        raise UsageError("no such interpreter", where=f"--lmgc90-python {python}")
    asked = "import sys, importlib.util as u; sys.exit(0 if u.find_spec('compas_lmgc90') else 1)"
    if subprocess.run([found, "-c", asked], check=False, capture_output=True).returncode:
        raise MissingLibraryError("compas_lmgc90 is not installed", where=python, remedy=_INSTALL)
    # not resolved: a virtual environment's interpreter is a link
    return str(Path(found).absolute())
