"""Samples of a study by worker processes: looked up in the store first, taken where there is none."""

import hashlib
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress
from pipelines.assess.study.prepare import problem_of
from pipelines.assess.workers.pool import Lost
from pipelines.assess.workers.store import Sample, SampleStore, Snapshot

_NUMBER = re.compile(r"[+-]?[0-9.]+(e[+-]?[0-9]+)?")

_CONTROLS = "controls"
ATTEMPTS = 11
"""Processes that a sample may lose, one more than the kills that a study must survive.

A sample that kills its process each time, as it needs more memory than there is, must end.
"""


class IncompleteError(Exception):
    """Raised where a part has taken its samples.

    It does not look those of others up: 1,000 parts would look up 10⁸ files of 10⁵.
    """

    def __init__(self, done: int) -> None:
        super().__init__("samples of other parts are theirs")
        self.done = done


@dataclass(frozen=True)
class Part:
    """Part of the samples that a job takes: those whose number is `number` - 1 modulo `count`."""

    number: int = 1
    count: int = 1


@dataclass(frozen=True)
class Task:
    """Sample that a worker takes.

    Attributes
    ----------
    snapshot : of the study
    point : (n,), which follows from the seed and the sample's number
    gradient : wanted
    """

    snapshot: Snapshot
    point: Array
    gradient: bool


def take(task: Task) -> Sample:
    """Take a sample and record it; return the record where there is one."""
    store = SampleStore(task.snapshot)
    known = store.get(task.point, task.gradient)
    if known is not None:
        return known
    sample = problem_of(task.snapshot).sample(task.point, task.gradient)
    store.put(sample)
    return sample


@dataclass
class Sampler:
    """Function of points whose samples are taken by workers.

    Attributes
    ----------
    snapshot : of the study
    run : works on tasks, and yields their numbers and answers
    part : of large batches that this process takes
    progress : called at every sample
    taken, cpu : samples taken here, and their processor time [s]
    faults : of the samples without an answer, by the kind of their reason: the first, and how many
    """

    snapshot: Snapshot
    run: Callable[[Sequence[Any]], Iterator[tuple[int, Any]]]
    part: Part
    progress: Listener
    taken: int = 0
    cpu: float = 0.0
    faults: dict[str, tuple[str, int]] = field(default_factory=dict)

    def __call__(self, points: Array, gradient: bool = False) -> list[Sample]:
        """Return the samples at points (m, n) in their order, all taken here."""
        return self._taken(points, gradient)

    def divided(self, points: Array, gradient: bool = False) -> list[Sample]:
        """Return the samples at points (m, n) of a plan in their order; a part takes its share and ends.

        Raises
        ------
        IncompleteError : this is a part
        """
        if self.part.count == 1:
            return self._taken(points, gradient)
        raise IncompleteError(len(self._taken(points[self.part.number - 1 :: self.part.count], gradient)))

    def alone(self, number: int) -> "Sampler":
        """Return a sampler of one quantity alone, by its number, whose records stand in a folder of their own."""
        content = self.snapshot.content()
        content["quantities"] = [content["quantities"][number]]
        snapshot = Snapshot.write(self.snapshot.folder / _CONTROLS, content)
        return Sampler(snapshot, self.run, self.part, self.progress)

    def _taken(self, points: Array, gradient: bool) -> list[Sample]:
        store, count = SampleStore(self.snapshot), len(points)
        found = [store.get(point, gradient) for point in points]
        todo = [number for number, sample in enumerate(found) if sample is None]
        tasks = [Task(self.snapshot, points[number], gradient) for number in todo]
        done = count - sum(sample is None for sample in found)
        for place, answer in self.run(tasks):
            number = todo[place]
            if isinstance(answer, Lost):
                answer = Sample(points[number], {}, "lost", answer.reason)
                store.put(answer)
            found[number] = answer
            self.taken, self.cpu, done = self.taken + 1, self.cpu + answer.cpu, done + 1
            self.progress(Progress("assess", done, count, "samples"))
        answers = [sample for sample in found if sample is not None]
        for sample in answers:
            if not sample.done:
                # reasons that differ in their numbers alone are one
                kind = _NUMBER.sub("#", f"{sample.state}: {sample.reason}")
                first, many = self.faults.get(kind, (f"{sample.state}: {sample.reason}", 0))
                self.faults[kind] = (first, many + 1)
        return answers

    def digest_of(self, samples: Sequence[Sample]) -> str:
        """Return a digest of the values of samples, whoever took them."""
        digest = hashlib.sha256()
        for sample in samples:
            digest.update(np.ascontiguousarray(sample.point).tobytes())
            digest.update(repr(sorted(sample.values.items())).encode() + sample.state.encode())
        return digest.hexdigest()
