"""A run in progress on the disk: its checkpoints, so that it can go on after Ctrl-C, a crash or a power cut."""

import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ground.errors import StorageError, UsageError, storing
from mechanics.carried import Carried
from mechanics.dynamics.progress import Listener, Progress
from mechanics.results.result import BodyResult, Frame
from mechanics.scene.scene import Block
from pipelines.results.checkpoints import Checkpoint, Checkpoints, write_whole
from pipelines.results.folder import RUN_INDEX, UNFINISHED, locked
from pipelines.results.vtkhdf import RESULTS, SHARE, GrowingResults
from pipelines.scene.fingerprint import changes
from pipelines.scene.settings import Output, ParaView
from survey.conventions import LISTED

_INPUTS = "inputs.json"

_STORED_ENDINGS = (
    ".h5",
    ".json",
    ".csv",
    ".npz",
)  # files of an unfinished run: checkpoints, inputs, observations


def finished_run(folder: Path, text: str) -> dict[str, Any] | None:
    """Return the summary of a folder whose run has finished, None if it has not.

    Raises
    ------
    UsageError : it is the run of another scene than that of `text`
    """
    if not (folder / RUN_INDEX).exists() or _checkpoints(folder).steps():
        return None
    try:
        summary = json.loads((folder / RUN_INDEX).read_text(encoding="utf-8"))
        same = (folder / "scene.toml").read_text(encoding="utf-8") == text
    except (OSError, ValueError):
        return None
    if not same:
        raise UsageError(
            "the run there has finished, but is of another scene",
            where=str(folder),
            remedy="leave out --resume to replace its results",
        )
    return dict(summary)


class UnfinishedRun:
    """Archive of a run, in the folder of its results.

    Checkpoints change no bit of a run, so they may be left out where steps are so fast that they would cost more than
    the steps; the first one is always written.

    Parameters
    ----------
    folder : of the results
    output : what the scene asks for

    Attributes
    ----------
    warnings : of checkpoints that were damaged, or could not be written
    resumed : the earlier resumptions, and this one: each the step, and what had changed
    """

    def __init__(self, folder: Path, output: Output) -> None:
        self.every = output.checkpoint
        self._shown = folder / RESULTS if output.paraview is not ParaView.PVD else None
        self._results: GrowingResults | None = None
        self._blocks: tuple[Block, ...] = ()
        self.warnings: list[str] = []
        self.resumed: list[dict[str, Any]] = []
        self._place = folder / UNFINISHED
        self._checkpoints = Checkpoints(self._place)
        self._found: Checkpoint | None = None
        self._versions: Mapping[str, str] = {}
        self._took, self._ended = 0.0, -float("inf")

    @property
    def steps(self) -> int:
        """Steps that the run had done when it was resumed; 0 if it begins."""
        return 0 if self._found is None else self._found.step

    def open(
        self,
        blocks: tuple[Block, ...],
        inputs: Mapping[str, str],
        versions: Mapping[str, str],
        duration: int,
        resume: bool,
    ) -> None:
        """Find the checkpoint from which the run goes on, if it is to; otherwise make room for a new one.

        Parameters
        ----------
        blocks : of the scene
        inputs : fingerprint of all that decides on the bits
        versions : of the program and its libraries
        duration : steps of the whole run
        resume : go on, if there is a run to go on with

        Raises
        ------
        UsageError : the scene has changed since, or no checkpoint can be read
        """
        self._versions, self._blocks = versions, blocks
        if resume and self._checkpoints.steps():
            self._go_on(inputs, versions, duration)
            return
        for path in self._place.iterdir():
            path.unlink()
        write_whole(self._place / _INPUTS, json.dumps(inputs, ensure_ascii=False).encode())

    def _go_on(self, inputs: Mapping[str, str], versions: Mapping[str, str], duration: int) -> None:
        carried, wrong = self._checkpoints.read()
        where = str(self._place)
        try:
            then = json.loads((self._place / _INPUTS).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            carried, wrong = None, [*wrong, f"{_INPUTS} is damaged"]
        if carried is None:
            raise UsageError(
                f"no checkpoint can be read: {'; '.join(wrong)}",
                where=where,
                remedy="begin again with --restart",
            )
        forbidden, free = changes(then, inputs)
        if carried.step >= duration:
            forbidden.append(f"duration: the run has done {carried.step} steps, {duration} are asked for")
        if forbidden:
            more = f", and {len(forbidden) - LISTED} more" if len(forbidden) > LISTED else ""
            raise UsageError(
                f"the scene is not that of the unfinished run: {'; '.join(forbidden[:LISTED])}{more}",
                where=where,
                remedy="undo the change, or begin again with --restart",
            )
        differing = [
            f"{name} {carried.notes['versions'].get(name)}, now {versions.get(name)}"
            for name in dict.fromkeys([*carried.notes["versions"], *versions])
            if carried.notes["versions"].get(name) != versions.get(name)
        ]
        self.warnings += [f"{what}; the run went on after step {carried.step}" for what in wrong]
        if differing:
            self.warnings.append(
                f"resumed after step {carried.step} with other libraries ({', '.join(differing)}): "
                "the last bits may differ"
            )
        self.resumed = [*carried.notes["resumed"], {"step": carried.step, "changed": [*free, *differing]}]
        self._found = carried
        if free:
            write_whole(self._place / _INPUTS, json.dumps(inputs, ensure_ascii=False).encode())

    def earlier(self) -> Carried | None:
        """Return what the run carried when it was stopped; None if it begins."""
        return None if self._found is None else self._found.carried

    def begin(self, bodies: tuple[BodyResult, ...], frames: Sequence[Frame]) -> None:
        """Write the frames so far, for ParaView; earlier results keep their place until the run is complete."""
        if self._shown is None:
            return
        with self._hampered():
            self._results = GrowingResults(self._place / RESULTS, bodies, self._blocks, frames)
            if not self._shown.exists():
                with suppress(OSError):  # a system without links
                    self._shown.unlink(missing_ok=True)
                    self._shown.symlink_to(Path(UNFINISHED) / RESULTS)

    def frame(self) -> None:
        """Let the file for ParaView grow by what is new."""
        if self._results is not None:
            with self._hampered():
                self._results.update()

    @contextmanager
    def _hampered(self) -> Iterator[None]:
        """Go on without the file for ParaView where it cannot be written; it is written whole at the end."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            self._results = None
            self.warnings.append(f"{RESULTS} did not grow as the run went on: {error}")

    def checkpoint(self, step: int, carried: Carried) -> None:
        """Write a checkpoint; a disk that is full is no reason to give up the run."""
        began = time.perf_counter()
        if began - self._ended < self._took / SHARE and step % self.every == 0:
            return
        try:
            self._checkpoints.write(step, carried, {"versions": self._versions, "resumed": self.resumed})
        except OSError as error:
            self.warnings.append(
                f"the checkpoint after step {step} could not be written: {error.strerror or error}; "
                "those before are kept"
            )
        self._ended = time.perf_counter()
        self._took = self._ended - began

    def hand_over(self, folder: Path) -> None:
        """Give the checkpoints and observations to the folder that will take the place of the present one, too."""
        there = folder / UNFINISHED
        there.mkdir()
        for path in self._place.glob("[!.]*.*"):
            if path.suffix not in _STORED_ENDINGS:
                continue
            try:
                os.link(path, there / path.name)
            except OSError:
                shutil.copy2(path, there / path.name)

    def remove(self) -> None:
        """Remove the checkpoints of a run that is complete."""
        shutil.rmtree(self._place, ignore_errors=True)


@contextmanager
def unfinished_run(
    folder: Path, output: Output, resume: bool | None, progress: Listener
) -> Iterator[UnfinishedRun]:
    """Yield the archive of a run in its folder, which no other program may use in the meantime.

    Where the run fails before its first checkpoint, nothing of it is left.

    Parameters
    ----------
    folder : of the results
    output : what the scene asks for
    resume : go on with an unfinished run; False: give it up; None: refuse to give it up
    progress : told how far an unfinished run is

    Raises
    ------
    UsageError : there is an unfinished run, or another program runs there
    StorageError : the disk is full, for example
    """
    place, made = folder / UNFINISHED, not folder.exists()
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"cannot be written: {error.strerror}", where=str(folder), remedy="name another folder"
        ) from error
    with locked(place):
        steps = _checkpoints(folder).steps()
        if steps and resume is None:
            raise UsageError(
                f"holds an unfinished run, with a checkpoint after step {steps[0]}",
                where=str(folder),
                remedy="go on with --resume, or begin again with --restart",
            )
        if steps and resume:
            progress(Progress("blocks", 0, None, f"the run will go on after step {steps[0]}"))
        archive = UnfinishedRun(folder, output)
        try:
            with storing(str(folder)):
                yield archive
        except StorageError as error:
            if not (checkpoints := _checkpoints(folder).steps()):
                raise
            how = f"--resume goes on after step {checkpoints[0]}"
            raise StorageError(error.what, where=error.where, remedy=f"{error.remedy}; {how}") from error
        finally:
            if not _checkpoints(folder).steps():
                shutil.rmtree(place, ignore_errors=True)
                if (shown := folder / RESULTS).is_symlink() and not shown.exists():
                    shown.unlink()
                if made:
                    with suppress(OSError):
                        folder.rmdir()


def _checkpoints(folder: Path) -> Checkpoints:
    return Checkpoints(folder / UNFINISHED)
