"""Output on stderr, beside the results, warnings and errors; help as plain text; and how short commands end soon."""

import gc
import os
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any, ParamSpec, TextIO

import typer
from typer.core import HAS_RICH, TyperCommand, TyperGroup

from moma.errors import MomaError, storage_error

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
            with _short_warnings(), _flushed():
                command(*arguments, **options)
        except (typer.Exit, typer.Abort, BrokenPipeError):
            raise  # typer handles its own exceptions, which end a command, and broken pipes
        except KeyboardInterrupt:
            say("interrupted")
            raise
        except Exception as error:
            foreseen = error if isinstance(error, MomaError) else storage_error(error)
            if foreseen is None and verbose:
                raise
            if verbose:
                traceback.print_exc()
            if foreseen is None:
                say(
                    f"error: unexpected {type(error).__name__}: {error}; please report it with the output of -v"
                )
                raise typer.Exit(1) from None
            say(f"error: {' '.join(str(foreseen).split())}")
            raise typer.Exit(foreseen.exit_code) from None

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
def _flushed() -> Iterator[None]:
    """Write out what was printed in a with-block, so that a full disk is reported as that of a file is."""
    try:
        yield
    except OSError:
        _flush()  # if it was the printing that failed, it fails again
        raise
    _flush()


def _flush() -> None:
    try:
        sys.stdout.flush()
    except OSError as error:
        if (refusal := storage_error(error, "standard output")) is None:
            raise
        # the interpreter would try again at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise refusal from error


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
