"""A masonry tower in an earthquake: `python -m benchmarks.tower [--blocks N …] [--steps N] [--build N] [--json]`.

Generated towers of about N rigid blocks are built and come to rest under their weight; then the strongest part of a
record of 30 s in three directions shakes them. Both are synthetic (benchmarks/tower_masonry.py). Joints are rigid, or
have a stiffness (`--stiffness`, Pa/m) and a little damping, as in distinct-element codes. The time of a step is
processor time of this process, stage by stage, with all that a run observes in each step, and that of the clock; from
the mean by the clock follows what the whole record would take, with so many `--threads`, and from several towers how it
grows. `--seconds` ends a motion early; the table has the steps that were made. `--build N` builds a tower of N blocks,
counts its contacts, and makes one step.
"""

import argparse
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from benchmarks.memory import peak_bytes
from benchmarks.report import (
    Row,
    Table,
    commit,
    environment,
    guarded,
    machine,
    print_json,
    print_table,
    progress,
)
from benchmarks.tower_masonry import earthquake, expected_contacts, strongest, tower, tower_blocks
from mechanics.dynamics.contact_search import detector
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.equilibrium import displacement, seen_from_supports
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.dynamics.stopping import Watch, balance_of
from mechanics.model.model import Model, build_model
from mechanics.results.peaks import PeakTracker
from mechanics.results.postprocess import Observer
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import ContactSettings, Scene, SolverSettings, TimeSettings
from mechanics.scene.state import State

__all__ = ["main", "tower_scene"]


_FRICTION = 0.6  # of all joints [-]
_RECORD = 30.0  # duration of the whole record [s]
_REST_STEPS = 10  # in which the tower comes to rest
_COMPILED = 1200  # blocks of a small tower of many bodies, which have kernels of their own
_SHEAR = 0.5  # stiffness along a joint over that across it [-]
_DAMPING = 2e-3  # dashpots of joints over their springs: 3 % of critical at 5 Hz [s]
_GOAL = 1e-5  # natural map that every step is to reach [-]
_BUILDING: Table = (
    ("blocks", "blocks", "d"),
    ("contacts", "contacts", "d"),
    ("expected", "expected", "d"),
    ("scene_s", "scene s", ".2f"),
    ("model_s", "model s", ".2f"),
    ("detect_contacts_s", "detection s", ".2f"),
    ("first_s", "first step s", ".2f"),
    ("first_eta", "its η", ".0e"),
    ("memory_gb", "memory GB", ".2f"),
)
_SHAKING: Table = (
    ("blocks", "blocks", "d"),
    ("steps", "steps", "d"),
    ("step_ms", "h ms", "g"),
    ("median_s", "step s, median", ".3f"),
    ("mean_s", "mean", ".3f"),
    ("largest_s", "largest", ".3f"),
    ("wall_s", "by the clock, mean", ".3f"),
    ("eta", "η worst", ".0e"),
    ("above", "steps above 1e-5", "d"),
    ("unconverged", "unconverged", "d"),
    ("iterations", "iterations, mean", ".0f"),
    ("contacts_shaking", "contacts", "d"),
    ("moved_mm", "moved mm", ".3g"),
    ("hours", "h for 30 s", ".1f"),
    ("memory_gb", "memory GB", ".2f"),
)
_SHARES: Table = (
    ("blocks", "blocks", "d"),
    ("advance_s", "advance s", ".3f"),
    ("detect_s", "detect s", ".3f"),
    ("assemble_s", "assemble s", ".3f"),
    ("solve_s", "solve s", ".3f"),
    ("observe_s", "observe s", ".3f"),
)
_STAGES = ("advance", "detect", "assemble", "solve", "observe")


class _ProcessorClock(Clock):
    """Processor seconds by stage."""

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Add the time of a with-block to a stage."""
        start = time.process_time()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.process_time() - start


class _Observers:
    """All that a run observes in each step (`mechanics.simulate`)."""

    def __init__(self, model: Model, start: State) -> None:
        self._model = model
        self._observer, self._peaks = Observer(model, start), PeakTracker(model, start)
        self._energy, self._watch = EnergyBalance(model, start), Watch(model, start)
        self._begun = False

    def __call__(self, step: Step) -> None:
        if not self._begun:
            self._peaks.begin(self._observer.begin(step))
            self._begun = True
        self._peaks(step)
        self._energy(step)
        self._watch(step, balance_of(self._model, step))


def main() -> None:
    """Build, shake and print."""
    options, measured = _options(), commit()
    solver = SolverSettings(
        tolerance=options.tolerance,
        velocity_tolerance=options.velocity_tolerance,
        max_iterations=options.iterations,
        threads=options.threads,
    )
    law = _law(options.stiffness)
    sizes = [options.build] if options.build else options.blocks
    # compiles, what few bodies need and what many do
    for count in [40, _COMPILED] if max(sizes) > _COMPILED else [40]:
        _shaken(tower_scene(count, options.step * 1e-3, 1, solver, law), 1, options.seconds)
    rows = [_measured(size, options, solver, law) for size in sizes]
    if options.json:
        print_json(rows)
        return
    print(f"{measured}; {machine()}; {environment('moma-masonry', 'numba', 'numpy')}\n")
    print_table(rows, _BUILDING)
    if not options.build:
        for table in (_SHAKING, _SHARES):
            print()
            print_table(rows, table)
        if len(rows) > 1:
            blocks, seconds = (np.log([row[key] for row in rows]) for key in ("blocks", "mean_s"))
            print(f"\nmean step ~ blocks to the power of {np.polyfit(blocks, seconds, 1)[0]:.2f}")


def _law(stiffness: float) -> DryJoint | ElasticJoint:
    """Return the law of all joints; rigid without a stiffness [Pa/m]."""
    if stiffness == 0.0:
        return DryJoint(friction=_FRICTION)
    return ElasticJoint(_FRICTION, stiffness, _SHEAR * stiffness, _DAMPING)


def _measured(
    blocks: int, options: argparse.Namespace, solver: SolverSettings, law: DryJoint | ElasticJoint
) -> Row:
    """Return what a tower of about so many blocks takes."""
    progress(f"a tower of about {blocks:,} blocks")
    start = time.process_time()
    shape = tower(blocks)
    scene = tower_scene(blocks, options.step * 1e-3, options.steps, solver, law)
    row = {"scene_s": time.process_time() - start, "expected": expected_contacts(shape)}
    return row | _shaken(scene, 0 if options.build else options.steps, options.seconds)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.tower", description=__doc__)
    parser.add_argument(
        "--blocks",
        type=int,
        nargs="+",
        default=[500, 1500, 4000, 11_500],
        help="about so many blocks (500 to 11500)",
    )
    parser.add_argument("--steps", type=int, default=300, help="steps of strong motion (300)")
    parser.add_argument("--step", type=float, default=5.0, help="time step in milliseconds (5)")
    parser.add_argument(
        "--seconds", type=float, default=3600.0, help="processor time after which a motion ends early (3600)"
    )
    parser.add_argument(
        "--iterations", type=int, default=5000, help="limit of the iterations of a step (5000)"
    )
    parser.add_argument("--tolerance", type=float, default=1e-5, help="natural map of every step (1e-5)")
    parser.add_argument(
        "--velocity-tolerance", type=float, default=1e-2, help="error of velocities, as in [solver] (1e-2)"
    )
    parser.add_argument(
        "--stiffness", type=float, default=0.0, help="of joints across, in Pa/m; rigid joints without"
    )
    parser.add_argument("--threads", type=int, default=1, help="as in [solver] (1)")
    parser.add_argument("--build", type=int, default=0, help="build about so many blocks, and make one step")
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser.parse_args()


def tower_scene(
    blocks: int, step: float, steps: int, solver: SolverSettings, law: DryJoint | ElasticJoint | None = None
) -> Scene:
    """Return a tower of about `blocks` blocks, and so many steps of strong motion after it has come to rest.

    Without a law its joints are rigid.
    """
    motion = strongest(earthquake(), max(step * steps, 0.01), _REST_STEPS * step)
    return Scene(
        f"synthetic tower of {blocks} blocks",
        tower_blocks(tower(blocks)),
        contact=ContactSettings(law=_law(0.0) if law is None else law),
        time=TimeSettings(step=step, theta=0.5, stop_at_equilibrium=False),
        solver=solver,
        loads=Loads(motions=(motion,)),
    )


def _shaken(scene: Scene, steps: int, most: float) -> Row:
    """Return what building, rest, and so many steps of motion, or `most` seconds of it, take.

    Without steps of motion, one step of rest alone.
    """
    clock = _ProcessorClock()
    with clock("model"):
        model, start = build_model(scene)
    with clock("contacts"):
        contacts = len(detector(model)(start, np.zeros(len(model.mass))))
    building = dict(clock.seconds)
    simulation, observe = Simulation(model, start, clock), _Observers(model, start)
    rest = []
    for count in range(_REST_STEPS if steps else 1):
        progress(f"rest: step {count + 1}")
        rest.append(_timed(simulation, observe, clock))
    before = dict(clock.seconds)
    shaken: list[tuple[float, float, bool, int, int, float]] = []
    for count in range(steps):
        if sum(one[0] for one in shaken) > most:
            break
        shaken.append(_timed(simulation, observe, clock))
        progress(
            f"motion: step {count + 1} of {steps}, {shaken[-1][0]:.2f} s, η {shaken[-1][1]:.0e}, "
            f"{shaken[-1][3]} iterations"
        )
    row = {
        "blocks": len(model.mass) - 1,
        "contacts": contacts,
        "model_s": building["model"],
        "detect_contacts_s": building["contacts"],
        "first_s": rest[0][0],
        "first_eta": rest[0][1],
        "memory_gb": (peak_bytes() or 0) / 1e9,
    }
    if not steps:
        return row
    seconds, eta, converged, iterations, contacts_shaking, wall = (
        np.array(column) for column in zip(*shaken, strict=True)
    )
    seen = seen_from_supports(model, start, simulation.state)
    row |= {
        "steps": len(shaken),
        "step_ms": 1e3 * scene.time.step,
        "median_s": float(np.median(seconds)),
        "mean_s": float(seconds.mean()),
        "largest_s": float(seconds.max()),
        "wall_s": float(wall.mean()),
        "eta": float(eta.max()),
        "above": int((eta > _GOAL).sum()),
        "unconverged": int((~converged).sum()),
        "iterations": float(iterations.mean()),
        "contacts_shaking": int(np.median(contacts_shaking)),
        "moved_mm": 1e3 * float(displacement(model, start, seen).max()),
        "hours": float(wall.mean()) * _RECORD / scene.time.step / 3600.0,
    }
    return row | {f"{stage}_s": (clock.seconds[stage] - before[stage]) / len(shaken) for stage in _STAGES}


def _timed(
    simulation: Simulation, observe: _Observers, clock: Clock
) -> tuple[float, float, bool, int, int, float]:
    """Return processor time [s], η, whether it is solved, iterations, contacts and time by the clock of one step."""
    start, began = time.process_time(), time.perf_counter()
    step = simulation.step()
    with clock("observe"):
        observe(step)
    spent, solution = time.process_time() - start, step.solution
    wall = time.perf_counter() - began
    return spent, solution.natural_map, solution.converged, solution.iterations, len(step.gap), wall


if __name__ == "__main__":
    guarded(main)
