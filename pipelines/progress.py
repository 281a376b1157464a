"""How long work tells where it stands, without knowing who listens."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

__all__ = ["Listener", "Progress", "Report", "silent"]


class Report(Protocol):
    """What is reported; `mechanics.simulate.Progress` has the same shape."""

    @property
    def stage(self) -> str:
        """Name of the work."""

    @property
    def done(self) -> int:
        """How much of it is done."""

    @property
    def total(self) -> int | None:
        """How much there is; None if nobody knows."""

    @property
    def text(self) -> str:
        """A few words on how it goes."""


@dataclass(frozen=True)
class Progress:
    """Where a pipeline stands: `done` of `total` in a stage, with a short text."""

    stage: str
    done: int
    total: int | None
    text: str = ""


Listener = Callable[[Report], None]


def silent(report: Report) -> None:
    """Listen to nothing."""
