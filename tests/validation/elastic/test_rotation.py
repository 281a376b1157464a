"""Elastic stones that turn: no stress from rigid motion, the stress of a fast spin, momentum and energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechanics.scene.scene import Scene, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.elastic_blocks import ELEMENTS, bar, elastic_box, elastic_follow

YOUNG = 1e10
STONE = Material("stone", density=2000.0, young=YOUNG, poisson=0.2)
SIDES = np.array([0.4, 0.3, 0.2])
# 90° in 100 steps, so slowly that the centrifugal stress ρω²L²/8 stays below 1e-17 E
STEP, STEPS = 1000.0, 100
TURN = np.pi / 2 / (STEP * STEPS)


def spinning(omega, element=Element.HEX8, theta=0.5, step=STEP, steps=STEPS, speed=(0.0, 0.0, 0.0)):
    block = elastic_box("block", -SIDES / 2, SIDES / 2, STONE, 0.1, element, (*speed, *omega))
    time = TimeSettings(step, theta, steps * step, stop_at_equilibrium=False)
    return Scene("spin", (block,), gravity=(0.0, 0.0, 0.0), time=time)


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize("element", ELEMENTS)
def test_a_block_turned_by_a_right_angle_is_free_of_stress(element, theta):
    """Von Mises below 1e-6 of E·1e-6 after 90° in 100 steps, about z. Principle: a rigid motion strains nothing."""
    result = simulate(spinning((0, 0, TURN), element, theta))
    (body,) = result.bodies
    assert body.von_mises.max() < 1e-12 * YOUNG
    # it has really turned: x to y, y to -x
    exact = body.reference[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    assert np.abs(body.position - exact).max() < 1e-6 * SIDES.max()


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_tumbling_block_is_free_of_stress_and_keeps_its_momentum(theta):
    """About no principal axis, as Euler's equations of the rigid block say: places within 1e-3 of its length.

    Von Mises below 1e-12 E; angular momentum and kinetic energy stay within 1e-9.
    """
    omega = TURN * np.array([0.5, 0.7, -0.4])
    scene = spinning(omega, theta=theta)
    path = elastic_follow(scene)
    spin, energy = path.angular_momentum, path.kinetic
    assert np.abs(spin - spin[0]).max() < 1e-9 * np.linalg.norm(spin[0])
    assert np.abs(energy - energy[0]).max() < 1e-9 * energy[0]
    result = simulate(scene)
    assert result.bodies[0].von_mises.max() < 1e-12 * YOUNG
    turn = _euler(omega, STEP * STEPS)
    assert np.abs(path.node[-1] - path.node[0] @ turn.T).max() < 1e-3 * SIDES.max()


def _euler(omega, duration):
    """Rotation (3, 3) of the rigid block after `duration`, 1e-12."""
    moments = np.array(
        [SIDES[1] ** 2 + SIDES[2] ** 2, SIDES[0] ** 2 + SIDES[2] ** 2, SIDES[0] ** 2 + SIDES[1] ** 2]
    )
    scale = np.linalg.norm(omega)

    def rate(_, y):
        turn, w = y[:9].reshape(3, 3), y[9:]
        skew = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([(turn @ skew).ravel(), -np.cross(w, moments * w) / moments])

    start = [*np.eye(3).ravel(), *(np.asarray(omega) / scale)]
    done = solve_ivp(rate, (0, duration * scale), start, rtol=1e-12, atol=1e-14, method="DOP853")
    return done.y[:9, -1].reshape(3, 3)


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_flying_block_is_free_of_stress(theta):
    """Gravity and a throw put no stress into a block: weight is the same everywhere. Von Mises below 1e-12 E.

    It turns by 0.1 mrad, with a centrifugal stress of 1e-8 Pa, and falls by ½ g t².
    """
    time = TimeSettings(1e-3, theta, 0.1, stop_at_equilibrium=False)
    block = elastic_box(
        "block", -SIDES / 2, SIDES / 2, STONE, 0.1, Element.HEX8, (3.0, 0, 1.0, 5e-4, 1e-3, 5e-4)
    )
    result = simulate(Scene("throw", (block,), time=time))
    assert result.bodies[0].von_mises.max() < 1e-12 * YOUNG
    # the θ-scheme falls by ½ g t² + (θ - ½) g h t
    fallen = 0.5 * 9.81 * 0.1**2 + (theta - 0.5) * 9.81 * 1e-3 * 0.1
    centre = result.bodies[0].displacement.mean(axis=0)
    assert centre == pytest.approx([0.3, 0.0, 0.1 - fallen], abs=1e-9)


LENGTH, SIDE, RATE = 1.0, 0.1, 20.0
# damping of the first axial mode, f = c/2L = 354 Hz, of one half: its swing after the sudden start dies within 20 ms
STEEP = Material("bar", density=2000.0, young=1e9, poisson=0.0, stiffness_damping=4.5e-4)


@pytest.mark.parametrize(
    "element", [Element.HEX8, Element.TET10, pytest.param(Element.HEX20, marks=pytest.mark.slow)]
)
def test_a_spinning_bar_bears_the_centrifugal_stress(element):
    """σ_xx = ρω²(L²/4 - x²)/2 along a bar that spins at 20 rad/s about z; 2 % of its largest, 100 kPa. Closed form.

    Angular momentum stays within 2ε of itself, by which the inertia changes: small strain leaves that out.
    """
    size = 0.05 if element is Element.HEX8 else 0.1
    block = bar(LENGTH, SIDE, STEEP, size, element, (0, 0, 0, 0, 0, RATE))
    time = TimeSettings(1e-4, 0.5, 0.03, stop_at_equilibrium=False)
    scene = Scene("bar", (block,), gravity=(0.0, 0.0, 0.0), time=time)
    path, result = elastic_follow(scene), simulate(scene)
    spin = path.angular_momentum[:, 2]
    strain = STEEP.density * RATE**2 * LENGTH**2 / (8 * STEEP.young)
    assert np.abs(spin / spin[0] - 1).max() < 2 * strain
    (body,) = result.bodies
    x, y, _ = body.reference.T
    largest = STEEP.density * RATE**2 * LENGTH**2 / 8
    exact = STEEP.density * RATE**2 * (LENGTH**2 / 4 - x**2) / 2
    # in axes of the bar, which has turned
    end = body.position[np.isclose(x, LENGTH / 2)].mean(axis=0)
    along = end / np.linalg.norm(end)
    xx, yy, zz, xy, yz, zx = body.stress.T
    tensor = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    axial = np.einsum("i,ijn,j->n", along, tensor, along)
    nodes = (np.abs(x) < 0.45 * LENGTH) & ~np.isnan(y)
    assert np.abs(axial - exact)[nodes].max() < 0.02 * largest


def test_a_spin_with_vibration_keeps_energy_and_momentum():
    """θ = ½, no damping: one turn of a bar that swings by twice its centrifugal strain, ε = 1e-4.

    Angular momentum and energy change by 2·2ε at most, as small strain leaves out what the swing does to the inertia;
    the momentum's mean over many swings and its direction stay, within 1e-2 ε.
    """
    material = Material("bar", density=2000.0, young=1e9, poisson=0.2)
    block = bar(LENGTH, SIDE, material, 0.1, Element.HEX8, (0, 0, 0, 1.0, 2.0, RATE))
    time = TimeSettings(2e-4, 0.5, 0.2, stop_at_equilibrium=False)
    scene = Scene("bar", (block,), gravity=(0.0, 0.0, 0.0), time=time)
    spin = elastic_follow(scene).angular_momentum / (material.density * LENGTH**3 * SIDE**2 * RATE / 12)
    strain = material.density * RATE**2 * LENGTH**2 / (8 * material.young)
    size = np.linalg.norm(spin, axis=1)
    assert np.abs(size / size[0] - 1).max() < 4 * strain
    early, late = size[1:501].mean(), size[-500:].mean()
    assert late == pytest.approx(early, rel=1e-2 * strain)
    assert np.abs(spin / size[:, None] - spin[0] / size[0]).max() < 1e-2 * strain
    assert simulate(scene).errors.energy < 4 * strain
