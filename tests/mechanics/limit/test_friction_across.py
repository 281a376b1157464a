"""Limit of stones that slide in a trough without friction across the line of sliding: limit equilibrium of wedges."""

import numpy as np
import pytest

from mechanics.limit.assembly import assembly
from mechanics.limit.limit_load import Flow, limit_load, without_friction_across
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import prism
from tests.mechanics.shapes import brick, ground, scene

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


def test_a_block_on_one_plane_has_no_friction_across_its_way():
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.2)), friction=FRICTION))
    found = without_friction_across(on, ALONG, limit_load(on, ALONG, Flow.COULOMB))
    assert found is not None
    assert found.multiplier == pytest.approx(FRICTION, rel=1e-3)


def test_what_tips_does_not_slide():
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (1, 0.2, 1)), friction=FRICTION))
    found = without_friction_across(on, ALONG, limit_load(on, ALONG, Flow.COULOMB))
    assert found is None or found.multiplier == pytest.approx(0.2, rel=1e-3)
