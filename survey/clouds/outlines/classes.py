"""Pictures of labels that are none: classes instead of stones, resampled colours, white mortar; and bridged stones."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError, UsageError
from survey.arrays import Array, Bools, Ints
from survey.conventions import CHECKED, GROUP, MOST, NEGLIGIBLE, TENTH
from survey.formats.tables.kinds import KINDS, kind_of

_PIECES = CHECKED  # pieces of one number, of which none has half of its area, that make it a class
_MIN_PIECES = GROUP  # pieces of black that stones in black have at least
SMALLEST = 12  # pixels of the smallest piece that can be a stone
_BRIDGE = 2.0  # pixels: half of the widest bridge that a slip of the brush makes
_SLENDER = NEGLIGIBLE  # of the side of a stone: half the width of a neck that is questioned
_MIN_PIECE_SHARE = (
    TENTH  # least share of a stone's area in each of the parts that hang together by a neck [-]
)
_EXPORT = "export it as it is, in its own size and without smoothing, e.g. as PNG"


def of_class(pixels: NDArray[Any], name: str, path: Path) -> Bools:
    """Return where a picture (h, w) or (h, w, 3) has a class, given by its number or colour.

    Parameters
    ----------
    pixels : of the picture
    name : number such as "100", or colour such as "#ff0000"
    path : of the picture

    Raises
    ------
    UsageError
        if it is no number or colour of this picture
    """
    text = name.strip().removeprefix("#")
    try:
        value = int(text, 16 if pixels.ndim == 3 else 10)
    except ValueError as error:
        remedy = "give a colour such as #ff0000" if pixels.ndim == 3 else "give a number such as 100"
        raise UsageError(f"--layer is {name!r}", where=str(path), remedy=remedy) from error
    flat = pixels.astype(np.int64)
    if pixels.ndim == 3:
        flat = (flat[..., 0] << 16) | (flat[..., 1] << 8) | flat[..., 2]
    found: Bools = flat == value
    if not found.any():
        there = np.unique(flat)
        some = ", ".join(_named(one, pixels.ndim == 3) for one in there[:8].tolist())
        remedy = f"the picture has {some}{', …' if len(there) > 8 else ''}"
        raise UsageError(f"no pixel is {name}", where=str(path), remedy=remedy)
    return found


def class_of_stones(path: Path, counts: Mapping[str, int], label: str | None, what: str) -> str | None:
    """Return the class of annotations that are stones; None: all are.

    Parameters
    ----------
    path : of the annotations
    counts : number of annotations by class
    label : that the user has named
    what : the classes are called, in the plural

    Raises
    ------
    UsageError
        if there is no such class, or none of several is named and they are not kinds of stones
    """
    listed = ", ".join(f"{name} ({count})" for name, count in counts.items())
    if label is not None and label not in counts:
        raise UsageError(f"no {label!r} among the {what}", where=str(path), remedy=f"{what} are: {listed}")
    if label is None and len(counts) > 1 and not all(kind_of(name, {}) in KINDS for name in counts):
        remedy = f"name that of the stones, e.g. --layer {max(counts, key=counts.__getitem__)}"
        raise UsageError(f"{len(counts)} {what}: {listed}", where=str(path), remedy=remedy)
    return label


def check_stones(numbers: NDArray[np.int32], values: Ints, colours: bool, path: Path) -> None:
    """Check that each number or colour of a picture can be a stone.

    Parameters
    ----------
    numbers : (h, w) rank of the number of each pixel; 0: mortar
    values : (n,) the numbers
    colours : whether they are colours
    path : of the picture

    Raises
    ------
    SurveyError
        if most colours are rims, as resampling makes them, or one has many pieces, as a class has
    """
    from scipy.ndimage import find_objects, label

    alike = np.ones(numbers.shape, np.bool_)
    alike[1:] &= numbers[1:] == numbers[:-1]
    alike[:-1] &= numbers[1:] == numbers[:-1]
    alike[:, 1:] &= numbers[:, 1:] == numbers[:, :-1]
    alike[:, :-1] &= numbers[:, 1:] == numbers[:, :-1]
    solid = np.bincount(numbers[alike], minlength=len(values)) > 0
    if (rims := int(np.count_nonzero(~solid[1:]))) > np.count_nonzero(solid[1:]):
        what = (
            f"{rims} of {len(values)} numbers or colours are thin rims: the picture was resampled or smoothed"
        )
        raise SurveyError(what, where=str(path), remedy=_EXPORT)
    classes = {}
    for number, box in enumerate(find_objects(numbers), start=1):
        if box is None:
            continue
        sizes = np.bincount(label(numbers[box] == number)[0].ravel())[1:]
        pieces = int(np.count_nonzero(sizes >= SMALLEST))
        if pieces >= _PIECES and sizes.max() < MOST * sizes.sum():
            classes[_named(int(values[number]), colours)] = pieces
    if classes:
        most = max(classes, key=lambda class_: classes[class_])
        what = " and ".join(
            f"{name} has {pieces} pieces" for name, pieces in list(classes.items())[:_MIN_PIECES]
        )
        remedy = (
            f"say which number or colour the stones have, e.g. --layer {most}: each of its pieces is a stone"
        )
        raise SurveyError(f"{what}: a picture of classes, not of stones", where=str(path), remedy=remedy)


def refuse_mortar(white: Bools, path: Path) -> None:
    """Refuse a picture of black and white whose white is the mortar.

    Raises
    ------
    SurveyError
        if one piece has most of the white, black has many pieces, and most of these are wider than what parts them from
        the next: an opening in white may be wider than any stone
    """
    from scipy.ndimage import distance_transform_edt, label
    from scipy.ndimage import maximum as largest_of

    if _largest(label(white)[0]) <= MOST * np.count_nonzero(white):
        return
    pieces = label(~white)[0]
    sizes = np.bincount(pieces.ravel())[1:]
    large = np.flatnonzero(sizes >= SMALLEST) + 1
    if len(large) < _MIN_PIECES or sizes.max() > MOST * sizes.sum():
        return
    widths = 2.0 * np.asarray(largest_of(distance_transform_edt(~white), pieces, large))
    if np.median(widths - _gaps(pieces)[large]) > 0.0:
        what = f"one piece has most of the white, and black has {len(large)} pieces: white is the mortar"
        remedy = (
            "invert it, so that stones are white; or name the number or colour of the stones, e.g. --layer 0"
        )
        raise SurveyError(what, where=str(path), remedy=remedy)


def _gaps(pieces: NDArray[np.signedinteger]) -> Array:
    """Return the distance of each numbered piece from the next; infinite for 0, and for a piece alone [px]."""
    from scipy.ndimage import distance_transform_edt

    away, nearest = distance_transform_edt(pieces == 0, return_indices=True)
    of_piece = pieces[tuple(nearest)]
    gaps = np.full(int(pieces.max()) + 1, np.inf)
    for first, second in (
        ((slice(None), slice(1, None)), (slice(None), slice(-1))),
        ((slice(1, None),), (slice(-1),)),
    ):
        border = of_piece[first] != of_piece[second]
        across = away[first][border] + away[second][border]
        np.minimum.at(gaps, of_piece[first][border], across)
        np.minimum.at(gaps, of_piece[second][border], across)
    return gaps


def neck(mask: Bools) -> tuple[str, str] | None:
    """Return the doubt that the largest piece of a mask (h, w) is of two stones, joined by a bridge; None where not."""
    from scipy.ndimage import distance_transform_edt, label

    pieces, count = label(mask)
    if count > 1:
        mask = pieces == 1 + int(np.argmax(np.bincount(pieces.ravel())[1:]))
    area = int(np.count_nonzero(mask))
    half = max(_BRIDGE, _SLENDER * float(np.sqrt(area)))
    deep = distance_transform_edt(np.pad(mask, 1)) > half
    sizes = np.bincount(label(deep)[0].ravel())[1:]
    large = np.sort(sizes[sizes > _MIN_PIECE_SHARE * area])[::-1]
    if len(large) < 2:
        return None
    shares = " and ".join(f"{one / area:.0%}" for one in large.tolist())
    text = f"parts of {shares} of its area hang together by {2.0 * half:.0f} pixels or less: several stones?"
    return "neck", text


def _largest(pieces: NDArray[np.signedinteger]) -> int:
    return int(np.bincount(pieces.ravel())[1:].max(initial=0))


def _named(value: int, colour: bool) -> str:
    return f"#{value:06x}" if colour else str(value)
