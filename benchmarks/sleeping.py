"""Time that sleep saves, and what it changes: `python -m benchmarks.sleeping [--only NAME …] [--json]`."""

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.generated import box_faces, running_bond
from benchmarks.report import Row, Table, guarded, machine, print_json, print_table, progress
from mechanics.arrays import Array
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.equilibrium import imbalance, support_reaction
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, TimeSettings
from mechanics.stones.materials import Material

__all__ = ["SCENES", "main"]


_STONE = Material("stone", density=2400.0, young=1e10, poisson=0.2)
_SLEEPS = (1e-4, 1e-3, 1e-2)
# places at so many instants are compared
_INSTANTS = 20
_TABLE: Table = (
    ("scene", "scene", ""),
    ("stones", "stones", "d"),
    ("contacts", "contacts", "d"),
    ("steps", "steps", "d"),
    ("sleep", "sleep", "g"),
    ("seconds", "s", ".3g"),
    ("faster", "times faster", ".2f"),
    ("asleep", "asleep, mean", ".0%"),
    ("moved", "moved at most, mm", ".3g"),
    ("difference", "off at the end, largest, mm", ".2g"),
    ("resting_difference", "of stones at rest, mm", ".2g"),
    ("balance", "balance of those asleep", ".0e"),
    ("reaction", "reaction", ".0e"),
    ("energy", "energy", ".0e"),
    ("unconverged", "steps above 1e-6", "d"),
)


@dataclass(frozen=True)
class _Run:
    seconds: float
    asleep: float
    places: Array
    balance: float
    reaction: float
    energy: float
    unconverged: int
    contacts: int


def main() -> None:
    """Run every scene without sleep and with it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sleeping", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(SCENES), default=list(SCENES))
    parser.add_argument("--sleep", nargs="+", type=float, default=list(_SLEEPS))
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each run")
    options = parser.parse_args()
    rows = [row for name in options.only for row in _compared(name, options.sleep)]
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}\n")
    print_table(rows, _TABLE)


def _compared(name: str, sleeps: Sequence[float]) -> list[Row]:
    scene = SCENES[name]()
    _run(replace(scene, time=replace(scene.time, duration=3 * scene.time.step)))
    awake, rows = None, []
    for sleep in (0.0, *sleeps):
        progress(f"{name}, sleep {sleep:g}")
        run = _run(replace(scene, time=replace(scene.time, sleep=sleep)))
        awake = awake or run
        off = np.linalg.norm(run.places - awake.places, axis=2)[-1]
        # at rest all the while, but for the rounding of solvers
        path = np.abs(np.diff(awake.places, axis=0)).sum(axis=(0, 2))
        moved = np.linalg.norm(awake.places[-1] - awake.places[0], axis=1)
        rows.append(
            {
                "scene": name,
                "stones": len(scene.blocks),
                "contacts": run.contacts,
                "steps": scene.time.steps,
                "sleep": sleep,
                "seconds": run.seconds,
                "faster": awake.seconds / run.seconds,
                "asleep": run.asleep,
                "moved": 1e3 * float(moved.max()),
                "difference": 1e3 * float(off.max()),
                "resting_difference": 1e3 * float(off[path < 1e-3].max(initial=0.0)),
                "balance": run.balance if run.asleep else None,
                "reaction": run.reaction,
                "energy": run.energy,
                "unconverged": run.unconverged,
            }
        )
    return rows


def _run(scene: Scene) -> _Run:
    model, start = build_model(scene)
    simulation, energy = Simulation(model, start), EnergyBalance(model, start)
    total = scene.time.steps
    places, asleep, balance, unconverged = [start.centre], 0.0, 0.0, 0
    begun, observed = time.process_time(), 0.0
    for count in range(1, total + 1):
        step = simulation.step()
        before = time.process_time()
        energy(step)
        sleeping = simulation.asleep
        asleep += sleeping.mean() / total
        unconverged += not step.solution.converged
        active = step.active
        out = imbalance(model, step.after, active.contacts, active.force, step.kick.load, step.resting)
        balance = max(balance, float(out[sleeping].max(initial=0.0)))
        if count % max(1, total // _INSTANTS) == 0:
            places.append(step.after.centre)
        observed += time.process_time() - before
    seconds = time.process_time() - begun - observed
    support = support_reaction(model, step.contacts, step.force, step.kick.load, step.after.time)
    return _Run(
        seconds,
        asleep,
        np.array(places),
        balance,
        support.error,
        energy.error,
        unconverged,
        len(step.contacts),
    )


def _scene(name: str, blocks: list[Block], duration: float, loads: Loads | None = None) -> Scene:
    return Scene(
        name,
        tuple(blocks),
        contact=ContactSettings(DryJoint(0.6)),
        time=TimeSettings(1e-3, 0.5, duration, stop_at_equilibrium=False),
        loads=loads or Loads(),
    )


def _wall(bricks: int, courses: int) -> list[Block]:
    own = running_bond(bricks, courses)
    return [
        Block(f"b{n}", corners, faces, _STONE, Fidelity.FIXED if fixed else Fidelity.RIGID)
        for n, (corners, faces, fixed) in enumerate(zip(own.vertices, own.faces, own.support, strict=True))
    ]


def _cuboid(
    code: str, low: tuple[float, ...], high: tuple[float, ...], velocity: tuple[float, ...] = (0.0,) * 6
) -> Block:
    corners = np.array([[(low[k], high[k])[i >> k & 1] for k in range(3)] for i in range(8)])
    return Block(code, corners, box_faces(), _STONE, Fidelity.RIGID, velocity=velocity)


def _long_wall() -> Scene:
    """A stone is thrown across the face of a long wall, at its end."""
    shot = _cuboid("shot", (0.1, -0.5, 0.32), (0.25, -0.35, 0.47), (0.0, 6.0, 0.5, 0.0, 0.0, 0.0))
    return _scene("long wall", [*_wall(60, 5), shot], 0.4)


def _pile() -> Scene:
    """Cubes that are dropped in two heaps."""
    rng = np.random.default_rng(4)
    ground = Block(
        "ground",
        np.array([[(-4.0, 8.0)[i & 1], (-4.0, 4.0)[i >> 1 & 1], (-1.0, 0.0)[i >> 2]] for i in range(8)]),
        box_faces(),
        _STONE,
        Fidelity.FIXED,
    )
    cubes = []
    for n in range(24):
        at = np.array([4.0 * (n % 2), 0.0, 0.05 + 0.32 * (n // 2) % 2.0]) + 0.6 * rng.uniform(-1, 1, 3) * [
            1,
            1,
            0,
        ]
        at[2] += 0.4 * (n // 2 // 6)
        cubes.append(_cuboid(f"c{n}", tuple(at), tuple(at + 0.25)))
    return _scene("pile", [ground, *cubes], 1.2)


def _pulse() -> Scene:
    """The ground of a wall moves to and fro once, and rests."""
    rate = History(np.array([0.0, 0.05, 0.15, 0.2]), np.outer([0.0, 0.3, -0.3, 0.0], [0.3, 1.0, 0.0]))
    motion = ImposedMotion(frozenset({"b0"}), rate)
    return _scene("pulse", _wall(6, 5), 0.6, Loads(motions=(motion,)))


SCENES: Mapping[str, Callable[[], Scene]] = {"long wall": _long_wall, "pile": _pile, "pulse": _pulse}


if __name__ == "__main__":
    guarded(main)
