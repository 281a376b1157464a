"""Stones that move as one, and where the second beginning of a candidate may end, from numbers that a test gives."""

from types import SimpleNamespace

import numpy as np
import pytest

from mechanics.limit import limit_load as limit_module
from mechanics.limit.assembly import assembly
from mechanics.limit.kinematic import _blocks
from mechanics.limit.limit_load import Flow, limit_load
from mechanics.limit.live_loads import Acceleration
from tests.mechanics.shapes import brick, ground, scene


def blocks(velocity, speed=(0.0, 1.0, 1.0)):
    """Return the blocks of three stones, the ground and two at x = 0 and 1 m whose sizes are 2 m."""
    on = SimpleNamespace(
        state=SimpleNamespace(centre=np.array([[0.0, 0, -1], [0, 0, 0], [1, 0, 0]])),
        model=SimpleNamespace(
            fixed=np.array([True, False, False]),
            mass=np.ones(3),
            surfaces=SimpleNamespace(size=np.full(3, 2.0)),
        ),
        contacts=SimpleNamespace(bodies=np.array([[1, 0], [2, 0], [1, 2]])),
    )
    motion = SimpleNamespace(velocity=np.array(velocity, dtype=float), speed=np.array(speed, dtype=float))
    return _blocks(on, motion).tolist()


STILL = (0.0,) * 6


@pytest.mark.parametrize(
    ("second", "expected"),
    [
        ((0, 0, 1.0, 0, -1.0, 0), [-1, 0, 0]),  # as the first carries it: ω × 1 m along x
        ((0, 0, 1.0, 0, 0, 0), [-1, 0, 1]),  # its centre alone
        ((0, 0, 1.0, 0, -1.00075, 0), [-1, 0, 0]),  # its corner 0.75 mm/s off
        ((0, 0, 1.0, 0, -1.00125, 0), [-1, 0, 1]),  # its corner 1.25 mm/s off
        ((0, 0, 1.0015, 0, -1.0, 0), [-1, 0, 1]),
    ],
)
def test_stones_are_one_block_where_all_of_one_moves_as_the_other(second, expected):
    assert blocks([STILL, (0, 0, 0, 0, -1.0, 0), second]) == expected


def test_stones_that_stand_are_none():
    assert blocks([STILL, STILL, (0, 0, 1.0, 0, 0, 0)], (0.0, 0.0, 1.0)) == [-1, -1, 0]


@pytest.mark.parametrize("converged", [True, False])
def test_the_second_beginning_ends_at_a_load_that_the_first_came_to(converged, monkeypatch):
    on = assembly(scene(ground(), brick("block", (0, 0, 0), (0.4, 0.4, 1.0)), friction=0.7))
    asked, iterated = [], limit_module._iterated

    def watched(on, programme, begin, far, known=None):
        asked.append(known)
        ending = iterated(on, programme, begin, far, known)
        return limit_module.replace(ending, converged=converged)

    monkeypatch.setattr(limit_module, "_iterated", watched)
    found = limit_load(on, Acceleration((1.0, 0.0, 0.0)), Flow.COULOMB)
    assert found.multiplier == pytest.approx(0.4, rel=1e-2)
    assert asked == [None, pytest.approx(0.4, rel=1e-2) if converged else None]
