"""What experiments set up, and what they measure of places that are known."""

import numpy as np
import pytest

from pipelines.geology.experiments.fault import Fault
from pipelines.geology.experiments.wedge import Wedge
from pipelines.geology.figures import draw_trishear
from pipelines.geology.file import parse_geology
from pipelines.geology.observe import Fields
from pipelines.geology.run import planar_scene
from pipelines.geology.sample import PreparedSample

HEAP = """
[sample]
smallest = 0.4
largest = 0.5
[contact]
friction = 0.4
rolling = false
[time]
step = 0.01
steps = 10
[repose]
length = 8.0
height = 4.0
"""
PLACES = np.array([[1.0, 0.45], [2.0, 0.45], [1.5, 1.2]])


def fields(place, bodies=(), force=(), time=10.0):
    """An instant at which walls, whose places do not matter, press on disks along x."""
    count, contacts = len(place), len(bodies)
    position = np.column_stack([place, np.zeros(count)])
    along = np.tile([1.0, 0.0], (contacts, 1))
    force = np.column_stack([np.array(force), np.zeros(contacts)])
    bodies = np.array(bodies, dtype=np.int64).reshape(-1, 2)
    still, gap = np.zeros((count, 3)), np.zeros(contacts)
    return Fields(100, time, position, still, *np.zeros((3, count)), bodies, along, along, force, gap)


@pytest.mark.parametrize(("line", "held"), [("", [True, True, False]), ("rough = false", [False] * 3)])
def test_a_rough_heap_stands_on_disks_that_are_glued_to_its_floor(line, held):
    scene = parse_geology(HEAP + line, "heap.toml", "repose")
    sample = PreparedSample(PLACES, np.full(3, 0.45), np.zeros(3, dtype=np.int64), "")
    made = planar_scene(scene, sample)
    assert [disk.fixed for disk in made.disks] == held
    assert not made.rolling
    # disks that leave the floor need somewhere to fall
    assert ("ground" in [wall.code for wall in made.walls]) == held[0]


def test_the_front_of_a_fault_is_where_a_tenth_of_its_rise_ends(tmp_path):
    fault = Fault(length=40.0, thickness=4.0, tip=10.0, dip=30.0, speed=0.2)
    x, y = np.meshgrid(np.arange(0.25, 40.0, 0.5), np.arange(0.25, 4.0, 0.5))
    start = np.column_stack([x.ravel(), y.ravel()])
    slip = 0.2 * 10.0
    # full rise up to 20 m, and none from 24 m on: a tenth of it at 23.6 m
    rise = slip * np.sin(np.radians(30.0)) * np.clip((24.0 - start[:, 0]) / 4.0, 0.0, 1.0)
    now = start + np.column_stack([np.zeros(len(start)), rise])
    radius = np.full(len(start), 0.25)
    found = fault.measures(start, radius, [fields(now)], {})
    assert found["front ahead of the tip [m]"] == pytest.approx(13.6, abs=0.6)
    name = draw_trishear(tmp_path, fields(now), radius, fault.trishear(found), fault.speed, "")
    assert (tmp_path / name).stat().st_size > 10_000


def test_the_force_on_the_wall_is_of_its_contacts_alone():
    wedge = Wedge(height=2.0, slope=20.0, push=0.5)
    x, y = np.meshgrid(np.arange(0.1, 5.4, 0.2), np.arange(0.1, 2.0, 0.2))
    start = np.column_stack([x.ravel(), y.ravel()])
    start = start[start[:, 1] < 2.0 - np.tan(np.radians(20.0)) * start[:, 0]]
    count = len(start)
    # walls are the base and then the one that pushes
    bodies = [(0, count + 1), (3, count + 1), (0, count), (0, 1)]
    now = fields(start + np.array([0.5, 0.0]), bodies, [7.0, 5.0, 100.0, 100.0])
    found = wedge.measures(start, np.full(count, 0.1), [now], {})
    assert found["force on the wall [N/m]"] == pytest.approx(12.0)
    assert found["slope [°]"] == pytest.approx(found["slope at the start [°]"])
