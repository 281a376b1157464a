"""Processes that work on tasks beside this one; a process that ends without an answer loses no other task.

The function and the tasks travel through a pipe, so the function must stand in a module. `concurrent.futures` and its
relatives lose all tasks as soon as one of their processes is killed.
"""

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

Work = Callable[[Any], Any]
"""Function of one task, in a module."""


@dataclass(frozen=True)
class Lost:
    """Answer to a task whose processes ended without one.

    Attributes
    ----------
    reason : how the last of them ended
    """

    reason: str


@contextmanager
def workers(
    count: int, work: Work, attempts: int = 1
) -> Iterator[Callable[[Sequence[Any]], Iterator[tuple[int, Any]]]]:
    """Yield a function that works on tasks, several at a time, each in a process beside this one if more than one.

    The function yields the number of each task and its answer, as they come. An exception of the work is raised here.
    The processes end with the with-block, however it ends, and with this process if it is killed.

    Parameters
    ----------
    count : of the processes; with 1 this process does the work
    work : the function of a task
    attempts : processes that a task may lose before its answer is `Lost`
    """
    if count == 1:
        yield lambda tasks: ((number, work(task)) for number, task in enumerate(tasks))
        return
    crew: list[Worker] = []

    def run(tasks: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        """Yield number and answer of each task, in the order in which they end."""
        while len(crew) < min(count, len(tasks)):
            crew.append(Worker(work))
        waiting, losses = deque(range(len(tasks))), dict[int, int]()
        running: dict[int, Worker] = {}
        while waiting or running:
            for worker in crew:
                if waiting and worker not in running.values():
                    number = waiting.popleft()
                    worker.ask(tasks[number])
                    running[number] = worker
            ready = wait([worker.channel for worker in running.values()])
            for number, worker in [item for item in running.items() if item[1].channel in ready]:
                answer = worker.answer()
                del running[number]
                losses[number] = losses.get(number, 0) + isinstance(answer, Lost)
                if isinstance(answer, Lost) and losses[number] < attempts:
                    waiting.appendleft(number)
                else:
                    yield number, answer

    try:
        yield run
    finally:
        for worker in crew:
            worker.end()


class Worker:
    """A process that works on one task at a time; where it has ended, the next task starts another.

    Parameters
    ----------
    work : the function of a task
    environment : variables of the process beside those of this one, as threads that libraries read when they are loaded
    """

    def __init__(self, work: Work, environment: Mapping[str, str] | None = None) -> None:
        self._work, self._environment = work, dict(environment or {})
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.channel, remote = context.Pipe()
        self._process = context.Process(target=_serve, args=(remote, os.getpid(), self._work), daemon=True)
        with _variables(self._environment):
            self._process.start()
        remote.close()

    def ask(self, task: Any) -> None:
        """Hand a task to the process."""
        try:
            self.channel.send(task)
        except OSError:
            self.end()
            self._start()
            self.channel.send(task)

    def ready(self, seconds: float) -> bool:
        """Return true as soon as its answer has arrived or it has ended; false where neither is so by then."""
        return bool(wait([self.channel], seconds))

    def answer(self) -> Any:
        """Return its answer, which has arrived, or how the process has ended without one."""
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
            return Lost(f"the process of its run {how}")
        if isinstance(answer, Exception):
            raise answer
        return answer

    def end(self) -> None:
        """Kill the process, even within a long step."""
        self._process.kill()
        self._process.join()
        self.channel.close()


@contextmanager
def _variables(added: Mapping[str, str]) -> Iterator[None]:
    """Add environment variables within a with-block."""
    before = {name: os.environ.get(name) for name in added}
    os.environ.update(added)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _serve(channel: "Connection[Any, Any]", parent: int, work: Work) -> None:
    """Work on the tasks that come, until the parent has ended."""
    _end_with_parent(parent)
    while True:
        try:
            task = channel.recv()
        except (EOFError, OSError):
            return
        try:
            answer: Any = work(task)
        except Exception as error:
            answer = error
        try:
            channel.send(answer)
        except OSError:
            return


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
