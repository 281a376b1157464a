"""Measured deformation as standardised residuals: walls of known scatter, moved by a known amount or not at all."""

from dataclasses import replace

import numpy as np
import pytest

from survey.quality.deformation import Built, measure_deformation
from survey.quality.facades import facades_of
from survey.quality.precision import appraise
from synthetic.buildings.walls import wall
from synthetic.measure import HALF_JOINT


def surveyed(building):
    stones = tuple(appraise(block) for block in building.blocks())
    return stones, facades_of(stones)


def still(code, points):
    return np.zeros_like(points)


@pytest.fixture(scope="module")
def laid():
    return surveyed(wall(120, seed=4))


def test_a_wall_that_has_not_moved_leaves_the_scatter_of_its_beds(laid):
    found = measure_deformation(*laid, Built(battered=True))
    residuals = found.residuals(still)
    # 4 standard deviations of χ²; the scatter itself is estimated from some fifty steps, within a fifth
    assert residuals @ residuals == pytest.approx(
        found.dof, abs=4.0 * np.sqrt(2.0 * found.dof) + 0.2 * found.dof
    )
    # half a joint is uniform between two bounds: standard deviation of their distance over √12
    assert found.scatter["facade 1", None] == pytest.approx(
        (HALF_JOINT[1] - HALF_JOINT[0]) / 12**0.5, rel=0.6
    )
    assert found.freedom > 40


def test_what_is_free_is_projected_out(laid):
    found = measure_deformation(*laid, Built(battered=True))
    before = found.residuals(still)
    rigid = np.array([0.3, -0.2, 0.5])
    raised = found.residuals(lambda code, points: np.tile(rigid, (len(points), 1)))
    np.testing.assert_allclose(raised, before, atol=1e-6)
    # the rank of the whitening is the degrees of freedom
    for group in found.groups:
        assert np.linalg.matrix_rank(group.whitening, tol=1e-6 * np.linalg.norm(group.whitening)) == group.dof


def test_a_crack_does_not_enlarge_the_scatter(laid):
    stones, facades = laid
    middle = np.median([stone.outline[:, 0].mean() for stone in stones])
    fallen = tuple(
        replace(stone, outline=stone.outline - [0, 0, 0.05]) if stone.outline[:, 0].mean() < middle else stone
        for stone in stones
    )
    before, after = (measure_deformation(one, facades) for one in (stones, fallen))
    assert after.scatter["facade 1", None] == pytest.approx(before.scatter["facade 1", None], rel=0.5)
    cracked = after.residuals(still)
    assert cracked @ cracked > 50.0 * after.dof


def test_the_upper_end_of_a_bevel_is_no_bed(laid):
    stones, facades = laid
    found = measure_deformation(stones, facades)
    group = next(one for one in found.groups if one.quantity == "beds" and one.course == 3)
    code = group.codes[2]
    k = next(k for k, stone in enumerate(stones) if stone.code == code)
    stone = stones[k]
    low = int(np.argmin(stone.outline @ (facades[0].frame.axes[0] + facades[0].frame.axes[1])))
    lifted = stone.outline[low] + 0.05 * facades[0].frame.axes[0]
    raised = stone.outline[low] + [0.0, 0.0, 0.025]
    bevelled = replace(
        stone,
        outline=np.insert(stone.outline, low, [raised, lifted], axis=0),
        corner_sigma=np.insert(stone.corner_sigma, low, stone.corner_sigma[[low, low]], axis=0),
        worn_corners=(),
    )
    changed = measure_deformation((*stones[:k], bevelled, *stones[k + 1 :]), facades)
    own = next(one for one in changed.groups if one.quantity == "beds" and one.course == 3)
    assert np.ptp(own.values) < 0.02
    assert own.codes.count(code) >= 2


def test_stones_on_older_work_are_left_out_and_a_tolerance_allows_slopes(laid):
    found = measure_deformation(*laid)
    second = frozenset(code for one in found.groups if one.course == 2 for code in one.codes)
    without = measure_deformation(*laid, undetermined=second)
    assert all(one.course != 2 for one in without.groups if one.quantity == "beds")
    assert len(without.groups) == len(found.groups) - 1

    def sloping(code, points):
        return np.column_stack([np.zeros((len(points), 2)), 2e-3 * points[:, 0]])

    strict, lenient = (
        measure_deformation(*laid, Built(level=level)).residuals(sloping) for level in (0.0, 2e-3)
    )
    assert strict @ strict > 1.5 * (lenient @ lenient)
