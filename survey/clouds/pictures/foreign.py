"""What in a picture is no stone: openings, and what stands before the wall."""

import numpy as np

from survey.arrays import Bools
from survey.clouds.pictures.joints import WIDTH, Field

__all__ = ["covered", "openings"]

_DARK = 0.40  # lightness over that of the wall below which it is an opening: the darkest shade leaves more than half
_BEHIND = 0.12  # distance of an opening behind the faces [m], more than joints are deep
_BEFORE = (
    0.035  # distance before the faces of what is no stone [m], more than bosses of plain ashlar stand out
)
_GREEN = 11.0  # by which leaves are greener than the wall [units of a*]: 2.3 are just seen
_LEAST = 8.0  # width of an opening over that of a joint
_MIDDLE = (25.0, 75.0)  # per cent of the depths of a wall between which those of its faces lie


def openings(light: Field, depth: Field | None) -> Bools:
    """Return where (h, w) the wall is open: far darker than it, or deep behind it, and wide.

    Parameters
    ----------
    light : (h, w) L*
    depth : (h, w) distance before the plane of the wall [m], NaN where nothing is known; None without a scan
    """
    from scipy.ndimage import binary_opening, gaussian_filter, uniform_filter

    found = gaussian_filter(light, 0.5 * WIDTH) < _DARK * float(np.quantile(light, 0.75))
    if depth is not None and np.isfinite(depth).any():
        face = float(np.nanmedian(depth))
        # no point was scanned on the wall there, whatever the colour of what lies behind
        found = ~np.isfinite(depth) | (np.nan_to_num(depth, nan=0.0) < face - _BEHIND)
    # single points in an opening, and dark pores, are neither
    found = uniform_filter(found.astype(np.float32), 7) > 0.5
    size = round(_LEAST * WIDTH)
    # a square, separable and so as quick as two lines
    eroded: Bools = binary_opening(found, np.ones((1, size)))
    return np.asarray(binary_opening(eroded, np.ones((size, 1))), dtype=np.bool_)


def covered(green: Field, depth: Field | None) -> Bools:
    """Return where (h, w) something stands before the wall: leaves by their colour, anything by its depth.

    Parameters
    ----------
    green : (h, w) a*, negative where it is green
    depth : as in `openings`
    """
    from scipy.ndimage import binary_closing, binary_opening, uniform_filter

    leaves = green < float(np.median(green)) - _GREEN
    found = binary_opening(leaves, np.ones((3, 3)))
    if depth is not None and np.isfinite(depth).any():
        before = np.nan_to_num(depth, nan=0.0) > float(np.nanmedian(depth)) + _BEFORE
        found |= uniform_filter(before.astype(np.float32), 5) > 0.3
    return np.asarray(binary_closing(found, np.ones((5, 5))), dtype=np.bool_)
