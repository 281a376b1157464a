"""Invariance of joint closing: in any order, at any place, and when repeated."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from survey.joints.close import ClosedStones, close_joints
from survey.simplify.simplify import BlockyStone
from tests.survey.plain_blocks import as_stone, bond, moved


def as_it_was(closed: ClosedStones) -> list[BlockyStone]:
    """Return the closed stones as if they had been simplified to that."""
    return [replace(one, solid=solid) for one, solid in zip(closed.simplified, closed.solids, strict=True)]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.002))
def test_closing_closed_stones_changes_nothing(seed: int, noise: float) -> None:
    closed = close_joints([as_stone(solid) for solid in bond(3, 3, 0.01, noise, seed)])
    assert closed.report.gaps == ()
    again = close_joints(as_it_was(closed))
    for one, two in zip(closed.solids, again.solids, strict=True):
        assert two.faces == one.faces
        np.testing.assert_allclose(two.vertices, one.vertices, rtol=0.0, atol=1e-12)
    assert again.report.gaps == again.report.overlaps == ()
    assert max(abs(one.width) for one in again.report.joints) < 1e-12


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.randoms(use_true_random=False))
def test_the_order_of_the_stones_does_not_matter(seed, random) -> None:
    stones = [as_stone(solid) for solid in bond(3, 3, 0.01, 0.002, seed)]
    other = stones.copy()
    random.shuffle(other)
    here = close_joints(stones)
    there = {solid.code: solid for solid in close_joints(other).solids}
    for one in here.solids:
        assert there[one.code].faces == one.faces
        np.testing.assert_allclose(there[one.code].vertices, one.vertices, rtol=0.0, atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    turned=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    shift=st.tuples(*[st.floats(-100.0, 100.0)] * 3),
)
def test_stones_close_alike_wherever_the_building_stands(seed, turned, shift) -> None:
    solids, observer = bond(3, 3, 0.01, 0.002, seed), np.array([0.9, -9.0, 0.4])
    turn = Rotation.from_rotvec(turned).as_matrix()
    here = close_joints([as_stone(solid, observer) for solid in solids])
    there = close_joints([as_stone(moved(one, turn, shift), turn @ observer + shift) for one in solids])
    for one, two in zip(here.solids, there.solids, strict=True):
        assert two.faces == one.faces
        np.testing.assert_allclose(two.vertices, one.vertices @ turn.T + shift, rtol=0.0, atol=1e-10)


def test_stones_close_as_well_far_from_the_origin_of_a_grid() -> None:
    far = np.array([4.1e5, 7.02e6, 312.0])
    solids, observer = bond(4, 4, 0.01, 0.002, 3), np.array([0.9, -9.0, 0.4])
    here = close_joints([as_stone(solid, observer) for solid in solids])
    there = close_joints([as_stone(moved(one, np.eye(3), far), observer + far) for one in solids])
    for one, two in zip(here.solids, there.solids, strict=True):
        # a double at 7·10⁶ m is good to 10⁻⁹ m
        np.testing.assert_allclose(two.vertices - far, one.vertices, rtol=0.0, atol=1e-8)
    for one, two in zip(here.report.joints, there.report.joints, strict=True):
        assert two.stones == one.stones
        assert two.area == pytest.approx(one.area, abs=1e-7)
        assert two.width == pytest.approx(one.width, abs=1e-7)
