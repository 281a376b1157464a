"""Regular prisms tip over their edges and corners: tan α = (distance of the edge below the centre) / (its height)."""

import numpy as np
import pytest

from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import drum
from pipelines.tuning.profiles import PROFILES
from tests.validation.masonry import cuboid
from tests.validation.statics.verdict import falls, hold, report, stands

RADIUS, HEIGHT, TURN = 0.5, 2.0, 0.3
FRICTION = 0.9  # more than the largest limit, 0.5
# sides of each prism, and whether it is leant over an edge or over a corner
CASES = [(n, over) for n in (3, 4, 5, 6, 8, 12, 16, 32, 64) for over in ("edge", "corner")]
QUICK = {(5, "edge"), (6, "corner"), (16, "edge"), (64, "corner")}


def scene(sides):
    angle = 2 * np.pi * np.arange(sides) / sides + TURN
    ring = RADIUS * np.column_stack([np.cos(angle), np.sin(angle)])
    table = cuboid("table", (-3.0, -3.0, -1.0), (3.0, 3.0, 0.0), Fidelity.FIXED)
    return table, drum("prism", ring, ring, (0.0, HEIGHT))


def limit(sides, over):
    """Direction in which the prism is leant (3,), and the multiplier of gravity at which it tips."""
    angle = TURN + (np.pi / sides if over == "edge" else 0.0)
    reach = RADIUS * (np.cos(np.pi / sides) if over == "edge" else 1.0)
    return (np.cos(angle), np.sin(angle), 0.0), reach / (HEIGHT / 2)


def assert_tips_at_its_limit(sides, over, **contact):
    toward, multiplier = limit(sides, over)
    low, high = (hold(scene(sides), FRICTION, part * multiplier, toward, **contact) for part in (0.99, 1.01))
    assert stands(low), report(low)
    assert falls(high), report(high)


@pytest.mark.parametrize(
    ("sides", "over"),
    [pytest.param(*case, marks=[] if case in QUICK else pytest.mark.slow) for case in CASES],
)
def test_a_prism_of_any_number_of_sides_stands_to_its_limit_and_no_further(sides, over):
    """Within 1 %, with the settings that a scene has by default."""
    assert_tips_at_its_limit(sides, over)


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize(("sides", "over"), [(6, "edge"), pytest.param(32, "corner", marks=pytest.mark.slow)])
def test_it_does_so_with_the_contact_points_of_every_profile(name, sides, over):
    overlay = PROFILES[name].rest
    assert_tips_at_its_limit(sides, over, points=overlay.points, placement=overlay.placement)
