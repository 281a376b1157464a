"""Directions of pushes: those of the façades, and the weakest."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.limit.assembly import Strength, assembly
from mechanics.limit.dead_load import at_instant, stands
from mechanics.limit.live_loads import levers
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import settlement
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Scene
from mechanics.scene.shapes import bond, box, drum, prism, wall
from pipelines.assess.directions import facade_pushes, push, weakest_push
from tests.mechanics.shapes import brick, ground, moved, scene

RING = [(np.cos(one), np.sin(one)) for one in np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)]


def turned(blocks, degrees):
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return tuple(moved(block, turn) for block in blocks)


def test_pushes_are_square_to_a_wall_and_along_it_however_it_stands():
    stones = wall(bond(4, 4), 0.4, 0.2, 0.2)
    assert [one.name for one in facade_pushes(stones)] == [
        f"horizontal {way}" for way in ("x", "-x", "y", "-y")
    ]
    ways = facade_pushes(turned(stones, 28.0))
    assert [one.name for one in ways] == [f"horizontal {angle}" for angle in (28, 208, 118, 298)]
    np.testing.assert_allclose(ways[0].live.direction, [np.cos(np.radians(28)), np.sin(np.radians(28)), 0])


def test_walls_that_meet_askew_have_pushes_of_their_own():
    stones = wall(bond(4, 4), 0.4, 0.2, 0.2)
    both = (*stones, *(replace(one, code=f"t{one.code}") for one in turned(stones, 30.0)))
    assert len(facade_pushes(both)) == 8


def test_the_ground_is_no_facade():
    """A footing that stands askew below the wall is not pushed."""
    stones = turned(wall(bond(4, 4), 0.4, 0.2, 0.2), 28.0)
    footing = ground((-3.0, -3.0, -1.0), (6.0, 6.0, 0.0))
    assert facade_pushes((footing, *stones)) == facade_pushes(stones)


def test_a_round_tower_is_pushed_along_the_axes():
    stones = [drum("d", RING, RING, (0.0, 0.5))]
    assert [one.name for one in facade_pushes(stones)][:2] == ["horizontal x", "horizontal -x"]


def test_the_weakest_push_of_a_wall_is_square_to_it():
    stones = turned(wall(bond(3, 5), 0.4, 0.2, 0.2), 28.0)
    found = weakest_push(assembly(Scene("wall", stones)))
    angle = float(found.name.split()[1])
    assert min(abs(angle - 118), abs(angle - 298)) < 6
    assert found.name.endswith("(weakest)")


def test_the_weakest_push_has_a_sense():
    """A stone whose weight lies near its back tips backwards first."""
    leaning = prism("leaning", [(0.0, 0.0), (0.6, 0.0), (0.1, 2.0), (0.0, 2.0)], 1.0)
    found = weakest_push(assembly(scene(ground(), leaning)))
    assert found.name == "horizontal -x (weakest)"


def test_an_angle_near_an_axis_is_named_by_it():
    assert push(359.7).name == "horizontal x"
    assert push(90.0).live.direction == (0.0, 1.0, 0.0)


def test_loads_that_grow_are_taken_in_the_end_or_at_an_instant():
    growing = StoneForce(
        frozenset({"a"}), History(np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [8e3, 0, 0]]))
    )
    one = replace(scene(ground(), brick("a", (0, 0, 0), (1, 0.5, 1))), loads=Loads(forces=(growing,)))
    # friction 0.6 of 9.8 kN
    assert not stands(assembly(at_instant(one))).outcome.rests
    assert stands(assembly(at_instant(one, 0.5))).outcome.rests


def test_supports_that_have_moved_are_refused_by_name():
    one = scene(ground(), brick("a", (0, 0, 0), (1, 0.5, 1)))
    one = replace(one, loads=Loads(motions=(settlement(["ground"], (0, 0, -0.01), 0.5),)))
    with pytest.raises(SceneError, match="the supports ground have moved"):
        at_instant(one)
    assert at_instant(one, 0.0).loads == Loads()


def test_stones_that_hang_loose_are_named():
    loose = box("loose", (1.0, 0.0, 0.5), (1.3, 0.3, 0.8))
    found = stands(
        assembly(scene(ground(), brick("a", (0, 0, 0), (1, 0.5, 1)), loose, step=5e-3, duration=0.5))
    )
    assert not found.outcome.rests
    assert found.moved == ("loose",)


def test_gravity_is_taken_at_the_instant_and_loads_have_their_moments():
    table = TiltingTable((0.0, 1.0, 0.0), History(np.array([0.0, 1.0]), np.array([0.0, 0.2])))
    pull = StoneForce(frozenset({"a"}), History.constant((100.0, 0, 0)), (0.0, 0.0, 0.3))
    one = replace(
        scene(ground(), brick("a", (0, 0, 0), (1, 0.5, 1))), loads=Loads(gravity=(table,), forces=(pull,))
    )
    there = at_instant(one)
    assert np.linalg.norm(there.gravity) == pytest.approx(np.linalg.norm(one.gravity))
    assert abs(there.gravity[0] / there.gravity[2]) == pytest.approx(np.tan(0.2), rel=1e-6)
    assert assembly(there).dead[3:] == pytest.approx([0.0, 30.0, 0.0], abs=1e-9)


def test_the_shear_strength_is_cohesion_and_friction_of_compression_and_tension():
    strength = Strength(np.array([0.5]), np.array([3.0]), np.array([2.0]))
    assert strength.shear(np.array([[10.0, 0.0, 0.0]])) == pytest.approx([9.0])


def test_a_lever_is_where_a_force_has_its_moment():
    """A force along x at (0, 0.2, 0.3): r × F = (0, 0.3 F, -0.2 F)."""
    rows, force, place = levers(np.array([[0.0] * 6, [5.0, 0.0, 0.0, 0.0, 1.5, -1.0]]))
    assert rows.tolist() == [1]
    assert force.tolist() == [[5.0, 0.0, 0.0]]
    assert place == pytest.approx(np.array([[0.0, 0.2, 0.3]]))
