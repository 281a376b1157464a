"""Orthophoto and depth map of a wall, painted point by point from clouds of any size."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError, UsageError
from ground.units import DECI, MILLI
from survey.arrays import Array, Bools
from survey.clouds._kernels.paint import Canvas, paint
from survey.clouds.points.chunks import PointCloud
from survey.clouds.wall import Wall
from survey.clouds.world import world_file
from survey.conventions import ALIKE, FEW, SOME, TRIALS, WIDEST_JOINT
from survey.quality.facades import upright_frame

DEPTH_STEP = DECI * MILLI
"""Step of the numbers of a depth map [m]."""

_LARGEST = 40_000_000  # pixels: 800 MB of sums
_SAMPLE = 4000  # points from which the plane of a wall is found
_CLOSE = WIDEST_JOINT  # distance of a wall's points from its plane [m]
_TRIES = TRIALS  # planes that are tried: a wall with a fifth of the points is met by three in 125
_UPRIGHT = math.sin(ALIKE)  # vertical component of the normal up to which a plane is a wall: 20°
_BEFORE = 0.3  # distance of ground from a wall [m]
_FOOT = SOME  # part of a wall's points below which the ground lies
_GROUND = FEW  # part of all points that makes it certain that there is ground
_FILLED = 2  # pixels by which gaps between points are closed
_LIGHT = np.array([-1.0, 1.0, 1.0])  # direction to the light of a relief: from the upper left

Progress = Callable[[str, int, int | None], None]


@dataclass(frozen=True)
class Picture:
    """Orthophoto and depth map.

    Attributes
    ----------
    wall : frame of its plane
    low : (2,) place (s, t) of its lower left corner [m]
    pixel : side of a pixel [m]
    counts : (h, w) points of each pixel, from the top
    depths : (h, w) mean distance of its points from the plane, towards the viewer [m]; NaN without points
    colours : (h, w, 3) mean colour; a relief where the cloud has none
    coloured : whether the cloud has colours or intensities
    """

    wall: Wall
    low: Array
    pixel: float
    counts: NDArray[np.float32]
    depths: NDArray[np.float32]
    colours: NDArray[np.uint8]
    coloured: bool


def find_wall(clouds: Sequence[PointCloud], progress: Progress) -> Wall:
    """Find the frame of the largest upright plane, seen from a scanner or from the ground before it.

    s begins at the left end of the wall, t is the height z.

    Raises
    ------
    SurveyError
        if there is none
    """
    origin = np.floor(clouds[0].near)
    sample = _sample(clouds, origin, progress)
    rng = np.random.default_rng(1)
    best, on_wall = 0, np.zeros(len(sample), dtype=bool)
    for _ in range(_TRIES if len(sample) > 3 else 0):
        a, b, c = sample[rng.integers(len(sample), size=3)]
        normal = np.cross(b - a, c - a)
        length = float(np.linalg.norm(normal))
        if length < 1e-6 or abs(normal[2]) > _UPRIGHT * length:
            continue
        close = np.abs((sample - a) @ normal) <= _CLOSE * length
        if (count := int(np.count_nonzero(close))) > best:
            best, on_wall = count, close
    if best < 20:
        remedy = 'state it: --wall FILE.toml, or two points on its foot: --wall "X,Y X,Y"'
        raise SurveyError("no upright plane among its points", where=str(clouds[0].path), remedy=remedy)
    normal = np.linalg.svd(sample[on_wall] - sample[on_wall].mean(axis=0), full_matrices=False)[2][2]
    middle = sample[on_wall].mean(axis=0)
    seen = [station.position - origin for cloud in clouds for station in cloud.stations]
    towards = normal @ (np.mean(seen, axis=0) - middle) if seen else _front(sample, on_wall, middle, normal)
    if towards < 0.0:
        normal = -normal
    flat = np.array([normal[0], normal[1], 0.0]) / np.hypot(normal[0], normal[1])
    frame = upright_frame(flat, middle)
    start = middle + float(((sample[on_wall] - middle) @ frame.axes[0]).min()) * frame.axes[0] + origin
    return Wall(np.array([start[0], start[1], 0.0]), frame.axes)


def _front(sample: Array, on_wall: Bools, middle: Array, normal: Array) -> float:
    """Return a number that is positive if a wall is seen from the side of its normal.

    The ground before it was scanned too; without ground, joints lie behind the faces of stones, which are more.
    """
    apart = (sample - middle) @ normal
    ground = (np.abs(apart) > _BEFORE) & (sample[:, 2] < np.quantile(sample[on_wall, 2], _FOOT))
    if np.count_nonzero(ground) > _GROUND * len(sample):
        return float(np.median(apart[ground]))
    return float(np.median(apart[on_wall]) - apart[on_wall].mean())


def _sample(clouds: Sequence[PointCloud], origin: Array, progress: Progress) -> Array:
    """Return some points from all parts of the clouds."""
    samples: list[Array] = []
    read, rng = 0, np.random.default_rng(0)
    for cloud in clouds:
        for chunk in cloud.chunks(origin, False):
            read += len(chunk.places)
            progress("look for the wall", read, None)
            few = min(len(chunk.places), _SAMPLE)
            samples.append(chunk.places[rng.integers(len(chunk.places), size=few)] if few else chunk.places)
    points = np.concatenate(samples) if samples else np.empty((0, 3))
    return points[rng.permutation(len(points))[:_SAMPLE]] if len(points) > _SAMPLE else points


def paint_wall(
    clouds: Sequence[PointCloud], wall: Wall, pixel: float, slab: float, progress: Progress
) -> tuple[Picture, int, int]:
    """Paint a wall, in two passes: the first finds how large the picture is.

    Parameters
    ----------
    clouds : the files
    wall : frame of its plane
    pixel : side of a pixel [m]
    slab : largest distance of a point from the plane [m]
    progress : told stage, points read, and their number

    Returns
    -------
    the picture, the number of points, and that of the points on it

    Raises
    ------
    UsageError
        if the picture would be too large
    SurveyError
        if no point is near the plane
    """
    origin = np.floor(clouds[0].near)
    local = wall.origin - origin
    low, high, read = _extent(clouds, wall, slab, origin, progress)
    low = np.floor(low / pixel) * pixel
    width, height = (int(pixels) for pixels in np.ceil((high - low) / pixel + 1e-9) + 1)
    if width * height > _LARGEST:
        remedy = f"take larger pixels, e.g. --pixel {pixel * np.sqrt(width * height / _LARGEST) * 1.05:.2g}"
        raise UsageError(f"a picture of {width} × {height} pixels", where="--pixel", remedy=remedy)
    corner = local + low[0] * wall.axes[0] + (low[1] + height * pixel) * wall.axes[1]
    counts = np.zeros((height, width), np.float32)
    canvas = Canvas(
        corner, wall.axes, pixel, slab, counts, counts.copy(), np.zeros((height, width, 3), np.float32)
    )
    shown, done, coloured, nothing = 0, 0, False, np.zeros((0, 3), np.uint8)
    for cloud in clouds:
        for chunk in cloud.chunks(origin, True):
            coloured |= chunk.colours is not None
            shown += paint(chunk.places, nothing if chunk.colours is None else chunk.colours, canvas)
            done += len(chunk.places)
            progress("paint", done, read)
    with np.errstate(invalid="ignore", divide="ignore"):
        depths = canvas.depths / counts
        mean = canvas.tints / counts[..., None] if coloured else None
    colours = _relief(filled(depths), pixel) if mean is None else _closed(mean, counts)
    return Picture(wall, low, pixel, counts, depths, colours, coloured), read, shown


def _extent(
    clouds: Sequence[PointCloud], wall: Wall, slab: float, origin: Array, progress: Progress
) -> tuple[Array, Array, int]:
    """Return the lowest and the highest corner (2,) of the points on a wall [m], and the number of all points."""
    local = wall.origin - origin
    low, high, read = np.full(2, np.inf), np.full(2, -np.inf), 0
    for cloud in clouds:
        for chunk in cloud.chunks(origin, False):
            flat = (chunk.places - local) @ wall.axes.T
            close = flat[np.abs(flat[:, 2]) <= slab, :2]
            read += len(flat)
            progress("measure the wall", read, None)
            if len(close):
                low, high = np.minimum(low, close.min(axis=0)), np.maximum(high, close.max(axis=0))
    if not np.isfinite(low).all():
        remedy = "check --wall, or widen --slab"
        what = f"none of its {read} points is within {slab:g} m of the wall"
        raise SurveyError(what, where=str(clouds[0].path), remedy=remedy)
    return low, high, read


def _closed(mean: NDArray[np.float32], counts: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Close small gaps between points; larger ones are black."""
    tints = filled(np.where((counts > 0)[..., None], mean, np.nan))
    out: NDArray[np.uint8] = np.clip(np.round(np.nan_to_num(tints)), 0.0, 255.0).astype(np.uint8)
    return out


def filled(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Close gaps of a few pixels, which are NaN, with the mean of their neighbours.

    Parameters
    ----------
    values : (h, w) or (h, w, 3)
    """
    out: NDArray[np.float32] = values.reshape(*values.shape[:2], -1).copy()
    for _ in range(_FILLED):
        painted = ~np.isnan(out[..., 0])
        total, number = np.zeros_like(out), np.zeros(painted.shape, np.float32)
        for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
            there = np.roll(painted, step, axis)
            total += np.where(there[..., None], np.roll(out, step, axis), 0.0)
            number += there
        gaps = ~painted & (number >= 2)
        out[gaps] = total[gaps] / number[gaps][:, None]
    return out.reshape(values.shape)


def _relief(depths: NDArray[np.float32], pixel: float) -> NDArray[np.uint8]:
    """Shade a depth map as if lit from the upper left."""
    depths_filled = np.where(np.isfinite(depths), depths, np.nanmedian(depths))
    down, right = (
        np.gradient(depths_filled, pixel)
        if min(depths_filled.shape) > 1
        else (depths_filled * 0.0, depths_filled * 0.0)
    )
    normal = np.stack([-right, down, np.ones_like(depths_filled)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    shade = np.clip(normal @ _LIGHT / np.linalg.norm(_LIGHT), 0.0, 1.0) * 230.0
    shade[~np.isfinite(depths)] = 0.0
    return np.repeat(shade.astype(np.uint8)[..., None], 3, axis=-1)


def write_picture(picture: Picture, photo: Path, depth: Path) -> float:
    """Write orthophoto and depth map as PNG with their world files; return the depth of the number 1 [m].

    The depth map has 16 bits: 0 without points, otherwise 1 + (depth - lowest) / `DEPTH_STEP`.
    """
    from PIL import Image

    finite = np.isfinite(picture.depths)
    lowest = float(np.floor(np.nanmin(picture.depths) / DEPTH_STEP) * DEPTH_STEP)
    numbers = np.where(
        finite, np.round((np.where(finite, picture.depths, lowest) - lowest) / DEPTH_STEP) + 1.0, 0.0
    )
    Image.fromarray(np.clip(numbers, 0, 65535).astype(np.uint16)).save(depth)
    Image.fromarray(picture.colours).save(photo)
    height = len(picture.counts)
    s, t = (picture.low + np.array([0.5, height - 0.5]) * picture.pixel).tolist()
    text = "".join(f"{one!r}\n" for one in (picture.pixel, 0.0, 0.0, -picture.pixel, s, t))
    for path in (photo, depth):
        world_file(path).write_text(text, encoding="ascii")
    return lowest
