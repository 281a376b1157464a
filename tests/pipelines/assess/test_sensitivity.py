"""First-order change of limit loads with friction and depth, against closed forms and differences."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.limit.assembly import assembly
from mechanics.limit.limit_load import limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings
from pipelines.assess.sensitivity import sensitivity
from tests.mechanics.shapes import brick, ground, scene

X = np.array([1.0, 0.0, 0.0])
PUSH = Acceleration((1.0, 0.0, 0.0))


def changes(blocks, friction, outwards=X):
    on = assembly(scene(*blocks, friction=friction))
    return sensitivity(on, PUSH, limit_load(on, PUSH), outwards)


def test_a_stone_that_tips_bears_in_proportion_to_its_depth():
    found = changes([ground(), brick("a", (0, 0, 0), (0.4, 1.0, 1.6))], 0.7)
    assert found.depth == pytest.approx(1.0, rel=1e-5)
    assert found.friction == pytest.approx(0.0, abs=1e-5)


def test_a_stone_that_slides_bears_in_proportion_to_its_friction():
    found = changes([ground(), brick("a", (0, 0, 0), (2.0, 1.0, 0.5))], 0.3)
    assert found.friction == pytest.approx(1.0, rel=1e-5)
    assert found.depth == pytest.approx(0.0, abs=1e-4)


def test_of_a_block_in_mortar_friction_has_the_share_of_what_it_carries():
    """λ W = μ (W + f A) + c A: what friction carries of it is its change."""
    stones = scene(ground(), brick("a", (0, 0, 0), (2.0, 1.0, 0.5)))
    law = MortarJoint(0.3, tension=2e3, shear=5e3)
    on = assembly(replace(stones, contact=ContactSettings(law)))
    limit = limit_load(on, PUSH)
    carried = 0.3 * (on.weight + float(on.strength.tension.sum()))
    assert limit.multiplier * on.weight == pytest.approx(
        carried + float(on.strength.cohesion.sum()), rel=1e-5
    )
    found = sensitivity(on, PUSH, limit, X)
    assert found.friction == pytest.approx(carried / (limit.multiplier * on.weight), rel=1e-4)


def test_a_wall_that_tips_and_slides_at_once_changes_as_differences_say():
    """Two courses of stones in bond, pushed along their length: both, by parts that only the programme knows."""

    def wall(deeper=1.0):
        widths = [(0, 0.5), (0.5, 1.0), (1.0, 1.5)], [(0, 0.25), (0.25, 0.75), (0.75, 1.25), (1.25, 1.5)]
        return [ground()] + [
            brick(f"{row}{k}", (deeper * a, 0, 0.4 * row), (deeper * b, 0.3, 0.4 * row + 0.4))
            for row in range(4)
            for k, (a, b) in enumerate(widths[row % 2])
        ]

    def bound(blocks, friction):
        on = assembly(scene(*blocks, friction=friction))
        return limit_load(on, PUSH).multiplier

    found, step = changes(wall(), 0.5), 1e-3
    by_friction = np.log(bound(wall(), 0.5 * (1 + step)) / bound(wall(), 0.5 * (1 - step))) / (2 * step)
    by_depth = np.log(bound(wall(1 + step), 0.5) / bound(wall(1 - step), 0.5)) / (2 * step)
    assert 0.05 < found.friction < 0.95
    assert found.friction == pytest.approx(by_friction, abs=2e-3)
    assert found.depth == pytest.approx(by_depth, abs=2e-3)


def test_without_a_direction_of_the_depth_only_friction_is_told():
    assert changes([ground(), brick("a", (0, 0, 0), (0.4, 1.0, 1.6))], 0.7, None).depth is None
