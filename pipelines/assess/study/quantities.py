"""Quantities of a sample: limit loads, geometric factor, outcome and summary of a run, aggregates of stones."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any

import numpy as np

from ground.errors import SceneError, SolverError
from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly, assembly
from mechanics.limit.dead_load import at_instant
from mechanics.limit.held import held_limit
from mechanics.limit.limit_load import Flow, limit_load
from mechanics.limit.live_loads import Acceleration, LiveLoad
from mechanics.limit.programme import Ending, Optimum, Programme
from mechanics.limit.thickness import geometric_safety
from mechanics.simulate import simulate
from pipelines.assess.questions import LoadQuestion, parse_question
from pipelines.assess.study.settings import QuantityTable, QuantityType
from pipelines.ingest.records import surveyed_block
from pipelines.results.summary import summarise
from pipelines.run.assemble import Assembly
from pipelines.scene.selection import StoneModel
from survey.conventions import EPSILON

_EXACT = EPSILON
"""Tolerance of programmes whose velocities are derivatives: at 10⁻⁹ those of six walls are wrong by 6·10⁻⁴ [-]."""

_WIDEST = 2.0
"""Share of their width to which joints of stones that fall are widened: factors are known down to a half [-]."""

_AGGREGATES: Mapping[str, Callable[[list[float]], float]] = {
    "sum": sum,
    "mean": fmean,
    "min": min,
    "max": max,
}


class UndecidedError(SceneError):
    """Raised where a run neither rests nor falls."""


@dataclass(frozen=True)
class Limited:
    """Bound of a limit load with all that its derivatives need.

    Attributes
    ----------
    on : the assembly
    live : the load
    load : (6 n,) at λ = 1 [N, N m]
    optimum : of the programme
    """

    on: RigidAssembly
    live: LiveLoad
    load: Array
    optimum: Optimum

    @property
    def value(self) -> float:
        """λ; zero where the stones fall under their weight [-]."""
        return 0.0 if self.optimum.ending is Ending.NO_BALANCE else self.optimum.multiplier


def quantity_name(table: QuantityTable) -> str:
    """Return the name of a quantity in reports."""
    return table.name or " ".join(filter(None, (str(table.type), table.load, table.key)))


def live_load(table: QuantityTable, turn: float = 0.0) -> LiveLoad:
    """Return the live load of a limit, turned by an angle about the vertical [rad].

    Raises
    ------
    UsageError : the words are no load
    SceneError : they are no load that grows
    """
    question = parse_question(table.load or "")
    if not isinstance(question, LoadQuestion):
        raise SceneError(f"load = {table.load!r} does not grow", remedy='give one such as "horizontal x"')
    if turn == 0.0 or not isinstance(question.live, Acceleration):
        return question.live
    x, y, z = question.live.direction
    cosine, sine = float(np.cos(turn)), float(np.sin(turn))
    return replace(question.live, direction=(cosine * x - sine * y, sine * x + cosine * y, z))


def evaluate(
    tables: Sequence[QuantityTable],
    assembled: Callable[[], Assembly],
    models: Sequence[StoneModel],
    turn: float,
) -> tuple[dict[str, float], Limited | None]:
    """Return the quantities of a scene by name, and the bound of the first if it is one.

    Raises
    ------
    UndecidedError : a run neither rests nor falls
    SceneError, SolverError, GeometryError : a quantity cannot be computed
    """
    values: dict[str, float] = {}
    first: Limited | None = None
    on: RigidAssembly | None = None
    run: tuple[float, Mapping[str, Any]] | None = None
    for number, table in enumerate(tables):
        name = quantity_name(table)
        match table.type:
            case QuantityType.AGGREGATE:
                values[name] = _aggregate(table, models)
                continue
            case QuantityType.OUTCOME | QuantityType.SUMMARY:
                run = run or _run(assembled())
                values[name] = run[0] if table.type is QuantityType.OUTCOME else _looked_up(run[1], table.key)
                continue
        on = on or assembly(at_instant(assembled().scene))
        if table.type is QuantityType.FACTOR:
            factor = geometric_safety(on, _WIDEST).factor
            values[name] = 0.0 if np.isnan(factor) else factor
            continue
        live = live_load(table, turn)
        if table.type is QuantityType.BOUND:
            limited = bound(on, live, table.load or "")
            first = limited if number == 0 else first
            values[name] = limited.value
        else:
            values[name] = _coulomb(on, live, table.type)
    for name, value in values.items():
        if not np.isfinite(value):
            raise SceneError(f"{name} has no finite value: nothing limits it")
    return values, first


def bound(on: RigidAssembly, live: LiveLoad, name: str) -> Limited:
    """Return the limit load of associative friction, with velocities exact enough for derivatives.

    Raises
    ------
    SolverError : Clarabel came to no answer
    """
    load = live(on)
    with suppress(SolverError):
        return Limited(on, live, load, Programme(on, load, name, _EXACT).solve(on.strength))
    return Limited(on, live, load, Programme(on, load, name).solve(on.strength))


def _coulomb(on: RigidAssembly, live: LiveLoad, kind: QuantityType) -> float:
    limit = limit_load(on, live)
    if np.isnan(limit.multiplier):
        return 0.0
    if kind is QuantityType.CANDIDATE:
        return limit_load(on, live, Flow.COULOMB, limit).lowest.multiplier
    return held_limit(on, live, limit).held


def _run(assembled: Assembly) -> tuple[float, Mapping[str, Any]]:
    result = simulate(assembled.scene)
    if not result.outcome.decided:
        raise UndecidedError(f"its run is {result.outcome}")
    return float(result.outcome.rests), summarise(result, version="", seconds={})


def _looked_up(summary: Mapping[str, Any], key: str | None) -> float:
    found: Any = summary
    for name in (key or "").split("."):
        if not isinstance(found, Mapping) or name not in found:
            raise SceneError(f"the summary has no {key!r}", remedy="look at summary.json of a run")
        found = found[name]
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise SceneError(f"{key} of the summary is not a number")
    return float(found)


def _aggregate(table: QuantityTable, models: Sequence[StoneModel]) -> float:
    codes = set(table.stones)
    numbers = [
        _measured(model, table.key or "") for model in models if not codes or model.record.code in codes
    ]
    return float(_AGGREGATES[table.of](numbers))


def _measured(model: StoneModel, key: str) -> float:
    """Return a number of a stone as its measurements give it now."""
    block = surveyed_block(model.record)
    match key:
        case "offset" | "rms":
            return float(getattr(block.face.fit, key))
        case "depth":
            return block.depth.value
        case _:
            return float(getattr(block.face.measures, key))
