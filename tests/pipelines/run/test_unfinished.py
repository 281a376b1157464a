"""Runs that were killed, stopped or hampered by the disk go on, and end with the bits of an unbroken run."""

import errno
import json
import os
import random
import signal
import time

import numpy as np
import pytest
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from archmodel.database.session import open_database
from ground.errors import DatabaseError, UsageError
from pipelines.results import checkpoints, vtkhdf
from pipelines.run import record as record_module
from pipelines.run import run as run_module
from pipelines.run import unfinished
from pipelines.run.run import run_scene
from tests.moma.commands import fails, invoke, prints
from tests.pipelines.scenes import TWO_COURSES

SCENE = (
    TWO_COURSES
    + """\
[time]
step = 0.005
theta = 0.5
duration = 0.3
stop_at_equilibrium = false
[output]
pictures = []
frame_every = 6
paraview = "both"
series = ["W02-02", "W02-03"]
checkpoint = 5
"""
)
TILTED = "\n[gravity]\ndirection = [0.6, 0.1, -1.0]\n"
ELASTIC = SCENE.replace("fixed =", 'deformable = ["W02-02"]\nfixed =').replace(
    "[time]", "[mesh]\nsize = 0.3\n[time]"
)
BONDED = (
    SCENE
    + TILTED
    + """
[[laws]]
type = "mortar"
between = ["course = 1", "course = 2"]
friction = 0.3
tension = 2e3
shear = 1e3
"""
)
SLEEPING = SCENE.replace("theta", "sleep = 1e-3\ntheta").replace("0.3\nstop", "0.5\nstop")
SCENES = {
    "elastic": ELASTIC + TILTED,
    "bonded": BONDED,
    "sleeping": SLEEPING,
    "two threads": SCENE + TILTED + "[solver]\nthreads = 2\n",
}


@pytest.fixture(autouse=True)
def every_checkpoint(monkeypatch):
    """Steps of these scenes are so fast that most checkpoints would be left out."""
    monkeypatch.setattr(unfinished, "SHARE", np.inf)
    monkeypatch.setattr(vtkhdf, "SHARE", np.inf)


def written(place, text, name="scene.toml"):
    path = place / name
    path.write_text(text, encoding="utf-8")
    return path


def bits(folder):
    """The bytes of all tables and meshes, and all numbers of the summary except times of the machine."""
    files = {
        path.name: path.read_bytes()
        for path in folder.iterdir()
        if path.suffix in (".csv", ".vtu", ".pvd", ".vtkhdf")
    }
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    own = {"resumed", "warnings"}
    summary["time"] = {key: summary["time"][key] for key in ("simulated", "rest")}
    return files | {key: value for key, value in summary.items() if key not in own}


def run_summary(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def differing(one, other):
    one, other = bits(one), bits(other)
    return [name for name in one | other if one.get(name) != other.get(name)]


def killed(delay, *arguments, **options):
    """Run a scene in a process that is killed after some time [s]; return whether it still ran then."""
    child = os.fork()
    if child == 0:
        try:
            run_scene(*arguments, **options)
        finally:
            os._exit(0)
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    return os.waitpid(child, 0)[1] == signal.SIGKILL


def killed_after(step, *arguments, **options):
    """Run a scene in a process that is killed as soon as it reports a step."""
    child = os.fork()
    if child == 0:

        def listen(report):
            if (report.stage, report.done) == ("step", step):
                os.kill(os.getpid(), signal.SIGKILL)

        try:
            run_scene(*arguments, progress=listen, **options)
        finally:
            os._exit(1)
    assert os.waitpid(child, 0)[1] == signal.SIGKILL


def times(path):
    """The instants that VTK's reader finds in a file."""
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    return list(reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()))


def names(folder):
    return sorted(path.name for path in (folder / "unfinished").glob("checkpoint-*"))


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[pytest.mark.slow] if one == "elastic" else []) for one in SCENES]
)
def test_a_killed_run_goes_on_after_its_last_checkpoint_and_so_does_one_killed_again(tmp_path, own_url, name):
    scene = written(tmp_path, SCENES[name])
    whole = run_scene(scene, own_url, tmp_path / "whole")
    out = tmp_path / "out"
    killed_after(23, scene, own_url, out)
    assert names(out) == ["checkpoint-00000015.h5", "checkpoint-00000020.h5"]
    assert times(out / "results.vtkhdf") == pytest.approx([0.0, 0.03, 0.06, 0.09])
    killed_after(42, scene, own_url, out, resume=True)
    assert names(out) == ["checkpoint-00000035.h5", "checkpoint-00000040.h5"]
    assert times(out / "results.vtkhdf") == pytest.approx(np.arange(7) * 0.03)
    heard = []
    done = run_scene(scene, own_url, out, resume=True, progress=heard.append)
    assert differing(tmp_path / "whole", out) == []
    assert done.summary["steps"] == whole.summary["steps"]
    assert done.summary["resumed"] == [{"step": 20, "changed": []}, {"step": 40, "changed": []}]
    steps = [one.done for one in heard if one.stage == "step"]
    assert steps == list(range(40, whole.summary["steps"] + 1))
    assert not (out / "unfinished").exists()


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("bonded", 3),
        *(pytest.param(name, 50, marks=pytest.mark.slow) for name in SCENES),
    ],
)
def test_a_kill_at_any_instant_costs_no_bit(tmp_path, own_url, name, count):
    scene = written(tmp_path, SCENES[name])
    run_scene(scene, own_url, tmp_path / "whole")
    begun = time.perf_counter()
    run_scene(scene, own_url, tmp_path / "warm")  # the first may compile kernels for minutes
    lasts = time.perf_counter() - begun
    instants = random.Random(f"{name} {count}")
    living = 0
    for number in range(count):
        out = tmp_path / f"out{number}"
        living += killed(instants.uniform(0.0, lasts), scene, own_url, out, resume=True)
        living += killed(instants.uniform(0.0, 0.5 * lasts), scene, own_url, out, resume=True)
        if unfinished.finished_run(out, scene.read_text(encoding="utf-8")) is None:
            run_scene(scene, own_url, out, resume=True)
        assert differing(tmp_path / "whole", out) == [], number
    assert living > count / 2


@pytest.fixture
def stopped(tmp_path, own_url):
    """A scene and a folder with a run that was killed after its step 23."""
    scene = written(tmp_path, BONDED)
    killed_after(23, scene, own_url, tmp_path / "out")
    return scene, own_url, tmp_path / "out"


def spoilt(path, at=0.5):
    """Change one byte of a file."""
    content = bytearray(path.read_bytes())
    content[int(at * len(content))] ^= 0xFF
    path.write_bytes(bytes(content))


@pytest.mark.parametrize(
    ("name", "at"),
    [("checkpoint-00000020.h5", 0.02), ("checkpoint-00000020.h5", 0.9), ("history-00000020.h5", 0.5)],
)
def test_a_damaged_checkpoint_leaves_the_one_before(tmp_path, stopped, name, at):
    scene, url, out = stopped
    run_scene(scene, url, tmp_path / "whole")
    spoilt(out / "unfinished" / name, at)
    done = run_scene(scene, url, out, resume=True)
    assert differing(tmp_path / "whole", out) == []
    assert done.summary["resumed"] == [{"step": 15, "changed": []}]
    expected = "checkpoint-00000020.h5 is damaged: the checksum of "
    assert any(
        one.startswith(expected) and one.endswith("the run went on after step 15") for one in done.warnings
    )


def test_a_file_cut_short_counts_as_damaged(stopped):
    scene, url, out = stopped
    newest = out / "unfinished/checkpoint-00000020.h5"
    newest.write_bytes(newest.read_bytes()[:700])
    assert run_scene(scene, url, out, resume=True).summary["resumed"][0]["step"] == 15


def test_without_a_readable_checkpoint_nothing_is_lost_or_begun(stopped):
    scene, url, out = stopped
    for name in names(out):
        spoilt(out / "unfinished" / name)
    before = sorted(path.name for path in (out / "unfinished").iterdir())
    with pytest.raises(UsageError, match=r"no checkpoint can be read: checkpoint-00000020\.h5 .*--restart"):
        run_scene(scene, url, out, resume=True)
    assert sorted(path.name for path in (out / "unfinished").iterdir()) == before


def test_a_full_disk_costs_checkpoints_but_not_the_run(tmp_path, stopped, monkeypatch):
    scene, url, out = stopped
    run_scene(scene, url, tmp_path / "whole")
    count, sync = 0, os.fsync

    def full(handle):
        nonlocal count
        count += 1
        if count % 3 == 0:
            os.ftruncate(handle, 100)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        sync(handle)

    monkeypatch.setattr(checkpoints.os, "fsync", full)
    done = run_scene(scene, url, out, resume=True)
    assert differing(tmp_path / "whole", out) == []
    failed = [one for one in done.warnings if "could not be written: No space left on device" in one]
    assert 0 < len(failed) < 8


def test_checkpoints_that_could_not_be_written_leave_those_before(stopped, monkeypatch):
    scene, url, out = stopped
    before = {path.name: path.read_bytes() for path in (out / "unfinished").glob("*.h5")}

    def full(handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(checkpoints.os, "fsync", full)
    killed_after(47, scene, url, out, resume=True)
    assert {path.name: path.read_bytes() for path in (out / "unfinished").glob("*.h5")} == before
    monkeypatch.undo()
    assert run_scene(scene, url, out, resume=True).summary["resumed"] == [{"step": 20, "changed": []}]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("step = 0.005", "step = 0.004", "time.step 0.005, now 0.004"),
        ("tension = 2e3", "tension = 3e3", "contact.rules 1.law.tension 2000.0, now 3000.0"),
        ("[0.6, 0.1, -1.0]", "[0.2, 0.1, -1.0]", "gravity "),
        ("density = 2350.0", "density = 2300.0", "stone W01-01: material"),
        ("frame_every = 6", "frame_every = 5", "frame_every 6, now 5"),
        ("course <= 2", "course <= 2 and code != 'W02-05'", "stone W02-05 is gone"),
        ("duration = 0.3", "duration = 0.1", "duration: the run has done 20 steps, 20 are asked for"),
    ],
)
def test_another_scene_is_refused_and_named(stopped, old, new, said):
    scene, url, out = stopped
    assert old in BONDED
    written(scene.parent, BONDED.replace(old, new))
    with pytest.raises(UsageError) as caught:
        run_scene(scene, url, out, resume=True)
    assert "the scene is not that of the unfinished run: " in str(caught.value)
    assert said in str(caught.value)
    assert names(out) == ["checkpoint-00000015.h5", "checkpoint-00000020.h5"]


def test_another_stone_in_the_database_is_refused_and_named(stopped):
    scene, url, out = stopped
    text = '[[depth]]\nvalue = 0.31\nsigma = 0.01\nsource = "drilled"\nstones = ["W02-03"]\n'
    prints("record", written(scene.parent, text, "depth.toml"), "--db", url)
    with pytest.raises(UsageError, match=r"unfinished run: stone W02-03: solid in the database"):
        run_scene(scene, url, out, resume=True)


def test_what_changes_no_bit_may_change_and_is_recorded(tmp_path, stopped):
    scene, url, out = stopped
    text = BONDED.replace("duration = 0.3", "duration = 0.4").replace(
        "checkpoint = 5", "checkpoint = 7 # less"
    )
    written(tmp_path, text)
    done = run_scene(scene, url, out, resume=True)
    assert done.summary["resumed"] == [{"step": 20, "changed": ["time.duration 0.3, now 0.4"]}]
    run_scene(scene, url, tmp_path / "whole")
    assert differing(tmp_path / "whole", out) == []


def test_other_libraries_are_recorded(stopped, monkeypatch):
    scene, url, out = stopped
    monkeypatch.setattr(run_module, "versions", lambda: {"moma-masonry": "9.9"})
    done = run_scene(scene, url, out, resume=True)
    assert any("with other libraries (" in one and "the last bits may differ" in one for one in done.warnings)


def test_an_unfinished_run_is_not_given_up_in_silence(stopped):
    scene, url, out = stopped
    words = "run", scene, "--db", url, "--out", out
    line = fails(2, *words)
    assert (
        "holds an unfinished run, with a checkpoint after step 20; go on with --resume, or begin again"
        in line
    )
    assert "holds an unfinished run" in fails(2, "check", scene, "--db", url, "--pictures", out)
    assert names(out) == ["checkpoint-00000015.h5", "checkpoint-00000020.h5"]
    # stones still move as the time ends
    assert invoke(*words, "--restart", "--json").exit_code == 1
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["resumed"] == []
    done = invoke(*words, "--resume")
    assert done.exit_code == 0
    assert "the run there has finished; leave out --resume to run the scene again" in done.stderr
    assert done.stdout.startswith("Two courses: moving after 0.3 s: stone ")
    written(scene.parent, SCENE)
    assert "of another scene" in fails(2, *words, "--resume")


def test_an_interrupted_run_has_results_and_goes_on(tmp_path, own_url):
    scene, out = written(tmp_path, BONDED), tmp_path / "out"
    run_scene(scene, own_url, tmp_path / "whole")
    count = iter(range(100))
    done = run_scene(scene, own_url, out, stop=lambda: next(count) == 11)
    assert (done.summary["outcome"], done.summary["steps"]) == ("interrupted", 12)
    assert names(out)[-1] == "checkpoint-00000012.h5"
    with pytest.raises(UsageError, match="go on with --resume"):
        run_scene(scene, own_url, out)
    # what was there stays until the whole run is
    killed_after(30, scene, own_url, out, resume=True)
    assert json.loads((out / "summary.json").read_text(encoding="utf-8"))["steps"] == 12
    run_scene(scene, own_url, out, resume=True)
    assert differing(tmp_path / "whole", out) == []


def test_a_run_that_could_not_be_stored_is_stored_by_resuming_it(tmp_path, own_url, monkeypatch):
    scene, out = written(tmp_path, BONDED), tmp_path / "out"

    def locked(session, record):
        raise DatabaseError("database is locked", where="own.db")

    with monkeypatch.context() as patch:
        patch.setattr(record_module, "store_run", locked)
        with pytest.raises(DatabaseError, match="could not be stored"):
            run_scene(scene, own_url, out)
    (newest, *_), steps = reversed(names(out)), run_summary(out)["steps"]
    complete = run_summary(out)["outcome"]
    done = run_scene(scene, own_url, out, resume=True)
    last = int(newest.partition("-")[2].partition(".")[0])
    # the run is stored from its last checkpoint on, not begun again
    assert done.summary["resumed"] == [{"step": last, "changed": []}]
    assert 0 < last < steps == done.summary["steps"]
    assert (done.run, done.summary["outcome"]) == (1, complete)
    assert not (out / "unfinished").exists()


def test_a_run_without_a_checkpoint_leaves_nothing(tmp_path, own_url):
    scene, out = written(tmp_path, BONDED), tmp_path / "out"
    killed_after(3, scene, own_url, out)
    assert names(out) == []
    assert run_scene(scene, own_url, out).summary["resumed"] == []
    with pytest.raises(UsageError):
        run_scene(written(tmp_path, SCENE + "[[loads]]\n"), own_url, tmp_path / "other" / "folder")
    with open_database(own_url, create=False):
        assert not (tmp_path / "other" / "folder").exists()


def test_two_programs_do_not_run_in_one_folder(tmp_path, own_url):
    scene, out = written(tmp_path, BONDED), tmp_path / "out"

    def second(report):
        if (report.stage, report.done) == ("step", 10):
            with pytest.raises(UsageError, match="another program is running there"):
                run_scene(scene, own_url, out, resume=True)

    run_scene(scene, own_url, out, progress=second)
