"""Horizontal thrust of the semicircular arch: any state lies between two bounds, and moving supports drive it to
them.

Contact points: sharp corners. Thrust is what the springers push with, over the weight of the whole arch.
"""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import spreading
from mechanics.scene.scene import ContactSettings, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from tests.validation.masonry import semicircular_arch
from tests.validation.statics.limit_analysis import thrust_bounds
from tests.validation.statics.verdict import hold, report, stands

COUNT, FRICTION = 27, 1.0
# t/R, smallest and largest H/W
BOUNDS = [
    (0.11, 0.19587, 0.20037),
    (0.12, 0.19059, 0.20747),
    (0.15, 0.17557, 0.22737),
    (0.2, 0.15341, 0.25497),
    (0.25, 0.13456, 0.2776),
]
SOME = [pytest.param(*c, marks=() if c[0] == 0.15 else pytest.mark.slow) for c in BOUNDS]


def thrust(result, springer):
    """Horizontal force of a springer on the arch, towards its middle, over the weight of the arch."""
    contacts, codes = result.contacts, [b.code for b in result.bodies]
    at = codes.index(springer)
    sign = (contacts.bodies[:, 1] == at).astype(float) - (contacts.bodies[:, 0] == at)
    inwards = 1.0 if springer == "left" else -1.0
    return inwards * float(sign @ contacts.force[:, 0]) / result.weight


@pytest.mark.parametrize(("thickness", "low", "high"), BOUNDS)
def test_limit_analysis_finds_the_bounds(thickness, low, high):
    """A05: to the digits given (own linear program); both lie below the friction cap μ/2."""
    found = thrust_bounds(semicircular_arch(COUNT, thickness), FRICTION)
    assert found == pytest.approx((low, high), abs=1e-5)
    assert high < FRICTION / 2


@pytest.mark.parametrize(("thickness", "low", "high"), BOUNDS)
def test_the_thrust_of_an_arch_as_built_lies_between_the_bounds(thickness, low, high):
    """A05: any state lies inside, within 1 %."""
    result = hold(semicircular_arch(COUNT, thickness), FRICTION)
    assert stands(result), report(result)
    left, right = thrust(result, "left"), thrust(result, "right")
    assert left == pytest.approx(right, rel=1e-3)
    assert 0.99 * low < left < 1.01 * high


def moved(thickness, distance):
    """The arch after its springers have slowly parted by `distance`, or closed if that is negative."""
    arch = semicircular_arch(COUNT, thickness)
    return simulate(
        Scene(
            "moved",
            arch,
            contact=ContactSettings(DryJoint(FRICTION)),
            time=TimeSettings(step=5e-3, theta=1.0, duration=3.0),
            solver=SolverSettings(tolerance=1e-6, velocity_tolerance=1e-5, max_iterations=5000),
            loads=Loads(motions=spreading({"left"}, {"right"}, (1.0, 0.0, 0.0), distance, 1.0)),
        )
    )


@pytest.mark.parametrize(("thickness", "low", "high"), SOME)
@pytest.mark.parametrize("closing", [False, True])
def test_moving_supports_drive_the_thrust_to_a_bound(thickness, low, high, closing):
    """A05: parting springers make the thrust smallest, closing ones make it largest, within 1 %.

    They move by 2·10⁻⁴ of the span between the hinges' middle lines, so the geometry stays what it was.
    """
    result = moved(thickness, -4e-4 if closing else 4e-4)
    assert result.outcome is Outcome.EQUILIBRIUM, report(result)
    expected = high if closing else low
    for springer in ("left", "right"):
        assert thrust(result, springer) == pytest.approx(expected, rel=1e-2)
    # three hinges at least have opened
    assert np.ptp(result.contacts.gap) > 1e-5
