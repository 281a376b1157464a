"""Runs of a tradeoff study: processes that are started, awaited, stopped, and never left behind."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any, Self

from mechanics.dynamics.progress import Listener, Progress
from pipelines.assess.workers.pool import Lost, Worker
from pipelines.tradeoff.forecast import Choice, Forecast, next_run
from pipelines.tradeoff.grid import Variant
from pipelines.tradeoff.pareto import models_of_interest
from pipelines.tradeoff.store import Measured, Status, Store
from pipelines.tradeoff.worker import Job, measured

_PAUSE = 0.02  # interval between polls of the processes [s]
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class Limits:
    """Limits of a study.

    Attributes
    ----------
    budget : time of all runs, including those of earlier calls [s]
    jobs : runs at a time
    memory : of one run [bytes]
    quantity : of the goal; variants of models on its front are run
    threads : of one run, from the scene
    """

    budget: float
    jobs: int
    memory: float
    quantity: str
    threads: int = 1


def carry_out(
    job: Job, settings: Sequence[Variant], store: Store, limits: Limits, progress: Listener
) -> tuple[Forecast, float]:
    """Run what fits into the budget and has not been run; return the forecast and the remaining time [s].

    Every run is kept in the store as soon as it has ended. Whatever ends this function ends its runs.
    """
    by_name = {setting.name: setting for setting in settings}
    # the meaning of a name may have changed, as that of a profile
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
            budget = f"{max(left, 0.0):.0f} s of the budget left"
            progress(Progress("trade", len(ended), len(by_name), ", ".join([budget, *runs.names])))
            if not runs.names:
                return Forecast(by_name, ended), left
            for run in runs.collect():
                store.keep(run)
                ended[run.name] = run
                progress(Progress("trade", len(ended), len(by_name), f"{budget}, {_described(run)}"))
            time.sleep(_PAUSE)


def _next(
    settings: Mapping[str, Variant],
    ended: Mapping[str, Measured],
    runs: "_Runs",
    left: float,
    limits: Limits,
) -> Choice | None:
    # a stopped run is tried again with a larger budget
    over = {
        name for name, run in ended.items() if run.status is not Status.STOPPED or run.budget >= limits.budget
    }
    memory, forecast = limits.memory / limits.jobs, Forecast(settings, ended)
    worth = models_of_interest(settings, ended, limits.quantity)
    return next_run(forecast, {*over, *runs.names}, worth, left, limits.budget, memory)


def _described(run: Measured) -> str:
    return f"{run.name}: {f'{run.cpu:.1f} s' if run.status is Status.DONE else run.status}"


@dataclass
class _Run:
    """A run that has begun, and its process."""

    choice: Choice
    worker: Worker
    begun: float


class _Runs:
    """Runs that have begun, each in a fresh process; a context manager that leaves none behind.

    Parameters
    ----------
    job : common to all; each gets its own overlay
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
            run.worker.end()
        self._runs.clear()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the settings that are being run."""
        return tuple(run.choice.setting.name for run in self._runs)

    def begin(self, choice: Choice) -> None:
        """Start a process."""
        begun = time.monotonic()
        worker = Worker(measured, dict.fromkeys(_THREADS, str(self._limits.threads)))
        self._runs.append(_Run(choice, worker, begun))
        worker.ask(replace(self._job, overlay=choice.setting.overlay))

    def collect(self) -> list[Measured]:
        """Return the runs that have ended, or exceeded their limit and are stopped."""
        over = []
        for run in tuple(self._runs):
            ready, elapsed = run.worker.ready(0.0), time.monotonic() - run.begun
            if ready:
                ending = _ending(run.worker.answer())
            elif elapsed > run.choice.limit:
                ending = {
                    "status": Status.STOPPED,
                    "reason": f"stopped after {elapsed:.0f} s",
                    "wall": elapsed,
                }
            else:
                continue
            run.worker.end()
            self._runs.remove(run)
            setting = run.choice.setting
            over.append(
                Measured(setting.name, setting.overlay, elapsed=elapsed, budget=self._limits.budget, **ending)
            )
        return over


def _ending(answer: dict[str, Any] | Lost) -> dict[str, Any]:
    """Return the status and the results of a run that has ended by itself."""
    reason = answer.reason if isinstance(answer, Lost) else answer.get("reason")
    if isinstance(answer, Lost) or reason is not None:
        return {"status": Status.FAILED, "reason": reason}
    return answer | {"status": Status.DONE}
