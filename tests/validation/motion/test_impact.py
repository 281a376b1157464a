"""Collisions: Newton's restitution, momentum, and energy that no collision makes. Closed forms and principles."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from mechanics.scene.scene import Block
from mechanics.stones.materials import Material
from tests.validation.scenes import G, box, dynamic, follow, ground, moved, rotation

WEIGHTLESS = (0.0, 0.0, 0.0)


def cube(mass, side, low, velocity=(0.0,) * 6):
    low = np.asarray(low, dtype=float)
    return box("cube", low, low + side, Material("test", mass / side**3, 1e9, 0.2), velocity=velocity)


def test_a_bouncing_cube_comes_to_rest():
    """I02 for a cube: free flight to 1e-12, bounces that lose 1 - e², and m g h as the impulse of each step at rest.

    Siconos' BouncingBallTS: height 1 m, m = 1 kg, e = 0.9, θ = 1/2, h = 5 ms, 10 s: q(0.005) = 0.999877375,
    q(0.4) = 0.2152, 0.04905 N s per step at rest, to 1e-10. The bounces depend on the rule of activation: a step late
    at most, so a peak's height is compared within 2 h v. A cube that gravity would turn back within a step is held
    where it is: its energy may rise by m (g h)²/8, and by nothing else.
    """
    step = 5e-3
    path = follow(
        dynamic(
            "ball",
            (ground(), cube(1.0, 0.2, [-0.1, -0.1, 0.9])),
            friction=0.0,
            restitution=0.9,
            step=step,
            duration=10,
        )
    )
    q = path.centre[:, 1, 2]
    assert q[1] == pytest.approx(0.999877375, abs=1e-12)
    assert path.velocity[1, 1, 2] == pytest.approx(-0.04905, abs=1e-12)
    assert q[80] == pytest.approx(0.2152, abs=1e-12)
    assert path.support[-50:, 2] * step == pytest.approx([0.04905] * 50, abs=1e-10)
    assert np.abs(path.velocity[-50:]).max() < 1e-10
    peaks = q[1:-1][(q[1:-1] > q[:-2]) & (q[1:-1] >= q[2:])] - 0.1
    fall, speed = 0.9, np.sqrt(2 * G * 0.9)
    for k, peak in enumerate(peaks[:5]):
        late = sum(2 * step * speed * 0.9**i for i in range(k + 1))
        assert abs(peak - fall * 0.81 ** (k + 1)) < late
    energy = path.kinetic + path.potential
    assert np.diff(energy).max() < (G * step) ** 2 / 8 + 1e-12 * energy[0]


@pytest.mark.parametrize("restitution", [0.0, 0.4, 1.0])
@pytest.mark.parametrize(("first", "second"), [(1.0, 1.0), (1.0, 1e3), (1e3, 1.0), (1.0, 1e6)])
def test_two_cubes_meet_head_on(restitution, first, second):
    """v₁' = (m₁v₁ + m₂v₂ + m₂ e (v₂ - v₁))/(m₁ + m₂), and the same for 2; 1e-10 m/s. Newton, closed form."""
    v1, v2 = 1.0, -0.5
    one = replace(cube(first, 0.2, [0, 0, 0], (v1, 0, 0, 0, 0, 0)), code="one")
    two = replace(cube(second, 0.3, [0.25, -0.05, -0.05], (v2, 0, 0, 0, 0, 0)), code="two")
    path = follow(
        dynamic(
            "meet",
            (one, two),
            restitution=restitution,
            friction=0.0,
            gravity=WEIGHTLESS,
            duration=0.1,
            tolerance=1e-13,
        )
    )
    total, mean = first + second, first * v1 + second * v2
    assert path.velocity[-1, 0, 0] == pytest.approx(
        (mean + second * restitution * (v2 - v1)) / total, abs=1e-10
    )
    assert path.velocity[-1, 1, 0] == pytest.approx(
        (mean + first * restitution * (v1 - v2)) / total, abs=1e-10
    )


def falling_on_a_corner(friction, restitution, step=1e-4):
    """A brick without weight that meets the ground with one corner."""
    tilted = moved(box("brick", [-0.1, -0.15, -0.05], [0.1, 0.15, 0.05]), rotation([1.0, 0.4, 0.2], 35))
    raised = moved(tilted, shift=(0, 0, 0.01 - tilted.vertices[:, 2].min()))
    brick = replace(raised, velocity=(0.6, -0.3, -2.0, 1.0, 0.5, -0.7))
    scene = dynamic(
        "corner",
        (ground(), brick),
        friction=friction,
        restitution=restitution,
        gravity=WEIGHTLESS,
        step=step,
        duration=0.008,
        tolerance=1e-13,
    )
    return follow(scene)


@pytest.mark.parametrize(
    ("friction", "restitution"), [(0.0, 0.0), (0.0, 0.6), (0.0, 1.0), (10.0, 0.0), (10.0, 0.5)]
)
def test_a_brick_that_falls_on_a_corner_leaves_as_newton_and_coulomb_say(friction, restitution):
    """Impulse W⁻¹ of the wanted change of velocity of the corner, eccentric, sticking or smooth; closed form.

    It is compared 1e-3 of the speed: the arms turn by h ‖ω‖ = 1.3e-4 from step to step.
    """
    path = falling_on_a_corner(friction, restitution)
    hit = int(np.abs(np.diff(path.velocity[:, 1, 2])).argmax())
    before = path.velocity[hit, 1]
    if restitution == 0:
        # an inelastic corner may land in two steps: g/(hθ) first, then a full stop
        before = path.velocity[hit - 1, 1]
    corner = path.corners(1)[hit]
    arm = corner[corner[:, 2].argmin()] - path.centre[hit, 1]
    turn = path.rotation[hit, 1]
    inertia = turn @ path.model.inertia.inertia[1] @ turn.T
    cross = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
    delassus = np.eye(3) / path.model.mass[1] - cross @ np.linalg.inv(inertia) @ cross
    u = before[:3] + np.cross(before[3:], arm)
    if friction == 0:
        impulse = np.array([0, 0, -(1 + restitution) * u[2] / delassus[2, 2]])
    else:
        impulse = np.linalg.solve(delassus, [-u[0], -u[1], -(1 + restitution) * u[2]])
        assert np.linalg.norm(impulse[:2]) < friction * impulse[2]
    after = path.velocity[hit + 2, 1]
    exact = before + np.concatenate(
        [impulse / path.model.mass[1], np.linalg.solve(inertia, np.cross(arm, impulse))]
    )
    assert np.abs(after[:3] - exact[:3]).max() < 1e-3 * 2.0
    assert np.abs(after[3:] - exact[3:]).max() < 1e-3 * np.linalg.norm(exact[3:]) + 5e-3


@pytest.mark.parametrize("theta", [0.5, 0.505, 0.51, 0.55, 0.6, 1.0])
def test_a_falling_stone_loses_what_the_scheme_takes(theta):
    """I06 for a rigid stone: a step takes (θ - ½) m (g h)² of its energy, nothing with θ = ½; 1e-9 of that of a step.

    ΔE = m h g (v₀ + v₁)/2 - m g h (θ v₁ + (1 - θ) v₀) with v₁ = v₀ + g h. Closed form; there is no spring between rigid
    stones, whose period the case asks for.
    """
    step = 0.01
    path = follow(dynamic("fall", [cube(2.0, 0.2, [0, 0, 0])], theta=theta, step=step, duration=0.5))
    lost = -np.diff(path.kinetic + path.potential)
    assert lost == pytest.approx(
        np.full(50, (theta - 0.5) * 2.0 * (G * step) ** 2), abs=1e-9 * 2.0 * (G * step) ** 2
    )


def swarm(count=3):
    """A grid of turned bricks that fly at one another and spin."""
    random = np.random.default_rng(7)
    blocks = []
    for i, j, k in product(range(count), repeat=3):
        size = random.uniform(0.12, 0.3, 3)
        place = 0.45 * (np.array([i, j, k]) - (count - 1) / 2)
        velocity = -2.0 * place + random.uniform(-0.5, 0.5, 3)
        spin = random.uniform(-3, 3, 3)
        material = Material("test", float(random.uniform(500, 3000)), 1e9, 0.2)
        brick = moved(
            box("b", -size / 2, size / 2), rotation(random.normal(size=3), random.uniform(0, 180)), place
        )
        blocks.append(
            Block(f"b{i}{j}{k}", brick.vertices, brick.faces, material, velocity=(*velocity, *spin))
        )
    return blocks


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
@pytest.mark.parametrize(("friction", "restitution"), [(0.0, 0.0), (0.5, 0.0), (0.5, 0.7)])
def test_a_swarm_keeps_its_momentum(theta, friction, restitution):
    """I04: 27 bricks collide; linear and angular momentum stay to 1e-12 of Σ‖m v‖ and of Σ‖L‖. Principle."""
    path = follow(
        dynamic(
            "swarm",
            swarm(),
            friction=friction,
            restitution=restitution,
            gravity=WEIGHTLESS,
            theta=theta,
            step=2e-3,
            duration=0.4,
            tolerance=1e-8,
        )
    )
    mass = path.model.mass
    linear = float(mass @ np.linalg.norm(path.velocity[0, :, :3], axis=1))
    angular = np.cross(path.centre[0], mass[:, None] * path.velocity[0, :, :3]) + path.spin[0]
    assert np.abs(path.momentum - path.momentum[0]).max() < 1e-12 * linear
    assert (
        np.abs(path.angular_momentum - path.angular_momentum[0]).max()
        < 1e-12 * np.linalg.norm(angular, axis=1).sum()
    )
    # they did collide
    assert path.kinetic[-1] < 0.9 * path.kinetic[0]


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
@pytest.mark.parametrize("friction", [0.0, 0.5, 10.0])
@pytest.mark.parametrize("gravity", [WEIGHTLESS, (0.0, 0.0, -G)])
def test_inelastic_collisions_make_no_energy(theta, friction, gravity):
    """With e = 0 and θ ≥ 1/2 no step ends with more energy than it began, to 1e-10 of the whole. Principle.

    But for what the curvature of the paths of held points lets in (`bend`), which is seen where bricks roll on the
    ground, and the solver's tolerance, 1e-10.
    """
    base = [] if gravity == WEIGHTLESS else [moved(ground(), shift=(0, 0, -1.0))]
    path = follow(
        dynamic(
            "swarm",
            [*base, *swarm(2)],
            friction=friction,
            gravity=gravity,
            theta=theta,
            step=2e-3,
            duration=0.4,
        )
    )
    assert path.made.max() < 1e-10 * (path.kinetic[0] + np.ptp(path.potential))
    assert path.kinetic[-1] < path.kinetic[0] or gravity != WEIGHTLESS
