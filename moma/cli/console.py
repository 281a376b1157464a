"""Output on stderr, beside the results, warnings and errors; help as plain text; and how short commands end soon."""

import gc
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, ParamSpec, TextIO

import typer
from typer.core import HAS_RICH, TyperCommand, TyperGroup

from moma.errors import MomaError

__all__ = ["PlainCommand", "PlainGroup", "reporting", "say", "short_lived"]

P = ParamSpec("P")


class PlainCommand(TyperCommand):
    """Command whose help is shown as it is written: [[loads]] in it is no markup."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help, once in the life of a command."""
        _escape(self)
        super().format_help(ctx, formatter)


class PlainGroup(TyperGroup):
    """Group of commands whose help is shown as it is written."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help of the group, and the first line of that of each command."""
        for one in (self, *self.commands.values()):
            _escape(one)
        super().format_help(ctx, formatter)


def _escape(command: Any) -> None:
    """Escape what Rich, where Typer uses it, would take for markup in the help of a command and of its parameters."""
    if not HAS_RICH:
        return
    from rich.markup import escape

    for one in (command, *command.params):
        if getattr(one, "help", None):
            one.help = escape(one.help)


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
def short_lived() -> Iterator[None]:
    """Collect no garbage in a with-block of a second: loading a mapping makes many objects, of which all live on."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


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
