"""Pictures of walls to find stones in: pixels, depth, what is left out, and their place in the wall's plane."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError, UsageError
from survey.arrays import Bools
from survey.clouds.pictures.joints import Field
from survey.clouds.views.orthophoto import DEPTH_STEP, filled
from survey.clouds.world import PixelPlace, world_of
from survey.conventions import NEGLIGIBLE

_STRETCHED = NEGLIGIBLE  # by which the two sides of a pixel may differ [-]
_INDEX = "cloud.json"  # of a folder that `moma cloud` writes


@dataclass(frozen=True)
class Photograph:
    """A picture of a wall.

    Attributes
    ----------
    path : the file
    pixels : (h, w, 3)
    depth : (h, w) distance before the wall's plane, gaps of a few pixels closed [m], NaN where nothing is
    known; None without a depth map left_out : (h, w) what is no wall, by a mask; None without one
    places : from pixels to metres of the wall's plane
    stated : whether the place of the picture is known; if not, its pixels count as millimetres
    """

    path: Path
    pixels: NDArray[np.uint8]
    depth: Field | None
    left_out: Bools | None
    places: PixelPlace
    stated: bool


def open_photograph(
    path: Path,
    *,
    pixel: float | None = None,
    size: tuple[float, float] | None = None,
    mask: Path | None = None,
    depth: Path | None = None,
) -> Photograph:
    """Open a picture of a wall.

    A world file or the tags of a GeoTIFF say where it lies; else `pixel` or `size` say how large it is, and
    its lower left corner is the origin. The depth map that `moma cloud` wrote beside an orthophoto is taken too.

    Parameters
    ----------
    path : PNG, JPEG, TIFF or another format of Pillow
    pixel : side of a pixel [m]
    size : width and height of the picture [m]
    mask : picture of the same size, white where there is no wall
    depth : depth map of 16 bits in steps of `DEPTH_STEP`; None: depth.png beside, if a cloud.json is there

    Raises
    ------
    UsageError, SurveyError
        if a file cannot be read, or the scale is stated twice or contradicts itself
    """
    picture, tags = _opened(path)
    pixels = _colours(picture)
    height, width = pixels.shape[:2]
    places, stated = _places(path, tags, (width, height), pixel, size)
    left_out = None
    if mask is not None:
        left_out = np.asarray(_opened(mask)[0].convert("L")) > 127
        _check_same(left_out.shape, (height, width), mask)
    beside = path.parent / "depth.png"
    index = path.parent / _INDEX
    if depth is None and path.name == "wall.png" and beside.is_file() and index.is_file():
        depth = beside
    depths = None
    if depth is not None:
        numbers = np.asarray(_opened(depth)[0]).astype(np.float32)
        _check_same(numbers.shape, (height, width), depth)
        lowest = _lowest(depth.parent / _INDEX)
        depths = filled(
            np.where(numbers > 0, lowest + (numbers - 1.0) * DEPTH_STEP, np.nan).astype(np.float32)
        )
    return Photograph(path, pixels, depths, left_out, places, stated)


def _colours(picture: Any) -> NDArray[np.uint8]:
    """Return the colours (h, w, 3) of a picture, row by row: its bytes as a whole would be there three times."""
    width, height = picture.size
    out = np.empty((height, width, 3), dtype=np.uint8)
    for row in range(height):
        out[row] = np.asarray(picture.crop((0, row, width, row + 1)).convert("RGB"))[0]
    return out


def _opened(path: Path) -> tuple[Any, dict[int, tuple[float, ...]]]:
    """Return a picture and the tags that say where it lies."""
    from PIL import Image

    if not path.is_file():
        raise UsageError("no such file", where=str(path), remedy="name a picture: PNG, JPEG or TIFF")
    limit = Image.MAX_IMAGE_PIXELS
    try:
        Image.MAX_IMAGE_PIXELS = None  # pictures of walls are large, and come from the user
        with Image.open(path) as picture:
            picture.load()
    except (OSError, ValueError, SyntaxError) as error:
        what = f"cannot be read as a picture: {' '.join(str(error).split())[:120]}"
        raise SurveyError(what, where=str(path), remedy="save it as PNG, JPEG or TIFF") from error
    finally:
        Image.MAX_IMAGE_PIXELS = limit
    tiff_tags = getattr(picture, "tag_v2", {})
    return picture, {tag: tuple(tiff_tags[tag]) for tag in (33550, 33922, 34264) if tag in tiff_tags}


def _places(
    path: Path,
    tags: dict[int, tuple[float, ...]],
    shape: tuple[int, int],
    pixel: float | None,
    size: tuple[float, float] | None,
) -> tuple[PixelPlace, bool]:
    """Return where the pixels lie, and whether anything says so."""
    width, height = shape
    world = world_of(path, tags)
    names = [name for name, one in (("--pixel", pixel), ("--size", size)) if one is not None]
    if world is not None and names:
        what = f"{names[0]} with a picture whose world file or tags say where it lies"
        raise UsageError(what, where=str(path), remedy="leave it out, or move the world file away")
    if len(names) == 2:
        raise UsageError("--pixel and --size", where=str(path), remedy="give one of them")
    if world is not None:
        return world, True
    if size is not None:
        across, up = size[0] / width, size[1] / height
        if abs(across / up - 1.0) > _STRETCHED:
            pixels = f"pixels of {across * 1e3:.2f} by {up * 1e3:.2f} mm"
            what = f"{width} × {height} pixels are not {size[0]:g} × {size[1]:g} m: {pixels}"
            raise UsageError(
                what, where="--size", remedy="crop the picture to the wall, and measure both sides"
            )
        pixel = float(np.sqrt(across * up))
    side = 0.001 if pixel is None else pixel
    return PixelPlace(
        np.diag([side, -side]), np.array([0.5 * side, (height - 0.5) * side])
    ), pixel is not None


def _lowest(index: Path) -> float:
    """Return the depth of the number 1 [m]; 0 if nothing states it."""
    if not index.is_file():
        return 0.0
    try:
        return float(json.loads(index.read_text(encoding="utf-8"))["depth_lowest"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        remedy = "run moma cloud again"
        raise SurveyError("does not state depth_lowest", where=str(index), remedy=remedy) from error


def _check_same(shape: tuple[int, ...], expected: tuple[int, int], path: Path) -> None:
    if shape != expected:
        what = f"has {shape[1]} × {shape[0]} pixels, the picture {expected[1]} × {expected[0]}"
        raise UsageError(what, where=str(path), remedy="give a picture of the same size")
