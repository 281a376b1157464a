"""Progress of long work, and who listens to it; light, so that every stage can use it."""

from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Listener", "Progress", "silent"]


@dataclass(frozen=True)
class Progress:
    """Where a run stands: `done` of `total` in a stage, with a short text; total is None if not known."""

    stage: str
    done: int
    total: int | None
    text: str = ""


Listener = Callable[[Progress], None]


def silent(progress: Progress) -> None:
    """Listen to nothing."""
