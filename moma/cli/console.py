"""Output on stderr, beside the results: progress, warnings, errors."""

import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TextIO

import typer

from moma.errors import MomaError

if TYPE_CHECKING:
    from rich.progress import TaskID

    from mechanics.dynamics.progress import Listener
    from mechanics.dynamics.progress import Progress as ProgressReport

__all__ = ["progress_bars", "reporting", "say"]

P = ParamSpec("P")


def say(message: str) -> None:
    """Print one line on stderr."""
    print(f"moma: {message}", file=sys.stderr)


def reporting(command: Callable[P, None]) -> Callable[P, None]:
    """Decorate a command to fail with one line and an exit code; with ``-v``, the traceback too."""

    @wraps(command)
    def run(*arguments: P.args, **options: P.kwargs) -> None:
        verbose = bool(options.get("verbose"))
        try:
            with _short_warnings():
                command(*arguments, **options)
        except MomaError as error:
            if verbose:
                traceback.print_exc()
            say(f"error: {' '.join(str(error).split())}")
            raise typer.Exit(error.exit_code) from None
        except Exception as error:
            # typer handles its own exceptions, which end a command, and broken pipes
            if verbose or isinstance(error, typer.Exit | typer.Abort | BrokenPipeError):
                raise
            say(f"error: unexpected {type(error).__name__}: {error}; please report it with the output of -v")
            raise typer.Exit(1) from None

    return run


@contextmanager
def _short_warnings() -> Iterator[None]:
    """Show each warning in one line, without its place in the source."""

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        say(f"warning: {' '.join(str(message).split())}")

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


@contextmanager
def progress_bars() -> "Iterator[Listener]":
    """Yield a listener that draws one bar per stage on a terminal, and nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda report: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns: list[Any] = [
        TextColumn("{task.description:>12}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[text]}"),
    ]
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, TaskID] = {}

        def show(report: "ProgressReport") -> None:
            if report.stage not in tasks:
                tasks[report.stage] = bars.add_task(report.stage, total=report.total, text="")
            bars.update(tasks[report.stage], completed=report.done, total=report.total, text=report.text)

        yield show
