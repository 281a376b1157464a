"""Kernels that commands call, with the types of their arguments: what a first use has to compile.

The list ``usual.json`` was recorded by ``python -m benchmarks.first_use --record``: from the sample by command, and
from a matrix of samples, profiles and commands. It only saves time: a kernel
that it does not name is compiled where it is called, one that is no longer called like that is compiled in vain.
"""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.dispatcher import Dispatcher

COMMANDS = ("orient", "ingest", "run")
"""Commands with a list, in their usual order."""

OTHERS = "others"
"""Name of the list of what other commands, samples and profiles compile beyond them."""

LISTS = Path(__file__).with_name("usual.json")
"""File of the lists, by command."""


@dataclass(frozen=True)
class KernelUse:
    """One kernel, and the types that it is called with.

    Attributes
    ----------
    module, name : of the compiled function
    types : of its arguments, as plain JSON: "float64" for a number, ["float64", 2, "C"] for an array, with "readonly"
        added where it is; {"of": [...]} for a tuple, {"named": "module:Class", "of": [...]} for a named one
    """

    module: str
    name: str
    types: tuple[Any, ...]

    def compile(self) -> None:
        """Compile the kernel, or load it if the cache of kernels has it."""
        kernel = getattr(import_module(self.module), self.name)
        kernel.compile(tuple(_decoded(text) for text in self.types))


def kernels_of(command: str) -> tuple[KernelUse, ...]:
    """Return the kernels of a command in the order of their first calls."""
    recorded = json.loads(LISTS.read_text(encoding="utf-8"))
    return tuple(
        KernelUse(entry["module"], entry["name"], tuple(entry["types"])) for entry in recorded[command]
    )


def all_kernels() -> tuple[KernelUse, ...]:
    """Return the kernels of all lists, each once."""
    return tuple(use for name in (*COMMANDS, OTHERS) for use in kernels_of(name))


@contextmanager
def recording() -> Iterator[list[KernelUse]]:
    """Collect the kernels that Python code calls, and that are compiled, within a with-block."""
    listener = _Recorder()
    event.register("numba:compile", listener)
    try:
        yield listener.uses
    finally:
        event.unregister("numba:compile", listener)


def called() -> list[KernelUse]:
    """Return the kernels that Python code has called in this process, whether they were compiled or loaded.

    Kernels that others call are not loaded by themselves where the cache is full.
    """
    uses: list[KernelUse] = []
    for name in sorted(sys.modules):
        for kernel in list(vars(sys.modules[name]).values()) if "._kernels" in name else ():
            if not isinstance(kernel, Dispatcher) or kernel.py_func.__module__ != name:
                continue
            for types in kernel.overloads:
                use = KernelUse(name, kernel.py_func.__qualname__, tuple(_encoded(kind) for kind in types))
                with suppress(AttributeError, TypeError, KeyError):  # of a type that has no name here
                    if tuple(_decoded(text) for text in use.types) == tuple(types) and use not in uses:
                        uses.append(use)
    return uses


class _Recorder(event.Listener):  # type: ignore[misc]
    """Listener to compilations; those within another are of kernels that kernels call."""

    def __init__(self) -> None:
        self.uses: list[KernelUse] = []
        self._depth = 0

    def on_start(self, event: Any) -> None:
        """Take down a kernel that Python code calls."""
        if self._depth == 0:
            function = event.data["dispatcher"].py_func
            types = tuple(_encoded(arg) for arg in event.data["args"])
            self.uses.append(KernelUse(function.__module__, function.__qualname__, types))
        self._depth += 1

    def on_end(self, event: Any) -> None:
        """Leave a compilation."""
        self._depth -= 1


def _encoded(kind: Any) -> Any:
    if isinstance(kind, numba.types.Array):
        return [str(kind.dtype), kind.ndim, kind.layout, *([] if kind.mutable else ["readonly"])]
    if isinstance(kind, numba.types.BaseTuple):
        parts: dict[str, Any] = {"of": [_encoded(part) for part in kind.types]}
        named = getattr(kind, "instance_class", tuple)
        return parts if named is tuple else {"named": f"{named.__module__}:{named.__qualname__}", **parts}
    return str(kind)


def _decoded(text: Any) -> Any:
    if isinstance(text, str):
        return getattr(numba.types, "boolean" if text == "bool" else text)
    if isinstance(text, list):
        return numba.types.Array(_decoded(text[0]), text[1], text[2], readonly=len(text) > 3)
    parts = [_decoded(text) for text in text["of"]]
    if "named" not in text:
        return numba.types.Tuple(parts)
    module, _, name = text["named"].partition(":")
    named = getattr(import_module(module), name)
    if all(part == parts[0] for part in parts):
        return numba.types.NamedUniTuple(parts[0], len(parts), named)
    return numba.types.NamedTuple(parts, named)
