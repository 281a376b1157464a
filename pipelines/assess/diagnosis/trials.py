"""Runs of a diagnosis: scenes in, motions of their stones out, here or in processes beside this one.

`Runner` is all that a cluster has to serve: scenes are self-contained texts, and may be run in any order.
"""

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from archmodel.database.session import open_database
from mechanics.results.result import Outcome
from mechanics.simulate import simulate, simulate_stages
from moma.errors import MomaError
from pipelines.assess.motions import Motions, stone_motions
from pipelines.run.assemble import assemble
from pipelines.scene.file import parse_scene

__all__ = ["Runner", "Trial", "Tried", "run_trial", "runner", "since_rest"]


@dataclass(frozen=True)
class Trial:
    """A scene to be run.

    Attributes
    ----------
    text, path : of the scene file; the path is for messages and for files beside it
    url : of the database with its stones
    """

    text: str
    path: str
    url: str


@dataclass(frozen=True)
class Tried:
    """Answer to a trial.

    Attributes
    ----------
    motions : of the stones; None if the run failed
    fault : reason of the failure, or of mistrust: the run did not come to rest; empty if there is none
    cpu : time of the processor [s]
    """

    motions: Motions | None
    fault: str
    cpu: float


Runner = Callable[[Sequence[Trial]], Iterable[Tried]]
"""Function that runs scenes, independent of each other, and gives the answers in their order as they come."""


def run_trial(trial: Trial) -> Tried:
    """Run one scene."""
    begun = time.process_time()
    try:
        scene = parse_scene(trial.text, trial.path)
        with open_database(trial.url, create=False) as database, database.session(read_only=True) as session:
            assembly = assemble(scene, session)
        result = simulate_stages(assembly.stages) if assembly.stages else simulate(assembly.scene)
    except MomaError as error:
        return Tried(None, " ".join(str(error).split()), time.process_time() - begun)
    cpu = time.process_time() - begun
    if result.outcome is Outcome.COLLAPSED:
        return Tried(None, "the run ended in collapse", cpu)
    fault = "" if result.outcome.rests else f"its run did not come to rest: {result.outcome}"
    return Tried(stone_motions(result.bodies, assembly.origin), fault, cpu)


def since_rest(tried: Tried, rest: Tried) -> Tried:
    """Return a run whose motions count from where the scene rests without any cause."""
    if tried.motions is None:
        return tried
    fault = f"without any cause: {rest.fault}" if rest.fault else ""
    if rest.motions is None:
        return Tried(None, fault, tried.cpu)
    return Tried(tried.motions.since(rest.motions), "; ".join(filter(None, (tried.fault, fault))), tried.cpu)


@contextmanager
def runner(jobs: int) -> Iterator[Runner]:
    """Yield a function that runs scenes, with so many at a time, each in a process of its own if more than one.

    The processes end with the with-block, however it ends, and with this process if it is killed.
    """
    if jobs == 1:
        yield lambda trials: map(run_trial, trials)
        return
    workers: list[_Worker] = []

    def run(trials: Sequence[Trial]) -> Iterator[Tried]:
        while len(workers) < min(jobs, len(trials)):
            workers.append(_Worker())
        answers: dict[int, Tried] = {}
        asked, running, told = 0, dict[int, _Worker](), 0
        while told < len(trials):
            idle = [one for one in workers if one not in running.values()]
            for worker in idle[: len(trials) - asked]:
                worker.ask(trials[asked])
                running[asked] = worker
                asked += 1
            ready = wait([one.channel for one in running.values()])
            for number, worker in [item for item in running.items() if item[1].channel in ready]:
                answers[number] = worker.answer()
                del running[number]
            while told in answers:
                yield answers.pop(told)
                told += 1

    try:
        yield run
    finally:
        for worker in workers:
            worker.end()


class _Worker:
    """A process that runs one scene at a time; where it has ended, the next scene starts another."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.channel, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(there, os.getpid()), daemon=True)
        self._process.start()
        there.close()

    def ask(self, trial: Trial) -> None:
        """Hand a scene to the process."""
        try:
            self.channel.send(trial)
        except OSError:
            self.end()
            self._start()
            self.channel.send(trial)

    def answer(self) -> Tried:
        """Return its answer, which is there, or the reason why the process has ended without one."""
        try:
            answer = self.channel.recv()
        except (EOFError, OSError):
            self._process.join()
            code = self._process.exitcode or 0
            how = (
                f"was killed by signal {-code}, maybe for its memory"
                if code < 0
                else f"ended with code {code}"
            )
            return Tried(None, f"the process of its run {how}", 0.0)
        if isinstance(answer, Exception):
            raise answer
        assert isinstance(answer, Tried)
        return answer

    def end(self) -> None:
        """Kill the process, even within a long step."""
        self._process.kill()
        self._process.join()
        self.channel.close()


def _serve(channel: "Connection[Any, Any]", parent: int) -> None:
    """Run the scenes that come, until the parent has ended."""
    _end_with_parent(parent)
    while True:
        try:
            trial = channel.recv()
        except (EOFError, OSError):
            return
        try:
            answer: Tried | Exception = run_trial(trial)
        except Exception as error:
            answer = error
        channel.send(answer)


def _end_with_parent(parent: int) -> None:
    """End this process as soon as its parent has ended, for whatever reason; signals are for the parent alone."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    if sys.platform.startswith("linux"):
        # the operating system does so at once, even within a long kernel, for which the thread below would wait
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
        if os.getppid() != parent:
            os._exit(1)
    if (process := multiprocessing.parent_process()) is not None:
        threading.Thread(target=_await, args=(process,), daemon=True).start()


def _await(parent: "multiprocessing.process.BaseProcess") -> None:
    parent.join()
    os._exit(1)
