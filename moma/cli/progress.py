"""Progress of long commands on stderr, and Ctrl-C or SIGTERM that ends a run after its step."""

import gc
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from moma.cli.console import say

if TYPE_CHECKING:
    from types import FrameType

    from rich.progress import TaskID

    from mechanics.dynamics.progress import Listener
    from mechanics.dynamics.progress import Progress as Report

_FIRST = 1.0  # time after which the first plain line appears: shorter commands need none [s]
_EVERY = 5.0  # interval between plain lines [s]
_MEASURED = 1.0  # time of a stage from which its rate is trusted [s]
_WINDOW = 15.0  # latest time of a stage from which its rate is taken, or half of it if that is more [s]
_SPACING = 0.2  # between the instants that a rate is taken from [s]
_KERNELS = 3  # kernels compiled in a row before it is announced; a single one takes a second or two
_ENDLESS = frozenset({"trade", "write"})  # stages whose end does not follow from their rate
_EARLIER = frozenset({"static", "step"})  # stages that may end before their total
_ENDING = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Ctrl-C or SIGTERM during a run: the first ends it after the present step, the second ends the program.

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
            """Note the stage, and pass the report on."""
            self._stage = report.stage
            listener(report)

        return listen

    @contextmanager
    def handled(self) -> Iterator[None]:
        """Handle Ctrl-C and SIGTERM in a with-block; only the main thread of a program can."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {number: signal.signal(number, self._note) for number in _ENDING}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _note(self, number: int, frame: "FrameType | None") -> None:
        if self._stage not in ("static", "step", "write"):
            raise KeyboardInterrupt
        self._asked = True
        # the default action ends the program at once, even within a long kernel
        for ending in _ENDING:
            signal.signal(ending, signal.SIG_DFL)
        say("interrupted: the run ends after this step and its results are written; Ctrl-C again aborts")


class _Stages:
    """Stages of a command: the latest report, and the rate of the stage that is running.

    Time in which kernels are compiled does not count, and neither does the rate of earlier stages.
    """

    def __init__(self) -> None:
        self.begun = time.monotonic()
        self.latest: Report | None = None
        self._samples: deque[tuple[float, int]] = deque()
        self._compiled, self._compiling = 0.0, 0.0

    def __call__(self, report: "Report") -> None:
        """Note a report."""
        before, now = self.latest, self._now()
        if before is None or _begins(report, before):
            self._samples.clear()
            self._began = now
        if not self._samples or report.done != self._samples[-1][1]:
            if len(self._samples) > 1 and self._samples[-1][0] - self._samples[-2][0] < _SPACING:
                self._samples.pop()
            self._samples.append((now, report.done))
        window = max(_WINDOW, 0.5 * (now - self._began))
        while len(self._samples) > 2 and self._samples[1][0] < now - window:
            self._samples.popleft()
        self.latest = report

    def compiling(self, begins: bool) -> None:
        """Stop or start the clock, as kernels are compiled."""
        now = time.monotonic()
        if begins:
            self._compiling = now
        else:
            self._compiled += now - self._compiling
            self._compiling = 0.0

    def left(self) -> str:
        """Return the time that the stage still takes at the rate measured lately, in words; empty if not known."""
        from moma.cli.text.checks import duration

        if self._compiling:
            return "compiling kernels"
        report = self.latest
        if report is None or report.total is None or report.stage in _ENDLESS or len(self._samples) < 2:
            return ""
        (began, first), (last, done) = self._samples[0], self._samples[-1]
        if last - began < _MEASURED:
            return ""
        rest = (last - began) / (done - first) * (report.total - done) - (self._now() - last)
        qualifier = "at most" if report.stage in _EARLIER else "about"
        return f"{qualifier} {duration(rest)} left" if rest > 0.0 else ""

    def line(self) -> str | None:
        """Return one line on the present stage; None if no stage has begun."""
        if (report := self.latest) is None:
            return None
        counted = (
            f" {report.done} of {report.total}" if report.total else f" {report.done}" if report.done else ""
        )
        parts = [f"{report.stage}{counted}", self.left(), report.text]
        return f"[{self.age()}] {', '.join(filter(None, parts))}"

    def age(self) -> str:
        """Return the time since the command began, in words."""
        from moma.cli.text.checks import duration

        return duration(time.monotonic() - self.begun)

    def _now(self) -> float:
        """Return the time without that of compilations [s]."""
        return (self._compiling or time.monotonic()) - self._compiled


def _begins(report: "Report", before: "Report") -> bool:
    """Return whether a report is of another stage than that before it, or of the same one that begins again."""
    counted = (report.total is None) is (before.total is None)
    return report.stage != before.stage or report.done < before.done or not counted


@contextmanager
def progress_bars() -> "Iterator[Listener]":
    """Yield a listener that draws one bar per stage on a terminal, and prints a line every few seconds elsewhere."""
    stages = _Stages()
    with _compilations(stages), _bars(stages) if sys.stderr.isatty() else _lines(stages) as listener:
        yield listener


@contextmanager
def _lines(stages: _Stages) -> "Iterator[Listener]":
    """Yield a listener whose latest report is printed from the first second on, however long a stage is silent.

    Results are printed as they come, if the command takes longer.
    """
    over = threading.Event()

    def print_lines() -> None:
        """Print a line of progress from time to time."""
        pause = _FIRST
        while not over.wait(pause):
            print_found()
            if (line := stages.line()) is not None:
                say(line)
            pause = _EVERY

    def listen(report: "Report") -> None:
        """Note the stage and what was found."""
        stages(report)
        if report.found:
            lines.append(f"[{stages.age()}] {report.found}")
            print_found()

    def print_found() -> None:
        """Print what was found, once the work takes its time."""
        while lines and time.monotonic() - stages.begun >= _FIRST:
            say(lines.popleft())

    lines: deque[str] = deque()
    thread = threading.Thread(target=print_lines, daemon=True)
    thread.start()
    try:
        yield listen
    finally:
        over.set()
        thread.join()
        print_found()


@contextmanager
def _bars(stages: _Stages) -> "Iterator[Listener]":
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
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, TaskID] = {}

        def show(report: "Report") -> None:
            """Move the bar of the stage."""
            stages(report)
            if report.stage not in tasks:
                tasks[report.stage] = bars.add_task(report.stage, total=report.total, text="", left="")
            left = stages.left()
            bars.update(
                tasks[report.stage], completed=report.done, total=report.total, text=report.text, left=left
            )
            if report.found:
                bars.console.print(report.found, markup=False, highlight=False)

        yield show


@contextmanager
def _compilations(stages: _Stages) -> Iterator[None]:
    """Stop the clock while kernels are compiled, which is done once; announce it once after an installation.

    A compiler makes millions of small objects that live: looking for garbage among them takes a tenth of its time, so
    none is collected meanwhile.
    """
    from numba.core import event

    compiled, depth, collecting = 0, 0, gc.isenabled()

    class Compiling(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            """Stop the clock and the garbage collector while kernels are compiled."""
            nonlocal compiled, depth
            compiled, depth = compiled + 1, depth + 1
            gc.disable()
            if depth == 1:
                stages.compiling(True)
            if compiled == _KERNELS and _is_first():
                say("compiling kernels, once after an installation or an update; this takes a minute or two")

        def on_end(self, event: Any) -> None:
            """Let both go on."""
            nonlocal depth
            depth -= 1
            if depth == 0:
                stages.compiling(False)
                if collecting:
                    gc.enable()

    with event.install_listener("numba:compile", Compiling()):
        yield


def _is_first() -> bool:
    """Return whether compilation is announced for the first time after an installation, and leave a mark if so."""
    import numba
    from numba.misc.appdirs import AppDirs

    import moma

    release = f"moma {moma.__version__}, numba {numba.__version__}, Python {sys.version.split()[0]}"
    beside = Path(__file__).with_name("__pycache__")
    users = Path(AppDirs(appname="numba", appauthor=False).user_cache_dir)
    places = [Path(numba.config.CACHE_DIR)] if numba.config.CACHE_DIR else [beside, users]
    for mark in (place / "moma-kernels-announced" for place in places):
        with suppress(OSError):
            if mark.exists() and mark.read_text(encoding="utf-8") == release:
                return False
            mark.parent.mkdir(parents=True, exist_ok=True)
            mark.write_text(release, encoding="utf-8")
            return True
    return True
