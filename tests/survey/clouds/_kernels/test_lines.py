"""Kernels of pictures do what slow loops in Python do."""

import heapq

import numpy as np
import pytest

from survey.clouds._kernels.flooding import flood
from survey.clouds._kernels.lines import contrasts, line_means, side_steps

PLACES = [((0, 0, 0), (-1, 0, 1)), ((-4, 0, 4), (2, 0, -2)), ((-9, 0, 9), (0, 0, 0))]


def picture(seed=2, shape=(7, 9)):
    return np.random.default_rng(seed).normal(size=shape).astype(np.float32)


def at(image, row, column):
    """A pixel, or the nearest at the edge."""
    return image[min(max(row, 0), image.shape[0] - 1), min(max(column, 0), image.shape[1] - 1)]


@pytest.mark.parametrize(("down", "right"), PLACES)
def test_means_along_lines(down, right):
    image = picture()
    out = np.empty_like(image)
    line_means(image, np.array(down), np.array(right), out)
    for (row, column), value in np.ndenumerate(out):
        pixels = [at(image, row + d, column + r) for d, r in zip(down, right, strict=True)]
        assert value == pytest.approx(np.mean(pixels), abs=1e-5)


@pytest.mark.parametrize(("down", "right"), [((3, 5), (0, 0)), ((2, 3), (2, 3)), ((-1, -2), (3, 5))])
def test_a_contrast_is_the_lesser_of_both_sides_and_the_most_of_all_distances(down, right):
    image = picture()
    out = np.empty_like(image)
    contrasts(image, np.array(down), np.array(right), out)
    for (row, column), value in np.ndenumerate(out):
        lesser = [
            min(
                image[row, column] - at(image, row + d, column + r),
                image[row, column] - at(image, row - d, column - r),
            )
            for d, r in zip(down, right, strict=True)
        ]
        assert value == pytest.approx(max(0.0, *lesser), abs=1e-5)


@pytest.mark.parametrize(("down", "right"), [(3, 0), (2, -3), (-1, 4)])
def test_a_step_is_from_one_side_to_the_other(down, right):
    image = picture()
    out = np.empty_like(image)
    side_steps(image, down, right, out)
    for (row, column), value in np.ndenumerate(out):
        step = at(image, row + down, column + right) - at(image, row - down, column - right)
        assert value == pytest.approx(step, abs=1e-5)


def flooded(levels, seeds):
    """Regions by a heap: the lowest pixel first, of equal ones the oldest."""
    out, queue = seeds.copy(), []
    for row, column in zip(*np.nonzero((seeds > 0) & (levels >= 0)), strict=True):
        heapq.heappush(queue, (levels[row, column], len(queue), row, column))
    age = len(queue)
    while queue:
        _, _, row, column = heapq.heappop(queue)
        for y, x in ((row - 1, column), (row, column - 1), (row, column + 1), (row + 1, column)):
            if out[y, x] == 0 and levels[y, x] >= 0:
                out[y, x] = out[row, column]
                heapq.heappush(queue, (levels[y, x], age, y, x))
                age += 1
    return out


@pytest.mark.parametrize("highest", [3, 200])
def test_a_flood_takes_the_lowest_pixels_first(highest):
    rng = np.random.default_rng(3)
    levels = rng.integers(0, highest + 1, (30, 40)).astype(np.int16)
    levels[10:12, 5:30] = -1
    levels[[0, -1]] = levels[:, [0, -1]] = -1
    seeds = np.zeros(levels.shape, np.int32)
    places = rng.choice(levels.size, 12, replace=False)
    seeds.ravel()[places] = np.arange(1, 13)
    seeds[levels < 0] = 0
    expected = flooded(levels, seeds)
    flood(levels, highest, seeds)
    assert (seeds == expected).all()
    assert (seeds[levels < 0] == 0).all()
