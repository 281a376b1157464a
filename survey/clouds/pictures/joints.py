"""Strength of joints: lines that differ from the stone on both sides, averaged along the best of many directions.

A joint is darker or lighter than what lies on both sides of it, or of another colour, or recessed. Channels
are first added with the
weights of Fisher's discriminant, contrast over variance, so that joints are high in one picture. At each
pixel and direction, the
picture is averaged along a short line; what it exceeds the lines on both sides by is its contrast, the
lesser of two, so that steps of
colour and edges of shade have none. The mean of contrasts along a long line leaves pores and grain behind
and bridges gaps. All of it
happens at a resolution at which a joint is `WIDTH` pixels wide, so that no length depends on the picture.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ROUNDED",
    "WIDTH",
    "Field",
    "Strength",
    "combined",
    "grain_and_contrast",
    "line_strength",
    "step_evidence",
]

WIDTH = 3.0
"""Width of a joint at the resolution of the work [px]."""

ROUNDED = 0.3
"""Noise that rounding to 8 bits leaves in a channel [units of L*, and of depth over its noise]."""

Field = NDArray[np.float32]

_DIRECTIONS = 16  # over half a turn: 11° apart, so that a line of 8 pixels leaves its pixels by less than one
_SHORT, _LONG = 3, 5  # doublings of the lines: 8 and 32 pixels
_NO_STEP, _STEP = 2.0, 5.0  # steps of colour that texture makes, and that two stones make [grains]
_SUREST_STEP = (
    0.5  # evidence of a step at most, over that of a usual joint: both edges of mortar are steps too
)
_SPARSE = 4  # pixels from one line whose contrast is counted to the next
_REACHES = (
    3,
    5,
)  # distances of the sides from the middle of a line [px]: narrow joints, and up to three times wider


@dataclass(frozen=True)
class Strength:
    """Strength of joints at every pixel.

    Attributes
    ----------
    evidence : (h, w) geometric mean of the contrasts along a short and a long line
    upright : (h, w) contrast along a short line, of lines within 25° of the vertical alone
    level : (h, w) of lines within 25° of the horizontal alone
    angle : (h, w) direction of the line, from the horizontal [rad]
    """

    evidence: Field
    upright: Field
    level: Field
    angle: Field


def combined(channels: list[Field]) -> Field:
    """Add channels (h, w) with the weights and signs by which joints stand out most; joints are high.

    The weight of a channel is the contrast of its lines over the square of its grain.
    """
    total = np.zeros_like(channels[0])
    for channel in channels:
        grain, contrast = grain_and_contrast(channel)
        total += np.float32(contrast / grain**2) * channel
    scale = 1.4826 * float(np.median(np.abs(total - np.median(total)))) + 1e-9
    return (total / scale).astype(np.float32)


def grain_and_contrast(channel: Field) -> tuple[float, float]:
    """Return grain and contrast of the joints of a channel (h, w); the contrast is negative if they are low.

    The contrast is what lines along rows and columns exceed both sides by, at the strongest fiftieth of the
    pixels, over that
    of the negative, since grain is as often lighter as darker. Grain is the mean of the differences between
    pixels at the
    distance of a joint, without the largest tenth, which edges make: a median would be zero where a file
    rounds colours.
    """
    from scipy.ndimage import gaussian_filter

    smooth = gaussian_filter(channel, 0.7)
    steps = np.concatenate(
        [np.abs(smooth[:, 3:] - smooth[:, :-3]).ravel(), np.abs(smooth[3:] - smooth[:-3]).ravel()]
    )
    steps = steps[:: max(1, len(steps) // 100_000)]
    grain = float(steps[steps <= np.quantile(steps, 0.9)].mean())
    contrast = 0.0
    for turned in (smooth, smooth.T):
        # along a line of 32 pixels, the mean of the next few is about the same
        line = np.ascontiguousarray(_means(np.ascontiguousarray(turned), 0.0, _LONG)[:, ::_SPARSE])
        for sign in (1.0, -1.0):
            contrast += sign * float(np.quantile(_exceeds(sign * line, 0.0, _REACHES[0]), 0.98))
    return 1.25 * grain + ROUNDED, contrast


def line_strength(image: Field) -> Strength:
    """Measure the strength of joints, which are high in a picture.

    Parameters
    ----------
    image : (h, w) at a resolution at which joints are `WIDTH` pixels wide
    """
    best = np.zeros_like(image)
    angle, level, upright = (np.zeros_like(image) for _ in range(3))
    for step in range(_DIRECTIONS):
        turn = np.pi * step / _DIRECTIONS
        steep, slope = _slope(turn)
        turned = np.ascontiguousarray(image.T) if steep else image
        line = _means(turned, -slope, _SHORT)
        contrast = np.maximum.reduce([_exceeds(line, -slope, reach) for reach in _REACHES])
        long = _means(contrast, -slope, _LONG)
        evidence = np.sqrt(np.maximum(contrast, 0.0) * np.maximum(long, 0.0))
        if steep:
            contrast, evidence = contrast.T, evidence.T
        better = evidence > best
        best = np.where(better, evidence, best)
        angle[better] = turn
        if min(turn, np.pi - turn) < np.radians(25.0):
            np.maximum(level, contrast, out=level)
        elif abs(turn - 0.5 * np.pi) < np.radians(25.0):
            np.maximum(upright, contrast, out=upright)
    return Strength(best, upright, level, angle)


def step_evidence(colours: NDArray[np.float32]) -> Field:
    """Return the evidence of a joint, 1 at a usual one, where colours differ on both sides of a straight line.

    Parameters
    ----------
    colours : (c, h, w) each over its grain, at the resolution of `line_strength`

    Returns
    -------
    (h, w) in proportion to the geometric mean of the steps across a short and a long line, beyond those of texture
    """
    best = np.zeros_like(colours[0])
    for step in range(0, _DIRECTIONS, 2):  # a step is wider than a line, and so less of a direction
        steep, slope = _slope(np.pi * step / _DIRECTIONS)
        short, long = (np.zeros_like(best.T if steep else best) for _ in range(2))
        for colour in colours:
            line = _means(np.ascontiguousarray(colour.T) if steep else colour, -slope, _SHORT)
            after, before = _sides(line, -slope, _REACHES[0])
            short += (after - before) ** 2
            long += _means(after - before, -slope, _LONG) ** 2
        mean = (short * long) ** np.float32(0.25)
        np.maximum(best, mean.T if steep else mean, out=best)
    share = np.clip((best - _NO_STEP) / (_STEP - _NO_STEP), 0.0, 1.0)
    steps: Field = (_SUREST_STEP * share).astype(np.float32)
    return steps


def _slope(turn: float) -> tuple[bool, float]:
    """Return whether a line is nearer to the vertical, and its slope from the nearer axis.

    Rows grow downwards: a line that rises to the right climbs to smaller rows.
    """
    steep = np.pi / 4 < turn < 3 * np.pi / 4
    return steep, float(1.0 / np.tan(turn) if steep else np.tan(turn))


def _means(image: Field, slope: float, doublings: int) -> Field:
    """Return means along lines of 2^doublings pixels about each pixel, whose rows change by `slope` a column."""
    out, count = image, 1
    for _ in range(doublings):
        out = 0.5 * (out + _shifted(out, round(count * slope), count))
        count *= 2
    half = count // 2
    return _shifted(out, -round(half * slope), -half)


def _shifted(image: Field, rows: int, columns: int) -> Field:
    """Return the picture (h, w) whose pixel is that some rows down and columns to the right; edges go on."""
    height, width = image.shape
    out = np.empty_like(image)
    if abs(rows) >= height or abs(columns) >= width:
        out[:] = image
        return out
    top, bottom = max(0, -rows), min(height, height - rows)
    first, last = max(0, -columns), min(width, width - columns)
    out[top:bottom, first:last] = image[top + rows : bottom + rows, first + columns : last + columns]
    out[top:bottom, :first] = out[top:bottom, first : first + 1]
    out[top:bottom, last:] = out[top:bottom, last - 1 : last]
    out[:top] = out[top]
    out[bottom:] = out[bottom - 1]
    return out


def _exceeds(line: Field, slope: float, reach: int) -> Field:
    """Return by how much each line exceeds both of those beside it at a distance, the lesser; 0 below."""
    return np.maximum(line - np.maximum(*_sides(line, slope, reach)), 0.0)


def _sides(line: Field, slope: float, reach: int) -> tuple[Field, Field]:
    """Return the lines at a distance on both sides of each."""
    length = float(np.hypot(1.0, slope))
    rows, columns = round(reach / length), round(-reach * slope / length)
    return _shifted(line, rows, columns), _shifted(line, -rows, -columns)
