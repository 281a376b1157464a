"""The verdicts of the wild scenes by the linear program of limit analysis, with margins; and the list itself."""

from collections import Counter

import numpy as np
import pytest

from mechanics.scene.shapes import bond, semicircular_arch, wall
from pipelines.tuning.profiles import PROFILES
from tests.validation.statics.limit_analysis import multiplier, stands
from tests.validation.wild import limits, motions, supports
from tests.validation.wild.matrix import SETTINGS, Mark, Setting, at, judged, rotating
from tests.validation.wild.scene_list import SCENES, Truth

MARGIN = 1.03


def test_there_are_enough_scenes_of_each_truth():
    count = Counter(one.truth for one in SCENES.values())
    assert len(SCENES) >= 40
    assert min(count[truth] for truth in Truth) >= 5


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_says_why_its_verdict_is_true(name):
    entry = SCENES[name]
    assert entry.build.__doc__
    assert 1 <= sum(one.fidelity != "fixed" for one in entry.build().blocks) <= 45


@pytest.mark.parametrize(("count", "least"), limits.LEAST_THICKNESS.items())
def test_the_least_thickness_of_an_arch(count, least):
    assert stands(semicircular_arch(count, 1.001 * least, 1.0, 0.3), 0.8)
    assert stands(semicircular_arch(count, 1.05 * least, 1.0, 0.3), 0.8 / MARGIN)
    assert not stands(semicircular_arch(count, 0.999 * least, 1.0, 0.3), 0.8)


@pytest.mark.parametrize(
    "name",
    ["drums_of_6_sides", "drums_of_16_sides", "drums_of_24_sides", "overhang", "corbel", "lapped_corbel"],
)
def test_scenes_inside_and_outside_their_limit(name):
    """By the linear program, with the tilted weight of the scene."""
    for where, part in (("inside", MARGIN), ("outside", 1 / MARGIN)):
        if f"{name}_{where}" not in SCENES:
            continue
        scene = SCENES[f"{name}_{where}"].build()
        pull, friction = np.array(scene.gravity) / -scene.gravity[2], scene.contact.law.friction
        size = float(np.hypot(*pull[:2]))
        if size:
            limit = multiplier(scene.blocks, friction, (*(pull[:2] / size), 0.0), sides=16)
            assert (limit > part * size) == (where == "inside")
        else:
            assert stands(scene.blocks, friction) == (where == "inside")


def test_the_tilted_wall():
    stones = wall(bond(3, 12, halves_first=True), 0.2, 0.1, 0.1)
    assert multiplier(stones, 0.6) == pytest.approx(limits.PANEL_LIMIT, rel=1e-4)
    assert multiplier(stones, 0.54) > 1.05 * 0.9 * limits.PANEL_LIMIT


def test_the_piers_of_an_arch():
    assert stands(limits.buttressed(0.28 / 1.08), 0.7 / 1.2)
    assert not stands(limits.buttressed(0.22 * 1.08), 0.7 * 1.2)


def test_the_domes():
    assert stands(limits.dome(), 0.3, sides=8)
    assert not stands(limits.dome(skip=3), 0.3, sides=16)


def test_openings_without_a_lintel():
    assert not stands(supports.opening(8, 5, 1, 5, 0.25, 1.0), 0.7)
    assert not stands(supports.opening(8, 5, 1, 6, 0.375, 1.125, halves=True), 0.5)


@pytest.mark.parametrize("name", ["pyramid", "opening_with_a_lintel"])
def test_scenes_that_stand_with_half_of_their_friction(name):
    scene = SCENES[name].build()
    assert stands(scene.blocks, 0.5 * scene.contact.law.friction)


def test_the_wedges():
    assert stands(SCENES["wedge_in_a_slot"].build().blocks, 0.3)
    assert not stands(SCENES["wedge_in_an_inverted_slot"].build().blocks, 0.4 * 1.2)


@pytest.mark.parametrize(("count", "width", "height"), [(1, 0.25, 1.0), (3, 0.5, 0.5), (10, 0.5, 0.15)])
def test_the_barrier_of_a_column_is_no_higher_than_that_of_its_top_drum_or_of_the_whole(count, width, height):
    """n (R - H/2) as one block, √(b² + h²)/2 - h/2 of the top drum alone; equal for one drum."""
    whole = count * 0.5 * (np.hypot(width, count * height) - count * height)
    top = 0.5 * (np.hypot(width, height) - height)
    least = motions.column_barrier(count, width, height)
    assert 0 < least <= min(whole, top) * (1 + 1e-12)
    if count == 1:
        assert least == pytest.approx(whole)


@pytest.mark.parametrize(
    ("truth", "outcome", "mark"),
    [
        (Truth.STANDS, "equilibrium", Mark.RIGHT),
        (Truth.STANDS, "settled", Mark.WRONG),
        (Truth.RESTS, "settled", Mark.RIGHT),
        (Truth.STANDS, "moving", Mark.OPEN),
        (Truth.STANDS, "collapsed", Mark.WRONG),
        (Truth.FALLS, "collapsed", Mark.RIGHT),
        (Truth.FALLS, "moving", Mark.OPEN),
        (Truth.FALLS, "equilibrium", Mark.WRONG),
        (Truth.SLIDES, "moving", Mark.RIGHT),
        (Truth.SLIDES, "collapsed", Mark.RIGHT),
        (Truth.SLIDES, "equilibrium", Mark.WRONG),
        *((truth, "undecided", Mark.UNDECIDED) for truth in Truth),
    ],
)
def test_a_verdict_is_held_against_the_truth(truth, outcome, mark):
    assert judged(truth, outcome) is mark


def test_the_matrix_has_every_profile_and_three_steps_and_its_quick_part_every_scene():
    assert len(SETTINGS) == len({str(one) for one in SETTINGS}) == len(PROFILES) * 2 * 2 * 3
    quick = rotating(SCENES)
    assert [name for name, _ in quick] == list(SCENES)
    assert len({setting for _, setting in quick}) >= 12


def test_a_scene_is_run_at_its_setting():
    """In the profile's settings, with the asked halting and start, and the asked step times the scene's pace."""
    entry = SCENES["stack_of_hundred_metres"]
    found = at(entry, Setting("fast", True, True, 5e-3))
    assert (found.time.relaxation, found.time.start, found.time.step) == (True, "equilibrium", 3 * 5e-3)
    assert found.time.duration == entry.build().time.duration
    assert found.solver.tolerance == PROFILES["fast"].rest.tolerance
    assert {one.fidelity for one in found.blocks} == {"fixed", "rigid"}
    elastic = at(SCENES["elastic_stack"], Setting("accurate", False, False, 1e-3))
    assert {one.fidelity for one in elastic.blocks} == {"fixed", "deformable"}
    assert not elastic.time.relaxation
