"""Every law of joints between elastic stones, and between elastic and rigid ones: thresholds in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Fidelity, LawRule, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from tests.validation.elastic.elastic_blocks import elastic_box, elastic_follow, joint_force
from tests.validation.scenes import G, box, ground, tilted_gravity

MATERIAL = Material("stone", density=2000.0, young=1e9, poisson=0.2, stiffness_damping=1e-4)
NO_WIDENING = Material("stone", density=2000.0, young=1e9, poisson=0.0, stiffness_damping=1e-4)
SIZE = 0.2
PAIRS = [
    "on elastic",
    *(pytest.param(pair, marks=pytest.mark.slow) for pair in ("on rigid", "rigid on elastic")),
]


def slide(pair, law, gravity, duration, velocity=0.0, ramp=None, step=1e-3):
    """A stone on a slab; either may be elastic. How far it has slid along x in time (n,) [m], and the result."""
    low, high = [-0.2, -0.15, 0.0], [0.2, 0.15, 0.2]
    start = (velocity, 0, 0, 0, 0, 0)
    if pair == "rigid on elastic":
        stone = box("stone", low, high, MATERIAL, velocity=start)
    else:
        stone = elastic_box("stone", low, high, MATERIAL, SIZE, velocity=start)
    if pair == "on rigid":
        slab = [ground(half=2.0)]
        rules = ()
    else:
        # held by a bond that never breaks
        slab = [ground(half=2.0), elastic_box("slab", [-0.4, -0.3, -0.0], [0.8, 0.3, 0.1], MATERIAL, SIZE)]
        stone = _lifted(stone, 0.1)
        rules = (LawRule(frozenset({"ground"}), frozenset({"slab"}), MortarJoint(0.6, 1e5, 1e5)),)
    scene = Scene(
        "slide",
        (*slab, stone),
        gravity=gravity,
        contact=ContactSettings(law, rules=rules),
        time=TimeSettings(step, 0.5, duration, stop_at_equilibrium=False),
        solver=SolverSettings(tolerance=1e-8),
        loads=Loads(gravity=() if ramp is None else (GravityRamp(ramp),)),
        frame_every=1,
    )
    result = simulate(scene)
    places = np.array([frame.positions[-1].mean(axis=0) for frame in result.frames])
    return places[:, 0] - places[0, 0], result


def acceleration(x, step):
    """Of the second half of a path (n,) [m/s²]."""
    late = x[len(x) // 2 :]
    return 2 * np.polyfit(step * np.arange(len(late)), late, 2)[0]


def _lifted(block, height):
    return replace(block, vertices=block.vertices + np.array([0.0, 0.0, height]))


@pytest.mark.parametrize("pair", PAIRS)
def test_a_stone_slides_on_an_incline_where_its_slope_exceeds_the_friction(pair):
    """tan α = 0.98 μ holds; at 1.05 μ it slides with g (sin α - μ cos α), within 3 %. μ = 0.5. Closed form.

    Gravity comes at once: while the stone swings it may slip a little, in the first half of the time.
    """
    friction, duration, step = 0.5, 0.1, 1e-3
    held, _ = slide(
        pair, DryJoint(friction), tilted_gravity(np.degrees(np.arctan(0.98 * friction))), duration
    )
    assert abs(held[-1] - held[len(held) // 2]) < 1e-6
    alpha = np.arctan(1.05 * friction)
    slid, result = slide(pair, DryJoint(friction), tilted_gravity(np.degrees(alpha)), duration)
    rate = G * (np.sin(alpha) - friction * np.cos(alpha))
    assert acceleration(slid, step) == pytest.approx(rate, rel=0.03)
    assert result.errors.natural_map < 1e-7


@pytest.mark.parametrize("pair", PAIRS)
def test_a_gliding_stone_feels_the_dynamic_friction_and_then_holds(pair):
    """With 0.3 m/s on a level slab it stops after v²/(2 μ_d g), within 3 %; μ_s = 0.6, μ_d = 0.4. Closed form."""
    law, speed = DryJoint(0.6, dynamic_friction=0.4), 0.3
    slid, _ = slide(pair, law, (0.0, 0.0, -G), 0.12, speed)
    assert slid[-1] == pytest.approx(speed**2 / (2 * 0.4 * G), rel=0.03)
    assert abs(slid[-1] - slid[-20]) < 1e-5


@pytest.mark.parametrize("pair", PAIRS)
def test_static_friction_holds_where_dynamic_friction_would_not(pair):
    """tan α = 0.5 between μ_d = 0.4 and μ_s = 0.8: at rest it stays; with a push of 0.3 m/s it goes on for good, 3 %.

    Gravity comes slowly to the stone at rest, lest its swing loosens it.
    """
    law, slope = DryJoint(0.8, dynamic_friction=0.4), tilted_gravity(np.degrees(np.arctan(0.5)))
    held, _ = slide(pair, law, slope, 0.1, ramp=0.05)
    assert abs(held[-1] - held[len(held) // 2]) < 1e-6
    alpha = np.arctan(0.5)
    slid, _ = slide(pair, law, slope, 0.1, velocity=0.3)
    assert acceleration(slid, 1e-3) == pytest.approx(G * (np.sin(alpha) - 0.4 * np.cos(alpha)), rel=0.03)


# two stones hang on each other and on a ceiling: ρg (0.2 + 0.3) at the upper joint, ρg 0.3 at the lower
UPPER, LOWER = MATERIAL.density * G * 0.5, MATERIAL.density * G * 0.3


def hang(law, lower="elastic", tolerance=1e-8):
    half = 0.1
    last = [-half, -half, -0.5], [half, half, -0.2]
    blocks = (
        box("ceiling", [-1, -1, 0.0], [1, 1, 0.5], fidelity=Fidelity.FIXED),
        elastic_box("upper", [-half, -half, -0.2], [half, half, 0.0], NO_WIDENING, SIZE),
        elastic_box("lower", *last, NO_WIDENING, SIZE)
        if lower == "elastic"
        else box("lower", *last, NO_WIDENING),
    )
    scene = Scene(
        "hang",
        blocks,
        contact=ContactSettings(law),
        time=TimeSettings(1e-3, 1.0, 0.15, stop_at_equilibrium=False),
        solver=SolverSettings(tolerance=tolerance),
        loads=Loads(gravity=(GravityRamp(0.1),)),
    )
    return simulate(scene)


def fallen(result, body):
    return float(-result.bodies[body].displacement[:, 2].mean())


@pytest.mark.parametrize("lower", ["elastic", "rigid"])
@pytest.mark.parametrize("law", ["mortar", "cohesive zone"])
def test_a_bond_carries_tension_up_to_its_strength(lower, law):
    """Strength 1.05 times the stress of the upper joint holds; with 0.95 of it, both stones fall as one.

    σ = ρ g times what hangs below, 9.81 and 5.886 kPa; gravity comes in 0.1 s, 50 periods. Closed form.
    """

    def joint(strength):
        if law == "mortar":
            return MortarJoint(0.6, strength, 10 * strength)
        return CohesiveZone(0.6, strength, 10 * strength, 1e-3, 1e-3)

    whole = hang(joint(1.05 * UPPER), lower)
    assert max(fallen(whole, 1), fallen(whole, 2)) < 1e-4
    assert joint_force(whole, 1, 0)[2] == pytest.approx(UPPER * 0.2**2, rel=1e-3)
    assert joint_force(whole, 2, 1)[2] == pytest.approx(LOWER * 0.2**2, rel=1e-3)
    middle = hang(joint(0.95 * UPPER), lower)
    assert fallen(middle, 1) > 1e-3
    assert fallen(middle, 2) == pytest.approx(fallen(middle, 1), abs=1e-4)
    assert middle.reaction == pytest.approx(0.0, abs=1e-6 * middle.weight)


@pytest.mark.slow
@pytest.mark.parametrize("lower", ["elastic", "rigid"])
def test_of_two_bonds_the_weaker_breaks(lower):
    """A lower joint of 0.95 times its stress breaks, the upper one of 1.05 times its own holds. Closed form."""
    weak, strong = MortarJoint(0.6, 0.95 * LOWER, 1e5), MortarJoint(0.6, 1.05 * UPPER, 1e5)
    half = 0.1
    last = [-half, -half, -0.5], [half, half, -0.2]
    blocks = (
        box("ceiling", [-1, -1, 0.0], [1, 1, 0.5], fidelity=Fidelity.FIXED),
        elastic_box("upper", [-half, -half, -0.2], [half, half, 0.0], NO_WIDENING, SIZE),
        elastic_box("lower", *last, NO_WIDENING, SIZE)
        if lower == "elastic"
        else box("lower", *last, NO_WIDENING),
    )
    rule = LawRule(frozenset({"upper"}), frozenset({"lower"}), weak)
    scene = Scene(
        "hang",
        blocks,
        contact=ContactSettings(strong, rules=(rule,)),
        time=TimeSettings(1e-3, 1.0, 0.2, stop_at_equilibrium=False),
        solver=SolverSettings(tolerance=1e-8),
        loads=Loads(gravity=(GravityRamp(0.1),)),
    )
    result = simulate(scene)
    assert fallen(result, 2) > 1e-2
    assert fallen(result, 1) < 1e-4
    assert result.reaction == pytest.approx(result.bodies[1].mass * G, rel=1e-3)


@pytest.mark.parametrize("strength", [1e5, 1e7, 1e9])
def test_a_strong_bond_is_as_exact_as_a_weak_one(strength):
    """However strong the mortar, its joints carry what hangs on them, within 1e-3, once gravity has come. Statics."""
    result = hang(MortarJoint(0.6, strength, strength), tolerance=1e-6)
    assert joint_force(result, 1, 0)[2] == pytest.approx(UPPER * 0.2**2, rel=1e-3)
    assert joint_force(result, 2, 1)[2] == pytest.approx(LOWER * 0.2**2, rel=1e-3)


@pytest.mark.parametrize("law", ["mortar", "cohesive zone"])
@pytest.mark.parametrize(("part", "holds"), [(0.97, True), (1.03, False)])
def test_a_bond_is_sheared_off_at_its_strength(law, part, holds):
    """A rigid plate on an elastic stone, pushed in the plane of the joint: T = (c_t + μ σ) A distinguishes them by 3 %.

    c_t = 20 kPa, μ = 0.5, the plate's weight gives σ = 9.81 kPa; A = 0.04 m². Closed form.
    """
    friction, shear, half = 0.5, 2e4, 0.1
    joint = (
        MortarJoint(friction, 1e5, shear)
        if law == "mortar"
        else CohesiveZone(friction, 1e5, shear, 10.0, 10.0)
    )
    plate = Material("plate", density=100000.0, young=1e10, poisson=0.2)
    area, height = (2 * half) ** 2, 0.01
    limit = (shear + friction * plate.density * G * height) * area
    blocks = (
        ground(half=1.0),
        elastic_box("stone", [-half, -half, 0.0], [half, half, 0.1], NO_WIDENING, SIZE),
        box("plate", [-half, -half, 0.1], [half, half, 0.1 + height], plate),
    )
    # in the plane of the joint, half the plate's height below its centre
    force = StoneForce(
        frozenset({"plate"}),
        History([0.0, 0.1, 0.3], np.outer([0.0, 0.0, part * limit], [1.0, 0.0, 0.0])),
        arm=(0.0, 0.0, -height / 2),
    )
    foot = LawRule(frozenset({"ground"}), frozenset({"stone"}), MortarJoint(0.6, 2e5, 2e5))
    scene = Scene(
        "shear",
        blocks,
        contact=ContactSettings(joint, rules=(foot,)),
        time=TimeSettings(1e-3, 1.0, 0.4, stop_at_equilibrium=False),
        solver=SolverSettings(tolerance=1e-8),
        loads=Loads(gravity=(GravityRamp(0.05),), forces=(force,)),
    )
    result = simulate(scene)
    moved = result.bodies[2].displacement[:, 0].mean()
    assert (moved < 1e-3) == holds
    if holds:
        assert result.contacts.status.tolist().count("bonded") > 0


def test_an_elastic_column_parts_in_tension_without_a_bond():
    """A dry joint carries no tension: pulled up by 1.02 times its weight the upper stone leaves, at 0.98 it stays."""
    half, rise = 0.1, 0.2
    for part, stays in ((0.98, True), (1.02, False)):
        head = Material("head", density=2000.0, young=1e10, poisson=0.2)
        blocks = (
            ground(half=1.0),
            elastic_box("lower", [-half, -half, 0.0], [half, half, rise], MATERIAL, SIZE),
            elastic_box("upper", [-half, -half, rise], [half, half, 2 * rise], MATERIAL, SIZE),
            box("head", [-half, -half, 2 * rise], [half, half, 3 * rise], head),
        )
        above = 2000.0 * G * (2 * half) ** 2 * 2 * rise
        pull = History([0.0, 0.1, 0.2], np.outer([0.0, 0.0, part * above], [0.0, 0.0, 1.0]))
        glue = LawRule(frozenset({"upper"}), frozenset({"head"}), MortarJoint(0.6, 1e5, 1e5))
        scene = Scene(
            "pull",
            blocks,
            contact=ContactSettings(DryJoint(0.6), rules=(glue,)),
            time=TimeSettings(1e-3, 1.0, 0.4, stop_at_equilibrium=False),
            solver=SolverSettings(tolerance=1e-8),
            loads=Loads(gravity=(GravityRamp(0.05),), forces=(StoneForce(frozenset({"head"}), pull),)),
        )
        path = elastic_follow(scene, body=2)
        lifted = (path.node[-1] - path.node[0])[:, 2].mean()
        assert (lifted < 1e-4) == stays
        if not stays:
            # 2 % of g upwards after the pull has passed the weight, at about 0.198 s
            assert lifted == pytest.approx(0.5 * 0.02 * G * 0.2**2, rel=0.05)
