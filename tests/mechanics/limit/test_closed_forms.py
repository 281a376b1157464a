"""Limit states of one and two blocks by formulas: planes that tilt, towers, wedges, thinned joints, oscillators."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ground.errors import SceneError
from mechanics.dynamics.outcome import Outcome
from mechanics.limit import confirm as confirm_module
from mechanics.limit import held
from mechanics.limit import loading_test as loading
from mechanics.limit.assembly import assembly
from mechanics.limit.confirm import ConfirmationRun, confirm, likeness
from mechanics.limit.joints import resultants, stress_blocks
from mechanics.limit.kinematic import kinematics
from mechanics.limit.limit_load import Flow, Mechanism, limit_load, mechanism, slides_along_one_line
from mechanics.limit.live_loads import Acceleration, PointForce, SpreadForce, levers
from mechanics.limit.loading_test import JawPath, LoadingTest, _Pushed
from mechanics.limit.pushover import _Run
from mechanics.limit.thickness import geometric_safety
from mechanics.limit.thrust import thrust
from mechanics.scene.rig import BEAM, Rig
from mechanics.scene.scene import Block, Fidelity
from tests.mechanics.shapes import BOX_FACES, LIMESTONE, brick, ground, scene

X = Acceleration((1.0, 0.0, 0.0))
EXACT = 1e-6  # of λ: programmes leave 10⁻⁹


def on_plane(stone, degrees, friction, ground_=None):
    """A stone on a plane that leans: gravity leans instead, so that it pulls along x."""
    lean = np.radians(degrees)
    pull = (9.81 * np.sin(lean), 0.0, -9.81 * np.cos(lean))
    return assembly(scene(ground_ or ground(), stone, gravity=pull, friction=friction))


def along(on, load, flow=Flow.ASSOCIATIVE):
    return limit_load(on, load, flow).multiplier


SQUAT, TALL = brick("a", (0, 0, 0), (1.0, 1.0, 0.5)), brick("a", (0, 0, 0), (0.4, 0.6, 1.6))


@pytest.mark.parametrize("flow", list(Flow))
@pytest.mark.parametrize(("degrees", "downwards"), [(10.0, True), (10.0, False), (25.0, True), (0.0, True)])
def test_a_block_on_a_plane_slides_where_the_push_reaches_its_cone_of_friction(degrees, downwards, flow):
    """λ along the plane, in units of gravity: μ cos β ∓ sin β."""
    lean, on = np.radians(degrees), on_plane(SQUAT, degrees, 0.6)
    push = Acceleration((1.0 if downwards else -1.0, 0.0, 0.0))
    exact = 0.6 * np.cos(lean) - (1.0 if downwards else -1.0) * np.sin(lean)
    assert along(on, push, flow) == pytest.approx(exact, rel=EXACT if flow is Flow.ASSOCIATIVE else 1e-2)


@pytest.mark.parametrize(("degrees", "downwards"), [(5.0, True), (5.0, False), (12.0, True)])
def test_a_slender_block_on_a_plane_tips_about_its_lower_edge(degrees, downwards):
    """b/h cos β ∓ sin β."""
    lean, on = np.radians(degrees), on_plane(TALL, degrees, 0.9)
    push = Acceleration((1.0 if downwards else -1.0, 0.0, 0.0))
    exact = 0.25 * np.cos(lean) - (1.0 if downwards else -1.0) * np.sin(lean)
    assert along(on, push) == pytest.approx(exact, rel=EXACT)


@pytest.mark.parametrize(("degrees", "stands"), [(30.9, True), (31.1, False)])
def test_a_plane_steeper_than_the_angle_of_friction_holds_nothing(degrees, stands):
    """μ = 0.6 is 30.96 degrees."""
    found = limit_load(on_plane(SQUAT, degrees, 0.6), X)
    assert (found.multiplier > 0.0) == stands


@pytest.mark.parametrize(
    ("lower", "upper", "friction", "exact"),
    [
        # both tip as one: half a width of 0.6 over half a height of 1.6
        ((0.6, 0.8), (0.6, 0.8), 0.9, 0.375),
        # the upper tips alone: 0.3 over 0.8
        ((1.0, 0.4), (0.3, 0.8), 0.9, 0.375),
        # the upper slides before it tips, and both before they tip
        ((1.0, 0.4), (0.8, 0.4), 0.4, 0.4),
        # a heavy foot with a narrow tower: both about the foot's edge, or the tower alone
        (
            (0.5, 0.2),
            (0.4, 1.6),
            0.9,
            min(0.25, (0.5 * 0.2 * 0.25 + 0.4 * 1.6 * 0.25) / (0.1 * 0.1 + 0.64 * 1.0)),
        ),
        # the foot is so narrow that both tip about it first
        ((0.3, 0.8), (0.9, 0.8), 0.9, (0.24 + 0.72) * 0.15 / (0.24 * 0.4 + 0.72 * 1.2)),
    ],
)
def test_a_tower_of_two_stones_falls_at_its_weakest_joint(lower, upper, friction, exact):
    foot = brick("foot", (-0.5 * lower[0], 0, 0), (0.5 * lower[0], 1.0, lower[1]))
    head = brick("head", (-0.5 * upper[0], 0, lower[1]), (0.5 * upper[0], 1.0, lower[1] + upper[1]))
    on = assembly(scene(ground((-3, -3, -1)), foot, head, friction=friction))
    assert along(on, X) == pytest.approx(exact, rel=EXACT)
    # pushed on its head alone, each joint has only that push
    alone = Acceleration((1.0, 0.0, 0.0), frozenset({"head"}))
    weight = np.array([lower[0] * lower[1], upper[0] * upper[1]])
    slides = min(friction * weight.sum() / weight[1], friction)
    tips = min(upper[0] / upper[1], 0.5 * lower[0] * weight.sum() / (weight[1] * (lower[1] + 0.5 * upper[1])))
    assert along(on, alone) == pytest.approx(min(slides, tips), rel=EXACT)


@pytest.mark.parametrize(("height", "exact"), [(0.1, 0.6), (0.5, 0.4), (1.6, 0.125), (None, 0.25)])
def test_a_force_at_a_height_slides_a_block_or_tips_it(height, exact):
    """μ W, or half of W b over the height; without a place it acts at the centre."""
    on = assembly(scene(ground(), TALL, friction=0.6))
    at = None if height is None else (0.2, 0.3, height)
    push = PointForce("a", (0.5 * on.weight, 0.0, 0.0), at)
    assert along(on, push) == pytest.approx(2.0 * exact, rel=EXACT)
    assert str(push) == f"force on a, in units of {0.5 * on.weight:g} N"


def test_a_force_is_spread_over_stones_as_their_weight_is():
    light, heavy = brick("a", (0, 0, 0), (1, 1, 0.5)), brick("b", (1.5, 0, 0), (2.5, 1, 1.5))
    on = assembly(scene(ground(), light, heavy))
    load = SpreadForce(frozenset({"a", "b"}), (8.0, 0.0, -4.0))(on).reshape(-1, 6)
    assert load[:, :3] == pytest.approx(np.array([[2.0, 0.0, -1.0], [6.0, 0.0, -3.0]]))
    assert not load[:, 3:].any()
    with pytest.raises(SceneError, match="not all zero"):
        SpreadForce(frozenset({"a"}), (0.0, 0.0, 0.0))(on)
    with pytest.raises(SceneError, match="ground is fixed"):
        SpreadForce(frozenset({"ground"}), (1.0, 0.0, 0.0))(on)


def test_an_acceleration_is_a_part_of_gravity_and_some_stones_have_it_as_forces():
    on = assembly(scene(ground(), SQUAT))
    assert Acceleration((0.0, 2.0, 0.0)).applied(on, 0.3).gravity == pytest.approx((0.0, 0.3 * 9.81, -9.81))
    some = Acceleration((0.0, 2.0, 0.0), frozenset({"a"})).applied(on, 0.3)
    assert some.gravity == (0.0, 0.0, -9.81)
    (force,) = some.loads.forces
    assert force.stones == frozenset({"a"})
    for direction in ((0.0, 0.0, 0.0), (np.nan, 0.0, 1.0)):
        with pytest.raises(SceneError, match="direction"):
            Acceleration(direction)


def test_a_force_and_its_moment_act_at_the_nearest_place_to_the_centre():
    arm, force = np.array([0.2, 0.0, 0.7]), np.array([0.0, 3.0, 0.0])
    load = np.array([np.zeros(6), np.concatenate([force, np.cross(arm, force)])])
    rows, found, place = levers(load)
    assert (rows.tolist(), found[0].tolist()) == ([1], force.tolist())
    assert place[0] == pytest.approx(arm)


def wedge(slope):
    """A wedge with a width of 1 m at its foot, 2 m at its top and faces that lean from upright, between two others."""
    side = np.tan(np.radians(slope))
    low = np.array([[-0.5, 0, 0], [0.5, 0, 0], [0.5, 1, 0], [-0.5, 1, 0]])
    high = np.array([[-0.5 - side, 0, 1], [0.5 + side, 0, 1], [0.5 + side, 1, 1], [-0.5 - side, 1, 1]])

    def prism(code, foot, head, fidelity):
        return Block(code, np.vstack([foot, head]), BOX_FACES, LIMESTONE, fidelity)

    def beside(sign):
        bottom, top = low.copy(), high.copy()
        inner, outer = ((1, 2), (0, 3)) if sign < 0 else ((0, 3), (1, 2))
        bottom[list(inner), 0], top[list(inner), 0] = sign * 0.5, sign * (0.5 + side)
        bottom[list(outer), 0] = top[list(outer), 0] = sign * 4.0
        return prism("left" if sign < 0 else "right", bottom, top, Fidelity.FIXED)

    return beside(-1), prism("wedge", low, high, Fidelity.RIGID), beside(1)


@pytest.mark.parametrize(("slope", "friction"), [(30.0, 0.0), (30.0, 0.2), (20.0, 0.3)])
def test_a_wedge_pushes_its_supports_apart_between_both_ends_of_friction(slope, friction):
    """H = W/2 cot(β ± φ): the faces push along their normals, which lie below the level by β."""
    on = assembly(scene(*wedge(slope), friction=friction))
    angle, phi = np.radians(slope), np.arctan(friction)
    least = 0.5 / np.tan(angle + phi)
    greatest = 0.5 / np.tan(angle - phi) if angle > phi else np.inf
    found = thrust(on, ["right"], (2.0, 0.0, 0.0))
    assert found.direction == (1.0, 0.0, 0.0)
    assert found.least.value / on.weight == pytest.approx(least, rel=1e-5)
    assert found.greatest.value / on.weight == pytest.approx(greatest, rel=1e-5)
    assert thrust(on, ["left"], (-1.0, 0.0, 0.0)).least.value == pytest.approx(found.least.value, rel=1e-5)


def test_a_wedge_between_faces_steeper_than_friction_locks():
    found = thrust(assembly(scene(*wedge(10.0), friction=0.3)), ["right"], (1.0, 0.0, 0.0))
    assert found.greatest.value == np.inf


def test_what_gives_no_thrust_is_refused():
    on = assembly(scene(ground(), SQUAT, brick("apart", (5, 5, 5), (6, 6, 6), Fidelity.FIXED)))
    for supports, way, words in (
        (["a"], (1.0, 0.0, 0.0), "a is not fixed"),
        (["apart"], (1.0, 0.0, 0.0), "no joint meets"),
        (["ground"], (0.0, 0.0, 0.0), "not all zero"),
    ):
        with pytest.raises(SceneError, match=words):
            thrust(on, supports, way)


@pytest.mark.parametrize("degrees", [4.0, 10.0])
def test_joints_may_shrink_until_their_edge_lies_below_the_resultant(degrees):
    """The resultant of a block of the height h meets its foot h/2 tan β from the middle of the width b."""
    found = geometric_safety(on_plane(TALL, degrees, 0.9))
    share = 1.6 * np.tan(np.radians(degrees)) / 0.4
    assert found.share == pytest.approx(share, rel=1e-3)
    assert found.factor == pytest.approx(1.0 / share, rel=1e-3)


def test_a_block_on_a_level_stands_on_a_point_and_one_that_falls_needs_wider_joints():
    assert geometric_safety(on_plane(TALL, 0.0, 0.9)).factor == np.inf
    steep = on_plane(TALL, 20.0, 0.9)
    assert np.isnan(geometric_safety(steep).share)
    assert geometric_safety(steep, 2.0).share == pytest.approx(4.0 * np.tan(np.radians(20.0)), rel=1e-3)


def resultant(on):
    force = thrust(on, ["ground"], (0.0, 0.0, -1.0)).least.force
    return resultants(on.joints, on.contacts, force, on.strength.shear(force))


def test_the_resultant_of_a_block_is_its_weight_at_its_place():
    degrees = 6.0
    on = on_plane(TALL, degrees, 0.5)
    lean = np.radians(degrees)
    found = resultant(on)
    assert found.normal[0] / on.weight == pytest.approx(np.cos(lean), rel=1e-5)
    assert found.shear[0] / on.weight == pytest.approx(np.sin(lean), rel=1e-5)
    off = 0.8 * np.tan(lean)
    assert found.place[0, 0] == pytest.approx(0.2 + off, abs=1e-4)
    assert found.edge[0] == pytest.approx(2.0 * off / 0.4, rel=1e-3)
    assert found.kern[0] == pytest.approx(6.0 * off / 0.4, rel=1e-3)
    assert found.friction_use[0] == pytest.approx(np.tan(lean) / 0.5, rel=1e-3)


def test_limits_of_crushing_are_levers_from_the_four_edges():
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (0.4, 0.6, 1.6))))
    blocks = stress_blocks(on.joints, np.array([np.inf, 3e6]))
    assert stress_blocks(on.joints, np.array([np.inf, np.inf])) is None
    # σ times the width across: twice along each axis
    assert sorted(blocks.limit) == pytest.approx(sorted([3e6 * 0.6] * 2 + [3e6 * 0.4] * 2))
    for row, limit in enumerate(blocks.limit):
        depth = 0.4 if limit > 1.5e6 else 0.6
        assert sorted(blocks.lever[row]) == pytest.approx([0.0, 0.0, depth, depth], abs=1e-9)


@pytest.mark.parametrize("wide", [0.2, 0.4])
def test_a_block_that_rocks_is_an_oscillator_of_its_whole_mass(wide):
    """λ(θ) = tan(α - θ) as the centre goes from 0 to b/2."""
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (wide, 1.0, 1.0)), friction=0.9))
    found = kinematics(on, X, limit_load(on, X))
    assert found.block.tolist() == [-1, 0]
    assert found.multiplier == pytest.approx(wide, rel=EXACT)
    assert (found.share, found.mass * 9.81, found.weight) == pytest.approx((1.0, on.weight, on.weight))
    assert found.capacity == pytest.approx(0.5 * wide, rel=1e-4)
    alpha, radius = np.arctan(wide), 0.5 * np.hypot(wide, 1.0)
    turned = alpha - np.arcsin(np.sin(alpha) - found.displacement / radius)
    assert found.multipliers == pytest.approx(np.tan(alpha - turned), abs=1e-4)
    assert found.acceleration() == pytest.approx(wide * 9.81, rel=1e-5)
    assert found.acceleration(1.35) == pytest.approx(wide * 9.81 / 1.35, rel=1e-5)


def test_a_block_that_slides_has_no_end_and_two_that_slide_apart_are_two():
    on = assembly(scene(ground(), SQUAT, brick("b", (1.5, 0, 0), (2.5, 1, 0.5)), friction=0.3))
    found = kinematics(on, X, limit_load(on, X))
    assert found.capacity == np.inf
    assert found.multiplier == pytest.approx(0.3, rel=EXACT)


def test_a_mechanism_has_its_fastest_corner_at_one():
    on = assembly(scene(ground(), SQUAT))
    lifted = mechanism(on, np.array([[0.0, 0.0, 4.0, 0.0, 0.0, 0.0]]))
    assert lifted.velocity[1].tolist() == [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    assert lifted.speed.tolist() == [0.0, 1.0]
    assert lifted.opening.all()
    assert not lifted.sliding.any()
    # a turn moves the corners by half of the width of the stone
    size = float(on.model.surfaces.size[1])
    both = mechanism(on, np.array([[3.0, 0.0, 0.0, 0.0, 0.0, 2.0]]))
    assert both.velocity[1, 0] == pytest.approx(3.0 / (3.0 + size))
    pulled = mechanism(on, np.zeros((1, 6)), np.array([[0.0, 0, -1, 0, 0, 0], np.zeros(6)]))
    assert pulled.opening.all()


@pytest.mark.parametrize(("turn", "cosine"), [(0.0, 1.0), (90.0, 0.0), (60.0, 0.5), (180.0, -1.0)])
def test_the_likeness_is_the_cosine_between_both_motions_weighted_by_mass(turn, cosine):
    on = assembly(scene(ground(), SQUAT, brick("b", (1.5, 0, 0), (2.5, 1, 1.5))))
    velocity, falls = np.zeros((3, 6)), np.zeros((3, 3))
    velocity[1:, 0] = 0.7
    angle = np.radians(turn)
    falls[1:] = 0.02 * np.array([np.cos(angle), np.sin(angle), 0.0])
    none = np.zeros(len(on.contacts), bool)
    found = likeness(on, Mechanism(velocity, np.array([0.0, 1.0, 1.0]), none, none), falls)
    assert found.cosine == pytest.approx(cosine, abs=1e-12)
    assert (found.mechanism, found.collapse, found.common) == (1.0, 1.0, 1.0)
    # of masses 1 and 3, the lighter alone falls: v·d is 1, of 4 times 1
    falls[2] = 0.0
    found = likeness(on, Mechanism(velocity, np.array([0.0, 1.0, 1.0]), none, none), falls)
    assert found.cosine == pytest.approx(cosine * np.sqrt(0.25), abs=1e-12)
    assert (found.mechanism, found.collapse, found.common) == (1.0, pytest.approx(0.25), pytest.approx(0.25))


def confirmed(monkeypatch, limit, candidate, bound=np.inf, runs=12):
    """What runs tell that hold every load up to a limit."""
    tried = []

    def trial(on, live, multiplier, *_):
        tried.append(multiplier)
        outcome = Outcome.EQUILIBRIUM if multiplier <= limit else Outcome.COLLAPSED
        return ConfirmationRun(multiplier, outcome, 1, 0, np.zeros((1, 3)))

    monkeypatch.setattr(confirm_module, "_trial", trial)
    return confirm(None, None, candidate, bound, runs), tried


@pytest.mark.parametrize("limit", [0.31, 0.48, 0.497, 0.52, 0.9, 2.0])
def test_runs_close_in_on_the_limit_to_three_percent(monkeypatch, limit):
    found, tried = confirmed(monkeypatch, limit, 0.5)
    assert found.held <= limit < found.lost
    assert found.lost <= 1.03 * found.held
    assert tried[0] == 0.5
    assert len(tried) <= 12


def test_runs_go_on_beside_the_candidate_in_steps_that_double(monkeypatch):
    up = confirmed(monkeypatch, 10.0, 0.5, runs=4)[1]
    assert up == pytest.approx([0.5, 0.5 * 1.03, 0.5 * 1.03 * 1.06, 0.5 * 1.03 * 1.06 * 1.12])
    down = confirmed(monkeypatch, 0.0, 0.5, runs=7)[1]
    factors = np.array(down[1:]) / down[:-1]
    assert factors == pytest.approx([0.97, 0.94, 0.88, 0.76, 0.52, 0.5])
    # next to the candidate first, and half-way where that is less
    between = confirmed(monkeypatch, 0.52, 0.5, 0.6, runs=4)[1]
    assert between == pytest.approx([0.5, 0.515, 0.515 * 1.06, 0.5 * 0.515 * (1.0 + 1.06)])


def test_no_run_is_made_at_a_bound_but_one_beyond_it_shows_how_stones_fall(monkeypatch):
    found, tried = confirmed(monkeypatch, 0.5, 0.49, 0.5)
    assert (found.held, found.lost) == (0.49, 0.5)
    assert tried == pytest.approx([0.49, 0.515])
    assert confirmed(monkeypatch, 9.0, 0.8, 0.5, runs=1)[1][0] == 0.5


@pytest.mark.parametrize(
    ("load", "unit"), [(1.0, 2e-3), (0.99, 1e-3), (2.5, 5e-3), (0.3, 5e-4), (40.0, 5e-2), (50.0, 0.1)]
)
def test_loads_are_multiples_of_a_round_number_up_to_two_thousandths(load, unit):
    assert held._unit(load) == pytest.approx(unit)


class Stepping:
    """Steps that hold every load below a limit; a mechanism would stop at a share of it."""

    def __init__(self, limit, stops=0.97):
        self.limit, self.stops, self.tried = limit, stops * limit, []

    def __call__(self, load):
        self.tried.append(load)
        return held._Trial(load < self.limit, self.stops, np.zeros((0, 3)), np.zeros((1, 6)), 0.0)

    def released(self, load):
        return None


@pytest.mark.parametrize(("limit", "most"), [(0.0077, 30), (0.333, 30), (1.0, 30), (90.0, 40)])
def test_without_a_bound_loads_double_until_one_is_lost_or_halve_until_one_holds(monkeypatch, limit, most):
    monkeypatch.setattr(held, "_falling", lambda on, trial: None)
    steps = Stepping(limit)
    found = held._without_bound(None, steps, steps(0.0))
    assert found.held < limit <= found.lost
    # two thousandths of the limit, whatever its size
    below = [digit * 10.0**k for k in (-3, -2, -1) for digit in (1.0, 2.0, 5.0)]
    first = next(load for load in (*below, *2.0 ** np.arange(20)) if load >= limit)
    assert found.lost - found.held == pytest.approx(held._unit(first))
    assert found.problems == len(set(steps.tried))
    assert len(steps.tried) <= most


def test_a_load_that_nothing_limits_is_endless():
    steps = Stepping(np.inf)
    found = held._without_bound(None, steps, steps(0.0))
    assert (found.held, found.lost, found.sure) == (np.inf, np.inf, np.inf)
    ratios = np.array(steps.tried[2:]) / steps.tried[1:-1]
    assert ratios == pytest.approx(np.full(len(ratios), 2.0))


def search(limit, stops):
    steps = Stepping(limit, stops)
    return held._Search(steps, 0.01, {0: steps(0.0)}), steps


@pytest.mark.parametrize(("stops", "tries"), [(0.995, 3), (0.6, 12), (0.0, 18)])
def test_a_search_goes_where_the_mechanism_would_stop(stops, tries):
    made, steps = search(0.505, stops)
    assert made._neighbours(0, 100, 99) == (50, 51)
    assert len(steps.tried) <= 2 + tries


def test_loads_below_the_limit_are_tried_ever_farther_down_to_a_hundredth():
    made, _ = search(1.0, 1.0)
    assert list(made._below(1000)) == [999, 998, 996, 992]
    assert list(made._below(50)) == [49]
    assert list(made._below(1)) == []


@pytest.mark.parametrize(
    ("values", "still", "words"),
    [
        ([1.0, 0.5], 0, ""),
        ([1.0, -0.1], 0, ""),
        ([1.0, 0.0, -0.1], 0, "no load is borne any more"),
        ([0.5], 10**6, "the stones do not follow"),
        ([1.0] * 5, 0, "5 points"),
    ],
)
def test_a_curve_ends_for_a_reason(values, still, words):
    assert _Run._end(SimpleNamespace(), values, 5, still, lambda: False) == words
    assert _Run._end(SimpleNamespace(), values, 5, still, lambda: True) == "stopped"


def test_jaws_go_to_their_places_in_turn_at_one_speed():
    path = JawPath(frozenset({"jaw"}), np.array([0.0, 1.0, 0.0]), (0.02, -0.01), 0.1)
    assert path.until == pytest.approx(0.2 + 0.3)
    assert [path.at(time) for time in (0.1, 0.2, 0.4, 0.5)] == pytest.approx([0.01, 0.02, 0.0, -0.01])
    path.rise = 0.003
    assert path.pose(0.1).displacement == pytest.approx([0.0, 0.01, 0.003])


@pytest.mark.parametrize(
    ("masses", "share"), [((1.0, 1.0, 1.0), 0.5), ((1.0, 1.0, 5.0), 1.0), ((5.0, 1.0, 1.0), 0.0)]
)
def test_the_share_of_turning_is_that_of_the_median_stone_by_mass(masses, share):
    """Pushed by 20 mm at a height of 2 m, stones that rock turn by 10 mrad; one turns by half of it, one slides."""
    rig = Rig((1.0, 0.0, 0.0), 2.0, 1e3)
    axis = rig.axes[1]
    turned = np.array(
        [Rotation.from_rotvec(angle * axis).as_matrix() for angle in (0.0, 0.005, 0.01, 0.3, 0.3)]
    )
    blocks = [SimpleNamespace(code=code) for code in ("A", "B", "C", "foot", BEAM)]
    model = SimpleNamespace(
        mass=np.array([*masses, 9.0, 9.0]),
        fixed=np.array([False, False, False, True, False]),
        scene=SimpleNamespace(blocks=blocks),
    )
    settled = SimpleNamespace(rotation=np.tile(Rotation.from_rotvec([0.0, 0.0, 0.4]).as_matrix(), (5, 1, 1)))
    end = SimpleNamespace(after=SimpleNamespace(rotation=turned @ settled.rotation))
    way = np.array([0.01, 0.02])
    test = LoadingTest(way, way, way, way, rig, model, settled, None, end, 0.0, 0, 0.0, False)
    assert test.free.tolist() == [True, True, True, False, False]
    assert test.turning == pytest.approx(share, abs=1e-9)


def test_jaws_rise_as_the_points_do_that_they_touched_first():
    contacts = SimpleNamespace(
        bodies=np.array([[0, 3], [3, 1], [0, 1]]),
        arm=np.array([[[0.5, 0, 0.2], [0, 0, 0]], [[0, 0, 0], [0.5, 0, 0.4]], [[9.0, 9, 9], [9, 9, 9]]]),
    )
    start = SimpleNamespace(
        centre=np.array([[0.0, 0, 1], [0, 0, 2], [0, 0, 0], [0, 0, 0]]),
        rotation=np.tile(np.eye(3), (4, 1, 1)),
    )
    pushed = _Pushed(SimpleNamespace(contacts=contacts), np.array([3]), start)
    assert pushed.rise(start) == 0.0
    # the first is lifted by 2 cm; the second turns by 1/10, which lifts its arm of half a metre by 5 cm
    turn = Rotation.from_rotvec([0.0, -np.arcsin(0.1), 0.0]).as_matrix()
    lean = 0.4 * (1.0 - np.cos(np.arcsin(0.1)))
    later = SimpleNamespace(
        centre=start.centre + np.outer([0.02, 0.0, 9.0, 9.0], [0.0, 0.0, 1.0]), rotation=start.rotation.copy()
    )
    later.rotation[1] = turn
    assert pushed.rise(later) == pytest.approx(0.5 * (0.02 + 0.05 - lean))
    alone = _Pushed(SimpleNamespace(contacts=contacts), np.array([2]), start)
    assert alone.rise(later) == 0.0


def test_jaws_go_at_a_hundredth_of_the_speed_of_a_fall_through_their_way(monkeypatch):
    class Caught(Exception):
        pass

    def caught(scene, rig, path):
        raise Caught(path, scene.time)

    monkeypatch.setattr(loading, "rigged", caught)
    stone = scene(brick("a", (0, 0, 0), (0.6, 0.2, 1.0)))
    with pytest.raises(Caught) as raised:
        loading.loading_test(stone, Rig((1.0, 0.0, 0.0), 1.0, 1e3), (0.01, -0.02), 1e-3)
    path, time = raised.value.args
    speed = 0.01 * np.sqrt(2.0 * 9.81 * 0.02)
    assert path.until == pytest.approx((0.01 + 0.03) / speed)
    assert time.step == pytest.approx(1e-3 / speed)
    assert time.duration == pytest.approx(path.until + time.step)


def test_stones_that_do_not_come_to_rest_are_named_the_farthest_first(monkeypatch):
    ways = np.array([0.01, 0.03, 0.0149, 0.0151, 0.9])
    monkeypatch.setattr(loading, "displacement", lambda *_: ways)
    blocks = [SimpleNamespace(code=code) for code in ("A", "B", "C", "D", BEAM)]
    model = SimpleNamespace(fixed=np.zeros(5, bool), scene=SimpleNamespace(blocks=blocks, name="wall"))
    begin = SimpleNamespace(centre=np.arange(15.0).reshape(5, 3))
    # half of the way of the farthest stone, the beam left out
    assert "fallen: B at (3.00, 4.00, 5.00) m by 30 mm, D at (9.00, 10.00, 11.00) m by 15.1 mm" in (
        loading._restless(model, begin, None).what
    )


@pytest.mark.parametrize(
    ("degrees", "spin", "along"),
    [(0.0, 0.0, True), (2.0, 0.0, True), (6.0, 0.0, False), (0.0, 0.05, True), (0.0, 0.4, False)],
)
def test_stones_slide_along_one_line_within_a_few_degrees_and_without_turning(degrees, spin, along):
    """Two stones of a size of 0.4 m; a spin of 0.05 rad/s moves its corners by a hundredth of the way."""
    angle = np.radians(degrees)
    velocity = np.zeros((3, 6))
    velocity[1, 0] = 1.0
    velocity[2, :2] = np.cos(angle), np.sin(angle)
    velocity[2, 5] = spin
    on = SimpleNamespace(
        contacts=SimpleNamespace(bodies=np.zeros((0, 2), int), frame=np.zeros((0, 3, 3))),
        model=SimpleNamespace(surfaces=SimpleNamespace(size=np.full(3, 0.4))),
    )
    moves = Mechanism(velocity, np.array([0.0, 1.0, 1.0]), np.zeros(0, bool), np.zeros(0, bool))
    limit = SimpleNamespace(mechanism=moves, force=np.zeros((0, 3)))
    assert slides_along_one_line(on, limit) == along


@pytest.mark.parametrize(("candidate", "first"), [(0.5, 0.5), (0.5049, 0.5), (None, 0.998), (0.999, 0.998)])
def test_the_search_begins_at_a_whole_hundredth_of_the_bound_or_next_to_it(monkeypatch, candidate, first):
    steps = Stepping(0.47)
    monkeypatch.setattr(held, "_Steps", lambda on, live: steps)
    monkeypatch.setattr(held, "_falling", lambda on, trial: "falls")
    found = held.held_limit(None, None, SimpleNamespace(multiplier=1.0), candidate)
    assert steps.tried[:2] == [0.0, pytest.approx(first)]
    assert found.held < 0.47 <= found.lost
    assert found.lost - found.held == pytest.approx(0.002)


def curve(displacement, force, inertia=None):
    """A test with a curve by hand, in metres and newtons."""
    places, forces = np.array(displacement, dtype=float), np.array(force, dtype=float)
    lost = np.zeros(len(places)) if inertia is None else np.array(inertia, dtype=float)
    rig = Rig((1.0, 0.0, 0.0), 1.1, 40e3)
    return LoadingTest(places, forces, lost, places, rig, None, None, None, None, 0.0, 0, 0.0, False)


def test_secants_are_taken_where_the_curve_first_reaches_their_share_of_the_largest_force():
    # a polygon through (1, 20), (2, 30) and (4, 100)
    test = curve([1.0, 2.0, 4.0, 5.0], [20.0, 30.0, 100.0, 60.0])
    assert test.early_stiffness == pytest.approx(15.0 / 0.75)
    assert test.stiffness == pytest.approx(30.0 / 2.0)
    assert test.secant(0.65) == pytest.approx(65.0 / 3.0)
    backwards = curve([-1.0, -2.0, -4.0], [-20.0, -30.0, -100.0])
    assert backwards.secant(0.65) == pytest.approx(65.0 / 3.0)


def test_a_curve_is_that_of_its_first_branch_and_ends_there():
    test = curve([1.0, 2.0, 1.0, -1.0, -3.0], [10.0, 40.0, 5.0, -9.0, -50.0])
    assert test.first_branch == 2
    assert test.at(np.array([0.5, 1.0, 1.5, 2.0])) == pytest.approx([5.0, 10.0, 25.0, 40.0])
    assert np.isnan(test.at(np.array([2.1]))).all()
    turned = curve([-1.0, -2.0, -1.5], [-10.0, -40.0, -5.0])
    assert turned.first_branch == 2
    assert turned.at(np.array([-0.5, -1.5])) == pytest.approx([-5.0, -25.0])
    assert curve([1.0, 2.0], [10.0, 40.0]).first_branch == 2


def test_strengths_are_the_largest_forces_of_calm_steps_each_way():
    test = curve([1.0, 2.0, -1.0, -2.0], [40.0, 90.0, -60.0, -100.0], [0.5, 1.1, -0.9, 1.0])
    assert test.calm.tolist() == [True, False, True, True]
    assert test.strength == (40.0, -100.0)
    assert curve([1.0], [10.0]).strength == (10.0, 0.0)
