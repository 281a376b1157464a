"""Settings with which outlines are proposed."""

from dataclasses import dataclass

from ground.errors import UsageError

__all__ = ["MASONRY", "OutlineSettings"]

MASONRY = ("auto", "ashlar", "coursed", "brick", "rubble")
"""Kinds of masonry; `auto` decides between courses and rubble."""

_JOINTS = (0.5, 200.0)  # width of a joint [px]


@dataclass(frozen=True)
class OutlineSettings:
    """Settings with which outlines are proposed.

    Attributes
    ----------
    masonry : one of `MASONRY`
    joint : width of the joints [px]; None: as the picture shows
    tile : side of the parts in which a large picture is worked on [px of the work]
    overlap : by which they overlap [px of the work]: more than a stone is long
    """

    masonry: str = "auto"
    joint: float | None = None
    tile: int = 1600
    overlap: int = 320

    def __post_init__(self) -> None:
        if self.masonry not in MASONRY:
            raise UsageError(
                f"is {self.masonry!r}", where="--masonry", remedy=f"kinds are {', '.join(MASONRY)}"
            )
        if self.joint is not None and not _JOINTS[0] <= self.joint <= _JOINTS[1]:
            remedy = "give the width of a joint in metres, and the size of the picture or of a pixel"
            raise UsageError(f"is {self.joint:g} pixels", where="--joint", remedy=remedy)
