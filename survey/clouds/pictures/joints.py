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

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ground.statistics.scale import CONSISTENT
from survey.arrays import Bools, Ints
from survey.clouds._kernels.lines import contrasts, keep_strongest, line_means, side_steps
from survey.conventions import MOST

WIDTH = 3.0
"""Width of a joint at the resolution of the work [px]."""

STRONGEST = 1.5
"""Strength over that of a usual joint above which more says nothing."""

ROUNDED = 0.3
"""Noise that rounding to 8 bits leaves in a channel [units of L*, and of depth over its noise]."""

Field = NDArray[np.float32]

_DIRECTIONS = 16  # over half a turn: 11° apart, so that a line of 9 pixels leaves its pixels by less than one
_SQUARE = np.radians(25.0)  # angle from the horizontal of beds, and of head joints from the vertical, at most
_SPARSE = 4  # pixels from one line to the next, whose mean is about the same
_SHORT = np.arange(-4, 5)  # places along a short line [px]
_LONG = _SPARSE * _SHORT  # along one of 33 pixels, of means along short lines
_BRIDGE = np.arange(-64, 65, 8)  # and of 129 pixels, as far as joints go on behind what hides them
_NO_STEP, _STEP = 2.0, 5.0  # steps of colour that texture makes, and that two stones make [grains]
_SUREST_STEP = (
    MOST  # evidence of a step at most, over that of a usual joint: both edges of mortar are steps too
)
_REACHES = (
    3,
    5,
)  # distances of the sides from the middle of a line [px]: narrow joints, and up to three times wider


DIRECTION = np.pi / _DIRECTIONS
"""Angle from one direction of lines to the next [rad]."""

STEP_REACH = _REACHES[0] + int(_SHORT[-1])
"""Distance from a step up to which colours tell of it [px]."""


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
    sparse = total[:: round(WIDTH)]
    scale = CONSISTENT * float(np.median(np.abs(sparse - np.median(sparse)))) + 1e-9
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
    from scipy.ndimage import gaussian_filter, uniform_filter1d

    smooth = gaussian_filter(channel, 0.7)
    steps = np.concatenate(
        [np.abs(smooth[:, 3:] - smooth[:, :-3]).ravel(), np.abs(smooth[3:] - smooth[:-3]).ravel()]
    )
    steps = steps[:: max(1, len(steps) // 100_000)]
    grain = float(steps[steps <= np.quantile(steps, 0.9)].mean())
    contrast = 0.0
    for axis, turn in ((1, 0.0), (0, 0.5 * np.pi)):
        line = uniform_filter1d(smooth, int(np.ptp(_LONG)) + 1, axis=axis)
        # along such a line, the mean of the next few is about the same
        sparse = np.ascontiguousarray(line[:, ::_SPARSE] if axis else line[::_SPARSE])
        exceeds = np.empty_like(sparse)
        for sign in (1.0, -1.0):
            contrasts(np.float32(sign) * sparse, *_sides(turn, _REACHES[:1]), exceeds)
            contrast += sign * float(np.median(np.quantile(exceeds, 0.98, axis=1 - axis)))
    return 1.25 * grain + ROUNDED, contrast


def line_strength(image: Field, hidden: Bools | None = None) -> Strength:
    """Measure the strength of joints, which are high in a picture.

    Parameters
    ----------
    image : (h, w) at a resolution at which joints are `WIDTH` pixels wide
    hidden : (h, w) where joints cannot be seen: those that end there go straight on; None: nowhere
    """
    veil = np.zeros(image.shape, dtype=np.bool_) if hidden is None else hidden
    covered, seen = veil.any(), (~veil).astype(np.float32)
    best, angle, level, upright = (np.zeros_like(image) for _ in range(4))
    line, contrast, long = (np.empty_like(image) for _ in range(3))
    for turn in _turns(1):
        line_means(image, *_along(turn, _SHORT), line)
        contrasts(line, *_sides(turn, _REACHES), contrast)
        if not covered:
            line_means(contrast, *_along(turn, _LONG), long)
        else:
            contrast *= seen
            _seen_means(contrast, seen, _along(turn, _LONG), line, long)
        keep_strongest(contrast, long, np.float32(turn), best, angle)
        if covered:
            _seen_means(contrast, seen, _along(turn, _BRIDGE), line, long)
            long[~veil] = 0.0
            keep_strongest(long, long, np.float32(turn), best, angle)
        for square, axis in ((level, 0.0), (upright, 0.5 * np.pi), (level, np.pi)):
            if abs(turn - axis) < _SQUARE:
                np.maximum(square, contrast, out=square)
    return Strength(np.sqrt(best, out=best), upright, level, angle)


def _seen_means(contrast: Field, seen: Field, places: tuple[Ints, Ints], share: Field, out: Field) -> None:
    """Compute the means of contrasts over what of a line is seen, or over a quarter of it if that is more."""
    line_means(contrast, *places, out)
    line_means(seen, *places, share)
    out /= np.maximum(share, 0.25, out=share)


def step_evidence(colours: NDArray[np.float32]) -> Field:
    """Return the evidence of a joint, 1 at a usual one, where colours differ on both sides of a straight line.

    Parameters
    ----------
    colours : (c, h, w) each over its grain, at the resolution of `line_strength`

    Returns
    -------
    (h, w) in proportion to the geometric mean of the steps across a short and a long line, beyond those of texture
    """
    line, step, long, total, total_long = (np.empty_like(colours[0]) for _ in range(5))
    best = np.zeros_like(line)
    for turn in _turns(2):  # a step is wider than a line, and so less of a direction
        down, right = _sides(turn, _REACHES[:1])
        total[:], total_long[:] = 0.0, 0.0
        for colour in colours:
            line_means(colour, *_along(turn, _SHORT), line)
            side_steps(line, down[0], right[0], step)
            line_means(step, *_along(turn, _LONG), long)
            total += np.square(step, out=step)
            total_long += np.square(long, out=long)
        np.maximum(best, np.multiply(total, total_long, out=total), out=best)
    del line, step, long, total, total_long
    share = np.clip((best ** np.float32(0.25) - _NO_STEP) / (_STEP - _NO_STEP), 0.0, 1.0)
    evidence: Field = (_SUREST_STEP * share).astype(np.float32)
    return evidence


def _turns(every: int) -> Iterator[float]:
    """Yield every so many of the directions of lines [rad]."""
    yield from (DIRECTION * np.arange(0, _DIRECTIONS, every)).tolist()


def _along(turn: float, places: Ints) -> tuple[Ints, Ints]:
    """Return rows and columns from a pixel to places along a line; a line that rises has fewer rows."""
    down, right = -np.sin(turn), np.cos(turn)
    larger = max(abs(down), abs(right))
    rows, columns = (np.round(places * step / larger).astype(np.int64) for step in (down, right))
    return rows, columns


def _sides(turn: float, reaches: tuple[int, ...]) -> tuple[Ints, Ints]:
    """Return rows and columns from the middle of a line to one of its sides at some distances."""
    apart = np.array(reaches)
    return np.round(apart * np.cos(turn)).astype(np.int64), np.round(apart * np.sin(turn)).astype(np.int64)
