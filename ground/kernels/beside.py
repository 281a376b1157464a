"""A second process that compiles kernels from the far end of a command's list, on a first use.

Compiling is most of a first use, and numba compiles one kernel at a time. The second process starts when the command
compiles its first kernel, and so never if the cache of kernels is warm. It takes one kernel after another from its
standard input, the last ones first, and leaves them in the cache; where the two meet, the command finds the rest there.
It ends with the command, and by itself, after the kernel in hand, if the command is killed.
"""

import gc
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Thread
from typing import Any

from numba.core import event

from ground.kernels.uses import COMMANDS, KernelUse, kernels_of


@contextmanager
def compiling_beside(command: str) -> Iterator[None]:
    """Let a second process compile the later kernels of a command, if the command has to compile any.

    Parameters
    ----------
    command : one of `COMMANDS`; kernels of those after it come last
    """
    if _processors() < 2:
        yield
        return
    listener = _FirstCompilation(command)
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
        listener.close()


def _processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _FirstCompilation(event.Listener):  # type: ignore[misc]
    """Listener that starts the second process at the first compilation."""

    def __init__(self, command: str) -> None:
        self._command = command
        self._asked = False
        self._helper: subprocess.Popen[str] | None = None
        self._feeder: Thread | None = None

    def on_start(self, event: Any) -> None:
        """Start the second process, once."""
        if self._asked:
            return
        self._asked = True
        with suppress(OSError):  # without a second process, the command compiles everything itself
            self._helper = subprocess.Popen(
                [sys.executable, "-P", "-m", "ground.kernels.beside"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            )
            self._feeder = Thread(target=_feed, args=(self._helper, _order(self._command)), daemon=True)
            self._feeder.start()

    def on_end(self, event: Any) -> None:
        """Do nothing: the second process goes on."""

    def close(self) -> None:
        """End the second process; numba replaces files of its cache as a whole, so none is left half-written."""
        if self._helper is None or self._feeder is None:
            return
        self._helper.terminate()
        self._helper.wait()
        self._feeder.join()
        for stream in (self._helper.stdin, self._helper.stdout):
            with suppress(OSError):
                assert stream is not None
                stream.close()


def _order(command: str) -> list[str]:
    """Return the kernels to compile, each by command and place: the command's own from the last, then later ones."""
    later = COMMANDS[COMMANDS.index(command) + 1 :]
    kernels = [f"{command} {place}" for place in reversed(range(len(kernels_of(command))))]
    return kernels + [f"{command} {place}" for command in later for place in range(len(kernels_of(command)))]


def _feed(helper: "subprocess.Popen[str]", order: list[str]) -> None:
    """Hand out one kernel whenever the one before is done."""
    assert helper.stdin is not None
    assert helper.stdout is not None
    with suppress(OSError, ValueError):  # the helper has ended
        for kernel_place in order:
            helper.stdin.write(f"{kernel_place}\n")
            helper.stdin.flush()
            if not helper.stdout.readline():
                return
        helper.stdin.close()


def _compile_what_comes() -> None:
    gc.disable()  # a compiler makes millions of small objects that live
    lists: dict[str, tuple[KernelUse, ...]] = {command: kernels_of(command) for command in COMMANDS}
    for line in sys.stdin:
        command, place = line.split()
        with suppress(Exception):  # a list of an older program; the command itself reports what is wrong
            lists[command][int(place)].compile()
        print("done", flush=True)


if __name__ == "__main__":
    _compile_what_comes()
