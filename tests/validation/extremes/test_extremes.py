"""Extremes, each with a stated outcome: nothing ends in NaN, in an endless loop or in silent nonsense."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Method, Scene, SolverSettings, TimeSettings
from mechanics.scene.shapes import bond
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from tests.validation.masonry import running_bond
from tests.validation.scenes import G, box, dynamic, follow, ground, moved, rotation, tilted_gravity


def resting(name, blocks, *, friction=0.6, tolerance=1e-12, **time):
    """A scene that is run until it rests."""
    return Scene(
        name,
        tuple(blocks),
        contact=ContactSettings(DryJoint(friction)),
        time=TimeSettings(**{"step": 2e-3, "theta": 1.0, "duration": 1.0, "balance_tolerance": 1e-6, **time}),
        solver=SolverSettings(tolerance=tolerance, max_iterations=5000),
    )


def check_rests(result, *, still=1e-6):
    """In balance to 1e-6 of each block's weight, every step solved, nothing moved by more than `still` [m]."""
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.unconverged_steps == 0
    assert result.errors.reaction < 1e-6
    assert max(np.abs(body.displacement).max() for body in result.bodies) < still


def column(count, *, ratio=1.0, width=0.5, height=0.25):
    """Equal blocks; the density of the topmost is `ratio` times that of the others, which grows from below."""
    heavy = [Material(f"m{i}", 2400.0 * ratio ** (i / max(count - 1, 1)), 1e9, 0.2) for i in range(count)]
    return [
        ground(),
        *(box(f"B{i}", [0, 0, i * height], [width, width, (i + 1) * height], heavy[i]) for i in range(count)),
    ]


@pytest.mark.parametrize("ratio", [1e2, 1e4, 1e6])
def test_a_heavy_block_rests_on_a_light_one(ratio):
    """S05: mass ratio to 10⁶, heavy on light: they stand still, solved, the weight arrives. Statics."""
    check_rests(simulate(resting("heavy", column(2, ratio=ratio))))


@pytest.mark.parametrize(("count", "ratio"), [(10, 1e6), (30, 1e3)])
def test_a_column_grows_heavier_upwards(count, ratio):
    """S05: the same in steps, from the lightest block at the foot to the heaviest on top. Statics."""
    check_rests(simulate(resting("heavier", column(count, ratio=ratio))))


@pytest.mark.parametrize("count", [1, 10, 100])
def test_a_column_stands(count):
    """S05: up to a hundred blocks: it stands still from the first step, every step solved. Statics."""
    result = simulate(resting("column", column(count)))
    check_rests(result)
    # each joint carries what lies above it
    lifted = np.zeros(count + 1)
    np.add.at(lifted, result.contacts.bodies.max(axis=1), np.abs(result.contacts.force[:, 2]))
    above = np.arange(count, 0, -1) * 2400.0 * 0.5 * 0.5 * 0.25 * G
    assert lifted[1:] == pytest.approx(above, rel=1e-5)


def test_without_friction_a_block_slides_as_on_ice():
    """S05: μ = 0: a = g sin θ within 1e-10. Closed form."""
    path = follow(dynamic("ice", (ground(), low()), gravity=tilted_gravity(25.0), friction=0.0, duration=0.2))
    assert path.velocity[-1, 1, 0] == pytest.approx(G * np.sin(np.radians(25.0)) * 0.2, rel=1e-10)


def wall(columns, courses):
    """Bricks of 0.3 × 0.15 × 0.1 m in running bond, about the plane y = 0."""
    return running_bond(bond(columns, courses, halves_first=False), 0.3, 0.1, depth=0.15)


def low(height=0.05):
    return box("low", [-0.5, -0.5, 0.0], [0.5, 0.5, height])


@pytest.mark.parametrize(("degrees", "slides"), [(84.0, False), (84.6, True)])
def test_with_friction_ten_a_slab_holds_until_84_degrees(degrees, slides):
    """S05: μ = 10: a slab too low to topple holds to atan 10 = 84.29°, then slides with g (sin θ - 10 cos θ)."""
    path = follow(
        dynamic("steep", (ground(), low()), gravity=tilted_gravity(degrees), friction=10.0, duration=0.2)
    )
    angle = np.radians(degrees)
    expected = G * (np.sin(angle) - 10 * np.cos(angle)) * 0.2 if slides else 0.0
    assert path.velocity[-1, 1, 0] == pytest.approx(expected, rel=1e-3, abs=1e-8)


def test_with_friction_ten_a_cube_topples_and_does_not_slide():
    """S05: μ = 10 at 50°: a cube turns over its edge (45°), which stays where it is. Closed form."""
    cube = box("cube", [-1, 0, 0], [0, 1, 1])
    path = follow(
        dynamic("cube", (ground(), cube), gravity=tilted_gravity(50.0), friction=10.0, duration=0.3)
    )
    edge = path.corners(1)[:, 1]
    assert path.velocity[-1, 1, 4] > 0.05
    assert np.abs(edge - edge[0]).max() < 1e-4


@pytest.mark.parametrize("friction", [0.0, 0.1, 1.0, 10.0])
@pytest.mark.parametrize(
    ("step", "height"),
    [
        (1e-5, 1e-5),
        pytest.param(1e-5, 1e-3, marks=pytest.mark.slow),
        (1e-4, 1e-3),
        (1e-3, 1e-3),
        (1e-2, 1e-3),
        (1e-1, 1e-3),
    ],
)
def test_a_block_that_falls_lands_and_rests(step, height, friction):
    """S05: h from 1e-5 to 1e-1 s, any friction: it lands to 1e-9 of its width, and rests within 16 ms or ten steps.

    Steps of 1e-5 s begin at a hundredth of a millimetre, too: within a tenth of the time.
    """
    duration = max(0.016 * np.sqrt(height / 1e-3), 10 * step)
    block = moved(box("block", [0, 0, 0], [0.5, 0.4, 0.3]), shift=(0, 0, height))
    path = follow(dynamic("drop", (ground(), block), friction=friction, step=step, duration=duration))
    assert np.abs(path.velocity[-1]).max() < 1e-9
    assert path.centre[-1, 1] == pytest.approx([0.25, 0.2, 0.15], abs=1e-9 * 0.3)
    # a place is known to rounding, of 0.3 m, and a step closes what is open: that much of g h may be left in forces
    rounding = np.finfo(float).eps * 0.3 / (G * step**2)
    assert path.support[-1, 2] == pytest.approx(path.model.mass[1] * G, rel=1e-9 + rounding)
    assert path.gap.min() > -1e-9 * 0.3


@pytest.mark.parametrize("step", [1e-5, 1e-3, 1e-1])
def test_a_wall_stands_whatever_the_step(step):
    """S05: h from 1e-5 to 1e-1 s: a wall in running bond rests from the first step on. Statics."""
    check_rests(simulate(resting("wall", wall(4, 4), step=step, duration=20 * step)), still=1e-7)


def test_slabs_of_one_to_a_hundred_lie_still():
    """S05: six slabs of 1 m × 1 m × 1 cm, crossed: they lie still, solved. Statics."""
    slabs = [
        moved(
            box(f"S{i}", [-0.5, -0.5, 0], [0.5, 0.5, 0.01]), rotation([0, 0, 1], 17.0 * i), (0, 0, 0.01 * i)
        )
        for i in range(6)
    ]
    check_rests(simulate(resting("slabs", (ground(), *slabs))), still=1e-7)


def test_a_slab_of_one_to_a_hundred_falls_flat_on_its_face():
    """S05: let go on one edge at 5°, it falls, rests flat, and no corner is deeper than 1e-3 of its thickness.

    Energy falls, but for what the curvature of the edge's path lets in (`bend`).
    """
    slab = moved(box("slab", [0, 0, 0], [1, 1, 0.01]), rotation([0, 1, 0], -5.0))
    path = follow(dynamic("slab", (ground(), slab), step=1e-3, duration=0.6))
    assert np.abs(path.velocity[-1, 1]).max() < 1e-6
    assert np.abs(path.corners(1)[-1][:, 2].reshape(2, 4) - [[0.0], [0.01]]).max() < 1e-5
    assert path.made.max() < 1e-9 * path.potential[0]


def test_an_initial_overlap_stays_and_makes_no_energy():
    """In true motion an overlap of a centimetre is kept, not pushed out: at rest at once, and it is reported."""
    block = moved(box("block", [0, 0, 0], [0.5, 0.4, 0.3]), shift=(0, 0, -0.01))
    result = simulate(dynamic("overlap", (ground(), block), duration=0.2))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.history.speed.max() < 1e-9
    assert result.errors.penetration == pytest.approx(0.01 / 0.3, rel=1e-6)
    assert result.errors.reaction < 1e-9


def test_an_initial_overlap_touches_and_gives_no_push():
    """In a relaxation, too, the block rests where it began, 1e-9 m: an overlap of the survey is no energy."""
    block = moved(box("block", [0, 0, 0], [0.5, 0.4, 0.3]), shift=(0, 0, -0.01))
    result = simulate(resting("overlap", (ground(), block), relaxation=True))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert np.abs(result.bodies[1].displacement).max() < 1e-9


def test_blocks_that_start_exactly_touching_stay():
    """From the first step on the forces are those of rest, and no velocity rises above 1e-9 m/s. Statics."""
    path = follow(dynamic("touching", column(3), duration=0.1))
    assert np.abs(path.velocity).max() < 1e-9
    weight = path.model.mass[1:].sum() * G
    assert path.support[:, 2] == pytest.approx(np.full(100, weight), rel=1e-8)


def test_without_gravity_nothing_moves_and_nothing_presses():
    """Zero gravity: blocks that touch stay, without a force, and this is an equilibrium. Statics."""
    scene = replace(resting("weightless", column(3)), gravity=(0.0, 0.0, 0.0))
    result = simulate(scene)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert np.abs(result.contacts.force).max(initial=0.0) == 0.0
    assert max(np.abs(body.displacement).max() for body in result.bodies) == 0.0


def test_without_gravity_a_pushed_block_drifts_on():
    """Zero gravity: a block that leaves the others keeps its velocity to 1e-12, and the run ends in motion."""
    *rest, top = column(3)
    blocks = (*rest, replace(top, velocity=(0.1, 0.0, 0.2, 0.0, 0.0, 0.3)))
    path = follow(dynamic("drift", blocks, gravity=(0, 0, 0), duration=0.5))
    assert path.velocity[-1, 3] == pytest.approx([0.1, 0.0, 0.2, 0.0, 0.0, 0.3], abs=1e-12)
    assert np.abs(path.velocity[-1, 1:3]).max() < 1e-12
    scene = dynamic("drift", blocks, gravity=(0, 0, 0), duration=0.1)
    assert simulate(scene).outcome is Outcome.MOVING


@pytest.mark.parametrize("step", [5e-4, 1e-3, 3e-3, 1e-2])
def test_a_block_fired_at_a_wall_does_not_pass_through_it(step):
    """At 100 m/s, up to 1 m a step, seven times the wall's thickness: it hits, and goes no farther than what it pushes.

    Nothing overlaps by more than 3 mm, energy only falls, friction takes less than a tenth of the momentum at once, and
    the shot, inelastic, goes on with the stone that it struck. Each step is solved to η < 0.02 in 500 iterations.
    """
    shot = box("shot", [0.70, -0.725, 0.26], [0.80, -0.625, 0.36], velocity=(0, 100.0, 0, 0, 0, 0))
    path = follow(
        dynamic(
            "shot",
            (*wall(5, 6), shot),
            step=step,
            duration=0.03,
            tolerance=1e-6,
            max_iterations=500,
            method=Method.AUTO,
        )
    )
    assert np.isfinite(path.velocity).all()
    assert path.natural_map.max() < 0.02
    energy = path.kinetic + path.potential
    assert np.diff(energy).max() < 1e-9 * energy[0]
    assert path.gap.min() > -3e-3
    # 0.55 m to the wall
    hit = int(np.argmax(path.velocity[:, -1, 1] < 99.0))
    assert hit * step == pytest.approx(0.0055, abs=step)
    assert path.momentum[hit, 1] == pytest.approx(100.0 * path.model.mass[-1], rel=0.1)
    struck = np.abs(path.velocity[-1, :-1, 1]).argmax()
    assert path.model.scene.blocks[struck].code == "3-3"
    assert path.velocity[-1, -1, 1] == pytest.approx(path.velocity[-1, struck, 1], rel=0.05)
    assert path.velocity[-1, struck, 1] > 1.0
    front = path.corners(len(path.model.mass) - 1)[-1][:, 1].max()
    assert front < path.corners(struck)[-1][:, 1].max()


@cache
def bumping(scale, friction, step=1e-3):
    """A block that falls askew on another, slides off and rocks."""
    lower = box("lower", [0, 0, 0], [0.5, 0.4, 0.3])
    upper = moved(box("upper", [0, 0, 0], [0.3, 0.3, 0.4]), rotation([0.2, 1, 0.1], 12), (0.15, 0.06, 0.37))
    upper = replace(upper, velocity=(0.5, 0.1, 0.0, 0.0, 0.0, 0.4))
    blocks = [moved(block, scale=scale) for block in (box("ground", [-3, -3, -1], [3, 3, 0]), lower, upper)]
    blocks[0] = replace(blocks[0], fidelity=ground().fidelity)
    time = np.sqrt(scale)
    return follow(dynamic("bump", blocks, friction=friction, step=step * time, duration=0.4 * time))


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("scale", [1e-3, 1e-2, 1e2, 1e4])
def test_trajectories_are_the_same_at_every_scale(scale, friction):
    """S05: Froude similarity: x/L at t √(g/L) is the same from 1e-3 to 1e4 m; 1e-6. Principle."""
    one, other = bumping(1.0, friction), bumping(scale, friction)
    assert np.abs(other.centre / scale - one.centre).max() < 1e-6
    assert np.abs(other.rotation - one.rotation).max() < 1e-6
    # and it is a motion worth comparing
    assert np.abs(one.rotation[-1, 2] - np.eye(3)).max() > 0.05


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 10, 100])
@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e6])
@pytest.mark.parametrize("friction", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("step", [1e-5, 1e-3, 1e-1])
def test_columns_stand_in_every_corner_of_the_matrix(count, ratio, friction, step):
    """S05: mass ratio × height × friction × step: a column stands, solved to 1e-12, the weight on the ground. Statics.

    Nothing moves by more than 1e-4 of a free fall for one step.
    """
    result = simulate(
        resting("matrix", column(count, ratio=ratio), friction=friction, step=step, duration=20 * step)
    )
    check_rests(result, still=1e-6 + 1e-4 * G * step**2)
