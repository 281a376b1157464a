"""A faint joint straight across a stone is found and parts it; a line that ends in it, or at its side, does not."""

import numpy as np
import pytest
from scipy.ndimage import find_objects

from survey.clouds.pictures import splitting
from survey.clouds.pictures.bond import LIKELY
from survey.clouds.pictures.joints import WIDTH, Strength
from survey.clouds.pictures.splitting import Line, dividing_lines, line_features, propose_missing

SHAPE = (40, 90)
ONE = np.ones(SHAPE, np.int64)
SEEN = np.zeros(SHAPE, bool)
SURE = (2.0 * LIKELY, 20.0, 0.0, 0.0, 0.0, 0.0)  # from a strength on, whatever the shapes


def lines_across(regions, strength, hidden):
    """The best lines across all regions: box of the region, axis, region, part beyond, line."""
    for number, box in enumerate(find_objects(regions), start=1):
        if box is not None:
            yield from ((box, *line) for line in dividing_lines(regions, number, box, strength, hidden))


def joints(*, upright=None, level=None):
    fields = [np.zeros(SHAPE, np.float32) if field is None else field for field in (upright, level)]
    return Strength(np.maximum(*fields), *fields, np.zeros(SHAPE, np.float32))


def upright(column, value=0.8, rows=slice(None), lean=0):
    """A line of a strength, whose ends lean to either side."""
    out = np.zeros(SHAPE, np.float32)
    places = column + np.round(lean * np.linspace(-1.0, 1.0, SHAPE[0])).astype(int)
    chosen = np.arange(SHAPE[0])[rows]
    out[chosen, places[chosen]] = value
    return out


def only_line(strength, regions=ONE, hidden=SEEN):
    ((_, axis, _, after, line),) = lines_across(regions, strength, hidden)
    return axis, after, line


@pytest.mark.parametrize("lean", [-4, -2, 0, 2, 4])
def test_the_line_of_a_joint_has_its_place_its_lean_and_its_strength(lean):
    axis, after, line = only_line(joints(upright=upright(50, lean=lean)))
    assert axis == 1
    # the strongest of three pixels across counts, so that a line may pass a pixel beside
    assert line.middle == pytest.approx(50, abs=1)
    assert line.lean == pytest.approx(lean, abs=2)
    assert line.strength == pytest.approx(0.8)
    assert line.gaps == 0.0
    # most lines across have no strength
    assert line.prominence == pytest.approx(np.log(0.82 / 0.02), rel=1e-4)
    beyond = after.sum(axis=1)
    assert beyond[20] == pytest.approx(90 - 51, abs=1)
    assert beyond[0] - beyond[-1] == pytest.approx(2 * line.lean)


def test_a_level_joint_is_a_line_of_the_other_axis():
    level = np.zeros(SHAPE, np.float32)
    level[15] = 0.6
    ((box, axis, whole, after, line),) = lines_across(ONE, joints(level=level), SEEN)
    assert (axis, line.strength, line.gaps) == (0, pytest.approx(0.6), 0.0)
    assert box == (slice(0, 40), slice(0, 90))
    assert whole.shape == after.shape == SHAPE[::-1]
    assert after.sum() == pytest.approx(90 * (40 - 16), abs=90)


def test_a_joint_over_half_of_the_height_has_half_of_the_strength_and_gaps_on_the_rest():
    _, _, line = only_line(joints(upright=upright(50, rows=slice(0, 20))))
    assert line.strength == pytest.approx(0.4)
    assert line.gaps == pytest.approx(0.5)


def test_what_is_hidden_of_a_line_counts_neither_for_nor_against_it():
    hidden = np.zeros(SHAPE, bool)
    hidden[:12] = True
    _, _, line = only_line(joints(upright=upright(50, rows=slice(12, 40))), hidden=hidden)
    assert (line.strength, line.gaps) == (pytest.approx(0.8), 0.0)
    hidden[:20] = True  # less than three fifths are seen
    assert not list(lines_across(ONE, joints(upright=upright(50)), hidden))


def test_no_more_than_the_strength_that_says_something_counts():
    assert only_line(joints(upright=upright(50, 9.0)))[2].strength == pytest.approx(1.5)


@pytest.mark.parametrize(("column", "found"), [(3, False), (4, False), (9, True), (80, True), (86, False)])
def test_joints_at_the_sides_of_a_region_are_none_within_it(column, found):
    lines = list(lines_across(ONE, joints(upright=upright(column)), SEEN))
    assert bool(lines) == found


def test_a_region_too_narrow_for_two_stones_has_no_line():
    narrow = np.zeros(SHAPE, np.int64)
    narrow[:, 40:54] = 1  # twice the distance from its ends and two more
    assert not list(lines_across(narrow, joints(upright=upright(47)), SEEN))
    narrow[:, 40:56] = 1
    assert list(lines_across(narrow, joints(upright=upright(47)), SEEN))


@pytest.mark.parametrize(("column", "found"), [(10, False), (16, True)])
def test_what_a_line_cuts_off_is_no_sliver(column, found):
    low = np.zeros(SHAPE, np.int64)
    low[10:13] = 1
    assert bool(list(lines_across(low, joints(upright=upright(column)), SEEN))) == found


@pytest.mark.parametrize("lean", [-4, -1, 0, 2, 3])
def test_sums_along_a_leaning_line_are_those_of_its_pixels(lean):
    field = np.random.default_rng(3).random((1, 23, 40)).astype(np.float32)
    cumulative = np.pad(np.cumsum(field, axis=1), ((0, 0), (1, 0), (0, 0)))
    shifts = [round(lean * (2.0 * row / 22.0 - 1.0)) for row in range(23)]
    true = [sum(field[0, row, column + shift] for row, shift in enumerate(shifts)) for column in range(4, 36)]
    assert splitting._along(cumulative, lean)[0, 4:36] == pytest.approx(true, rel=1e-5)


def test_the_features_of_a_line_are_its_own_and_how_much_fuller_the_whole_is():
    whole = np.zeros(SHAPE, bool)
    whole[:20, 10:70] = whole[20:, 10:40] = True  # an L of 1800 pixels in a box of 2400
    after = whole & (np.arange(90) >= 40)
    found = line_features(whole, after, Line(0.7, 0.2, 1.5, 39, 0))
    assert found[:4] == pytest.approx([1.0, 0.7, 0.2, 1.5])
    # both parts, of 1200 and 600 pixels, fill their boxes
    assert found[4] == pytest.approx(1800.0 / 2400.0 - 1.0)
    assert found[5] == pytest.approx(np.log(np.sqrt(600.0) / WIDTH))
    # the part that is a step fills its own less
    step = whole & (np.arange(90) >= 55)
    askew = line_features(whole, step, Line(0.7, 0.2, 1.5, 54, 0))
    assert askew[4] == pytest.approx(0.75 - (1500.0 * (1500.0 / 1800.0) + 300.0) / 1800.0)


def test_a_stone_is_parted_at_every_likely_joint():
    strong = upright(30) + upright(60)
    level = np.zeros(SHAPE, np.float32)
    level[20, :30] = 0.8
    found = propose_missing(ONE, joints(upright=strong, level=level), SEEN, weights=(-10.0, 20.0, 0, 0, 0, 0))
    assert len(np.unique(found)) == 4
    pieces = [found[10, 10], found[30, 10], found[20, 45], found[20, 80]]
    assert sorted(pieces) == [1, 2, 3, 4]
    for (rows, columns), number in zip(
        (((0, 18), (0, 28)), ((23, 40), (0, 28)), ((0, 40), (33, 58)), ((0, 40), (63, 90))),
        pieces,
        strict=True,
    ):
        assert (found[slice(*rows), slice(*columns)] == number).all()


def test_no_stone_is_parted_at_a_line_that_is_unlikely():
    assert (
        propose_missing(ONE, joints(upright=upright(30, 0.3)), SEEN, weights=(-10.0, 20.0, 0, 0, 0, 0)) == 1
    ).all()
    weights = (np.log(0.6 / 0.4) + 1e-6, 0, 0, 0, 0, 0)  # a chance of .6 from the constant alone
    parted = propose_missing(ONE, joints(upright=upright(30)), SEEN, 0.6, weights)
    assert len(np.unique(parted)) == 2
    whole = propose_missing(ONE, joints(upright=upright(30)), SEEN, 0.6001, weights)
    assert len(np.unique(whole)) == 1


def test_the_likelier_of_an_upright_and_a_level_line_comes_first():
    level = np.zeros(SHAPE, np.float32)
    level[20] = 0.8
    found = propose_missing(
        ONE, joints(upright=upright(45, 1.0), level=level), SEEN, weights=(-10, 20, 0, 0, 0, 0)
    )
    # the upright line parts the whole height; the first new number is of its right part
    assert found[5, 80] == 2 or found[35, 80] == 2
    assert len(np.unique(found)) == 4


def test_a_course_of_many_stones_is_parted_at_all_of_its_joints():
    wide = np.ones((20, 400), np.int64)
    field = np.zeros(wide.shape, np.float32)
    field[:, 20::20] = 0.8
    nothing = np.zeros_like(field)
    found = propose_missing(
        wide, Strength(field, field, nothing, nothing), wide == 0, weights=(-10.0, 20.0, 0, 0, 0, 0)
    )
    assert len(np.unique(found[10])) == 20


def test_other_regions_keep_their_numbers_and_new_ones_lie_above():
    regions = ONE.copy()
    regions[:, 45:] = 3
    found = propose_missing(regions, joints(upright=upright(22)), SEEN, weights=(-10.0, 20.0, 0, 0, 0, 0))
    assert set(np.unique(found)) == {1, 3, 4}
    assert (found[:, 45:] == 3).all()
