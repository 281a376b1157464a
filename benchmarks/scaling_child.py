"""One generated scene of one size: a process of its own, run by benchmarks.scaling; prints one line of JSON."""

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from benchmarks.generated import disk_box, running_bond
from benchmarks.memory import arrays_bytes, peak_bytes
from benchmarks.scenes import engine_scene
from mechanics.contact.assembly import rigid_delassus
from mechanics.contact.contacts import take
from mechanics.model import build_model
from mechanics.operators.rigid import schedule
from mechanics.planar.contacts import PlanarDetector
from mechanics.planar.delassus import PlanarDelassus
from mechanics.planar.model import build_planar_model
from mechanics.planar.simulation import PlanarSimulation
from mechanics.problem import Delassus
from mechanics.scene import SolverSettings
from mechanics.simulation import Clock, Simulation, detector

__all__ = ["main"]

Array = NDArray[np.float64]

# sweeps of the timed step, and timed sweeps for a cache-warm figure
_STEP_SWEEPS = 50
_REPEATS, _ENOUGH = 5, 0.2
_DEFAULT_STEPS = 8


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
    _once(make(4, 4), options.threads)  # compiles every kernel
    before = peak_bytes()
    case = make(options.across, options.high)
    contacts = len(case.u_free)
    row: dict[str, Any] = {
        "kind": options.kind,
        "across": options.across,
        "high": options.high,
        "bodies": case.bodies,
        "contacts": contacts,
    }
    numba.set_num_threads(1)
    simulation = case.simulation()
    simulation.step()
    row["bytes_kept"] = arrays_bytes(simulation) / contacts
    after = peak_bytes()
    row["bytes_peak"] = None if after is None or before is None else (after - before) / contacts
    row |= _times(case, options.threads)
    numba.set_num_threads(1)
    row |= _default(case.default())
    after = peak_bytes()
    row["bytes_peak_default"] = None if after is None or before is None else (after - before) / contacts
    json.dump(row, sys.stdout)


def _once(case: _Case, threads: list[int]) -> None:
    for count in threads:
        numba.set_num_threads(count)
        case.detect()
        _sweeps(case, 2)
        case.simulation().step()
    case.default().step()


def _times(case: _Case, threads: list[int]) -> dict[str, Any]:
    row: dict[str, Any] = {"detection": _best(case.detect)[0]}
    impulses = []
    for count in threads:
        numba.set_num_threads(count)
        sweep, impulse = _sweeps(case, _STEP_SWEEPS)
        step = _best(lambda: case.simulation().step, prepared=True)
        impulses.append(impulse)
        for name, (cpu, wall) in (("sweep", sweep), ("step", step)):
            row |= {f"{name}_{count}": cpu, f"{name}_wall_{count}": wall}
    row["same_bits"] = all(np.array_equal(one, impulses[0]) for one in impulses)
    return row


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


def _sweeps(case: _Case, count: int) -> tuple[tuple[float, float], Array]:
    """Times of one sweep [s] near the solution, and the impulses after a fixed number of sweeps."""
    none = np.zeros(len(case.u_free))
    sweep = case.operator.gauss_seidel(case.u_free, none + case.friction, none)
    impulse = np.zeros_like(case.u_free)
    sweep(impulse, count)
    early = impulse.copy()
    cpu, wall = _best(lambda: sweep(impulse, count))
    return (cpu / count, wall / count), early


def _wall(bricks: int, courses: int) -> _Case:
    blocks = running_bond(bricks, courses)
    scene = engine_scene(blocks, 1e-3, 0.5, 1e-300, _STEP_SWEEPS, sweeping=True)
    model, state = build_model(scene)
    usual = replace(model, scene=replace(scene, solver=SolverSettings()))
    find = detector(model)
    reach = np.zeros(len(model.mass))
    contacts = find(state, reach)
    plan = schedule(contacts.bodies, model.inertia.moving)
    operator = rigid_delassus(model, state, take(contacts, plan.order), plan)
    fall = np.zeros((len(model.mass), 6))
    fall[model.inertia.moving, 2] = -9.81e-3
    return _Case(
        lambda: find(state, reach),
        operator,
        operator.relative_velocity(fall),
        blocks.friction,
        lambda: Simulation(model, state, Clock()),
        lambda: Simulation(usual, state, Clock()),
        len(model.mass),
    )


def _disks(columns: int, rows: int) -> _Case:
    scene = disk_box(columns, rows, sweeps=_STEP_SWEEPS)
    model, state = build_planar_model(scene)
    usual = replace(model, scene=replace(scene, solver=SolverSettings()))
    find = PlanarDetector(model)
    contacts = find(state)
    operator = PlanarDelassus(contacts.bodies, contacts.normal, contacts.lever, model.inertia)
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
