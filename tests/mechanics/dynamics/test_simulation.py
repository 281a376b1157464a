"""Motions with closed forms, and what the observers say of them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.energy import elastic_energy, kinetic_energy
from mechanics.dynamics.observers.equilibrium import displacement, imbalance, speed, support_reaction
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.scene import Fidelity, Method, SolverSettings
from mechanics.simulate import simulate
from tests.mechanics.shapes import TURN, brick, ground, moved, pile, scene

SOFT = Fidelity.DEFORMABLE
BOTH = pytest.mark.parametrize("fidelity", [Fidelity.RIGID, SOFT])
G = 9.81


def run(one, steps, **settings):
    """The steps of a scene, and its model."""
    model, start = build_model(one)
    simulation = Simulation(model, start, **settings)
    return model, start, [simulation.step() for _ in range(steps)]


def balance_of(model, start, steps):
    energy = EnergyBalance(model, start)
    for step in steps:
        energy(step)
    return energy


# --- free motion ---


@BOTH
@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_free_fall_is_exact_at_theta_one_half_and_else_off_by_what_theory_says(theta, fidelity):
    h, n, v0 = 1e-2, 50, np.array([0.3, -0.2, 1.5])
    block = brick("a", (0, 0, 5), (0.4, 0.5, 5.6), fidelity, velocity=(*v0, 0, 0, 0))
    model, start, steps = run(scene(block, step=h, theta=theta), n)
    t, end = n * h, steps[-1].after
    assert end.time == pytest.approx(t)
    # q = q0 + v0 t - g t²/2, and each step adds -(θ - ½) g h²
    expected = v0 * t - np.array([0, 0, G * t**2 / 2 + (theta - 0.5) * G * h * t])
    points = end.node if fidelity is SOFT else end.centre
    begin = start.node if fidelity is SOFT else start.centre
    np.testing.assert_allclose(points - begin, np.broadcast_to(expected, begin.shape), atol=1e-9)
    v = end.node_velocity if fidelity is SOFT else end.velocity[:, :3]
    np.testing.assert_allclose(v, np.broadcast_to(v0 - [0, 0, G * t], v.shape), atol=1e-9)
    assert balance_of(model, start, steps).error < 1e-10


def test_an_elastic_stone_that_turns_freely_keeps_its_shape():
    block = brick("a", (0, 0, 0), (0.4, 0.5, 0.6), SOFT, velocity=(0, 0, 0, 0, 0, 2.0))
    model, _, steps = run(scene(block, gravity=(0, 0, 0), step=1e-3, theta=1.0), 200)
    end = steps[-1].after
    # the centrifugal stretch ρ ω² L²/E ~ 2000·4·0.4/1e9 and the step's own, all far below 1 %
    shape = model.stones[0].displacement(end.node, end.centre, end.rotation)
    assert np.abs(shape).max() < 2e-3
    angle = np.arctan2(end.rotation[0, 1, 0], end.rotation[0, 0, 0])
    assert angle == pytest.approx(0.4, rel=1e-2)


@BOTH
def test_momentum_is_kept_when_two_free_stones_collide(fidelity):
    stones = (
        brick("a", (0, 0, 0), (0.5, 0.4, 0.3), fidelity, velocity=(2.0, 0, 0, 0, 0, 0)),
        brick("b", (0.52, 0.1, -0.1), (0.9, 0.5, 0.4), velocity=(-1.0, 0.1, 0, 0, 0, 0)),
    )
    model, start, steps = run(scene(*stones, gravity=(0, 0, 0), step=1e-3, theta=0.5), 30)

    def momentum(state):
        total = model.mass @ state.velocity[:, :3]
        stone = model.stones[0]
        return total if stone is None else total + stone.operators.nodal_mass @ state.node_velocity

    assert any(step.solution.impulse.any() for step in steps)  # they met
    np.testing.assert_allclose(momentum(steps[-1].after), momentum(start), atol=1e-12 * model.mass.sum() * 2)
    assert kinetic_energy(model, steps[-1].after) < 0.9 * kinetic_energy(model, start)


# --- contact ---


@BOTH
@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_falling_stone_lands_on_the_ground_not_in_it(theta, fidelity):
    block = brick("a", (0, 0, 0.02), (0.5, 0.5, 0.42), fidelity)
    model, _, steps = run(scene(ground(), block, step=3e-3, theta=theta, friction=0.6), 60)
    deepest = max(float(np.max(-step.gap, initial=0.0)) for step in steps)
    # the contacts are looked for at q + h(1-θ)v: what is already in overlap there stays so; the rest lands exactly,
    # to what solving to η = 1e-6 leaves
    allowed = 3e-3 * (1 - theta) * np.sqrt(2 * G * 0.02) + 1e-5
    assert deepest < allowed
    last = steps[-1]
    assert len(last.contacts) >= 4
    bottom = last.after.node[:, 2].min() if fidelity is SOFT else last.after.centre[1, 2] - 0.2
    assert bottom == pytest.approx(0.0, abs=allowed)
    if theta == 1.0 or fidelity is Fidelity.RIGID:  # else an elastic stone goes on ringing
        assert speed(model, last.after)[1] < 2e-2


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_a_closing_gap_is_closed_at_the_next_kick_to_the_last_digits_and_never_overlaps(theta):
    # at 1 m/s, 1 mm a step; open by 0.3 mm still where contacts are looked for, q + h(1-θ)v
    gap = 1e-3 * (1 - theta) + 3e-4
    block = brick("a", (0, 0, gap), (1, 1, 1 + gap), velocity=(0, 0, -1.0, 0, 0, 0))
    one = scene(ground(), block, gravity=(0, 0, 0), step=1e-3, theta=theta)
    _, _, (first, second) = run(replace(one, solver=SolverSettings(tolerance=1e-13)), 2)
    np.testing.assert_allclose(first.gap, 3e-4 * (1 - theta), atol=1e-14)
    np.testing.assert_allclose(second.gap, 0.0, atol=1e-14)
    np.testing.assert_allclose(second.after.velocity, 0.0, atol=1e-12)


@pytest.mark.parametrize(("theta", "order"), [(0.5, 1e-2), (1.0, 1e-2)])
def test_a_sliding_stone_stops_after_v2_over_2_mu_g_and_the_energy_adds_up(theta, order):
    mu, v0, h = 0.3, 1.0, 1e-3
    block = brick("a", (-1, 0, 0), (-0.5, 0.5, 0.2), velocity=(v0, 0, 0, 0, 0, 0))
    one = scene(ground(), block, friction=mu, step=h, theta=theta, duration=0.5, stop_at_equilibrium=False)
    one = replace(one, solver=SolverSettings(tolerance=1e-10))
    model, start, steps = run(one, 500)
    path = v0**2 / (2 * mu * G)
    moved_by = steps[-1].after.centre[1] - start.centre[1]
    np.testing.assert_allclose(moved_by, [path, 0, 0], atol=h * v0)
    energy = balance_of(model, start, steps)
    assert energy.error < 1e-10
    # friction took all of it, but for what the scheme did
    assert energy.contact == pytest.approx(-kinetic_energy(model, start), rel=order)


@BOTH
@pytest.mark.parametrize(("mu", "slides"), [(0.5, True), (0.65, False)])
def test_a_stone_on_a_slope_slides_if_friction_is_less_than_the_tangent(mu, slides, fidelity):
    slope = np.arctan(0.577)
    gravity = (G * np.sin(slope), 0.0, -G * np.cos(slope))
    block = brick("a", (-1, 0, 0), (-0.2, 0.5, 0.3), fidelity)
    _, start, steps = run(scene(ground(), block, gravity=gravity, friction=mu, step=2e-3, theta=1.0), 100)
    t, end = 0.2, steps[-1].after
    before, after = (start.node, end.node) if fidelity is SOFT else (start.centre[1:], end.centre[1:])
    path = (after - before).mean(axis=0)[0]
    expected = 0.5 * (np.sin(slope) - mu * np.cos(slope)) * G * t**2 if slides else 0.0
    # θ = 1 runs ahead by g h t/2
    assert path == pytest.approx(expected, abs=0.03 * abs(expected) + 1e-4)


def test_a_run_repeats_bit_for_bit():
    stones = (
        ground(),
        brick("soft", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, mesh_size=0.3),
        brick("hard", (0.1, 0, 0.31), (0.7, 0.4, 0.6), velocity=(0.3, 0, 0, 0.5, 0, 0)),
    )
    one = scene(*stones, step=2e-3, duration=0.03, stop_at_equilibrium=False)
    first, second = simulate(one), simulate(one)
    for a, b in zip(first.bodies, second.bodies, strict=True):
        assert a.position.tobytes() == b.position.tobytes()
    assert first.contacts.force.tobytes() == second.contacts.force.tobytes()
    for name in ("kinetic", "balance", "natural_map", "iterations"):
        assert getattr(first.history, name).tobytes() == getattr(second.history, name).tobytes()


def test_a_rigid_run_repeats_bit_for_bit():
    one = pile(4, stones=7, near=0.25, step=2e-3, duration=0.2, stop_at_equilibrium=False)
    first, second = simulate(one), simulate(one)
    assert first.history.contacts.max() > 8
    for a, b in zip(first.bodies, second.bodies, strict=True):
        assert a.position.tobytes() == b.position.tobytes()
    for name in ("kinetic", "balance", "natural_map", "iterations"):
        assert getattr(first.history, name).tobytes() == getattr(second.history, name).tobytes()


def test_contacts_are_looked_for_again_only_when_something_has_moved():
    block = brick("a", (0, 0, 0), (0.5, 0.5, 0.4))
    _, _, resting_ = run(scene(ground(), block, step=1e-3), 5)
    assert all(step.contacts is resting_[0].contacts for step in resting_)
    _, _, fresh = run(scene(ground(), block, step=1e-3), 5, fresh_contacts=True)
    assert all(a.contacts is not b.contacts for a, b in itertools.pairwise(fresh))
    np.testing.assert_allclose(fresh[-1].force, resting_[-1].force, atol=1e-9 * np.abs(fresh[-1].force).max())
    pushed = replace(block, velocity=(0.1, 0, 0, 0, 0, 0))
    _, _, sliding = run(scene(ground(), pushed, step=1e-3), 5)
    assert all(a.contacts is not b.contacts for a, b in itertools.pairwise(sliding))
    # a millionth of the smallest width, 0.4 µm, is still the same place
    crawling = replace(block, velocity=(1e-7, 0, 0, 0, 0, 0))
    _, _, steps = run(scene(ground(), crawling, step=1e-3, gravity=(0, 0, 0), friction=0.0), 5)
    assert steps[0].contacts is steps[-1].contacts


def test_a_thick_slab_comes_to_rest_on_three_fixed_pebbles():
    # 1 m thick, on fixed stones of 1 cm; it falls by 4.9 mm, half a pebble, between two looks at the contacts
    edge = 0.01
    places = ((-1, -1), (1, -1), (0, 1))
    pebbles = [
        brick(str(k), (x, y, 0), (x + edge, y + edge, edge), Fidelity.FIXED)
        for k, (x, y) in enumerate(places)
    ]
    slab = brick("slab", (-2, -2, 1.49 * edge), (2, 2, 1 + 1.49 * edge))
    stones = ground((-3, -3, -1), (3, 3, 0)), slab, *pebbles
    _, _, steps = run(scene(*stones, step=1e-3, theta=1.0), 60)
    assert steps[-1].after.centre[1, 2] == pytest.approx(0.5 + edge, abs=1e-5)


# --- the observers ---


@BOTH
@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["upright", "turned world"])
def test_a_resting_stone_is_in_balance_and_the_ground_carries_its_weight(fidelity, turn):
    stones = ground(), brick("a", (0, 0, 0), (0.8, 0.5, 0.4), fidelity)
    one = scene(
        *(moved(s, turn, (7, 8, 9)) for s in stones), gravity=tuple(turn @ [0, 0, -G]), step=5e-3, theta=1.0
    )
    one = replace(one, solver=SolverSettings(tolerance=1e-10, max_iterations=20000))
    model, _, steps = run(one, 40)
    last = steps[-1]
    balance = imbalance(model, last.after, last.contacts, last.force, last.kick.load)
    assert balance[0] == 0.0
    assert balance[1] < 1e-6
    support = support_reaction(model, last.contacts, last.force, last.kick.load, last.after.time)
    assert support.weight == pytest.approx(2000 * 0.8 * 0.5 * 0.4 * G, rel=1e-10)
    assert support.error < 1e-6


def test_a_stone_in_the_air_is_out_of_balance_by_its_weight():
    model, _, steps = run(scene(ground(), brick("a", (0, 0, 2), (1, 1, 3)), step=1e-3), 1)
    last = steps[-1]
    assert imbalance(model, last.after, last.contacts, last.force, last.kick.load).tolist() == [0.0, 1.0]
    assert support_reaction(model, last.contacts, last.force, last.kick.load, last.after.time).error == 1.0


def test_displacement_and_speed_are_those_of_the_farthest_corner():
    model, start = build_model(
        scene(ground(), brick("a", (0, 0, 0), (2, 0.2, 0.2), velocity=(0, 0, 0, 0, 0, 3)))
    )
    assert speed(model, start).tolist() == pytest.approx([0.0, 3 * np.hypot(1, 0.1)])
    half = replace(start, rotation=np.stack([np.eye(3), np.diag([-1.0, -1.0, 1.0])]))
    assert displacement(model, start, half).tolist() == pytest.approx([0.0, 2 * np.hypot(1, 0.1)])


def test_a_stretched_stone_holds_its_elastic_energy():
    model, start = build_model(scene(brick("a", (0, 0, 0), (1, 1, 1), SOFT)))
    nu, strain = 0.2, 1e-4
    stretched = replace(
        start,
        node=(start.node - start.centre) * [1 + strain, 1 - nu * strain, 1 - nu * strain] + start.centre,
    )
    assert elastic_energy(model, start) == pytest.approx(0.0, abs=1e-12)
    assert elastic_energy(model, stretched) == pytest.approx(0.5 * 1e9 * strain**2, rel=1e-9)


# --- whole runs ---


def resting(fidelity=Fidelity.RIGID, **time):
    return scene(ground(), brick("a", (0, 0, 0), (0.8, 0.5, 0.4), fidelity), step=5e-3, **time)


def test_a_resting_stone_is_found_in_equilibrium_after_five_steps():
    result = simulate(resting())
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.steps == 5
    assert result.time == pytest.approx(5 * 5e-3)
    assert result.reaction == pytest.approx(result.weight, rel=1e-6)
    assert result.errors.penetration < 1e-9
    assert result.errors.unconverged_steps == 0
    assert set(result.contacts.status) == {"stick"}
    np.testing.assert_allclose(result.contacts.force.sum(axis=0), [0, 0, result.weight], atol=1e-3)


def test_a_falling_stone_has_collapsed():
    result = simulate(scene(brick("a", (0, 0, 2), (1, 1, 3)), step=1e-2, duration=5.0))
    assert result.outcome is Outcome.COLLAPSED
    # it has fallen just over half its width: t = √(2·0.5/g)
    assert result.time == pytest.approx(np.sqrt(1 / G), abs=0.02)


def test_a_short_run_ends_in_motion():
    result = simulate(scene(brick("a", (0, 0, 2), (1, 1, 3)), step=1e-2, duration=0.05))
    assert result.outcome is Outcome.MOVING
    assert (result.steps, len(result.history.time)) == (5, 5)


def test_a_leaning_stone_falls_over_and_a_less_leaning_one_rocks_back():
    # a stone 0.4 wide and 1 high stands up to atan 0.4 = 21.8°
    def tilted(degrees):
        angle = np.radians(degrees)
        turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
        block = moved(brick("a", (0, 0, 0), (0.4, 0.4, 1)), turn)
        # rocking moves its top by up to 0.55 m, falling by more than 1 m
        return simulate(scene(ground(), block, step=4e-3, duration=5.0, collapse_displacement=2.0))

    upright = tilted(20.0)
    assert upright.outcome is Outcome.SETTLED
    assert upright.bodies[1].position[:, 2].max() == pytest.approx(1.0, abs=1e-3)
    assert tilted(24.0).outcome is Outcome.COLLAPSED


def test_relaxation_brings_an_elastic_stone_to_rest_and_accounts_for_the_energy_it_takes():
    one = resting(SOFT, relaxation=True, theta=0.5, duration=2.0)
    one = replace(one, time=replace(one.time, step=2e-4))
    result = simulate(one)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.energy < 1e-6
    assert result.errors.reaction < 1e-3
    # the top sinks by about ρ g H²/(2E)
    sinking = 2000 * G * 0.4**2 / (2 * 1e9)
    top = result.bodies[1].reference[:, 2] > 0.4 - 1e-9
    assert -result.bodies[1].displacement[top, 2].mean() == pytest.approx(sinking, rel=0.25)


def test_what_relaxation_takes_out_is_the_kinetic_energy():
    one = resting(SOFT, relaxation=True, theta=0.5)
    one = replace(one, time=replace(one.time, step=2e-4))
    model, _, steps = run(one, 60)
    halted = [step for step in steps if step.relaxed > 0]
    assert halted
    for step in halted:
        assert step.relaxed == kinetic_energy(model, step.after)
    followers = [b for a, b in itertools.pairwise(steps) if a.relaxed > 0]
    assert all(not step.before.node_velocity.any() for step in followers)


def test_steps_that_the_solver_leaves_unsolved_are_counted():
    stones = ground(), *(brick(str(k), (0, 0, k), (1, 0.5, k + 1)) for k in range(4))
    once = SolverSettings(method=Method.NSGS, tolerance=1e-10, max_iterations=1)
    result = simulate(replace(scene(*stones, step=5e-3, duration=0.05), solver=once))
    assert result.errors.unconverged_steps == result.steps == 10
    assert result.errors.natural_map > 1e-10
    # never in equilibrium, nor anything else, on the word of unsolved steps
    assert result.outcome is Outcome.UNDECIDED
    assert result.reason.startswith("10 of 10 steps were not solved")


def test_frames_are_kept_as_often_as_asked_and_progress_is_told():
    told = []
    one = replace(resting(duration=0.05, stop_at_equilibrium=False), frame_every=4)
    result = simulate(one, told.append)
    assert [frame.time for frame in result.frames] == pytest.approx([0, 0.02, 0.04, 0.05])
    assert [p.done for p in told if p.stage == "mesh"] == [1, 2]
    assert [(p.done, p.total) for p in told if p.stage == "step"] == [(k, 10) for k in range(11)]
    assert set(result.wall_time) >= {"mesh", "assemble", "detect", "solve", "advance", "stress"}


def test_stress_under_own_weight_is_the_weight_over_the_area():
    stone = brick("a", (0, 0, 0), (0.8, 0.5, 0.4), SOFT, mesh_size=0.2)
    result = simulate(replace(scene(ground(), stone, step=5e-3), solver=SolverSettings(tolerance=1e-8)))
    body = result.bodies[1]
    assert result.outcome is Outcome.EQUILIBRIUM
    # free sides: σ_zz = -ρ g (H - z) in the mean over a section
    middle = np.abs(body.reference[:, 2] - 0.2) < 0.11
    height = 0.4 - body.reference[middle, 2]
    ratio = body.stress[middle, 2].mean() / (-2000 * G * height.mean())
    assert ratio == pytest.approx(1.0, abs=0.2)
    assert body.von_mises.max() < 2.5 * 2000 * G * 0.4
    rigid = result.bodies[0]
    assert rigid.stress is None
    assert rigid.von_mises is None
