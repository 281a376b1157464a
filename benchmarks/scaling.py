"""Cost against size: `python -m benchmarks.scaling [--kinds KIND …] [--largest N] [--threads 2] [--json]`.

*wall* and *disks*: running-bond walls and boxes of disks from about 100 to 100,000 contacts: detection, sweeps, a step
with a fixed number of sweeps, memory; with one thread and more. *deformable*: walls of deformable bricks to their
equilibrium. *cold*: the first step of columns, of thick walls and of stones whose masses differ by up to 10⁶, with
nothing known of the forces. See benchmarks/README.md for what the columns mean.
"""

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.report import (
    Row,
    alone,
    arrays_bytes,
    columns,
    guarded,
    options_of,
    peak_bytes,
    progress,
    show,
)
from benchmarks.scenes import (
    column,
    disk_box,
    engine_scene,
    first_problem,
    running_bond,
    thick_wall,
    wall_scene,
)
from mechanics.arrays import Array
from mechanics.contact.contacts import take
from mechanics.delassus import rigid
from mechanics.delassus.assembly import rigid_delassus
from mechanics.dynamics.contact_search import detector
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.planar.contacts import PlanarDetector
from mechanics.planar.delassus import PlanarDelassus
from mechanics.planar.model import build_planar_model
from mechanics.planar.simulation import PlanarSimulation
from mechanics.problem.problem import ContactStart, Delassus
from mechanics.problem.residual import residual
from mechanics.scene.scene import Block, Scene, SolverSettings, Start
from mechanics.simulate import simulate
from mechanics.solvers.choice import choose_solver
from mechanics.stones.meshing.elements import Element

# bricks and courses, columns and rows: about 100, 300, 1,000, … contacts; and the wall of 1,600 bricks
_SIZES = {
    "wall": ((4, 3), (6, 5), (10, 9), (20, 14), (40, 22), (50, 55), (80, 107), (40, 40)),
    "disks": ((8, 5), (14, 8), (25, 14), (45, 23), (80, 43), (140, 73), (250, 135)),
    "deformable": ((4, 6), (10, 10), (20, 15)),
}
# about how many contacts for each brick or disk
_EACH = {"wall": 12, "disks": 3, "deformable": 45}
_TABLE = columns(
    "kind scene | bodies bodies :d | contacts contacts :d | detection_ms detection ms :.3g | "
    "sweep_ns sweep ns per contact :.3g | sliding of which slide :.0% | stick_ns where all stick :.3g | "
    "step_ms step ms :.3g | default_first_ms default solver: first ms :.3g | default_iterations iterations :d | "
    "default_step_ms later ms :.3g | bytes_kept bytes per contact kept :.0f | bytes_peak at most :.0f | "
    "bytes_peak_default default solver :.0f | speedup_detection threads: detection :.2f | "
    "speedup_sweep sweep :.2f | speedup_step step :.2f"
)
_DEFORMABLE = columns(
    "bodies stones :d | nodes nodes per stone :.0f | contacts contacts :d | cpu_s CPU to equilibrium s :.3g | "
    "per_stone_ms CPU ms per stone :.3g | start_s of which the static start :.3g | step_ms step ms :.3g | "
    "eta η :.0e | balance balance :.0e | reaction reaction - weight :.0e | memory_gb memory GB :.2f | "
    "outcome outcome | speedup threads :.2f"
)
_COLD = columns(
    "scene scene | contacts contacts :d | iterations iterations :d | cpu_ms ms :.3g | eta η :.0e | "
    "velocity velocities :.0e | converged solved | why by"
)
_FITTED = ("detection", "step_1", "default_first", "default_step")


def main() -> None:
    """Run all sizes and print."""
    parser = options_of("scaling", __doc__)
    kinds = [*_SIZES, "cold"]
    parser.add_argument("--kinds", nargs="+", choices=kinds, default=["wall", "disks"])
    parser.add_argument("--largest", type=int, default=200_000, help="no scene with more contacts (200000)")
    parser.add_argument("--threads", type=int, default=2, help="compare one thread with this many (2)")
    options = parser.parse_args()
    threads = sorted({1, min(options.threads, os.cpu_count() or 1)})
    rows = {kind: list(_rows(kind, options.largest, threads)) for kind in options.kinds}
    if options.json:
        show([row for some in rows.values() for row in some], as_json=True)
        return
    for kind, some in rows.items():
        show(some, {"deformable": _DEFORMABLE, "cold": _COLD}.get(kind, _TABLE), as_json=False)
        powers = [
            f"{key} {some[0][f'exponent_{key}']:.2f}" for key in _FITTED if f"exponent_{key}" in some[0]
        ]
        print(f"\n{kind}: cost ~ contacts to the power of: {', '.join(powers)}\n" if powers else "")


def _rows(kind: str, largest: int, threads: list[int]) -> Iterator[Row]:
    if kind == "cold":
        # kernels are compiled, or loaded, before the clock runs
        for made in (lambda: thick_wall(2, 3), lambda: _heavy(3, 1, 1e6)):
            _cold(Case("", made))
        yield from (_cold(case) for case in CASES if len(case.blocks()) * 16 <= largest)
        return
    rows = []
    for across, high in _SIZES[kind]:
        if _EACH[kind] * across * high > largest:
            continue
        progress(f"{kind} {across} x {high}")
        if kind == "deformable":
            some = [alone(deformable, across, high, threads=count) for count in threads]
            rows.append(some[0] | {"speedup": some[0]["wall_s"] / some[-1]["wall_s"]})
        else:
            row = alone(measured, kind, across, high, threads, threads=threads[-1])
            rows.append(_derived(row, threads[-1]))
    if kind != "deformable" and len(rows) > 1:
        contacts = np.log([row["contacts"] for row in rows])
        for key in _FITTED:
            power = float(np.polyfit(contacts, np.log([row[key] for row in rows]), 1)[0])
            rows = [row | {f"exponent_{key}": power} for row in rows]
    yield from rows


def _derived(row: Row, last: int) -> Row:
    contacts = row["contacts"]
    row |= {
        "detection_ms": 1e3 * row["detection"],
        "sweep_ns": 1e9 * row["sweep_1"] / contacts,
        "stick_ns": 1e9 * row["sweep_stick"] / contacts,
        "step_ms": 1e3 * row["step_1"],
        "default_first_ms": 1e3 * row["default_first"],
        "default_step_ms": 1e3 * row["default_step"],
        "threads": last,
    }
    if last > 1:
        for name in ("detection", "sweep", "step"):
            row[f"speedup_{name}"] = row[f"{name}_wall_1"] / row[f"{name}_wall_{last}"]
    return row


# --- walls and disks ---

# sweeps of the timed step, and timed sweeps for a cache-warm figure
_STEP_SWEEPS = 50
_REPEATS, _ENOUGH = 5, 0.2
_DEFAULT_STEPS = 8
# friction with which next to nothing slides
_STICKING = 10.0


@dataclass(frozen=True)
class _Case:
    """A scene taken apart: what is timed by itself.

    Attributes
    ----------
    detect : finds the contacts
    operator : W of these contacts
    u_free : (nc, d) under gravity [m/s]
    friction : μ [-]
    simulation : makes a simulation at the scene's start, whose solver makes `_STEP_SWEEPS` sweeps in each step
    default : makes one with the default solver and tolerance
    bodies : number of them
    """

    detect: Callable[[], Any]
    operator: Delassus
    u_free: Array
    friction: float
    simulation: Callable[[], Any]
    default: Callable[[], Any]
    bodies: int


def measured(kind: str, across: int, high: int, threads: list[int]) -> Row:
    """Return what a wall or a box of disks of a size costs, with each number of threads."""
    make = _wall if kind == "wall" else _disks
    for count in threads:  # compiles every kernel
        case = make(4, 4, count)
        case.detect()
        _sweeps(case, 2)
        case.simulation().step()
        case.default().step()
    before, case = peak_bytes(), make(across, high, 1)
    contacts = len(case.u_free)
    row: Row = {"kind": kind, "across": across, "high": high, "bodies": case.bodies, "contacts": contacts}
    simulation = case.simulation()
    simulation.step()
    row["bytes_kept"] = arrays_bytes(simulation) / contacts
    row["bytes_peak"] = (peak_bytes() - before) / contacts
    del simulation
    row |= _times({count: make(across, high, count) for count in threads})
    row |= _default(case.default())
    row["bytes_peak_default"] = (peak_bytes() - before) / contacts
    return row


def _times(cases: dict[int, _Case]) -> Row:
    """Sweeps and whole steps, by number of threads."""
    row: Row = {}
    impulses = []
    for count, case in cases.items():
        sweep, impulse = _sweeps(case, _STEP_SWEEPS)
        step = _best(lambda case=case: case.simulation().step, prepared=True)  # type: ignore[misc]
        impulses.append(impulse)
        for name, (cpu, wall) in (("detection", _best(case.detect)), ("sweep", sweep), ("step", step)):
            row |= {f"{name}_{count}": cpu, f"{name}_wall_{count}": wall}
    row["detection"] = row["detection_1"]
    sticking, _ = _sweeps(cases[1], _STEP_SWEEPS, friction=_STICKING)
    row["sweep_stick"] = sticking[0]
    row["sliding"] = _sliding(impulses[0], cases[1].friction)
    row["same_bits"] = all(np.array_equal(one, impulses[0]) for one in impulses)
    return row


def _sliding(impulse: Array, friction: float) -> float:
    """Share of the contacts that slide."""
    tangential, limit = np.linalg.norm(impulse[:, 1:], axis=1), friction * impulse[:, 0]
    return float(np.mean((tangential >= limit * (1 - 1e-9)) & (limit > 0)))


def _default(simulation: Any) -> Row:
    """Processor times of the first steps as a user has them: the first, and the median of some more [s]."""
    times, sweeps = [], []
    for _ in range(_DEFAULT_STEPS):
        start = time.process_time()
        step = simulation.step()
        times.append(time.process_time() - start)
        sweeps.append(step.solution.iterations)
    return {
        "default_first": times[0],
        "default_iterations": sweeps[0],
        "default_step": float(np.median(times[1:])),
    }


def _best(run: Callable[[], Any], prepared: bool = False) -> tuple[float, float]:
    """Smallest processor and wall time of several runs [s]; `prepared`: `run` makes, untimed, what is timed."""
    cpu, wall, spent = np.inf, np.inf, 0.0
    for n in range(50):
        work = run() if prepared else run
        start = time.process_time(), time.perf_counter()
        work()
        took = time.perf_counter() - start[1]
        cpu, wall = min(cpu, time.process_time() - start[0]), min(wall, took)
        spent += took
        if n + 1 >= _REPEATS and spent > _ENOUGH:
            break
    return cpu, wall


def _sweeps(case: _Case, count: int, friction: float | None = None) -> tuple[tuple[float, float], Array]:
    """Times of one sweep over all contacts [s] near the solution, and the impulses after a fixed number of sweeps."""
    none = np.zeros(len(case.u_free))
    asleep, rigid._CALM = rigid._CALM, -1.0  # no contact sleeps: this is the cost of solving every one
    mu = case.friction if friction is None else friction
    sweep = case.operator.gauss_seidel(case.u_free, none + mu, none)
    rigid._CALM = asleep
    impulse = np.zeros_like(case.u_free)
    sweep(impulse, count)
    early = impulse.copy()
    cpu, wall = _best(lambda: sweep(impulse, count))
    return (cpu / count, wall / count), early


def _wall(bricks: int, courses: int, threads: int) -> _Case:
    blocks = running_bond(bricks, courses)
    scene = engine_scene(blocks, 1e-3, 0.5, 1e-30, _STEP_SWEEPS, sweeping=True)
    scene = replace(scene, solver=replace(scene.solver, threads=threads))
    model, state = build_model(scene)
    usual = replace(model, scene=replace(scene, solver=SolverSettings()))
    find = detector(model)
    reach = np.zeros(len(model.mass))
    contacts = find(state, reach)
    plan = rigid.schedule(contacts.bodies, model.inertia.moving)
    operator = rigid_delassus(model, state, take(contacts, plan.order), plan)
    fall = np.zeros((len(model.mass), 6))
    fall[model.inertia.moving, 2] = -9.81e-3
    return _Case(
        lambda: find(state, reach),
        operator,
        operator.relative_velocity(fall),
        blocks.friction,
        lambda: Simulation(model, state),
        lambda: Simulation(usual, state),
        len(model.mass),
    )


def _disks(columns: int, rows: int, threads: int) -> _Case:
    scene = disk_box(columns, rows, sweeps=_STEP_SWEEPS)
    scene = replace(scene, solver=replace(scene.solver, threads=threads))
    model, state = build_planar_model(scene)
    usual = replace(model, scene=replace(scene, solver=SolverSettings()))
    find = PlanarDetector(model)
    contacts = find(state)
    operator = PlanarDelassus(contacts.bodies, contacts.normal, contacts.lever, model.inertia, threads)
    fall = np.zeros((len(model.fixed), 3))
    fall[~model.fixed, 1] = -9.81e-4
    return _Case(
        lambda: find(state),
        operator,
        operator.relative_velocity(fall),
        0.3,
        lambda: PlanarSimulation(model, state, Clock()),
        lambda: PlanarSimulation(usual, state, Clock()),
        len(model.fixed),
    )


# --- deformable walls ---


def deformable(bricks: int, courses: int) -> Row:
    """Return what a wall of bricks of 8 × 4 × 3 linear hexahedra on rigid ground costs from the scene to its rest."""

    def scene(bricks: int, courses: int) -> Scene:
        start, size = Start.EQUILIBRIUM, 0.0375
        return wall_scene(
            bricks, courses, Element.HEX8, start, size, step=1e-3, theta=1.0, duration=0.1, base=False
        )

    simulate(scene(1, 1))  # compiles
    begun = time.perf_counter(), time.process_time()
    result = simulate(scene(bricks, courses))
    wall, cpu = time.perf_counter() - begun[0], time.process_time() - begun[1]
    own = [body for body in result.bodies if body.stress is not None]
    stages, errors = result.wall_time, result.errors
    return {
        "kind": "deformable",
        "bodies": len(own),
        "nodes": float(np.mean([len(body.reference) for body in own])),
        "contacts": len(result.contacts.gap),
        "outcome": str(result.outcome),
        "cpu_s": cpu,
        "wall_s": wall,
        "start_s": stages.get("start", 0.0),
        "step_ms": 1e3
        * (wall - sum(stages.get(key, 0.0) for key in ("start", "mesh", "stress")))
        / result.steps,
        "per_stone_ms": 1e3 * cpu / len(own),
        "eta": errors.natural_map,
        "balance": errors.balance,
        "reaction": errors.reaction,
        "memory_gb": peak_bytes() / 1e9,
    }


# --- tall and heavy scenes from a cold start ---


_STONE = 2400.0  # density [kg/m³]


@dataclass(frozen=True)
class Case:
    """A scene, and how well its first step is to be solved."""

    name: str
    blocks: Callable[[], list[Block]]
    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    friction: float = 0.6
    tilt: float = 0.0


def _heavy(count: int, place: int, ratio: float) -> list[Block]:
    densities = np.full(count, _STONE)
    densities[place] *= ratio
    return column(densities.tolist())


_EXACT = {"tolerance": 1e-8, "velocity_tolerance": 1e-8}
CASES = (
    *(Case(f"column of {n}", partial(column, [_STONE] * n)) for n in (10, 20, 50, 100, 200)),
    Case("column of 100, tilted by 2°", lambda: column([_STONE] * 100), tilt=2.0),
    Case("column of 100, friction 0.1", lambda: column([_STONE] * 100), friction=0.1),
    Case("column of 100, friction 10", lambda: column([_STONE] * 100), friction=10.0),
    Case("wall of 20 courses, three leaves", lambda: thick_wall(4, 20)),
    Case("wall of 150 courses, three leaves", lambda: thick_wall(4, 150)),
    Case("1,000 t on 1 kg", lambda: _heavy(2, 1, 1e6), **_EXACT),
    Case("1 kg on 1,000 t", lambda: _heavy(2, 0, 1e6), **_EXACT),
    Case("one of 10 heavier by 1e6", lambda: _heavy(10, 5, 1e6), **_EXACT),
    Case("one of 10 lighter by 1e6", lambda: _heavy(10, 5, 1e-6), **_EXACT),
    Case("one of 100 heavier by 1e6", lambda: _heavy(100, 50, 1e6), **_EXACT),
    Case("10, every other heavier by 1e6", lambda: column([_STONE, _STONE * 1e6] * 5), **_EXACT),
    Case("100 growing to 1e6 upwards", lambda: column((_STONE * np.logspace(0, 6, 100)).tolist()), **_EXACT),
    Case(
        "100 growing to 1e6 downwards", lambda: column((_STONE * np.logspace(6, 0, 100)).tolist()), **_EXACT
    ),
)


def _cold(case: Case) -> Row:
    problem = first_problem(case.blocks(), case.friction, case.tilt)
    nothing = np.zeros_like(problem.u_free)
    settings = SolverSettings(tolerance=case.tolerance, velocity_tolerance=case.velocity_tolerance)
    solver = choose_solver(settings, deformable=False)
    start = time.process_time()
    solution = solver(problem, ContactStart(nothing, nothing))
    seconds = time.process_time() - start
    left = residual(problem, solution.impulse)
    return {
        "scene": case.name,
        "contacts": len(nothing),
        "iterations": solution.iterations,
        "cpu_ms": 1e3 * seconds,
        "eta": left.natural_map,
        "velocity": left.velocity,
        "converged": "yes" if left.within(case.tolerance, case.velocity_tolerance) else "no",
        "why": solution.why,
    }


if __name__ == "__main__":
    guarded(main)
