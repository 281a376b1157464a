"""Verdicts: rests that last, falls without return, motions in between, and what unsolved steps leave open."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.rest.relaxation import Relaxation
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.verdicts.watch import Watch
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Fidelity, Method, SolverSettings, Start
from mechanics.scene.shapes import bond, box, wall
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, moved, opening, scene

G = 9.81


@pytest.mark.parametrize("step", [1e-3, pytest.param(2e-3, marks=pytest.mark.slow), 5e-3])
def test_a_wall_without_a_lintel_collapses_whatever_the_step_though_a_relaxation_jams_it(step):
    """Its stones rest after 8 mm to 0.12 m where they are halted, held by forces that nothing causes."""
    result = simulate(opening(step=step, relaxation=True))
    assert result.outcome is Outcome.COLLAPSED
    assert result.reason.startswith("stone 3-")


def between_walls(method, count=1):
    """Stones side by side that just fill the room between two upright walls."""
    walls = ground((-2, -1, -3), (0, 1, 2)), replace(ground((2, -1, -3), (4, 1, 2)), code="other")
    at = np.linspace(0.0, 2.0, count + 1)
    stones = [brick(str(k), (at[k], 0, 0), (at[k + 1], 0.5, 0.2)) for k in range(count)]
    one = scene(*walls, *stones, step=5e-3, duration=0.5)
    return replace(one, contact=ContactSettings(DryJoint(0.8)), solver=SolverSettings(method=method))


@pytest.mark.parametrize("method", [Method.AUTO, Method.ADMM, Method.INTERIOR_POINT, Method.NEWTON])
@pytest.mark.parametrize("count", [1, 2])
def test_stones_that_only_self_stress_could_hold_fall(method, count):
    assert not simulate(between_walls(method, count)).outcome.rests


def test_a_rest_by_self_stress_is_disproved_and_told():
    result = simulate(between_walls(Method.ADMM, 2))
    assert not result.outcome.rests
    assert result.reason.startswith("held only by self-stress, which no load applies")


def test_a_rest_that_comes_back_is_one_or_undecided_where_forces_from_nothing_surely_move_it():
    """Rigid joints admit the rest and a motion then: neither waiting nor a verdict of motion would be true."""
    one = between_walls(Method.AUTO)
    model, start = build_model(one)
    low, beside = (replace(start, centre=start.centre - np.array([0.0, 0.0, z])) for z in (0.01, 0.01001))
    watch, rest = Watch(model, start), Outcome.SETTLED
    assert [watch.disproved(rest, state, surely=True) for state in (start, low)] == [Outcome.MOVING] * 2
    assert watch.disproved(rest, beside, surely=False) is rest
    again = watch.disproved(rest, beside, surely=True)
    assert again is Outcome.UNDECIDED
    assert watch.verdict(again, None).reason.startswith("held only by self-stress, which no load applies")


def test_a_rest_near_its_limit_is_found_again_after_next_to_nothing():
    """A wall of 20 courses under .9 of the load of its candidate begins to slide in the step from nothing."""
    stones = wall(bond(12, 12), 0.4, 0.2, 0.2)
    one = scene(*stones, step=5e-3, duration=0.5)
    result = simulate(replace(one, gravity=(0.4 * G, 0.0, -G)))
    assert result.outcome is Outcome.EQUILIBRIUM


def slope(angle, velocity, **time):
    """A flat stone on a slope with friction 0.6, in motion."""
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    base, stone = ground((-20, -1, -1), (20, 1, 0)), brick("slab", (0, 0, 0), (1, 0.5, 0.2))
    along = turn @ [velocity, 0, 0]
    return scene(
        moved(base, turn), replace(moved(stone, turn), velocity=(*along, 0, 0, 0)), step=2e-3, **time
    )


def test_a_stone_in_balance_that_slides_at_a_constant_speed_moves():
    """At tan α = μ friction balances the weight of a sliding stone: balance alone is no rest."""
    result = simulate(slope(np.arctan(0.6), 0.01, duration=0.1))
    assert result.errors.balance < 1e-4
    assert result.outcome is Outcome.MOVING
    assert result.reason == "stone slab moves at 10 mm/s"


def test_a_slow_slide_is_a_motion_however_far_it_goes():
    result = simulate(slope(np.arctan(0.6), 0.05, duration=1.0, collapse_displacement=0.05))
    assert result.outcome is Outcome.MOVING
    moved_by = np.linalg.norm(result.bodies[1].displacement, axis=1).max()
    assert moved_by == pytest.approx(0.05, rel=0.01)


def test_a_stone_at_rest_in_steps_that_are_not_solved_is_undecided():
    stones = (brick(str(k), (0, 0, k), (1, 0.7, k + 1)) for k in range(2))
    solver = SolverSettings(tolerance=1e-17, max_iterations=100)
    one = replace(scene(ground(), *stones, step=5e-3, duration=0.1), solver=solver)
    result = simulate(one)
    assert result.errors.balance < 1e-6
    assert result.outcome is Outcome.UNDECIDED
    assert "of 20 steps were not solved" in result.reason


def test_a_rest_of_deformable_stones_is_no_verdict_before_it_is_confirmed():
    """Their scene is run again with rigid stones; stopped meanwhile, the run is interrupted."""
    seen = []
    cube = brick("cube", (0, 0, 0), (0.5, 0.5, 0.5), Fidelity.DEFORMABLE)
    one = scene(ground(), cube, step=5e-3, duration=0.5, relaxation=True)
    assert simulate(one, lambda told: seen.append(told.stage)).outcome is Outcome.EQUILIBRIUM
    assert "confirm" in seen
    seen.clear()
    result = simulate(one, lambda told: seen.append(told.stage), lambda: "confirm" in seen)
    assert result.outcome is Outcome.INTERRUPTED


def test_rigid_stones_that_relax_are_balanced_whatever_the_velocity_tolerance():
    """With 0.1 for their velocities alone they would not be in equilibrium."""
    stones = (brick(str(k), (0, 0, 0.5 * k), (1, 0.5, 0.5 * (k + 1))) for k in range(6))
    one = scene(ground(), *stones, step=5e-3, duration=0.1, relaxation=True)
    result = simulate(replace(one, solver=SolverSettings(Method.ADMM, tolerance=0.5, velocity_tolerance=0.1)))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.balance <= one.time.balance_tolerance


def test_a_fall_that_unsolved_steps_may_have_caused_is_undecided():
    one = replace(opening(step=5e-3), solver=SolverSettings(tolerance=1e-15, max_iterations=1))
    result = simulate(one)
    assert result.errors.unconverged_steps > 0
    assert result.outcome is Outcome.UNDECIDED
    assert "steps were not solved, with errors of up to" in result.reason


def test_a_block_that_rocks_far_and_comes_back_stands():
    """Let go at 0.9 of its tipping angle its top swings through 0.7 of its width."""
    angle = 0.9 * np.arctan(0.4)
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    block = moved(brick("a", (0, 0, 0), (0.4, 0.4, 1)), turn)
    result = simulate(scene(ground(), block, step=4e-3, duration=5.0))
    assert result.outcome is Outcome.SETTLED
    assert result.reason.startswith("it does not stand as surveyed: stone a came to rest ")


def test_a_cube_that_topples_has_collapsed_though_its_centre_is_as_high_as_before():
    # about its edge, at 1.2 times the least speed that takes it over, √(3 g (√2 - 1) / 2a)
    spin = 1.2 * np.sqrt(1.5 * G * (np.sqrt(2) - 1) / 0.5)
    velocity = 0.25 * spin, 0.0, 0.25 * spin, 0.0, spin, 0.0
    block = replace(brick("cube", (0, 0, 0), (0.5, 0.5, 0.5)), velocity=velocity)
    result = simulate(scene(ground(), block, step=4e-3, duration=5.0))
    assert result.outcome is Outcome.COLLAPSED
    assert result.bodies[1].position[:, 2].max() == pytest.approx(0.5, abs=1e-3)
    assert result.reason.startswith("stone cube has fallen or toppled")


def test_a_stone_that_drops_before_it_rests_is_named_with_its_share():
    result = simulate(scene(ground(), brick("a", (0, 0, 0.02), (1, 0.8, 0.42)), step=5e-3))
    assert result.outcome is Outcome.SETTLED
    assert (
        result.reason == "it does not stand as surveyed: stone a came to rest 20 mm lower, 5 % of its width"
    )


def test_a_static_start_that_fails_is_said_beside_the_verdict():
    one = scene(ground(), brick("a", (0, 0, 0.02), (1, 0.8, 0.04)), step=5e-3, start=Start.EQUILIBRIUM)
    result = simulate(one)
    assert not result.static.found
    assert "no static equilibrium was found: the run began at rest, all loads at once" in result.cautions


def test_a_static_start_keeps_the_velocities_of_the_scene():
    block = replace(brick("a", (0, 0, 0), (1, 0.8, 0.4)), velocity=(1.0, 0, 0, 0, 0, 0))
    result = simulate(scene(ground(), block, step=1e-3, start=Start.EQUILIBRIUM))
    assert result.static.found
    # v²/(2 μ g)
    assert result.bodies[1].displacement[:, 0].mean() == pytest.approx(1 / (2 * 0.6 * G), rel=0.01)


def test_a_relaxation_does_not_halt_stones_that_begin_in_motion():
    block = replace(brick("a", (0, 0, 0), (1, 0.8, 0.4)), velocity=(1.0, 0, 0, 0, 0, 0))
    result = simulate(scene(ground(), block, step=1e-3, relaxation=True))
    assert result.bodies[1].displacement[:, 0].mean() == pytest.approx(1 / (2 * 0.6 * G), rel=0.01)
    assert any(caution.startswith("nothing was halted") for caution in result.cautions)


def test_an_overlap_between_fixed_stones_does_not_hold_what_nothing_carries():
    """A block 2 µm too wide between two fixed walls: an overlap that is pushed out would wedge it."""
    walls = ground((-1, 0, 0), (0, 1, 1), "left"), ground((1, 0, 0), (2, 1, 1), "right")
    for relaxation in (False, True):
        block = brick("block", (-1e-6, 0.2, 0.2), (1 + 1e-6, 0.8, 0.8))
        result = simulate(scene(*walls, block, step=5e-3, relaxation=relaxation))
        assert result.outcome is Outcome.COLLAPSED


def test_a_wedge_that_friction_holds_rests_and_lasts():
    """A keystone in a slot whose sides are 10° off the vertical, tan 10° = 0.18 < μ: held from the first step."""
    low, high = 0.1, 0.1 + 0.5 * np.tan(np.radians(10))
    wedge = box("wedge", (-0.1, 0, 0), (0.1, 0.3, 0.5))
    corners = wedge.vertices.copy()
    corners[:, 0] = np.sign(corners[:, 0]) * np.where(corners[:, 2] > 0.25, high, low)
    sides = []
    for sign in (-1, 1):
        side = ground((0.1, -0.1, 0), (1, 0.4, 0.5), f"side{sign}")
        at = side.vertices.copy()
        inner = at[:, 0] < 0.5
        at[inner, 0] = np.where(at[inner, 2] > 0.25, high, low)
        at[:, 0] *= sign
        faces = side.faces if sign > 0 else tuple(tuple(reversed(face)) for face in side.faces)
        sides.append(replace(side, vertices=at, faces=faces))
    for relaxation in (False, True):
        result = simulate(scene(*sides, replace(wedge, vertices=corners), step=2e-3, relaxation=relaxation))
        assert result.outcome is Outcome.EQUILIBRIUM
        assert not result.cautions


@pytest.mark.parametrize(("gap", "held"), [(0.004, True), (0.006, False)])
def test_mortar_that_is_too_wide_to_hold_is_told(gap, held):
    """The bed under the second of two stones 0.5 m wide is not filled where it is wider than 5 mm."""
    stones = brick("A", (0, 0, 0), (1, 0.5, 1)), brick("B", (0, 0, 1 + gap), (1, 0.5, 2))
    one = scene(ground(), *stones, step=1e-4, duration=5e-4)
    one = replace(one, contact=replace(one.contact, law=MortarJoint(0.6, 1e5, 2e5)))
    expected = "mortar does not hold 50 % of the area of its joints, where gaps or overlaps exceed a hundredth of the "
    told = [caution for caution in simulate(one).cautions if "mortar" in caution]
    assert told == ([] if held else [f"{expected}smaller stone's width (A and B: 6 mm)"])


@pytest.mark.parametrize("relaxation", [False, True])
@pytest.mark.parametrize("step", [1e-9, 1e-13])
def test_a_time_too_short_to_see_anything_move_decides_nothing(step, relaxation):
    """Nothing holds the stone; in 200 steps of a nanosecond it falls by 0.2 pm, at 2 µm/s."""
    stone = brick("a", (0, 0, 1), (0.5, 0.5, 1.5))
    result = simulate(scene(ground(), stone, step=step, duration=200 * step, relaxation=relaxation))
    assert result.outcome is Outcome.MOVING
    assert result.cautions[0].startswith("whether it stands is not decided")


@pytest.mark.parametrize(("damping_time", "outcome"), [(100.0, Outcome.MOVING), (0.07, Outcome.SETTLED)])
def test_what_dashpots_hold_for_a_while_does_not_rest(damping_time, outcome):
    """On springs of 1 MPa/m a cube of 0.5 m sinks by 13 mm: at 0.13 mm/s at first, where τ is 100 s."""
    law = ElasticJoint(0.6, normal_stiffness=1e6, shear_stiffness=1e6, damping_time=damping_time)
    one = scene(ground(), brick("a", (0, 0, 0), (0.5, 0.5, 0.5)), step=5e-3, duration=1.0, theta=1.0)
    assert simulate(replace(one, contact=ContactSettings(law))).outcome is outcome


@pytest.mark.parametrize(("share", "rests"), [(0.5, True), (1.2, False)])
def test_a_rest_before_the_last_load_has_come_is_no_equilibrium(share, rests):
    """A block rests from the start; a push that is a share of its friction comes between 0.1 and 0.15 s."""
    most = share * 0.6 * 2000.0 * 0.4 * G
    push = History(np.array([0.1, 0.15]), np.array([[0.0, 0, 0], [most, 0, 0]]))
    one = scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.4)), step=5e-3, duration=0.3)
    result = simulate(replace(one, loads=Loads(forces=(StoneForce(frozenset({"a"}), push),))))
    assert (result.outcome is Outcome.EQUILIBRIUM) == rests
    assert result.time > 0.15


def test_a_rest_before_a_support_has_moved_is_no_equilibrium():
    """The ground sinks by 20 mm between 0.1 and 0.15 s."""
    one = scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.4)), step=5e-3, duration=0.3)
    result = simulate(replace(one, loads=Loads(motions=(settlement(["ground"], (0, 0, -0.02), 0.05, 0.1),))))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert 0.15 < result.time < 0.25
    assert result.bodies[1].displacement[:, 2] == pytest.approx(-0.02, abs=1e-5)


def stepped(one):
    """A scene, its start, and its first step."""
    model, start = build_model(one)
    return model, start, Simulation(model, start).step()


def test_a_rest_lasts_for_five_steps_in_a_row():
    """Balance that comes and goes is none, however often it comes."""
    model, start, step = stepped(scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.4)), step=5e-3))
    watch, calm, not_calm = Watch(model, start), np.zeros(2), np.array([0.0, 1.0])
    for _ in range(3):
        assert [watch(step, calm) for _ in range(4)] == [Outcome.MOVING] * 4
        assert watch(step, not_calm) is Outcome.MOVING
    assert [watch(step, calm) for _ in range(5)] == [Outcome.MOVING] * 4 + [Outcome.EQUILIBRIUM]


@pytest.mark.parametrize(
    ("degrees", "aside", "outcome"),
    [
        (90.0, 0.5, Outcome.COLLAPSED),  # it lies on its side, as high as before
        (90.0, 0.0, Outcome.COLLAPSED),  # its corners are elsewhere all the same
        (5.0, 0.5, Outcome.SETTLED),
        (0.0, 0.0, Outcome.EQUILIBRIUM),
    ],
)
def test_a_stone_at_rest_on_its_side_has_toppled_without_having_sunk(degrees, aside, outcome):
    model, start, step = stepped(scene(ground(), brick("a", (0, 0, 0), (0.5, 0.5, 0.5)), step=5e-3))
    turn = np.radians(degrees)
    about = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    after = replace(
        step.after,
        centre=start.centre + np.array([[0.0, 0.0, 0.0], [aside, 0.0, 0.0]]),
        rotation=np.array([np.eye(3), about]),
        velocity=np.zeros((2, 6)),
    )
    watch, lying = Watch(model, start), replace(step, after=after)
    assert [watch(lying, np.zeros(2)) for _ in range(5)][-1] is outcome
    if outcome is Outcome.COLLAPSED:
        reason = watch.verdict(outcome, None).reason
        assert reason == "stone a has fallen or toppled, and lies 0 mm lower"


def test_supports_that_drive_apart_are_not_what_moves():
    """Two grounds part at 0.5 m/s each; a stone between them slides at a tenth of that."""
    away = [
        ImposedMotion(frozenset({code}), History.constant([way, 0.0, 0.0]))
        for code, way in (("left", -0.5), ("right", 0.5))
    ]
    stone = brick("a", (0, 0, 0), (1, 1, 0.4), velocity=(0.05, 0, 0, 0, 0, 0))
    grounds = [ground((x, -2, -1), (x + 1, 3, 0), code) for x, code in ((-5, "left"), (5, "right"))]
    one = scene(ground(), *grounds, stone, gravity=(0.0, 0.0, 0.0), step=5e-3, duration=0.05)
    result = simulate(replace(one, loads=Loads(motions=tuple(away))))
    assert result.outcome is Outcome.MOVING
    assert result.reason == "stone a moves at 50 mm/s"


def test_a_relaxation_forgets_the_energy_that_it_has_taken():
    """Halted after its peak, a motion begins anew, and goes on as long as its energy grows."""
    one = scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.4)), relaxation=True)
    model, state = build_model(one)
    relax, halts = Relaxation(model), []
    for pace in (1.0, 2.0, 1.5, 0.5, 1.0, 0.9):
        moving = replace(state, velocity=np.array([[0.0] * 6, [pace, 0, 0, 0, 0, 0]]))
        halts.append(not relax(moving).velocity.any())
    assert halts == [False, False, True, False, False, True]


def test_a_halt_takes_its_energy_from_the_balance():
    """A stone in flight is halted between two steps, and falls on from there."""
    flying = brick("a", (0, 0, 5), (1, 1, 5.4), velocity=(1.0, 0, 2.0, 0, 0, 0))
    model, start = build_model(scene(ground(), flying, step=5e-3))
    simulation, balance = Simulation(model, start), EnergyBalance(model, start)
    for count in range(6):
        if count == 3:
            balance.halted(simulation.state)
            simulation.halt(simulation.state.time)
        balance(simulation.step())
    # ½ m v² with v_z = 2 m/s - 3 g h
    taken = 0.5 * 2000.0 * 0.4 * (1.0 + (2.0 - 3 * G * 5e-3) ** 2)
    assert balance.scheme == pytest.approx(taken, rel=0.02)
    assert balance.error < 1e-9


def test_a_relaxation_under_loads_that_change_leaves_out_inertia_and_says_so():
    one = scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.4)), step=5e-3, relaxation=True)
    said = "relaxation left out the inertia of the motion while loads or supports changed"
    assert said not in simulate(one).cautions
    ramp = replace(one, loads=Loads(gravity=(GravityRamp(0.05),)))
    assert said in simulate(ramp).cautions


def test_a_stone_that_its_load_pushes_away_has_collapsed_on_level_ground():
    """Pushed by its weight, against a friction of 0.6 of it: what falls along its load falls, wherever that points."""
    push = StoneForce(frozenset({"a"}), History.constant([2000.0 * 0.4 * G, 0.0, 0.0]))
    one = scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.4)), step=5e-3, duration=1.0)
    result = simulate(replace(one, loads=Loads(forces=(push,))))
    assert result.outcome is Outcome.COLLAPSED
    # the load points downwards by as much: its way along it is 1/√2 of that along the ground
    along = result.bodies[1].displacement[:, 0].max() * np.sqrt(0.5)
    assert along > one.time.collapse_displacement * 0.4
    assert f"has sunk by {1e3 * along:.3g} mm" in result.reason
