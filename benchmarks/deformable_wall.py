"""A small wall of deformable bricks: `python -m benchmarks.deformable_wall [--json]`.

Running bond of 6 courses on an elastic base, as LMGC90 was timed on it; see benchmarks/README.md.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from benchmarks.generated import box_faces
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from mechanics.dynamics.observers.equilibrium import imbalance, support_reaction
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, LawRule, Scene, Start, TimeSettings
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from moma.errors import SolverError

__all__ = ["deformable_wall", "main", "wall_scene"]

# length, depth and height of a brick [m]; head joints are open by this, so that they never touch [m]
_BRICK, _HEAD_JOINT = (0.30, 0.15, 0.10), 1e-3
_BRICKS, _COURSES = 4, 6
_STONE = Material("stone", density=2400.0, young=5e9, poisson=0.2)
# what holds the base at its bottom does not break
_GLUE = MortarJoint(friction=1.0, tension=1e5, shear=1e5)
_TABLE: Table = (
    ("start", "start", ""),
    ("element", "element", ""),
    ("bodies", "bodies", "d"),
    ("nodes", "nodes", "d"),
    ("contacts", "contacts", "d"),
    ("step_ms", "step ms", ".3g"),
    ("slowest_ms", "slowest", ".3g"),
    ("first_ms", "first", ".3g"),
    ("start_ms", "static start", ".3g"),
    ("cpu_ms", "CPU ms", ".3g"),
    ("iterations", "iterations", "d"),
    ("most_iterations", "most", "d"),
    ("eta", "largest η", ".0e"),
    ("unconverged", "steps above 1e-6", "d"),
    ("balance", "balance", ".0e"),
    ("reaction", "reaction - weight", ".0e"),
)


def main() -> None:
    """Time the steps from rest under sudden gravity, and from static equilibrium."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.deformable_wall", description=__doc__)
    parser.add_argument("--element", choices=[one.value for one in Element], default=Element.HEX8.value)
    parser.add_argument("--steps", type=int, default=60, help="time steps of each run (60)")
    parser.add_argument(
        "--warm-up", type=int, default=10, help="first steps that are left out of the median (10)"
    )
    parser.add_argument("--starts", nargs="+", choices=[one.value for one in Start], default=[*Start])
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each start")
    options = parser.parse_args()
    rows = [
        _run(deformable_wall(Element(options.element), Start(start)), options.steps, options.warm_up)
        for start in options.starts
    ]
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def deformable_wall(element: Element, start: Start) -> Scene:
    """27 bricks and half bricks in running bond on an elastic base; h = 1e-4 s, θ = 0.505."""
    return wall_scene(_BRICKS, _COURSES, element, start)


def wall_scene(
    bricks: int,
    courses: int,
    element: Element,
    start: Start,
    size: float = _BRICK[0] / 4,
    step: float = 1e-4,
    theta: float = 0.505,
    duration: float = 1.0,
    base: bool = True,
) -> Scene:
    """Running bond, on an elastic base that is held at its bottom or on rigid ground; head joints are open, μ = 0.5."""
    length, depth, height = _BRICK
    wide = bricks * length
    cells = [("base", 0.0, wide, 0)] if base else []
    for row in range(len(cells), courses + len(cells)):
        cuts = np.arange(bricks + 1) * length
        if row % 2 == 0:
            cuts = np.concatenate([[0.0], cuts[:-1] + length / 2, [wide]])
        cells += [
            (f"{row}-{k + 1}", cuts[k] + _HEAD_JOINT / 2, cuts[k + 1] - _HEAD_JOINT / 2, row)
            for k in range(len(cuts) - 1)
        ]
    blocks = [_box("ground", (0.0, wide), depth, (-height, 0.0), Fidelity.FIXED, element, size)]
    blocks += [
        _box(code, (low, high), depth, (row * height, (row + 1) * height), Fidelity.DEFORMABLE, element, size)
        for code, low, high, row in cells
    ]
    held = (LawRule(frozenset({"ground"}), frozenset({"base"}), _GLUE),) if base else ()
    return Scene(
        f"deformable wall {bricks} x {courses}",
        tuple(blocks),
        contact=ContactSettings(DryJoint(0.5), rules=held, alert_distance=_HEAD_JOINT / height / 2),
        time=TimeSettings(step, theta, duration, start=start),
    )


def _box(
    code: str,
    x: tuple[float, float],
    depth: float,
    z: tuple[float, float],
    fidelity: Fidelity,
    element: Element,
    size: float,
) -> Block:
    corners = np.array([[x[i & 1], (0.0, depth)[i >> 1 & 1], z[i >> 2]] for i in range(8)])
    return Block(code, corners, box_faces(), _STONE, fidelity, size, element)


def _run(scene: Scene, steps: int, warm_up: int) -> Row:
    """Wall and processor time of each step, how well it was solved, and what the ground carries at the end."""
    progress(f"{scene.name}, start {scene.time.start}")
    _started(replace(scene, solver=replace(scene.solver, max_iterations=20)))[
        0
    ].step()  # compiles the kernels
    simulation, start_ms = _started(scene)
    model, wall, cpu, solutions = simulation.model, [], [], []
    for _ in range(steps):
        started = time.perf_counter(), time.process_time()
        step = simulation.step()
        wall.append(time.perf_counter() - started[0])
        cpu.append(time.process_time() - started[1])
        solutions.append(step.solution)
    support = support_reaction(model, step.contacts, step.force, step.kick.load, step.after.time)
    eta = np.array([one.natural_map for one in solutions])
    iterations = np.array([one.iterations for one in solutions])
    balance = imbalance(model, step.after, step.contacts, step.force, step.kick.load)
    return {
        "start": str(scene.time.start),
        "element": str(scene.blocks[1].element),
        "bodies": len(scene.blocks) - 1,
        "nodes": len(step.after.node),
        "contacts": len(step.contacts),
        "start_ms": start_ms,
        "first_ms": 1e3 * wall[0],
        "step_ms": 1e3 * float(np.median(wall[warm_up:])),
        "slowest_ms": 1e3 * float(np.max(wall[warm_up:])),
        "cpu_ms": 1e3 * float(np.median(cpu[warm_up:])),
        "iterations": int(np.median(iterations[warm_up:])),
        "most_iterations": int(iterations.max()),
        "eta": float(eta.max()),
        "unconverged": int(np.sum(eta > scene.solver.tolerance)),
        "balance": float(balance.max()),
        "reaction": support.error,
    }


def _started(scene: Scene) -> tuple[Simulation, float | None]:
    """A simulation at the start that the scene asks for, and how long the search for its equilibrium took [ms]."""
    model, state = build_model(scene)
    simulation = Simulation(model, state)
    if scene.time.start is not Start.EQUILIBRIUM:
        return simulation, None
    begun = time.perf_counter()
    found, search = static_start(model, state, lambda _: None)
    if not found.found:
        raise SolverError(f"no equilibrium, balance {found.balance:.1e}", where=scene.name)
    simulation.take_over(search)
    return simulation, 1e3 * (time.perf_counter() - begun)


if __name__ == "__main__":
    guarded(main)
