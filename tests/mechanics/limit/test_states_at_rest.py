"""State from which limit loads start where the dead load moves stones or breaks bonds: that at rest."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import assembly
from mechanics.limit.dead_load import stands
from mechanics.limit.limit_load import limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import Fidelity, LawRule
from tests.mechanics.shapes import brick, ground, scene

ALONG = Acceleration((1.0, 0.0, 0.0))


def pile(gaps, friction=0.7):
    """Return boxes of .6 x .6 x .2 m above each other, each a gap above the one below."""
    boxes, top = [], 0.0
    for number, gap in enumerate(gaps):
        boxes.append(brick(f"b{number}", (0.0, 0.0, top + gap), (0.6, 0.6, top + gap + 0.2)))
        top += gap + 0.2
    return scene(ground(), *boxes, friction=friction, step=5e-3, duration=2.0)


@pytest.mark.parametrize(
    ("gaps", "falls"),
    [([1.5e-4] * 5, False), ([0.0, 4e-4, 0.0, 4e-4, 0.0, 0.0], True), ([1e-4, 1e-3, 1e-3], True)],
)
def test_boxes_with_open_joints_are_assessed_where_they_rest(gaps, falls):
    """Forces carry them as drawn where gaps count as closed; at rest a pile of height h tips at b/h, or slides at μ."""
    standing = stands(assembly(pile(gaps)))
    assert standing.outcome.rests
    assert standing.rest is not None
    assert standing.falls_as_drawn is falls
    assert standing.farthest == pytest.approx(sum(gaps), rel=1e-2)
    found = limit_load(standing.rest, ALONG)
    assert found.multiplier == pytest.approx(min(0.6 / (0.2 * len(gaps)), 0.7), rel=1e-3)


def test_boxes_that_touch_keep_the_joints_as_they_are_drawn():
    standing = stands(assembly(pile([0.0] * 3)))
    assert standing.outcome is Outcome.EQUILIBRIUM
    assert standing.rest is None
    assert not standing.falls_as_drawn


def hung(gap, law):
    """Return a cube of .4 m that hangs on a ceiling by a bond, a gap above the ground."""
    top = gap + 0.4
    blocks = (
        ground(),
        brick("cube", (0.0, 0.0, gap), (0.4, 0.4, top)),
        brick("ceiling", (-1.0, -1.0, top), (1.0, 1.0, top + 1.0), Fidelity.FIXED),
    )
    one = scene(*blocks, friction=0.5, step=5e-3, duration=1.0)
    rule = LawRule(frozenset({"cube"}), frozenset({"ceiling"}), law)
    return replace(one, contact=replace(one.contact, rules=(rule,)))


def test_mortar_that_the_dead_load_breaks_holds_nothing():
    """A cube of 9.4 kPa on its bed above: with a half of that it drops onto the ground, on which it slides at .5."""
    density = 2000.0
    weight = density * 9.81 * 0.4
    weak = stands(assembly(hung(2e-4, MortarJoint(0.5, 0.5 * weight, 2.0 * weight))))
    assert weak.outcome.rests
    assert weak.broken == (("cube", "ceiling"),)
    assert weak.rest is not None
    assert limit_load(weak.rest, ALONG).multiplier == pytest.approx(0.5, rel=1e-3)
    strong = stands(assembly(hung(2e-4, MortarJoint(0.5, 4.0 * weight, 8.0 * weight))))
    assert strong.rest is None
    assert strong.broken == ()


def test_mortar_that_breaks_without_parting_holds_nothing_either():
    """A cube hangs at a wall by half its weight, and drops onto the ground along it: away from it, it slides at .5."""
    weight = 2000.0 * 9.81 * 0.4
    wall = brick("wall", (0.4, -1.0, 0.0), (1.4, 1.0, 2.0), Fidelity.FIXED)
    cube = brick("cube", (0.0, 0.0, 2e-4), (0.4, 0.4, 0.4002))
    one = scene(ground(), wall, cube, friction=0.5, step=5e-3, duration=1.0)
    rule = LawRule(frozenset({"cube"}), frozenset({"wall"}), MortarJoint(0.5, 0.5 * weight, 0.5 * weight))
    standing = stands(assembly(replace(one, contact=replace(one.contact, rules=(rule,)))))
    assert standing.broken == (("wall", "cube"),)
    assert limit_load(standing.rest, Acceleration((-1.0, 0.0, 0.0))).multiplier == pytest.approx(
        0.5, rel=1e-3
    )


def test_a_broken_bond_leaves_friction_springs_and_the_strength_to_compression():
    law = ElasticJoint(0.7, 1e9, 4e8, tension=1e4, shear=2e4, compressive_strength=1e6)
    bare = law.without_bond(False)
    assert (bare.tension, bare.shear, bare.normal_stiffness, bare.compressive_strength) == (0, 0, 1e9, 1e6)
    assert MortarJoint(0.6, 1e4, 2e4).without_bond(False) == MortarJoint(0.6, 0.0, 0.0)
    zone = CohesiveZone(0.6, 1e4, 2e4, 10.0, 10.0)
    for one in (MortarJoint(0.6, 1e4, 2e4), zone):
        assert one.without_bond(True).friction == 0.6
        assert not hasattr(one.without_bond(True), "tension")


def test_what_time_cuts_short_is_not_decided():
    """Two boxes and .02 s: too short for a rest, and nothing falls."""
    short = pile([0.0] * 2)
    short = replace(short, time=replace(short.time, step=0.01, duration=0.02))
    standing = stands(assembly(short))
    assert standing.outcome is Outcome.MOVING
    assert not standing.outcome.decided
    assert Outcome.COLLAPSED.decided
    assert not Outcome.UNDECIDED.decided


def test_a_block_moves_with_its_corners_and_keeps_its_shape():
    """The upper of two above open beds of .15 mm sinks by both; lengths of its edges do not change."""
    raised = pile([1.5e-4] * 2)
    standing = stands(assembly(raised))
    assert standing.rest is not None
    before = raised.blocks[2].vertices
    after = standing.rest.model.scene.blocks[2].vertices
    assert np.abs(after - before + [0.0, 0.0, 3e-4]).max() < 1e-6
    edges = [np.linalg.norm(np.diff(one, axis=0), axis=1) for one in (before, after)]
    assert np.abs(edges[0] - edges[1]).max() < 1e-14
