"""Driven bodies and forces in the engine: where they are, what they carry, what they cost."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ground.errors import SceneError
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads, Pose
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Fidelity, SolverSettings
from tests.mechanics.shapes import brick, ground, scene

G = 9.81
THETAS = pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])


@dataclass(frozen=True)
class Swing:
    """Swings along a direction and about an axis through a pivot, from rest."""

    stones: frozenset
    along: tuple = (0.0, 0.0, 0.0)
    about: tuple = (0.0, 0.0, 0.0)
    pivot: tuple = (0.0, 0.0, 0.0)
    pulse: float = 7.0

    def pose(self, time):
        part = 1.0 - np.cos(self.pulse * time)
        turn = Rotation.from_rotvec(part * np.array(self.about)).as_matrix()
        return Pose(part * np.array(self.along), turn, np.array(self.pivot))


@dataclass(frozen=True)
class Drift:
    """Moves with a constant velocity, and turns with a constant spin about the vertical through a pivot."""

    stones: frozenset
    velocity: tuple = (0.0, 0.0, 0.0)
    spin: float = 0.0
    pivot: tuple = (0.0, 0.0, 0.0)

    def pose(self, time):
        turn = Rotation.from_rotvec([0, 0, self.spin * time]).as_matrix()
        return Pose(time * np.array(self.velocity), turn, np.array(self.pivot))


TABLE = frozenset({"ground"})


def started(*blocks, motions=(), forces=(), eta=1e-9, **settings):
    one = replace(scene(*blocks, **settings), loads=Loads(motions=motions, forces=forces))
    one = replace(one, solver=SolverSettings(tolerance=eta))
    return Simulation(*build_model(one))


# --- driven bodies ---


@THETAS
def test_a_driven_body_is_at_every_step_exactly_where_its_motion_says(theta):
    motion = Swing(TABLE, (0.02, -0.03, 0.01), (0.1, 0.2, -0.3), (0.5, 1.0, -2.0))
    simulation = started(
        ground(), brick("a", (0, 0, 0.5), (1, 1, 1)), motions=(motion,), step=0.01, theta=theta
    )
    start = simulation.start
    for count in range(1, 60):
        after = simulation.step().after
        pose = motion.pose(count * 0.01)
        expected = pose.pivot + pose.rotation @ (start.centre[0] - pose.pivot) + pose.displacement
        np.testing.assert_allclose(after.centre[0], expected, atol=1e-13)
        np.testing.assert_allclose(after.rotation[0], pose.rotation, atol=1e-13)


@THETAS
def test_a_stone_rides_on_a_table_that_moves_and_turns_evenly(theta):
    """It gets the table's velocity in its first steps, and keeps its place on it as long as friction can hold it."""
    motion = Drift(TABLE, (0.2, 0.1, 0.05), 0.5, (0.5, 0.5, 0.0))
    stone = brick("a", (0.3, 0.3, 0), (0.7, 0.7, 0.2), velocity=(0.2, 0.1, 0.05, 0, 0, 0.5))
    simulation = started(ground(), stone, motions=(motion,), step=2e-3, theta=theta, friction=0.6)
    for _ in range(250):
        step = simulation.step()
    after, pose = step.after, motion.pose(0.5)
    np.testing.assert_allclose(after.velocity[1], [0.2, 0.1, 0.05, 0, 0, 0.5], atol=1e-4)
    expected = pose.pivot + pose.rotation @ (simulation.start.centre[1] - pose.pivot) + pose.displacement
    np.testing.assert_allclose(after.centre[1], expected, atol=1e-5)
    np.testing.assert_allclose(after.rotation[1], pose.rotation, atol=1e-5)


def test_a_belt_drags_a_stone_with_mu_g_until_both_are_as_fast():
    mu, pace, h = 0.4, 0.5, 1e-3
    stone = brick("a", (-1, 0, 0), (-0.5, 0.4, 0.2))
    simulation = started(
        ground(), stone, motions=(Drift(TABLE, (pace, 0, 0)),), step=h, theta=0.5, friction=mu
    )
    steps = [simulation.step() for _ in range(300)]
    speed = np.array([s.after.velocity[1, 0] for s in steps])
    time = h * np.arange(1, 301)
    np.testing.assert_allclose(speed, np.minimum(mu * G * time, pace), atol=1e-6 + mu * G * h)
    sliding = time < pace / (mu * G) - h
    np.testing.assert_allclose(speed[sliding], mu * G * time[sliding], rtol=1e-6)
    # half of what the belt puts in becomes motion, half is lost: pace · force · time against m pace²/2; to first
    # order in the step, in which the belt starts with a jerk
    balance = EnergyBalance(simulation.model, simulation.start)
    for step in steps:
        balance(step)
    kinetic = 0.5 * simulation.model.mass[1] * pace**2
    assert balance.external == pytest.approx(2 * kinetic, rel=1e-2)
    assert balance.contact == pytest.approx(-kinetic, rel=1e-2)
    assert balance.error < 1e-11


def test_without_friction_a_moving_table_takes_nothing_along():
    stone = brick("a", (-1, 0, 0), (-0.5, 0.4, 0.2))
    motion = Swing(TABLE, (0.1, 0.05, 0.0))
    simulation = started(ground(), stone, motions=(motion,), step=2e-3, friction=0.0)
    for _ in range(200):
        step = simulation.step()
    np.testing.assert_allclose(step.after.centre[1], simulation.start.centre[1], atol=1e-9)


@THETAS
def test_the_balance_closes_when_a_table_shakes_stones(theta):
    stones = ground(), brick("a", (0, 0, 0), (1, 0.6, 0.5)), brick("b", (0.2, 0.1, 0.5), (0.6, 0.5, 1.4))
    motion = Swing(TABLE, (0.05, 0.02, 0.01), (0.02, -0.05, 0.01))
    simulation = started(*stones, motions=(motion,), step=2e-3, theta=theta)
    balance = EnergyBalance(simulation.model, simulation.start)
    for _ in range(200):
        balance(simulation.step())
    assert balance.external > 5.0
    assert balance.error < 1e-11


def test_a_driven_stone_pushes_a_free_one_ahead():
    """A ram at 0.3 m/s meets a cube on smooth ground: inelastic, so the cube leaves with the ram's velocity."""
    ram = brick("ram", (-1.05, 0.2, 0.2), (-0.05, 0.8, 0.8), Fidelity.FIXED)
    cube = brick("cube", (0, 0, 0), (1, 1, 1))
    simulation = started(
        ground((-5, -5, -1), (9, 5, 0)), ram, cube, motions=(Drift(frozenset({"ram"}), (0.3, 0, 0)),),
        step=2e-3, theta=0.5, friction=0.0,
    )  # fmt: skip
    for _ in range(200):
        step = simulation.step()
    assert step.after.velocity[2, 0] == pytest.approx(0.3, abs=1e-7)
    # it began to move when the gap of 0.05 m was closed
    assert step.after.centre[2, 0] - 0.5 == pytest.approx(0.3 * 0.4 - 0.05, abs=0.3 * 2e-3)
    np.testing.assert_allclose(step.after.centre[1, 0] + 0.5, step.after.centre[2, 0] - 0.5, atol=0.3 * 2e-3)


# --- forces ---


@THETAS
def test_a_constant_force_moves_a_free_stone_by_half_f_over_m_t2(theta):
    h, n = 1e-2, 80
    push = np.array([30.0, -20.0, 10.0])
    force = StoneForce(frozenset({"a"}), History.constant(push))
    simulation = started(
        brick("a", (0, 0, 0), (0.5, 0.4, 0.3)), forces=(force,), gravity=(0, 0, 0), step=h, theta=theta
    )
    for _ in range(n):
        step = simulation.step()
    acceleration, t = push / (2000 * 0.06), n * h
    # the θ-scheme adds (θ - ½) a h² in each step
    expected = acceleration * (t**2 / 2 + (theta - 0.5) * h * t)
    np.testing.assert_allclose(step.after.centre[0] - simulation.start.centre[0], expected, rtol=1e-12)
    np.testing.assert_allclose(step.after.velocity[0], [*(acceleration * t), 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(step.kick.load[0], [*push, 0, 0, 0], rtol=1e-13)


def test_a_couple_about_a_principal_axis_spins_a_stone_up_evenly():
    """Two forces, ahead and behind: M t/I about z, and no motion of the centre."""
    a, b, push = 0.5, 0.4, 6.0
    forces = tuple(
        StoneForce(
            frozenset({"a"}), History.constant([0.0, s * push, 0.0]), arm=(s * a / 2, 0.0, 0.0), follows=True
        )
        for s in (1.0, -1.0)
    )
    simulation = started(
        brick("a", (0, 0, 0), (a, b, 0.3)), forces=forces, gravity=(0, 0, 0), step=1e-2, theta=0.5
    )
    for _ in range(100):
        step = simulation.step()
    inertia = 2000 * 0.06 / 12 * (a**2 + b**2)
    np.testing.assert_allclose(step.after.velocity[0], [0, 0, 0, 0, 0, push * a / inertia], atol=1e-11)
    balance = 0.5 * inertia * (push * a / inertia) ** 2
    assert balance == pytest.approx(0.5 * push * a * step.after.velocity[0, 5], rel=1e-12)


def test_the_balance_closes_under_forces_that_turn_with_their_stones():
    force = StoneForce(
        frozenset({"a"}),
        History(np.array([0.0, 0.3]), np.array([[0, 0, 0], [400.0, 100, 300]])),
        (0.1, 0.2, 0.0),
        True,
    )
    stone = brick("a", (0, 0, 0), (0.5, 0.4, 0.3), velocity=(0, 0, 0, 1, 2, 3))
    simulation = started(ground(), stone, forces=(force,), step=2e-3, theta=0.5)
    balance = EnergyBalance(simulation.model, simulation.start)
    for _ in range(300):
        balance(simulation.step())
    assert balance.external != 0
    assert balance.error < 1e-11


# --- what loads may not be ---


def force_on(*codes):
    return StoneForce(frozenset(codes), History.constant([1.0, 0, 0]))


@pytest.mark.parametrize(
    ("loads", "said"),
    [
        ({"motions": (Drift(frozenset({"a"})),)}, r"a motion is imposed on a, which is not fixed.*make it fixed"),
        ({"motions": (Drift(TABLE), Swing(TABLE))}, r"two motions are imposed on ground.*give one"),
        ({"forces": (force_on("ground"),)}, r"a force acts on ground, which is not rigid.*forces act on rigid stones"),
        ({"forces": (force_on("soft"),)}, r"a force acts on soft, which is not rigid"),
        ({"forces": (force_on("a", "nobody"),)}, r"a load names nobody.*give codes of blocks of the scene"),
        ({"motions": (Drift(frozenset({"z", "y"})),)}, r"a load names y, z"),
    ],
)  # fmt: skip
def test_loads_on_stones_that_cannot_bear_them_are_refused(loads, said):
    stones = (
        ground(),
        brick("a", (0, 0, 0), (1, 1, 1)),
        brick("soft", (0, 0, 1), (1, 1, 2), Fidelity.DEFORMABLE),
    )
    with pytest.raises(SceneError, match=said):
        started(*stones, **loads)
