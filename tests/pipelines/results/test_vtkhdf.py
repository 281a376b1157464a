"""`results.vtkhdf`: VTK reads what was written, while it grows, after its writer was killed, and at the end."""

import os
import random
import resource
import signal
import time
from dataclasses import replace

import h5py
import numpy as np
import pytest
import pyvista
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import box
from mechanics.simulate import simulate
from pipelines.results import vtkhdf
from pipelines.results.vtk import CONTACT_ARRAYS, point_fields, status_numbers
from pipelines.results.vtkhdf import GrowingResults, write_vtkhdf
from tests.mechanics.shapes import LIMESTONE, brick, ground, opening, scene

STONES, CONTACTS = 0, 1


@pytest.fixture(autouse=True)
def every_frame(monkeypatch):
    """Frames of these scenes come so fast that most would wait."""
    monkeypatch.setattr(vtkhdf, "SHARE", np.inf)


@pytest.fixture(scope="module")
def wall():
    """A wall of rigid stones that falls; contacts come and go."""
    return simulate(replace(opening(step=3e-3), frame_every=1))


@pytest.fixture(scope="module")
def mixed():
    """A rigid stone on an elastic one."""
    soft = brick("soft", (0, 0, 0), (1, 1, 1), Fidelity.DEFORMABLE, mesh_size=0.5)
    one = scene(ground(), soft, brick("hard", (0.2, 0.2, 1), (0.8, 0.8, 1.5)), step=5e-3, duration=0.03)
    return simulate(replace(one, frame_every=2))


class Read:
    """What VTK's reader finds in a file."""

    def __init__(self, path):
        self._reader = vtkHDFReader()
        self._reader.SetFileName(str(path))
        self._reader.UpdateInformation()
        steps = self._reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
        self.times = list(steps or ())

    def __call__(self, step, block):
        """A block in one step: points, point data, cell data, cells as lists of points."""
        self._reader.SetStep(step)
        self._reader.Update()
        grid = self._reader.GetOutputDataObject(0).GetBlock(block)
        data = [
            {one.GetArrayName(k): vtk_to_numpy(one.GetArray(k)) for k in range(one.GetNumberOfArrays())}
            for one in (grid.GetPointData(), grid.GetCellData())
        ]
        cells = grid.GetCells()
        ends = vtk_to_numpy(cells.GetOffsetsArray())
        rows = np.split(vtk_to_numpy(cells.GetConnectivityArray()), ends[1:-1]) if len(ends) > 1 else []
        points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetNumberOfPoints() else np.zeros((0, 3))
        return points, *data, rows


def same(read, result, frames):
    """Compare every value in the file with those of the frames."""
    bodies, blocks = result.bodies, result.scene.blocks
    assert read.times == [frame.time for frame in frames]
    for step, frame in enumerate(frames):
        points, fields, cells, rows = read(step, STONES)
        np.testing.assert_array_equal(points, np.concatenate(frame.positions))
        elastic = "stress" in fields
        for name, values in point_fields(bodies, blocks, frame, elastic).items():
            np.testing.assert_array_equal(fields.pop(name), values.astype(np.float32))
        assert fields == {}
        assert len(rows) == len(cells["stone"]) == len(cells["fidelity"])
        contacts = frame.contacts
        points, fields, _, rows = read(step, CONTACTS)
        np.testing.assert_array_equal(points, contacts.point)
        assert [list(row) for row in rows] == [[k] for k in range(len(contacts.gap))]
        if len(rows):
            for name in CONTACT_ARRAYS:
                np.testing.assert_array_equal(fields[name], getattr(contacts, name))
            assert (fields["status"] == status_numbers(contacts)).all()


def payload(result, frames):
    """Bytes of what the frames hold, and of one mesh."""
    stones = sum(len(one) for one in frames[0].positions)
    points = sum(len(frame.contacts.gap) for frame in frames)
    mesh = sum((len(face) * 8 + 8 + 6) for body in result.bodies for face in body.faces)
    return mesh + len(frames) * stones * (24 + 12 + 12) + points * (24 + 24 + 24 + 5 * 8 + 8 + 4 + 1)


def test_a_file_of_rigid_stones_holds_all_frames_and_one_mesh(wall, tmp_path):
    write_vtkhdf(tmp_path / "a.vtkhdf", wall.bodies, wall.scene.blocks, wall.frames)
    read = Read(tmp_path / "a.vtkhdf")
    same(read, wall, wall.frames)
    *_, cells, rows = read(3, STONES)
    faces = [
        [corner + 8 * number for corner in face]
        for number, body in enumerate(wall.bodies)
        for face in body.faces
    ]
    assert [list(row) for row in rows] == faces
    assert cells["stone"].tolist() == [number for number, body in enumerate(wall.bodies) for _ in body.faces]
    with h5py.File(tmp_path / "a.vtkhdf") as file:
        assert len(file["VTKHDF/stones/Connectivity"]) == 4 * len(faces)


def test_a_file_of_elastic_stones_holds_their_stresses(mixed, tmp_path):
    write_vtkhdf(tmp_path / "a.vtkhdf", mixed.bodies, mixed.scene.blocks, mixed.frames)
    read = Read(tmp_path / "a.vtkhdf")
    same(read, mixed, mixed.frames)
    _, fields, cells, _ = read(len(mixed.frames) - 1, STONES)
    stress = next(body.von_mises for body in mixed.bodies if body.code == "soft")
    start = len(mixed.bodies[0].reference)
    np.testing.assert_allclose(fields["von_mises"][start : start + len(stress)], stress, rtol=1e-6)
    assert np.isfinite(cells["stress_error"][cells["stone"] == 1]).all()
    assert np.isnan(cells["stress_error"][cells["stone"] != 1]).all()


def test_a_complete_file_is_little_larger_than_what_it_holds(wall, tmp_path):
    write_vtkhdf(tmp_path / "a.vtkhdf", wall.bodies, wall.scene.blocks, wall.frames)
    assert (tmp_path / "a.vtkhdf").stat().st_size < 1.1 * payload(wall, wall.frames)


def test_a_growing_file_can_be_read_after_each_frame_and_is_little_larger_than_what_it_holds(wall, tmp_path):
    path, frames = tmp_path / "results.vtkhdf", list(wall.frames[:3])
    growing = GrowingResults(path, wall.bodies, wall.scene.blocks, frames)
    for number, frame in enumerate(wall.frames[3:]):
        frames.append(frame)
        growing.update()
        if number % 8 == 0:
            assert Read(path).times[-1] == frame.time
    same(Read(path), wall, frames)
    frames += wall.frames
    growing.update()
    assert path.stat().st_size < 1.1 * payload(wall, frames)


def test_frames_that_come_too_fast_wait(wall, tmp_path, monkeypatch):
    monkeypatch.setattr(vtkhdf, "SHARE", 1e-9)
    path, frames = tmp_path / "results.vtkhdf", list(wall.frames[:3])
    growing = GrowingResults(path, wall.bodies, wall.scene.blocks, frames)
    for frame in wall.frames[3:5]:
        frames.append(frame)
        growing.update()
    assert len(Read(path).times) == 4
    monkeypatch.setattr(vtkhdf, "SHARE", np.inf)
    growing.update()
    same(Read(path), wall, wall.frames[:5])


def forked(work):
    child = os.fork()
    if child == 0:
        try:
            work()
        finally:
            os._exit(0)
    return child


@pytest.mark.parametrize("count", [4, pytest.param(50, marks=pytest.mark.slow)])
def test_a_writer_that_is_killed_at_any_instant_leaves_a_whole_file(wall, tmp_path, count):
    path, instants = tmp_path / "results.vtkhdf", random.Random(count)

    def write():
        frames = list(wall.frames[:1])
        growing = GrowingResults(path, wall.bodies, wall.scene.blocks, frames)
        for frame in wall.frames[1:]:
            frames.append(frame)
            growing.update()

    seen = []
    for _ in range(count):
        for left in tmp_path.iterdir():
            left.unlink()
        child = forked(write)
        while not path.exists():
            time.sleep(1e-3)
        time.sleep(instants.uniform(0.0, 1.0))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        read = Read(path)
        seen.append(len(read.times))
        same(read, wall, wall.frames[: seen[-1]])
    assert len(set(seen)) > 1


def test_a_file_can_be_read_at_any_moment(wall, tmp_path, monkeypatch):
    """It keeps its content for many times the time of an update, which is that of a look, and the next update too."""
    monkeypatch.undo()
    path = tmp_path / "results.vtkhdf"
    films = [replace(frame, time=float(k)) for k, frame in enumerate(40 * wall.frames)]

    def write():
        frames = films[:1]
        growing = GrowingResults(path, wall.bodies, wall.scene.blocks, frames)
        for frame in films[1:]:
            frames.append(frame)
            growing.update()
            time.sleep(0.05)

    child = forked(write)
    while not path.exists():
        time.sleep(1e-3)
    seen = []
    while len(set(seen)) < 3:
        assert os.waitpid(child, os.WNOHANG) == (0, 0)
        read = Read(path)
        # VTK gives no instant of a file with a single frame
        seen.append(max(1, len(read.times)))
        points = read(seen[-1] - 1, STONES)[0]
        np.testing.assert_array_equal(points, np.concatenate(films[seen[-1] - 1].positions))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def test_a_disk_that_is_full_leaves_what_was_there(wall, tmp_path):
    path = tmp_path / "results.vtkhdf"
    told = tmp_path / "told"

    def write():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        frames = list(wall.frames[:5])
        growing = GrowingResults(path, wall.bodies, wall.scene.blocks, frames)
        resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 2_000_000,) * 2)
        for frame in wall.frames[5:]:
            frames.append(frame)
            try:
                growing.update()
            except (OSError, RuntimeError):
                told.write_text(str(len(frames)))
                return

    assert os.waitpid(forked(write), 0)[1] == 0
    count = len(Read(path).times)
    assert 5 < count < int(told.read_text()) < len(wall.frames)
    same(Read(path), wall, wall.frames[:count])


def test_a_scene_without_contacts_can_be_read(tmp_path):
    result = simulate(scene(box("alone", (0, 0, 0), (1, 1, 1), LIMESTONE), step=1e-2, duration=0.03))
    write_vtkhdf(tmp_path / "a.vtkhdf", result.bodies, result.scene.blocks, result.frames)
    same(Read(tmp_path / "a.vtkhdf"), result, result.frames)


def test_pyvista_opens_the_file_as_named_blocks(mixed, tmp_path):
    write_vtkhdf(tmp_path / "a.vtkhdf", mixed.bodies, mixed.scene.blocks, mixed.frames)
    reader = pyvista.get_reader(tmp_path / "a.vtkhdf")
    reader.reader.SetStep(len(mixed.frames) - 1)
    blocks = reader.read()
    assert blocks.keys() == ["stones", "contacts"]
    np.testing.assert_array_equal(blocks["stones"].points, np.concatenate(mixed.frames[-1].positions))
    assert np.isfinite(blocks["stones"]["von_mises"]).any()
