"""Checkpoints are whole or not there: damage is seen, a full disk costs a checkpoint, a folder has one program."""

import errno
import os
from pathlib import Path

import numpy as np
import pytest

from ground.errors import UsageError
from mechanics.carried import Carried, Rows
from mechanics.dynamics.progress import silent
from pipelines.results import checkpoints
from pipelines.results.checkpoints import Checkpoints
from pipelines.run.unfinished import UnfinishedRun, unfinished_run
from pipelines.scene.settings import Output


def state(step: int) -> Carried:
    """Return what a run of three stones carries after a step."""
    history = Rows([(0.1 * k, float(k)) for k in range(step)])
    return {"time": 0.1 * step, "centre": np.full((3, 3), float(step)), "history": history}


@pytest.fixture
def written(tmp_path: Path) -> Path:
    """A folder with checkpoints after steps 5 and 10."""
    archive = Checkpoints(tmp_path)
    for step in (5, 10):
        archive.write(step, state(step), {"resumed": []})
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    """Return all files of a folder, hidden ones too."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def no_space(handle: int) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_checkpoint_comes_back_with_its_arrays_and_rows(written: Path) -> None:
    found, wrong = Checkpoints(written).read()
    assert found is not None
    assert (found.step, wrong) == (10, [])
    assert list(found.carried["history"]) == list(state(10)["history"])
    np.testing.assert_array_equal(found.carried["centre"], np.full((3, 3), 10.0))


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.99])
@pytest.mark.parametrize("name", ["checkpoint-00000010.h5", "history-00000010.h5"])
def test_one_wrong_byte_anywhere_leaves_the_checkpoint_before(written: Path, name: str, share: float) -> None:
    path = written / name
    content = bytearray(path.read_bytes())
    # the zeros that fill the head up to its end are no content
    place = int(share * len(content)) if share > 0.1 else 20
    content[place] ^= 0x01
    path.write_bytes(bytes(content))
    found, wrong = Checkpoints(written).read()
    assert found is not None
    assert found.step == 5
    assert [text.split(":")[0] for text in wrong] == ["checkpoint-00000010.h5 is damaged"]
    assert f"the checksum of {name} does not match" in wrong[0]


def test_a_history_of_another_run_is_not_taken(
    written: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    other = tmp_path_factory.mktemp("other")
    archive = Checkpoints(other)
    for step in (5, 10):
        archive.write(
            step, {**state(step), "history": Rows([(0.2 * k, 0.0) for k in range(step)])}, {"resumed": []}
        )
    name = "history-00000010.h5"
    (written / name).write_bytes((other / name).read_bytes())
    found, _ = Checkpoints(written).read()
    assert found is not None
    assert found.step == 5


def test_where_none_can_be_read_all_are_named(written: Path) -> None:
    for path in written.glob("checkpoint-*.h5"):
        path.write_bytes(path.read_bytes()[:-1])
    found, wrong = Checkpoints(written).read()
    assert found is None
    assert [text.split(" is ")[0] for text in wrong] == ["checkpoint-00000010.h5", "checkpoint-00000005.h5"]


def test_a_full_disk_leaves_the_files_before_and_no_others(
    written: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before, archive = contents(written), Checkpoints(written)
    archive.read()
    monkeypatch.setattr(checkpoints.os, "fsync", no_space)
    with pytest.raises(OSError, match="No space left"):
        archive.write(15, state(15), {"resumed": []})
    assert contents(written) == before
    monkeypatch.undo()
    archive.write(20, state(20), {"resumed": []})
    found, wrong = Checkpoints(written).read()
    assert found is not None
    assert (found.step, len(found.carried["history"]), wrong) == (20, 20, [])


def test_the_last_two_checkpoints_are_kept(written: Path) -> None:
    archive = Checkpoints(written)
    for step in (5, 10, 15):
        archive.write(step, state(step), {"resumed": []})
    assert archive.steps() == [15, 10]


def test_a_full_disk_does_not_end_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with unfinished_run(tmp_path / "out", Output(checkpoint=5), None, silent) as archive:
        archive.open((), {}, {}, 20, False)
        archive.checkpoint(5, state(5))
        with monkeypatch.context() as patch:
            patch.setattr(checkpoints.os, "fsync", no_space)
            archive.checkpoint(11, state(11))
        assert archive.warnings == [
            "the checkpoint after step 11 could not be written: No space left on device; those before are kept"
        ]
        archive.checkpoint(12, state(12))
    assert Checkpoints(tmp_path / "out/unfinished").steps() == [12, 5]


def test_a_folder_has_one_program_at_a_time(tmp_path: Path) -> None:
    output = Output(checkpoint=5)
    for resume in (None, True, False):
        with unfinished_run(tmp_path / "out", output, resume, silent):
            with (
                pytest.raises(UsageError, match="another program is running there"),
                unfinished_run(tmp_path / "out", output, resume, silent),
            ):
                pass
            with unfinished_run(tmp_path / "elsewhere", output, resume, silent):
                pass


def test_a_resumed_archive_refuses_another_scene_and_keeps_its_files(written: Path) -> None:
    folder = written / "out"
    with unfinished_run(folder, Output(checkpoint=5), None, silent) as archive:
        archive.open((), {"time.step": "0.1"}, {}, 20, False)
        archive.checkpoint(5, state(5))
    before = contents(folder / "unfinished")
    with unfinished_run(folder, Output(checkpoint=5), True, silent):
        changed = UnfinishedRun(folder, Output(checkpoint=5))
        with pytest.raises(UsageError, match=r"not that of the unfinished run: .*time\.step"):
            changed.open((), {"time.step": "0.2"}, {}, 20, True)
    assert contents(folder / "unfinished") == before


def test_without_checkpoint_the_folder_is_as_before(tmp_path: Path) -> None:
    with unfinished_run(tmp_path / "out", Output(), None, silent) as archive:
        archive.open((), {}, {}, 20, False)
    assert not (tmp_path / "out").exists()
