"""One generated scene of one size: a process of its own, run by benchmarks.scaling; prints one line of JSON."""

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.generated import disk_box, running_bond
from benchmarks.memory import arrays_bytes, peak_bytes
from benchmarks.scenes import engine_scene
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
from mechanics.problem.problem import Delassus
from mechanics.scene.scene import SolverSettings

__all__ = ["main"]


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


def main() -> None:
    """`scaling_child.py KIND BRICKS COURSES` with KIND wall or disks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=["wall", "disks"])
    parser.add_argument("across", type=int)
    parser.add_argument("high", type=int)
    parser.add_argument("--threads", type=int, nargs="+", default=[1])
    options = parser.parse_args()
    make = _wall if options.kind == "wall" else _disks
    for count in options.threads:  # compiles every kernel
        _once(make(4, 4, count))
    before = peak_bytes()
    case = make(options.across, options.high, 1)
    contacts = len(case.u_free)
    row: dict[str, Any] = {
        "kind": options.kind,
        "across": options.across,
        "high": options.high,
        "bodies": case.bodies,
        "contacts": contacts,
    }
    simulation = case.simulation()
    simulation.step()
    row["bytes_kept"] = arrays_bytes(simulation) / contacts
    row["bytes_peak"] = _since(before, contacts)
    del simulation
    row["detection"] = _best(case.detect)[0]
    cases = {count: make(options.across, options.high, count) for count in options.threads}
    row |= _times(cases)
    row |= _default(case.default())
    row["bytes_peak_default"] = _since(before, contacts)
    json.dump(row, sys.stdout)


def _since(before: int | None, contacts: int) -> float | None:
    """By how much the largest memory of this process has grown, for each contact."""
    after = peak_bytes()
    return None if after is None or before is None else (after - before) / contacts


def _once(case: _Case) -> None:
    case.detect()
    _sweeps(case, 2)
    case.simulation().step()
    case.default().step()


def _times(cases: dict[int, _Case]) -> dict[str, Any]:
    """Sweeps and whole steps, by number of threads."""
    row: dict[str, Any] = {}
    impulses = []
    for count, case in cases.items():
        sweep, impulse = _sweeps(case, _STEP_SWEEPS)
        step = _best(partial(_ready, case), prepared=True)
        impulses.append(impulse)
        for name, (cpu, wall) in (("sweep", sweep), ("step", step)):
            row |= {f"{name}_{count}": cpu, f"{name}_wall_{count}": wall}
    sticking, _ = _sweeps(cases[1], _STEP_SWEEPS, friction=_STICKING)
    row["sweep_stick"] = sticking[0]
    row["sliding"] = _sliding(impulses[0], cases[1].friction)
    row["same_bits"] = all(np.array_equal(one, impulses[0]) for one in impulses)
    return row


def _sliding(impulse: Array, friction: float) -> float:
    """Share of the contacts that slide."""
    tangential, limit = np.linalg.norm(impulse[:, 1:], axis=1), friction * impulse[:, 0]
    return float(np.mean((tangential >= limit * (1 - 1e-9)) & (limit > 0)))


def _ready(case: _Case) -> Callable[[], Any]:
    """The first step of a new simulation."""
    step: Callable[[], Any] = case.simulation().step
    return step


def _default(simulation: Any) -> dict[str, float]:
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


if __name__ == "__main__":
    main()
