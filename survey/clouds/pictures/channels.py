"""Channels of a picture in which joints may show, and what in it is no wall: openings, and what stands before it."""

import numpy as np
from numpy.typing import NDArray

from ground.statistics.scale import CONSISTENT
from survey.arrays import Bools
from survey.clouds.pictures.joints import ROUNDED, WIDTH, Field
from survey.conventions import SOME, WEAR

_DARK = 0.40  # lightness over that of the wall below which it is an opening: the darkest shade leaves more than half
_BLACK = 16.0  # L* + 16 is in proportion to the cube root of the luminance (CIE 1976)
_BEHIND = 0.12  # distance of an opening behind the faces [m], more than joints are deep
_BEFORE = (
    WEAR  # distance before the faces of what is no stone [m], more than bosses of plain ashlar stand out
)
_GREEN = 11.0  # by which leaves are greener than the wall [units of a*]: 2.3 are just seen
_DENSE = SOME  # part of the pixels before the wall from which it is hidden
_LEAST = 8.0  # width of an opening over that of a joint


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
    before = _before(green, depth)
    hidden, void = covered(before), openings(light, depth)
    if left_out is not None:
        void = void | left_out
    channels = [light, green, blue, *([] if depth is None else [_relief(depth)])]
    # single leaves are no stone either
    return _without(channels, hidden | void | before), hidden, void


def lightness(pixels: NDArray[np.uint8]) -> tuple[Field, Field, Field]:
    """Return CIE lightness L*, a* and b* (each (h, w)) of sRGB pixels (h, w, 3)."""
    table = np.linspace(0.0, 1.0, 256)
    linear = np.where(table <= 0.04045, table / 12.92, ((table + 0.055) / 1.055) ** 2.4).astype(np.float32)
    rgb = linear[pixels[..., :3]]
    xyz = rgb @ np.array(
        [[0.4339, 0.2127, 0.0178], [0.3762, 0.7152, 0.1095], [0.1899, 0.0722, 0.8727]], dtype=np.float32
    )
    root: Field = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0).astype(np.float32)
    x, y, z = root[..., 0], root[..., 1], root[..., 2]
    light, green, blue = 116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)
    return light.astype(np.float32), green.astype(np.float32), blue.astype(np.float32)


def without_shade(channels: list[Field]) -> list[Field]:
    """Return channels whose first three are the logarithm of L*, and a* and b* over it, all in units of L*.

    A shade divides the light by a factor. It lessens the contrast of L*, a* and b* within it; of these it changes
    the first by a constant, and the others not at all.
    """
    light, green, blue, *others = channels
    root = light + np.float32(_BLACK)
    usual = np.float32(np.median(root))
    return [usual * np.log(root / usual), green * usual / root, blue * usual / root, *others]


def grains(channels: list[Field]) -> NDArray[np.float32]:
    """Return smoothed channels (c, h, w), each over the usual difference between places two joints apart."""
    from scipy.ndimage import uniform_filter

    out = np.stack([uniform_filter(channel, round(WIDTH)) for channel in channels])
    apart = 2 * round(WIDTH)
    sparse = out[:, :: round(WIDTH)]
    usual = CONSISTENT * np.median(np.abs(sparse[:, :, apart:] - sparse[:, :, :-apart]), axis=(1, 2))
    least = ROUNDED / round(WIDTH)  # of the mean of its pixels
    over: Field = (out / np.maximum(usual, least)[:, None, None]).astype(np.float32)
    return over


def _relief(depth: Field) -> Field:
    """Return depth in thousandths of a metre, without what is far from the faces, gaps closed."""
    known = np.isfinite(depth)
    middle = float(np.median(depth[known])) if known.any() else 0.0
    return np.clip(np.where(known, 1e3 * (depth - middle), 0.0), -40.0, 40.0).astype(np.float32)


def _without(channels: list[Field], where: Bools) -> list[Field]:
    """Return channels whose hidden pixels have the value of the nearest that is seen, so that they show no joints."""
    from scipy.ndimage import distance_transform_edt

    if not where.any() or where.all():
        return channels
    nearest = tuple(distance_transform_edt(where, return_distances=False, return_indices=True))
    return [channel[nearest] for channel in channels]


def openings(light: Field, depth: Field | None) -> Bools:
    """Return the pixels (h, w) in which the wall is open: far darker than it, or deep behind it, and wide.

    Parameters
    ----------
    light : (h, w) L*
    depth : (h, w) distance before the plane of the wall [m], NaN where nothing is known; None without a scan
    """
    from scipy.ndimage import gaussian_filter, uniform_filter

    found = gaussian_filter(light, 0.5 * WIDTH) < _DARK * float(np.quantile(light, 0.75))
    if depth is not None and np.isfinite(depth).any():
        face = float(np.nanmedian(depth))
        # no point was scanned on the wall there, whatever the colour of what lies behind
        found = ~np.isfinite(depth) | (np.nan_to_num(depth, nan=0.0) < face - _BEHIND)
    # single points in an opening, and dark pores, are neither
    found = uniform_filter(found.astype(np.float32), 7) > 0.5
    size = round(_LEAST * WIDTH)
    return _runs(_runs(found, size).T, size).T


def _runs(where: Bools, least: int) -> Bools:
    """Return which pixels (h, w) are in a run along their row of at least so many that are chosen."""
    change = np.diff(np.pad(where, ((0, 0), (1, 1))).ravel().astype(np.int8), append=0)
    first, beyond = np.flatnonzero(change > 0), np.flatnonzero(change < 0)
    long = beyond - first >= least
    steps = np.zeros(change.shape, dtype=np.int8)
    steps[first[long]], steps[beyond[long]] = 1, -1
    out: Bools = np.cumsum(steps, dtype=np.int8).reshape(len(where), -1)[:, :-2] > 0
    return out


def _before(green: Field, depth: Field | None) -> Bools:
    """Return the pixels (h, w) that show what is before the wall: leaves by colour, anything by depth.

    Parameters
    ----------
    green : (h, w) a*, negative where it is green
    depth : as in `openings`
    """
    leaves = green < float(np.median(green)) - _GREEN
    if depth is not None and np.isfinite(depth).any():
        leaves |= np.nan_to_num(depth, nan=0.0) > float(np.nanmedian(depth)) + _BEFORE
    return leaves


def covered(before: Bools) -> Bools:
    """Return where (h, w) so much is before the wall that joints cannot be seen."""
    from scipy.ndimage import binary_closing, uniform_filter

    if not before.any():
        return before
    covering = uniform_filter(before.astype(np.float32), 5) > _DENSE
    return np.asarray(binary_closing(covering, np.ones((5, 5), dtype=bool)), dtype=np.bool_)
