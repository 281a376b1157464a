"""Settings with which clouds with outlines, and masks alone, are read."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ground.errors import UsageError
from survey.clouds.outlines.reading import DRAWN, SMOOTH
from survey.clouds.wall import Wall
from survey.conventions import LEAST, SMALL_STONE
from survey.formats.options import ReadingOptions

MASONRY = ("auto", "ashlar", "coursed", "brick", "rubble")
"""Kinds of masonry; `auto` decides between courses and rubble."""

_JOINTS = (0.5, 200.0)  # width of a joint [px]


@dataclass(frozen=True)
class CloudOptions(ReadingOptions):
    """Settings of a cloud with outlines; `sigma` is that of a single point of the cloud.

    Attributes
    ----------
    outlines : file of outlines
    wall : frame of the plane that outlines without heights lie in; None: they lie in space
    layer : of a file of outlines with several
    chosen : names of attributes of outlines, by meaning
    outline_unit : length of the unit of outlines [m]; None: as their file states, else metres, unless asked
    outline_sigma : standard deviation of a drawn corner along the wall, where the outline states none [m]
    margin : width along the edge of a stone whose points are left out [m]; None: three times the sigma of its outline
    slab : largest distance of a point of a stone from the plane that its outline lies in [m]
    smooth : largest distance of the boundary of a mask from the sides of its outline [px]
    """

    outlines: Path = field(default_factory=Path)
    wall: Wall | None = None
    layer: str | None = None
    chosen: Mapping[str, str] = field(default_factory=dict)
    outline_unit: float | None = None
    outline_sigma: float = DRAWN
    margin: float | None = None
    slab: float = SMALL_STONE
    smooth: float = SMOOTH


@dataclass(frozen=True)
class MaskOptions(ReadingOptions):
    """Settings of masks, or of outlines, without a cloud.

    Attributes
    ----------
    size : width and height of the picture, or of the wall from the origin of outlines in metres [m]; None: a world file
        says where the pixels of a picture lie, and the wall is as large as the outlines
    depth : of all stones [m]; None: by the rules of the header file
    wall : frame of the picture in space; None: it stands on the x axis, seen along y
    layer : of a file of outlines with several; of a picture of classes, the number or colour of the stones
    chosen : names of attributes of outlines, by meaning
    outline_sigma : standard deviation of a drawn corner, where the outline states none [m]
    smooth : largest distance of the boundary of a mask from the sides of its outline [px]
    """

    size: tuple[float, float] | None = None
    depth: float | None = None
    wall: Wall | None = None
    layer: str | None = None
    chosen: Mapping[str, str] = field(default_factory=dict)
    outline_sigma: float = LEAST
    smooth: float = SMOOTH


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
