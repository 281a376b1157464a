"""Measured against computed deformation: beds and faces that moved by a known amount."""

import numpy as np
import pytest

from survey.quality.courses import measure_courses
from survey.quality.facades import facades_of
from survey.quality.movement import compare_courses, compare_plumb
from survey.quality.precision import appraise
from synthetic.buildings.walls import wall
from synthetic.frame import RigidMotion
from tests.survey.quality.departures import walls_by_hand


def surveyed(building):
    stones = tuple(appraise(block) for block in building.blocks())
    facades = facades_of(stones)
    return stones, facades


def turned(angle, pivot, axis):
    """The motion that turns about an axis through a pivot by a small angle [rad]."""
    x, y, z = np.array(axis) * np.sin(angle)
    cross = np.array([(0, -z, y), (z, 0, -x), (-y, x, 0)])
    rotation = np.eye(3) + cross + (1 - np.cos(angle)) / np.sin(angle) ** 2 * cross @ cross
    return RigidMotion(rotation, pivot - rotation @ pivot)


@pytest.fixture(scope="module")
def tilted():
    """A wall that has turned as a whole in its plane by 4 mm/m, and out of it by 3 mm/m."""
    laid = wall(120, seed=4)
    frame_axis = laid.solids[0].vertices[1] - laid.solids[0].vertices[0]
    along = frame_axis * [1, 1, 0] / np.linalg.norm(frame_axis * [1, 1, 0])
    pivot = laid.solids[0].vertices[0]
    inward = np.cross([0, 0, 1], along)
    first, second = turned(-4e-3, pivot, inward), turned(3e-3, pivot, along)
    motion = RigidMotion(second.rotation @ first.rotation, second.rotation @ first.shift + second.shift)
    movement = {solid.code: motion for solid in laid.solids}
    return wall(120, seed=4, movement=movement), motion


def test_a_building_moves_with_its_survey(tilted):
    building, motion = tilted
    laid = wall(120, seed=4)
    for before, after in zip(laid.solids, building.solids, strict=True):
        np.testing.assert_allclose(after.vertices, motion.place(before.vertices), atol=1e-12)
    for before, after in zip(laid.survey.blocks, building.survey.blocks, strict=True):
        # the same stone, measured with the same noise; rounded to a tenth of a millimetre
        assert np.abs(after.points - motion.place(before.points)).max() < 1e-3


def test_the_true_movement_explains_what_was_measured(tilted):
    building, motion = tilted
    stones, facades = surveyed(building)
    lines = measure_courses(stones, facades)

    def moved(code, points):
        # where it came from: points are places after the movement
        before = (points - motion.shift) @ motion.rotation
        return points - before

    courses = compare_courses(lines, moved)
    assert len(courses) >= 5
    chi2, still, dof = (
        sum(getattr(one.misfit, name) for one in courses) for name in ("chi2", "still", "dof")
    )
    # 3 standard deviations of χ², √(2 dof)
    assert chi2 < dof + 3.0 * np.sqrt(2.0 * dof)
    assert still > 3.0 * dof
    for one in courses:
        # slopes within 4 σ of those measured; all courses turned alike
        assert abs(one.slope) == pytest.approx(4e-3, rel=0.02)
        assert abs(one.slope - one.line.slope) < 4.0 * one.slope_sigma
        for stone in one.stones.values():
            assert abs(stone.measured - stone.simulated) < 6.0 * stone.sigma
    (plumb,) = compare_plumb(stones, facades, moved)
    (battered,) = compare_plumb(stones, facades, moved, battered=True)
    # the wall was built with a batter of 0.3°, which is no movement
    assert plumb.misfit.chi2 > 10.0 * plumb.misfit.dof
    assert battered.misfit.chi2 < battered.misfit.dof + 4.0 * np.sqrt(2.0 * battered.misfit.dof)
    assert battered.misfit.dof == plumb.misfit.dof - 1
    height = max(solid.vertices[:, 2].max() for solid in building.solids) - 6.83
    tops = [one.simulated for one in plumb.courses.values()]
    assert max(tops) - min(tops) == pytest.approx(3e-3 * (height - 0.3), rel=0.1)


def test_another_movement_does_not_explain_it(tilted):
    building, motion = tilted
    stones, facades = surveyed(building)
    lines = measure_courses(stones, facades)

    def opposite(code, points):
        return (points - motion.shift) @ motion.rotation - points

    wrong = compare_courses(lines, opposite)
    none = compare_courses(lines, lambda code, points: np.zeros_like(points))
    dof = sum(one.misfit.dof for one in none)
    assert sum(one.misfit.chi2 for one in wrong) > 3.0 * dof
    for one in none:
        assert one.misfit.chi2 == pytest.approx(one.misfit.still, rel=1e-9)
        assert one.slope == pytest.approx(0.0, abs=1e-12)


def test_beds_that_scatter_are_known_no_better_than_they_scatter():
    """Beds laid to 8 mm, measured to 1 mm: at rest they depart from their course by one σ, not by eight."""
    stones = walls_by_hand.wall(21, beds=0.008, sigma=0.001)
    lines = measure_courses(stones, facades_of(stones))
    beds = [
        one
        for course in compare_courses(lines, lambda code, points: np.zeros_like(points))
        for one in course.stones.values()
    ]
    assert np.mean([one.sigma for one in beds]) == pytest.approx(0.008, rel=0.25)
    assert np.std([(one.measured - one.simulated) / one.sigma for one in beds]) == pytest.approx(
        1.0, abs=0.25
    )
