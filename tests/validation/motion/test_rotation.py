"""Free and forced rotation of rigid bodies: Euler's equations, the flip of the middle axis, the heavy top."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Block
from mechanics.stones.materials import Material
from tests.validation.scenes import G, box, dynamic, follow, moved, rotation


def plate(inertia, velocity=(0.0,) * 6):
    """A box about the origin with the principal moments `inertia` [kg m²]; it is 1 mm thick where its moments add up.

    Moments 1, 2, 3 are those of a plate without thickness; a millimetre changes the first two by 10⁻⁶.
    """
    a, b, c = inertia
    mass = 12.0
    square = np.maximum([b + c - a, a + c - b, a + b - c], 2e-6) / 2
    sides = np.sqrt(12 * square / mass)
    material = Material("test", mass / float(np.prod(sides)), 1e9, 0.2)
    return box("body", -sides / 2, sides / 2, material, velocity=velocity)


def body_rates(path):
    """ω in body axes (n, 3) [rad/s]."""
    return np.einsum("nji,nj->ni", path.rotation[:, 0], path.velocity[:, 0, 3:])


def euler(inertia, omega, times):
    """ω in body axes (n, 3) by Euler's equations, 1e-12."""
    moments = np.asarray(inertia)

    def rate(_, w):
        return -np.cross(w, moments * w) / moments

    return solve_ivp(rate, (0, times[-1]), omega, t_eval=times, rtol=1e-12, atol=1e-14, method="DOP853").y.T


def flips(time, spin):
    """Times at which a rate passes zero [s]."""
    at = np.flatnonzero(spin[:-1] * spin[1:] < 0)
    return time[at] + (time[at + 1] - time[at]) * spin[at] / (spin[at] - spin[at + 1])


def check_conserved(path, tolerance):
    """Spatial angular momentum, as a vector, and energy stay."""
    spin, energy = path.angular_momentum, path.kinetic
    assert np.abs(spin - spin[0]).max() < tolerance * np.linalg.norm(spin[0])
    assert np.abs(energy - energy[0]).max() < tolerance * energy[0]


@pytest.mark.slow
def test_a_body_flips_about_its_middle_axis():
    """R16: moments 1, 2, 3, ω₀ = (0.001, 1, 0.001): it flips at 14.90594 s; 1 % with h = 1 ms. Euler, 1e-12.

    Energy and angular momentum may drift by 1e-4; they stay to 1e-11.
    """
    block = plate((1.0, 2.0, 3.0), (0, 0, 0, 0.001, 1.0, 0.001))
    path = follow(dynamic("flip", [block], gravity=(0, 0, 0), duration=15.5))
    assert flips(path.time, body_rates(path)[:, 1])[0] == pytest.approx(14.90594, rel=1e-2)
    check_conserved(path, 1e-11)


def test_it_flips_again_and_again():
    """R16: the next flips come at 42.43678 and 69.96762 s, half a period of 27.53084 s apart; 1 %, h = 20 ms."""
    omega = (0.001, 1.0, 0.001)
    path = follow(
        dynamic(
            "flip", [plate((1.0, 2.0, 3.0), (0, 0, 0, *omega))], gravity=(0, 0, 0), step=2e-2, duration=75
        )
    )
    times = flips(path.time, body_rates(path)[:, 1])
    assert times == pytest.approx([14.90594, 42.43678, 69.96762], rel=1e-2)
    exact = euler((1.0, 2.0, 3.0), omega, np.linspace(0, 75, 7501))
    assert flips(np.linspace(0, 75, 7501), exact[:, 1]) == pytest.approx(
        [14.90594, 42.43678, 69.96762], rel=1e-5
    )
    check_conserved(path, 1e-11)


@pytest.mark.parametrize("step", [1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize("theta", [0.5, 0.8, 1.0])
def test_a_tumbling_stone_keeps_its_momentum_and_energy(step, theta):
    """Free rotation keeps angular momentum, a vector, and energy to 1e-11, however long the step. Principle."""
    block = moved(
        plate((1.0, 1.7, 2.2), (0.3, -0.2, 0.1, 1.0, -2.0, 0.7)), rotation([1, 2, 3], 40), (5.0, 0.0, 2.0)
    )
    path = follow(dynamic("tumble", [block], gravity=(0, 0, 0), step=step, theta=theta, duration=500 * step))
    check_conserved(path, 1e-11)
    assert np.abs(path.momentum - path.momentum[0]).max() < 1e-13 * np.linalg.norm(path.momentum[0])
    turns = path.rotation[:, 0]
    assert np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12


def test_a_tumbling_stone_follows_eulers_equations():
    """Rates in body axes over ten turns, against Euler's equations integrated to 1e-12; 1e-3 of ‖ω‖ with h ‖ω‖ = 0.009.

    A second-order scheme errs by about (h ‖ω‖)²/12 of the phase, 23 rad: 2e-4.
    """
    inertia, omega = (1.0, 1.7, 2.2), np.array([1.0, -2.0, 0.7])
    path = follow(
        dynamic("tumble", [plate(inertia, (0, 0, 0, *omega))], gravity=(0, 0, 0), step=4e-3, duration=10.0)
    )
    exact = euler(inertia, omega, path.time)
    assert np.abs(body_rates(path) - exact).max() < 1e-3 * np.linalg.norm(omega)


@dataclass(frozen=True)
class TopMoment:
    """The moment -20 a × e₃ of the weight on a top whose axis is a; its support point is its centre here."""

    axis: tuple[float, float, float]
    stones: frozenset[str] = frozenset({"body"})

    def __call__(self, time, centre, rotation):
        axis = rotation @ np.array(self.axis)
        return np.zeros_like(centre), -20.0 * np.cross(axis, [0.0, 0.0, 1.0])


def top(step, duration):
    """Moments 5, 5, 1, spin 50 rad/s about its axis, which leans by 0.05 rad."""
    lean = rotation([1, 0, 0], np.degrees(0.05))
    axis = lean @ np.array([0.0, 0.0, 1.0])
    block = plate((5.0, 5.0, 1.0))
    block = Block(
        "body", block.vertices @ lean.T, block.faces, block.material, velocity=(0, 0, 0, *(50.0 * axis))
    )
    scene = dynamic(
        "top",
        [block],
        gravity=(0, 0, 0),
        step=step,
        duration=duration,
        loads=Loads(forces=(TopMoment(tuple(axis)),)),
    )
    path = follow(scene)
    axes = path.rotation[:, 0] @ axis
    return path, axes, path.kinetic + 20.0 * axes[:, 2]


def test_the_energy_of_a_heavy_top_drifts_by_the_square_of_the_step():
    """R17: moments 5, 5, 1, moment -20 a × e₃, tilt 0.05, ω₀ = 50 rad/s; H₀ = 1269.975; order 1.9 to 2.1 to h = 2 ms.

    Simo & Wong 1991; parameters of Solfec's validation (heavy-symmetrical-top). Flights of more than 0.1 rad go in
    substeps, and drift less.
    """
    steps, drift = np.array([5e-4, 1e-3, 2e-3]), []
    for step in steps:
        path, _, energy = top(step, 1.0)
        assert energy[0] == pytest.approx(1269.975, rel=1e-6)
        drift.append(np.abs(energy - energy[0]).max())
        # the moment has no part along e₃
        assert path.angular_momentum[:, 2] == pytest.approx(path.angular_momentum[0, 2], rel=1e-9)
    order = np.diff(np.log(drift)) / np.diff(np.log(steps))
    assert np.abs(order - 2.0).max() < 0.1


@pytest.mark.slow
def test_the_energy_of_a_heavy_top_stays_for_ten_seconds():
    """R17 in full: h = 1, 3 and 9 ms, T = 10 s: the drift grows no faster than the square of the step."""
    drift = []
    for step in (1e-3, 3e-3, 9e-3):
        _, _, energy = top(step, 10.0)
        drift.append(np.abs(energy - energy[0]).max())
    assert drift[0] < 1e-6
    assert drift[1] < 9 * 1.05 * drift[0]
    assert drift[2] < 81 * drift[0]


def test_a_heavy_top_nods_and_precesses():
    """R17: its axis against the equations of motion integrated to 1e-10; 1 % of the tilt, h = 1 ms, the first 2 s."""
    path, axes, _ = top(1e-3, 2.0)
    moments = np.array([5.0, 5.0, 1.0])
    start = rotation([1, 0, 0], np.degrees(0.05))

    def rate(_, y):
        turn, w = y[:9].reshape(3, 3), y[9:]
        moment = -20.0 * np.cross([0, 0, 1], turn.T @ [0, 0, 1])
        skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([(turn @ skew).ravel(), (moment - np.cross(w, moments * w)) / moments])

    exact = solve_ivp(
        rate, (0, 2), [*start.ravel(), 0, 0, 50.0], t_eval=path.time, rtol=1e-10, atol=1e-12, method="DOP853"
    )
    exact_axes = exact.y[:9].T.reshape(-1, 3, 3)[:, :, 2]
    assert np.abs(axes - exact_axes).max() < 1e-2 * 0.05


def test_a_thrown_stone_tumbles_about_a_parabola():
    """Its centre is where ½ g t² puts it, to 1e-12; energy stays to 1e-11 with θ = ½. Closed form."""
    block = moved(plate((1.0, 1.7, 2.2), (1.0, 2.0, 5.0, 1.0, -2.0, 0.7)), rotation([3, 1, 2], 70))
    path = follow(dynamic("thrown", [block], step=5e-3))
    t = path.time[:, None]
    exact = path.centre[0, 0] + path.velocity[0, 0, :3] * t + 0.5 * np.array([0, 0, -G]) * t**2
    assert np.abs(path.centre[:, 0] - exact).max() < 1e-12
    energy = path.kinetic + path.potential
    assert np.abs(energy - energy[0]).max() < 1e-11 * energy[0]
