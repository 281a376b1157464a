"""Channels of a picture in which joints may show: lightness, colours, depth, without what is no wall."""

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Bools
from survey.clouds.pictures.foreign import covered, openings
from survey.clouds.pictures.joints import Field

__all__ = ["channels_of", "lightness"]


def channels_of(
    pixels: NDArray[np.uint8], depth: Field | None = None, left_out: Bools | None = None
) -> tuple[list[Field], Bools, Bools]:
    """Return channels, where something stands before the wall, and where there is none, all (h, w).

    Parameters
    ----------
    pixels : (h, w, 3)
    depth : (h, w) distance before the wall's plane [m], NaN where nothing is known; None without a scan
    left_out : (h, w) what is no wall, as a mask says
    """
    light, green, blue = lightness(pixels)
    hidden, void = covered(green, depth), openings(light, depth)
    if left_out is not None:
        void = void | left_out
    channels = [light, green, blue, *([] if depth is None else [_relief(depth)])]
    return [_without(one, hidden | void) for one in channels], hidden, void


def lightness(pixels: NDArray[np.uint8]) -> tuple[Field, Field, Field]:
    """Return CIE lightness L*, a* and b* (each (h, w)) of sRGB pixels (h, w, 3)."""
    table = np.linspace(0.0, 1.0, 256)
    linear = np.where(table <= 0.04045, table / 12.92, ((table + 0.055) / 1.055) ** 2.4).astype(np.float32)
    rgb = linear[pixels[..., :3]]
    xyz = rgb @ np.array(
        [[0.4339, 0.2127, 0.0178], [0.3762, 0.7152, 0.1095], [0.1899, 0.0722, 0.8727]], dtype=np.float32
    )
    root = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    x, y, z = root[..., 0], root[..., 1], root[..., 2]
    return 116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)


def _relief(depth: Field) -> Field:
    """Return depth in thousandths of a metre, without what is far from the faces, gaps closed."""
    known = np.isfinite(depth)
    middle = float(np.median(depth[known])) if known.any() else 0.0
    return np.clip(np.where(known, 1e3 * (depth - middle), 0.0), -40.0, 40.0).astype(np.float32)


def _without(channel: Field, where: Bools) -> Field:
    """Return a channel whose hidden pixels have the mean of those around them, so that they show no joints."""
    from scipy.ndimage import distance_transform_edt

    if not where.any() or where.all():
        return channel
    nearest = distance_transform_edt(where, return_distances=False, return_indices=True)
    out: Field = channel[tuple(nearest)]
    return out
