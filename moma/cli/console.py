"""Standard streams that never fail for what is printed; warnings and errors; help as plain text; ends of commands."""

import codecs
import gc
import inspect
import io
import os
import sys
import traceback
import unicodedata
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import wraps
from typing import Any, TextIO

import typer
from typer.core import HAS_RICH, TyperCommand, TyperGroup

from ground.errors import MomaError, missing_library, storage_error

_CLOSEST = "moma.closest"  # name of the error handler
# what decomposes into no ASCII
_ASCII = str.maketrans({
    "–": "-", "—": "-", "−": "-", "─": "-", "·": "*", "×": "x", "÷": "/", "→": "->", "←": "<-", "↑": "^", "≤": "<=",
    "≥": ">=", "≈": "~", "≠": "!=", "±": "+-", "∞": "inf", "√": "sqrt", "“": '"', "”": '"', "„": '"', "‘": "'",
    "’": "'", "«": "<<", "»": ">>", "°": "deg", "µ": "u", "μ": "u", "ß": "ss", "æ": "ae", "ø": "o", "ł": "l",
})  # fmt: skip


class _Pipe(io.FileIO):
    """Standard stream of which the reader may have seen enough: a command ends as if it had gone on reading."""

    def write(self, data: Any) -> int:
        """Write bytes; drop them where nobody reads any more."""
        try:
            return super().write(data)
        except BrokenPipeError:
            return len(memoryview(data).cast("B"))


def open_streams() -> None:
    """Prepare standard output and error, so that no command fails for what it prints.

    Characters that the encoding of a stream lacks become the closest ASCII ones, or "?". What is written to a closed
    stream, or to a pipe without a reader, is dropped; other failures, such as a full disk, are those of the command.
    """
    codecs.register_error(_CLOSEST, _closest)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper) and stream.isatty():
            stream.reconfigure(errors=_CLOSEST)
        elif isinstance(stream, io.TextIOWrapper):
            stream.flush()
            bytes_ = io.BufferedWriter(_Pipe(stream.fileno(), "wb", closefd=False))
            # what goes on is read in a file, too, while it goes on
            line = stream.line_buffering or name == "stderr"
            setattr(sys, name, io.TextIOWrapper(bytes_, stream.encoding, _CLOSEST, line_buffering=line))


def _closest(error: UnicodeError) -> tuple[str, int]:
    """Return ASCII for the characters that an encoding lacks, and where to go on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end].translate(_ASCII)
    plain = (
        unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode() or "?" for name in lacking
    )
    return "".join(plain), error.end


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
        for group in (self, *self.commands.values()):
            _escape(group)
        super().format_help(ctx, formatter)


def _escape(command: Any) -> None:
    """Escape what Rich, where Typer uses it, would take for markup in the help of a command and of its parameters."""
    if not HAS_RICH:
        return
    from rich.markup import escape

    for documented in (command, *command.params):
        if getattr(documented, "help", None):
            documented.help = escape(documented.help)


def say(message: str) -> None:
    """Print one line on stderr."""
    print(f"moma: {message}", file=sys.stderr)


def reporting(command: Callable[..., None]) -> Callable[..., None]:
    """Decorate a command to fail with one line and an exit code; with ``-v``, the traceback too.

    The fields of a dataclass among its parameters become options in its place: the command receives the dataclass.
    """
    signature = inspect.signature(command)
    groups: dict[str, Any] = {
        name: parameter.annotation
        for name, parameter in signature.parameters.items()
        if is_dataclass(parameter.annotation)
    }

    @wraps(command)
    def run(**options: Any) -> None:
        """Build the dataclasses of options, run the command, and say what failed."""
        verbose = bool(options.get("verbose"))
        for name, group in groups.items():
            options[name] = group(**{field.name: options.pop(field.name) for field in fields(group)})
        try:
            with _short_warnings(), _flushed():
                command(**options)
        except (typer.Exit, typer.Abort, BrokenPipeError):
            raise  # typer handles its own exceptions, which end a command, and broken pipes
        except KeyboardInterrupt:
            say("interrupted")
            raise
        except Exception as error:
            foreseen = (
                error if isinstance(error, MomaError) else storage_error(error) or missing_library(error)
            )
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

    parameters = [
        option
        for parameter in signature.parameters.values()
        for option in (
            inspect.signature(groups[parameter.name]).parameters.values()
            if parameter.name in groups
            else (parameter,)
        )
    ]
    listed = [option.replace(kind=option.KEYWORD_ONLY) for option in parameters]
    run.__signature__ = signature.replace(parameters=listed)  # type: ignore[attr-defined]
    run.__annotations__ = {option.name: option.annotation for option in listed}
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
        """Say a warning in a line."""
        say(f"warning: {' '.join(str(message).split())}")

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield
