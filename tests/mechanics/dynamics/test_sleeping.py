"""Stones at rest sleep, and nothing that matters changes by it: slides, hits and failures come when they are due."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.dynamics.observers.equilibrium import imbalance, support_reaction
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Scene, TimeSettings
from mechanics.simulate import simulate
from tests.validation.scenes import G, box, ground, moved, rotation, tilted_gravity

SLEEP = 1e-3


def scene(*blocks, friction=0.6, gravity=(0.0, 0.0, -G), loads=None, duration=0.3, sleep=SLEEP, theta=0.5):
    return Scene(
        "sleep",
        (ground(), *blocks),
        gravity=gravity,
        contact=ContactSettings(DryJoint(friction)),
        time=TimeSettings(1e-3, theta, duration, stop_at_equilibrium=False, sleep=sleep),
        loads=loads or Loads(),
    )


def stack(count, x=0.0, side=0.4, rise=0.2):
    return [box(f"{x:g}-{k}", (x, 0.0, k * rise), (x + side, side, (k + 1) * rise)) for k in range(count)]


def run(one, steps=None):
    """Every step, with who sleeps after it."""
    model, start = build_model(one)
    simulation = Simulation(model, start)
    for _ in range(steps or round(one.time.duration / one.time.step)):
        yield simulation, simulation.step()


def test_a_stack_falls_asleep_and_bears_its_weight():
    one = scene(*stack(4))
    *_, (simulation, step) = run(one, 120)
    assert simulation.asleep.tolist() == [False, True, True, True, True]
    assert len(step.active.contacts) == 0
    assert len(step.contacts) == 16
    assert not step.after.velocity.any()
    model = simulation.model
    assert support_reaction(model, step.contacts, step.force, step.kick.load, step.after.time).error < 1e-4
    whole = imbalance(model, step.after, step.contacts, step.force, step.kick.load)
    light = imbalance(
        model, step.after, step.active.contacts, step.active.force, step.kick.load, step.resting
    )
    assert whole.max() < SLEEP
    np.testing.assert_allclose(light, whole, atol=1e-12)


def test_without_the_key_nobody_sleeps():
    for simulation, _ in run(scene(*stack(2), sleep=0.0), 120):
        assert not simulation.asleep.any()


def test_nobody_sleeps_in_a_relaxation():
    one = scene(*stack(2))
    one = replace(one, time=replace(one.time, relaxation=True, theta=1.0))
    assert not any(simulation.asleep.any() for simulation, _ in run(one, 120))


@pytest.mark.parametrize("sleep", [-0.1, 1.0, float("nan")])
def test_a_sleep_that_is_no_part_of_a_weight_is_refused(sleep):
    with pytest.raises(SceneError, match="sleep"):
        TimeSettings(sleep=sleep)


def test_a_run_repeats_bit_for_bit():
    shot = box("shot", (-0.6, 0.1, 0.25), (-0.4, 0.3, 0.4), velocity=(4.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    one = scene(*stack(2), *stack(2, 1.0), shot, duration=0.17)
    first, second = simulate(one), simulate(one)
    for a, b in zip(first.bodies, second.bodies, strict=True):
        assert np.array_equal(a.position, b.position)
    assert np.array_equal(first.history.balance, second.history.balance)
    np.testing.assert_array_equal(first.contacts.force, second.contacts.force)


def test_who_is_hit_wakes_in_that_very_step():
    """A stone that flies at 3 m/s into a sleeping one of the same mass, without friction: both go on at 1.5 m/s."""
    still = box("still", (0.0, 0.0, 0.0), (0.4, 0.4, 0.4))
    shot = box("shot", (-1.0, 0.0, 0.0), (-0.6, 0.4, 0.4), velocity=(3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    slept = []
    for simulation, step in run(scene(still, shot, friction=0.0), 205):
        slept.append(bool(simulation.asleep[1]))
        # the landing takes two steps, and momentum is whole in both
        assert step.after.velocity[1:, 0].sum() == pytest.approx(3.0, rel=1e-6)
    assert slept.index(True) < 100
    assert slept.index(False, 100) == pytest.approx(0.6 / 3.0 / 1e-3, abs=2)
    assert step.after.velocity[1:, 0] == pytest.approx([1.5, 1.5], rel=1e-6)


def test_a_hit_goes_through_a_whole_row_of_sleepers_at_once():
    """Momentum m v is shared by nine equal stones that touch: none of it is lost on those that are held."""
    row = [box(str(k), (0.4 * k, 0.0, 0.0), (0.4 * (k + 1), 0.4, 0.4)) for k in range(8)]
    shot = box("shot", (-1.0, 0.0, 0.0), (-0.6, 0.4, 0.4), velocity=(3.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    for simulation, step in run(scene(*row, shot, friction=0.0), 205):
        if 0.1 < step.after.time < 0.19:
            assert simulation.asleep[1:-1].all()
        assert step.after.velocity[1:, 0].sum() == pytest.approx(3.0, rel=1e-6)
    assert step.after.velocity[1:, 0] == pytest.approx(np.full(9, 3.0 / 9.0), rel=1e-5)


@pytest.mark.parametrize("ratio", [1.001, 1.0003])
def test_a_slide_that_is_hardly_one_is_not_stopped(ratio):
    """On a slope with tan α = ratio·μ a block slides by ½ (g sin α - μ g cos α) t²."""
    friction = 0.5
    slope = np.degrees(np.arctan(ratio * friction))
    block = box("block", (0.0, 0.0, 0.0), (0.4, 0.4, 0.1))
    one = scene(block, friction=friction, gravity=tilted_gravity(slope), duration=0.3)
    slept, place = False, 0.0
    for simulation, step in run(one):
        slept, place = slept or bool(simulation.asleep.any()), step.after.centre[1, 0]
    assert not slept
    net = G * (np.sin(np.radians(slope)) - friction * np.cos(np.radians(slope)))
    assert place - 0.2 == pytest.approx(0.5 * net * 0.3**2, rel=0.02)


def test_a_block_that_holds_on_its_slope_sleeps():
    slope = np.degrees(np.arctan(0.999 * 0.5))
    block = box("block", (0.0, 0.0, 0.0), (0.4, 0.4, 0.1))
    one = scene(block, friction=0.5, gravity=tilted_gravity(slope))
    *_, (simulation, _) = run(one, 120)
    assert simulation.asleep[1]


@pytest.mark.parametrize("angle", [1e-2, 1e-4])
def test_a_block_that_rocks_is_not_stopped_at_its_turning_point(angle):
    """It is let go on one edge, at rest but out of balance, however small the angle."""
    block = box("block", (0.0, 0.0, 0.0), (0.2, 0.2, 0.8))
    tilted = moved(block, rotation((0.0, 1.0, 0.0), np.degrees(angle)))
    lift = -tilted.vertices[:, 2].min()
    tilted = replace(tilted, vertices=tilted.vertices + np.array([0.0, 0.0, lift]))
    asleep, awake = (
        [step.after.rotation[1] for _, step in run(scene(tilted, sleep=sleep), 60)] for sleep in (SLEEP, 0.0)
    )
    assert np.array_equal(asleep, awake)


def test_a_table_that_turns_late_wakes_a_block_when_it_slides():
    """A table turns from 0.1 s on: a sleeping block slides at tan α = μ, as if it had been awake.

    From then on its acceleration grows by g ω / cos α in a second, so it has 1 mm/s after (2·10⁻³ cos α / g ω)^½.
    """
    friction, rate = 0.3, np.radians(60.0)
    block = box("block", (0.0, 0.0, 0.0), (0.4, 0.4, 0.1))
    table = TiltingTable((0.0, 1.0, 0.0), History(np.array([0.0, 0.1, 1.1]), np.array([0.0, 0.0, rate])))
    first = {}
    for sleep in (SLEEP, 0.0):
        one = scene(block, friction=friction, loads=Loads(gravity=(table,)), duration=0.5, sleep=sleep)
        slept = False
        for simulation, step in run(one):
            slept = slept or bool(simulation.asleep.any())
            if abs(step.after.velocity[1, 0]) > 1e-3:
                first[sleep] = step.after.time
                break
        assert slept == (sleep > 0)
    assert first[SLEEP] == first[0.0]
    late = np.sqrt(2e-3 * np.cos(np.arctan(friction)) / (G * rate))
    assert first[0.0] == pytest.approx(0.1 + np.arctan(friction) / rate + late, abs=2e-3)


def test_a_sleeping_wall_fails_under_a_growing_push_at_the_same_instant():
    """The top stone of a stack of three is pushed harder and harder: it slides when the push is μ m g.

    From then on its acceleration grows by g in 0.25 s, so it has 1 mm/s after (2·10⁻³ · 0.25 / g)^½.
    """
    stones = stack(3)
    weight = 2400.0 * 0.4 * 0.4 * 0.2 * G
    push = History(np.array([0.0, 0.15, 0.4]), np.outer([0.0, 0.0, weight], [1.0, 0.0, 0.0]))
    loads = Loads(forces=(StoneForce(frozenset({stones[-1].code}), push),))
    first = {}
    for sleep in (SLEEP, 0.0):
        for _, step in run(scene(*stones, loads=loads, duration=0.4, sleep=sleep)):
            if step.after.velocity[3, 0] > 1e-3:
                first[sleep] = step.after.time
                break
    assert first[SLEEP] == pytest.approx(first[0.0], abs=1.5e-3)
    assert first[0.0] == pytest.approx(0.15 + 0.6 * 0.25 + np.sqrt(5e-4 / G), abs=2e-3)


def pushed(most, **more):
    """A block of 0.4 × 0.4 × 0.2 m whose horizontal push grows from 0.1 s to 0.15 s to a part of its weight."""
    (stone,) = stack(1)
    weight = 2400.0 * 0.4 * 0.4 * 0.2 * G
    push = History(np.array([0.0, 0.1, 0.15]), np.outer([0.0, 0.0, most * weight], [1.0, 0.0, 0.0]))
    return scene(stone, loads=Loads(forces=(StoneForce(frozenset({stone.code}), push),)), **more)


@pytest.mark.parametrize(("most", "sleeps"), [(0.9 * SLEEP, True), (5 * SLEEP, False)])
def test_a_push_beyond_sleep_wakes_a_stone_that_friction_holds(most, sleeps):
    """No step ends with a stone asleep whose push, over its weight, is more than `sleep`; up to that, it sleeps on."""
    for simulation, step in run(pushed(most), 148):
        if 0.06 < step.after.time < 0.1:
            assert simulation.asleep[1]
    assert simulation.asleep[1] == sleeps
    history = simulate(pushed(most)).history
    assert history.balance[60:].max() <= SLEEP
    assert (history.balance[160:200].max() > 0.5 * SLEEP) == sleeps


def test_a_sleeping_stone_wakes_where_it_alone_keeps_the_scene_from_its_end():
    """A push of half of `sleep` leaves it asleep, but out of balance by more than the scene's tolerance for its end."""
    one = pushed(0.5e-2, sleep=1e-2, duration=0.4)
    still = simulate(one)
    assert still.errors.balance == pytest.approx(0.5e-2, rel=1e-3)
    result = simulate(replace(one, time=replace(one.time, stop_at_equilibrium=True)))
    assert one.time.balance_tolerance < 0.5e-2
    assert result.outcome.rests
    assert 0.15 < result.time < 0.25
    assert result.errors.balance <= one.time.balance_tolerance


def test_supports_that_move_wake_all():
    """A support that sinks from 0.2 s on takes its stack along; a sleeping stone would stay in the air."""
    stones = stack(2)
    sink = settlement(["ground"], (0.0, 0.0, -0.01), 0.2, start=0.15)
    for simulation, step in run(scene(*stones, loads=Loads(motions=(sink,)), duration=0.45)):
        if 0.16 < step.after.time < 0.34:
            assert not simulation.asleep.any()
    assert simulation.asleep[1:].all()
    assert step.after.centre[1:, 2] - [0.1, 0.3] == pytest.approx(-0.01, abs=1e-6)


def test_a_support_that_only_turns_wakes_all():
    """A floor turns about its middle, on which a block stands: friction takes the block along."""
    block = box("block", (-0.2, -0.2, 0.0), (0.2, 0.2, 0.2))
    spin = History(np.array([0.0, 0.1, 0.2, 0.3]), np.array([0.0, 0.0, 1.0, 0.0]))
    turning = ImposedMotion(frozenset({"ground"}), spin=spin)
    for simulation, step in run(scene(block, loads=Loads(motions=(turning,)), duration=0.4)):
        assert simulation.asleep[1] or not 0.06 < step.after.time < 0.1
        assert not (simulation.asleep[1] and 0.11 < step.after.time < 0.29)
    np.testing.assert_allclose(step.after.rotation[1], rotation((0.0, 0.0, 1.0), np.degrees(0.1)), atol=1e-4)


def test_a_stone_that_is_pulled_from_under_another_wakes_it():
    """The lower of two stones is pulled out by six times its weight; the upper falls."""
    stones = stack(2)
    weight = 2400.0 * 0.4 * 0.4 * 0.2 * G
    pull = History(np.array([0.0, 0.1, 0.12]), np.outer([0.0, 0.0, 6 * weight], [1.0, 0.0, 0.0]))
    loads, paths = Loads(forces=(StoneForce(frozenset({stones[0].code}), pull),)), {}
    for sleep in (SLEEP, 0.0):
        one = scene(*stones, friction=0.05, loads=loads, duration=0.4, sleep=sleep)
        paths[sleep] = np.array([step.after.centre for _, step in run(one)])
    assert paths[0.0][-1, 2, 2] < 0.25
    np.testing.assert_allclose(paths[SLEEP], paths[0.0], atol=1e-5)


def test_energy_and_history_count_those_asleep():
    """Two of four stacks are hit: reaction, weight, contacts and energy are those of the whole scene."""
    shot = box("shot", (-1.2, 0.1, 0.25), (-1.0, 0.3, 0.4), velocity=(3.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    stacks = [stone for x in (0.0, 1.0, 2.0, 3.0) for stone in stack(2, x)]
    result = simulate(scene(*stacks, shot, duration=0.45))
    awake = simulate(scene(*stacks, shot, duration=0.45, sleep=0.0))
    assert result.errors.energy < 1e-9
    assert result.history.contacts[100] == awake.history.contacts[100]
    assert result.reaction == pytest.approx(awake.reaction, rel=2e-3)
    assert len(result.contacts.gap) == len(awake.contacts.gap)
    for one, other in zip(result.bodies, awake.bodies, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=2e-5)


def test_sleep_does_not_keep_a_scene_from_its_equilibrium():
    """A slab is dropped on one of two stacks that sleep: the run ends in balance to the scene's own tolerance."""
    slab = box("slab", (0.0, 0.0, 0.43), (0.4, 0.4, 0.63))
    one = scene(*stack(2), *stack(2, 1.0), slab, duration=1.0, sleep=1e-2)
    result = simulate(replace(one, time=replace(one.time, stop_at_equilibrium=True)))
    assert result.outcome.rests
    assert result.time > np.sqrt(2 * 0.03 / G)
    assert result.errors.balance <= one.time.balance_tolerance
    assert result.errors.reaction <= 1e-3
