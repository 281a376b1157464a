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
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.stopping import Watch, balance_of
from mechanics.model.model import build_model
from mechanics.results.forecast.plan import Amounts, plan
from moma.errors import SolverError

__all__ = ["main"]

# stones of the scene that compiles, or loads, every kernel
_FEW = 12
# steps until all sleep, and steps that are timed then
_UNTIL_ASLEEP, _ASLEEP = 60, 20


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


def _asleep(case: Case) -> Row:
    """Seconds of one step, observers and all, in which all stones sleep."""
    scene = case.scene()
    model, start = build_model(scene)
    simulation, watch = Simulation(model, start), Watch(model, start)
    energy, begun = EnergyBalance(model, start), 0.0
    for count in range(_UNTIL_ASLEEP + _ASLEEP):
        if count == _UNTIL_ASLEEP:
            begun = time.process_time()
        step = simulation.step()
        energy(step)
        watch(step, balance_of(model, step))
    took = (time.process_time() - begun) / _ASLEEP
    if not simulation.asleep[model.inertia.moving].all():
        raise SolverError("not all sleep", where=scene.name)
    amounts = asdict(Amounts(len(scene.blocks), len(step.contacts)))
    return asdict(case) | {
        "amounts": amounts, "seconds": took, "stages": {"asleep": took}, "steps": 1, "memory": None
    }  # fmt: skip


def _measured(case: Case) -> Row:
    if case.mode == "asleep":
        return _asleep(case)
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
