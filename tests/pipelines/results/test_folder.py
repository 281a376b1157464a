"""Results appear whole or not at all, and replace nothing but earlier results."""

import errno
import json
import os
import subprocess
import sys

import pytest

from ground.errors import StorageError, UsageError
from pipelines.results.folder import UNFINISHED_ASSESSMENT, check_replaceable, replacing, source_of
from tests.paths import ROOT


def write(folder, name, text="x"):
    (folder / name).write_text(text, encoding="utf-8")


def results(folder, *names):
    """A folder as a run leaves it."""
    folder.mkdir()
    for name in names:
        write(folder, name)
    write(folder, "summary.json", json.dumps({"files": [*names, "summary.json"]}))
    return folder


def test_results_replace_earlier_ones_whole(tmp_path):
    folder = results(tmp_path / "out", "old.png")
    with replacing(folder) as fresh:
        write(fresh, "new.png")
        assert (folder / "old.png").exists()
    assert [one.name for one in folder.iterdir()] == ["new.png"]
    assert [one.name for one in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt])
def test_a_failed_run_leaves_what_was_there(tmp_path, failure):
    folder = results(tmp_path / "out", "old.png")

    def run():
        with replacing(folder) as fresh:
            write(fresh, "new.png")
            raise failure

    with pytest.raises(failure):
        run()
    assert sorted(one.name for one in folder.iterdir()) == ["old.png", "summary.json"]
    assert [one.name for one in tmp_path.iterdir()] == ["out"]


def test_folders_above_are_made_and_an_empty_one_is_taken(tmp_path):
    with replacing(tmp_path / "a/b/c") as fresh:
        write(fresh, "new.png")
    assert (tmp_path / "a/b/c/new.png").exists()
    (tmp_path / "empty").mkdir()
    check_replaceable(tmp_path / "empty")


def test_what_no_run_wrote_is_not_replaced(tmp_path):
    folder = results(tmp_path / "out", "old.png")
    write(folder, "my_state.pvsm")
    with pytest.raises(UsageError, match=r"my_state\.pvsm"):
        check_replaceable(folder)
    with pytest.raises(UsageError), replacing(folder):
        pass
    assert (folder / "my_state.pvsm").exists()
    home = tmp_path / "home"
    home.mkdir()
    write(home, "thesis.tex")
    write(home, "summary.json", "[1]")
    with pytest.raises(UsageError, match=r"summary\.json, thesis\.tex"):
        check_replaceable(home)
    with pytest.raises(UsageError, match="not a folder"):
        check_replaceable(home / "thesis.tex")


def test_what_moma_wrote_with_another_command_is_replaced_but_not_the_results_of_a_run(tmp_path):
    pictures = tmp_path / "garden"
    pictures.mkdir()
    write(pictures, "joints.png")
    write(pictures, "check.json", json.dumps({"files": ["joints.png", "check.json"]}))
    check_replaceable(pictures)
    check_replaceable(pictures, "survey.json")
    run = results(tmp_path / "out", "report.html")
    with pytest.raises(UsageError, match="holds the results of a run; name another folder"):
        check_replaceable(run, "check.json")
    check_replaceable(run)


KILLED = """
import json, os, pathlib, signal, sys
from pipelines.results import folder as module

place, exchange = pathlib.Path(sys.argv[1]), sys.argv[2] == "True"
if not exchange:
    module._exchanged = lambda one, other: False


def fill(folder, name):
    (folder / name).write_text("x")
    (folder / "summary.json").write_text(json.dumps({"files": [name, "summary.json"]}))


def replace_and_die(folder, count):
    child = os.fork()
    if child == 0:
        left = [count]

        def hook(event, arguments):
            if event.split(".")[0] in ("os", "shutil", "tempfile", "ctypes", "open", "fcntl"):
                left[0] -= 1
                if left[0] < 0:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(hook)
        with module.replacing(folder) as fresh:
            fill(fresh, "new.png")
        os._exit(0)
    return os.waitpid(child, 0)[1]


count, ended, seen = 0, False, []
while not ended:
    own = place / str(count)
    own.mkdir()
    folder = own / "out"
    folder.mkdir()
    fill(folder, "old.png")
    ended = replace_and_die(folder, count) == 0
    if not exchange:  # between the two renames MOMA alone finds them
        module.check_replaceable(folder)
    found = sorted(one.name for one in folder.iterdir())
    with module.replacing(folder) as fresh:
        fill(fresh, "newer.png")
    seen.append([found, sorted(one.name for one in own.iterdir()), sorted(one.name for one in folder.iterdir())])
    count += 1
print(json.dumps(seen))
"""
"""Replace results in child processes, the n-th of which kills itself before its n-th call to the file system."""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="names are exchanged on Linux alone")
@pytest.mark.parametrize("exchange", [True, False])
def test_a_kill_at_any_instant_leaves_old_or_new_results_and_the_next_run_cleans_up(tmp_path, exchange):
    done = subprocess.run(
        [sys.executable, "-c", KILLED, str(tmp_path), str(exchange)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert len(seen) > 15
    ways = {tuple(found) for found, _, _ in seen}
    assert ways == {("old.png", "summary.json"), ("new.png", "summary.json")}
    assert {tuple(left) for _, left, _ in seen} == {("out",)}
    assert {tuple(after) for _, _, after in seen} == {("newer.png", "summary.json")}


def test_the_hidden_folder_of_a_run_that_lives_is_left_alone(tmp_path):
    with replacing(tmp_path / "out") as fresh:
        write(fresh, "new.png")
        with replacing(tmp_path / "out2") as other:
            write(other, "new.png")
        assert (fresh / "new.png").exists()
    assert sorted(one.name for one in tmp_path.iterdir()) == ["out", "out2"]


def test_a_hidden_folder_of_the_user_is_left_alone(tmp_path):
    (tmp_path / ".out-settings").mkdir()
    with replacing(tmp_path / "out") as fresh:
        write(fresh, "new.png")
    assert (tmp_path / ".out-settings").exists()


@pytest.mark.parametrize(
    "failure",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        OSError(
            "Can't write data (file write failed: errno = 28, error message = 'No space left on device')"
        ),
        RuntimeError("Can't decrement id ref count (unable to close file, errno = 28)"),
    ],
)
def test_a_full_disk_is_named_with_what_is_kept(tmp_path, failure):
    folder = results(tmp_path / "out", "old.png")

    def run():
        with replacing(folder) as fresh:
            write(fresh, "new.png")
            raise failure

    with pytest.raises(StorageError, match=r"out: the disk is full; make room .*; earlier results there"):
        run()
    assert sorted(one.name for one in folder.iterdir()) == ["old.png", "summary.json"]
    assert [one.name for one in tmp_path.iterdir()] == ["out"]


def test_other_failures_are_not_taken_for_a_full_disk(tmp_path):
    with pytest.raises(FileNotFoundError), replacing(tmp_path / "out"):
        (tmp_path / "none").read_text(encoding="utf-8")
    with pytest.raises(RuntimeError, match="a mistake"), replacing(tmp_path / "out"):
        raise RuntimeError("a mistake")


def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_computed(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "access", lambda place, mode: place != tmp_path)
    with pytest.raises(UsageError, match=f"{tmp_path}: the folder cannot be written"):
        check_replaceable(tmp_path / "a/b/out")


def test_results_of_another_scene_are_replaced_only_where_that_is_asked_for(tmp_path):
    scene, other = tmp_path / "wall.toml", tmp_path / "tower.toml"
    folder = results(tmp_path / "out", "old.png")
    told = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    check_replaceable(folder, source=[scene])  # an older version did not say of which scene they are
    write(folder, "summary.json", json.dumps(told | {"source": source_of([scene], folder)}))
    check_replaceable(folder, source=[scene])
    check_replaceable(folder)
    with pytest.raises(UsageError, match=r"holds the results of .*wall\.toml; .* --overwrite"):
        check_replaceable(folder, source=[other])
    # moved together with their scene, they are still of that scene
    moved = tmp_path.parent / f"{tmp_path.name}-moved"
    tmp_path.rename(moved)
    check_replaceable(moved / "out", source=[moved / "wall.toml"])
    with pytest.raises(UsageError):
        check_replaceable(moved / "out", source=[moved / "tower.toml"])
    moved.rename(tmp_path)


def test_unfinished_work_of_another_command_is_left_alone(tmp_path):
    folder = tmp_path / "out"
    (folder / UNFINISHED_ASSESSMENT).mkdir(parents=True)
    check_replaceable(folder, "assessment.json")
    for index in ("summary.json", "diagnosis.json"):
        with pytest.raises(UsageError, match="holds an unfinished assessment"):
            check_replaceable(folder, index)
