"""The runs of a study of speed against accuracy: processes that are begun, awaited, stopped, and never left behind."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

from mechanics.dynamics.progress import Listener, Progress
from pipelines.results.quantities import quantities_from
from pipelines.tradeoff.forecast import Choice, Forecast, next_run
from pipelines.tradeoff.grid import Setting
from pipelines.tradeoff.pareto import models_of_interest
from pipelines.tradeoff.store import Measured, Status, Store
from pipelines.tradeoff.worker import FAILED, Job
from pipelines.tuning.overlay import overlay_record

__all__ = ["Limits", "carry_out"]

_PAUSE = 0.02  # seconds between two looks at the processes
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Limits:
    """What a study may take.

    Attributes
    ----------
    budget : time of all runs, those of earlier calls included [s]
    jobs : runs at a time
    memory : of one run [bytes]
    quantity : that the study is after; variants of models that are on its front are run
    threads : of one run, as its scene says
    """

    budget: float
    jobs: int
    memory: float
    quantity: str
    threads: int = 1


def carry_out(
    job: Job, settings: Sequence[Setting], store: Store, limits: Limits, progress: Listener
) -> tuple[Forecast, float]:
    """Run what fits into the budget and has not been run; what is known then, and the time that is left of it [s].

    Every run is kept in the store as soon as it has ended. Whatever ends this function ends its runs.
    """
    by_name = {one.name: one for one in settings}
    # a name may have come to mean another setting, as that of a profile
    ended = {
        name: run
        for name, run in store.load().items()
        if name in by_name and run.overlay == by_name[name].overlay
    }
    end = time.monotonic() + limits.budget - sum(run.elapsed for run in ended.values()) / limits.jobs
    with _Runs(job, limits) as runs:
        while True:
            left = end - time.monotonic()
            while len(runs.names) < limits.jobs and (choice := _next(by_name, ended, runs, left, limits)):
                runs.begin(choice)
                progress(Progress("trade", len(ended), len(by_name), choice.setting.name))
            if not runs.names:
                return Forecast(by_name, ended), left
            for run in runs.collect():
                store.keep(run)
                ended[run.name] = run
                progress(Progress("trade", len(ended), len(by_name), _told(run)))
            time.sleep(_PAUSE)


def _next(
    settings: Mapping[str, Setting],
    ended: Mapping[str, Measured],
    runs: "_Runs",
    left: float,
    limits: Limits,
) -> Choice | None:
    # what was stopped is tried again when there is more time than there was then
    over = {
        name for name, run in ended.items() if run.status is not Status.STOPPED or run.budget >= limits.budget
    }
    memory, forecast = limits.memory / limits.jobs, Forecast(settings, ended)
    worth = models_of_interest(settings, ended, limits.quantity)
    return next_run(forecast, {*over, *runs.names}, worth, left, limits.budget, memory)


def _told(run: Measured) -> str:
    return f"{run.name}: {f'{run.cpu:.1f} s' if run.status is Status.DONE else run.status}"


@dataclass
class _Run:
    """A process at work."""

    choice: Choice
    process: "subprocess.Popen[bytes]"
    answer: IO[bytes]
    complaint: IO[bytes]
    begun: float

    def stop(self) -> None:
        """End it at once if it has not ended, and close all that was open for it."""
        self.process.kill()
        self.process.wait()
        if self.process.stdin is not None:
            self.process.stdin.close()
        self.answer.close()
        self.complaint.close()


class _Runs:
    """Processes at work; to be used as a context, at whose end none is left.

    Parameters
    ----------
    job : what they share; each gets its overlay
    limits : of the study
    """

    def __init__(self, job: Job, limits: Limits) -> None:
        self._job, self._limits = job, limits
        self._runs: list[_Run] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for run in self._runs:
            run.stop()
        self._runs.clear()

    @property
    def names(self) -> tuple[str, ...]:
        """Of the settings that are being run."""
        return tuple(run.choice.setting.name for run in self._runs)

    def begin(self, choice: Choice) -> None:
        """Start a process."""
        # closed by _Run.close; files, since pipes that nobody reads would make it wait
        answer, complaint = tempfile.TemporaryFile(), tempfile.TemporaryFile()  # noqa: SIM115
        process = subprocess.Popen(
            [sys.executable, "-m", "pipelines.tradeoff.worker"],
            stdin=subprocess.PIPE,
            stdout=answer,
            stderr=complaint,
            env=self._environment(),
            start_new_session=True,  # Ctrl-C is told to us alone, and we end it
        )
        self._runs.append(_Run(choice, process, answer, complaint, time.monotonic()))
        asked = asdict(self._job) | {
            "overlay": overlay_record(choice.setting.overlay),
            "parent": os.getpid(),
        }
        assert process.stdin is not None
        try:
            process.stdin.write(json.dumps(asked).encode() + b"\n")
            process.stdin.flush()
        except BrokenPipeError:
            return  # it ended already; its exit code will say so

    def collect(self) -> list[Measured]:
        """Those that have ended since, or that have to be stopped now."""
        over = []
        for run in tuple(self._runs):
            elapsed = time.monotonic() - run.begun
            if run.process.poll() is not None:
                ending = _ending(run)
            elif elapsed > run.choice.limit:
                ending = {
                    "status": Status.STOPPED,
                    "reason": f"stopped after {elapsed:.0f} s",
                    "wall": elapsed,
                }
            else:
                continue
            run.stop()
            self._runs.remove(run)
            setting = run.choice.setting
            over.append(
                Measured(setting.name, setting.overlay, elapsed=elapsed, budget=self._limits.budget, **ending)
            )
        return over

    def _environment(self) -> dict[str, str]:
        root = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
        return os.environ | dict.fromkeys(_THREADS, str(self._limits.threads)) | {"PYTHONPATH": path}


def _ending(run: _Run) -> dict[str, Any]:
    """How a process ended by itself, and what it said."""
    code, said, complaint = run.process.returncode, _text(run.answer), _text(run.complaint)
    try:
        answer: dict[str, Any] = json.loads(said)
    except ValueError:
        answer = {}
    if code == 0 and "quantities" in answer:
        return answer | {"status": Status.DONE, "quantities": quantities_from(answer["quantities"])}
    known = answer.get("reason") if code == FAILED else None
    return {"status": Status.FAILED, "reason": known or _last_words(complaint, code)}


def _text(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode("utf-8", errors="replace")


def _last_words(complaint: str, code: int) -> str:
    if code < 0:
        name = signal.Signals(-code).name
        return f"killed by {name}" + (", maybe for its memory" if code == -signal.SIGKILL else "")
    lines = [line.strip() for line in complaint.splitlines() if line.strip()]
    return lines[-1] if lines else f"ended with code {code}"
