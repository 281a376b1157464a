"""World files: where the pixels of a picture lie in the plane of a wall or map."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np

from ground.errors import SurveyError
from survey.arrays import Array


class _Tag(IntEnum):
    """Tags of GeoTIFF: size of a pixel, a tie point, a matrix."""

    SCALE, TIE, MATRIX = 33550, 33922, 34264


@dataclass(frozen=True)
class PixelPlace:
    """Affine map from the column and row of a pixel's middle to a plane.

    Attributes
    ----------
    matrix : (2, 2) change of place by one column and one row, its columns [m]
    origin : (2,) place of the middle of the upper left pixel [m]
    """

    matrix: Array
    origin: Array

    def place(self, pixels: Array) -> Array:
        """Return the places (n, 2) of pixels (n, 2) [m]."""
        out: Array = pixels @ self.matrix.T + self.origin
        return out

    @property
    def pixel(self) -> float:
        """Side of a square of the area of a pixel [m]."""
        return float(np.sqrt(abs(np.linalg.det(self.matrix))))


def world_file(picture: Path) -> Path:
    """Return the usual name of the world file of a picture: .pgw, .tfw, .jgw."""
    ending = picture.suffix.lower().lstrip(".")
    return picture.with_suffix(f".{ending[:1]}{ending[-1:]}w")


def world_of(picture: Path, tags: Mapping[int, tuple[float, ...]] | None = None) -> PixelPlace | None:
    """Find where the pixels of a picture lie: by its world file, or by the tags of a GeoTIFF.

    Parameters
    ----------
    picture : beside which the world file may lie, as .pgw, .pngw or .wld
    tags : of a TIFF

    Returns
    -------
    None if nothing says so

    Raises
    ------
    SurveyError
        if the world file is damaged
    """
    endings = (world_file(picture), picture.with_suffix(f"{picture.suffix}w"), picture.with_suffix(".wld"))
    for path in endings:
        if path.is_file():
            return _read(path)
    if tags and _Tag.MATRIX in tags:
        m = np.array(tags[_Tag.MATRIX], dtype=np.float64).reshape(4, 4)
        return _of_corner(m[:2, :2], m[:2, 3])
    if tags and _Tag.SCALE in tags and _Tag.TIE in tags:
        scale, tie = tags[_Tag.SCALE], tags[_Tag.TIE]
        matrix = np.diag([scale[0], -scale[1]])
        return _of_corner(matrix, np.array(tie[3:5]) - matrix @ np.array(tie[:2]))
    return None


def _of_corner(matrix: Array, corner: Array) -> PixelPlace:
    """Return the map of a GeoTIFF, whose origin is the corner of the first pixel, not its middle."""
    return PixelPlace(matrix, corner + matrix @ [0.5, 0.5])


def _read(path: Path) -> PixelPlace:
    remedy = (
        "a world file has six lines: the change of x, of y by a column, by a row, and x, y of the first pixel"
    )
    try:
        numbers = [float(word.replace(",", ".")) for word in path.read_text(encoding="utf-8-sig").split()]
    except (OSError, ValueError) as error:
        raise SurveyError(f"cannot be read: {error}", where=str(path), remedy=remedy) from error
    if len(numbers) != 6:
        raise SurveyError(f"has {len(numbers)} numbers", where=str(path), remedy=remedy)
    a, d, b, e, c, f = numbers
    matrix = np.array([[a, b], [d, e]])
    if not np.isfinite(numbers).all() or abs(np.linalg.det(matrix)) < 1e-18:
        raise SurveyError("its pixels have no area", where=str(path), remedy=remedy)
    return PixelPlace(matrix, np.array([c, f]))
