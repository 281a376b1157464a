"""Limit of stones that slide in a trough without friction across the line of sliding: limit equilibrium of wedges."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.limit.assembly import assembly
from mechanics.limit.held import held_limit
from mechanics.limit.limit_load import (
    Flow,
    limit_load,
    lines_of_sliding,
    mechanism,
    slides_along_one_line,
    without_friction_across,
)
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import prism
from tests.mechanics.shapes import brick, ground, scene
from tests.validation.one_answer.scenes import (
    FLAT_AND_STEEP,
    least_angle,
    limit_along_the_line,
    wedge_on_two_planes,
)

ALONG = Acceleration((0.0, 1.0, 0.0))
FRICTION = 0.4


def trough(*dips):
    """Return a wedge in a level trough along y between planes of two dips [°]: 4 m long, .2 m high over its edge."""
    left, right = np.tan(np.radians(dips))
    a, b, top = -0.2 / left, 0.2 / right, 0.2
    wedge = prism("wedge", [(a, top), (0.0, 0.0), (b, top)], 4.0)
    far, low = 0.02, -0.5
    banks = [
        prism(
            "left",
            [(a - far, top + far * left), (a - far, low), (0.0, low), (0.0, 0.0)],
            4.0,
            fidelity=Fidelity.FIXED,
        ),
        prism(
            "right",
            [(b + far, top + far * right), (0.0, 0.0), (0.0, low), (b + far, low)],
            4.0,
            fidelity=Fidelity.FIXED,
        ),
    ]
    return assembly(scene(*banks, wedge, friction=FRICTION))


@pytest.mark.parametrize("dips", [(35.0, 85.0), (45.0, 45.0), (30.0, 60.0)])
def test_a_wedge_slides_at_the_load_of_limit_equilibrium(dips):
    """N₁ sin α = N₂ sin β and N₁ cos α + N₂ cos β = W: λ = μ (sin α + sin β)/sin(α + β)."""
    on = trough(*dips)
    bound = limit_load(on, ALONG)
    found = without_friction_across(on, ALONG, limit_load(on, ALONG, Flow.COULOMB, bound))
    alpha, beta = np.radians(dips)
    expected = FRICTION * (np.sin(alpha) + np.sin(beta)) / np.sin(alpha + beta)
    assert found is not None
    assert found.multiplier == pytest.approx(expected, rel=2e-3)
    assert bound.multiplier > 1.03 * expected


@pytest.mark.parametrize(
    "planes",
    [
        FLAT_AND_STEEP,
        *(
            pytest.param(one, marks=pytest.mark.slow)
            for one in (((40, 130), (60, 220)), ((50, 100), (65, 200)))
        ),
    ],
)
def test_a_plunging_wedge_slides_at_the_load_of_limit_equilibrium(planes):
    """Friction across the line of sliding bears more, by the rule of runs, and is left out of this limit."""
    share = 0.06
    expected, along = limit_along_the_line(planes, least_angle(planes) * (1 + share))
    on, live = assembly(wedge_on_two_planes(share, True, planes=planes)), Acceleration(tuple(along))
    bound = limit_load(on, live)
    held = held_limit(on, live, bound)
    limit = replace(
        bound, flow=Flow.COULOMB, multiplier=held.held, force=held.force, mechanism=held.mechanism
    )
    found = without_friction_across(on, live, limit)
    assert found.multiplier == pytest.approx(expected, rel=2e-3)
    assert held.held > 1.01 * expected


def test_a_steep_wedge_that_limit_equilibrium_lets_slide_is_held_by_friction_across_its_line():
    """Planes of 35 and 85° hold at 32°, where limit equilibrium without friction across asks for 32.69°."""
    assert least_angle(FLAT_AND_STEEP) == pytest.approx(32.69, abs=5e-3)
    share = 32.0 / 32.69 - 1.0
    on = assembly(wedge_on_two_planes(share, tetrahedron=True, planes=FLAT_AND_STEEP))
    live = Acceleration(tuple(limit_along_the_line(FLAT_AND_STEEP, 32.0)[1]))
    bound = limit_load(on, live)
    held = held_limit(on, live, bound)
    assert held.held > 0.0
    limit = replace(
        bound, flow=Flow.COULOMB, multiplier=held.held, force=held.force, mechanism=held.mechanism
    )
    assert np.isnan(without_friction_across(on, live, limit).multiplier)


def test_a_block_on_one_plane_has_no_friction_across_its_way():
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.2)), friction=FRICTION))
    found = without_friction_across(on, ALONG, limit_load(on, ALONG, Flow.COULOMB))
    assert found is not None
    assert found.multiplier == pytest.approx(FRICTION, rel=1e-3)


def test_what_tips_does_not_slide():
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (1, 0.2, 1)), friction=FRICTION))
    found = without_friction_across(on, ALONG, limit_load(on, ALONG, Flow.COULOMB))
    assert found is None or found.multiplier == pytest.approx(0.2, rel=1e-3)


def test_a_stone_between_two_planes_has_no_line_where_another_stone_moves_that_has_none():
    on = assembly(wedge_on_two_planes(0.06, True, planes=FLAT_AND_STEEP))
    live = Acceleration(tuple(limit_along_the_line(FLAT_AND_STEEP, 34.0)[1]))
    held = held_limit(on, live, bound := limit_load(on, live))
    limit = replace(bound, force=held.force, mechanism=held.mechanism)
    line = lines_of_sliding(on, limit)
    assert line.any(axis=1).tolist() == [False, False, True]
    speed = held.mechanism.speed.copy()
    speed[0] = 0.5
    other = replace(limit, mechanism=replace(held.mechanism, speed=speed))
    assert not lines_of_sliding(on, other).any()


@pytest.mark.parametrize(
    ("first", "second", "one_line"),
    [
        ((1.0, 0.2, 0.0), (0.5, 0.1, 0.0), True),
        ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), True),
        ((1.0, 0.0, 0.0), (1.0, 0.005, 0.0), True),
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), False),
        ((1.0, 0.3, 0.0), (1.0, -0.3, 0.0), False),
        ((1.0, 0.0, 0.0), (0.001, 0.001, 0.0), True),
    ],
)
def test_stones_slide_along_one_line_or_apart(first, second, one_line):
    """The stones of a dome that opens slide outwards on all sides: no friction of theirs is across one line."""
    blocks = ground(), brick("a", (0, 0, 0), (1, 1, 0.2)), brick("b", (2, 0, 0), (3, 1, 0.2))
    on = assembly(scene(*blocks, friction=FRICTION))
    velocity = np.zeros((2, 6))
    velocity[:, :3] = first, second
    limit = replace(limit_load(on, ALONG), mechanism=mechanism(on, velocity))
    assert slides_along_one_line(on, limit) == one_line


def test_stones_that_turn_slide_along_no_line():
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.2)), friction=FRICTION))
    limit = limit_load(on, ALONG)
    for spin, one_line in ((0.01, True), (10.0, False)):
        turning = replace(limit, mechanism=mechanism(on, np.array([[1.0, 0.0, 0.0, 0.0, spin, 0.0]])))
        assert slides_along_one_line(on, turning) == one_line
