"""Disks that roll and slide. Closed forms."""

import numpy as np
import pytest

from mechanics.scene.laws.dry_joint import DryJoint
from tests.validation.planar.scenes import G, ball, run, start, steps_of


def slope(degrees):
    angle = np.radians(degrees)
    return (G * float(np.sin(angle)), -G * float(np.cos(angle)))


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_disk_rolls_down_an_incline_with_two_thirds_of_g_sin(theta):
    """Case R06: 20°, a = 2/3 g sin α = 2.236812 m/s²; tolerance 0.5 %, here that of rounding."""
    result = run([ball()], gravity=slope(20.0), theta=theta)
    vx, vy, spin = result.velocity[0]
    assert vx == pytest.approx(2.236812, rel=1e-6)
    assert spin == pytest.approx(-vx / 0.1, rel=1e-9)
    assert abs(vy) < 1e-12
    # x = a t²/2, and the scheme's own offset (θ - 1/2) h v
    assert result.position[0, 0] == pytest.approx(2.236812 / 2 + (theta - 0.5) * 1e-3 * 2.236812, rel=1e-6)


@pytest.mark.parametrize("degrees", [20.0])
@pytest.mark.parametrize("excess", [-1e-4, 1e-4])
def test_a_disk_rolls_without_sliding_from_a_third_of_the_slope(degrees, excess):
    """Case R06: μ_min = tan(20°)/3 = 0.121323; told apart at 10⁻⁴, and below it a = g (sin α - μ cos α)."""
    limit, angle = 0.121323, np.radians(degrees)
    assert limit == pytest.approx(np.tan(angle) / 3, rel=1e-5)
    friction = float(np.tan(angle) / 3 * (1 + excess))
    result = run([ball()], gravity=slope(degrees), law=DryJoint(friction))
    vx, _, spin = result.velocity[0]
    slip = vx + 0.1 * spin
    if excess > 0:
        assert abs(slip) < 1e-12
        assert result.contacts.status.tolist() == ["stick"]
    else:
        # a = g (sin - μ cos), R ω' = 2 g μ cos
        assert slip == pytest.approx(G * (np.sin(angle) - 3 * friction * np.cos(angle)), rel=1e-6)
        assert result.contacts.status.tolist() == ["slip"]


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_sliding_disk_begins_to_roll(theta):
    """Case R07: v0 = 2 m/s, μ = 0.2: rolls from t = v0/(3 μ g) = 0.339789 s on, with v = 2 v0/3, at x = 0.566316 m;
    tolerance 0.5 % or one step."""
    step = 1e-4
    simulation = start([ball(velocity=(2.0, 0.0, 0.0))], law=DryJoint(0.2), step=step, theta=theta)
    for _ in range(4000):
        last = simulation.step().after
        if abs(last.velocity[0, 0] + 0.1 * last.velocity[0, 2]) < 1e-12:
            break
    assert last.time == pytest.approx(0.339789, abs=step)
    assert last.velocity[0, 0] == pytest.approx(1.333333, rel=1e-6)
    assert last.centre[0, 0] == pytest.approx(0.566316, abs=2 * step)
    # and goes on so
    after = steps_of(simulation, 500)[-1].after
    np.testing.assert_allclose(after.velocity[0], [4 / 3, 0.0, -40 / 3], atol=1e-9)


def test_a_disk_that_cannot_turn_slides_down_an_incline_as_a_block_does():
    """A block on a slope: a = g (sin α - μ cos α), and rest below tan α = μ; a disk that rolls comes down at once."""
    angle, friction = np.radians(20.0), 0.2
    result = run([ball()], gravity=slope(20.0), law=DryJoint(friction), rolling=False)
    assert result.velocity[0, 0] == pytest.approx(G * (np.sin(angle) - friction * np.cos(angle)), rel=1e-6)
    assert abs(result.velocity[0, 2]) < 1e-6
    assert result.errors.energy < 1e-9
    # its moment of inertia is 10⁹ times that of a disk: it rolls with 2·10⁻⁹ g sin α
    assert abs(run([ball()], gravity=slope(20.0), law=DryJoint(0.4), rolling=False).velocity[0, 0]) < 1e-8
