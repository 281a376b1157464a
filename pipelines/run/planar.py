"""Runs of scenes of the plane that can be stopped, or killed, and go on."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Listener, silent
from mechanics.planar.result import PlanarResult
from mechanics.planar.scene import PlanarScene
from mechanics.planar.simulate import PlanarObserver, simulate_planar
from pipelines.results.folder import replacing
from pipelines.run.record import versions
from pipelines.run.unfinished import UnfinishedRun, unfinished_run
from pipelines.scene.fingerprint import planar_fingerprint
from pipelines.scene.settings import Output, ParaView

Write = Callable[[Path, PlanarResult, UnfinishedRun], None]
"""Writes results into an empty folder, given the archive of the run."""


def run_planar(
    scene: PlanarScene,
    folder: Path,
    resume: bool | None = None,
    every: int = 100,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    observers: Sequence[PlanarObserver] = (),
    write: Write | None = None,
) -> tuple[PlanarResult, tuple[str, ...]]:
    """Run a scene of the plane with checkpoints; return its result, and warnings of checkpoints.

    Checkpoints change no bit. They stand in the folder until the run is complete; a run that was stopped or killed goes
    on from the last one, and hands the instants after it to the observers again, which know them by their numbers.

    Parameters
    ----------
    scene : the scene
    folder : made if it is not there
    resume : go on with the unfinished run there, if there is one; False: give it up; None: refuse to give it up
    every : number of steps between two checkpoints; those that would take more than 4 % of the time are left out
    progress, stop, observers : as in `simulate_planar`
    write : called at the end, even of an interrupted run, with a new folder that then takes the place of `folder`

    Raises
    ------
    UsageError : there is an unfinished run and `resume` is None; it is of another scene; another program runs there
    SceneError : if a motion leaves the plane
    SolverError : if the motion is no longer finite
    """
    steps = scene.time.steps
    output = Output(checkpoint=every, paraview=ParaView.PVD)
    with unfinished_run(folder, output, resume, progress) as archive:
        archive.open((), planar_fingerprint(scene), versions(), steps, bool(resume))
        result = simulate_planar(scene, progress, stop, archive, observers)
        if write is not None:
            with replacing(folder) as fresh:
                write(fresh, result, archive)
                archive.hand_over(fresh)
        if result.outcome is not Outcome.INTERRUPTED:
            archive.remove()
        return result, tuple(archive.warnings)
