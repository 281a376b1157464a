"""How long work tells where it stands, without knowing who listens; light, so that every stage can use it."""

from dataclasses import dataclass

__all__ = ["Progress"]


@dataclass(frozen=True)
class Progress:
    """Where a run stands: `done` of `total` in a stage, with a short text; total is None if not known."""

    stage: str
    done: int
    total: int | None
    text: str = ""
