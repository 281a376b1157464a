"""The loop of steps: order of its calls, checkpoints, and where it stops."""

import pytest

from mechanics.dynamics.progress import Clock, SteppedRun


class Counting(SteppedRun):
    """A run that only counts."""

    CARRIED = ("steps",)
    REBUILT = ("clock", "total")

    def __init__(self, total):
        self.clock, self.steps, self.total = Clock(), 0, total

    @property
    def done(self):
        return self.steps >= self.total

    @property
    def text(self):
        return f"step {self.steps}"

    def step(self):
        self.steps += 1


class Noting:
    """An archive that notes its checkpoints among the other calls."""

    def __init__(self, every, calls):
        self.every, self.calls, self.kept = every, calls, {}

    def earlier(self):
        return None

    def checkpoint(self, step, carried):
        self.calls.append(("checkpoint", step))
        self.kept[step] = carried


def gone(run, every=None, stop=lambda: False):
    """Whether a run was stopped, its calls in their order, and its archive."""
    calls = []
    archive = None if every is None else Noting(every, calls)
    stopped = run.go(
        lambda progress: calls.append((progress.text, progress.total)),
        stop,
        archive,
        lambda last: calls.append(("observe", last)),
    )
    return stopped, calls, archive


def test_a_checkpoint_follows_the_observers_of_its_step_and_the_last_step_has_none():
    stopped, calls, archive = gone(Counting(4), every=2)
    assert not stopped
    assert calls[2:5] == [("step 2", 4), ("observe", False), ("checkpoint", 2)]
    assert calls[-2:] == [("step 4", 4), ("observe", True)]
    assert sorted(archive.kept) == [2]


@pytest.mark.parametrize("every", [0, 2, 3])
def test_a_run_that_is_stopped_has_a_checkpoint_of_its_last_step(every):
    run, asked = Counting(9), iter([False, False, True])
    stopped, calls, archive = gone(run, every, lambda: next(asked))
    assert stopped
    assert (run.steps, max(archive.kept)) == (3, 3)
    assert calls[-2:] == [("observe", True), ("checkpoint", 3)]
    assert archive.kept[3]["steps"] == 3


def test_after_the_last_step_nobody_is_asked_whether_to_stop():
    asked = []
    stopped, _, _ = gone(Counting(3), stop=lambda: bool(asked.append(1)))
    assert not stopped
    assert len(asked) == 2


def test_the_seconds_of_a_resumed_run_are_added():
    run, other = Counting(5), Counting(5)
    run.clock.seconds = {"solve": 2.0, "detect": 1.0}
    run.step()
    other.clock.seconds = {"solve": 0.5}
    other.restore(run.carried())
    assert other.steps == 1
    assert other.clock.seconds == {"solve": 2.5, "detect": 1.0}
