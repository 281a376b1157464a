"""The automatic choice from step to step: what rests keeps its forces, what moves is followed."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mechanics.contact.contacts import gaps
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulation import PlanarSimulation
from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import residual
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Fidelity, Method, SolverSettings
from mechanics.scene.shapes import bond, wall
from mechanics.solvers import auto, chain
from mechanics.solvers.auto import Auto
from mechanics.solvers.chain import KEPT
from tests.mechanics.planar.shapes import box, grid_of_disks
from tests.mechanics.shapes import brick, posed, scene
from tests.mechanics.solvers.problems import STEP, G, cold, column, leaning, velocity_of

FREE = G * STEP  # velocity that gravity gives in a step [m/s]


class Tilt:
    """Gravity as on a support that is accelerated along the wall."""

    until = np.inf

    def __init__(self, share):
        self.share = share

    def __call__(self, time, gravity):
        return gravity + np.linalg.norm(gravity) * np.array([self.share(time), 0.0, 0.0])


def followed(count, share=None, size=8, **solver):
    """Steps of a square wall in running bond on a slab; `share` of gravity along it by time."""
    one = scene(*wall(bond(size, size), 0.5, 0.25, 0.3), step=STEP, theta=0.5, duration=0.05)
    loads = Loads() if share is None else Loads((Tilt(share),))
    simulation = Simulation(*build_model(replace(one, loads=loads, solver=SolverSettings(**solver))))
    return [simulation.step() for _ in range(count)]


@cache
def rest():
    return followed(60)


# --- rest ---


def test_a_settled_wall_keeps_its_forces():
    """Balanced once more, to far below the tolerance, they need no iteration in any later step."""
    work = np.array([step.solution.iterations for step in rest()[1:]])
    assert all(step.solution.converged for step in rest())
    assert np.count_nonzero(work) <= 4
    assert not work[20:].any()
    assert {step.solution.why for step in rest()[21:]} == {KEPT}


def test_a_settled_wall_neither_speeds_up_nor_opens():
    for step in rest()[1:]:
        assert np.abs(step.after.velocity[:, :3]).max() <= 1e-6 * FREE
    last = rest()[-1]
    # contacts may break their law by 10⁻⁵ g h, which is an ångström in a step: gaps stay far below
    assert np.abs(gaps(last.contacts, last.after)).max() <= 1e-6 * FREE * STEP


def test_a_tilted_wall_stays():
    """A fifth of its weight along its courses, below a friction of 0.6: every step is solved, and nothing moves."""
    steps = followed(5, lambda time: 0.2)
    assert all(step.solution.converged for step in steps)
    assert max(np.abs(step.after.velocity).max() for step in steps) <= 1e-4 * FREE


def test_forces_are_not_kept_where_they_solve_the_step_no_longer():
    problem, last = rest()[-1].problem, rest()[-1].solution
    warm = ContactStart(last.impulse, last.velocity, 0)
    # all stones fly up, by a hundred times what the tolerance leaves undecided
    lifted = replace(problem, u_free=problem.u_free + np.array([1e-3 * FREE, 0.0, 0.0]))
    kept, found = Auto()(problem, warm), Auto()(lifted, warm)
    assert (kept.iterations, kept.why) == (0, KEPT)
    np.testing.assert_array_equal(kept.impulse, warm.impulse)
    assert found.iterations > 0
    assert found.converged
    assert velocity_of(lifted, found)[:, 0].min() > -1e-5 * FREE


def test_forces_at_the_edge_of_the_tolerances_are_solved_further_not_kept():
    """Rigid stones that they set in motion would be stopped by the next step, and set in motion again for ever."""
    problem, last = rest()[-1].problem, rest()[-1].solution
    rough = (1 + 4e-7) * last.impulse
    assert residual(problem, rough).within(1e-6, 1e-5)
    found = Auto()(problem, ContactStart(rough, last.velocity))
    assert found.iterations > 0
    assert residual(problem, found.impulse).within(3e-8, 3e-7)
    again = Auto()(problem, ContactStart(found.impulse, found.velocity))
    assert (again.iterations, again.why) == (0, KEPT)


def test_forces_of_a_rest_are_exact_where_they_are_kept_for_long():
    """What they lack would add up to a creep: from step two on, a hundredth of the tolerances is left at most."""
    left = residual(rest()[-1].problem, rest()[-1].solution.impulse)
    assert left.within(1e-8, 1e-7)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_gaps_below_the_tolerance_do_not_set_stones_in_motion(seed):
    """Errors of earlier steps leave gaps and overlaps of a billionth; contacts rest as if there were none."""
    problem = rest()[10].problem
    ajar = np.random.default_rng(seed).uniform(-5e-6, 5e-6, len(problem.bias)) * FREE
    gaping = replace(problem, bias=ajar)
    found = Auto()(gaping, cold(gaping))
    assert found.converged
    assert np.abs(velocity_of(gaping, found)).max() <= 1e-8 * FREE


def test_iterations_with_gaps_closed_and_as_they_are_count_together(monkeypatch):
    """An η that nothing reaches: with gaps closed the chain fails, and again with what is left of the iterations."""
    spent = []

    def counted(*given):
        found = chain.follow(*given)
        spent.append(found.iterations)
        return found

    monkeypatch.setattr(auto, "follow", counted)
    problem = rest()[10].problem
    gaping = replace(problem, bias=np.full(len(problem.bias), 1e-6 * FREE))
    found = Auto(1e-30, 1e-5, 100)(gaping, cold(gaping))
    assert len(spent) == 2
    assert not found.converged
    assert found.iterations == sum(spent) <= 100


def pinched(count):
    """Stones that each overlap two fixed ones by a millimetre, one from each side."""
    stones = []
    for n in range(count):
        y = 0.5 * n
        stones += [
            brick(f"L{n}", (-1.0, y, -1.0), (0.0, y + 0.4, 1.0), Fidelity.FIXED),
            brick(f"R{n}", (0.5, y, -1.0), (1.5, y + 0.4, 1.0), Fidelity.FIXED),
            brick(f"S{n}", (-1e-3, y, -0.15), (0.501, y + 0.4, 0.15)),
        ]
    return posed(scene(*stones), STEP, theta=0.5).problem


@pytest.mark.parametrize("count", [1, 310])
def test_a_stone_pinched_by_an_overlap_does_not_hang(count):
    """Friction could hold it, by forces across it that no load causes: it falls freely, few stones or many."""
    problem = pinched(count)
    found = Auto()(problem, cold(problem))
    assert found.converged
    assert np.abs(found.impulse).max() <= 1e-4 * 2000.0 * 0.502 * 0.4 * 0.3 * FREE


# --- motion ---


def shaken(time):
    return 0.3 * np.sin(30.0 * time)


def test_a_motion_is_followed_by_one_method_and_its_rest_is_found():
    """Shaken beyond what friction holds for 20 steps, then still: its forces are kept again in the end."""
    steps = followed(80, lambda time: 0.9 if time < 0.02 else 0.0, size=4)
    assert all(step.solution.converged for step in steps)
    moving, still = steps[5:20], steps[-10:]
    assert all(step.solution.motion > 0 for step in moving)
    assert {step.solution.why.split(":")[0] for step in moving} <= {"body ADMM", "Newton"}
    assert all(np.abs(step.after.velocity).max() < 1e-3 * FREE for step in still)
    assert {step.solution.why for step in still} == {KEPT}


def test_contacts_of_a_wall_that_only_trembles_are_kept_where_its_motion_may_be_wrong():
    loose = followed(50, shaken, motion_error=1e-4)
    assert all(step.solution.converged for step in loose)
    assert len({id(step.found) for step in loose}) <= 10
    # nothing slides in truth
    assert np.abs(loose[-1].after.centre - loose[0].before.centre).max() <= 1e-4


def test_errors_of_a_motion_are_allowed_in_a_motion_alone():
    problem = posed(leaning(0.9, 6, 6), step=5e-3).problem
    loosely = Auto(motion_speed=1e-3 * float(np.abs(problem.u_free).max()))
    first = loosely(problem, cold(problem))
    assert residual(problem, first.impulse).within(1e-6, 1e-5)
    off = ContactStart(0.9 * first.impulse, first.velocity, motion=20)
    exact, loose = Auto()(problem, off), loosely(problem, off)
    assert exact.converged
    assert loose.converged
    assert loose.iterations < exact.iterations
    assert residual(problem, loose.impulse).velocity <= 1e-3
    assert residual(problem, exact.impulse).within(1e-6, 1e-5)


def test_factors_that_are_kept_give_the_same_bits():
    """The operator of many steps knows factors by its penalties; one that is new has none."""
    problem = posed(leaning(0.3, 6, 6), step=5e-3).problem
    fresh = replace(problem, delassus=replace(problem.delassus))
    start = ContactStart(np.full_like(problem.u_free, 0.1), np.zeros_like(problem.u_free), motion=20)
    Auto()(problem, cold(problem))
    one, other = Auto()(problem, start), Auto()(fresh, start)
    assert one.iterations > 0
    np.testing.assert_array_equal(one.impulse, other.impulse)


# --- heavy on light ---


def test_a_heavy_stone_on_a_light_one_is_solved_at_once():
    problem = column([2.0, 2e6])
    found = Auto(1e-8, 1e-8)(problem, cold(problem))
    assert found.converged
    assert found.iterations <= 60


# --- the plane ---

FLOOR = Wall("floor", (-10.0, 0.0), (10.0, 0.0))


def tower_of_disks(count, top=2400.0):
    """Disks on top of each other, the last of its own density."""
    return tuple(
        Disk(f"d{n}", (0.0, 0.1 + 0.2 * n), 0.1, top if n == count - 1 else 2400.0) for n in range(count)
    )


def planar_steps(one, count):
    model, start = build_planar_model(one)
    simulation = PlanarSimulation(model, start, Clock())
    return [simulation.step() for _ in range(count)]


@pytest.mark.parametrize(
    "disks", [tower_of_disks(100), tower_of_disks(2, 2.4e9)], ids=["stack of 100", "10^6 on 1"]
)
def test_tall_and_heavy_columns_of_disks_rest_at_the_default_settings(disks):
    steps = planar_steps(PlanarScene("column", disks, (FLOOR,), time=PlanarTime(1e-3, 1.0, 0.02)), 10)
    assert all(step.solution.converged for step in steps)
    assert np.abs(steps[-1].after.velocity).max() < 1e-4 * FREE


def test_a_small_heap_is_swept_alone():
    centres, radii = grid_of_disks(4, 3)
    steps = planar_steps(box(centres, radii, time=PlanarTime(1e-3, 1.0), solver=SolverSettings()), 60)
    assert any(step.solution.iterations for step in steps)
    assert all(step.solution.converged for step in steps)
    reasons = {step.solution.why.split(":")[0] for step in steps if step.solution.iterations}
    assert reasons == {"sweeps"}


def test_few_iterations_are_sweeps_alone_with_the_same_bits():
    disks = tower_of_disks(40)
    runs = [
        planar_steps(
            PlanarScene("column", disks, (FLOOR,), solver=SolverSettings(method, max_iterations=60)), 5
        )
        for method in (Method.AUTO, Method.NSGS)
    ]
    for one, other in zip(*runs, strict=True):
        assert not one.solution.converged
        np.testing.assert_array_equal(one.impulse, other.impulse)
