"""Progress of long computations and its listeners; a light module, for every stage of the pipelines."""

from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["Listener", "Progress", "silent"]


@dataclass(frozen=True)
class Progress:
    """Progress of a run: `done` of `total` in a stage, with a short text; `total` is None if not known."""

    stage: str
    done: int
    total: int | None
    text: str = ""


Listener = Callable[[Progress], None]


def silent(progress: Progress) -> None:
    """Ignore progress."""
