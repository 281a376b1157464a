"""Compliant joints: an elastic layer across the joint, no creep along it; rigid ones wherever these can be solved."""

from dataclasses import replace

import numpy as np
import pytest
from mechanics.solvers.strategies.rigid import Alternating

from mechanics.dynamics.contact_problem import JointCompliance
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactSolution
from mechanics.scene.scene import Fidelity, Method
from mechanics.scene.shapes import bond, box, wall
from mechanics.simulate import simulate
from mechanics.solvers.choice import choose_solvers
from tests.mechanics.shapes import brick, ground, scene

G, STEP, DENSITY = 9.81, 5e-3, 2000.0
ALWAYS = 10**9


def yielding(simulation):
    """Let joints give way also where a motion is followed, in which the law is easier to see."""
    time = replace(simulation.model.scene.time, relaxation=True)
    simulation._solvers = choose_solvers(simulation.model.scene.solver, 0, 1, time)


def compliant(one, value):
    """A simulation with compliant joints in every step, and its model."""
    model, start = build_model(one)
    simulation = Simulation(model, start)
    yielding(simulation)
    simulation._joints = JointCompliance(value, ALWAYS)
    return simulation, model


def block(slope=0.0, **time):
    """A block of 0.5 m on a ground that is inclined by a gravity along x."""
    one = scene(ground(), brick("S", (0, 0, 0), (0.5, 0.5, 0.5)), friction=0.6, step=STEP, **time)
    return replace(one, gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)))


MASS = DENSITY * 0.125


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_a_block_sinks_by_its_weight_over_the_stiffness_of_its_four_points_and_no_further(theta):
    """ε h² F with F = m g/4; h g per step would add up to 25 m in the thousand steps."""
    epsilon = 1e-3 / MASS
    simulation, _ = compliant(block(theta=theta), epsilon)
    depth = []
    for _ in range(1000):
        step = simulation.step()
        depth.append(-step.gap)
    sunk = epsilon * STEP**2 * MASS * G / 4
    np.testing.assert_allclose(depth[-1], sunk, rtol=1e-6)
    np.testing.assert_allclose(step.compression, sunk, rtol=1e-6)
    np.testing.assert_allclose(depth[100], depth[-1], rtol=1e-6)


def test_a_constant_shear_below_friction_moves_nothing_in_a_thousand_steps():
    """At half of the friction angle the block shears its joint by ε h² F_T, once, and stays.

    Its centre moves as much again, as it leans by the moment m g sin α · a/2, half its width a above the joint.
    """
    slope, epsilon = 0.5 * np.arctan(0.6), 1e-3 / MASS
    simulation, _ = compliant(block(slope), epsilon)
    place = []
    for _ in range(1000):
        simulation.step()
        place.append(simulation.state.centre[1, 0] - 0.25)
    assert place[-1] == pytest.approx(2 * epsilon * STEP**2 * MASS * G * np.sin(slope) / 4, rel=1e-3)
    assert abs(place[-1] - place[100]) < 1e-12


def test_a_block_above_the_angle_of_friction_slides_as_on_a_rigid_joint():
    slope, steps = np.arctan(0.6) + 0.2, 100
    simulation, _ = compliant(block(slope), 1e-3 / MASS)
    for _ in range(steps):
        simulation.step()
    speed = G * (np.sin(slope) - 0.6 * np.cos(slope)) * steps * STEP
    assert simulation.state.velocity[1, 0] == pytest.approx(speed, rel=1e-3)


def test_the_weight_of_a_stack_sinks_through_all_its_joints():
    """The joint under stone k of n carries n - k + 1 weights."""
    stones = [brick(f"S{k}", (0, 0, 0.5 * k), (0.5, 0.5, 0.5 * k + 0.5)) for k in range(4)]
    epsilon = 1e-3 / MASS
    simulation = compliant(scene(ground(), *stones, step=STEP), epsilon)[0]
    for _ in range(60):
        simulation.step()
    each = epsilon * STEP**2 * MASS * G / 4
    sunk = simulation.start.centre[1:, 2] - simulation.state.centre[1:, 2]
    np.testing.assert_allclose(sunk, each * np.cumsum([4, 3, 2, 1]), rtol=1e-3)


def test_forces_of_a_compliant_joint_lift_no_stone_when_the_joints_are_rigid_again():
    simulation, _ = compliant(block(), 1e-3 / MASS)
    for _ in range(100):
        simulation.step()
    height = simulation.state.centre[1, 2]
    simulation._joints = replace(simulation._joints, left=0)
    for _ in range(10):
        step = simulation.step()
        assert step.problem.delassus.joint_compliance is None
    # a sixtieth of the overlap, what the tolerance of velocities leaves
    assert simulation.state.centre[1, 2] == pytest.approx(height, abs=1e-9)


def test_a_rest_on_compliant_joints_that_is_released_bears_its_forces_on_rigid_ones_from_a_halt():
    """Loaded anew, a compliant joint would let the block sink by ε h² F once more."""
    simulation, _ = compliant(block(relaxation=True), 1e-3 / MASS)
    for _ in range(60):
        simulation.step()
    speed = np.zeros_like(simulation.state.velocity)
    speed[1, 2] = -1e-5
    simulation.state = replace(simulation.state, velocity=speed)
    again = simulation.released()
    np.testing.assert_array_equal(again.state.velocity, 0.0)
    step = again.step()
    assert step.problem.delassus.joint_compliance is None
    # held by its weight alone: forces that stopped a motion, too, would lift it in the next step
    assert step.force[:, 2].sum() == pytest.approx(MASS * G, rel=1e-6)
    np.testing.assert_allclose(step.after.centre, simulation.state.centre, rtol=0, atol=1e-10)


def test_a_rest_that_is_released_is_worth_what_steps_are_before_joints_yield():
    simulation, _ = compliant(block(relaxation=True), 1e-3 / MASS)
    own = simulation._solvers
    early, brief = Failing(own.early), Failing(own.brief)
    simulation._solvers = replace(own, early=early, brief=brief)
    for _ in range(20):
        simulation.step()
    again = simulation.released()
    for _ in range(3):
        again.step()
    assert (early.calls, brief.calls) == (1, 0)


def test_an_overlap_that_no_force_explains_pushes_nothing():
    """Two walls that a block overlaps by 1 mm; without friction from them, it falls as if they were not there."""
    walls = (
        brick(code, (x, -0.2, -1.0), (x + 1.0, 0.2, 1.0), Fidelity.FIXED)
        for code, x in (("L", -1), ("R", 0.5))
    )
    stone = brick("S", (-1e-3, -0.2, -0.15), (0.5 + 1e-3, 0.2, 0.15))
    simulation, _ = compliant(scene(*walls, stone, step=1e-3), 1e-4)
    for _ in range(10):
        simulation.step()
    np.testing.assert_allclose(simulation.state.centre[2, 2], -55 * G * 1e-6, rtol=1e-6)


def regular():
    return scene(*wall(bond(4, 4), 0.5, 0.25, 0.3), step=5e-3, relaxation=True)


def test_a_regular_wall_stays_rigid_to_the_last_bit():
    usual, without = (
        simulate(replace(regular(), solver=replace(regular().solver, joint_compliance=share)))
        for share in (1e-3, 0.0)
    )
    assert usual.outcome is Outcome.EQUILIBRIUM
    assert usual.cautions == without.cautions == ()
    for one, other in zip(usual.bodies, without.bodies, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(usual.contacts.force, without.contacts.force)


class Failing:
    """A solver of rigid joints that never succeeds."""

    def __init__(self, solver):
        self._solver, self.calls = solver, 0

    def __call__(self, problem, start):
        self.calls += 1
        return replace(self._solver(problem, start), converged=False)


def test_rigid_joints_that_fail_are_tried_again_after_ever_longer_waits():
    model, start = build_model(regular())
    simulation = Simulation(model, start)
    yielding(simulation)
    own = simulation._solvers
    early, brief = Failing(own.early), Failing(own.brief)
    simulation._solvers = replace(own, early=early, brief=brief)
    used = [simulation.step().problem.delassus.joint_compliance is not None for _ in range(60)]
    assert all(used)
    # tried in the first step, after 8 with compliant joints, after 16 more, after 32 more
    assert (early.calls, brief.calls) == (1, 3)
    simulation._solvers = own
    simulation._joints = replace(simulation._joints, left=0)
    assert simulation.step().problem.delassus.joint_compliance is None


def test_joints_that_had_to_yield_beside_deformable_stones_do_so_for_good():
    stones = [
        replace(one, fidelity=Fidelity.DEFORMABLE, mesh_size=0.5) if k == 3 else one
        for k, one in enumerate(regular().blocks)
    ]
    model, start = build_model(replace(regular(), blocks=tuple(stones)))
    simulation = Simulation(model, start)
    time = replace(simulation.model.scene.time, relaxation=True)
    own = choose_solvers(simulation.model.scene.solver, 1, 10, time)
    early, brief = Failing(own.early), Failing(own.brief)
    simulation._solvers = replace(own, early=early, brief=brief)
    steps = [simulation.step() for _ in range(12)]
    assert all(step.solution.converged for step in steps)
    assert all(step.problem.delassus.joint_compliance is not None for step in steps)
    assert (early.calls, brief.calls) == (1, 0)


def test_joints_that_cannot_be_solved_either_way_are_left_to_the_rigid_methods():
    model, start = build_model(regular())
    simulation = Simulation(model, start)
    yielding(simulation)
    own = simulation._solvers
    failing = Failing(own.compliant[0][1])
    simulation._solvers = replace(
        own,
        early=Failing(own.early),
        brief=Failing(own.brief),
        compliant=((1.0, failing), (3.0, failing), (10.0, failing)),
    )
    steps = [simulation.step() for _ in range(9)]
    assert all(step.solution.converged for step in steps)
    # three compliances in the first step, none in the eight that follow
    assert failing.calls == 3


def test_joints_that_must_be_softer_stay_so_until_rigid_ones_are_tried():
    model, start = build_model(regular())
    simulation = Simulation(model, start)
    yielding(simulation)
    own = simulation._solvers
    (_, quick), *softer = own.compliant
    failing = Failing(quick)
    simulation._solvers = replace(
        own, early=Failing(own.early), brief=Failing(own.brief), compliant=((1.0, failing), *softer)
    )
    values = [simulation.step().problem.delassus.joint_compliance[0, 0] for _ in range(9)]
    np.testing.assert_allclose(values, 3.0 * simulation._joints.value)
    # in the first step, and after the eight that follow it
    assert failing.calls == 2


@pytest.mark.parametrize("method", [one for one in Method if one is not Method.AUTO])
def test_a_method_that_is_asked_for_gets_rigid_joints(method):
    one = regular()
    model, start = build_model(replace(one, solver=replace(one.solver, method=method)))
    assert Simulation(model, start)._solvers.compliant == ()


def test_the_verdict_tells_how_far_joints_gave_way(monkeypatch):
    """Rigid joints that always fail: a block sinks by ε h² m g/4 with ε = 10⁻³ W̄."""
    monkeypatch.setattr(Alternating, "__call__", _never)
    result = simulate(scene(ground(), box("S", (0, 0, 0), (1, 1, 1)), step=STEP, relaxation=True))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.unconverged_steps == 0
    model, start = build_model(result.scene)
    w = Simulation(model, start).step().problem.delassus
    sunk = 1e-3 * w.scale * STEP**2 * result.weight / 4
    assert result.cautions[0] == (
        f"joints gave way elastically in {result.steps} of {result.steps} steps, which rigid joints did not solve: "
        f"stones overlap by at most {1e3 * sunk:.3g} mm for it (S and ground; {1e3 * sunk:.3g} mm at the end)"
    )


def _never(self, problem, start):
    return ContactSolution(start.impulse, start.velocity, 1, 1.0, False, "nothing")
