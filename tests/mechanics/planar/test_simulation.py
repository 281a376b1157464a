"""Steps of the plane: loads, driven walls, energy, rest, and what must not depend on place, turn, order or threads."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError, SolverError
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Clock
from mechanics.planar.contacts import PlanarDetector
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import simulate_planar
from mechanics.planar.simulation import PlanarSimulation
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp, TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import LawRule, Method, SolverSettings
from tests.mechanics.planar.shapes import ACCURATE, G, box, grid_of_disks

FLOOR = Wall("floor", (-10.0, 0.0), (10.0, 0.0))
GOES_ON = {"stop_at_equilibrium": False}


def disk(code="d", centre=(0.0, 0.1), radius=0.1, **more):
    return Disk(code, centre, radius, **more)


def run(*disks, walls=(FLOOR,), friction=0.5, time=None, **more):
    return simulate_planar(
        PlanarScene(
            "test", disks, walls, law=DryJoint(friction), time=time or PlanarTime(), solver=ACCURATE, **more
        )
    )


def weight_of(radius=0.1, density=2400.0):
    return density * np.pi * radius**2 * G


def test_a_disk_at_rest_is_in_equilibrium_after_five_steps_and_the_floor_bears_it():
    result = run(disk())
    assert result.outcome is Outcome.EQUILIBRIUM
    # the first step cannot know whether the loads are steady
    assert result.steps == 6
    assert result.weight == pytest.approx(weight_of(), rel=1e-14)
    assert result.reaction == pytest.approx(weight_of(), rel=1e-12)
    assert result.contacts.status.tolist() == ["stick"]
    np.testing.assert_allclose(result.contacts.force, [[0.0, weight_of()]], atol=1e-9)
    np.testing.assert_allclose(result.position[0], [0.0, 0.1, 0.0], atol=1e-15)


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
def test_energy_is_accounted_for_to_rounding_in_a_falling_heap(theta):
    centres, radii = grid_of_disks(6, 5)
    result = simulate_planar(box(centres, radii, time=PlanarTime(1e-3, theta, 0.15), friction=0.4))
    assert result.history.contacts.max() > 20
    assert result.errors.energy < 1e-12


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_contacts_only_take_energy(theta):
    # Σ r·u_θ ≤ 0 with inelastic laws: a heap that falls never has more energy than it had
    centres, radii = grid_of_disks(6, 5)
    scene = box(centres, radii, time=PlanarTime(1e-3, theta, 0.2, **GOES_ON), friction=0.4)
    model, start = build_planar_model(scene)
    simulation = PlanarSimulation(model, start, Clock())
    works = np.array([simulation.step().work for _ in range(200)])
    assert works.min() < 0
    # θ = 1/2 may give back what landing before the kick has cost, never more than it had
    assert np.cumsum(works).max() <= 1e-15
    if theta == 1.0:
        assert works.max() <= 1e-15


@pytest.mark.parametrize("theta", [0.5, 0.7, 1.0])
def test_a_lift_carries_a_disk_without_sinking_in_and_puts_in_the_work(theta):
    # up by a parabola: velocity 0.5 t, so 0.25 m after 1 s; the floor bears m (g + 0.5) and does that work
    rise = History(np.array([0.0, 2.0]), np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    loads = Loads(motions=(ImposedMotion(frozenset({"floor"}), rise),))
    scene = PlanarScene(
        "lift", (disk(),), (FLOOR,), time=PlanarTime(1e-2, theta, 1.0), solver=ACCURATE, loads=loads
    )
    model, start = build_planar_model(scene)
    simulation = PlanarSimulation(model, start, Clock())
    steps = [simulation.step() for _ in range(100)]
    mass = weight_of() / G
    assert steps[-1].after.centre[1, 1] == pytest.approx(0.25, abs=1e-12)
    # by the first kick the floor has come a (h (1-θ))²/2 nearer; it never comes nearer at a kick
    nearer = 0.5 * (1e-2 * (1 - theta)) ** 2 / 2
    np.testing.assert_allclose([step.contacts.gap[0] for step in steps], -nearer, atol=1e-14)
    # and between two kicks at most by what a chord and an arc differ
    assert abs(steps[-1].after.centre[0, 1] - 0.35) <= 0.5 * 1e-4 / 8 + 1e-12
    assert steps[-1].impulse[0, 0] / 1e-2 == pytest.approx(mass * (G + 0.5), rel=1e-9)
    # the first and the last of 100 steps count for the difference
    assert sum(step.driven for step in steps) == pytest.approx(mass * (G + 0.5) * 0.25, rel=2e-2)


def test_a_belt_takes_a_disk_along():
    # a plate moves at 1 m/s under a disk at rest: friction gives it μ g until its lowest point keeps up;
    # v = 1/3 of the plate's speed then, as two thirds of the slip go into turning
    belt = ImposedMotion(frozenset({"floor"}), History.constant([1.0, 0.0, 0.0]))
    result = run(
        disk(), friction=0.3, time=PlanarTime(1e-4, 1.0, 0.3, **GOES_ON), loads=Loads(motions=(belt,))
    )
    vx, vy, spin = result.velocity[0]
    assert vx == pytest.approx(1 / 3, rel=1e-9)
    assert vx + spin * 0.1 == pytest.approx(1.0, rel=1e-9)
    assert abs(vy) < 1e-12


def test_a_turning_wall_lifts_a_disk_at_its_own_pace():
    # a frictionless plate turns about the origin by 0.1 rad/s; the disk is held by an upright wall at its left
    spin = ImposedMotion(frozenset({"plate"}), spin=History.constant(0.1))
    plate, post = Wall("plate", (0.0, 0.0), (2.0, 0.0)), Wall("post", (0.9, -1.0), (0.9, 3.0))
    result = simulate_planar(
        PlanarScene(
            "turn",
            (disk(centre=(1.0, 0.1)),),
            (plate, post),
            gravity=(-1.0, -G),
            law=DryJoint(0.0),
            time=PlanarTime(1e-3, 1.0, 1.0, **GOES_ON),
            solver=ACCURATE,
            loads=Loads(motions=(spin,)),
        )
    )
    # it stays at x = 1 and 0.1 above the plate: y cos φ - sin φ = 0.1
    angle = 0.1
    assert result.position[1, 2] == pytest.approx(angle, rel=1e-12)
    assert result.position[0, 0] == pytest.approx(1.0, abs=1e-9)
    # contacts are linear in a step: the overlap they leave is at most (ω h)² of a metre, for 1000 steps
    assert result.position[0, 1] == pytest.approx((0.1 + np.sin(angle)) / np.cos(angle), abs=1e-5)


def test_a_force_pushes_along_and_turns():
    # F = 3 N on the rim at the top of a free disk: a = F/m, ω' = F R/J = 2 F/(m R)
    push = StoneForce(frozenset({"d"}), History.constant([3.0, 0.0, 0.0]), arm=(0.0, 0.1, 0.0), follows=False)
    result = simulate_planar(
        PlanarScene(
            "push",
            (disk(),),
            gravity=(0.0, 0.0),
            time=PlanarTime(1e-3, 0.5, 1e-3),
            loads=Loads(forces=(push,)),
        )
    )
    mass = weight_of() / G
    np.testing.assert_allclose(
        result.velocity[0], [3e-3 / mass, 0.0, -2 * 3e-3 / (mass * 0.1)], rtol=1e-9, atol=1e-18
    )


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_what_is_hit_is_stopped_by_what_nobody_watched(theta):
    # the first disk hits the second with 10 m/s, which leaves with 5 m/s; the third is at 0.6 of what that is until the
    # next kick, far beyond the alert distance, and before the impact nothing moved towards it
    second = 0.2 + 10.0 * 1e-2 * (1 - theta)
    disks = (
        disk("a", (0.0, 0.0), velocity=(10.0, 0.0, 0.0)),
        disk("b", (second, 0.0)),
        disk("c", (second + 0.2 + 0.6 * 5.0 * 1e-2, 0.0)),
    )
    scene = PlanarScene(
        "row",
        disks,
        gravity=(0.0, 0.0),
        law=DryJoint(0.0),
        time=PlanarTime(1e-2, theta, 1.0),
        solver=ACCURATE,
    )
    model, start = build_planar_model(scene)
    assert len(PlanarDetector(model)(start)) == 1
    simulation = PlanarSimulation(model, start, Clock())
    step = simulation.step()
    assert step.contacts.bodies.tolist() == [[0, 1], [1, 2]]
    # at the next kick they touch
    np.testing.assert_allclose(simulation.step().contacts.gap, 0.0, atol=1e-12)


def test_nothing_rests_while_gravity_grows():
    result = run(disk(), loads=Loads(gravity=(GravityRamp(0.1),)), time=PlanarTime(1e-3, 1.0, 1.0))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.time > 0.1
    assert result.reaction == pytest.approx(weight_of(), rel=1e-9)


def test_a_table_that_tilts_sends_a_disk_rolling():
    # tan of 0.2 rad is below 3 μ: it rolls down with two thirds of g sin
    table = TiltingTable((0.0, 0.0, 1.0), History.constant(0.2))
    result = run(disk(), time=PlanarTime(1e-3, 0.5, 0.2, **GOES_ON), loads=Loads(gravity=(table,)))
    assert abs(result.velocity[0, 0]) == pytest.approx(2 / 3 * G * np.sin(0.2) * 0.2, rel=1e-6)


def test_a_motion_out_of_the_plane_is_refused():
    motion = ImposedMotion(frozenset({"floor"}), History.constant([0.0, 0.0, 1.0]))
    with pytest.raises(SceneError, match="leaves the plane"):
        run(disk(), loads=Loads(motions=(motion,)))


def test_a_motion_that_is_not_finite_stops_the_run():
    push = StoneForce(frozenset({"d"}), History.constant([1e308, 0.0, 0.0]))
    with np.errstate(over="ignore"), pytest.raises(SolverError, match=r"not finite at t = 1 s"):
        run(disk(density=1e-3), walls=(), loads=Loads(forces=(push,)), time=PlanarTime(1.0, 1.0, 5.0))


def test_rules_give_groups_of_bodies_their_own_law():
    # on a slope of 20°, d slides on its ice, e rolls
    slope = np.radians(20.0)
    rule = LawRule(frozenset({"d"}), frozenset({"floor"}), DryJoint(0.0))
    result = run(
        disk("d"),
        disk("e", (1.0, 0.1)),
        gravity=(G * np.sin(slope), -G * np.cos(slope)),
        rules=(rule,),
        time=PlanarTime(1e-3, 0.5, 0.1, **GOES_ON),
    )
    assert result.velocity[0, 0] == pytest.approx(0.1 * G * np.sin(slope), rel=1e-9)
    assert result.velocity[0, 2] == 0.0
    assert result.velocity[1, 0] == pytest.approx(2 / 3 * 0.1 * G * np.sin(slope), rel=1e-9)


def test_a_disk_rolls_along_a_polyline_as_along_one_line():
    # a flat floor in 40 pieces: not one bit of its speed is lost at a joint
    xs = np.linspace(-1.0, 3.0, 41)
    walls = tuple(Wall(f"w{i}", (xs[i], 0.0), (xs[i + 1], 0.0)) for i in range(40))
    rolling = disk(velocity=(2.0, 0.0, -20.0))
    time = PlanarTime(1e-3, 0.5, 1.0, **GOES_ON)
    pieces, whole = run(rolling, walls=walls, time=time), run(rolling, time=time)
    np.testing.assert_allclose(pieces.velocity[0], [2.0, 0.0, -20.0], atol=1e-12)
    np.testing.assert_allclose(pieces.position[0], whole.position[0], atol=1e-12)


@pytest.mark.parametrize("pieces", [50, 200])
def test_a_disk_runs_through_a_bowl_of_many_pieces_and_up_again(pieces):
    # a frictionless bowl of radius 1: it rises to its old height, less what the bends take: each takes the part
    # sin²(π/pieces) of the energy that is kinetic there; on the way that is at most pieces × sin² ~ π²/pieces
    angles = np.linspace(np.pi, 2 * np.pi, pieces + 1)
    corners = np.column_stack([np.cos(angles), np.sin(angles)])
    walls = tuple(Wall(f"w{i}", tuple(corners[i]), tuple(corners[i + 1])) for i in range(pieces))
    inner = 0.9 * np.cos(np.pi / 2 / pieces)
    begin = (inner * np.cos(np.pi * 1.25), inner * np.sin(np.pi * 1.25))
    result = run(
        disk(centre=begin),
        walls=walls,
        friction=0.0,
        time=PlanarTime(5e-4, 0.5, 2.0, **GOES_ON),
        frame_every=4,
    )
    heights = np.array([frame.position[0, 1] for frame in result.frames])
    drop = begin[1] + 0.9
    returned = heights[len(heights) // 3 :].max()
    assert returned > begin[1] - 1.5 * np.pi**2 / pieces * drop
    assert returned < begin[1] + 1e-3
    assert result.history.penetration.max() < 1e-3


def test_a_heap_at_rest_is_solved_from_what_is_remembered():
    centres, radii = grid_of_disks(5, 4)
    scene = box(centres, radii, time=PlanarTime(2e-3, 1.0, 3.0, balance_tolerance=1e-8))
    result = simulate_planar(scene)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.history.iterations.max() > 50
    assert result.history.iterations[-4:].max() <= 20
    assert result.errors.reaction < 1e-7


def test_admm_finds_the_rest_that_sweeps_find():
    # where a heap of frictionless disks comes to rest does not depend on how its steps are solved
    centres, radii = grid_of_disks(3, 2)
    scene = box(centres, radii, friction=0.0, time=PlanarTime(2e-3, 1.0, 3.0, balance_tolerance=1e-6))
    other = replace(scene, solver=replace(scene.solver, method=Method.ADMM, tolerance=1e-9))
    swept, split = simulate_planar(scene), simulate_planar(other)
    assert swept.outcome is split.outcome is Outcome.EQUILIBRIUM
    assert split.errors.unconverged_steps == 0
    np.testing.assert_allclose(split.position[:, :2], swept.position[:, :2], atol=1e-5 * radii.min())


def heap(turn=0.0, shift=(0.0, 0.0), scale=1.0, order=None, mirror=False):
    """A small heap falls for a while; positions and velocities, back in the axes of the first."""
    centres, radii = grid_of_disks(5, 5, radius=0.5, seed=3)
    low, high = -0.05, float((centres[:, 0] + radii).max()) + 0.05
    corners = np.array([[low, 8.0], [low, low], [high, low], [high, 8.0]])
    flip = np.array([-1.0, 1.0]) if mirror else np.ones(2)
    co, si = np.cos(turn), np.sin(turn)
    rotation = np.array([[co, -si], [si, co]])

    def there(x):
        return scale * ((np.asarray(x) * flip) @ rotation.T) + shift

    order = np.arange(len(radii)) if order is None else order
    walls = [(there(corners[i]), there(corners[i + 1])) for i in range(3)]
    scene = PlanarScene(
        "heap",
        tuple(Disk(f"d{i}", tuple(there(centres[i])), scale * radii[i]) for i in order),
        tuple(Wall(f"w{i}", tuple(a), tuple(b)) for i, (a, b) in enumerate(walls)),
        gravity=tuple(rotation @ [0.0, -G]),
        law=DryJoint(0.3),
        # Froude: times go with the root of lengths
        time=PlanarTime(5e-3 * np.sqrt(scale), 1.0, 0.4 * np.sqrt(scale), **GOES_ON),
        solver=ACCURATE,
    )
    result = simulate_planar(scene)
    back = np.empty((len(radii), 2))
    back[order] = ((result.position[: len(radii), :2] - shift) / scale) @ rotation * flip
    spin = np.empty(len(radii))
    spin[order] = result.position[: len(radii), 2] * (-1 if mirror else 1)
    return back, spin


@pytest.mark.parametrize(
    "change",
    [
        {"turn": 0.9},
        {"shift": (1e4, -1e4)},
        {"scale": 1e-2},
        {"scale": 1e3},
        {"mirror": True},
        {"order": np.random.default_rng(0).permutation(25)},
    ],
    ids=["turned", "moved", "small", "large", "mirrored", "permuted"],
)
def test_a_heap_falls_the_same_wherever_and_however_large_it_is(change):
    (here, spin), (there, other_spin) = heap(), heap(**change)
    assert np.abs(spin).max() > 1e-3
    np.testing.assert_allclose(there, here, atol=1e-6)
    np.testing.assert_allclose(other_spin, spin, atol=1e-6)


def test_a_run_repeats_bit_for_bit():
    centres, radii = grid_of_disks(6, 6)
    scene = box(centres, radii, time=PlanarTime(1e-3, 1.0, 0.1))
    one, two = simulate_planar(scene), simulate_planar(scene)
    np.testing.assert_array_equal(one.position, two.position)
    np.testing.assert_array_equal(one.contacts.force, two.contacts.force)


def test_progress_is_told_and_frames_are_kept():
    heard = []
    scene = PlanarScene("fall", (disk(centre=(0.0, 50.0)),), time=PlanarTime(1e-2, 0.5, 0.1), frame_every=3)
    result = simulate_planar(scene, heard.append)
    assert [one.done for one in heard] == list(range(1, 11))
    assert {one.total for one in heard} == {10}
    np.testing.assert_allclose(
        [frame.time for frame in result.frames], [0, 0.03, 0.06, 0.09, 0.1], atol=1e-12
    )
    assert result.outcome is Outcome.MOVING
    assert len(result.history.time) == 10
    assert set(result.wall_time) == {"advance", "detect", "assemble", "solve", "observe"}


def test_each_step_makes_the_sweeps_that_are_asked_for_at_least():
    solver = SolverSettings(Method.NSGS, max_iterations=200)
    scene = PlanarScene("rest", (disk(),), (FLOOR,), solver=solver, min_sweeps=60)
    assert (simulate_planar(scene).history.iterations == 60).all()
    with pytest.raises(SceneError, match="min_sweeps = 60"):
        replace(scene, solver=SolverSettings())


def test_a_column_begins_with_the_forces_under_which_it_rests():
    # ten sweeps carry the weight through ten of forty disks in a step
    disks = tuple(disk(f"d{n}", (0.0, 0.1 + 0.2 * n)) for n in range(40))
    few = SolverSettings(Method.NSGS, tolerance=1e-12, max_iterations=10)
    scene = PlanarScene("column", disks, (FLOOR,), time=PlanarTime(1e-3, 1.0, 5e-3, **GOES_ON), solver=few)
    without = simulate_planar(scene)
    found = simulate_planar(replace(scene, start_iterations=500))
    assert without.history.speed.max() > 3 * G * 1e-3
    assert found.history.speed.max() < 0.01 * without.history.speed.max()
    assert found.reaction == pytest.approx(found.weight, rel=5e-3)
    with pytest.raises(SceneError, match="start_iterations = -1"):
        replace(scene, start_iterations=-1)
