"""Gravity that changes, forces on stones, imposed motions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ground.errors import SceneError
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp, TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement, spreading
from mechanics.scene.loads.time_series import History

DOWN = np.array([0.0, 0.0, -9.81])
NORTH = frozenset({"N1"})


def test_a_ramp_takes_gravity_to_its_whole():
    ramp = GravityRamp(2.0)
    for time, part in ((-1.0, 0.0), (0.0, 0.0), (0.5, 0.25), (2.0, 1.0), (9.0, 1.0)):
        np.testing.assert_allclose(ramp(time, DOWN), part * DOWN)
    with pytest.raises(SceneError, match=r"duration = 0\.0; give a number greater than 0 \[s\]"):
        GravityRamp(0.0)


def test_a_table_that_tilts_about_y_makes_stones_slide_along_x():
    """The right end (x > 0) of the table goes down when it turns by a positive angle about y."""
    table = TiltingTable.at_rate_degrees((0.0, 2.0, 0.0), rate=0.1, limit=30.0, start=10.0)
    for time, degrees in ((0.0, 0.0), (10.0, 0.0), (110.0, 10.0), (310.0, 30.0), (999.0, 30.0)):
        angle = np.radians(degrees)
        expected = 9.81 * np.array([np.sin(angle), 0.0, -np.cos(angle)])
        np.testing.assert_allclose(table(time, DOWN), expected, atol=1e-12)
    turned = Rotation.from_euler("y", 10, degrees=True)
    np.testing.assert_allclose(turned.apply(table(110.0, DOWN)), DOWN, atol=1e-12)


@pytest.mark.parametrize("changed", [{"rate": 0.0}, {"limit": -1.0}, {"start": -1.0}])
def test_impossible_tables_are_refused(changed):
    with pytest.raises(SceneError, match=r"tilting table: rate = .* °/s, limit = .* °, start = .* s"):
        TiltingTable.at_rate_degrees((0, 1, 0), **{"rate": 1.0, "limit": 1.0} | changed)


def test_a_table_needs_an_axis_and_one_angle():
    with pytest.raises(SceneError, match="axis"):
        TiltingTable((0.0, 0.0, 0.0), History.constant(0.1))
    with pytest.raises(SceneError, match="one angle a time"):
        TiltingTable((0.0, 1.0, 0.0), History.constant([0.1, 0.2]))


def test_a_force_acts_at_a_point_that_moves_with_the_stone():
    quarter = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    pull = History([0.0, 1.0], [[0.0, 0.0, 0.0], [6.0, 0.0, 0.0]])
    rotation = np.stack([np.eye(3), quarter])
    force, moment = StoneForce(NORTH, pull, arm=(0.0, 2.0, 0.0))(0.5, np.zeros((2, 3)), rotation)
    np.testing.assert_allclose(force, [[3, 0, 0], [3, 0, 0]], atol=1e-15)
    # arm y × force x = -z; after a quarter turn the arm is -x, along the force
    np.testing.assert_allclose(moment, [[0, 0, -6], [0, 0, 0]], atol=1e-14)
    force, moment = StoneForce(NORTH, pull, (0.0, 2.0, 0.0), follows=True)(0.5, np.zeros((2, 3)), rotation)
    np.testing.assert_allclose(force, [[3, 0, 0], [0, 3, 0]], atol=1e-14)
    np.testing.assert_allclose(moment, [[0, 0, -6], [0, 0, -6]], atol=1e-14)


def test_a_force_has_three_components():
    with pytest.raises(SceneError, match="a force of 2 components; give x, y and z"):
        StoneForce(NORTH, History.constant([1.0, 2.0]))


def test_the_place_of_a_motion_is_the_exact_integral_of_its_velocity():
    motion = ImposedMotion(
        NORTH,
        velocity=History([0.0, 2.0], [[0.0, 0.0, 0.0], [0.2, 0.0, -0.4]]),
        spin=History([0.0, 1.0], [0.0, 0.5]),
        axis=(0.0, 3.0, 0.0),
        pivot=(1.0, 2.0, 3.0),
    )
    pose = motion.pose(1.0)
    np.testing.assert_allclose(pose.displacement, [0.05, 0.0, -0.1], rtol=1e-14)  # v̇ t²/2
    np.testing.assert_allclose(pose.rotation, Rotation.from_euler("y", 0.25).as_matrix(), atol=1e-15)
    np.testing.assert_array_equal(pose.pivot, [1, 2, 3])
    start = motion.pose(0.0)
    np.testing.assert_array_equal(start.displacement, np.zeros(3))
    np.testing.assert_array_equal(start.rotation, np.eye(3))


def test_supports_settle_and_spread_by_what_was_asked():
    settled = settlement(["A", "B"], (0.0, 0.01, -0.02), duration=5.0, start=1.0)
    assert settled.stones == {"A", "B"}
    np.testing.assert_allclose(settled.pose(1.0).displacement, np.zeros(3), atol=1e-18)
    np.testing.assert_allclose(settled.pose(3.5).displacement, [0, 0.005, -0.01], rtol=1e-12)
    np.testing.assert_allclose(settled.pose(8.0).displacement, [0, 0.01, -0.02], rtol=1e-12)
    left, right = spreading(["L"], ["R"], (2.0, 0.0, 0.0), distance=0.1, duration=4.0)
    np.testing.assert_allclose(left.pose(4.0).displacement, [-0.05, 0, 0], rtol=1e-12)
    np.testing.assert_allclose(right.pose(4.0).displacement, [0.05, 0, 0], rtol=1e-12)
    with pytest.raises(SceneError, match="spreading: direction has no length"):
        spreading(["L"], ["R"], (0.0, 0.0, 0.0), 0.1, 4.0)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"velocity": History.constant(1.0)}, "without three components"),
        ({"spin": History.constant([1.0, 2.0, 3.0])}, "a spin that is a vector"),
        ({"axis": (0.0, 0.0, 0.0)}, "axis = "),
    ],
)
def test_impossible_motions_are_refused(changed, said):
    with pytest.raises(SceneError, match="motion: ") as caught:
        ImposedMotion(NORTH, **changed)
    assert said in str(caught.value)


def test_loads_say_until_when_they_change():
    """No scene is at its equilibrium before."""
    ramp, table = GravityRamp(2.0), TiltingTable.at_rate_degrees((0, 1, 0), rate=2.0, limit=6.0, start=1.0)
    push = StoneForce(NORTH, History([0.0, 7.0], np.zeros((2, 3))))
    settled = settlement(NORTH, (0.0, 0.0, -1.0), duration=5.0, start=1.0)
    assert [one.until for one in (ramp, table, push, settled)] == [2.0, 4.0, 7.0, 6.0]
    assert Loads((ramp, table), (push,), (settled,)).until == 7.0
    assert Loads().until == 0.0
    assert StoneForce(NORTH, History.constant([1.0, 0.0, 0.0])).until == 0.0
    assert ImposedMotion(NORTH, History.constant([1.0, 0.0, 0.0])).until == np.inf
    assert ImposedMotion(NORTH, spin=History([0.0, 1.0], [0.0, 1.0])).until == np.inf
    assert ImposedMotion(NORTH, spin=History([0.0, 3.0], [1.0, 0.0])).until == 3.0
