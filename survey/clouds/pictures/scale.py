"""Resolution of the work: that at which joints are as wide as the filters for them."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from survey.clouds.pictures.channels import channels_of
from survey.clouds.pictures.joints import WIDTH, Field, combined, grain_and_contrast

_WIDTHS = [width * 2.0**k for k in range(4) for width in (2.0, 3.0)]  # of joints that are tried [px]
_SAMPLE = 512  # side of the parts of a picture that they are tried on, at most [px]
_ENOUGH = 128.0  # side over the width of a joint from which a part is no larger: some courses of some stones


def joint_width(pixels: NDArray[np.uint8], depth: Field | None = None) -> tuple[float, float]:
    """Find the width of the joints of a picture by their contrast over grain at many resolutions.

    Parameters
    ----------
    pixels : (h, w, 3)
    depth : (h, w) distance before the wall's plane [m]; None without a depth map

    Returns
    -------
    width [px], and the best contrast of joints over grain
    """
    widths = []
    for width in _WIDTHS:
        if min(pixels.shape[:2]) * WIDTH / width < 40:
            break
        ratios = []
        for part in _parts(pixels.shape, min(_SAMPLE, round(_ENOUGH * width))):
            heights = None if depth is None else resized_field(depth[part], width / WIDTH)
            channels, _, _ = channels_of(resized(pixels[part], width / WIDTH), heights)
            grain, contrast = grain_and_contrast(combined(channels))
            ratios.append(contrast / grain)
        # the second best, where there are two: others may show a door, one may show a bush or a scaffold
        widths.append((width, sorted(ratios)[-2:][0]))
    if not widths:
        return WIDTH, 0.0
    best = max(ratio for _, ratio in widths)
    # of those that have half of the best contrast the finest, which has the better edges
    good = [width for width, ratio in widths if ratio >= min(0.5 * best, best)]
    # pixels between those of a picture show nothing more
    return next((width for width in good if width >= WIDTH), good[0]), best


def _parts(shape: tuple[int, ...], side: int) -> Iterator[tuple[slice, slice]]:
    """Yield parts of a picture, of a side [px]: the middle, and the corners if they are others."""
    height, width = shape[:2]
    rows, columns = max(0, height - side), max(0, width - side)
    places = {(rows // 2, columns // 2), (0, 0), (0, columns), (rows, 0), (rows, columns)}
    for top, start in sorted(places):
        yield slice(top, top + side), slice(start, start + side)


def resized(pixels: NDArray[np.uint8], factor: float) -> NDArray[np.uint8]:
    """Return a picture (h, w, 3) whose pixels are `factor` times as large, as means of those within."""
    from PIL import Image

    shape = _shape(pixels.shape, factor)
    filter = Image.Resampling.BOX if factor >= 1.0 else Image.Resampling.BICUBIC
    return np.asarray(Image.fromarray(pixels).resize(shape, filter))


def resized_field(field: Field, factor: float) -> Field:
    """Return a field (h, w) whose pixels are `factor` times as large; NaN where a pixel has one."""
    from PIL import Image

    shape = _shape(field.shape, factor)
    filter = Image.Resampling.BOX if factor >= 1.0 else Image.Resampling.BILINEAR
    return np.asarray(
        Image.fromarray(field.astype(np.float32), mode=None).resize(shape, filter), dtype=np.float32
    )


def _shape(shape: tuple[int, ...], factor: float) -> tuple[int, int]:
    return max(1, round(shape[1] / factor)), max(1, round(shape[0] / factor))
