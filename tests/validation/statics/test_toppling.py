"""A single block on a tilted table: does it topple or slide, and at which angle? tan θ = min(μ, b/h), closed form."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.gravity import TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from tests.validation.masonry import cuboid
from tests.validation.statics.verdict import ALONG, DOWN, TOLERANCE, G, falls, hold, report, stands

FRICTION = 0.7
# width, height, angle, whether it topples
BLOCKS = [(0.2, 1.0, 11.30993, True), (0.4, 1.0, 21.80141, True), (1.0, 1.0, 34.99202, False)]


def scene(width, height):
    table = cuboid("table", (-3.0, -1.0, -1.0), (3.0, 1.0, 0.0), Fidelity.FIXED)
    return table, cuboid("block", (0.0, -0.2, 0.0), (width, 0.2, height))


@pytest.mark.parametrize(("width", "height", "angle", "topples"), BLOCKS)
def test_a_block_holds_below_its_angle_and_goes_above(width, height, angle, topples):
    """R04: within 0.2°, and in the right way."""
    assert np.tan(np.radians(angle)) == pytest.approx(min(FRICTION, width / height), rel=1e-6)
    low, high = (
        hold(scene(width, height), FRICTION, np.tan(np.radians(angle + turn))) for turn in (-0.2, 0.2)
    )
    assert stands(low), report(low)
    assert falls(high), report(high)
    # the edge behind rises if it topples; else all corners move alike, along the table
    rise = np.ptp(high.bodies[1].displacement[:, 2])
    slip = high.bodies[1].displacement[:, 0].min()
    assert (rise > 1e-3 and abs(slip) < 1e-3) if topples else (rise < 1e-6 and slip > 0.01)


@pytest.mark.parametrize(("width", "height", "angle", "topples"), BLOCKS)
def test_a_block_goes_at_its_angle_on_a_table_that_turns_slowly(width, height, angle, topples):
    """R04: within 0.2° at 0.1° a second, from half a degree below; gravity turns instead of the table."""
    start, rate = angle - 0.5, 0.1
    tilt = np.tan(np.radians(start))
    down = (np.array(DOWN) + tilt * np.array(ALONG)) / np.hypot(1.0, tilt)
    result = simulate(
        Scene(
            "table",
            scene(width, height),
            gravity=tuple(G * down),
            contact=ContactSettings(DryJoint(FRICTION)),
            time=TimeSettings(step=1e-2, theta=1.0, duration=10.0, collapse_displacement=0.05),
            solver=SolverSettings(tolerance=TOLERANCE),
            loads=Loads(gravity=(TiltingTable.at_rate_degrees((0.0, 1.0, 0.0), rate, 1.0),)),
        )
    )
    assert result.errors.unconverged_steps == 0
    assert result.outcome is Outcome.COLLAPSED
    # it goes when it is faster than a millimetre a second, which it then stays; until then it has not moved
    moves = result.history.speed > 1e-3
    first = int(np.argmax(moves))
    assert moves[first:].all()
    assert start + rate * result.history.time[first] == pytest.approx(angle, abs=0.2)
    assert result.history.speed[result.history.time < (angle - start) / rate - 0.05].max() < 1e-5
