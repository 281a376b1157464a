"""One stage of a benchmark in a process of its own, on one core unless more threads are asked for."""

import json
import os
import subprocess
import sys
from pathlib import Path

from benchmarks.report import Row
from moma.errors import MomaError

__all__ = ["run_child"]

_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def run_child(module: str, *arguments: object, where: str, error: type[MomaError], threads: int = 1) -> Row:
    """The row that a module prints as JSON in its last line.

    Parameters
    ----------
    module : run as ``python -m``
    arguments : on its command line
    where, error : of the complaint, if it fails
    threads : that numba and BLAS may use

    Raises
    ------
    MomaError
        as `error`, with the last line of what it said
    """
    done = subprocess.run(
        [sys.executable, "-m", module, *map(str, arguments)],
        cwd=Path(__file__).resolve().parents[1],
        env=os.environ | dict.fromkeys(_THREADS, str(threads)),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        said = done.stderr.strip().splitlines()
        raise error(said[-1] if said else "no word", where=where)
    row: Row = json.loads(done.stdout.splitlines()[-1])
    return row
