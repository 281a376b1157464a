"""Blocks of disks whose contacts still hold, and those that have come off at the surface."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mechanics.arrays import Array, Bools, Ints
from mechanics.planar.measures.surface import profile

_SEVERAL = 5  # disks of a block, at least; fewer are debris
_HEIGHT_ROUNDING = 1e-9  # of the height of a disk's top, over its radius [-]


@dataclass(frozen=True)
class Blocks:
    """Groups of disks that contacts join which were there at the start and still hold.

    Attributes
    ----------
    label : (nd,) number of the block of each disk, by falling size
    size : (nb,) disks of each block
    detached : (n,) blocks of several disks at the free surface, none of which stood on the base at the start
    """

    label: Ints
    size: Ints
    detached: Ints

    @property
    def detached_disks(self) -> int:
        """Number of disks in detached blocks."""
        return int(self.size[self.detached].sum())

    @property
    def largest_share(self) -> float:
        """Share of the disks that the largest block holds [-]."""
        return float(self.size[0] / len(self.label))


def blocks_of(start: Array, now: Array, radius: Array, reach: float) -> Blocks:
    """Find the blocks of a cohesive sample.

    A contact holds as long as its disks stay within the range of the cohesion. Those that formed later do not count: a
    block that lies on others has come off all the same.

    Parameters
    ----------
    start, now : (nd, 2) centres [m]
    radius : (nd,) [m]
    reach : range of the cohesion, the largest gap of a contact that holds [m]

    Examples
    --------
    A square of 6 × 6 disks whose upper right quarter has moved by a radius:

    >>> place = np.array([(x, y) for y in range(6) for x in range(6)], dtype=float)
    >>> moved = place + 0.5 * ((place[:, :1] > 2.5) & (place[:, 1:] > 2.5))
    >>> found = blocks_of(place, moved, np.full(36, 0.5), 0.01)
    >>> found.size.tolist(), found.detached.tolist()
    ([27, 9], [1])
    """
    count = len(radius)
    pairs = cKDTree(start).query_pairs(2.0 * float(radius.max()) + reach, output_type="ndarray")
    intact = _holds(pairs, start, radius, reach) & _holds(pairs, now, radius, reach)
    first, second = pairs[intact].T
    joined = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    label = connected_components(joined, directed=False)[1]
    size = np.bincount(label)
    order = np.argsort(-size, kind="stable")
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    label, size = rank[label], size[order]
    tops = now[:, 1] + radius
    free = profile(now, radius, now[:, 0]) <= tops + _HEIGHT_ROUNDING * radius
    bottoms = start[:, 1] - radius
    on_base = bottoms - bottoms.min() < radius
    off = np.setdiff1d(label[free], label[on_base])
    return Blocks(label, size, off[size[off] >= _SEVERAL])


def _holds(pairs: Ints, place: Array, radius: Array, reach: float) -> Bools:
    first, second = pairs.T
    gap = np.linalg.norm(place[first] - place[second], axis=1) - radius[first] - radius[second]
    return np.asarray(gap <= reach)
