"""ADMM on the velocities of rigid bodies: its solutions, its bits, and walls that it follows."""

from dataclasses import replace

import numpy as np
import pytest
from mechanics.solvers.strategies.compliant import Compliant

from benchmarks.scenes import engine_scene, running_bond
from mechanics.delassus.compliant import CompliantDelassus
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import residual
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import SolverSettings
from mechanics.solvers._kernels.body_parts import parts_of
from mechanics.solvers.first_order import body_admm
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.second_order.interior_point import InteriorPoint
from moma.errors import SolverError

_ALONG, _ACROSS = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
_STEPS = 60


def shaken(direction, bricks=6, **solver):
    """Return a square wall on a slab that is shaken with 0.3 g at 5 Hz."""
    scene = engine_scene(running_bond(bricks, bricks), 1e-3, 0.5, 1e-6, 2000)
    time = np.arange(0.0, 0.3, 1e-3)
    pulse = 2 * np.pi * 5.0
    speed = 0.3 * 9.81 / pulse * np.sin(pulse * time)
    ground = ImposedMotion(frozenset(["b0"]), velocity=History(time, np.outer(speed, direction)))
    return replace(
        scene,
        loads=Loads(motions=(ground,)),
        time=replace(scene.time, duration=_STEPS * 1e-3),
        solver=SolverSettings(**solver),
    )


def followed(scene, steps=_STEPS):
    """Return the steps of a scene."""
    simulation = Simulation(*build_model(scene))
    return [simulation.step() for _ in range(steps)]


def places(steps):
    return np.array([step.after.centre for step in steps])


@pytest.fixture(scope="module")
def finest():
    """Places of the stones in every step, to a thousandth of the default tolerances."""
    return places(followed(shaken(_ALONG, tolerance=1e-9, velocity_tolerance=1e-8)))


@pytest.fixture(scope="module")
def problem():
    """The contact problem of a step in which stones slide."""
    return followed(shaken(_ALONG), 20)[-1].problem


def nothing(problem):
    return ContactStart(np.zeros_like(problem.u_free), np.zeros_like(problem.u_free))


@pytest.mark.parametrize(
    "stages",
    [
        (Stage(0.05, 4000, False),),
        (Stage(0.1, 4000, True),),
        (Stage(0.1, 20, False), Stage(0.05, 4000, False)),
    ],
)
def test_velocities_are_those_of_the_interior_point(problem, stages):
    found = BodyADMM(1e-7, 1e-6, 5000, stages)(problem, nothing(problem))
    exact = InteriorPoint(1e-8, 1e-6, 100)(problem, nothing(problem))
    assert found.converged
    # forces of joints of four points are not unique, the velocities that they give are
    wanted = problem.delassus.apply(exact.impulse)
    given = problem.delassus.apply(found.impulse)
    assert np.abs(given - wanted).max() < 1e-4 * np.abs(problem.u_free).max()


def test_the_solution_is_a_fixed_point_whose_velocity_is_dual_to_it(problem):
    found = BodyADMM(1e-7, 1e-6, 5000, (Stage(0.05, 4000, False),))(problem, nothing(problem))
    again = BodyADMM(1e-6, 1e-5, 5000)(problem, ContactStart(found.impulse, found.velocity))
    assert again.iterations == 0
    left = residual(problem, found.impulse)
    assert np.abs(found.velocity - left.dual).max() < 1e-5 * np.abs(problem.u_free).max()


def test_factors_of_single_precision_lose_nothing(problem, monkeypatch):
    solver = BodyADMM(1e-14, 1e-14, 100, (Stage(0.05, 100, False),))
    found = []
    for few in (body_admm._FEW, 1):
        monkeypatch.setattr(body_admm, "_FEW", few)
        problem.delassus.memo.clear()
        found.append(solver(problem, nothing(problem)))
    problem.delassus.memo.clear()
    double, single = found
    assert not np.array_equal(single.impulse, double.impulse)
    # velocities themselves, solved for in single precision, would be wrong by some 10⁻⁷
    np.testing.assert_allclose(single.velocity, double.velocity, atol=1e-10 * np.abs(problem.u_free).max())
    assert single.natural_map < 1.001 * double.natural_map


@pytest.fixture(scope="module")
def wide():
    """The contact problem of a step of a wall of 20 × 4 bricks that is shaken."""
    scene = shaken(_ALONG)
    bricks = engine_scene(running_bond(20, 4), 1e-3, 0.5, 1e-6, 2000).blocks
    return followed(replace(scene, blocks=bricks), 20)[-1].problem


def test_threads_share_the_parts_of_many_bodies_with_the_same_bits(wide, monkeypatch):
    monkeypatch.setattr(body_admm, "_FEW", 1)
    solver = BodyADMM(1e-14, 1e-14, 60, (Stage(0.05, 40, False), Stage((1.0, 0.1, 0.01), 20, False)))
    found = []
    for threads in (1, 2, 3):
        wide.delassus.memo.clear()
        operator = replace(wide.delassus, threads=threads)
        found.append(solver(replace(wide, delassus=operator), nothing(wide)))
        assert len(body_admm._bodies_of(operator, operator.rigid).groups) == threads
    assert len({one.impulse.tobytes() for one in found}) == 1
    assert len({one.velocity.tobytes() for one in found}) == 1


def test_parts_change_nothing_but_rounding(wide, monkeypatch):
    monkeypatch.setattr(body_admm, "_FEW", 1)
    solver = BodyADMM(1e-14, 1e-14, 40, (Stage(0.05, 40, False),))
    found = []
    for several in (False, True):
        monkeypatch.setattr(
            body_admm, "parts_of", lambda panels, _, several=several: parts_of(panels, several)
        )
        wide.delassus.memo.clear()
        found.append(solver(wide, nothing(wide)))
        assert (len(body_admm._bodies_of(wide.delassus, wide.delassus.rigid)._parts.body) > 1) == several
    wide.delassus.memo.clear()
    whole, cut = found
    # factors are of single precision, and each iteration corrects the last one's rounding
    np.testing.assert_allclose(cut.impulse, whole.impulse, atol=1e-6 * np.abs(whole.impulse).max())


def test_contacts_of_joints_that_yield_share_their_load_as_newton_finds_it(problem):
    """(W + E) instead of W: E is 2 % of W across joints, 4 % along them, and of small contacts 10⁴ times as large."""
    mean = np.einsum("cii->c", problem.delassus.diagonal) / 3.0
    compliance = mean[:, None] * np.array([0.02, 0.04, 0.04])
    compliance[::7] *= 1e4
    yielding = replace(problem, delassus=CompliantDelassus(problem.delassus, compliance))
    found = BodyADMM(1e-10, 1e-9, 3000, (Stage(0.2, 3000, True),))(yielding, nothing(problem))
    exact = Compliant(1e-10, 1e-9)(yielding, nothing(problem))
    assert found.converged
    assert exact.why == "compliant joints, Newton"
    # W + E is regular, so the impulses are unique
    np.testing.assert_allclose(found.impulse, exact.impulse, atol=1e-6 * np.abs(exact.impulse).max())
    rigid = BodyADMM(1e-10, 1e-9, 3000, (Stage(0.05, 3000, True),))(problem, nothing(problem))
    assert np.abs(rigid.impulse - exact.impulse).max() > 0.01 * np.abs(exact.impulse).max()


def test_a_problem_that_is_not_of_rigid_bodies_is_refused(problem):
    with pytest.raises(SolverError, match="not all rigid"):
        BodyADMM()(replace(problem, delassus=_Unknown(problem.delassus)), nothing(problem))


class _Unknown:
    """W without its bodies."""

    rigid = None
    plane = None

    def __init__(self, delassus):
        self.diagonal = delassus.diagonal


@pytest.mark.parametrize("direction", [_ALONG, _ACROSS])
def test_every_step_of_a_shaken_wall_is_solved_by_the_method_of_the_last_ones(direction):
    steps = followed(shaken(direction))
    assert all(step.solution.converged for step in steps)
    why = [step.solution.why for step in steps]
    motion = [name.startswith("admm of bodies: motion") for name in why]
    # once the wall is found to move, no other method is tried before
    assert sum(motion) > 0.8 * _STEPS, why
    iterations = np.array([step.solution.iterations for step in steps])[motion]
    assert np.median(iterations) < 120
    assert iterations.max() <= 550


def test_a_shaken_wall_moves_the_same_way_to_the_last_bit():
    one, other = (places(followed(shaken(_ACROSS), 25)) for _ in range(2))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("asked", [1e-6, 1e-5, 1e-4])
def test_a_motion_is_as_wrong_as_the_user_allows_within_a_factor_of_three(asked, finest):
    """Measured against the finest run; solver errors need not add up, so that it may be less."""
    steps = followed(shaken(_ALONG, motion_error=asked))
    assert all(step.solution.converged for step in steps)
    assert np.abs(places(steps) - finest).max() <= 3.0 * asked


def test_the_loosest_motion_finds_contacts_seldom_takes_few_iterations_and_keeps_its_error():
    """Across the wall, where all stones move: to 1 mm, where the default finds contacts in each step."""
    default, loose = (followed(shaken(_ACROSS, **setting)) for setting in ({}, {"motion_error": 1e-3}))
    assert np.abs(places(loose) - places(default)).max() <= 1e-3
    found, seldom = (len({id(step.found) for step in steps}) for steps in (default, loose))
    assert found > 2 * seldom
    total, few = (sum(step.solution.iterations for step in steps[10:]) for steps in (default, loose))
    assert total > 2.5 * few


def test_the_default_follows_a_motion_to_nanometres(finest):
    assert np.abs(places(followed(shaken(_ALONG))) - finest).max() < 1e-8


def test_a_looser_motion_takes_fewer_iterations():
    default, loose = (
        sum(step.solution.iterations for step in followed(shaken(_ALONG, **setting))[10:])
        for setting in ({}, {"motion_error": 1e-4})
    )
    assert default > 1.5 * loose
