"""Compliant joints: an elastic layer across the joint, no creep along it; rigid ones wherever these can be solved."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.contact_problem import JointCompliance, may_yield
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Fidelity, Method
from mechanics.scene.shapes import bond, wall
from mechanics.simulate import simulate
from tests.mechanics.dense_operator import blocks_apart
from tests.mechanics.shapes import brick, ground, scene

G, STEP, DENSITY = 9.81, 5e-3, 2000.0
ALWAYS = 10**9


def begun(one, joints, at=None):
    """A simulation that goes on as a resumed run does, with joints in a given state; `at`: where another one stands."""
    own = Simulation(*build_model(one))
    return own.resumed((at or own).carried() | {"_joints": joints})


def compliant(one, value):
    """A simulation with compliant joints in every step."""
    return begun(one, JointCompliance(value, ALWAYS))


def block(slope=0.0, **time):
    """A block of 0.5 m on a ground that is inclined by a gravity along x."""
    one = scene(ground(), brick("S", (0, 0, 0), (0.5, 0.5, 0.5)), friction=0.6, step=STEP, **time)
    return replace(one, gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)))


MASS = DENSITY * 0.125
EPSILON = 1e-3 / MASS


# --- an elastic layer ---


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_block_sinks_by_its_weight_over_the_stiffness_of_its_four_points_and_no_further(theta):
    """ε h² F with F = m g/4; h g per step would add up to 4 m in four hundred steps."""
    simulation = compliant(block(theta=theta), EPSILON)
    depth = []
    for _ in range(400):
        step = simulation.step()
        depth.append(-step.gap)
    sunk = EPSILON * STEP**2 * MASS * G / 4
    np.testing.assert_allclose(depth[-1], sunk, rtol=1e-5)
    np.testing.assert_allclose(step.compression, sunk, rtol=1e-5)
    np.testing.assert_allclose(depth[100], depth[-1], rtol=1e-5)


def test_a_constant_shear_below_friction_moves_nothing_in_four_hundred_steps():
    """At half of the friction angle the block shears its joint by ε h² F_T, once, and stays.

    Its centre moves as much again, as it leans by the moment m g sin α · a/2, half its width a above the joint.
    """
    slope = 0.5 * np.arctan(0.6)
    simulation = compliant(block(slope), EPSILON)
    place = []
    for _ in range(400):
        simulation.step()
        place.append(simulation.state.centre[1, 0] - 0.25)
    sheared = 2 * EPSILON * STEP**2 * MASS * G * np.sin(slope) / 4
    assert place[-1] == pytest.approx(sheared, rel=1e-3)
    assert abs(place[-1] - place[100]) < 1e-4 * sheared


def test_a_block_above_the_angle_of_friction_slides_as_on_a_rigid_joint():
    slope, steps = np.arctan(0.6) + 0.2, 100
    simulation = compliant(block(slope), EPSILON)
    for _ in range(steps):
        simulation.step()
    speed = G * (np.sin(slope) - 0.6 * np.cos(slope)) * steps * STEP
    assert simulation.state.velocity[1, 0] == pytest.approx(speed, rel=1e-3)


def test_the_weight_of_a_stack_sinks_through_all_its_joints():
    """The joint under stone k of n carries n - k + 1 weights."""
    stones = [brick(f"S{k}", (0, 0, 0.5 * k), (0.5, 0.5, 0.5 * k + 0.5)) for k in range(4)]
    simulation = compliant(scene(ground(), *stones, step=STEP), EPSILON)
    for _ in range(60):
        simulation.step()
    each = EPSILON * STEP**2 * MASS * G / 4
    sunk = simulation.start.centre[1:, 2] - simulation.state.centre[1:, 2]
    np.testing.assert_allclose(sunk, each * np.cumsum([4, 3, 2, 1]), rtol=1e-3)


def test_forces_of_a_compliant_joint_lift_no_stone_when_the_joints_are_rigid_again():
    yielded = compliant(block(), EPSILON)
    for _ in range(100):
        yielded.step()
    height = yielded.state.centre[1, 2]
    simulation = begun(block(), JointCompliance(EPSILON, 0), yielded)
    for _ in range(10):
        step = simulation.step()
        assert step.problem.delassus.joint_compliance is None
    # a thirtieth of the overlap, what the tolerance of velocities leaves
    sunk = EPSILON * STEP**2 * MASS * G / 4
    assert simulation.state.centre[1, 2] == pytest.approx(height, abs=sunk / 30)


def test_a_rest_on_compliant_joints_that_is_released_bears_its_forces_on_rigid_ones_from_a_halt():
    """Loaded anew, a compliant joint would let the block sink by ε h² F once more."""
    simulation = compliant(block(relaxation=True), EPSILON)
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
    assert step.force[:, 2].sum() == pytest.approx(MASS * G, rel=1e-5)
    np.testing.assert_allclose(step.after.centre, simulation.state.centre, rtol=0, atol=1e-9)


def test_an_overlap_that_no_force_explains_pushes_nothing():
    """Two walls that a block overlaps by 1 mm; without forces from them, it falls as if they were not there."""
    walls = (
        brick(code, (x, -0.2, -1.0), (x + 1.0, 0.2, 1.0), Fidelity.FIXED)
        for code, x in (("L", -1), ("R", 0.5))
    )
    stone = brick("S", (-1e-3, -0.2, -0.15), (0.5 + 1e-3, 0.2, 0.15))
    simulation = compliant(scene(*walls, stone, step=1e-3), 1e-4)
    for _ in range(10):
        simulation.step()
    np.testing.assert_allclose(simulation.state.centre[2, 2], -55 * G * 1e-6, rtol=1e-5)


# --- when joints yield ---


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


SPEED, PINCHED = 1e-4, 0.1  # of the right support [m/s], for so long [s]


def pinched(**time):
    """A block between two supports, one of which moves into it: rigid joints contradict each other."""
    blocks = (
        ground(),
        brick("left", (-1.0, 0.0, 0.0), (0.0, 0.5, 0.5), Fidelity.FIXED),
        brick("S", (0.0, 0.0, 0.0), (0.5, 0.5, 0.5)),
        brick("right", (0.5, 0.0, 0.0), (1.5, 0.5, 0.5), Fidelity.FIXED),
    )
    times = np.array([0.0, PINCHED, PINCHED + 1e-6, 10.0])
    speed = -SPEED * np.array([1.0, 1.0, 0.0, 0.0])
    drive = ImposedMotion(frozenset(["right"]), velocity=History(times, np.outer(speed, [1.0, 0.0, 0.0])))
    one = scene(*blocks, step=STEP, **{"relaxation": True} | time)
    return replace(one, loads=Loads(motions=(drive,)))


def yields(one, steps):
    """Whether joints were compliant in each step, and whether it was solved."""
    simulation = Simulation(*build_model(one))
    made = [simulation.step() for _ in range(steps)]
    return [(step.problem.delassus.joint_compliance is not None, step.solution.converged) for step in made]


def test_joints_yield_where_rigid_ones_contradict_each_other_on_the_way_to_a_rest():
    assert all(one == (True, True) for one in yields(pinched(), 15)[1:])


def test_in_a_motion_joints_stay_rigid_and_the_step_counts_as_unsolved():
    assert all(one == (False, False) for one in yields(pinched(relaxation=False), 15)[1:])


def test_the_verdict_tells_how_far_joints_gave_way():
    result = simulate(pinched())
    assert result.errors.unconverged_steps == 0
    told = [caution for caution in result.cautions if caution.startswith("joints gave way elastically in")]
    assert len(told) == 1
    assert "which rigid joints did not solve" in told[0]


@pytest.mark.parametrize("method", Method)
def test_joints_yield_where_the_method_is_left_open_alone(method):
    one = replace(pinched(), solver=replace(pinched().solver, method=method))
    assert may_yield(build_model(one)[0]) == (method is Method.AUTO)


SPRINGS = ContactSettings(ElasticJoint(0.6, 1e9, 1e9))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, True),
        ({"solver": replace(regular().solver, joint_compliance=0.0)}, False),
        ({"time": replace(regular().time, relaxation=False)}, False),
        ({"contact": SPRINGS}, False),
    ],
    ids=["rest", "no compliance", "motion", "springs of their own"],
)
def test_joints_may_yield_on_the_way_to_a_rest_alone(change, expected):
    assert may_yield(build_model(replace(regular(), **change))[0]) == expected


@pytest.mark.parametrize(("soft", "expected"), [(0, True), (3, True), (12, False)])
def test_joints_may_yield_where_more_stones_are_rigid_than_deform(soft, expected):
    blocks = regular().blocks
    some = [
        replace(one, fidelity=Fidelity.DEFORMABLE, mesh_size=0.5) if 0 < n <= soft else one
        for n, one in enumerate(blocks)
    ]
    assert may_yield(build_model(replace(regular(), blocks=tuple(some)))[0]) == expected


# --- how long ---

OPERATOR = blocks_apart(*[2.0 * np.eye(3)] * 2)


def tried(joints, steps, yields=True):
    """Steps in which rigid joints are tried, if these always fail and compliant ones are solved or not."""
    found = []
    for count in range(steps):
        if joints.rigid:
            found.append(count)
            joints = joints.needed(OPERATOR, 1e-3)
        joints = joints.used(1.0) if yields else joints.failed()
    return found


def test_rigid_joints_that_fail_are_tried_again_after_ever_longer_waits():
    """After 8 steps with compliant joints, after 16 more, after 32 more."""
    assert tried(JointCompliance(), 60) == [0, 8, 24, 56]


def test_joints_that_had_to_yield_beside_deformable_stones_do_so_for_good():
    assert tried(JointCompliance(lasting=True), 60) == [0]
    yielded = JointCompliance(lasting=True).needed(OPERATOR, 1e-3).used(1.0)
    assert not yielded.released().rigid


def test_compliance_is_a_share_of_w_and_is_kept():
    first = JointCompliance().needed(OPERATOR, 1e-3)
    assert first.value == pytest.approx(2e-3)
    assert first.needed(blocks_apart(np.eye(3)), 1e-3).value == first.value
    assert first.softer(10.0).value == pytest.approx(2e-2)
    assert first.used(3.0).softness == 3.0
    # once rigid ones have been tried again, it begins hard
    assert first.used(3.0).needed(OPERATOR, 1e-3).softness == 1.0


def test_joints_that_cannot_be_solved_either_way_are_left_to_rigid_ones_for_a_while():
    joints = JointCompliance().failed()
    assert joints.rigid
    assert joints.left == -8
    for _ in range(8):
        assert joints.left < 0
        joints = joints.passed()
    assert joints.left == 0


def test_a_release_tries_rigid_joints_at_once():
    assert JointCompliance(1e-3, 5).released().rigid
    assert JointCompliance(1e-3, -5).released().left == -5
