"""One pass over a cloud, which keeps a random sample of the points of each patch of each stone.

Memory is bounded by the number of stones, not by that of points: a face is divided into some 36 patches, and each keeps
up to `_PATCH_POINTS` points. Chunks are read while the chunk before is sorted.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Ints
from survey.clouds._kernels.collect import Frames, Grid, Patches, Rings, Samples, collect
from survey.clouds.placing import PlacedOutline
from survey.clouds.points.chunks import PointCloud
from survey.conventions import ENOUGH, JOINT, SAMPLE, STEP

_PATCHES = 36  # of a face: the fit of planes tells outliers apart best among 20 to 50 points
_DENSE = ENOUGH  # points of a patch whose mean says something
_MIN_PATCHES = SAMPLE  # patches from which a plane and its scatter are known
_PATCH_POINTS = (
    24  # points of a patch: beyond, the mean of a patch is known better than its roughness lets it matter
)
_SMALLEST = JOINT  # side of a patch: less than the roughness of a stone is long [m]
_MAX_PATCHES = 144  # patches of a face that is much longer than high
_CUBES = 2_000_000  # cubes of space, for each of which the outlines near it are listed: 16 MB of starts
_FINEST = STEP  # side of a cube [m]


@dataclass(frozen=True)
class Collected:
    """Samples of the points of all stones.

    Attributes
    ----------
    patches : into which faces are divided
    samples : points of each patch
    read : points of the clouds
    inside : points that lie in an outline
    """

    patches: Patches
    samples: Samples
    read: int
    inside: int

    def of(self, k: int) -> tuple[Ints, NDArray[np.float32], int]:
        """Return counts and sampled places of the patches of an outline, and the patches in a row.

        In a sparse scan, four patches are one, until most of them have some points.
        """
        rows = slice(self.patches.first[k], self.patches.first[k + 1])
        counts, places, columns = (
            self.samples.counts[rows],
            self.samples.places[rows],
            int(self.patches.columns[k]),
        )
        while len(counts) >= 2 * _MIN_PATCHES and np.count_nonzero(counts >= _DENSE) < _MIN_PATCHES:
            counts, places, columns = _coarser(counts, places, columns)
        return counts, places, columns


def _coarser(
    counts: Ints, places: NDArray[np.float32], columns: int
) -> tuple[Ints, NDArray[np.float32], int]:
    """Join two by two patches; of sparse ones, which keep all their points."""
    rows, wide, high = len(counts) // columns, (columns + 1) // 2, (len(counts) // columns + 1) // 2
    new_counts = np.zeros(wide * high, np.int64)
    new_places = np.zeros((wide * high, 4 * places.shape[1], 3), np.float32)
    for p in range(rows * columns):
        target = (p // columns // 2) * wide + p % columns // 2
        count = min(int(counts[p]), places.shape[1])
        start = int(new_counts[target])
        new_places[target, start : start + count] = places[p, :count]
        new_counts[target] += count
    return new_counts, new_places, wide


def divide(placed: Sequence[PlacedOutline], margins: Array) -> Patches:
    """Divide faces into patches.

    Parameters
    ----------
    placed : outlines
    margins : (n,) width along the edges that is left out [m]
    """
    low = np.array([outline.ring.min(axis=0) for outline in placed]) + margins[:, None]
    high = np.array([outline.ring.max(axis=0) for outline in placed]) - margins[:, None]
    extent = np.maximum(high - low, 1e-6)
    inner = np.minimum(np.array([outline.area for outline in placed]), extent.prod(axis=1))
    side = np.maximum(np.sqrt(inner / _PATCHES), _SMALLEST)
    # a slanting face fills little of its box
    side = np.maximum(side, np.sqrt(extent.prod(axis=1) / _MAX_PATCHES))
    shape = np.maximum(np.ceil(extent / side[:, None]), 1).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(shape.prod(axis=1))]).astype(np.int64)
    return Patches(first, np.ascontiguousarray(shape[:, 0]), low, high, side)


def collect_points(
    clouds: Sequence[PointCloud],
    placed: Sequence[PlacedOutline],
    margins: Array,
    slab: float,
    progress: Callable[[int, int | None], None] = lambda done, total: None,
) -> Collected:
    """Read clouds once, and sort their points into the patches of stones.

    Parameters
    ----------
    clouds : the files
    placed : outlines of the stones
    margins : (n,) width along the edge of each that is left out [m]
    slab : largest distance of a point from the plane of an outline along the line of sight [m]
    progress : called with the number of points read, and of all if it is known
    """
    # relative to a place of the wall, single precision keeps micrometres
    origin = np.floor(placed[0].origin)
    origins = np.array([outline.origin for outline in placed]) - origin
    frames = Frames(origins, np.array([outline.axes for outline in placed]), slab)
    start = np.concatenate([[0], np.cumsum([len(outline.ring) for outline in placed])]).astype(np.int64)
    rings = Rings(start, np.ascontiguousarray(np.concatenate([outline.ring for outline in placed])), margins)
    patches = divide(placed, margins)
    count = int(patches.first[-1])
    samples = Samples(np.zeros(count, np.int64), np.zeros((count, _PATCH_POINTS, 3), np.float32))
    grid = _grid(placed, origin, slab)
    counts = [cloud.count for cloud in clouds]
    total = None if None in counts else sum(count or 0 for count in counts)
    read = inside = 0
    with ThreadPoolExecutor(1) as beside:
        sorting: Future[int] | None = None
        for cloud in clouds:
            for chunk in cloud.chunks(origin, False):
                inside += 0 if sorting is None else sorting.result()
                sorting = beside.submit(collect, chunk.places, frames, rings, patches, grid, samples)
                read += len(chunk.places)
                progress(read, total)
        inside += 0 if sorting is None else sorting.result()
    return Collected(patches, samples, read, inside)


def _grid(placed: Sequence[PlacedOutline], origin: Array, slab: float) -> Grid:
    """List the outlines whose slab reaches into each cube of space."""
    boxes = np.array([_box(outline, slab) for outline in placed]) - origin
    low, high = boxes[:, 0].min(axis=0) - 1e-6, boxes[:, 1].max(axis=0) + 1e-6
    extent = high - low
    side = max(_FINEST, 0.25 * float(np.median([np.sqrt(outline.area) for outline in placed])))
    while np.prod(np.ceil(extent / side)) > _CUBES:
        side *= 1.25
    shape = np.ceil(extent / side).astype(np.int64)
    # at most the last cube, whatever rounding does
    first = np.minimum(((boxes[:, 0] - low) / side).astype(np.int64), shape - 1)
    last = np.minimum(((boxes[:, 1] - low) / side).astype(np.int64), shape - 1)
    cubes, members = [], []
    for k, (a, b) in enumerate(zip(first, last, strict=True)):
        x, y, z = (np.arange(a[j], b[j] + 1) for j in range(3))
        cells = ((x[:, None, None] * shape[1] + y[:, None]) * shape[2] + z).ravel()
        cubes.append(cells)
        members.append(np.full(len(cells), k, dtype=np.int32))
    cube, member = np.concatenate(cubes), np.concatenate(members)
    order = np.argsort(cube, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(cube, minlength=int(shape.prod())))]).astype(np.int64)
    return Grid(low, side, shape, start, member[order])


def _box(outline: PlacedOutline, slab: float) -> Array:
    """Return the lowest and highest corner (2, 3) of the slab of an outline."""
    flat = outline.origin + outline.ring @ outline.axes[:2]
    reach = slab * np.abs(outline.axes[2])
    return np.array([flat.min(axis=0) - reach, flat.max(axis=0) + reach])
