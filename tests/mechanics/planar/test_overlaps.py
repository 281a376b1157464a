"""Overlaps that unsolved steps leave do not add up, and no kinetic energy comes of it."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.dynamics.progress import Clock
from mechanics.planar.delassus import PlanarGaussSeidel
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import simulate_planar
from mechanics.planar.simulation import PlanarSimulation
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Method, SolverSettings
from tests.mechanics.planar.shapes import G, grid_of_disks


def pushed_bed(columns, rows, steps, sweeps, largest_overlap=0.01, speed=0.5):
    """Disks of about half a metre that fall into a bed, while its left wall comes in; no step is solved."""
    centres, radii = grid_of_disks(columns, rows, radius=0.5, spread=0.14)
    width = float((centres[:, 0] + radii).max())
    low = float((centres[:, 1] - radii).min())
    walls = (
        Wall("floor", (-5.0, low), (width + 5.0, low)),
        Wall("left", (0.0, low - 0.1), (0.0, 10 * rows)),
        Wall("right", (width, low - 0.1), (width, 10 * rows)),
    )
    push = ImposedMotion(frozenset({"left"}), History.constant([speed, 0.0, 0.0]))
    return PlanarScene(
        "pushed",
        tuple(
            Disk(f"d{n}", tuple(c), float(r), 2800.0)
            for n, (c, r) in enumerate(zip(centres, radii, strict=True))
        ),
        walls,
        law=DryJoint(0.4),
        time=PlanarTime(0.025, 1.0, steps * 0.025, stop_at_equilibrium=False),
        solver=SolverSettings(Method.NSGS, 1e-12, 1e-12, sweeps),
        loads=Loads(motions=(push,)),
        largest_overlap=largest_overlap,
    )


def overlaps(result):
    """Deepest overlap of each step over the smallest radius, at least: widths differ by a third."""
    radii = np.array([disk.radius for disk in result.scene.disks])
    return result.history.penetration * 2 * radii.max() / radii.min()


def test_overlaps_do_not_add_up_in_a_slow_flow():
    kept = simulate_planar(pushed_bed(24, 10, 300, 20))
    left = simulate_planar(pushed_bed(24, 10, 300, 20, np.inf))
    assert kept.errors.unconverged_steps > 290
    # of the width of the smaller disk: half of what it is of its radius
    assert 2 * left.errors.penetration > 0.03
    assert 2 * kept.errors.penetration <= 0.01
    assert left.history.lifted.max() == 0.0
    assert kept.history.lifted.sum() > 0
    assert max(kept.errors.energy, left.errors.energy) < 1e-12


@pytest.mark.slow
def test_overlaps_do_not_add_up_in_five_thousand_steps():
    kept = simulate_planar(pushed_bed(40, 12, 5000, 100, speed=0.1))
    assert kept.errors.unconverged_steps > 4000
    assert overlaps(kept).max() <= 0.012
    assert 2 * kept.errors.penetration <= 0.01


def advanced(scene, steps):
    model, start = build_planar_model(scene)
    simulation = PlanarSimulation(model, start, Clock())
    return simulation, [simulation.step() for _ in range(steps)]


def test_a_correction_moves_disks_and_leaves_their_velocities_as_they_are():
    kept, steps = advanced(pushed_bed(24, 10, 300, 20), 150)
    first = next(n for n, step in enumerate(steps) if step.lifted != 0.0)
    _, others = advanced(pushed_bed(24, 10, 300, 20, np.inf), first + 1)
    one, other = steps[first], others[first]
    np.testing.assert_array_equal(one.after.velocity, other.after.velocity)
    np.testing.assert_array_equal(one.impulse, other.impulse)
    moved = one.after.centre - other.after.centre
    nd = len(kept.model.radius)
    assert not moved[nd:].any()
    # what is lifted is the work against gravity
    assert one.lifted == pytest.approx(G * float(np.sum(kept.model.mass[:nd] * moved[:nd, 1])), rel=1e-6)
    assert (-one.gap).max() <= 0.008 * kept.model.radius.min()
    assert (-other.gap).max() > 0.008 * kept.model.radius.min()
    np.testing.assert_array_equal(kept.state.centre, steps[-1].after.centre)


def column(count, steps, sweeps):
    """Disks of 1 m that stand on each other, without friction."""
    return PlanarScene(
        "column",
        tuple(Disk(f"d{n}", (0.0, 0.5 + n), 0.5, 2800.0) for n in range(count)),
        (Wall("floor", (-1.0, 0.0), (1.0, 0.0)),),
        law=DryJoint(0.0),
        time=PlanarTime(0.025, 1.0, steps * 0.025, stop_at_equilibrium=False),
        solver=SolverSettings(Method.NSGS, 1e-12, 1e-12, sweeps),
    )


def test_a_pile_that_sinks_steadily_is_lifted_with_fewer_sweeps(monkeypatch):
    # the last correction is nearly the next one; 2,000 sweeps are those of the velocities
    made, sweep = [], PlanarGaussSeidel.__call__
    monkeypatch.setattr(
        PlanarGaussSeidel,
        "__call__",
        lambda self, impulse, sweeps: made.append(sweeps) or sweep(self, impulse, sweeps),
    )
    scene, counts = column(30, 100, 20), []
    for again in (0.9, 0.0):
        monkeypatch.setattr("mechanics.planar.overlaps._AGAIN", again)
        made.clear()
        assert overlaps(simulate_planar(scene)).max() <= 0.01
        counts.append(sum(made))
    assert counts[0] < 0.6 * counts[1]


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_what_rebounds_is_not_moved(restitution):
    # it comes 0.01 m in a step, a tenth of its radius: Newton's law acts once it overlaps, and sends it back by itself
    ball = Disk("ball", (0.0, 0.135), 0.1, velocity=(0.0, -10.0, 0.0))
    scene = PlanarScene(
        "rebound",
        (ball,),
        (Wall("floor", (-1.0, 0.0), (1.0, 0.0)),),
        law=DryJoint(0.0, restitution=restitution),
        time=PlanarTime(1e-3, 1.0, 0.008, stop_at_equilibrium=False),
    )
    one, other = (simulate_planar(replace(scene, largest_overlap=most)) for most in (0.01, np.inf))
    assert other.history.penetration.max() > 0.01
    np.testing.assert_array_equal(one.position, other.position)
    assert not one.history.lifted.any()


@pytest.mark.parametrize(
    ("disks", "walls", "said"),
    [
        (
            [Disk("a", (0.0, 0.0), 0.1), Disk("b", (0.15, 0.0), 0.2), Disk("c", (0.5, 0.0), 0.2)],
            [],
            "disk 'a' and disk 'b': at the start they overlap by 0.15 m at (0.025, 0), 150% of the radius 0.1 m; "
            "30% is allowed; move them apart",
        ),
        (
            [Disk("a", (0.0, 0.05), 0.1), Disk("b", (1.0, 0.02), 0.1)],
            [Wall("floor", (-1.0, 0.0), (2.0, 0.0))],
            "disk 'b' and wall 'floor': at the start they overlap by 0.08 m at (1, -0.04), 80% of the radius 0.1 m; "
            "30% is allowed; so do 1 more pairs; move the wall or the disk",
        ),
    ],
)
def test_disks_that_overlap_too_far_at_the_start_are_refused_with_their_place(disks, walls, said):
    scene = PlanarScene("bad", tuple(disks), tuple(walls))
    with pytest.raises(SceneError) as caught:
        simulate_planar(scene)
    assert said in str(caught.value)
    simulate_planar(replace(scene, start_overlap=np.inf, time=PlanarTime(1e-3, 1.0, 1e-3)))


def test_overlaps_of_the_start_stay_and_those_of_the_motion_do_not():
    # four in a row overlap by a fifth, under a load that two sweeps do not carry
    disks = tuple(Disk(f"d{n}", (0.0, 0.1 + 0.18 * n), 0.1) for n in range(4))
    scene = PlanarScene(
        "overlapping",
        disks,
        (Wall("floor", (-1.0, 0.0), (1.0, 0.0)),),
        time=PlanarTime(1e-2, 1.0, 2.0, stop_at_equilibrium=False),
        solver=SolverSettings(Method.NSGS, 1e-12, 1e-12, 1),
    )
    kept = simulate_planar(scene)
    assert kept.errors.unconverged_steps > 5
    assert 0.1 <= kept.errors.penetration <= 0.105
