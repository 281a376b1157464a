"""How long will a run take? `python -m benchmarks.cost [--fit] [--json]`.

Runs scenes of known size and compares the time and the memory they take with what `mechanics.results.forecast.cost`
expects of them. With `--fit` other scenes are run, and the rates are found anew: what is printed is to replace those
of mechanics/results/forecast/cost_rates.py.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from benchmarks.child import run_child
from benchmarks.cost_scenes import Case
from benchmarks.report import Row, Table, guarded, machine, print_json, print_table, progress
from mechanics.arrays import Array
from mechanics.results.forecast.cost import calibration, expected_cost, measures
from mechanics.results.forecast.cost_rates import Rate
from mechanics.results.forecast.plan import Amounts, plan
from moma.errors import SolverError

__all__ = ["fitted", "main"]


_FIT = (
    *(Case("wall", n) for n in (50, 500, 2000)),
    *(Case("pillars", n) for n in (60, 600)),
    *(Case("leaves", n) for n in (60, 150)),
    *(Case("portals", n) for n in (40, 250)),
    *(Case("vault", n) for n in (60, 240)),
    *(Case("wall", n, mode="relaxation") for n in (100, 1000)),
    *(
        Case(kind, n, mode="relaxation")
        for kind, n in (("leaves", 100), ("pillars", 240), ("portals", 100), ("vault", 120))
    ),
    *(Case("wall", n, mode="motion") for n in (8, 100, 800)),
    Case("pillars", 12, mode="motion"),
    *(Case("wall", 8, mode=mode) for mode in ("static", "relaxation")),
    *(
        Case(kind, n, mode="motion")
        for kind, n in (("leaves", 100), ("pillars", 240), ("portals", 100), ("vault", 120))
    ),
    *(Case("wall", n, mode="asleep") for n in (100, 400, 1600)),
    Case("pillars", 24, "hex8"),
    Case("pillars", 60, "tet10", 0.2),
    Case("wall", 30, "hex8"),
    Case("wall", 30, "tet10"),
    Case("wall", 20, "hex8", 0.08),
    Case("wall", 80, "tet4", 0.2),
    Case("leaves", 30, "hex8", 0.2),
    Case("portals", 30, "tet4", 0.2),
    Case("vault", 30, "hex8", 0.25),
    Case("pillars", 24, "tet4", 0.12, "relaxation"),
    Case("wall", 30, "hex8", mode="relaxation"),
    Case("wall", 60, "tet4", 0.2, "relaxation"),
    Case("wall", 20, "tet10", 0.2, "relaxation"),
    Case("vault", 30, "tet4", 0.3, "relaxation"),
    Case("wall", 20, "hex8", mode="motion"),
    Case("wall", 30, "tet4", 0.2, "motion"),
    Case("pillars", 24, "hex8", mode="motion"),
)
_TRY = (
    *(Case("arch", n) for n in (50, 500)),
    *(Case("opening", n) for n in (100, 400)),
    *(Case("column", n) for n in (50, 500, 2000)),
    Case("arch", 250, mode="relaxation"),
    Case("opening", 200, mode="relaxation"),
    Case("column", 250, mode="motion"),
    Case("opening", 200, mode="motion"),
    Case("arch", 25, "hex8", 0.2),
    Case("arch", 50, "tet4", 0.25),
    Case("opening", 50, "tet4", 0.2),
    Case("opening", 60, "hex8", 0.2),
    Case("column", 25, "hex8", 0.3),
    Case("column", 50, "tet10", 0.4),
    Case("arch", 25, "tet4", 0.25, "relaxation"),
    Case("column", 25, "tet4", 0.4, "relaxation"),
)
# stages of a run, and the amounts on which each depends
_MEASURES: Mapping[tuple[str, str], tuple[str, ...]] = {
    ("rigid", "mesh"): ("one", "stones"),
    ("rigid", "start"): ("stones", "contacts", "tangle"),
    ("rigid", "settled"): ("one", "contacts"),
    ("rigid", "relaxing"): ("one", "contacts", "tangle"),
    ("rigid", "moving"): ("one", "contacts", "tangle"),
    ("rigid", "asleep"): ("one", "stones"),
    ("rigid", "stress"): ("stones", "contacts"),
    ("elastic", "mesh"): ("one", "stones", "distinct_nodes", "nodes"),
    ("elastic", "assemble"): ("one", "contacts", "condensed", "blocks"),
    ("elastic", "start"): ("fronts", "contacts", "condensed", "flops"),
    ("elastic", "settled"): ("nodes", "contacts", "fronts", "flops"),
    ("elastic", "relaxing"): ("fronts", "factor", "flops"),
    ("elastic", "moving"): ("fronts", "factor"),
    ("elastic", "stress"): ("stones", "nodes", "contacts"),
}
_BYTES: Mapping[str, tuple[str, ...]] = {
    "rigid": ("contacts", "stones"),
    "elastic": ("contacts", "nodes", "blocks", "factor"),
}
_PACE = {"static": "settled", "relaxation": "relaxing", "motion": "moving", "asleep": "asleep"}
# stages of the clock that are part of every step
_STEP = ("detect", "solve", "advance", "observe")
# of the logarithm of time over expectation: so many standard deviations make the spread
_DEVIATIONS = 1.3
# a spread that few runs show is taken to be no less than this, that of many no less than the other
_FEW, _LEAST_OF_FEW, _LEAST = 6, 2.0, 1.25
_TABLE: Table = (
    ("scene", "scene", ""),
    ("stones", "stones", "d"),
    ("contacts", "contacts", "d"),
    ("steps", "steps", "d"),
    ("seconds", "measured s", ".3g"),
    ("low", "expected: low", ".3g"),
    ("likely", "likely", ".3g"),
    ("high", "high", ".3g"),
    ("ratio", "measured / likely", ".2f"),
    ("inside", "in the range", ""),
    ("memory_mb", "measured MB", ".0f"),
    ("expected_mb", "expected MB", ".0f"),
)


def main() -> None:
    """Try the expectation on scenes from which it was not learnt; or learn it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cost", description=__doc__)
    parser.add_argument("--fit", action="store_true", help="run the other scenes, and print new rates")
    parser.add_argument("--rows", type=Path, help="file of measured scenes that are not to be run again")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each scene")
    options = parser.parse_args()
    cases = _FIT if options.fit else _TRY
    rows = [_measured(case, options.rows) for case in cases]
    measured = [row for row in rows if row is not None]
    if options.fit:
        print(_module(measured))
        return
    tried = [_tried(row) for row in measured]
    if options.json:
        print_json([row | {"machine": machine()} for row in tried])
        return
    print(f"{machine()}\n")
    print_table(tried, _TABLE)


def _measured(case: Case, kept: Path | None) -> Row | None:
    """A measured scene; from the file if it is there, else run and written to it. None if it failed before."""
    known = [json.loads(line) for line in kept.read_text().splitlines()] if kept and kept.exists() else []
    for row in known:
        if all(row[key] == value for key, value in asdict(case).items()):
            return None if row.get("failed") else row
    progress(f"{case.kind} {case.stones} {case.element} {case.mode}")
    row = run_child(
        "benchmarks.cost_child",
        json.dumps(asdict(case)),
        where=f"{case.kind} {case.stones}",
        error=SolverError,
    )
    if kept:
        with kept.open("a") as file:
            file.write(json.dumps(row) + "\n")
    return row


def fitted(work: Sequence[Mapping[str, float]], seconds: Array, names: Sequence[str]) -> Rate:
    """Rates, none negative, with the least relative error, and the factors within which most measured values lie."""
    table = np.array([[one[name] for name in names] for one in work])
    rates, _ = nnls(table / seconds[:, None], np.ones(len(seconds)))
    ratio = np.log(seconds / np.maximum(table @ rates, 1e-12))
    # by the median ratio: a few slow runs would drag the sum of squares
    middle = float(np.median(ratio))
    below, above = (
        float(np.exp(_DEVIATIONS * np.sqrt(np.mean(np.maximum(side, 0.0) ** 2) * 2.0)))
        for side in (middle - ratio, ratio - middle)
    )
    per = {
        name: float(f"{rate * np.exp(middle):.3g}")
        for name, rate in zip(names, rates, strict=True)
        if rate > 0
    }
    least = _LEAST_OF_FEW if len(seconds) < _FEW else _LEAST
    return Rate(per, *(float(f"{max(one, least):.2f}") for one in (below, above)))


def _module(rows: Sequence[Row]) -> str:
    """The text of the rates as Python."""
    lines = [f"MACHINE = {machine()!r}", "", "RATES: Mapping[tuple[str, str], Rate] = {"]
    for (kind, stage), names in _MEASURES.items():
        pairs = [
            (measures(Amounts(**row["amounts"])), _seconds(row, stage)) for row in rows if _kind(row) == kind
        ]
        own = [(work, took) for work, took in pairs if took is not None and took > 0]
        rate = fitted([work for work, _ in own], np.array([took for _, took in own]), names)
        lines.append(f"    ({kind!r}, {stage!r}): {rate},")
    lines += ["}", "", "MEMORY: Mapping[str, Rate] = {"]
    for kind, names in _BYTES.items():
        own_rows = [row for row in rows if _kind(row) == kind and (row["memory"] or 0) > 1e6]
        work = [measures(Amounts(**row["amounts"])) for row in own_rows]
        rate = fitted(work, np.array([row["memory"] for row in own_rows], dtype=float), names)
        program = float(np.median([row["program"] for row in own_rows]))
        lines.append(f"    {kind!r}: {replace(rate, per=dict(rate.per) | {'one': float(f'{program:.3g}')})},")
    lines += ["}", "", f"CALIBRATION: Mapping[str, float] = {calibration()}"]
    return "\n".join(lines)


def _kind(row: Row) -> str:
    return "elastic" if row["element"] else "rigid"


def _seconds(row: Row, stage: str) -> float | None:
    """What a stage took, or one step of a pace; None if the run had none of it."""
    stages: Mapping[str, float] = row["stages"]
    if stage in _PACE.values():
        steps = [*_STEP, *(["assemble"] if _kind(row) == "rigid" else [])]
        if stage == "asleep":
            return stages.get(stage)
        took = sum(stages.get(one, 0.0) for one in steps) / row["steps"]
        return took if _PACE[row["mode"]] == stage else None
    return stages.get(stage)


def _tried(row: Row) -> Row:
    """A measured scene beside what was expected of it."""
    case = Case(**{key: row[key] for key in ("kind", "stones", "element", "size", "mode")})
    scene = case.scene()
    cost = expected_cost(plan(scene), scene)
    low, likely, high = cost.seconds
    return {
        "scene": f"{case.kind}, {case.element or 'rigid'}, {case.mode}",
        "stones": row["amounts"]["stones"],
        "contacts": row["amounts"]["contacts"],
        "steps": row["steps"],
        "seconds": row["seconds"],
        "low": low,
        "likely": likely,
        "high": high,
        "ratio": row["seconds"] / likely,
        "inside": "yes" if low <= row["seconds"] <= high else "no",
        "memory_mb": (row["memory"] + row["program"]) / 1e6,
        "expected_mb": cost.memory / 1e6,
    }


if __name__ == "__main__":
    guarded(main)
