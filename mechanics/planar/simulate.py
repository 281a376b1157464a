"""Run a scene of the plane from its start to its outcome."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from threadpoolctl import ThreadpoolController

from mechanics.carried import Checkpointing
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Listener, silent
from mechanics.planar.result import PlanarFrame, PlanarInstant, PlanarResult
from mechanics.planar.run import PlanarRun
from mechanics.planar.scene import PlanarScene


@dataclass(frozen=True)
class PlanarObserver:
    """Observer of a run, to which nothing need be kept in memory.

    Attributes
    ----------
    every : number of steps between two instants; the last one of the run is handed out too
    take : called with each; in a resumed run, with those after its checkpoint
    steps : further steps after which an instant is handed out
    """

    every: int
    take: Callable[[PlanarInstant], None]
    steps: frozenset[int] = frozenset()

    def wants(self, step: int) -> bool:
        """Return whether the instant after a step is handed out."""
        return step % self.every == 0 or step in self.steps


def simulate_planar(
    scene: PlanarScene,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    archive: Checkpointing | None = None,
    observers: Sequence[PlanarObserver] = (),
) -> PlanarResult:
    """Run a scene of the plane until it rests or its duration is over; `PlanarRun` goes step by step.

    Parameters
    ----------
    scene : the scene
    progress : called at every step
    stop : asked after every step; where it says True, the run ends as interrupted
    archive : keeps checkpoints, and knows from which the run goes on; None: nothing is kept
    observers : see the bodies, contacts and forces of some steps

    Raises
    ------
    SceneError : if disks overlap too much at the start, or a motion leaves the plane
    SolverError : if the motion is no longer finite

    Examples
    --------
    A floor carries the weight of the disk that rests on it:

    >>> from mechanics.planar.scene import Disk, PlanarScene, Wall
    >>> disk, floor = Disk("disk", (0.0, 0.1), 0.1), Wall("floor", (-1.0, 0.0), (1.0, 0.0))
    >>> result = simulate_planar(PlanarScene("rest", (disk,), (floor,)))
    >>> round(result.reaction / result.weight, 6)
    1.0
    """
    # products of several threads would not be the same to the last bit
    with ThreadpoolController().limit(limits=1, user_api="blas"):
        run = PlanarRun(scene)
        earlier = None if archive is None else archive.earlier()
        if earlier is not None:
            run.restore(earlier)

        def observe(last: bool) -> None:
            """Hand the instant out to the observers that want it."""
            due = [observer for observer in observers if last or observer.wants(run.steps)]
            if due:
                instant = run.instant()
                for observer in due:
                    observer.take(instant)

        stopped = run.go(progress, stop, archive, observe)
        return _with_its_end(run.result(Outcome.INTERRUPTED if stopped else None))


def _with_its_end(result: PlanarResult) -> PlanarResult:
    """Return a result whose frames include its last instant."""
    if result.frames[-1].time == result.time:
        return result
    return replace(result, frames=(*result.frames, PlanarFrame(result.time, result.position)))
