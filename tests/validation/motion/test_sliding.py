"""Sliding blocks: when they slide, how fast, how far and in which direction. Closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Block, Method
from mechanics.simulate import simulate
from tests.validation.scenes import STONE, G, box, dynamic, follow, ground, moved, rotation, tilted_gravity

# R01: tan θ_c = μ
THRESHOLDS = [(0.3, 16.69924), (0.5, 26.56505), (0.65, 33.02387), (0.7, 34.99202)]


def low_block(velocity=(0.0,) * 6):
    """So low that it does not topple."""
    return box("block", [-0.5, -0.5, 0.0], [0.5, 0.5, 0.5], velocity=velocity)


def incline(degrees, friction, **settings):
    settings = {"step": 5e-3, "tolerance": 1e-9, **settings}
    return dynamic(
        "incline", (ground(), low_block()), gravity=tilted_gravity(degrees), friction=friction, **settings
    )


@pytest.mark.parametrize(("friction", "threshold"), THRESHOLDS)
@pytest.mark.parametrize("excess", [-0.5, -0.03, 0.03, 0.5])
def test_a_block_slides_as_soon_as_the_slope_exceeds_friction(friction, threshold, excess):
    """R01: it sticks below θ_c (|v| < 1e-6 m/s after 1 s), and slides above with g (sin θ - μ cos θ), within 2 %.

    Closed form. Asked half a degree from the threshold, and much nearer: 0.03° is 10⁻³ in tan θ.
    """
    angle = np.radians(threshold + excess)
    result = simulate(incline(threshold + excess, friction))
    speed = float(result.history.speed[-1])
    if excess < 0:
        assert speed < 1e-6
        assert result.outcome is Outcome.EQUILIBRIUM
    else:
        assert speed == pytest.approx(G * (np.sin(angle) - friction * np.cos(angle)), rel=2e-2)


@pytest.mark.parametrize(
    ("degrees", "friction", "acceleration"), [(30.0, 0.3, 2.356287), (20.0, 0.3, 0.589702)]
)
@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_a_sliding_block_accelerates_as_coulomb_says(degrees, friction, acceleration, theta):
    """R02: v and x after 1 s within 1e-4, but for the offset (θ - ½) h v of the θ-scheme. Closed form."""
    step = 4e-3
    result = simulate(incline(degrees, friction, theta=theta, step=step))
    offset = (theta - 0.5) * step * acceleration
    assert result.history.speed[-1] == pytest.approx(acceleration, rel=1e-4)
    downhill = float(result.bodies[1].displacement[:, 0].mean())
    assert downhill == pytest.approx(acceleration / 2 + offset, rel=1e-4)
    assert result.errors.energy < 1e-9


def test_friction_brings_a_block_to_a_full_stop():
    """R03: from 3 m/s with μ = 0.4 it stops after 0.764526 s and 1.146789 m, and stays. 1e-3 or a step; closed form."""
    step = 1e-3
    path = follow(dynamic("stop", (ground(), low_block((3.0, *[0.0] * 5))), friction=0.4, step=step))
    speed = np.linalg.norm(path.velocity[:, 1], axis=1)
    assert path.time[speed < 1e-9][0] == pytest.approx(0.764526, abs=step)
    assert path.centre[-1, 1, 0] == pytest.approx(1.146789, rel=1e-3)
    assert path.centre[-1, 1, 1] == pytest.approx(0.0, abs=1e-9)
    assert speed[path.time > 0.764526 + step].max() < 1e-9


def test_a_spinning_block_is_stopped_by_its_four_corners():
    """R08: ω₀ = 10 rad/s, μ = 0.3: it stops after 0.283158 s and 1.415789 rad. 2 %; t = ω₀ r/(3 μ g), closed form."""
    block = box("block", [-0.2, -0.15, 0.0], [0.2, 0.15, 0.1], velocity=(0, 0, 0, 0, 0, 10.0))
    path = follow(dynamic("spin", (ground(), block), friction=0.3, duration=0.35))
    spin = path.velocity[:, 1, 5]
    turn = np.unwrap(np.arctan2(path.rotation[:, 1, 1, 0], path.rotation[:, 1, 0, 0]))
    assert path.time[np.abs(spin) < 1e-6][0] == pytest.approx(0.283158, rel=2e-2)
    assert turn[-1] == pytest.approx(1.415789, rel=2e-2)
    assert np.abs(path.centre[-1, 1, :2]).max() < 0.02 * 0.2


def test_friction_is_the_same_in_all_directions():
    """R09: from 3 m/s with μ = 0.4 it slides 1.146789 m whatever the direction; spread below 0.1 %. Closed form.

    A pyramid with four facets in place of Coulomb's cone differs by up to 41 %.
    """
    distance = []
    for degrees in (0, 15, 30, 45, 60, 75, 90):
        angle = np.radians(degrees)
        velocity = (3 * np.cos(angle), 3 * np.sin(angle), 0.0, 0.0, 0.0, 0.0)
        path = follow(
            dynamic("isotropy", (ground(), low_block(velocity)), friction=0.4, step=4e-3, duration=0.8)
        )
        way = path.centre[-1, 1, :2] - path.centre[0, 1, :2]
        assert np.degrees(np.arctan2(way[1], way[0])) == pytest.approx(degrees, abs=0.02)
        distance.append(np.linalg.norm(way))
    assert np.ptp(distance) < 1e-3 * 1.146789
    assert distance == pytest.approx([1.146789] * 7, rel=1e-3)


def test_a_block_pushed_across_a_slope_comes_to_rest_on_it():
    """R11: 20°, μ = 0.5, 2 m/s across: rests after 0.92294 s, 0.500176 m across and 0.335953 m down. 1 %.

    The equation v' = g sin θ e_x - μ g cos θ v/‖v‖ is integrated here once more.
    """
    slope, friction = np.radians(20), 0.5

    def slide(_, state):
        v = state[2:]
        pull = np.array([G * np.sin(slope), 0.0]) - friction * G * np.cos(slope) * v / np.linalg.norm(v)
        return [*v, *pull]

    def stops(_, state):
        return np.linalg.norm(state[2:]) - 1e-6

    stops.terminal = True
    exact = solve_ivp(slide, (0, 2), [0, 0, 0, 2.0], rtol=1e-10, atol=1e-12, events=stops)
    assert [exact.t[-1], *exact.y[1::-1, -1]] == pytest.approx([0.92294, 0.500176, 0.335953], rel=1e-4)

    block = low_block((0.0, 2.0, 0.0, 0.0, 0.0, 0.0))
    path = follow(dynamic("across", (ground(), block), gravity=tilted_gravity(20), friction=friction))
    speed = np.linalg.norm(path.velocity[:, 1], axis=1)
    assert path.time[speed < 1e-9][0] == pytest.approx(exact.t[-1], rel=1e-2)
    downhill, across = path.centre[-1, 1, :2]
    assert across == pytest.approx(exact.y[1, -1], rel=1e-2)
    assert downhill == pytest.approx(exact.y[0, -1], rel=1e-2)
    # it does not turn on the way
    assert np.abs(path.rotation[-1, 1] - np.eye(3)).max() < 1e-6


@pytest.mark.parametrize("width", [0.2, 0.4])
def test_a_slender_block_topples_before_it_slides(width):
    """tan θ = b/h < μ = 0.7: it stands 0.5° below, and turns over its edge 0.5° above. Closed form."""
    limit = np.degrees(np.arctan(width / 1.0))
    block = box("block", [0, 0, 0], [width, 0.5, 1.0])
    stands, falls = (
        simulate(
            dynamic(
                "topple",
                (ground(), block),
                gravity=tilted_gravity(limit + d),
                friction=0.7,
                step=2e-3,
                duration=0.5,
                tolerance=1e-9,
            )
        )
        for d in (-0.5, 0.5)
    )
    assert stands.outcome is Outcome.EQUILIBRIUM
    assert stands.history.speed[-1] < 1e-6
    assert falls.history.speed[-1] > 0.02
    # the uphill edge lifts, the downhill edge stays where it is
    uphill, downhill_edge = falls.bodies[1].displacement[0], falls.bodies[1].displacement[1]
    assert uphill[2] > 1e-3
    assert np.linalg.norm(downhill_edge) < 1e-3 * abs(uphill[2]) + 1e-5


# R19: a slender rod, leaning, slides on its lower tip; the tip leads and friction turns it into the ground
LEAN, LONG, THICK = 63.435, 1.0, 0.02


def rod(speed):
    """A square rod that stands on one corner, its tip in the origin; its centre lies towards +x."""
    half = THICK / 2
    upright = moved(box("rod", [-half, -half, 0.0], [half, half, LONG]), rotation([0, 0, 1], 45))
    block = moved(upright, rotation([0, 1, 0], 90 - LEAN))
    tip = block.vertices[block.vertices[:, 2].argmin()]
    return Block("rod", block.vertices - tip, block.faces, STONE, velocity=(speed, 0, 0, 0, 0, 0))


def painleve(friction, **settings):
    return follow(
        dynamic(
            "rod",
            (ground(), rod(-3.0)),
            friction=friction,
            method=Method.AUTO,
            max_iterations=10000,
            **settings,
        )
    )


def tip_terms(path):
    """The centre seen from the tip (x, z) [m], and the squared radius of gyration [m²]."""
    x, _, z = path.centre[0, 1]
    return x, z, (LONG**2 + THICK**2) / 12


@pytest.mark.parametrize("friction", [0.2, 0.6, 1.0, 1.25])
def test_a_sliding_rod_feels_the_normal_force_that_friction_makes_of_its_weight(friction):
    """R19: below μ_P = 4/3, N = m g/(1 + x (x - μ z)/k²), the centre at (x, z) from the tip. 1e-3; closed form."""
    path = painleve(friction, step=1e-5, duration=1e-5)
    x, z, gyration = tip_terms(path)
    normal = path.model.mass[1] * G / (1 + x * (x - friction * z) / gyration)
    assert path.support[0, 2] == pytest.approx(normal, rel=1e-3)
    assert path.support[0, 0] == pytest.approx(friction * normal, rel=1e-3)


@pytest.mark.parametrize("friction", [1.4, 2.0, 10.0])
def test_beyond_painleve_the_rod_jams_in_an_impact_without_collision(friction):
    """R19: beyond μ_P no finite force exists; the tip stops at once and the rod turns about it. 1e-3; closed form.

    μ_P(θ) = (1 + 3 cos² θ)/(3 sin θ cos θ) is least, 4/3, at 63.435° (Génot & Brogliato 1999). The momentum about
    the tip stays: ω = v z/(k² + x² + z²).
    """
    path = painleve(friction, step=1e-5, duration=1e-5)
    x, z, gyration = tip_terms(path)
    spin = -3.0 * z / (gyration + x**2 + z**2)
    assert path.velocity[1, 1, 4] == pytest.approx(spin, rel=1e-3)
    assert path.velocity[1, 1, [0, 2]] == pytest.approx([spin * z, -spin * x], rel=1e-3)


@pytest.mark.parametrize("friction", [1.2, 4 / 3, 1.4, 2.0, 10.0])
def test_the_painleve_rod_does_not_blow_up(friction):
    """R19: through jam, vault and fall every number stays finite, and the tip goes nowhere under the ground. Principle.

    Energy falls, but for what the curvature of the tip's path lets in (`bend` of the path).
    """
    path = painleve(friction, step=1e-3, duration=0.6)
    assert np.isfinite(path.velocity).all()
    assert path.natural_map.max() <= 1e-9
    assert path.made.max() < 1e-9 * path.kinetic[0]
    assert path.gap.min() > -1e-6 * LONG
    # it has fallen, and lies still
    assert path.corners(1)[-1][:, 2].max() < 2 * THICK
