"""Results of joints against statics and kinematics by hand: blocks that press, lean, slide, rock and fly."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.results.interfaces import placed_faces
from mechanics.results.joints import joint_results, parting, starting_joints
from mechanics.results.postprocess import Observer
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Fidelity, Part
from mechanics.scene.shapes import BOX_FACES
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, detected, ground, moved, scene
from tests.pipelines.results_by_hand import box

G, DENSITY = 9.81, 2000.0
BOTH = pytest.mark.parametrize("fidelity", [Fidelity.RIGID, Fidelity.DEFORMABLE])
FALLING = {"stop_at_equilibrium": False, "theta": 0.5}


def between(result, first, second):
    """Number of the only joint of two stones."""
    codes = [body.code for body in result.bodies]
    wanted = sorted((codes.index(first), codes.index(second)))
    (number,) = [k for k, pair in enumerate(result.joints.bodies.tolist()) if pair == wanted]
    return number


@BOTH
def test_eccentric_blocks_press_where_their_weights_are(fidelity):
    """Overhang a: the upper joint b - a wide bears W at a/2 from its middle: kern 6 (a/2)/(b - a), edge a/(b - a).

    The lower one, b wide, bears 2 W at a/2 from the middle: kern 3 a/b. W = 9810 N.
    """
    a, weight = 0.3, DENSITY * G * 0.5
    one = scene(
        ground(),
        brick("low", (0, 0, 0), (1, 1, 0.5), fidelity),
        brick("up", (a, 0, 0.5), (1 + a, 1, 1.0), fidelity),
        step=0.01,
        duration=2.0,
    )
    result = simulate(one)
    joints, lower, upper = result.joints, between(result, "ground", "low"), between(result, "low", "up")
    assert len(joints) == 2
    assert joints.area[[lower, upper]] == pytest.approx([1.0, 0.7], rel=1e-4)
    assert -joints.force[[lower, upper], 2] == pytest.approx([2 * weight, weight], rel=1e-3)
    assert joints.kern[[lower, upper]] == pytest.approx([3 * a, 3 * a / (1 - a)], rel=2e-3)
    assert joints.edge[[lower, upper]] == pytest.approx([a, a / (1 - a)], rel=2e-3)
    assert joints.in_kern[[lower, upper]].tolist() == [True, False]
    assert joints.centre_of_pressure[upper] == pytest.approx([a + 0.5, 0.5, 0.5], abs=2e-3)
    assert joints.pressure_mean[[lower, upper]] == pytest.approx([2 * weight, weight / 0.7], rel=2e-3)
    # a linear pressure would reach 1 + kern times the mean; bearing on corners, it is more
    largest = joints.pressure_mean * (1 + joints.kern)
    assert (joints.pressure_max > joints.pressure_mean).all()
    assert (joints.pressure_max < 1.6 * largest).all()
    assert joints.sliding.max() < 1e-6
    assert not joints.parted.any()
    own = result.contacts.joint >= 0
    assert own.all()
    assert result.contacts.area.sum() == pytest.approx(joints.area.sum(), rel=1e-3)
    np.testing.assert_allclose(
        result.contacts.pressure * result.contacts.area,
        np.einsum("ci,ci->c", result.contacts.force, result.contacts.normal),
        atol=1e-9 * weight,
    )


@BOTH
def test_a_block_on_a_slope_leans_on_its_lower_side(fidelity):
    """Gravity under α: N = W cos α, e = (H/2) tan α, friction used tan α / μ."""
    slope, friction, height, width = np.radians(15.0), 0.6, 0.6, 1.0
    one = scene(
        ground(),
        brick("a", (0, 0, 0), (width, 0.8, height), fidelity),
        gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)),
        friction=friction,
        step=0.01,
        duration=2.0,
    )
    result = simulate(one)
    joints, weight = result.joints, DENSITY * G * width * 0.8 * height
    assert len(joints) == 1
    away = height / 2 * np.tan(slope)
    assert np.linalg.norm(joints.eccentricity[0]) == pytest.approx(away, rel=2e-3)
    assert joints.centre_of_pressure[0] == pytest.approx([width / 2 + away, 0.4, 0.0], abs=1e-3)
    assert joints.kern[0] == pytest.approx(6 * away / width, rel=2e-3)
    assert joints.friction_use[0] == pytest.approx(np.tan(slope) / friction, rel=2e-3)
    assert joints.force[0] == pytest.approx(
        [weight * np.sin(slope), 0.0, -weight * np.cos(slope)], abs=1e-3 * weight
    )
    assert joints.slipping[0] == 0.0


def test_a_block_that_was_pushed_has_slid_as_far_as_it_moved():
    """v²/(2 μ g), and all of it slides while it does."""
    speed, friction = 2.0, 0.5
    one = scene(
        ground((-2, -2, -1), (6, 3, 0)),
        brick("a", (0, 0, 0), (1, 1, 0.3), velocity=(speed, 0, 0, 0, 0, 0)),
        friction=friction,
        step=1e-3,
        duration=0.5,
        stop_at_equilibrium=False,
    )
    result = simulate(one)
    joint = between(result, "ground", "a")
    moved_by = result.bodies[1].displacement[0, 0]
    assert moved_by == pytest.approx(speed**2 / (2 * friction * G), rel=5e-3)
    assert result.joints.sliding[joint] == pytest.approx(moved_by, rel=1e-9)
    assert result.contacts.slide == pytest.approx(moved_by, rel=1e-9)
    moving = simulate(replace(one, time=replace(one.time, duration=0.1)))
    assert moving.joints.slipping[joint] == pytest.approx(1.0)
    assert moving.joints.friction_use[joint] == pytest.approx(1.0, rel=1e-6)


def test_slipping_and_open_are_parts_of_the_area_not_of_the_points():
    """Four points that stand for 1, 2, 3 and 4 parts of ten of the area of a joint."""
    one = scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.5)), step=0.01)
    model, start = build_model(one)
    step, observer = Simulation(model, start).step(), Observer(model, start)
    observer.begin(step)
    contacts, joints = observer.contacts_and_joints(step)
    assert joints.area == pytest.approx(contacts.area.sum())
    known = starting_joints(model, start, step.contacts)
    faces = placed_faces(model, step.after)
    area = joints.area * np.array([0.1, 0.2, 0.3, 0.4])
    for status, slipping, idle in (
        (("slip", "open", "stick", "broken"), 0.1, 0.6),
        (("stick", "slip", "slip", "open"), 0.5, 0.4),
        (("bonded", "bonded", "stick", "stick"), 0.0, 0.0),
    ):
        given = replace(contacts, area=area, status=np.array(status))
        found = joint_results(model, known, faces, known.face, step, given)
        assert (found.slipping, found.open) == (pytest.approx([slipping]), pytest.approx([idle]))


@pytest.mark.parametrize(("duration", "least"), [(0.45, 0.5), (0.85, 20.0)])
def test_a_toppling_block_opens_its_joint_and_leans_on_its_edge(duration, least):
    """Turned by φ about its edge, a block b wide opens the joint by 2 b sin(φ/2), across the mean of both planes."""
    width = 0.5
    one = scene(
        ground(),
        brick("a", (0, 0, 0), (width, 1, 2.0)),
        gravity=(0.35 * G, 0.0, -G),
        friction=0.9,
        step=1e-3,
        duration=duration,
        **FALLING,
    )
    result = simulate(one)
    position = result.bodies[1].position
    turn = np.arcsin((position[0, 2] - position[1, 2]) / width)
    assert np.radians(least) < turn < np.radians(30)
    joints = result.joints
    assert joints.gap[0] == pytest.approx(2 * width * np.sin(turn / 2), rel=1e-5)
    assert joints.opening[0] == pytest.approx(joints.gap[0], rel=1e-3)
    assert joints.edge[0] == pytest.approx(1.0, abs=1e-3)
    assert joints.kern[0] == pytest.approx(3.0, rel=5e-3)
    assert not joints.in_kern[0]


def test_a_joint_that_has_parted_is_not_forgotten():
    """A block thrown up and away: opening and sliding are how far it flew, up and along."""
    one = scene(
        ground(),
        brick("a", (0, 0, 0), (0.5, 0.5, 0.5), velocity=(1.0, 0.5, 3.0, 0, 0, 0)),
        step=1e-3,
        duration=0.2,
        **FALLING,
    )
    result = simulate(one)
    flight = result.bodies[1].displacement[0]
    joints = result.joints
    assert joints.parted.tolist() == [True]
    assert joints.opening[0] == pytest.approx(flight[2])
    assert joints.sliding[0] == pytest.approx(np.hypot(*flight[:2]))
    assert joints.open[0] == 1.0
    assert np.isnan(joints.kern[0])
    assert joints.force[0] == pytest.approx([0.0, 0.0, 0.0])
    # what was the joint goes with the second stone
    foot = result.bodies[1].position[result.bodies[1].reference[:, 2] == 0.0]
    assert sorted(joints.polygon[0].tolist()) == pytest.approx(np.array(sorted(foot.tolist())))
    assert joints.centroid[0] == pytest.approx(foot.mean(axis=0))


@pytest.mark.parametrize("gap", [0.007, 0.02])
def test_stones_that_were_only_near_each_other_do_not_part(gap):
    """A block that flies past above the ground, by more than a hundredth of its width, has not left it."""
    one = scene(
        ground(),
        brick("a", (0, 0, gap), (0.5, 0.5, gap + 0.5), velocity=(0, 0, 2.0, 0, 0, 0)),
        step=1e-3,
        duration=0.1,
        **FALLING,
    )
    result = simulate(one)
    assert result.joints.parted.tolist() == [False]
    assert result.joints.opening[0] == pytest.approx(result.bodies[1].displacement[0, 2])
    assert result.joints.gap[0] == pytest.approx(result.bodies[1].displacement[0, 2] + gap)


def test_a_joint_that_is_found_later_comes_after_those_of_the_start():
    one = scene(
        ground(),
        brick("fallen", (0, 0, 0.2), (0.5, 0.5, 0.7)),
        brick("there", (1, 0, 0), (1.5, 0.5, 0.5)),
        step=1e-3,
        duration=1.0,
    )
    result = simulate(one)
    assert result.joints.bodies.tolist() == [[0, 2], [0, 1]]
    assert sorted(set(result.contacts.joint.tolist())) == [0, 1]
    assert all((frame.contacts.joint < 2).all() for frame in result.frames)


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.5])
def test_mortar_shares_the_shear_with_friction(friction):
    """Friction used: W sin α / (μ W cos α + c A) on 1 m²; without cohesion and friction it is not known."""
    slope, cohesion, weight = np.radians(10.0), 5e3, DENSITY * G * 0.5
    one = scene(
        ground(),
        brick("a", (0, 0, 0), (1, 1, 0.5)),
        gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)),
        step=5e-3,
        duration=1.0,
    )
    law = MortarJoint(friction, tension=1e4, shear=cohesion)
    joints = simulate(replace(one, contact=replace(one.contact, law=law))).joints
    capacity = friction * weight * np.cos(slope) + cohesion
    assert joints.friction_use[0] == pytest.approx(weight * np.sin(slope) / capacity, rel=1e-4)
    level = scene(ground(), brick("a", (0, 0, 0), (1, 1, 0.5)), friction=friction, duration=0.1)
    assert np.isnan(simulate(level).joints.friction_use[0]) == (friction == 0.0)


def test_a_joint_that_was_not_there_at_the_start_is_open_by_its_gap():
    """A block that fell from 0.2 m is 9.6 mm above the ground after 0.197 s: near enough for a joint, but open."""
    fallen, height = brick("a", (0, 0, 0.2), (0.5, 0.5, 0.7)), 0.2 - 0.5 * G * 0.197**2
    joints = simulate(scene(ground(), fallen, step=1e-3, duration=0.197, **FALLING)).joints
    assert (joints.gap, joints.opening) == (pytest.approx([height]), pytest.approx([height]))
    assert joints.open.tolist() == [1.0]
    assert not joints.parted.any()


def test_a_gap_that_was_there_at_the_start_is_no_opening():
    """Two stones on the ground, 4 mm apart."""
    one = scene(
        ground(), brick("a", (0, 0, 0), (0.5, 0.5, 0.5)), brick("b", (0.504, 0, 0), (1, 0.5, 0.5)), step=0.01
    )
    result = simulate(one)
    between_them = between(result, "a", "b")
    assert result.joints.gap[between_them] == pytest.approx(0.004)
    assert result.joints.opening == pytest.approx(0.0, abs=1e-7)
    assert result.joints.open[between_them] == 1.0


def test_stones_that_turn_together_do_not_slide():
    _, start, contacts = detected(scene(ground(), brick("a", (0, 0, 0), (1, 1, 1))))
    turn = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
    turned = replace(start, centre=start.centre @ turn.T + 3.0, rotation=turn @ start.rotation)
    there = replace(contacts, frame=contacts.frame @ turn.T)
    for still in parting(there, start, turned):
        assert still == pytest.approx(0.0, abs=1e-12)
    pushed = turned.centre.copy()
    pushed[1] += turn @ [0.01, 0.0, 0.02]
    opening, slid = parting(there, start, replace(turned, centre=pushed))
    sign = np.where(contacts.bodies[:, :1] == 1, 1.0, -1.0)
    np.testing.assert_allclose(sign * slid @ turn, np.tile([0.01, 0.0, 0.0], (len(slid), 1)), atol=1e-12)
    assert opening == pytest.approx(0.02)


def test_a_stone_of_two_parts_has_a_joint_for_each_face_that_touches():
    """An arch of one stone: two feet on the ground, and each bears half of the weight."""
    feet = [box((0, 0, 0), (0.3, 1, 0.6)), box((0.7, 0, 0), (1.0, 1, 0.6))]
    top = box((0, 0, 0.6), (1.0, 1, 1.0))
    outline = np.array(
        [
            [x, y, z]
            for y in (0, 1)
            for x, z in ((0, 0), (0.3, 0), (0.3, 0.6), (0.7, 0.6), (0.7, 0), (1, 0), (1, 1), (0, 1))
        ],
        dtype=float,
    )
    ring = list(range(8))
    sides = [(a, (a + 1) % 8, (a + 1) % 8 + 8, a + 8) for a in ring]
    # the front is not convex; faces are for its volume and for pictures
    faces = (tuple(ring), tuple(reversed([a + 8 for a in ring])), *(side[::-1] for side in sides))
    stone = replace(
        brick("gate", (0, 0, 0), (1, 1, 1)),
        vertices=outline,
        faces=faces,
        parts=tuple(Part(part, BOX_FACES) for part in (*feet, top)),
    )
    result = simulate(scene(ground(), stone, step=0.01))
    assert result.joints.bodies.tolist() == [[0, 1], [0, 1]]
    assert sorted(result.joints.centroid[:, 0]) == pytest.approx([0.15, 0.85], abs=1e-6)
    weight = DENSITY * G * (1.0 - 0.4 * 0.6)
    assert -result.joints.force[:, 2] == pytest.approx([weight / 2] * 2, rel=1e-4)


def test_contact_points_are_where_the_stones_are_at_the_end():
    """A block rides on ground that goes by 20 mm in a step."""
    ride = ImposedMotion(frozenset({"ground"}), History.constant([2.0, 0.0, 0.0]))
    block = brick("a", (0, 0, 0), (0.5, 0.5, 0.5), velocity=(2.0, 0, 0, 0, 0, 0))
    one = replace(scene(ground(), block, step=0.01, duration=0.05), loads=Loads(motions=(ride,)))
    result = simulate(one)
    foot = result.bodies[1].position[result.bodies[1].reference[:, 2] == 0.0]
    assert foot[:, 0].min() == pytest.approx(0.1, abs=1e-6)
    there = [
        result.contacts.point[np.lexsort(result.contacts.point.T.round(3))],
        foot[np.lexsort(foot.T.round(3))],
    ]
    np.testing.assert_allclose(*there, atol=1e-6)


def test_edges_make_no_joint():
    """A cube that stands on its edge touches the ground in a line."""
    turn = Rotation.from_euler("y", 45, degrees=True).as_matrix()
    cube = moved(brick("a", (-0.25, -0.25, -0.25), (0.25, 0.25, 0.25)), turn, (0, 0, 0.25 * np.sqrt(2)))
    result = simulate(scene(ground(), cube, step=1e-3, duration=5e-3, **FALLING))
    assert len(result.contacts.joint) > 0
    assert (result.contacts.joint == -1).all()
    assert len(result.joints) == 0


@BOTH
def test_frames_know_velocity_stress_and_contacts(fidelity):
    one = replace(
        scene(
            ground(),
            brick("a", (0, 0, 0.3), (0.5, 0.5, 0.8), fidelity, velocity=(0.2, 0, 0, 0, 0, 0)),
            step=1e-3,
            duration=0.4,
            stop_at_equilibrium=False,
        ),
        frame_every=100,
    )
    result = simulate(one)
    assert [frame.time for frame in result.frames] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    falling = result.frames[1]
    np.testing.assert_allclose(
        falling.velocities[1], np.tile([0.2, 0.0, -G * 0.1], (len(falling.positions[1]), 1)), atol=1e-9
    )
    assert len(falling.contacts.gap) == 0
    assert len(result.frames[-1].contacts.gap) > 0
    assert falling.stresses[0] is None
    if fidelity is Fidelity.DEFORMABLE:
        landed = result.frames[-1].stresses[1]
        assert np.abs(falling.stresses[1]).max() < 1e-6 * np.abs(landed).max()
        np.testing.assert_allclose(landed, result.bodies[1].stress)
        assert result.frames[-1].stress_errors[1] == result.bodies[1].values.error
    else:
        assert falling.stresses[1] is None


def test_a_model_of_balls_has_no_joints():
    from mechanics.model.balls import ball

    model, _ = build_model(scene(ground(), brick("a", (0, 0, 0), (1, 1, 1))))
    assert model.rigid_only
    result = simulate(
        scene(ground(), ball("b", (0.0, 0.0, 0.2), 0.2, model.scene.blocks[0].material), step=0.01)
    )
    assert len(result.joints) == 0
    assert (result.contacts.joint == -1).all()
