"""A block on a tilted plane: when it slides, how fast, and when it topples. Closed forms."""

import numpy as np
import pytest
from scenes import G, box, ground, tilted_gravity

from mechanics.laws.dry_joint import DryJoint
from mechanics.result import Outcome
from mechanics.scene import ContactSettings, Method, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate


def incline(block, degrees, friction, *, theta=0.5, duration=1.0, step=2e-3):
    return simulate(
        Scene(
            "incline",
            (ground(), block),
            gravity=tilted_gravity(degrees),
            contact=ContactSettings(DryJoint(friction)),
            time=TimeSettings(step, theta, duration, stop_at_equilibrium=False),
            solver=SolverSettings(Method.NSGS, tolerance=1e-9, max_iterations=5000),
        )
    )


def low_block():
    return box("block", [-0.5, -0.5, 0.0], [0.5, 0.5, 0.5])


def downhill(result):
    return float(result.bodies[1].displacement[:, 0].mean())


@pytest.mark.parametrize("friction", [0.3, 0.5, 0.65, 0.7])
@pytest.mark.parametrize("excess", [-1e-3, 1e-3])
def test_a_block_slides_as_soon_as_the_slope_exceeds_friction(friction, excess):
    # sticks if tan α < μ, slides with a = g (sin α - μ cos α) if tan α > μ; told apart at 1e-3 in tan α
    angle = np.arctan(friction * (1 + excess))
    result = incline(low_block(), np.degrees(angle), friction, duration=0.5)
    speed = float(result.history.speed[-1])
    acceleration = G * (np.sin(angle) - friction * np.cos(angle))
    if excess < 0:
        assert speed < 1e-6
        assert result.outcome is Outcome.EQUILIBRIUM
    else:
        assert speed == pytest.approx(acceleration * 0.5, rel=1e-2)


@pytest.mark.parametrize(("degrees", "friction"), [(30.0, 0.3), (20.0, 0.3), (40.0, 0.5)])
@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_sliding_block_accelerates_as_coulomb_says(degrees, friction, theta):
    # v and x after 1 s; the scheme's own offset of x is (θ - ½) h v
    step = 2e-3
    result = incline(low_block(), degrees, friction, theta=theta, step=step)
    angle = np.radians(degrees)
    acceleration = G * (np.sin(angle) - friction * np.cos(angle))
    assert result.history.speed[-1] == pytest.approx(acceleration, rel=1e-3)
    assert downhill(result) == pytest.approx(acceleration / 2 + (theta - 0.5) * step * acceleration, rel=1e-4)
    assert result.errors.energy < 1e-9


@pytest.mark.parametrize("width", [0.2, 0.4])
def test_a_slender_block_topples_before_it_slides(width):
    # tan α = b/h < μ = 0.7: it stands half a degree below, and turns over its edge half a degree above
    limit = np.degrees(np.arctan(width / 1.0))
    stands = incline(box("block", [0, 0, 0], [width, 0.5, 1.0]), limit - 0.5, 0.7, duration=0.5)
    falls = incline(box("block", [0, 0, 0], [width, 0.5, 1.0]), limit + 0.5, 0.7, duration=0.5)
    assert stands.outcome is Outcome.EQUILIBRIUM
    assert stands.history.speed[-1] < 1e-6
    assert falls.history.speed[-1] > 0.02
    # the uphill edge lifts, the downhill edge stays where it is
    uphill, downhill_edge = falls.bodies[1].displacement[0], falls.bodies[1].displacement[1]
    assert uphill[2] > 1e-3
    assert np.linalg.norm(downhill_edge) < 1e-3 * abs(uphill[2]) + 1e-5
