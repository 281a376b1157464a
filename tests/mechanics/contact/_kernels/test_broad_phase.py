"""Bodies put in place, their boxes, and the pairs of boxes that overlap, against numpy and against trying all pairs."""

import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.contact._kernels import broad_phase as kernel

coordinate = st.integers(-128, 128).map(lambda i: i / 64)


def close_pairs(low, high, owner, fixed):
    """Try all pairs."""
    return {
        (i, j)
        for i, j in itertools.combinations(range(len(low)), 2)
        if owner[i] != owner[j]
        and not (fixed[i] and fixed[j])
        and (low[i] <= high[j]).all()
        and (low[j] <= high[i]).all()
    }


def found_pairs(low, high, owner, fixed):
    """Return what three shares of unequal size find."""
    grid, count = kernel.grid_of(low, high), len(low)
    shares = itertools.pairwise((0, count // 5, count // 2, count))
    return np.concatenate([kernel.close_pairs(low, high, owner, fixed, grid, *share) for share in shares])


def assert_all_pairs_found(low, high, owner, fixed):
    found = found_pairs(low, high, owner, fixed)
    assert found.shape[1:] == (2,)
    assert (found[:, 0] < found[:, 1]).all()
    pairs = [tuple(pair) for pair in found.tolist()]
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == close_pairs(low, high, owner, fixed)


# places on a lattice, so that many boxes share faces, edges and corners
box = st.tuples(
    *[coordinate] * 3, *[st.integers(1, 96).map(lambda i: i / 64)] * 3, st.integers(0, 9), st.booleans()
)


@settings(max_examples=100, deadline=None)
@given(st.lists(box, min_size=1, max_size=40), st.sampled_from([2, 3]), st.sampled_from([1e-2, 1.0, 1e3]))
def test_the_pairs_are_those_that_trying_all_finds(boxes, dimension, scale):
    table = np.array(boxes, dtype=float)
    low = scale * table[:, :dimension]
    high = low + scale * table[:, 3 : 3 + dimension]
    assert_all_pairs_found(low, high, table[:, 6].astype(np.int64), table[:, 7].astype(bool))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([2, 3]), st.integers(1, 150), st.floats(0.0, 1.0))
@example(seed=0, dimension=3, count=1, held=0.0)
def test_boxes_of_very_different_sizes_far_away_are_found_as_well(seed, dimension, count, held):
    """Sizes over three decades: some boxes span many more cells than the grid takes."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-2, 1, (count, 1)) * rng.uniform(0.3, 1.0, (count, dimension))
    low = rng.uniform(-3, 3, (count, dimension)) + 1e4 * rng.normal(size=dimension)
    owner, fixed = np.sort(rng.integers(0, count, count)), rng.random(count) < held
    assert_all_pairs_found(low, low + size, owner, fixed)


@pytest.mark.parametrize("dimension", [2, 3])
def test_there_is_room_for_any_number_of_pairs(dimension):
    low = np.zeros((60, dimension))
    found = found_pairs(low, low + 1, np.arange(60), np.zeros(60, dtype=bool))
    assert len(found) == 60 * 59 // 2


@pytest.mark.parametrize("dimension", [2, 3])
def test_one_floor_under_everything_meets_everything_once(dimension):
    rng = np.random.default_rng(1)
    low = np.vstack([np.full((1, dimension), -1e3), rng.uniform(-900, 900, (500, dimension))])
    high = low + 0.1
    high[0] = 1e3
    free = np.zeros(501, dtype=bool)
    found = found_pairs(low, high, np.arange(501), free)
    assert {(0, j) for j in range(1, 501)} <= {tuple(pair) for pair in found.tolist()}
    assert_all_pairs_found(low, high, np.arange(501), free)


def test_boxes_that_share_no_more_than_a_corner_make_a_pair():
    low = np.array([[0.0, 0, 0], [0.1, 0.1, 0.1], [0.3, 0.3, 0.3]])
    high = np.array([[0.1, 0.1, 0.1], [0.3, 0.3, 0.3], [0.4, 0.4, 0.4]])
    found = found_pairs(low, high, np.arange(3), np.zeros(3, dtype=bool))
    assert sorted(map(tuple, found.tolist())) == [(0, 1), (1, 2)]


@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_boxes_make_no_pair(count):
    low = np.zeros((count, 3))
    found = found_pairs(low, low + 1, np.arange(count), np.zeros(count, dtype=bool))
    assert found.shape == (0, 2)


def test_a_wall_of_equal_bricks_has_the_pairs_of_its_bond():
    """Running bond: each brick meets the next of its course, and two of the course below."""
    courses, width = 30, 40
    low = np.array([(x + 0.5 * (z % 2), 0.0, 0.5 * z) for z in range(courses) for x in range(width)])
    found = found_pairs(
        low - 1e-3, low + [1, 0.5, 0.5] + 1e-3, np.arange(len(low)), np.zeros(len(low), dtype=bool)
    )
    ends = courses - 1  # one brick of each upper course has but one below it
    assert len(found) == courses * (width - 1) + (courses - 1) * 2 * width - ends


# --- places and boxes ---


def random_bodies(seed, count=7):
    rng = np.random.default_rng(seed)
    pointer = np.concatenate([[0], np.cumsum(rng.integers(1, 9, count))])
    return (
        pointer,
        rng.normal(size=(pointer[-1], 3)),
        10 * rng.normal(size=(count, 3)),
        Rotation.random(count, random_state=seed).as_matrix(),
    )


@pytest.mark.parametrize("seed", range(3))
def test_points_are_put_where_their_bodies_are(seed):
    pointer, local, centre, rotation = random_bodies(seed)
    found = kernel.place(pointer, local, centre, rotation)
    for b, (start, stop) in enumerate(itertools.pairwise(pointer)):
        twin = [centre[b] + rotation[b] @ x for x in local[start:stop]]
        np.testing.assert_allclose(found[start:stop], twin, atol=1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_boxes_hold_their_bodies_with_a_margin_and_no_more(seed):
    pointer, local, centre, rotation = random_bodies(seed)
    vertex = kernel.place(pointer, local, centre, rotation)
    margin = np.linspace(0.0, 0.3, len(centre))
    low, high = kernel.boxes(pointer, vertex, margin)
    for b, (start, stop) in enumerate(itertools.pairwise(pointer)):
        np.testing.assert_array_equal(low[b], vertex[start:stop].min(axis=0) - margin[b])
        np.testing.assert_array_equal(high[b], vertex[start:stop].max(axis=0) + margin[b])


def test_material_points_are_where_their_bodies_carry_them():
    _, _, centre, rotation = random_bodies(4)
    rng = np.random.default_rng(0)
    body, arm = rng.integers(0, len(centre), (11, 2)), rng.normal(size=(11, 2, 3))
    found = kernel.points_of(body, arm, centre, rotation)
    for c, side in itertools.product(range(11), range(2)):
        b = body[c, side]
        np.testing.assert_allclose(found[c, side], centre[b] + rotation[b] @ arm[c, side], atol=1e-14)
