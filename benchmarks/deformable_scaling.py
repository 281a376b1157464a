"""Walls of 100 to 1,000 deformable stones: `python -m benchmarks.deformable_scaling [--json]`.

Time and memory to static equilibrium, and of the steps that follow; see benchmarks/README.md.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.deformable_wall import wall_scene
from benchmarks.memory import peak_bytes
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Scene, Start
from mechanics.simulate import simulate
from mechanics.stones.meshing.elements import Element
from moma.errors import SolverError

__all__ = ["main"]

# bricks and courses of walls of about 100, 300 and 1,000 stones
_SIZES = {100: (10, 10), 300: (20, 15), 1000: (40, 25)}
# edge length that gives a brick about 200 nodes [m]: 8 × 4 × 3 linear hexahedra have 180
_MESH = {Element.HEX8: 0.0375, Element.TET10: 0.1}
_TABLE: Table = (
    ("element", "element", ""),
    ("stones", "stones", "d"),
    ("nodes", "nodes per stone", ".0f"),
    ("contacts", "contacts", "d"),
    ("outcome", "outcome", ""),
    ("cpu_s", "CPU to equilibrium s", ".3g"),
    ("total_s", "wall s", ".3g"),
    ("start_s", "of which the static start", ".3g"),
    ("mesh_s", "meshes", ".3g"),
    ("step_ms", "step ms", ".3g"),
    ("per_stone_ms", "CPU ms per stone", ".3g"),
    ("steps", "steps", "d"),
    ("eta", "η", ".0e"),
    ("balance", "balance", ".0e"),
    ("reaction", "reaction - weight", ".0e"),
    ("peak_gb", "memory GB", ".2f"),
)


def main() -> None:
    """Run each size in a process of its own, and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.deformable_scaling", description=__doc__)
    parser.add_argument("--stones", nargs="+", type=int, choices=list(_SIZES), default=[100, 300])
    parser.add_argument("--elements", nargs="+", choices=[one.value for one in _MESH], default=["hex8"])
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each wall")
    options = parser.parse_args()
    if options.child:
        print(json.dumps(_run(Element(options.elements[0]), options.stones[0])))
        return
    rows = [_apart(element, stones) for element in options.elements for stones in options.stones]
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def _apart(element: str, stones: int) -> Row:
    """One wall in a process of its own, so that its memory can be told."""
    progress(f"{stones} stones of {element}")
    options = ["--child", "--elements", element, "--stones", str(stones)]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.deformable_scaling", *options],
        cwd=Path(__file__).resolve().parents[1],
        env=os.environ | {"NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        said = done.stderr.strip().splitlines()
        raise SolverError(said[-1] if said else "no word", where=f"{stones} stones of {element}")
    row: Row = json.loads(done.stdout.splitlines()[-1])
    return row


def _scene(element: Element, bricks: int, courses: int) -> Scene:
    start, size = Start.EQUILIBRIUM, _MESH[element]
    return wall_scene(bricks, courses, element, start, size, step=1e-3, theta=1.0, duration=0.1, base=False)


def _run(element: Element, stones: int) -> Row:
    """Compile on a wall of one brick; then from the scene to its equilibrium."""
    simulate(_scene(element, 1, 1))
    begun = time.perf_counter(), time.process_time()
    result = simulate(_scene(element, *_SIZES[stones]))
    total, cpu = time.perf_counter() - begun[0], time.process_time() - begun[1]
    own = [body for body in result.bodies if body.stress is not None]
    stages, errors = result.wall_time, result.errors
    start = stages.get("start", 0.0)
    rest = total - start - stages.get("mesh", 0.0) - stages.get("stress", 0.0)
    peak = peak_bytes()
    return {
        "element": str(element),
        "stones": len(own),
        "nodes": float(np.mean([len(body.reference) for body in own])),
        "contacts": len(result.contacts.gap),
        "outcome": str(result.outcome),
        "cpu_s": cpu,
        "total_s": total,
        "start_s": start,
        "mesh_s": stages.get("mesh", 0.0),
        "step_ms": 1e3 * rest / result.steps,
        "per_stone_ms": 1e3 * cpu / len(own),
        "steps": result.steps,
        "eta": errors.natural_map,
        "balance": errors.balance,
        "reaction": errors.reaction,
        "peak_gb": None if peak is None else peak / 1e9,
        "at_rest": result.outcome is Outcome.EQUILIBRIUM,
        "stages": stages,
    }


if __name__ == "__main__":
    guarded(main)
