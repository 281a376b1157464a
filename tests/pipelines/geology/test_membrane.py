"""Membranes: forces that are known, and the stress of a sample that they confine."""

import numpy as np
import pytest

from ground.errors import SceneError
from pipelines.geology.experiments.membrane import Membrane
from pipelines.geology.observe import Instants, read_rows
from pipelines.geology.run import run_geology

PRESSURE = 2e5
SCENE = f"""
[sample]
smallest = 0.3
largest = 0.5
falling_friction = 0.05
[contact]
friction = 0.4
[time]
step = 0.004
steps = STEPS
[solver]
min_iterations = 50
max_iterations = 200
[biaxial]
width = 10.0
height = 12.0
pressure = {PRESSURE}
strain = STRAIN
walls = "flexible"
[output]
every = 10
fields_every = 300
checkpoint = 20
figures = false
"""


def forces(place, radius, pressure=3.0):
    membrane = Membrane(frozenset(), np.asarray(radius, dtype=float), pressure)
    return membrane(0.0, np.column_stack([place, np.zeros(len(place))]), np.zeros((len(place), 3, 3)))[0]


def test_each_disk_bears_the_pressure_on_half_the_distances_to_its_neighbours():
    i, j = np.indices((4, 3)).reshape(2, -1)
    found = forces(np.column_stack([2.0 * i, 2.0 * j]), np.ones(12))
    # 4 columns of 3 disks of radius 1: each side disk stands for a height of 2
    assert found[:3] == pytest.approx(np.tile([6.0, 0.0, 0.0], (3, 1)))
    assert found[9:] == pytest.approx(np.tile([-6.0, 0.0, 0.0], (3, 1)))
    assert not found[3:9].any()


def test_the_membrane_follows_a_bulge():
    i, j = np.indices((4, 3)).reshape(2, -1)
    place = np.column_stack([2.0 * i, 2.0 * j])
    place[10] += [1.0, 0.0]
    found = forces(place, np.ones(12))
    # lines of (1, 2) below and (-1, 2) above the disk in the middle: normals turn with them
    assert found[10] == pytest.approx([-6.0, 0.0, 0.0])
    assert found[9] == pytest.approx([-6.0, 1.5, 0.0])
    assert found[11] == pytest.approx([-6.0, -1.5, 0.0])


def test_a_sample_that_has_come_apart_is_refused():
    i, j = np.indices((3, 3)).reshape(2, -1)
    low = np.column_stack([2.0 * i, 2.0 * j])
    with pytest.raises(SceneError, match="does not lead from one platen to the other"):
        forces(np.vstack([low, low + np.array([0.0, 20.0])]), np.ones(18))


def scene(folder, strain, steps):
    path = folder / "biaxial.toml"
    text = SCENE.replace("STRAIN", str(strain)).replace("STEPS", str(steps))
    path.write_text(text, encoding="utf-8")
    return path


def pushed_across(instant, x):
    """Force that the disks left of x and those right of it push each other apart with."""
    count, (first, second) = len(instant.pressure), instant.bodies.T
    left = instant.position[:, 0] < x
    across = (second < count) & (left[first] != left[second])
    return (np.where(left[first], -1.0, 1.0) * instant.force[:, 0])[across].sum()


@pytest.mark.parametrize("seed", [1, 2])
def test_a_sample_at_rest_bears_the_pressure_of_its_membrane(tmp_path, seed):
    path = scene(tmp_path, 1e-6, 400)
    path.write_text(path.read_text(encoding="utf-8").replace("[sample]", f"[sample]\nseed = {seed}"))
    done = run_geology(path, "biaxial", tmp_path / "out")
    last = Instants(tuple(sorted((tmp_path / "out" / "arrays").iterdir())))[-1]
    with np.load(next((tmp_path / ".samples").iterdir())) as sample:
        given = forces(last.position[: len(last.pressure), :2], sample["radius"], PRESSURE)
    # the mean stress within differs by 4 % from one sample to the next, what crosses a line does not
    for x in (3.0, 5.0, 7.0):
        right = last.position[: len(last.pressure), 0] > x
        assert pushed_across(last, x) == pytest.approx(-given[right, 0].sum(), rel=0.01)
        assert -given[right, 0].sum() == pytest.approx(PRESSURE * 12.0, rel=0.1)
    rows = read_rows(tmp_path / "out" / done.summary["cells"]["whole sample"])
    assert rows["sigma_xx"][-10:] == pytest.approx(PRESSURE, rel=0.1)


def test_a_run_within_a_membrane_goes_on_with_the_same_bits(tmp_path):
    path = scene(tmp_path, 0.02, 80)
    run_geology(path, "biaxial", tmp_path / "whole")
    steps = iter([False] * 50)
    stopped = run_geology(path, "biaxial", tmp_path / "parts", stop=lambda: next(steps, True))
    assert stopped.summary["outcome"] == "interrupted"
    run_geology(path, "biaxial", tmp_path / "parts", resume=True)
    last = [
        Instants(tuple(sorted((tmp_path / name / "arrays").iterdir())))[-1] for name in ("whole", "parts")
    ]
    assert np.array_equal(last[0].position, last[1].position)
    assert np.array_equal(last[0].force, last[1].force)
