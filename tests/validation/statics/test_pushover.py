"""Capacity curves by the dynamics: closed forms, published walls, and loads that no stone follows."""

import numpy as np
import pytest

from benchmarks.limit import WALLS
from ground.errors import SolverError
from mechanics.limit.assembly import assembly
from mechanics.limit.kinematic import kinematics
from mechanics.limit.limit_load import Flow, limit_load
from mechanics.limit.live_loads import Acceleration, PointForce
from mechanics.limit.pushover import Pushover, pushover
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Scene
from tests.validation.masonry import cuboid
from tests.validation.scenes import G, ground
from tests.validation.statics.test_limit_loads import ALONG, standing

WIDE, HIGH = 0.3, 3.0


def led(blocks, live=ALONG, **options):
    on = standing(blocks)
    found = limit_load(on, live, Flow.COULOMB, limit_load(on, live))
    return on, found, pushover(on, live, found, **options)


def turned(way):
    """Turn of the wall whose centre has gone so far along the load."""
    slope, radius = np.arctan(WIDE / HIGH), np.hypot(WIDE, HIGH) / 2
    return slope, slope - np.arcsin(np.sin(slope) - way / radius)


def wall():
    return (ground(), cuboid("wall", (0, 0, 0), (WIDE, 1, HIGH)))


def test_a_wall_that_tips_follows_its_closed_form():
    """λ = tan(α - θ), to 1 % of its beginning; none is borne once the centre stands over the edge."""
    on, found, curve = led(wall(), reach=WIDE / 2)
    slope, turn = turned(curve.displacement)
    assert curve.calm[1:].all()
    np.testing.assert_allclose(curve.multiplier[1:], np.tan(slope - turn)[1:], atol=1e-3)
    assert curve.peak == pytest.approx(0.1, rel=0.035)  # the stone gathers speed in the first interval
    assert curve.onset == pytest.approx(0.1, rel=0.03)
    assert curve.falls_to(0.0) == pytest.approx(WIDE / 2, rel=5e-3)
    assert curve.falls_to(0.05) == pytest.approx(WIDE / 4, rel=0.02)
    assert curve.ended == "no load is borne any more"
    assert curve.unsolved == 0
    # of a single block the code's d* is the way of its centre
    oscillator = kinematics(on, ALONG, found)
    same = np.interp(curve.displacement, oscillator.displacement, oscillator.multipliers)
    borne = curve.multiplier > 0.0
    borne[0] = False
    np.testing.assert_allclose(curve.multiplier[borne], same[borne], atol=1e-3)


def test_a_force_at_a_point_follows_its_closed_form():
    """A push of 1 kN at the top: F = W (b cos θ - h sin θ)/2 over the lever h cos θ + b sin θ of its place."""
    _, _, curve = led(wall(), PointForce("wall", (1e3, 0, 0), (0.0, 0.5, HIGH)), reach=WIDE / 2)
    _, turn = turned(curve.displacement)
    weight = 2000.0 * WIDE * HIGH * G / 1e3
    lever = HIGH * np.cos(turn) + WIDE * np.sin(turn)
    expected = weight * (WIDE * np.cos(turn) - HIGH * np.sin(turn)) / 2 / lever
    np.testing.assert_allclose(curve.multiplier[1:], expected[1:], atol=0.01 * expected[0])


def test_loads_that_grow_with_time_stay_as_they_are_at_the_start():
    later = StoneForce(
        frozenset({"wall"}), History(np.array([0.0, 0.01]), np.array([[0.0, 0, 0], [1e6, 0, 0]]))
    )
    scene = Scene("later", wall(), contact=ContactSettings(DryJoint(0.65)), loads=Loads(forces=(later,)))
    on = assembly(scene)
    curve = pushover(on, ALONG, limit_load(on, ALONG), reach=WIDE / 2, points=10)
    assert curve.onset == pytest.approx(0.1, rel=0.03)


@pytest.mark.slow
def test_a_published_wall_bears_its_limit_load_and_less_from_then_on():
    wall_03 = WALLS["W03"]
    _, found, curve = led(wall_03.blocks(), reach=0.1, points=25)
    assert 0.97 * wall_03.candidate < curve.peak < 1.01 * wall_03.bound
    assert curve.peak == pytest.approx(found.multiplier, rel=0.02)
    calm = curve.multiplier[curve.calm]
    assert calm[-1] < 0.9 * calm[0]
    assert np.abs(curve.inertia[2:]).max() < 1e-3


def test_intervals_in_which_stones_hit_one_another_do_not_count():
    values, inertia = np.array([0.5, 0.4, 4.0, 0.2, 0.1]), np.array([0.0, 0.0, -3.6, 0.0, 0.0])
    ways = np.arange(5.0)
    curve = Pushover("a", np.eye(3)[0], ways, values, inertia, 0.5, 0.5, "", 1, 0)
    assert curve.calm.tolist() == [True, True, False, True, True]
    assert curve.peak == 0.5
    assert curve.falls_to(0.3) == pytest.approx(2.0)
    assert curve.falls_to(0.0) == np.inf


def test_a_load_that_no_mechanism_follows_is_refused():
    on = standing(wall())
    down = Acceleration((0.0, 0.0, -1.0))
    with pytest.raises(SolverError, match="no mechanism moves along the load"):
        pushover(on, down, limit_load(on, down))


def test_it_can_be_stopped():
    seen = []
    _, _, curve = led(wall(), reach=WIDE / 2, progress=seen.append, stop=lambda: len(seen) >= 3)
    assert curve.ended == "stopped"
    assert len(curve.displacement) == 3
