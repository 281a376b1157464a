"""Loading tests of blocks whose force is a formula: rocking, sliding, with a guided head, crushing, out of plane."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError, SolverError
from mechanics.limit.loading_test import JawPath, _loaded, loading_test, softening_step
from mechanics.model.model import build_model
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.rig import BASE, BEAM, JAWS, Head, Rig, rigged
from mechanics.scene.scene import ContactSettings, LawRule, Placement, Scene
from mechanics.scene.shapes import box
from mechanics.stones.materials import Material

WIDTH, DEEP, TALL, PUSH, LOAD = 0.6, 0.2, 1.0, 1.1, 40e3
STONE = Material("stone", 2000.0, 10e9, 0.2)
WEIGHT = 2000.0 * 9.81 * WIDTH * DEEP * TALL


def scene(law, turn=0.0, **contact):
    """A block, turned about the vertical."""
    block = box("block", (0.0, 0.0, 0.0), (WIDTH, DEEP, TALL), STONE)
    c, s = np.cos(turn), np.sin(turn)
    turned = block.vertices @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return Scene("block", (replace(block, vertices=turned),), contact=ContactSettings(law, **contact))


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_block_under_a_beam_rocks_about_its_toe_both_ways(turn):
    rig = Rig((np.cos(turn), np.sin(turn), 0.0), PUSH, LOAD)
    test = loading_test(scene(DryJoint(1.0), turn), rig, (0.01, -0.01), 5e-4)
    # the toe's lever shrinks with the displacement of the beam and of the block's centre
    place, force = test.displacement[19], test.force[19]
    expected = (LOAD * (WIDTH / 2 - place) + WEIGHT * (WIDTH / 2 - place * TALL / 2 / PUSH)) / PUSH
    assert place == pytest.approx(0.01)
    assert force == pytest.approx(expected, rel=0.01)
    assert test.force[-1] == pytest.approx(-expected, rel=0.01)
    forwards, backwards = test.strength
    assert forwards == pytest.approx((LOAD + WEIGHT) * WIDTH / 2 / PUSH, rel=0.02)
    assert backwards == pytest.approx(-forwards, rel=0.02)
    assert test.turning == pytest.approx(1.0, abs=0.02)
    assert test.lift[19] == pytest.approx(WIDTH / 2 * place / PUSH, rel=0.03)
    assert test.unsolved == 0
    assert test.energy_error < 1e-6


def slippery(way):
    """The test of a block that slides below a beam, as far as `way` [m]."""
    return loading_test(scene(DryJoint(0.1)), Rig((1.0, 0.0, 0.0), PUSH, LOAD), (way,), 5e-4)


def test_a_slippery_block_slides():
    test = slippery(0.005)
    assert test.force[-1] == pytest.approx(0.1 * LOAD, rel=0.02)  # below the beam
    assert test.turning == pytest.approx(0.0, abs=1e-3)


def test_a_beam_that_may_not_turn_doubles_the_lever():
    test = loading_test(scene(DryJoint(1.5)), Rig((1.0, 0.0, 0.0), PUSH, LOAD, Head.GUIDED), (0.002,), 2e-4)
    place = test.displacement[-1]
    assert test.force[-1] == pytest.approx(
        (LOAD * (WIDTH - place) + WEIGHT * (WIDTH - place) / 2) / TALL, rel=0.02
    )


def test_a_toe_that_crushes_shortens_the_lever():
    strength = 2e6
    law = ElasticJoint(1.0, 1e11, 4e10, compressive_strength=strength)
    test = loading_test(
        scene(law, placement=Placement.AREA, spacing=0.02), Rig((1.0, 0.0, 0.0), PUSH, LOAD), (0.02,), 4e-4
    )
    toe = (LOAD + WEIGHT) / (strength * DEEP)
    place = test.displacement[-1]
    expected = (LOAD * (WIDTH / 2 - toe / 2 - place) + WEIGHT * (WIDTH / 2 - toe / 2 - place / 2)) / PUSH
    assert toe > 0.1
    assert test.force[-1] == pytest.approx(expected, rel=0.03)


def test_two_blocks_held_at_the_top_follow_the_line_of_rigid_ones():
    """F = W 2t/h (1 - d/t) of a wall on two edges that is pushed at mid-height."""
    high, thick = 1.5, 0.11
    halves = tuple(
        box(f"half {k}", (0.0, 0.0, k * high / 2), (1.0, thick, (k + 1) * high / 2), STONE) for k in (0, 1)
    )
    wall = Scene("wall", halves, contact=ContactSettings(DryJoint(0.7)))
    test = loading_test(wall, Rig((0.0, 1.0, 0.0), high / 2, 0.0, Head.HELD), (0.03,), 3e-4)
    weight = 2000.0 * 9.81 * high * thick
    d = test.displacement[9:]
    np.testing.assert_allclose(test.force[9:], weight * 2 * thick / high * (1 - d / thick), rtol=0.015)


def test_the_rig_refuses_what_it_cannot_push():
    block = scene(DryJoint(0.6))
    for rig, words in (
        (Rig((1.0, 0.0, 0.0), 0.9, LOAD), "below the stones' top"),
        (Rig((1.0, 0.0, 0.0), 1.2, 0.0, Head.FREE), "above the stones' top"),
    ):
        with pytest.raises(SceneError, match=words):
            loading_test(block, rig, (0.01,))
    for wrong, words in (
        ({"direction": (0.0, 0.0, 1.0), "height": 1.1}, "horizontal"),
        ({"direction": (1.0, 0.0, 0.0), "height": -1.0}, "height"),
        ({"direction": (1.0, 0.0, 0.0), "height": 1.0, "load": 1.0, "head": Head.FREE}, "a load on a top"),
    ):
        with pytest.raises(SceneError, match=words):
            Rig(**wrong)
    assert Rig((1.0, 0.0, 0.0), 1.1).pieces == (BASE, BEAM)
    with pytest.raises(SceneError, match="backwards without a beam"):
        loading_test(block, Rig((1.0, 0.0, 0.0), 0.5, 0.0, Head.FREE), (0.01, -0.01))
    grows = StoneForce(frozenset({"block"}), History.trapezoid(0.0, 1.0, [0.0, 0.0, -1.0]))
    with pytest.raises(SceneError, match="changes with time"):
        loading_test(replace(block, loads=Loads(forces=(grows,))), Rig((1.0, 0.0, 0.0), 1.1, LOAD), (0.01,))


def soft(tension=2e5, shear=2e5, opening=10.0, sliding=100.0):
    """Joint whose bond is lost over 2 G/c: 0.1 mm of opening, 1 mm of sliding."""
    return ElasticJoint(
        0.5, 1e11, 4e10, tension=tension, shear=shear, energy_tension=opening, energy_shear=sliding
    )


def test_a_step_is_half_of_the_shortest_way_over_which_bonds_soften():
    one = scene(soft())
    assert softening_step(one) == pytest.approx(0.5e-4)
    assert softening_step(scene(soft(opening=200.0))) == pytest.approx(0.5e-3)
    # no more tension is held than shear over friction
    assert softening_step(scene(soft(tension=8e5))) == pytest.approx(0.25e-4)
    assert softening_step(scene(CohesiveZone(0.5, 1e5, 1e5, 3.0, 300.0))) == pytest.approx(3e-5)
    assert softening_step(scene(DryJoint(0.6))) == np.inf
    rule = LawRule(frozenset({"block"}), frozenset({BASE}), soft())
    ruled = replace(one, contact=replace(one.contact, law=DryJoint(0.6), rules=(rule,)))
    assert softening_step(ruled) == pytest.approx(0.5e-4)


def test_steps_follow_from_the_softening_where_none_are_asked_for():
    rig = Rig((1.0, 0.0, 0.0), PUSH, LOAD)
    for opening, to, step in ((1.0, 0.01, 0.5e-5), (1.0, 1e-4, 5e-7), (10.0, 0.001, 5e-6)):
        test = loading_test(scene(soft(opening=opening)), rig, (to,), stop=lambda: True)
        assert test.displacement[0] == pytest.approx(step)


def test_secants_are_taken_at_15_and_30_percent_of_the_largest_force():
    """F = 100 kN u/(u + 1 mm): at 0.15 of 80 kN the secant is 88 kN/mm, at 0.3 of it 76."""
    place = np.linspace(1e-6, 4e-3, 4000)
    force = 1e5 * place / (place + 1e-3)
    test = replace(slippery(0.001), displacement=place, force=force)
    assert test.early_stiffness == pytest.approx((1e5 - 0.15 * 8e4) / 1e-3, rel=1e-3)
    assert test.stiffness == pytest.approx((1e5 - 0.3 * 8e4) / 1e-3, rel=1e-3)


def stacked(shift):
    """Two boxes, the upper one aside by `shift` [m]."""
    lower = box("lower", (0.0, 0.0, 0.0), (WIDTH, DEEP, 0.5), STONE)
    upper = box("upper", (shift, 0.0, 0.5), (shift + WIDTH, DEEP, 1.0), STONE)
    return Scene("stack", (lower, upper), contact=ContactSettings(ElasticJoint(0.7, 1e10, 4e9)))


def wedged(slope):
    """Two parts of a block, on a joint with a slope, and friction 0.2."""
    blocks = []
    for code, low in (("base", 0.0), ("slider", 0.5)):
        part = box(code, (0.0, 0.0, low), (WIDTH, DEEP, low + 0.5), STONE)
        corners = part.vertices.copy()
        in_joint = np.isclose(corners[:, 2], 0.5)
        corners[in_joint, 2] += slope * (corners[in_joint, 0] - WIDTH / 2)
        blocks.append(replace(part, vertices=corners))
    return Scene("wedge", tuple(blocks), contact=ContactSettings(ElasticJoint(0.2, 1e10, 4e9)))


@pytest.mark.parametrize(
    ("stones", "rig", "words"),
    [
        (stacked(0.4), Rig((1.0, 0.0, 0.0), 0.7, 0.0, Head.FREE), r"upper at \(0\.70, 0\.10, 0\.75\) m by"),
        (
            wedged(-0.5),
            Rig((1.0, 0.0, 0.0), 0.7, 0.0, Head.FREE),
            r"slider at \(0\.\d\d, 0\.10, 0\.\d\d\) m by",
        ),
        (wedged(-0.5), Rig((1.0, 0.0, 0.0), PUSH, LOAD), r"slider at \(0\.\d\d, 0\.10, 0\.\d\d\) m by"),
    ],
)
def test_stones_that_do_not_come_to_rest_are_named_with_their_places(stones, rig, words):
    with pytest.raises(SolverError, match=words):
        loading_test(stones, rig, (0.01,))


def test_rest_is_judged_by_what_stones_carry():
    """What is out of balance counts over the weight and the force on top of it: (40 + 2.354)/2.354 = 17.99."""
    rig = Rig((1.0, 0.0, 0.0), PUSH, LOAD)
    jaws = JawPath(frozenset(JAWS), rig.axes[0], (0.01,), 1.0)
    model, _ = build_model(rigged(scene(DryJoint(1.0)), rig, jaws))
    loaded = _loaded(model, rig)
    assert loaded.scene.time.balance_tolerance == pytest.approx(1e-4 * (LOAD + WEIGHT) / WEIGHT)
    alone = _loaded(model, replace(rig, load=0.0))
    assert alone.scene.time.balance_tolerance == pytest.approx(1e-4)
