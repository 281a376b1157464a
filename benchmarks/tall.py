"""Tall, heavy and hyperstatic rigid scenes from a cold start: `python -m benchmarks.tall [--json]`.

The first step of columns, of thick walls and of stones whose masses differ by up to 10⁶, with nothing known of the
forces. See benchmarks/README.md for what the columns mean.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.generated import box_faces
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, TimeSettings
from mechanics.solvers.strategies.rigid import Alternating
from mechanics.stones.materials import Material

__all__ = ["CASES", "Case", "column", "first_problem", "main", "thick_wall"]

_DENSITY = 2400.0
_TABLE: Table = (
    ("scene", "scene", ""),
    ("contacts", "contacts", "d"),
    ("iterations", "iterations", "d"),
    ("cpu_ms", "ms", ".3g"),
    ("eta", "η", ".0e"),
    ("velocity", "velocities", ".0e"),
    ("converged", "solved", ""),
    ("why", "by", ""),
)


@dataclass(frozen=True)
class Case:
    """A scene, and how well its first step is to be solved."""

    name: str
    blocks: Callable[[], list[Block]]
    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    friction: float = 0.6
    tilt: float = 0.0


def _box(
    code: str, low: Sequence[float], high: Sequence[float], density: float, fixed: bool = False
) -> Block:
    ends = np.array([low, high], dtype=float)
    corners = np.array([[ends[i >> k & 1, k] for k in range(3)] for i in range(8)])
    material = Material(f"stone {density:.3g}", density, 1e10, 0.2)
    return Block(code, corners, box_faces(), material, Fidelity.FIXED if fixed else Fidelity.RIGID)


def _ground() -> Block:
    return _box("ground", (-20, -20, -1), (20, 20, 0), _DENSITY, fixed=True)


def column(densities: Sequence[float]) -> list[Block]:
    """Blocks of 0.5 × 0.5 × 0.25 m, one on the other, from the lowest up [kg/m³]."""
    boxes = [
        _box(f"B{n}", (0, 0, 0.25 * n), (0.5, 0.5, 0.25 * (n + 1)), density)
        for n, density in enumerate(densities)
    ]
    return [_ground(), *boxes]


def thick_wall(bricks: int, courses: int, leaves: int = 3) -> list[Block]:
    """Leaves of bricks of 0.3 × 0.15 × 0.1 m side by side, head joints staggered by course and by leaf."""
    boxes = []
    for course in range(courses):
        for leaf in range(leaves):
            joints = np.arange(bricks + 1.0)
            if (course + leaf) % 2:
                joints = np.concatenate([[0.0], joints[:-1] + 0.5, [float(bricks)]])
            for n in range(len(joints) - 1):
                low = (0.3 * joints[n], 0.15 * leaf, 0.1 * course)
                high = (0.3 * joints[n + 1], 0.15 * (leaf + 1), 0.1 * (course + 1))
                boxes.append(_box(f"{course}-{leaf}-{n}", low, high, _DENSITY))
    return [_ground(), *boxes]


def _heavy(count: int, place: int, ratio: float) -> list[Block]:
    densities = np.full(count, _DENSITY)
    densities[place] *= ratio
    return column(densities.tolist())


_EXACT = {"tolerance": 1e-8, "velocity_tolerance": 1e-8}
CASES = (
    *(Case(f"column of {n}", partial(column, [_DENSITY] * n)) for n in (10, 20, 50, 100, 200)),
    Case("column of 100, tilted by 2°", lambda: column([_DENSITY] * 100), tilt=2.0),
    Case("column of 100, friction 0.1", lambda: column([_DENSITY] * 100), friction=0.1),
    Case("column of 100, friction 10", lambda: column([_DENSITY] * 100), friction=10.0),
    Case("wall of 20 courses, three leaves", lambda: thick_wall(4, 20)),
    Case("wall of 150 courses, three leaves", lambda: thick_wall(4, 150)),
    Case("1,000 t on 1 kg", lambda: _heavy(2, 1, 1e6), **_EXACT),
    Case("1 kg on 1,000 t", lambda: _heavy(2, 0, 1e6), **_EXACT),
    Case("one of 10 heavier by 1e6", lambda: _heavy(10, 5, 1e6), **_EXACT),
    Case("one of 10 lighter by 1e6", lambda: _heavy(10, 5, 1e-6), **_EXACT),
    Case("one of 100 heavier by 1e6", lambda: _heavy(100, 50, 1e6), **_EXACT),
    Case("10, every other heavier by 1e6", lambda: column([_DENSITY, _DENSITY * 1e6] * 5), **_EXACT),
    Case(
        "100 growing to 1e6 upwards", lambda: column((_DENSITY * np.logspace(0, 6, 100)).tolist()), **_EXACT
    ),
    Case(
        "100 growing to 1e6 downwards", lambda: column((_DENSITY * np.logspace(6, 0, 100)).tolist()), **_EXACT
    ),
)


class _Kept(Exception):
    """The problem that was asked for."""


def first_problem(blocks: list[Block], friction: float = 0.6, tilt: float = 0.0) -> ContactProblem:
    """The contact problem of the first step of 1 ms; `tilt` of the ground about y [°]."""
    angle = np.radians(tilt)
    scene = Scene(
        "tall",
        tuple(blocks),
        gravity=(9.81 * float(np.sin(angle)), 0.0, -9.81 * float(np.cos(angle))),
        contact=ContactSettings(DryJoint(friction)),
        time=TimeSettings(step=1e-3, theta=0.5, stop_at_equilibrium=False),
    )
    kept: list[ContactProblem] = []

    def keep(problem: ContactProblem, start: ContactStart) -> ContactSolution:
        kept.append(problem)
        raise _Kept

    model, state = build_model(scene)
    with suppress(_Kept):
        Simulation(model, state, solver=keep).step()
    return kept[0]


def main() -> None:
    """Solve the first step of every case and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tall", description=__doc__)
    parser.add_argument("--only", nargs="+", default=[""], help="cases whose names hold one of these")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each scene")
    options = parser.parse_args()
    # kernels are compiled, or loaded, before the clock runs
    _row(Case("", lambda: thick_wall(2, 3), tilt=10.0))
    _row(Case("", lambda: _heavy(3, 1, 1e6), **_EXACT))
    rows = [_row(case) for case in CASES if any(part in case.name for part in options.only)]
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def _row(case: Case) -> Row:
    problem = first_problem(case.blocks(), case.friction, case.tilt)
    nothing = np.zeros_like(problem.u_free)
    solver = Alternating(case.tolerance, case.velocity_tolerance)
    start = time.process_time()
    solution = solver(problem, ContactStart(nothing, nothing))
    seconds = time.process_time() - start
    left = residual(problem, solution.impulse)
    if case.name:
        progress(f"{case.name}: {seconds:.3f} s")
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
