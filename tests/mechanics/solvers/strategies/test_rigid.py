"""Walls at rest and in motion: forces that hold them are kept, and what does not change is not made again."""

from dataclasses import replace

import numpy as np
import pytest
from mechanics.solvers.strategies.rigid import Alternating, _without_self_stress

from benchmarks.scenes import column, engine_scene, first_problem, running_bond
from mechanics.contact.contacts import gaps
from mechanics.delassus.rigid import RigidDelassus
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactStart
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import SolverSettings
from mechanics.solvers.first_order.body_admm import BodyADMM
from mechanics.solvers.second_order.scaling import equilibrated

FREE = 9.81 * 1e-3  # velocity that gravity gives in a step of 1 ms [m/s]


class Tilt:
    """Gravity as on a support that is accelerated along the wall."""

    until = np.inf

    def __init__(self, share):
        self.share = share

    def __call__(self, time, gravity):
        return gravity + np.linalg.norm(gravity) * np.array([self.share(time), 0.0, 0.0])


def wall(bricks, share=None, courses=None, **solver):
    """A wall in running bond on a slab, square or of so many courses; `share` of gravity along it by time."""
    scene = engine_scene(
        running_bond(bricks, courses or bricks), step=1e-3, theta=0.5, tolerance=1e-6, sweeps=2000
    )
    loads = Loads() if share is None else Loads((Tilt(share),))
    time = replace(scene.time, duration=0.05)
    return replace(scene, loads=loads, time=time, solver=SolverSettings(**solver))


def followed(scene, count):
    simulation = Simulation(*build_model(scene))
    return [simulation.step() for _ in range(count)]


@pytest.fixture(scope="module")
def rest():
    """Wall of 10 courses of 10 bricks on a slab for 80 steps of 1 ms."""
    return followed(wall(10), 80)


def test_a_settled_wall_keeps_its_forces(rest):
    # balanced once more, to far below the tolerance, they need no iteration in any later step
    work = np.array([step.solution.iterations for step in rest[1:]])
    assert all(step.solution.converged for step in rest)
    assert np.count_nonzero(work) <= 4
    assert not work[20:].any()


def test_a_tall_wall_is_settled_by_its_first_step():
    # its forces are sought for longer, as balancing them anew in each later step takes ten times as long
    steps = followed(wall(12, courses=160), 5)
    assert all(step.solution.converged for step in steps)
    assert [step.solution.iterations for step in steps[1:]] == [0, 0, 0, 0]


def test_a_settled_wall_neither_speeds_up_nor_opens(rest):
    for step in rest[1:]:
        assert np.abs(step.after.velocity[:, :3]).max() <= 1e-6 * FREE
    last = rest[-1]
    # contacts may break their law by 10⁻⁵ g h, which is an ångström in a step: gaps stay far below
    assert np.abs(gaps(last.contacts, last.after)).max() <= 1e-6 * FREE * 1e-3


def test_forces_are_not_sought_where_a_contact_moves(rest):
    last = rest[-1]
    problem = last.problem
    warm = ContactStart(last.solution.impulse, last.solution.velocity, 0)
    # all stones fly up, by ten times what the tolerance leaves undecided
    lifted = replace(problem, u_free=problem.u_free + np.array([1e-3 * FREE, 0.0, 0.0]))
    solver = Alternating()
    assert solver._kept(lifted, warm, follows=True) is None
    kept = solver._kept(problem, warm, follows=True)
    assert kept is not None
    assert kept.iterations == 0
    np.testing.assert_array_equal(kept.impulse, warm.impulse)


def test_a_tilted_wall_needs_no_newton_step_to_stay_at_rest():
    # ADMM with a small penalty gives up a breath from the solution
    first = followed(wall(20, lambda time: 0.2), 1)[0]
    assert first.solution.converged
    assert first.solution.why.startswith("admm of bodies")


def test_factors_that_are_kept_give_the_same_bits():
    step = followed(wall(6, lambda time: 0.3 * np.sin(30.0 * time)), 12)[-1]
    own = step.problem.delassus
    assert "bodies" in own.memo
    start = ContactStart(0.9 * step.solution.impulse, step.solution.velocity)
    fresh = RigidDelassus(own.body, own.geometry, own.inertia, own.schedule, own.threads, own.centre)
    one = BodyADMM()(step.problem, start)
    other = BodyADMM()(replace(step.problem, delassus=fresh), start)
    assert one.iterations > 0
    np.testing.assert_array_equal(one.impulse, other.impulse)


def test_contacts_of_a_wall_that_only_trembles_are_kept_where_its_motion_may_be_wrong():
    def shaken(time):
        return 0.3 * np.sin(30.0 * time)

    loose = followed(wall(8, shaken, motion_error=1e-4), 50)
    found = {id(step.found) for step in loose}
    assert all(step.solution.converged for step in loose)
    assert len(found) <= 10
    # nothing slides in truth
    moved = loose[-1].after.centre - loose[0].before.centre
    assert np.abs(moved).max() <= 1e-4


@pytest.mark.parametrize(
    ("times", "penalty", "extrapolated"), [(1.9, 0.1, True), (2.0, 0.1, False), (4.0, 0.2, False)]
)
def test_errors_of_many_times_the_loosest_tolerance_are_reached_without_extrapolation(
    rest, times, penalty, extrapolated
):
    problem = rest[-1].problem
    loosest = 0.025 * np.abs(problem.u_free).max()
    strategy = Alternating(motion_speed=times * loosest)._in_motion(problem)
    assert strategy.velocity_tolerance == 0.025
    first = strategy._bodies(problem, many=False).stages[0]
    assert (first.penalty, first.extrapolated) == (penalty, extrapolated)


def test_forces_that_clamp_are_taken_out_and_all_bodies_feel_the_same():
    """A column of stones of 1 and 10⁶ in turns, whose contacts press sideways against each other in pairs."""
    problem = first_problem(column([2400.0, 2.4e9] * 3), friction=0.5)
    nothing = np.zeros_like(problem.u_free)
    impulse = Alternating(1e-8, 1e-6)(problem, ContactStart(nothing, nothing)).impulse
    weight = impulse[:, 0].max()
    clamped = impulse.copy()
    clamped[:, 1] += 1e-2 * weight * np.tile([1.0, -1.0, 1.0, -1.0], len(impulse) // 4)
    even, each = equilibrated(problem)
    least = _without_self_stress(even, clamped / each[:, None]) * each[:, None]
    assert np.abs(least[:, 1:]).max() < 1e-6 * weight
    upper = problem.delassus.body.max(axis=1)
    carried, wanted = (np.bincount(upper, forces[:, 0])[1:] for forces in (least, impulse))
    np.testing.assert_allclose(carried, wanted, rtol=1e-5)
