"""A run of the plane that goes on from what it carried takes the same steps, to the last bit; observers see it go."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.carried import Carrier
from mechanics.dynamics.outcome import Outcome
from mechanics.planar.run import PlanarRun
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import PlanarObserver, simulate_planar
from mechanics.planar.simulation import PlanarSimulation
from mechanics.scene.laws.bonds import BROKEN
from mechanics.scene.laws.law import BOND
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import SolverSettings
from tests.mechanics.dynamics.test_resuming import Kept, assert_same_bits, copied
from tests.mechanics.planar.shapes import box, grid_of_disks
from tests.mechanics.planar.test_overlaps import pushed_bed


def pushed():
    """A slow flow in which overlaps of the start stay, and those of unsolved steps are corrected."""
    bed = pushed_bed(12, 6, 60, 15, 0.002)
    wedged = replace(
        bed.disks[0], code="wedged", centre=(bed.disks[0].centre[0] + 0.9, bed.disks[0].centre[1])
    )
    return replace(bed, disks=(*bed.disks, wedged), frame_every=7, start_overlap=np.inf)


def bonded():
    """Bonded disks that fall on an edge, where bonds break."""
    disks = tuple(Disk(f"d{n}", (0.2 * (n % 6), 0.15 + 0.2 * (n // 6)), 0.1) for n in range(12))
    law = MortarJoint(0.3, 2e4, 2e4)
    walls = (Wall("edge", (0.45, 0.0), (0.55, 0.0)),)
    return PlanarScene(
        "bonded", disks, walls, law=law, time=PlanarTime(2e-3, 0.5, 0.15, False), frame_every=10
    )


def settling():
    """Disks that fall into a box, with the automatic choice, and come to rest."""
    centres, radii = grid_of_disks(3, 2)
    time = PlanarTime(1e-3, 1.0, 0.5)
    return box(centres, radii, time=time, solver=SolverSettings())


SCENES = {one.__name__: one for one in (pushed, bonded, settling)}


@pytest.mark.parametrize("name", SCENES)
def test_a_resumed_run_ends_with_the_same_bits_and_so_does_one_resumed_again(name):
    scene, archive = SCENES[name](), Kept()
    whole = simulate_planar(scene, archive=archive)
    assert_same_bits(whole, simulate_planar(scene))
    assert sorted(archive.kept) == list(range(1, whole.steps))
    for step in (1, 2 * whole.steps // 3, whole.steps - 1):
        again = Kept(every=5, earlier=archive.kept[step])
        assert_same_bits(whole, simulate_planar(scene, archive=again))
        if again.kept:
            assert_same_bits(whole, simulate_planar(scene, archive=Kept(0, again.kept[max(again.kept)])))


def test_the_scenes_do_what_they_are_for():
    """Disks are moved apart although overlaps of the start stay, bonds break, and a heap comes to rest."""
    kept = {name: Kept() for name in SCENES}
    results = {name: simulate_planar(one(), archive=kept[name]) for name, one in SCENES.items()}
    assert results["pushed"].history.lifted.any()
    assert kept["pushed"].kept[5]["simulation"]["_overlaps"]["_gap"].min() < -0.1
    first, last = (kept["bonded"].kept[step]["simulation"]["_memory"]["_values"] for step in (1, 70))
    assert not (first[:, 4 + BOND] == BROKEN).any()
    assert (last[:, 4 + BOND] == BROKEN).any()
    assert results["settling"].outcome is Outcome.EQUILIBRIUM


def test_an_interrupted_run_goes_on_as_if_nothing_had_been():
    scene, stopped, count = pushed(), Kept(0), iter(range(100))
    part = simulate_planar(scene, stop=lambda: next(count) == 20, archive=stopped)
    assert part.outcome is Outcome.INTERRUPTED
    assert part.steps == 21
    assert part.frames[-1].time == part.time
    assert list(stopped.kept) == [21]
    assert_same_bits(simulate_planar(scene), simulate_planar(scene, archive=Kept(0, stopped.kept[21])))


def test_a_run_made_step_by_step_may_be_left_and_taken_up():
    scene = settling()
    run, other = PlanarRun(scene), PlanarRun(scene)
    for _ in range(10):
        run.step()
    other.restore(copied(run.carried()))
    with pytest.raises(SceneError, match="no step has been made"):
        other.instant()
    while not run.done:
        run.step()
    while not other.done:
        other.step()
    assert run.outcome is Outcome.EQUILIBRIUM
    assert_same_bits(run.result(), other.result())
    np.testing.assert_array_equal(run.instant().position, run.result().position)


def test_observers_are_handed_every_kth_step_and_the_last_and_nothing_is_kept():
    scene, seen = pushed(), []
    whole = simulate_planar(scene, observers=(PlanarObserver(25, seen.append),))
    assert [one.step for one in seen] == [25, 50, 60]
    assert seen[0].time == pytest.approx(25 * scene.time.step)
    np.testing.assert_array_equal(seen[-1].position, whole.position)
    np.testing.assert_array_equal(seen[-1].velocity, whole.velocity)
    np.testing.assert_array_equal(seen[-1].contacts.force, whole.contacts.force)
    # momentum: contacts and gravity change the velocity of each disk
    steps = []
    simulate_planar(scene, observers=(PlanarObserver(1, steps.append),))
    for before, after in pairwise(steps[40:51]):
        force = np.zeros((len(whole.position), 2))
        np.add.at(force, after.contacts.bodies[:, 0], after.contacts.force)
        np.add.at(force, after.contacts.bodies[:, 1], -after.contacts.force)
        radius = np.array([disk.radius for disk in scene.disks])
        mass = 2800.0 * np.pi * radius**2
        change = (after.velocity - before.velocity)[: len(mass), :2] / scene.time.step
        balance = force[: len(mass)] / mass[:, None] + [0.0, -9.81]
        np.testing.assert_allclose(change, balance, atol=1e-9 * np.abs(balance).max())


# attributes of objects that keep what they make: functions of the scene, of the bodies' places
KEEPERS = {
    "_detector": {"_model", "_neighbours", "_reach"},
    "_drive": {"_motions", "_name", "_start", "bodies"},
}


@pytest.mark.parametrize("name", SCENES)
def test_every_attribute_that_changes_is_carried(name):
    """A new attribute must be named as carried or as rebuilt, or a resumed run would silently begin without it."""
    run = PlanarRun(SCENES[name]())
    run.step()
    run.step()
    carriers, seen = [run], set()
    while carriers:
        one = carriers.pop()
        seen.add(type(one).__name__)
        assert set(vars(one)) == {*one.CARRIED, *one.REBUILT}, type(one).__name__
        assert not {*one.CARRIED} & {*one.REBUILT}
        carriers += [value for value in vars(one).values() if isinstance(value, Carrier)]
    assert seen == {
        "PlanarRun",
        "PlanarSimulation",
        "Memory",
        "Overlaps",
        "_Log",
        "PlanarWatch",
        "PlanarEnergy",
    }
    simulation = run.simulation
    assert isinstance(simulation, PlanarSimulation)
    for name, known in KEEPERS.items():
        assert set(vars(getattr(simulation, name))) == known
