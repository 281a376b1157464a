"""One run of a tradeoff study in a process of its own: ``python -m pipelines.tradeoff.worker``.

A separate process has its own CPU time and memory, and can be stopped. The job is one line of JSON on the standard
input, which stays open as long as the parent lives; the answer is one line of JSON on the standard output.
"""

import ctypes
import json
import os
import signal
import sys
import threading
import time
from dataclasses import dataclass
from typing import Any

from archmodel.database.session import open_database
from ground.errors import MomaError
from mechanics.results.result import Result
from mechanics.simulate import simulate
from pipelines.results.quantities import quantities
from pipelines.run.assemble import assemble
from pipelines.scene.file import SceneFile, parse_scene
from pipelines.tradeoff.memory import peak_memory
from pipelines.tuning.overlay import overlaid, overlay_from

__all__ = ["FAILED", "SHORT", "Job"]

FAILED = 3
"""Exit code of a run that failed with a MomaError; the reason is on the standard output."""

SHORT = 5.0
"""CPU time below which work is done twice, since the first time includes loading compiled kernels [s]."""


@dataclass(frozen=True)
class Job:
    """Input of one run.

    Attributes
    ----------
    text, path : of the scene file; the path is for messages and for files beside it
    url : of the database
    overlay : settings that replace those of the scene, see `overlay_record`
    width : typical smallest width of the stones [m]
    """

    text: str
    path: str
    url: str
    overlay: dict[str, Any]
    width: float


def _measured(job: Job) -> dict[str, Any]:
    """Run the scene, twice if that is short, and return its cost and results."""
    program = peak_memory()
    scene = overlaid(parse_scene(job.text, job.path), overlay_from(job.overlay), job.width)
    for _ in range(2):
        cpu, wall = time.process_time(), time.perf_counter()
        result = _simulated(scene, job.url)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        if cpu > SHORT:
            break
    return {
        "cpu": cpu,
        "wall": wall,
        "memory": peak_memory(),
        "program_memory": program,
        "nodes": sum(len(body.reference) for body in result.bodies if body.element is not None),
        "contacts": len(result.contacts.gap),
        "steps": result.steps,
        "unconverged_steps": result.errors.unconverged_steps,
        "solver": next(iter(result.solvers), ""),
        "stages": dict(result.wall_time),
        "quantities": quantities(result).as_record(),
    }


def _simulated(scene: SceneFile, url: str) -> Result:
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        assembly = assemble(scene, session)
    return simulate(assembly.scene)


def _end_with_parent(parent: int) -> None:
    """End this process as soon as its parent has ended, for whatever reason."""
    if sys.platform.startswith("linux"):
        # the operating system does so at once, even within a long numba kernel, for which the thread below would wait
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() != parent:
            os._exit(1)
    threading.Thread(target=_await_end, daemon=True).start()


def _await_end() -> None:
    # the parent sends nothing more, so reading ends when its end of the pipe is closed
    while os.read(0, 1024):
        pass
    os._exit(1)


def _main() -> int:
    # unbuffered, since the rest is read by the watching thread
    with open(sys.stdin.fileno(), "rb", buffering=0, closefd=False) as channel:
        asked = json.loads(channel.readline())
    _end_with_parent(asked.pop("parent"))
    try:
        answer = _measured(Job(**asked))
    except MomaError as error:
        print(json.dumps({"reason": " ".join(str(error).split())}))
        return FAILED
    print(json.dumps(answer, allow_nan=False))
    return 0


if __name__ == "__main__":
    sys.exit(_main())
