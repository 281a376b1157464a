"""Forecast of what a run takes, beside what it took: `python -m benchmarks.cost [--fit] [--json]`.

Runs scenes of known size and compares the time and the memory they take with what `mechanics.results.forecast.cost`
expects of them. With `--fit` other scenes are run, and the rates are found anew: what is printed is to replace those
of mechanics/results/forecast/cost_rates.py.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.optimize import nnls

import mechanics.simulate
from benchmarks.report import (
    ProcessorClock,
    Row,
    alone,
    columns,
    guarded,
    machine,
    options_of,
    peak_bytes,
    progress,
    show,
)
from ground.errors import SolverError
from mechanics.arrays import Array
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.verdicts.lasting import balance_of
from mechanics.dynamics.verdicts.watch import Watch
from mechanics.model.model import build_model
from mechanics.results.forecast.cost import calibration, expected_cost, measures
from mechanics.results.forecast.cost_rates import Rate
from mechanics.results.forecast.plan import Amounts, plan
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, Start, TimeSettings
from mechanics.scene.shapes import BOX_FACES, box_corners
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element

_STONE = Material("stone", density=2400.0, young=5e9, poisson=0.2)
_BRICK = (0.6, 0.4, 0.3)  # length, depth and height of a stone [m]
# stones of the scene that compiles, or loads, every kernel
_FEW_STONES = 12
# steps until all sleep, and steps that are timed then
_UNTIL_ASLEEP, _ASLEEP = 60, 20


@dataclass(frozen=True)
class Case:
    """One scene to be measured.

    Attributes
    ----------
    kind : a name among `KINDS`
    stones : about how many
    element : of deformable stones; empty: rigid ones
    size : of the mesh [m]
    mode : *static*: from the static equilibrium; *relaxation*: kinetic relaxation; *motion*: 60 steps of free motion;
        *asleep*: steps in which all sleep
    """

    kind: str
    stones: int
    element: str = ""
    size: float = 0.15
    mode: str = "static"

    def scene(self) -> Scene:
        """The scene."""
        solids = KINDS[self.kind](self.stones)
        fidelity = Fidelity.DEFORMABLE if self.element else Fidelity.RIGID
        kind = Element(self.element) if self.element else Element.TET4
        blocks = tuple(
            Block(f"b{n}", corners, BOX_FACES, _STONE, Fidelity.FIXED if fixed else fidelity, self.size, kind)
            for n, (corners, fixed) in enumerate(solids)
        )
        return Scene(
            f"{self.kind} of {self.stones}", blocks, contact=ContactSettings(DryJoint(0.6)), time=self._time()
        )

    def _time(self) -> TimeSettings:
        if self.mode == "static":
            return TimeSettings(1e-3, 1.0, 1.0, start=Start.EQUILIBRIUM)
        if self.mode == "relaxation":
            return TimeSettings(1e-2, 1.0, 2.0, relaxation=True)
        sleep = 1e-2 if self.mode == "asleep" else 0.0
        return TimeSettings(1e-3, 0.5, 0.06, stop_at_equilibrium=False, sleep=sleep)


# --- the scenes: corners of each stone, and whether it is fixed ---


def _courses(bricks: int, courses: int, depth: float, at: float = 0.0) -> list[tuple[Array, bool]]:
    """Running bond from y = `at` on, without its ground."""
    length, _, height = _BRICK
    solids = []
    for course in range(courses):
        joints = np.arange(bricks + 1) * length
        if course % 2:
            joints = np.concatenate([[0.0], (np.arange(bricks) + 0.5) * length, [bricks * length]])
        solids += [
            (box_corners((a, at, course * height), (b, at + depth, (course + 1) * height)), False)
            for a, b in pairwise(joints)
        ]
    return solids


def _ground(wide: float, deep: float) -> tuple[Array, bool]:
    return box_corners((-1.0, -1.0, -0.5), (wide + 1.0, deep + 1.0, 0.0)), True


def _wall(stones: int) -> list[tuple[Array, bool]]:
    """Twice as many courses as stones in each."""
    bricks = max(2, round(np.sqrt(stones / 2)))
    courses = max(2, round(stones / (bricks + 0.5)))
    return [_ground(bricks * _BRICK[0], _BRICK[1]), *_courses(bricks, courses, _BRICK[1])]


def _leaves(stones: int) -> list[tuple[Array, bool]]:
    """A wall of three leaves, the middle one in larger stones."""
    bricks = max(2, round(np.sqrt(stones / 3)))
    courses = max(2, round(stones / 3 / (bricks + 0.5)))
    length, depth, height = _BRICK
    leaves = [solid for k in (0, 2) for solid in _courses(bricks, courses, depth, k * depth)]
    core = [
        (
            box_corners((a, depth, 0.0), (a + length, 2 * depth, courses * height))
            + _lift(c, height, courses),
            False,
        )
        for c in range(courses)
        for a in np.arange(bricks) * length
    ]
    return [_ground(bricks * length, 3 * depth), *leaves, *core]


def _lift(course: int, height: float, courses: int) -> Array:
    """Return the shifts (8, 3) of the corners of a stone as high as the wall to its course [m]."""
    top = np.arange(8) // 4
    lift = np.zeros((8, 3))
    lift[:, 2] = height * (course + top) - top * courses * height
    return lift


def _pillars(stones: int) -> list[tuple[Array, bool]]:
    """Pillars of twelve drums."""
    count = max(1, round(stones / 12))
    length, depth, height = _BRICK
    drums = [
        (
            box_corners((2 * k * length, 0.0, i * height), ((2 * k + 1) * length, depth, (i + 1) * height)),
            False,
        )
        for k in range(count)
        for i in range(12)
    ]
    return [_ground(2 * count * length, depth), *drums]


def _portals(stones: int) -> list[tuple[Array, bool]]:
    """Storeys of pillars of three drums, with lintels from the middle of one to that of the next."""
    count = max(2, round(np.sqrt(stones / 3)))
    storeys = max(1, round(stones / (4 * count - 1)))
    length, depth, height = _BRICK
    solids = [_ground(3 * count * length, depth)]
    for storey in range(storeys):
        foot = 4 * storey * height
        for k in range(count):
            left, middle = 3 * k * length, (3 * k + 0.5) * length
            solids += [
                (
                    box_corners(
                        (left, 0.0, foot + i * height), (left + length, depth, foot + (i + 1) * height)
                    ),
                    False,
                )
                for i in range(3)
            ]
            if k + 1 < count:
                # the outer ones lie on the whole of their pillar
                start = left if k == 0 else middle
                end = middle + 3 * length + (0.5 * length if k + 2 == count else 0.0)
                top = foot + 3 * height
                solids.append((box_corners((start, 0.0, top), (end, depth, top + height)), False))
    return solids


def _vault(stones: int) -> list[tuple[Array, bool]]:
    """A barrel vault: rings of 15 stones that touch each other, every other turned by half a stone."""
    count, solids = max(1, round(stones / 15)), []
    for k in range(count):
        cuts = [-0.2, *np.pi * np.arange(16) / 15, np.pi + 0.2]
        if k % 2:
            cuts = [-0.2, 0.0, *np.pi * (np.arange(15) + 0.5) / 15, np.pi, np.pi + 0.2]
        solids += [
            (_voussoir(a, b, 0.5 * k, (2.2, 2.7)), i in (0, len(cuts) - 2))
            for i, (a, b) in enumerate(pairwise(cuts))
        ]
    return solids


def _arch(stones: int) -> list[tuple[Array, bool]]:
    """Semicircular arches of 25 voussoirs, each on its own springers, thickness 0.2 of the mean radius."""
    count = max(1, round(stones / 25))
    solids = []
    for k in range(count):
        angle = np.pi * np.arange(-1, 27) / 25
        angle[0], angle[-1] = -0.2, np.pi + 0.2
        for i, (a, b) in enumerate(pairwise(angle)):
            solids.append((_voussoir(a, b, 2.0 * k), i in (0, 26)))
    return solids


def _voussoir(start: float, end: float, y: float, radii: tuple[float, float] = (1.8, 2.2)) -> Array:
    rays = [
        (r, angle) for angle, r in ((end, radii[0]), (start, radii[0]), (start, radii[1]), (end, radii[1]))
    ]
    ring = [(r * np.cos(angle), r * np.sin(angle)) for r, angle in rays]
    return np.array([(x, y + depth, z) for depth in (0.0, 0.5) for x, z in reversed(ring)])


def _opening(stones: int) -> list[tuple[Array, bool]]:
    """A wall with a door in its middle, below a lintel."""
    bricks = max(4, round(np.sqrt(stones)))
    courses = max(4, round(stones / (bricks + 0.5) / 0.9))
    length, depth, height = _BRICK
    middle, half, top = bricks * length / 2, max(0.8, bricks * length / 8), courses // 2
    solids = [_ground(bricks * length, depth)]
    for corners, _ in _courses(bricks, courses, depth):
        low, high = corners[:, 0].min(), corners[:, 0].max()
        course = round(corners[:, 2].min() / height)
        if course < top:
            left, right = max(low, middle + half), min(high, middle - half)
            pieces = [(low, right)] if low < middle - half else []
            pieces += [(left, high)] if high > middle + half else []
        elif course == top:
            pieces = [(low, min(high, middle - half - 0.3))] if low < middle - half - 0.31 else []
            pieces += [(max(low, middle + half + 0.3), high)] if high > middle + half + 0.31 else []
        else:
            pieces = [(low, high)]
        solids += [
            (box_corners((a, 0.0, course * height), (b, depth, (course + 1) * height)), False)
            for a, b in pieces
            if b - a > 0.05
        ]
    lintel = (middle - half - 0.3, 0.0, top * height), (middle + half + 0.3, depth, (top + 1) * height)
    return [*solids, (box_corners(*lintel), False)]


def _column(stones: int) -> list[tuple[Array, bool]]:
    """Columns of 25 drums, each wider than high, side by side."""
    count = max(1, round(stones / 25))
    drums = [
        (box_corners((3.0 * k, 0.0, 0.4 * i), (3.0 * k + 1.2, 1.2, 0.4 * (i + 1))), False)
        for k in range(count)
        for i in range(25)
    ]
    return [_ground(3.0 * count, 1.2), *drums]


KINDS: Mapping[str, Callable[[int], list[tuple[Array, bool]]]] = {
    "wall": _wall,
    "leaves": _leaves,
    "pillars": _pillars,
    "portals": _portals,
    "vault": _vault,
    "arch": _arch,
    "opening": _opening,
    "column": _column,
}


# --- what was learnt, and what is tried ---

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
_TABLE = columns(
    "scene scene | stones stones :d | contacts contacts :d | steps steps :d | "
    "seconds measured s :.3g | low expected: low :.3g | likely likely :.3g | high high :.3g | "
    "ratio measured / likely :.2f | inside in the range | memory_mb measured MB :.0f | "
    "expected_mb expected MB :.0f"
)


def main() -> None:
    """Try the expectation on scenes from which it was not learnt; or learn it."""
    parser = options_of("cost", __doc__)
    parser.add_argument("--fit", action="store_true", help="run the other scenes, and print new rates")
    parser.add_argument("--rows", type=Path, help="file of measured scenes that are not to be run again")
    options = parser.parse_args()
    cases = _FIT if options.fit else _TRY
    found = [_kept(case, options.rows) for case in cases]
    rows = [row for row in found if row is not None]
    if options.fit:
        print(_module(rows))
        return
    show([_tried(row) for row in rows], _TABLE, as_json=options.json)


def _kept(case: Case, kept: Path | None) -> Row | None:
    """A measured scene; from the file if it is there, else run and written to it. None if it failed before."""
    known = [json.loads(line) for line in kept.read_text().splitlines()] if kept and kept.exists() else []
    for row in known:
        if all(row[key] == value for key, value in asdict(case).items()):
            return None if row.get("failed") else row
    progress(f"{case.kind} {case.stones} {case.element} {case.mode}")
    row = alone(measured, asdict(case))
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
    """Return the time of a stage, or of one step of a pace [s]; None if the run had none of it."""
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


def measured(asked: dict[str, Any]) -> Row:
    """Return what a scene takes, given by the attributes of a `Case`."""
    with patch.object(mechanics.simulate, "Clock", ProcessorClock):
        return _measured(Case(**asked))


def _measured(case: Case) -> Row:
    if case.mode == "asleep":
        return _asleep(case)
    mechanics.simulate.simulate(replace(case, stones=_FEW_STONES, size=1.0).scene())
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
        "memory": after - before,
        "program": before,
    }


if __name__ == "__main__":
    guarded(main)
