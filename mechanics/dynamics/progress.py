"""Progress of long work, its listeners, the time of each stage, and the loop of steps; light, for every stage."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from mechanics.carried import Carried, Carrier, Checkpointing


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


class SteppedRun(Carrier, ABC):
    """A run made step by step, of stones or of disks, which may be stopped, kept in checkpoints, and resumed.

    A class that derives from it names `clock` and `total` among its `REBUILT`, and `steps` among its `CARRIED`.

    Attributes
    ----------
    clock : wall seconds by stage, which a resumed run adds to
    steps, total : steps made, and at most
    """

    clock: Clock
    steps: int
    total: int

    @property
    @abstractmethod
    def done(self) -> bool:
        """True where no further step is to be made."""

    @property
    @abstractmethod
    def text(self) -> str:
        """State of the last step in a few words."""

    @abstractmethod
    def step(self) -> object:
        """Make one time step, and account for it."""

    def go(
        self,
        report: Listener,
        stop: Callable[[], bool],
        archive: Checkpointing | None,
        observe: Callable[[bool], None],
    ) -> bool:
        """Make steps until the run is done or stopped; return whether it was stopped.

        Parameters
        ----------
        report : called after every step
        stop : asked after every step but the last
        archive : takes a checkpoint where the run is stopped, and every so many steps before the last; None: none
        observe : called after every step, before its checkpoint, with True for the last
        """
        while not self.done:
            self.step()
            report(Progress("step", self.steps, self.total, self.text))
            stopped = not self.done and stop()
            last = self.done or stopped
            observe(last)
            if archive is not None:
                regular = archive.every and self.steps % archive.every == 0
                if stopped or (regular and not last):
                    with self.clock("checkpoint"):
                        archive.checkpoint(self.steps, self.carried())
            if stopped:
                return True
        return False

    def carried(self) -> dict[str, Any]:
        """Return what another run of the same scene needs to go on from here; arrays are shared, not copied."""
        return super().carried() | {"seconds": dict(self.clock.seconds)}

    def restore(self, carried: Carried) -> None:
        """Go on where another run of the same scene stood."""
        super().restore(carried)
        for stage, seconds in carried["seconds"].items():
            self.clock.seconds[stage] = self.clock.seconds.get(stage, 0.0) + seconds
