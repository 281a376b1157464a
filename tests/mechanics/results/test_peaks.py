"""Largest values of a run, and time series, against kinematics and statics by hand."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.results.joints import SLIVER
from mechanics.results.patch_pressure import patch_pressure
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Fidelity, Part
from mechanics.scene.shapes import BOX_FACES
from mechanics.simulate import simulate
from mechanics.stones.elasticity.tensors import principal, von_mises
from tests.mechanics.shapes import brick, ground, scene
from tests.pipelines.results_by_hand import box

G, DENSITY = 9.81, 2000.0
STEP = 1e-3
ALWAYS = {"stop_at_equilibrium": False, "step": STEP}


@pytest.fixture(scope="module")
def thrown():
    """A cube of half a metre, thrown up by v = 0.5 m/s: it rises by v²/2g = 12.7 mm in v/g = 51 ms, and falls back."""
    cube = brick("cube", (0, 0, 0), (0.5, 0.5, 0.5), velocity=(0, 0, 0.5, 0, 0, 0))
    one = scene(ground(), cube, theta=0.5, duration=0.15, **ALWAYS)
    return simulate(replace(one, series=("cube", "ground"), frame_every=10))


def test_a_stone_that_comes_back_keeps_the_peak_of_its_way(thrown):
    """The end, after the stone has fallen back, knows nothing of it."""
    rise, peaks = 0.5**2 / (2 * G), thrown.peaks
    assert np.isnan(peaks.displacement.value[0])  # the ground is fixed
    assert peaks.displacement.value[1] == pytest.approx(rise, rel=1e-3)
    assert peaks.displacement.time[1] == pytest.approx(0.5 / G, abs=2 * STEP)
    assert np.abs(thrown.bodies[1].displacement).max() < 0.02 * rise
    assert peaks.relative.value[1] == peaks.displacement.value[1]
    # the joint opened as far as the stone rose, and both its stones know the other
    assert peaks.opening.value == pytest.approx(rise, rel=1e-3)
    assert peaks.opening.partner.tolist() == [1, 0]
    assert peaks.opening.time == pytest.approx(0.5 / G, abs=2 * STEP)
    assert thrown.joints.opening[0] < 0.02 * rise
    # it falls back in 2v/g, and stops in one step: 0.5 m/s · 250 kg / 1 ms, against a weight of 2.45 kN
    assert peaks.pressure.time == pytest.approx(2 * 0.5 / G, abs=2 * STEP)
    assert (peaks.pressure.value > 10 * thrown.joints.pressure_max[0]).all()


def test_the_peak_is_found_between_the_frames(thrown):
    """Without frames there are the same peaks."""
    without = simulate(replace(thrown.scene, frame_every=0))
    assert len(without.frames) == 2
    for name in ("displacement", "opening", "sliding", "pressure"):
        np.testing.assert_array_equal(getattr(without.peaks, name).value, getattr(thrown.peaks, name).value)


def test_the_series_holds_free_flight_and_then_the_weight(thrown):
    """z = v t - g t²/2 in flight; once back, the joint carries the weight W = 2452 N."""
    series, weight = thrown.series, DENSITY * G * 0.5**3
    assert series.body.tolist() == [1, 0]
    assert len(series.time) == thrown.steps
    flying = series.time < 0.09
    t = series.time[flying]
    rise = series.centre[flying, 0, 2] - 0.25
    assert rise == pytest.approx(0.5 * t - G * t**2 / 2, abs=0.5 * STEP * 0.5)
    assert series.velocity[flying, 0, 2] == pytest.approx(0.5 - G * t, abs=G * STEP)
    assert (series.centre[:, 1] == series.centre[0, 1]).all()
    joints = series.joints
    assert joints.joint.tolist() == [0]
    assert joints.opening[flying, 0] == pytest.approx(rise, abs=1e-9)
    assert (joints.normal[flying & (series.time > 0.01), 0] == 0).all()
    assert joints.normal[-1, 0] == pytest.approx(weight, rel=1e-2)
    assert joints.shear[-1, 0] < 1e-3 * weight


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_joint_opens_by_its_widest_corner_whichever_that_is(way):
    """A slender block begins to tip about an edge of its foot, to either side."""
    block = brick("cube", (0, 0, 0), (0.25, 0.5, 1.0))
    one = scene(
        ground(), block, gravity=(0.5 * G * way, 0, -G), theta=0.5, duration=0.2, **(ALWAYS | {"step": 4e-3})
    )
    result = simulate(replace(one, series=("cube", "ground")))
    turn = np.linalg.norm(result.series.turn[-1, 0])
    assert turn > 0.02
    assert result.series.joints.opening[-1, 0] == pytest.approx(0.25 * turn, rel=0.02)


def test_turns_are_those_since_the_start():
    """A cube in free flight turns by ω t about its axis."""
    cube = brick("cube", (0, 0, 1), (0.5, 0.5, 1.5), velocity=(0, 0, 0, 0, 0, 2.0))
    one = scene(ground(), cube, gravity=(0, 0, 0), theta=0.5, duration=0.3, **ALWAYS)
    series = simulate(replace(one, series=("cube",))).series
    assert series.turn[:, 0, 2] == pytest.approx(2.0 * series.time, rel=1e-6)
    assert series.turn[:, 0, :2] == pytest.approx(0.0, abs=1e-12)
    assert series.velocity[:, 0, 5] == pytest.approx(2.0)
    assert series.joints.normal.shape == (len(series.time), 0)


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, Fidelity.DEFORMABLE])
def test_motion_of_the_ground_is_no_motion_relative_to_it(fidelity):
    """The ground goes 20 mm aside and comes back, slowly enough that its stone rides on it."""
    there = History(
        np.array([0.0, 0.1, 0.2, 0.3, 0.4]), np.array([0, 0.2, 0, -0.2, 0])[:, None] * [1.0, 0, 0]
    )
    one = scene(ground(), brick("cube", (0, 0, 0), (0.5, 0.5, 0.5), fidelity), duration=0.5, **ALWAYS)
    result = simulate(replace(one, loads=Loads(motions=(ImposedMotion(frozenset({"ground"}), there),))))
    peaks = result.peaks
    assert peaks.displacement.value[1] == pytest.approx(0.02, rel=0.02)
    assert peaks.displacement.time[1] == pytest.approx(0.2, abs=2 * STEP)
    assert peaks.relative.value[1] < 2e-4
    assert peaks.relative_end[1] < 2e-4
    # the ground pulls by m a = 2 m/s² of the mass; an elastic stone sways besides
    least = 2.0 * result.weight / G
    assert peaks.shear.value == pytest.approx(least, rel=1e-3 if fidelity is Fidelity.RIGID else 0.5)
    assert peaks.shear.end < 0.2 * least


@pytest.fixture(scope="module")
def pressed():
    """A stone of weight W, pressed by up to P = 5 kN at 0.2 s, and by nothing in the end; a frame of every step."""
    push = History(np.array([0.1, 0.2, 0.3]), np.array([0.0, -5000.0, 0.0])[:, None] * [0, 0, 1.0])
    one = scene(ground(), brick("cube", (0, 0, 0), (0.5, 0.5, 0.5)), duration=0.4, **ALWAYS)
    loads = Loads(forces=(StoneForce(frozenset({"cube"}), push),))
    return simulate(replace(one, loads=loads, frame_every=1))


def test_a_passing_load_leaves_its_peak(pressed):
    """The reaction was W + P; after it W is left."""
    weight, peaks = DENSITY * G * 0.5**3, pressed.peaks
    assert peaks.reaction.value == pytest.approx(weight + 5000.0, rel=1e-2)
    assert peaks.reaction.time == pytest.approx(0.2, abs=2 * STEP)
    assert peaks.reaction.end == pytest.approx(weight, rel=1e-3)
    assert peaks.pressure.time == pytest.approx(0.2, abs=2 * STEP)
    assert np.isnan(peaks.von_mises.value).all()


def test_the_peak_of_pressure_is_that_of_patches_in_every_step(pressed):
    """The readable computation, on the contact points of every frame."""
    largest = 0.0
    for frame in pressed.frames[1:]:
        own = frame.contacts
        force = own.pressure * own.area
        largest = max(largest, patch_pressure(own.point, force, own.area, own.joint).max())
    assert pressed.peaks.pressure.value == pytest.approx(largest, rel=1e-9)


def test_stresses_have_their_peaks_in_the_frames():
    """Put down at once, an elastic stone bounces: its stress is largest at about half a period, not at the end."""
    cube = brick("cube", (0, 0, 0), (0.5, 0.5, 0.5), Fidelity.DEFORMABLE)
    one = scene(ground(), cube, theta=1.0, duration=0.05, **ALWAYS)
    result = simulate(replace(one, frame_every=1))
    peaks, stresses = result.peaks, [frame.stresses[1] for frame in result.frames]
    largest = [von_mises(stress).max() for stress in stresses]
    assert peaks.von_mises.value[1] == max(largest)
    assert peaks.von_mises.time[1] == result.frames[int(np.argmax(largest))].time
    assert peaks.von_mises.value[1] > result.bodies[1].values.von_mises_max
    assert peaks.compression.value[1] == pytest.approx(
        max(-principal(stress)[0].min() for stress in stresses)
    )
    assert np.isnan(peaks.von_mises.value[0])


def test_a_stone_on_a_splinter_says_nothing_of_pressure():
    """An overlap of 1 mm bears the same force as a face, on less than the two-hundredth part of its area."""
    cubes = [brick("low", (0, 0, 0), (0.5, 0.5, 0.5)), brick("up", (0.499, 0, 0.5), (0.999, 0.5, 1.0))]
    props = brick("prop", (0.55, 0, 0), (0.999, 0.5, 0.5), Fidelity.FIXED)
    result = simulate(scene(ground(), *cubes, props, step=0.01, duration=0.1))
    joints = result.joints
    narrow = joints.area < SLIVER * 0.25
    assert narrow.any()
    np.testing.assert_array_equal(joints.sliver, narrow)
    assert result.peaks.pressure.value.max() == pytest.approx(joints.pressure_max[~narrow].max())


@pytest.mark.parametrize("order", [1, -1])
def test_joints_of_two_stones_keep_their_forces_apart_whichever_stone_is_first(order):
    """A stone of 9.81 kN in a slot, without friction, pushed against its right side by 3 kN."""
    parts = ((-1, -1, -1), (2, 2, 0)), ((-1, -1, 0), (0, 2, 1)), ((1, -1, 0), (2, 2, 1))
    ring = [(-1, -1), (2, -1), (2, 1), (1, 1), (1, 0), (0, 0), (0, 1), (-1, 1)]
    outline = np.array([[x, y, z] for y in (-1, 2) for x, z in ring], dtype=float)
    front = tuple(range(8))
    sides = [(a, a + 8, (a + 1) % 8 + 8, (a + 1) % 8) for a in front]
    slot = replace(
        brick("slot", *parts[0], Fidelity.FIXED),
        vertices=outline,
        faces=(front, tuple(a + 8 for a in reversed(front)), *sides),
        parts=tuple(Part(box(*one), BOX_FACES) for one in parts),
    )
    stones = (slot, brick("stone", (0, 0, 0), (1, 1, 0.5)))[::order]
    push = StoneForce(frozenset({"stone"}), History.constant([3e3, 0.0, 0.0]))
    one = scene(*stones, friction=0.0, step=5e-3, duration=0.1)
    result = simulate(replace(one, loads=Loads(forces=(push,)), series=("stone", "slot")))
    joints = result.joints
    across = np.einsum("ji,ji->j", joints.force, joints.frame[:, 0])
    assert sorted(across) == pytest.approx([0.0, 3e3, 9810.0], rel=1e-6, abs=1e-3)
    assert result.series.joints.normal[-1] == pytest.approx(across, rel=1e-6, abs=1e-3)


@pytest.mark.parametrize("order", [1, -1])
def test_a_support_bears_the_weight_whichever_stone_is_named_first(order):
    """W = 250 kg · g of the cube; forces act on the first stone of a contact."""
    blocks = [ground(), brick("cube", (0, 0, 0), (0.5, 0.5, 0.5))][::order]
    peaks = simulate(scene(*blocks, duration=0.01, **ALWAYS)).peaks
    assert peaks.reaction.value == pytest.approx(250.0 * G, rel=1e-3)


def test_shear_reaction_and_pressure_have_instants_of_their_own():
    """A stone of W = 530 N on a wide ground is pushed aside by 0.2 kN at 0.1 s, and down by 1 kN at 0.2 s."""
    at = np.array([0.05, 0.1, 0.15, 0.2, 0.25])
    aside, down = (np.array(one)[:, None] for one in ([0, 200.0, 0, 0, 0], [0, 0, 0, -1e3, 0]))
    push = History(at, aside * [1.0, 0, 0] + down * [0, 0, 1.0])
    one = scene(ground(), brick("cube", (0, 0, 0), (0.3, 0.3, 0.3)), step=5e-3, duration=0.3)
    peaks = simulate(replace(one, loads=Loads(forces=(StoneForce(frozenset({"cube"}), push),)))).peaks
    most = DENSITY * G * 0.3**3 + 1e3
    assert (peaks.shear.value, peaks.shear.time) == pytest.approx((200.0, 0.1), rel=0.06)
    assert (peaks.reaction.value, peaks.reaction.time) == pytest.approx((most, 0.2), rel=0.06)
    assert peaks.shear.end == pytest.approx(0.0, abs=0.1)
    assert peaks.pressure.time == pytest.approx([0.2, 0.2], abs=0.01)
    assert (peaks.pressure.value > 0.9 * most / 0.09).all()
