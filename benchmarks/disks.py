"""Disks at rest, 1,000 to 200,000, per contact and sweep: `python -m benchmarks.disks [--disks N …] [--json]`.

Beside Chipmunk (`pip install pymunk`), where it is installed, with as many iterations of its sequential impulses:
for each number of disks right after ours, in a process of its own, up to `--theirs` disks.
"""

import resource
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import (
    Row,
    Table,
    environment,
    guarded,
    machine,
    options_of,
    print_json,
    print_table,
    progress,
)
from mechanics.arrays import Array
from mechanics.planar.run import PlanarRun
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Method, SolverSettings
from pipelines.geology.file import read_geology
from pipelines.geology.sample import prepare

__all__ = ["main"]

_SCENE = Path(__file__).resolve().parents[1] / "data" / "samples" / "geology" / "deposit.toml"
_SWEEPS, _STEP = 100, 0.025
# steps before those that are timed, in which forces are found; and those
_BEFORE, _TIMED = 3, 3
_DENSITY, _FRICTION = 2800.0, 0.4
_TABLE: Table = (
    ("disks", "disks", ",d"),
    ("contacts", "contacts", ",d"),
    ("step", "step, ms", ".3g"),
    ("each", "ns per contact and sweep, whole step", ".3g"),
    ("memory", "memory, kB per disk", ".3g"),
    ("their_contacts", "contacts, Chipmunk", ",d"),
    ("their_step", "step, ms, Chipmunk", ".3g"),
    ("their_each", "ns per contact and iteration, Chipmunk", ".3g"),
)


def main() -> None:
    """Print a row for each number of disks."""
    parser = options_of("disks", __doc__)
    parser.add_argument("--disks", nargs="+", type=int, default=[1000, 4000, 15000, 43000, 200000])
    parser.add_argument("--theirs", type=int, default=50_000, help="most disks with which Chipmunk is timed")
    options = parser.parse_args()
    centre, radius, length = _sample()
    _ours(centre, radius, length, 1)
    rows: list[Row] = []
    begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for count in sorted(options.disks):
        progress(f"{count:,} disks")
        copies = max(1, round(count / len(radius)))
        places = np.vstack([centre + np.array([length * number, 0.0]) for number in range(copies)])
        radii, long = np.tile(radius, copies), length * copies
        row = _ours(places, radii, long, options.threads)
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - begin
        # what the first, small ones take was taken by compiling already
        row["memory"] = grown / len(radii) if grown else None
        if find_spec("pymunk") and len(radii) <= options.theirs:
            progress(f"{len(radii):,} disks: {row['step']:.3g} ms a step; Chipmunk")
            # in another process, so that its memory is not counted as ours
            with ProcessPoolExecutor(1, get_context("spawn")) as apart:
                row |= apart.submit(_theirs, places, radii, long).result()
        rows.append(row)
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'pymunk')}; {options.threads} thread(s)\n")
    print_table(rows, _TABLE)


def _sample() -> tuple[Array, Array, float]:
    """Return centres, radii and length of the deposit that is laid side by side."""
    scene = read_geology(_SCENE, "deposit")
    with tempfile.TemporaryDirectory() as folder:
        sample = prepare(scene, Path(folder))
    return sample.centre, sample.radius, scene.experiment.length


def _timed(step: Callable[[], Any]) -> float:
    for _ in range(_BEFORE):
        step()
    spent = []
    for _ in range(_TIMED):
        begin = time.process_time()
        step()
        spent.append(time.process_time() - begin)
    return float(np.median(spent))


def _ours(centre: Array, radius: Array, length: float, threads: int) -> Row:
    high = 2.0 * float(centre[:, 1].max())
    scene = PlanarScene(
        "disks",
        tuple(
            Disk(str(number), (float(x), float(y)), float(r), _DENSITY)
            for number, ((x, y), r) in enumerate(zip(centre, radius, strict=True))
        ),
        (
            Wall("floor", (-length, 0.0), (2.0 * length, 0.0)),
            Wall("left", (0.0, -1.0), (0.0, high)),
            Wall("right", (length, -1.0), (length, high)),
        ),
        law=DryJoint(_FRICTION),
        time=PlanarTime(_STEP, 1.0, 1e3, stop_at_equilibrium=False),
        solver=SolverSettings(
            Method.NSGS, tolerance=1e-4, velocity_tolerance=np.inf, max_iterations=_SWEEPS, threads=threads
        ),
        min_sweeps=_SWEEPS,
    )
    run = PlanarRun(scene)
    spent = _timed(run.step)
    contacts = len(run.instant().contacts.gap)
    return {
        "disks": len(radius),
        "contacts": contacts,
        "step": 1e3 * spent,
        "each": 1e9 * spent / (contacts * _SWEEPS),
    }


def _theirs(centre: Array, radius: Array, length: float) -> Row:
    import pymunk

    space = pymunk.Space()
    space.iterations, space.gravity = _SWEEPS, (0.0, -9.81)
    high = 2.0 * float(centre[:, 1].max())
    for ends in (
        ((-length, 0.0), (2.0 * length, 0.0)),
        ((0.0, -1.0), (0.0, high)),
        ((length, -1.0), (length, high)),
    ):
        wall = pymunk.Segment(space.static_body, *ends, 0.0)
        # friction of a pair is the product of both
        wall.friction = _FRICTION**0.5
        space.add(wall)
    bodies = []
    for (x, y), r in zip(centre.tolist(), radius.tolist(), strict=True):
        mass = _DENSITY * np.pi * r * r
        body = pymunk.Body(mass, 0.5 * mass * r * r)
        body.position = x, y
        shape = pymunk.Circle(body, r)
        shape.friction = _FRICTION**0.5
        space.add(body, shape)
        bodies.append(body)
    spent = _timed(lambda: space.step(_STEP))
    found = {"free": 0, "fixed": 0}

    def count(arbiter: Any) -> None:
        still = any(shape.body.body_type == pymunk.Body.STATIC for shape in arbiter.shapes)
        found["fixed" if still else "free"] += 1

    for body in bodies:
        body.each_arbiter(count)
    # one between two disks was met from both
    contacts = found["fixed"] + found["free"] // 2
    return {
        "their_contacts": contacts,
        "their_step": 1e3 * spent,
        "their_each": 1e9 * spent / (contacts * _SWEEPS),
    }


if __name__ == "__main__":
    guarded(main)
