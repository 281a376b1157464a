"""A run that begins in static equilibrium: what is found, what is carried over, and what stays as it was."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.scenes import wall_scene
from mechanics.dynamics.observers.equilibrium import speed, support_reaction
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.dynamics.warm_start import Memory
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactSolution
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import STATE
from mechanics.scene.loads.gravity import GravityRamp, TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Fidelity, SolverSettings, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.solvers.auto import Auto
from mechanics.stones.meshing.elements import Element
from tests.mechanics.shapes import TURN, brick, ground, scene, transformed

HARD, SOFT = Fidelity.RIGID, Fidelity.DEFORMABLE
G = 9.81


def column(*fidelities, low=0.0, gravity=(0.0, 0.0, -G), friction=0.6, tolerance=1e-9, **time):
    """Stones of 0.4 m x 0.3 m x 0.3 m, one on the other."""
    blocks = []
    for k, fidelity in enumerate(fidelities):
        corners = (0, 0, low + 0.3 * k), (0.4, 0.3, low + 0.3 * (k + 1))
        blocks.append(brick(f"{k}", *corners, fidelity, mesh_size=0.17, element=Element.HEX8))
    settings = {"step": 1e-3, "theta": 0.5, "balance_tolerance": 1e-7, "start": Start.EQUILIBRIUM, **time}
    one = scene(ground(), *blocks, gravity=gravity, friction=friction, **settings)
    return replace(one, solver=SolverSettings(tolerance=tolerance, velocity_tolerance=1e-7))


COLUMNS = {
    "elastic": (SOFT,),
    "elastic ones": (SOFT, SOFT),
    "rigid on elastic": (SOFT, HARD),
    "elastic on rigid": (HARD, SOFT),
    "one elastic between rigid ones": (HARD, SOFT, HARD),
    "rigid": (HARD,),
    "rigid ones": (HARD, HARD, HARD),
}
EVERY = pytest.mark.parametrize("name", COLUMNS)


def searched(one):
    """The result of the search, the model, and a run before and after it has taken the search over."""
    model, start = build_model(one)
    static, search = static_start(model, start, lambda _: None)
    simulation = Simulation(model, start)
    simulation.take_over(search)
    return model, start, static, search, simulation


@cache
def begun(name):
    return searched(column(*COLUMNS[name]))


@cache
def continued(name):
    """The first ten steps after a static start."""
    one = searched(column(*COLUMNS[name]))
    return one, [one[-1].step() for _ in range(10)]


@EVERY
def test_a_column_is_found_in_balance(name):
    _, _, static, _, _ = begun(name)
    assert static.found
    assert static.balance <= 1e-7
    assert static.natural_map <= 1e-7  # what rounding leaves in steps of 1 s
    assert 1 <= static.steps <= 4


@EVERY
def test_the_ground_carries_the_weight_from_the_first_step_on(name):
    (model, *_), steps = continued(name)
    weight = 2000.0 * 0.4 * 0.3 * 0.3 * G * len(COLUMNS[name])
    for step in steps:
        support = support_reaction(model, step.contacts, step.force, step.kick.load, step.after.time)
        assert support.weight == pytest.approx(weight, rel=1e-12)
        assert support.reaction == pytest.approx(weight, rel=1e-7)


def test_a_run_of_rigid_stones_begins_with_the_contacts_of_its_search():
    """A sliver may be found or not after movements of rounding, and with it its force would be lost."""
    _, _, told, search, simulation = searched(column(HARD, HARD))
    made = simulation.step()
    assert told.found
    assert made.solution.iterations == 0
    # the search goes on with the same contacts too, not with equal ones
    assert search.step().found.contacts is made.found.contacts


@EVERY
def test_bodies_stay_at_rest_and_the_solver_finds_its_work_done(name):
    """Slower than 1e-9 m/s, a ten-millionth of what gravity does in one step; at most one look of a solver."""
    (model, *_), steps = continued(name)
    assert max(speed(model, step.after).max() for step in steps) < 1e-9
    # rigid stones: the sweeps with which every solution begins
    assert max(step.solution.iterations for step in steps) <= 20
    assert all(step.solution.converged for step in steps)


@EVERY
def test_the_clock_starts_at_zero_with_all_bodies_at_rest(name):
    _, start, _, search, _ = begun(name)
    simulation = Simulation(begun(name)[0], start)
    simulation.take_over(search)
    assert simulation.state.time == 0.0
    assert not simulation.state.velocity.any()
    assert not simulation.state.node_velocity.any()


def test_frames_of_a_run_have_their_stresses_the_first_that_of_the_search():
    result = simulate(column(SOFT, HARD))
    assert len(result.frames) == 2
    assert result.bodies[1].stress is result.frames[-1].stresses[1]
    assert result.bodies[1].values.error == result.frames[-1].stress_errors[1]
    # that of the drawing would be without stress
    pressure = 2000.0 * G * 0.6  # at the foot
    assert np.abs(result.frames[0].stresses[1][:, 2]).max() > 0.5 * pressure


def test_an_elastic_column_has_shortened_and_rigid_stones_have_not_moved():
    """Under its weight a stone of height H and E = 1 GPa shortens by some ρgH²/2E = 0.9 µm: 0.5 to 1.2 times that."""
    _, start, *_, simulation = begun("elastic")
    top = np.isclose(start.node[:, 2], 0.3)
    sunk = (start.node - simulation.state.node)[top, 2].mean()
    assert 0.5 < sunk / (2000 * G * 0.3**2 / 2e9) < 1.2
    _, start, *_, simulation = begun("rigid ones")
    np.testing.assert_allclose(simulation.state.centre, start.centre, atol=1e-9)


def test_the_balance_of_an_elastic_wall_takes_a_handful_of_factorisations():
    """Once the contacts that open are known, Newton's method ends in a step or two, whatever the number of stones."""
    wall = wall_scene(4, 4, Element.TET10, Start.EQUILIBRIUM, 0.1, step=1e-3, theta=1.0, base=False)
    _, _, static, *_ = searched(wall)
    assert static.found
    assert static.iterations <= 6


def test_a_second_step_goes_on_from_the_impulses_of_the_first():
    """W is so large that whole stones move by what these lack, next to nothing: η is 1, and a factorisation ends it."""
    wall = wall_scene(4, 4, Element.TET10, Start.EQUILIBRIUM, 0.1, step=1e-3, theta=1.0, base=False)
    model, start = build_model(replace(wall, time=TimeSettings(step=1.0, theta=1.0, relaxation=True)))
    search = Simulation(model, start, solver=Auto(1e-7, 1e-7), elastic_scale=True)
    search.step()
    search.halt(0.0)
    second = search.step()
    assert second.solution.converged
    assert second.solution.iterations <= 3


def test_the_search_ends_where_rounding_alone_is_left():
    """Of 14 stones of small linear tetrahedra η comes to 3e-7, of which a path and more steps take nothing."""
    wall = wall_scene(3, 4, Element.TET4, Start.EQUILIBRIUM, 0.035, step=1e-3, theta=1.0, base=False)
    _, _, static, *_ = searched(wall)
    assert static.found
    assert static.iterations <= 12


def test_it_is_the_same_to_the_last_bit_with_two_threads():
    wall = wall_scene(3, 4, Element.TET10, Start.EQUILIBRIUM, 0.1, step=1e-3, theta=1.0, base=False)
    one, two = (searched(replace(wall, solver=SolverSettings(threads=count)))[-1] for count in (1, 2))
    np.testing.assert_array_equal(one.state.node, two.state.node)


def test_it_is_the_same_in_a_turned_world():
    one = column(SOFT, HARD)
    other = transformed(replace(one, gravity=tuple(TURN @ one.gravity)), TURN, (3.0, -2.0, 5.0))
    states = []
    for which in (one, other):
        _, start, static, _, simulation = searched(which)
        assert static.found
        states.append(simulation.state.node - start.node)
    np.testing.assert_allclose(states[1], states[0] @ TURN.T, atol=1e-3 * np.abs(states[0]).max())


@pytest.mark.parametrize("fidelity", [SOFT, HARD])
def test_a_stone_a_little_above_the_ground_is_set_down(fidelity):
    gap = 1e-3
    model, start, static, _, simulation = searched(column(fidelity, low=gap))
    assert static.found
    sunk = (start.centre - simulation.state.centre)[1]
    np.testing.assert_allclose(sunk, [0, 0, gap], atol=1e-5)
    step = simulation.step()
    assert speed(model, step.after).max() < 1e-8
    assert support_reaction(model, step.contacts, step.force, step.kick.load, step.after.time).error < 1e-6


@pytest.mark.parametrize("fidelity", [SOFT, HARD])
@pytest.mark.parametrize("kind", ["air", "slope"])
def test_where_stones_fall_nothing_is_found_and_the_run_begins_at_rest(fidelity, kind):
    low, gravity = (2.0, (0.0, 0.0, -G)) if kind == "air" else (0.0, (0.8 * G, 0.0, -0.6 * G))
    one = column(fidelity, low=low, gravity=gravity, theta=0.5, duration=5e-3, stop_at_equilibrium=False)
    result = simulate(one)
    assert not result.static.found
    body = result.bodies[1]
    # five steps of free motion from rest, not from where the search had left
    falls = np.array(gravity) * (1.0 if kind == "air" else np.array([1 - 0.6 * 0.6 / 0.8, 0, 0]))
    expected = 0.5 * falls * 5e-3**2
    np.testing.assert_allclose(body.displacement.mean(axis=0), expected, atol=2e-2 * np.abs(expected).max())


@pytest.mark.parametrize("fidelity", [SOFT, HARD])
def test_driven_supports_wait_until_the_run_begins(fidelity):
    """The ground leaves sideways with 0.1 m/s at once; the static start knows nothing of it."""
    drift = ImposedMotion(frozenset(["ground"]), History.constant(np.array([0.1, 0.0, 0.0])))
    plain, driven = column(fidelity), replace(column(fidelity), loads=Loads(motions=(drift,)))
    _, start, static, _, simulation = searched(driven)
    assert static.found
    np.testing.assert_array_equal(simulation.state.centre[0], start.centre[0])
    np.testing.assert_array_equal(simulation.state.rotation[0], np.eye(3))
    still = searched(plain)[-1].state
    np.testing.assert_allclose(simulation.state.node, still.node, atol=1e-15)
    np.testing.assert_allclose(simulation.state.centre, still.centre, atol=1e-15)
    after = simulation.step().after
    np.testing.assert_allclose((after.centre - start.centre)[0], [1e-4, 0, 0], atol=1e-15)


@pytest.mark.parametrize("fidelity", [SOFT, HARD])
@pytest.mark.parametrize("duration", [0.5, 2.0, 1000.0])
def test_a_gravity_that_grows_from_zero_holds_nothing_at_the_start(fidelity, duration):
    """The loads of the first instant are none, however many seconds the search takes for its steps."""
    one = replace(column(fidelity), loads=Loads(gravity=(GravityRamp(duration),)))
    _, start, static, _, simulation = searched(one)
    assert static.found
    np.testing.assert_allclose(simulation.state.node, start.node, atol=1e-12)
    np.testing.assert_allclose(simulation.state.centre, start.centre, atol=1e-12)


@pytest.mark.parametrize("fidelity", [SOFT, HARD])
def test_a_table_that_tilts_is_level_at_the_start(fidelity):
    """By 30° each second: the search, which steps by seconds, sees it level all the same."""
    table = TiltingTable.at_rate_degrees((0.0, 1.0, 0.0), 30.0, 90.0)
    level, tilting = column(fidelity), replace(column(fidelity), loads=Loads(gravity=(table,)))
    _, start, static, _, simulation = searched(tilting)
    assert static.found
    still = searched(level)[-1].state
    moved = max(np.abs(still.node - start.node).max(initial=0.0), 1e-12)
    np.testing.assert_allclose(simulation.state.node, still.node, atol=1e-6 * moved)
    np.testing.assert_allclose(simulation.state.centre, still.centre, atol=1e-12)


def test_without_any_load_nothing_happens():
    for fidelity in (SOFT, HARD):
        _, start, static, _, simulation = searched(column(fidelity, gravity=(0.0, 0.0, 0.0)))
        assert static.found
        np.testing.assert_allclose(simulation.state.node, start.node, atol=1e-14)


def test_an_initial_velocity_is_for_the_run_not_for_the_search():
    """Stones are at rest in the equilibrium that is sought; a velocity has no place in it."""
    one = column(SOFT)
    pushed = replace(one, blocks=(one.blocks[0], replace(one.blocks[1], velocity=(0, 0, 0.5, 0, 0, 0))))
    still, other = searched(one), searched(pushed)
    assert other[2].found
    moved = np.abs(still[-1].state.node - still[1].node).max()
    np.testing.assert_allclose(other[-1].state.node, still[-1].state.node, atol=1e-3 * moved)


def test_friction_holds_on_a_slope():
    """tan α = 0.4 < μ: the forces are parallel to the weight, in the first step too.

    Its balance cannot fall below its strain, 1e-7: moments are taken on the strained stone.
    """
    angle = np.arctan(0.4)
    gravity = (G * np.sin(angle), 0.0, -G * np.cos(angle))
    one = column(SOFT, gravity=gravity, friction=0.5, balance_tolerance=1e-6)
    model, _, static, _, simulation = searched(one)
    assert static.found
    step = simulation.step()
    total = step.force.sum(axis=0) * (1.0 if model.fixed[step.contacts.bodies[0, 1]] else -1.0)
    np.testing.assert_allclose(total, -model.mass[1] * np.array(gravity), rtol=1e-6, atol=1e-6)
    assert speed(model, step.after).max() < 1e-8


def test_a_run_without_it_says_nothing_of_it():
    one = column(SOFT, start=Start.REST, duration=2e-3)
    assert simulate(one).static is None


def test_the_first_frame_is_the_equilibrium():
    result = simulate(column(SOFT, duration=3e-3, stop_at_equilibrium=False))
    assert result.static.found
    assert result.frames[0].time == 0.0
    assert result.steps == 3


def test_frictionless_contacts_serve():
    one = replace(column(SOFT, SOFT), contact=ContactSettings(DryJoint(0.0)))
    model, _, static, _, simulation = searched(one)
    assert static.found
    step = simulation.step()
    assert support_reaction(model, step.contacts, step.force, step.kick.load, 0.0).error < 1e-7


# --- what is remembered ---


def test_forces_are_kept_and_velocities_forgotten():
    """The same forces over steps 0.5 times as long: half the impulses; internal variables as they are."""
    memory, key = Memory(), np.array([5, 3, 9])
    impulse, velocity = np.arange(9.0).reshape(3, 3), np.ones((3, 3))
    state = np.zeros((3, STATE))
    state[:, :5] = np.arange(15.0).reshape(3, 5)
    memory.store(key, ContactSolution(impulse, velocity, 1, 0.0, True), state)
    for asked, rows in ((key, [0, 1, 2]), (np.array([9, 5]), [2, 0])):
        start, internal = memory.at_rest(0.5).recall(asked)
        np.testing.assert_array_equal(start.impulse, 0.5 * impulse[rows])
        np.testing.assert_array_equal(start.velocity, 0.0)
        np.testing.assert_array_equal(internal, state[rows])
    # the memory itself is what it was
    np.testing.assert_array_equal(memory.recall(key)[0].impulse, impulse)
    np.testing.assert_array_equal(memory.recall(key)[0].velocity, velocity)
