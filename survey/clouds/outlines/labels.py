"""Label pictures: PNG or TIFF with one number or colour for each stone, or stones in white and mortar in black."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError
from survey.arrays import Array
from survey.clouds.outlines.classes import SMALLEST, check_stones, neck, of_class, refuse_mortar
from survey.clouds.outlines.outline import Attributes, Outline
from survey.clouds.outlines.tracing import few_corners, trace
from survey.clouds.world import PixelPlace, world_of
from survey.conventions import FEW, LISTED, MOST, NEGLIGIBLE
from survey.geometry.polygons import ring_area

_LARGEST = 1 << 24  # number of a stone: as many as there are colours
_GREY = NEGLIGIBLE  # share of pixels neither black, white nor between both, in a picture of two colours
_RIM = 5  # pixels of the square in which the smoothed edge between black and white has both
_DARK, _WHITE = 32, 223  # of 255
_SPECK = NEGLIGIBLE  # area of a piece over the median of all below which it is a speck, not a stone [-]
_WALL_SHARE = MOST  # share of a picture above which a piece is rather the wall than a stone
_WHOLE = 1.0 - FEW  # share of the largest piece above which the others are specks


@dataclass(frozen=True)
class Labels:
    """Stones of a picture by number.

    Attributes
    ----------
    path : the file
    numbers : (h, w) number of the stone of each pixel; 0: mortar
    values : number of each stone in the picture, by its number here; None if stones were numbered here
    specks : number of pieces that were too small for a stone
    smallest : pieces of fewer pixels are specks
    places : from pixels to metres of the wall; None if the file does not say
    """

    path: Path
    numbers: NDArray[np.int32]
    values: NDArray[np.int64] | None
    specks: int
    smallest: int
    places: PixelPlace | None


def read_labels(path: Path, stones: str | None = None) -> Labels:
    """Read a picture of labels.

    A picture with blacks and whites alone has stones in white and mortar in black, and each piece of white is a stone.
    In any other, each number or colour is a stone, and 0 or black is mortar.

    Parameters
    ----------
    path : the picture
    stones : number or colour of the stones in a picture of classes, each piece of which is a stone; None: as above

    Raises
    ------
    SurveyError
        if it cannot be read, has no stones, or one number is not one stone
    UsageError
        if it has no pixel of this number or colour
    """
    pixels, tags = _pixels(path)
    places = world_of(path, tags)
    two = _two_colours(pixels)
    if stones is None and two is not None:
        refuse_mortar(two, path)
    elif stones is not None:
        named = of_class(pixels, stones, path)
        # of black and white, with edges between them, the one that holds the colour that is named
        two = named if two is None else two if two[named].mean() > 0.5 else ~two
    if two is not None:
        numbers, specks, smallest = _pieces(two)
        if not numbers.any():
            raise SurveyError("no white piece is large enough for a stone", where=str(path), remedy=_REMEDY)
        return Labels(path, numbers, None, specks, smallest, places)
    colours = pixels.ndim == 3
    flat = _colour_numbers(pixels) if colours else pixels
    values, numbers = _ranked(flat, path)
    if len(values) < 2 or values[0] != 0:
        listed = ", ".join(f"#{value:06x}" if colours else str(value) for value in values[:LISTED].tolist())
        few = len(values) <= LISTED
        remedy = f"{_REMEDY}; or name that of the stones with --layer: {listed}" if few else _REMEDY
        raise SurveyError(f"{len(values)} numbers and no 0 among them", where=str(path), remedy=remedy)
    check_stones(numbers, values, colours, path)
    return Labels(path, numbers, None if colours else values, 0, SMALLEST, places)


_REMEDY = "a picture of labels has stones in white and mortar in black, or one number for each stone and 0 for mortar"


def outlines_of(labels: Labels, tolerance: float) -> Iterator[Outline]:
    """Trace the stones of a picture.

    Parameters
    ----------
    labels : the picture
    tolerance : largest distance of the boundary of a stone from the sides of its outline [px]

    Yields
    ------
    outlines in pixels: column and row, whole at the middle of a pixel
    """
    from scipy.ndimage import find_objects

    for number, box in enumerate(find_objects(labels.numbers), start=1):
        if box is None:
            continue
        mask = labels.numbers[box] == number
        if np.count_nonzero(mask) < SMALLEST:
            continue
        value = number if labels.values is None else int(labels.values[number])
        where = f"{labels.path}, label {value}"
        outline = outline_of_mask(number, mask, (box[1].start, box[0].start), tolerance, where)
        if outline is not None:
            share = np.count_nonzero(mask) / labels.numbers.size
            whole = ("whole wall", f"it fills {share:.0%} of the picture: joints may be missing in the mask")
            doubts = (*outline.doubts, *([whole] if share > _WALL_SHARE else []))
            yield replace(outline, code=f"S{value:03d}", doubts=doubts)


def outline_of_mask(
    number: int,
    mask: NDArray[np.bool_],
    corner: tuple[int, int],
    tolerance: float,
    where: str,
    attributes: Attributes | None = None,
) -> Outline | None:
    """Trace a mask, whose upper left pixel has this column and row; None if it has no area."""
    ring, pieces, share = trace(mask)
    if len(ring) < 3 or abs(ring_area(ring)) < 1.0:
        return None
    doubts = []
    if share < _WHOLE:
        doubts.append(("in pieces", f"{pieces} pieces; the largest, with {share:.0%} of the area, is taken"))
    if (bridged := neck(mask)) is not None:
        doubts.append(bridged)
    corners = few_corners(ring, tolerance) + corner
    return Outline(number, f"S{number:03d}", corners, attributes or Attributes(), where, tuple(doubts))


def _pixels(path: Path) -> tuple[NDArray[Any], dict[int, tuple[float, ...]]]:
    """Return the pixels of a picture, (h, w) or (h, w, 3), and the tags that say where they lie."""
    from PIL import Image

    limit = Image.MAX_IMAGE_PIXELS
    try:
        Image.MAX_IMAGE_PIXELS = None  # pictures of walls are large, and come from the user
        with Image.open(path) as picture:
            tiff_tags = getattr(picture, "tag_v2", {})
            tags = {tag: tuple(tiff_tags[tag]) for tag in (33550, 33922, 34264) if tag in tiff_tags}
            if picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info:
                return _opaque(np.asarray(picture.convert("RGBA"))), tags
            plain = {"CMYK": "RGB", "YCbCr": "RGB"}.get(picture.mode)
            return np.asarray(picture if plain is None else picture.convert(plain)), tags
    except (OSError, ValueError, SyntaxError) as error:
        what = f"cannot be read as a picture: {' '.join(str(error).split())[:120]}"
        raise SurveyError(what, where=str(path), remedy="save it as PNG or TIFF") from error
    finally:
        Image.MAX_IMAGE_PIXELS = limit


def _opaque(pixels: NDArray[np.uint8]) -> NDArray[Any]:
    """Return the colours of a picture (h, w, 4), black where it is transparent; of one colour alone, where it is."""
    seen = pixels[..., 3] > 127
    colours = np.where(seen[..., None], pixels[..., :3], np.uint8(0))
    drawn = pixels[seen, :3]
    return colours if seen.all() or not len(drawn) or (drawn != drawn[0]).any() else seen


def _two_colours(pixels: NDArray[Any]) -> NDArray[np.bool_] | None:
    """Return where a picture of black and white is white; None if it has other colours."""
    if pixels.dtype == np.bool_:
        return pixels.astype(np.bool_)
    if pixels.dtype != np.uint8:
        values = np.unique(pixels)
        return np.asarray(pixels != 0) if len(values) == 2 and values[0] == 0 else None
    grey = pixels if pixels.ndim == 2 else pixels[..., :3].max(axis=2)
    if pixels.ndim == 3 and int((grey - pixels[..., :3].min(axis=2)).max()) > 16:
        return None
    counts = np.bincount(grey.ravel(), minlength=256)
    used = np.flatnonzero(counts)
    if len(used) == 2 and used[0] == 0:
        return np.asarray(grey > 0)
    # labels that are counted from 1 fill the dark range without ever being white
    if not (counts[0] and counts[1:_DARK].sum() < 0.5 * counts[_WHITE:].sum()):
        return None
    return np.asarray(grey > 127) if _inner_greys(grey) < _GREY * grey.size else None


def _inner_greys(grey: NDArray[np.uint8]) -> int:
    """Return the number of pixels that are neither black nor white, nor of the smoothed edge between both."""
    from scipy.ndimage import maximum_filter, minimum_filter

    inner = (grey >= _DARK) & (grey <= _WHITE)
    inner &= (minimum_filter(grey, _RIM) >= _DARK) | (maximum_filter(grey, _RIM) <= _WHITE)
    return int(np.count_nonzero(inner))


def _pieces(white: NDArray[np.bool_]) -> tuple[NDArray[np.int32], int, int]:
    """Number the pieces of white from the ground up, row by row, and leave specks out.

    Returns
    -------
    numbers of the pixels, the number of specks, and the pixels of the smallest piece that is none
    """
    from scipy.ndimage import find_objects, label

    numbers, count = label(white)
    sizes = np.bincount(numbers.ravel(), minlength=count + 1)
    sizes[0] = 0
    fine, smallest = sizes >= SMALLEST, SMALLEST
    if fine.any():
        smallest = max(SMALLEST, int(np.ceil(_SPECK * float(np.median(sizes[fine])))))
        fine &= sizes >= smallest
    boxes = find_objects(numbers)
    good = np.flatnonzero(fine)
    middles = np.array([[0.5 * (boxes[k - 1][a].start + boxes[k - 1][a].stop) for a in (0, 1)] for k in good])
    order = _rows_from_below(middles, np.array([boxes[k - 1][0].stop - boxes[k - 1][0].start for k in good]))
    renumbered = np.zeros(count + 1, dtype=np.int32)
    renumbered[good[order]] = np.arange(1, len(good) + 1)
    return renumbered[numbers], int(np.count_nonzero(sizes)) - len(good), smallest


def _rows_from_below(middles: Array, heights: Array) -> NDArray[np.intp]:
    """Order places (row, column) in rows of about a stone's height, from the lowest, each from left to right."""
    if not len(middles):
        return np.empty(0, dtype=np.intp)
    row = np.floor((middles[:, 0].max() - middles[:, 0]) / max(float(np.median(heights)), 1.0) + 0.5)
    return np.lexsort((middles[:, 1], row))


def _ranked(pixels: NDArray[Any], path: Path) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Return the numbers of a picture, and the rank of that of each pixel, without sorting millions of pixels."""
    if pixels.dtype.kind not in "ui" or int(pixels.min()) < 0 or int(pixels.max()) > _LARGEST:
        what = f"numbers from {pixels.min():g} to {pixels.max():g}"
        raise SurveyError(what, where=str(path), remedy=f"number stones with whole numbers up to {_LARGEST}")
    there = np.zeros(int(pixels.max()) + 1, dtype=np.bool_)
    there[pixels] = True
    values = np.flatnonzero(there)
    ranks = np.zeros(len(there), dtype=np.int32)
    ranks[values] = np.arange(len(values), dtype=np.int32)
    return values, ranks[pixels]


def _colour_numbers(pixels: NDArray[Any]) -> NDArray[np.int32]:
    """Return the colours of a picture as numbers, black as 0."""
    red, green, blue = (pixels[..., k].astype(np.int32) for k in range(3))
    return (red << 16) | (green << 8) | blue
