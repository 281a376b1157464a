"""Who listens to long work; `mechanics.dynamics.progress.Progress` is what is told."""

from collections.abc import Callable

from mechanics.dynamics.progress import Progress

__all__ = ["Listener", "Progress", "silent"]

Listener = Callable[[Progress], None]


def silent(progress: Progress) -> None:
    """Listen to nothing."""
