"""Progress of long commands on stderr, and Ctrl-C that ends a run after its step."""

import gc
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from moma.cli.console import say

if TYPE_CHECKING:
    from types import FrameType

    from rich.progress import TaskID

    from mechanics.dynamics.progress import Listener
    from mechanics.dynamics.progress import Progress as Report

__all__ = ["Interruption", "progress_bars"]

_FIRST = 1.0  # time after which the first plain line appears: shorter commands need none [s]
_EVERY = 5.0  # interval between plain lines [s]
_MEASURED = 1.0  # time of a stage from which its rate is trusted [s]
_KERNELS = 3  # kernels compiled in a row before it is announced; a single one takes a second or two
_ENDLESS = frozenset({"trade"})  # stages whose end does not follow from their rate
_EARLIER = frozenset({"step"})  # stages that may end before their total


class Interruption:
    """Ctrl-C during a run: the first ends it after the present step, the second ends the program.

    Before there is a step, nothing is lost: the first ends the program too.
    """

    def __init__(self) -> None:
        self._stage = ""
        self._asked = False

    def __call__(self) -> bool:
        """Return whether the run is to end."""
        return self._asked

    def listening(self, listener: "Listener") -> "Listener":
        """Return a listener that tells the stage of the run too."""

        def listen(report: "Report") -> None:
            self._stage = report.stage
            listener(report)

        return listen

    @contextmanager
    def handled(self) -> Iterator[None]:
        """Handle Ctrl-C in a with-block; only the main thread of a program can."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = signal.signal(signal.SIGINT, self._note)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    def _note(self, number: int, frame: "FrameType | None") -> None:
        if self._stage not in ("static", "step", "write"):
            raise KeyboardInterrupt
        self._asked = True
        # the default action ends the program at once, even within a long kernel
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        say("interrupted: the run ends after this step and its results are written; Ctrl-C again aborts")


class _Stages:
    """Stages of a command: the latest report, and the rate of each stage."""

    def __init__(self) -> None:
        self.begun = time.monotonic()
        self.latest: Report | None = None
        self._first: dict[str, tuple[float, int]] = {}

    def __call__(self, report: "Report") -> None:
        """Note a report."""
        self._first.setdefault(report.stage, (time.monotonic(), report.done))
        self.latest = report

    def left(self, report: "Report") -> str:
        """Return the time that a stage still takes at the rate measured so far, in words; empty if not known."""
        from moma.cli.text.checks import duration

        began, first = self._first[report.stage]
        spent, done = time.monotonic() - began, report.done - first
        if report.total is None or done <= 0 or spent < _MEASURED or report.stage in _ENDLESS:
            return ""
        known = "at most" if report.stage in _EARLIER else "about"
        return f"{known} {duration(spent / done * (report.total - report.done))} left"

    def line(self) -> str | None:
        """Return one line on the present stage; None if no stage has begun."""
        from moma.cli.text.checks import duration

        if (report := self.latest) is None:
            return None
        counted = (
            f" {report.done} of {report.total}" if report.total else f" {report.done}" if report.done else ""
        )
        parts = [f"{report.stage}{counted}", self.left(report), report.text]
        return f"[{duration(time.monotonic() - self.begun)}] {', '.join(filter(None, parts))}"


@contextmanager
def progress_bars() -> "Iterator[Listener]":
    """Yield a listener that draws one bar per stage on a terminal, and prints a line every few seconds elsewhere."""
    with ExitStack() as held:
        listener = held.enter_context(_bars() if sys.stderr.isatty() else _lines())
        held.enter_context(_announced())
        yield listener


@contextmanager
def _lines() -> "Iterator[Listener]":
    """Yield a listener whose latest report is printed from the first second on, however long a stage is silent."""
    stages, over = _Stages(), threading.Event()

    def print_lines() -> None:
        pause = _FIRST
        while not over.wait(pause):
            if (line := stages.line()) is not None:
                say(line)
            pause = _EVERY

    thread = threading.Thread(target=print_lines, daemon=True)
    thread.start()
    try:
        yield stages
    finally:
        over.set()
        thread.join()


@contextmanager
def _bars() -> "Iterator[Listener]":
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns: list[Any] = [
        TextColumn("{task.description:>12}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
        TextColumn("{task.fields[text]}", markup=False),  # codes of stones may hold brackets
    ]
    stages = _Stages()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, TaskID] = {}

        def show(report: "Report") -> None:
            stages(report)
            if report.stage not in tasks:
                tasks[report.stage] = bars.add_task(report.stage, total=report.total, text="", left="")
            left = stages.left(report)
            bars.update(
                tasks[report.stage], completed=report.done, total=report.total, text=report.text, left=left
            )

        yield show


@contextmanager
def _announced() -> Iterator[None]:
    """Announce the compilation of kernels, which takes a minute when they are first used and is done once.

    A compiler makes millions of small objects that live: looking for garbage among them takes a tenth of its time, so
    none is collected meanwhile.
    """
    from numba.core import event

    compiled, depth, collecting = 0, 0, gc.isenabled()

    class Compiling(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            nonlocal compiled, depth
            compiled, depth = compiled + 1, depth + 1
            gc.disable()
            if compiled == _KERNELS:
                say("compiling kernels, once after an installation or an update; this takes a minute or two")

        def on_end(self, event: Any) -> None:
            nonlocal depth
            depth -= 1
            if depth == 0 and collecting:
                gc.enable()

    with event.install_listener("numba:compile", Compiling()):
        yield
