"""Progress of long work, its listeners, and the time of each stage; light, so that every stage can use it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

__all__ = ["Clock", "Listener", "Progress", "silent"]


@dataclass(frozen=True)
class Progress:
    """Progress of a run: `done` of `total` in a stage, with a short text; `total` is None if not known.

    `found` is a result in a line, to be shown as soon as there is one.
    """

    stage: str
    done: int
    total: int | None
    text: str = ""
    found: str = ""


Listener = Callable[[Progress], None]


def silent(progress: Progress) -> None:
    """Ignore progress."""


class Clock:
    """Wall seconds by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Add the time of a with-block to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start
