"""Runs of a diagnosis: scenes in, motions of their stones out, here or in processes beside this one.

`Runner` is all that a cluster has to serve: scenes are self-contained texts, and may be run in any order.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from archmodel.database.session import open_database
from ground.errors import MomaError
from mechanics.dynamics.outcome import Outcome
from mechanics.simulate import simulate, simulate_stages
from pipelines.assess.motions import Motions, stone_motions
from pipelines.assess.workers.pool import Lost, workers
from pipelines.run.assemble import assemble
from pipelines.scene.file import parse_scene


@dataclass(frozen=True)
class Trial:
    """A scene to be run.

    Attributes
    ----------
    text, path : of the scene file; the path is for messages and for files beside it
    url : of the database with its stones
    """

    text: str
    path: str
    url: str


@dataclass(frozen=True)
class Tried:
    """Answer to a trial.

    Attributes
    ----------
    motions : of the stones; None if the run failed
    fault : reason of the failure, or of mistrust: the run did not come to rest; empty if there is none
    cpu : time of the processor [s]
    """

    motions: Motions | None
    fault: str
    cpu: float


Runner = Callable[[Sequence[Trial]], Iterable[Tried]]
"""Function that runs scenes, independent of each other, and gives the answers in their order as they come."""


def run_trial(trial: Trial) -> Tried:
    """Run one scene."""
    begun = time.process_time()
    try:
        scene = parse_scene(trial.text, trial.path)
        with open_database(trial.url, create=False) as database, database.session(read_only=True) as session:
            assembly = assemble(scene, session)
        result = simulate_stages(assembly.stages) if assembly.stages else simulate(assembly.scene)
    except MomaError as error:
        return Tried(None, " ".join(str(error).split()), time.process_time() - begun)
    cpu = time.process_time() - begun
    if result.outcome is Outcome.COLLAPSED:
        return Tried(None, "the run ended in collapse", cpu)
    fault = "" if result.outcome.rests else f"its run did not come to rest: {result.outcome}"
    return Tried(stone_motions(result.bodies, assembly.origin), fault, cpu)


def since_rest(tried: Tried, rest: Tried) -> Tried:
    """Return a run whose motions count from where the scene rests without any cause."""
    if tried.motions is None:
        return tried
    fault = f"without any cause: {rest.fault}" if rest.fault else ""
    if rest.motions is None:
        return Tried(None, fault, tried.cpu)
    return Tried(tried.motions.since(rest.motions), "; ".join(filter(None, (tried.fault, fault))), tried.cpu)


@contextmanager
def runner(jobs: int) -> Iterator[Runner]:
    """Yield a function that runs scenes, with so many at a time, each in a process of its own if more than one.

    The processes end with the with-block, however it ends, and with this process if it is killed.
    """
    with workers(jobs, run_trial) as answers:
        yield lambda trials: _in_order(answers(trials))


def _in_order(answers: Iterable[tuple[int, Tried | Lost]]) -> Iterator[Tried]:
    """Yield numbered answers in the order of their numbers, each as soon as it may be."""
    waiting: dict[int, Tried] = {}
    due = 0
    for number, answer in answers:
        waiting[number] = Tried(None, answer.reason, 0.0) if isinstance(answer, Lost) else answer
        while due in waiting:
            yield waiting.pop(due)
            due += 1
