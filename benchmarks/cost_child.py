"""One scene of `benchmarks.cost`, measured in a process of its own; prints one line of JSON."""

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from unittest.mock import patch

import mechanics.simulate
from benchmarks.cost_scenes import Case
from benchmarks.memory import peak_bytes
from benchmarks.report import Row
from mechanics.plan import plan
from mechanics.simulation import Clock

__all__ = ["main"]

# stones of the scene that compiles, or loads, every kernel
_FEW = 12


class _ProcessorClock(Clock):
    """Processor seconds by stage: the machine may have other work."""

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Add the time of a with-block to a stage."""
        start = time.process_time()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.process_time() - start


def main() -> None:
    """`python -m benchmarks.cost_child JSON` with the attributes of a `Case`."""
    case = Case(**json.loads(sys.argv[1]))
    with patch.object(mechanics.simulate, "Clock", _ProcessorClock):
        print(json.dumps(_measured(case)))


def _measured(case: Case) -> Row:
    mechanics.simulate.simulate(replace(case, stones=_FEW, size=1.0).scene())
    before, scene = peak_bytes(), case.scene()
    start = time.process_time()
    result = mechanics.simulate.simulate(scene)
    seconds = time.process_time() - start
    after = peak_bytes()
    start = time.process_time()
    amounts = plan(scene).amounts
    return asdict(case) | {
        "amounts": asdict(amounts),
        "plan": time.process_time() - start,
        "seconds": seconds,
        "stages": result.wall_time,
        "steps": result.steps,
        "iterations": int(result.history.iterations.sum()),
        "unconverged": result.errors.unconverged_steps,
        "outcome": str(result.outcome),
        "memory": None if after is None or before is None else after - before,
        "program": before,
    }


if __name__ == "__main__":
    main()
