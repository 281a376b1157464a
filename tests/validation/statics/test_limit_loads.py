"""Limit loads by cone programmes: published walls, closed forms, and a linear programme of another hand."""

import numpy as np
import pytest

from benchmarks.limit import FRICTION, WALLS
from mechanics.limit.assembly import assembly
from mechanics.limit.limit_load import Flow, limit_load
from mechanics.limit.live_loads import Acceleration, PointForce
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings, Scene
from mechanics.scene.shapes import bond
from tests.validation.masonry import cuboid, running_bond, semicircular_arch
from tests.validation.scenes import ground
from tests.validation.statics.limit_analysis import multiplier

ALONG = Acceleration((1.0, 0.0, 0.0))


def standing(blocks, law=None):
    return assembly(Scene("limit", tuple(blocks), contact=ContactSettings(law or DryJoint(FRICTION))))


@pytest.mark.parametrize("name", WALLS)
def test_walls_have_their_published_loads(name):
    one = WALLS[name]
    on = standing(one.blocks())
    assert len(on.free) == one.stones
    bound = limit_load(on, ALONG)
    assert bound.multiplier == pytest.approx(one.bound, rel=3e-5)
    candidate = limit_load(on, ALONG, Flow.COULOMB)
    assert candidate.converged
    assert candidate.multiplier == pytest.approx(one.candidate, rel=1e-2)
    assert candidate.multiplier < bound.multiplier


@pytest.mark.parametrize(
    ("count", "thickness", "friction"), [(7, 0.2, 0.7), (15, 0.15, 0.7), (12, 0.25, 0.5)]
)
def test_arches_agree_with_a_linear_programme(count, thickness, friction):
    arch = semicircular_arch(count, thickness)
    found = limit_load(standing(arch, DryJoint(friction)), ALONG)
    assert found.multiplier == pytest.approx(multiplier(arch, friction), rel=1e-5)


@pytest.mark.parametrize(("width", "height", "friction"), [(0.3, 3.0, 0.6), (0.5, 6.0, 0.6), (2.0, 1.0, 0.4)])
def test_a_stone_topples_at_its_slenderness_or_slides_at_its_friction(width, height, friction):
    on = standing([ground(), cuboid("S", (0, 0, 0), (width, 0.8, height))], DryJoint(friction))
    for flow in Flow:
        found = limit_load(on, ALONG, flow)
        assert found.multiplier == pytest.approx(min(width / height, friction), rel=1e-6)


def test_bonded_stones_bear_what_their_mortar_does():
    """Four corners with a quarter of the bed each: two of them crack, W b/2 + s A b = λ W h/2 about the edge."""
    width, depth, height, tension = 0.4, 0.5, 2.0, 2e4
    on = standing(
        [ground(), cuboid("S", (0, 0, 0), (width, depth, height))],
        MortarJoint(friction=5.0, tension=tension, shear=1e6),
    )
    bed = 0.5 * tension * width * depth
    found = limit_load(on, ALONG)
    assert found.multiplier == pytest.approx(
        (on.weight * width / 2 + bed * width) / (on.weight * height / 2), rel=1e-6
    )


def test_the_mechanism_balances_the_power_of_all_loads():
    """Dry joints dissipate nothing where flow is associative: dead and live load do no work together."""
    on = standing(WALLS["W03"].blocks())
    found = limit_load(on, ALONG)
    power = found.mechanism.velocity[on.free].ravel() @ (on.dead + found.multiplier * ALONG(on))
    assert abs(power) < 1e-6 * (found.mechanism.velocity[on.free].ravel() @ ALONG(on))
    u = (on.lift.T @ found.mechanism.velocity[on.free].ravel()).reshape(-1, 3)
    assert (u[:, 0] >= FRICTION * np.linalg.norm(u[:, 1:], axis=1) - 1e-6).all()


def test_a_candidate_slides_without_opening():
    on = standing(WALLS["W01"].blocks())
    found = limit_load(on, ALONG, Flow.COULOMB)
    u = (on.lift.T @ found.mechanism.velocity[on.free].ravel()).reshape(-1, 3)
    bears = found.force[:, 0] > 1e-3 * on.weight / len(on.free)
    assert np.abs(u[bears, 0]).max() < 0.02
    assert np.linalg.norm(u[:, 1:], axis=1).max() > 0.1
    left = on.lift @ found.force.ravel() + on.dead + found.multiplier * ALONG(on)
    assert np.abs(left).max() < 1e-5 * on.weight


def test_forces_and_weight_turn_into_one_another():
    """A force of the stone's weight at its centre is the same push as an acceleration of gravity."""
    on = standing([ground(), cuboid("S", (0, 0, 0), (0.5, 0.8, 2.0))])
    push = limit_load(on, PointForce("S", (on.weight, 0.0, 0.0)))
    assert push.multiplier == pytest.approx(limit_load(on, ALONG).multiplier, rel=1e-9)
    low = limit_load(on, PointForce("S", (on.weight, 0.0, 0.0), (0.0, 0.4, 0.4)))
    assert low.multiplier == pytest.approx(0.25 / 0.4, rel=1e-6)


def test_what_falls_by_itself_is_told_from_what_nothing_limits():
    leaning = cuboid("S", (4.0, 0, 0), (6.5, 0.8, 1.0))
    falls = limit_load(standing([ground(half=5.0), leaning]), ALONG)
    assert np.isnan(falls.multiplier)
    assert "own weight" in falls.headline
    assert falls.mechanism.velocity.any()
    pressed = standing([ground(), cuboid("S", (0, 0, 0), (0.5, 0.8, 2.0))])
    endless = limit_load(pressed, Acceleration((0.0, 0.0, -1.0)))
    assert np.isinf(endless.multiplier)
    assert "nothing limits it" in endless.headline


@pytest.mark.slow
def test_forty_courses_of_forty_bricks():
    """L7: 12 s; the load that this program found first, to its digits."""
    on = standing(running_bond(bond(40, 40, halves_first=True), 0.2, 0.1))
    found = limit_load(on, ALONG)
    assert found.converged
    assert found.multiplier == pytest.approx(0.4224, abs=1e-4)
