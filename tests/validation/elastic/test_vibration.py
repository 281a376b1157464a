"""Vibration of elastic bars: frequencies, the wave after sudden gravity, Rayleigh's damping; closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.elastic_blocks import SOFT, bar, elastic_box, elastic_follow
from tests.validation.scenes import G, box, ground

LENGTH, SIDE = 1.0, 0.0625
SPEED = np.sqrt(SOFT.young / SOFT.density)
# of the column that is held at its foot, and of the free bar
COLUMN, FREE = SPEED / (4 * LENGTH), SPEED / (2 * LENGTH)


def column(material, law, step, duration, side=SIDE, lumped=False):
    half = side / 2
    block = elastic_box("column", [-half, -half, 0.0], [half, half, LENGTH], material, side)
    return Scene(
        "column",
        (ground(half=1.0), block),
        contact=ContactSettings(law),
        time=TimeSettings(step, 0.5, duration, stop_at_equilibrium=False, lumped_mass=lumped),
        solver=SolverSettings(tolerance=1e-8),
    )


@pytest.mark.parametrize("lumped", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_sudden_gravity_doubles_the_stress_of_a_column(lumped):
    """F17: the base bears ρ g c t until t = 2L/c, there 2 ρgL = 39240 Pa, within 2 %; the top sinks by ρgL²/E, 1 %.

    E = 1 GPa, ρ = 2000, L = 1 m, ν = 0, f₁ = 176.777 Hz; θ = ½, no damping, 64 elements, 400 steps a period: in one
    dimension these give 0.996 of the peak, 0.989 with lumped mass; 16 elements and 200 steps 0.980 and 0.973.
    """
    step, side = 1 / COLUMN / 400, LENGTH / 64
    path = elastic_follow(column(SOFT, DryJoint(0.0), step, 1.05 / COLUMN, side, lumped))
    assert pytest.approx(176.777, rel=1e-5) == COLUMN
    assert path.natural_map.max() < 1e-8
    stress = path.support[:, 2] / side**2
    middle = path.time[1:] - step / 2
    exact = SOFT.density * G * SPEED * np.minimum(middle, 1 / COLUMN - middle)
    assert stress.max() == pytest.approx(2 * SOFT.density * G * LENGTH, rel=0.02)
    # mesh and step round the wave's edge and leave ripples behind it; its impulse is that of the closed form
    assert np.abs(stress - exact)[middle < 0.95 / COLUMN].max() < 0.1 * 2 * SOFT.density * G * LENGTH
    assert stress[:200].sum() == pytest.approx(exact[:200].sum(), rel=0.01)
    top = np.isclose(path.node[0, :, 2], LENGTH)
    sunk = path.node[0, top, 2].mean() - path.node[:, top, 2].mean(axis=1)
    assert sunk.max() == pytest.approx(SOFT.density * G * LENGTH**2 / SOFT.young, rel=0.01)
    assert path.time[sunk.argmax()] == pytest.approx(0.5 / COLUMN, rel=0.02)


def _swings(height):
    """Period [s] in samples, and logarithmic decrement, of a decaying swing (n,) about its mean by its peaks."""
    peaks = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    exact, values = [], []
    for k in peaks:
        # the vertex of the parabola through three samples
        a, b, c = height[k - 1 : k + 2]
        shift = 0.5 * (a - c) / (a - 2 * b + c)
        exact.append(k + shift)
        values.append(b - 0.25 * (a - c) * shift)
    return np.array(exact), np.array(values)


@pytest.mark.parametrize("element", [Element.HEX8, pytest.param(Element.TET10, marks=pytest.mark.slow)])
@pytest.mark.parametrize("lumped", [False, True])
def test_a_free_bar_swings_at_its_frequency(element, lumped):
    """f = c/2L = 353.6 Hz of the free bar with ν = 0; 0.5 % with 16 elements and 200 steps a period. Energy stays.

    The θ-scheme with θ = ½ lengthens the period by (2π/200)²/12 = 0.008 %.
    """
    step = 1 / FREE / 200
    path = swinging(SOFT, step, 4.0 / FREE, element, lumped)
    instants, heights = _swings(amplitude(path))
    assert np.diff(instants).mean() * step == pytest.approx(1 / FREE, rel=5e-3)
    assert heights[-1] == pytest.approx(heights[0], rel=1e-3)


def swinging(material, step, duration, element=Element.HEX8, lumped=False):
    """A free bar whose first axial mode is set going: v_x = V sin(πx/L)."""
    scene = Scene(
        "bar",
        (bar(LENGTH, SIDE, material, SIDE, element),),
        gravity=(0.0, 0.0, 0.0),
        time=TimeSettings(step, 0.5, duration, stop_at_equilibrium=False, lumped_mass=lumped),
    )

    def start(_, state):
        velocity = np.zeros_like(state.node)
        velocity[:, 0] = 1e-3 * np.sin(np.pi * state.node[:, 0] / LENGTH)
        return replace(state, node_velocity=velocity)

    return elastic_follow(scene, start=start)


def amplitude(path):
    """Lengthening of the bar (n,) [m]."""
    x = path.node[:, :, 0]
    ends = [np.isclose(x[0], side * LENGTH / 2) for side in (1, -1)]
    return x[:, ends[0]].mean(axis=1) - x[:, ends[1]].mean(axis=1) - LENGTH


@pytest.mark.parametrize(("of_mass", "of_stiffness"), [(0.05, 0.0), (0.0, 0.05), (0.02, 0.03), (0.0, 0.3)])
def test_rayleigh_damping_takes_its_share_of_each_swing(of_mass, of_stiffness):
    """Swings decay by exp(-2πζ/√(1 - ζ²)) with ζ = α/2ω + βω/2; ζ within 1 %, 200 steps a period."""
    omega = 2 * np.pi * FREE
    material = replace(SOFT, mass_damping=2 * omega * of_mass, stiffness_damping=2 * of_stiffness / omega)
    path = swinging(material, 1 / FREE / 200, 3.5 / FREE)
    _, heights = _swings(amplitude(path))
    decrement = np.log(heights[0] / heights[-1]) / (len(heights) - 1)
    assert len(heights) >= 3
    found = decrement / np.hypot(2 * np.pi, decrement)
    assert found == pytest.approx(of_mass + of_stiffness, rel=0.01)


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_mass_damping_brakes_the_stone_as_a_whole(theta):
    """v = v₀ exp(-αt) + (g/α)(1 - exp(-αt)), and a slow spin goes as exp(-αt): 1e-3 with αh = 1e-3; θ = ½: 1e-5."""
    alpha, step, duration = 2.0, 5e-4, 0.5
    material = Material("stone", 2000.0, 1e10, 0.2, mass_damping=alpha)
    block = elastic_box(
        "block", [-0.2, -0.15, -0.1], [0.2, 0.15, 0.1], material, 0.1, velocity=(3.0, 0, 0, 0, 0, 1e-3)
    )
    time = TimeSettings(step, theta, duration, stop_at_equilibrium=False)
    path = elastic_follow(Scene("fall", (block,), time=time))
    left = np.exp(-alpha * path.time)
    mass = 2000.0 * 0.4 * 0.3 * 0.2
    exact = mass * np.column_stack([3.0 * left, 0 * left, -G / alpha * (1 - left)])
    tolerance = 1e-5 if theta == 0.5 else 1e-3
    assert np.abs(path.momentum - exact).max() < tolerance * 3.0 * mass
    centre = path.node.mean(axis=1)
    spin = path.angular_momentum - np.cross(centre, path.momentum)
    assert spin[:, 2] == pytest.approx(spin[0, 2] * left, rel=2 * tolerance)


def test_a_damped_column_comes_to_rest_by_itself():
    """Sudden gravity, bonded foot, θ = ½, ζ = 0.1 by stiffness damping: peaks of the base stress within 3 %.

    The first mode has 8/π² of its swing about ρgL, and peaks at heights exp(-ζωt) of that, a damped period apart;
    the higher ones, damped ∝ ω, have gone by the second peak.
    """
    omega, part = 2 * np.pi * COLUMN, 0.1
    material = replace(SOFT, stiffness_damping=2 * part / omega)
    step = 1 / COLUMN / 200
    scene = column(material, MortarJoint(0.0, 1e5, 1e5), step, 3 / COLUMN)
    stress = elastic_follow(scene).support[:, 2] / SIDE**2 / (SOFT.density * G * LENGTH)
    instants, heights = _swings(stress - 1.0)
    assert np.diff(instants).mean() * step == pytest.approx(1 / COLUMN / np.sqrt(1 - part**2), rel=0.01)
    ratio = np.exp(-2 * np.pi * part / np.sqrt(1 - part**2))
    assert heights[1] / heights[0] == pytest.approx(ratio, rel=0.03)
    decay = np.exp(-part * omega * instants[1] * step)
    assert heights[1] == pytest.approx(8 / np.pi**2 * decay, rel=0.03)


@pytest.mark.slow
def test_a_rigid_load_on_a_light_column_swings_at_its_frequency():
    """A rigid block of mass m on a column of stiffness k = EA/L, bonded: f = √(k/(m + m_c/3))/2π, 1 % (Rayleigh)."""
    light = Material("light", density=20.0, young=1e7, poisson=0.0)
    heavy = Material("heavy", density=20000.0, young=1e10, poisson=0.2)
    half = SIDE / 2
    blocks = (
        ground(half=1.0),
        elastic_box("column", [-half, -half, 0.0], [half, half, 0.25], light, SIDE),
        box("load", [-half, -half, 0.25], [half, half, 0.25 + SIDE], heavy),
    )
    area = SIDE**2
    mass, own = heavy.density * area * SIDE, light.density * area * 0.25
    omega = np.sqrt(light.young * area / 0.25 / (mass + own / 3))
    step = 2 * np.pi / omega / 200
    scene = Scene(
        "swing",
        blocks,
        contact=ContactSettings(MortarJoint(0.5, 1e6, 1e6)),
        time=TimeSettings(step, 0.5, 3.2 * 2 * np.pi / omega, stop_at_equilibrium=False),
        solver=SolverSettings(tolerance=1e-9),
        frame_every=1,
    )
    result = simulate(scene)
    height = np.array([frame.positions[2][:, 2].mean() for frame in result.frames])
    instants, _ = _swings(height)
    assert np.diff(instants).mean() * step == pytest.approx(2 * np.pi / omega, rel=0.01)
