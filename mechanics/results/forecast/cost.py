"""Expected cost of a run: seconds by stage, and memory.

The seconds of a stage are a sum over the amounts on which its algorithm depends (`Amounts`), each times the seconds of
one unit on the machine named in cost_rates. Two numbers are unknown beforehand: the iterations of the contact problems,
and the steps until a scene rests. The result is therefore a range: each stage has the factors by which measured runs
lay above and below, and the number of steps has a least, a likely and a largest value. Where stones may move, or a run
ends as soon as it rests, nothing bounds the iterations: its range reaches from steps that are solved at once to a run
of its whole duration whose contacts never converge.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import cache

import numpy as np

from mechanics.results.forecast.cost_rates import CALIBRATION, MEMORY, RATES
from mechanics.results.forecast.plan import Amounts, Plan
from mechanics.scene.scene import Scene, Start, TimeSettings

# least, likely and largest number of steps:
_RESTING = (5, 6, 40)  # from an equilibrium: the steps in which it must last, and the one that finds it
_RELAXING = (5, 20, 80)  # of a kinetic relaxation
_SETTLING = (5, 30, 300)  # of a run from rest that ends where it begins
_SWEEP = 1.5e-7  # one sweep of projections over the contacts, for each [s]
_ATTEMPTS = 3.0  # a step is tried by Newton, by ADMM, and between compliant joints [-]
_TOUCHING = 12.0  # contact points of a stone in a heap, where few or none touch at the start: four on each of three [-]
_HARDER = 15.0  # step of deformable stones whose contacts do not converge, over one that relaxes [-]


_UNKNOWN: Mapping[str, str] = {
    "settled": "whether it begins in equilibrium, and how hard its contacts are to solve, shows in the run",
    "relaxing": "when it rests shows in the run",
    "moving": "when it rests shows in the run",
    "driven": "when it rests shows in the run",
}
"""Reasons why the time of a run cannot be known, by the kind of its steps."""

_ITERATIONS = "how many iterations the contacts of moving stones take shows in the run"


@dataclass(frozen=True)
class ExpectedCost:
    """Expected cost of a run.

    Attributes
    ----------
    seconds : low, likely and high, of one processor
    longest : if no stone comes to rest before the duration is over [s]
    memory : most of the whole program [bytes]
    asleep : likely seconds if nearly all stones slept in its steps (`[time] sleep`); None where
        no stone may sleep, or a run ends as soon as they would
    by_stage : likely seconds of mesh, assemble, start, steps and stress, as far as the run has these stages
    steps : least, likely and largest number of steps
    unknown : the reason why the time cannot be known before the run, in words; empty if it can
    """

    seconds: tuple[float, float, float]
    longest: float
    memory: int
    asleep: float | None
    by_stage: Mapping[str, float]
    steps: tuple[int, int, int]
    unknown: str = ""


def expected_cost(plan: Plan, scene: Scene, slowness: float = 1.0) -> ExpectedCost:
    """Return the expected cost of the run of a scene.

    Parameters
    ----------
    plan : of the scene
    scene : the scene
    slowness : time of this machine over that of the one on which the rates were measured; see `machine_slowness`
    """
    amounts, time_ = plan.amounts, scene.time
    kind = "elastic" if amounts.nodes else "rigid"
    stages = {"mesh": 1.0, "assemble": 1.0, "start": 1.0, "stress": 1.0}
    if time_.start is not Start.EQUILIBRIUM:
        del stages["start"]
    work, steps = measures(amounts), _steps(time_, scene.loads.until)
    pace = _pace(scene)
    moves = pace in ("moving", "driven")
    step = RATES[kind, "moving" if moves else pace]
    usual = RATES.get((kind, pace), step)
    low = likely = high = 0.0
    by_stage = {}
    for stage in stages:
        rate = RATES.get((kind, stage))
        if rate is None:
            continue
        seconds = slowness * rate(work)
        by_stage[stage] = seconds
        low, likely, high = low + seconds / rate.below, likely + seconds, high + seconds * rate.above
    step_cost, likely_step = slowness * step(work), slowness * usual(work)
    by_stage["steps"] = steps[1] * likely_step
    total = time_.steps
    moving = high + total * slowness * RATES[kind, "moving"](work)
    unknown = _ITERATIONS if moves else ""
    if steps[0] != steps[2]:
        unknown = _UNKNOWN[pace]
    if unknown:
        moving = high + total * slowness * _hardest(kind, scene, work)
    seconds_range = (
        low + steps[0] * step_cost / step.below,
        likely + steps[1] * likely_step,
        max(high + steps[2] * step_cost * step.above, moving if unknown else 0.0),
    )
    return ExpectedCost(
        seconds_range,
        max(moving, seconds_range[1]),
        int(MEMORY[kind](work)),
        _asleep(kind, time_, likely, slowness * steps[1] * RATES["rigid", "asleep"](work)),
        by_stage,
        steps,
        unknown,
    )


def _hardest(kind: str, scene: Scene, work: Mapping[str, float]) -> float:
    """Return the seconds of a step whose contacts do not converge."""
    if kind == "elastic":
        return _HARDER * max(RATES["elastic", "relaxing"](work), RATES["elastic", "moving"](work))
    contacts = max(work["contacts"], _TOUCHING * work["stones"])
    sweeps = scene.solver.max_iterations * contacts * _SWEEP
    return _ATTEMPTS * max(sweeps, RATES["rigid", "moving"](work), RATES["rigid", "driven"](work))


def measures(amounts: Amounts) -> dict[str, float]:
    """Return the quantities that rates refer to: the amounts; *one*; *tangle*, contacts · √stones."""
    values = {name: float(value) for name, value in asdict(amounts).items()}
    return values | {"one": 1.0, "tangle": values["contacts"] * values["stones"] ** 0.5}


def _asleep(kind: str, time_: TimeSettings, rest: float, steps: float) -> float | None:
    """Return the seconds with sleep: `rest` of the other stages, `steps` of the steps."""
    useless = kind == "elastic" or time_.relaxation or time_.stop_at_equilibrium
    return None if useless else rest + steps


def _pace(scene: Scene) -> str:
    """Return the kind of step that prevails in a run."""
    time_ = scene.time
    if time_.relaxation:
        return "relaxing"
    if not scene.steady:
        return "driven"
    return "settled" if time_.start is Start.EQUILIBRIUM and time_.stop_at_equilibrium else "moving"


def _steps(time_: TimeSettings, until: float) -> tuple[int, int, int]:
    """Return the least, likely and largest number of steps, with loads that change `until` some time [s]."""
    total = time_.steps
    if not time_.stop_at_equilibrium:
        return total, total, total
    first = total if until >= time_.duration else int(np.ceil(until / time_.step))
    more = _RELAXING if time_.relaxation else _RESTING if time_.start is Start.EQUILIBRIUM else _SETTLING
    low, likely, high = (min(total, first + one) for one in more)
    return low, likely, high


@cache
def machine_slowness() -> float:
    """Return the time of this machine over that of the machine of the rates, from about 0.1 s of work [-].

    The mean, in logarithms, of Python's own loops, of passes over arrays and of products of matrices.
    """
    return float(np.exp(np.mean([np.log(took / CALIBRATION[name]) for name, took in calibration().items()])))


def calibration() -> dict[str, float]:
    """Return the processor seconds of three fixed pieces of work, the best of several runs."""
    return {name: _best(work) for name, work in _WORK.items()}


def _best(work: Callable[[], object], times: int = 5) -> float:
    seconds = []
    for _ in range(times):
        start = time.process_time()
        work()
        seconds.append(time.process_time() - start)
    return max(min(seconds), 1e-6)


def _loops() -> int:
    total = 0
    for i in range(60_000):
        total += i % 7
    return total


def _passes() -> float:
    numbers = np.arange(250_000, dtype=float)
    for _ in range(4):
        numbers = np.sqrt(numbers + 1.0) * 2.0
    return float(numbers[-1])


def _products() -> float:
    matrix = np.full((300, 300), 0.5)
    for _ in range(2):
        matrix = matrix @ matrix / 300.0
    return float(matrix[0, 0])


_WORK: Mapping[str, Callable[[], object]] = {"loops": _loops, "passes": _passes, "products": _products}
