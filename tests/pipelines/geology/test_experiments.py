"""What experiments set up, and what they measure of places that are known."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError
from pipelines.geology.experiments.biaxial import Biaxial
from pipelines.geology.experiments.fault import Fault
from pipelines.geology.experiments.fold import Fold
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
    """An instant at which two walls, whose places do not matter, press on disks along x."""
    count, contacts = len(place), len(bodies)
    position = np.column_stack([np.vstack([place, np.zeros((2, 2))]), np.zeros(count + 2)])
    along = np.tile([1.0, 0.0], (contacts, 1))
    force = np.column_stack([np.array(force), np.zeros(contacts)])
    bodies = np.array(bodies, dtype=np.int64).reshape(-1, 2)
    still, gap = np.zeros((count + 2, 3)), np.zeros(contacts)
    return Fields(100, time, position, still, *np.zeros((3, count)), bodies, along, along, force, gap)


def test_the_front_of_a_fold_is_that_of_its_rise_and_no_single_disk():
    fold = Fold(length=100.0, deep=10.0, thickness=10.0, deep_length=10.0, slope_end=20.0, speed=1.0)
    x, y = np.meshgrid(np.arange(0.25, 100.0, 0.5), np.arange(0.25, 10.0, 0.5))
    start = np.column_stack([x.ravel(), y.ravel()])
    # 6 m at the wall, and none from 40 m on: a tenth of it at 36 m
    rise = 6.0 * np.clip(1.0 - start[:, 0] / 40.0, 0.0, 1.0)
    now = start + np.column_stack([np.zeros(len(start)), rise])
    # a disk has come to lie on the others, far away
    now[-3, 1] += 1.0
    radius = np.full(len(start), 0.25)
    assert fold.measures(start, radius, [fields(now)], {})["front [m]"] == pytest.approx(36.0, abs=4.0)
    assert fold.measures(start, radius, [fields(start)], {})["front [m]"] == 0.0


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
    model = fault.trishear(start, fields(now)).model
    name = draw_trishear(tmp_path, fields(now), radius, model, fault.speed, "")
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


def test_the_base_bears_what_slides_over_it():
    wedge = Wedge(height=2.0, slope=20.0, push=0.5)
    start = np.array([[0.1, 0.1], [0.3, 0.1], [0.5, 0.1], [0.2, 0.3]])
    count = len(start)
    # on the base: two disks that the wall, whose speed is 0.05, takes along, and one that stays
    now = fields(
        start + np.array([0.5, 0.0]), [(0, count), (1, count), (2, count), (3, count + 1)], [0.0] * 4
    )
    velocity = np.zeros((count + 2, 3))
    velocity[[0, 1, 3, count + 1], 0] = 0.05
    force = np.array([[-3.0, 10.0], [-1.0, 10.0], [-9.0, 10.0], [50.0, 0.0]])
    found = wedge.measures(start, np.full(count, 0.1), [replace(now, velocity=velocity, force=force)], {})
    assert found["friction angle of the base [°]"] == pytest.approx(np.degrees(np.arctan(0.2)))


def test_the_slope_of_a_wedge_that_has_deformed_ends_at_its_new_toe():
    wedge = Wedge(height=2.0, slope=20.0, push=1.0)
    x, y = np.meshgrid(np.arange(0.05, 7.0, 0.1), np.arange(0.05, 4.0, 0.1))
    sand = np.column_stack([x.ravel(), y.ravel()])
    start = sand[sand[:, 1] < 2.0 - np.tan(np.radians(20.0)) * sand[:, 0]]
    # steeper, and half as long: its toe is at 2.75 m from the wall, not at 5.5 m
    slope = np.arctan(2.0 * np.tan(np.radians(20.0)))
    now = start * np.array([0.5, 1.0]) + np.array([1.0, 0.0])
    alone = np.array([[6.0, 0.05]])
    place = np.vstack([now[:-1], alone])
    found = wedge.measures(start, np.full(len(start), 0.05), [fields(place)], {})
    assert found["slope [°]"] == pytest.approx(np.degrees(slope), abs=1.0)


def test_the_peak_of_the_friction_is_a_mean_over_one_percent_of_strain():
    time = np.arange(1.0, 101.0)
    ratio = np.full(100, 0.2)
    ratio[40:45] = 0.3
    ratio[70] = 0.5
    rows = {"time": time, "q": 2.0 * ratio, "p": np.full(100, 2.0)}
    # five rows are 1 % of strain: one that is high alone counts a fifth
    found = Biaxial(10.0, 20.0, 1e5, strain=0.2).measures(PLACES, np.ones(3), [], rows)
    assert found["sin φ, peak [-]"] == pytest.approx(0.3)
    assert found["sin φ [-]"] == pytest.approx(0.2 + 0.3 / 51.0)


def test_a_box_has_a_wall_at_its_end():
    open_end, box = (
        Wedge(height=0.02, slope=0.0, push=0.05, layer_length=0.2, box=closed) for closed in (False, True)
    )
    assert [wall.code for wall in open_end.setup(0.1, 1.0).walls] == ["base", "left"]
    right = box.setup(0.1, 1.0).walls[2]
    assert (right.start[0], right.end[0]) == (0.2, 0.2)
    with pytest.raises(SceneError, match="m between two walls"):
        Wedge(height=0.02, slope=0.0, push=0.19, layer_length=0.2, box=True)
