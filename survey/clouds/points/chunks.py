"""A point cloud as it is streamed: pieces of bounded size, about an origin near the points."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError
from survey.arrays import Array
from survey.conventions import STEP
from survey.records.survey import Station

CHUNK = 1_000_000
"""Points of a chunk: 24 MB of coordinates, and large enough that a chunk's fixed costs do not count."""

LINES = CHUNK // 4  # lines in memory at a time: strings of Python take 70 bytes each
_HARMLESS = 0.0005  # rounding of single precision that no survey notices [m]
_HOPELESS = STEP  # beyond which points of a face lie on lines [m]


@dataclass(frozen=True)
class Chunk:
    """Some points of a cloud.

    Attributes
    ----------
    places : (n, 3) relative to the origin that the reader was given [m]
    colours : (n, 3) red, green, blue from 0 to 255; None if the file has none or none were asked for
    """

    places: Array
    colours: NDArray[np.uint8] | None = None


Chunks = Callable[[Array, bool], Iterator[Chunk]]
"""A function of the origin (3,), and of whether colours are wanted, that reads a file from its beginning."""


@dataclass(frozen=True)
class PointCloud:
    """A file of points, of which only the head has been read.

    Attributes
    ----------
    path : the file
    count : number of points; None where the file does not say
    near : (3,) a place near the points [m]
    chunks : reads the points
    stations : places of the scanner, where the file tells them
    warnings : doubts about the file, in words
    """

    path: Path
    count: int | None
    near: Array
    chunks: Chunks
    stations: tuple[Station, ...] = ()
    warnings: tuple[str, ...] = field(default=())


def lost_digits(path: Path, farthest: float) -> tuple[str, ...]:
    """Return a warning if coordinates of this size [m] lose digits in single precision, otherwise nothing.

    Raises
    ------
    SurveyError
        if they lose so many that no face can be measured
    """
    lost = float(np.spacing(np.float32(farthest))) / 2.0
    what = (
        f"coordinates are stored in single precision and reach {farthest:.0f} m, where it rounds by up to "
        f"{float(f'{lost * 1e3:.2g}'):g} mm"
    )
    remedy = "export in double precision, or shifted near 0"
    if lost > _HOPELESS:
        raise SurveyError(what, where=str(path), remedy=f"{remedy}; LAS and LAZ lose none")
    return (f"{path}: {what}; {remedy}",) if lost > _HARMLESS else ()
