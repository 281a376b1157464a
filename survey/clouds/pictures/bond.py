"""Knowledge of masonry about borders: the probability that two regions are two stones, and regions that are one.

The probability is a logistic function of what was measured along a border and of the shapes on both sides of it: the
mean strength of its joint, the share of it without a joint, the step of colour across it, how far the union of both is
a fuller rectangle than each alone (a stone of ashlar is one, a course of two half-height stones is not), how level or
upright it is, and the size of the smaller. Its weights were fitted to rendered walls with known stones
(`python -m benchmarks.outlines --fit`), not to photographs.
"""

import heapq
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from survey.arrays import Array, Bools, Ints
from survey.clouds.pictures.joints import STRONGEST, WIDTH, Strength
from survey.clouds.pictures.regions import borders_of
from survey.conventions import SOME

FEATURES = ("constant", "strength", "gaps", "fuller", "askew", "size", "step")
"""Names of what the probability depends on."""

WEIGHTS: Mapping[str, tuple[float, ...]] = MappingProxyType(
    {
        name: tuple(weights)
        for name, weights in json.loads(Path(__file__).with_name("weights.json").read_text("utf-8")).items()
    }
)
"""Weights by the kind of masonry, of missing joints, and of all borders that stay, that
`python -m benchmarks.outlines --fit` fits."""

GAP = SOME
"""Strength over that of a usual joint below which there is none."""

LIKELY = 0.6
"""Probability from which a border stays. Photographs have blots that rendered walls lack: on twelve of them 6 % of
the stones are split at 0.5, 2 % at 0.6, 1 % at 0.7, where one in 138 fewer is found."""

_LARGE = 20.0  # size of a region over the width of a joint from which it is surely no fragment


@dataclass
class Border:
    """A border: pixels along it, and sums of strength, gaps, rows, columns, and of pixels that part columns.

    After these, `steps` has the number of pixels beyond which both regions go on, and the sums of the steps of the
    colours there, from the region of the lower number to the other.
    """

    length: float
    sums: Array
    steps: Array

    def joined(self, other: "Border") -> "Border":
        """Return both as one."""
        return Border(self.length + other.length, self.sums + other.sums, self.steps + other.steps)

    def turned(self) -> "Border":
        """Return it as the other region sees it."""
        return Border(self.length, self.sums, np.concatenate([self.steps[:1], -self.steps[1:]]))


@dataclass
class Bond:
    """Regions and the borders between them, which change as regions are joined.

    Attributes
    ----------
    weights : of `FEATURES`
    areas : pixels of each region
    boxes : (4,) first and last row and column of each
    borders : by region and neighbour, both ways
    joined : into which region each went
    """

    weights: Array
    areas: dict[int, float]
    boxes: dict[int, tuple[int, int, int, int]]
    borders: dict[int, dict[int, Border]]
    joined: dict[int, int] = field(default_factory=dict)

    def features(self, a: int, b: int) -> Array:
        """Return the features (7,) of the border between two regions."""
        border = self.borders[a][b]
        strength, gaps, _, _, across = border.sums / border.length
        first, second = self.areas[a], self.areas[b]
        fill = (first * self._fill(a) + second * self._fill(b)) / (first + second)
        box = _union(self.boxes[a], self.boxes[b])
        fuller = (first + second) / _box_area(box) - fill
        askew = 1.0 - abs(2.0 * across - 1.0)
        size = np.log(min(np.sqrt(min(first, second)) / WIDTH, _LARGE))
        step = np.linalg.norm(border.steps[1:]) / max(border.steps[0], 1.0)
        return np.array([1.0, strength, gaps, fuller, askew, size, np.log1p(step)])

    def probability(self, a: int, b: int) -> float:
        """Return the probability that there is a joint between two regions."""
        return float(expit(self.features(a, b) @ self.weights))

    def certainty(self, a: int, b: int) -> float:
        """Return that probability if no border is to be joined any more: of those that stay, more are joints."""
        constant, slope = WEIGHTS["stayed"]
        return float(expit(constant + slope * (self.features(a, b) @ self.weights)))

    def join(self, a: int, b: int) -> None:
        """Make one region of two; it keeps the number `a`."""
        self.areas[a] += self.areas.pop(b)
        self.boxes[a] = _union(self.boxes[a], self.boxes.pop(b))
        for c, border in self.borders.pop(b).items():
            del self.borders[c][b]
            if c == a:
                continue
            border = border if (b < c) == (a < c) else border.turned()
            merged = border if c not in self.borders[a] else self.borders[a][c].joined(border)
            self.borders[a][c] = self.borders[c][a] = merged
        self.joined[b] = a

    def _fill(self, a: int) -> float:
        return self.areas[a] / _box_area(self.boxes[a])


def bond_of(
    regions: Ints, strength: Strength, colours: NDArray[np.float32], hidden: Bools, kind: str
) -> Bond:
    """Gather the regions of a picture and their borders.

    Parameters
    ----------
    regions : (h, w) numbers; 0 is no region
    strength : of joints, 1 at a usual one
    colours : (c, h, w) each over its grain
    hidden : (h, w) where joints cannot be seen
    kind : of masonry, a key of `WEIGHTS`
    """
    from scipy.ndimage import find_objects

    ratio = np.minimum(strength.evidence, STRONGEST).astype(np.float32)
    # what is not seen is as likely a joint as none
    joint = np.where(hidden, np.float32(0.5), ratio >= GAP).astype(np.float32)
    ratio[hidden] = 0.5
    found = borders_of(regions, np.stack([ratio, joint]), colours, hidden)
    sums = found.sums.copy()
    sums[:, 1] = found.lengths - sums[:, 1]  # a gap where neither side has a joint
    borders: dict[int, dict[int, Border]] = {}
    areas = np.bincount(regions.ravel())
    boxes = find_objects(regions)
    for k in np.flatnonzero(areas).tolist():
        if k:
            borders[k] = {}
    every = zip(found.pairs.tolist(), found.lengths.tolist(), sums, found.steps, strict=True)
    for (a, b), length, row, steps in every:
        borders[a][b] = borders[b][a] = Border(length, row, steps)
    limits = {
        k: (boxes[k - 1][0].start, boxes[k - 1][0].stop, boxes[k - 1][1].start, boxes[k - 1][1].stop)
        for k in borders
    }
    return Bond(np.array(WEIGHTS[kind]), {k: float(areas[k]) for k in borders}, limits, borders)


def join_weak(bond: Bond, least: float = LIKELY) -> None:
    """Join regions that are one stone rather than two, the surest first, until all borders are likely."""
    queue = [(bond.probability(a, b), a, b) for a, others in bond.borders.items() for b in others if a < b]
    heapq.heapify(queue)
    while queue:
        chance, a, b = heapq.heappop(queue)
        if chance >= least:
            return
        if a not in bond.borders or b not in bond.borders[a] or chance != bond.probability(a, b):
            continue
        bond.join(a, b)
        for c in bond.borders[a]:
            low, high = min(a, c), max(a, c)
            heapq.heappush(queue, (bond.probability(low, high), low, high))


def renumbered(regions: Ints, bond: Bond) -> Ints:
    """Return regions (h, w) with the numbers that they have after joining."""
    table = np.arange(int(regions.max()) + 1)
    for k in bond.joined:
        end = k
        while end in bond.joined:
            end = bond.joined[end]
        table[k] = end
    return table[regions]


def _union(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    return min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])


def _box_area(box: tuple[int, int, int, int]) -> float:
    return float((box[1] - box[0]) * (box[3] - box[2]))
