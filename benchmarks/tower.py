"""A masonry tower in an earthquake: `python -m benchmarks.tower [--blocks N …] [--steps N] [--build N] [--json]`.

Towers of about N rigid blocks come to rest under their weight; then the strongest part of a record of 30 s in three
directions shakes them. Both are synthetic: a hollow square shaft, 5.3 m wide and 25 m high, of walls 0.7 m thick, whose
leaves are tied by headers in every fourth course. Joints are dry, or have a stiffness (`--stiffness`, Pa/m) and some
damping, as in distinct-element codes. The time of a step is processor time of this process, stage by stage, with all
that a run observes, and that of the clock; from the mean by the clock follows what the whole record would take.
`--build N` builds a tower of N blocks, counts its contacts, and makes one step.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.report import ProcessorClock, Row, columns, guarded, options_of, peak_bytes, progress, show
from mechanics.arrays import Array, Ints
from mechanics.dynamics.contact_search import detector
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.equilibrium import displacement, seen_from_supports
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.dynamics.verdicts.lasting import balance_of
from mechanics.dynamics.verdicts.watch import Watch
from mechanics.model.model import Model, build_model
from mechanics.results.peaks import PeakTracker
from mechanics.results.postprocess import Observer
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.ground_motion import Component, GroundMotion
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.record_processing import without_drift
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, SolverSettings, TimeSettings
from mechanics.scene.shapes import box
from mechanics.scene.state import State
from mechanics.stones.materials import Material

BASE = "base"
"""Code of the ground on which the tower stands."""

_WIDTH, _HEIGHT = 5.3, 25.0  # of the tower [m]
_STONE = Material("synthetic limestone", density=2200.0, young=5e9, poisson=0.2)
_USUAL, _LEAVES, _ACROSS = 11_500, 3, 22  # blocks of the tower with so many leaves, and so many units across
_TIES = 4  # courses of which one has headers
# wall, middle along it, width, sill and head: openings as parts of width and height of the tower
_OPENINGS = (
    (0, 0.5, 0.20, 0.00, 0.10),
    (1, 0.5, 0.14, 0.28, 0.36),
    (3, 0.5, 0.14, 0.28, 0.36),
    (0, 0.5, 0.14, 0.52, 0.60),
    (2, 0.5, 0.14, 0.52, 0.60),
    *((wall, 0.5, 0.24, 0.82, 0.93) for wall in range(4)),
)
_FRICTION = 0.6  # of all joints [-]
_RECORD = 30.0  # duration of the whole record [s]
_REST_STEPS = 10  # in which the tower comes to rest
_COMPILED = 1200  # blocks of a small tower of many bodies, which have kernels of their own
_SHEAR = 0.5  # stiffness along a joint over that across it [-]
_DAMPING = 2e-3  # dashpots of joints over their springs: 3 % of critical at 5 Hz [s]
_GOAL = 1e-5  # natural map that every step is to reach [-]
_BUILDING = columns(
    "blocks blocks :d | contacts contacts :d | expected expected :d | scene_s scene s :.2f | "
    "model_s model s :.2f | detect_contacts_s detection s :.2f | first_s first step s :.2f | "
    "first_eta its η :.0e | memory_gb memory GB :.2f"
)
_SHAKING = columns(
    "blocks blocks :d | steps steps :d | step_ms h ms :g | median_s step s, median :.3f | "
    "mean_s mean :.3f | largest_s largest :.3f | wall_s by the clock, mean :.3f | eta η worst :.0e | "
    "above steps above 1e-5 :d | unconverged unconverged :d | iterations iterations, mean :.0f | "
    "contacts_shaking contacts :d | moved_mm moved mm :.3g | hours h for 30 s :.1f | "
    "memory_gb memory GB :.2f"
)
_SHARES = columns(
    "blocks blocks :d | advance_s advance s :.3f | detect_s detect s :.3f | "
    "assemble_s assemble s :.3f | solve_s solve s :.3f | observe_s observe s :.3f"
)
_STAGES = ("advance", "detect", "assemble", "solve", "observe")


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
    options = _options()
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
    tables = [_BUILDING] if options.build else [_BUILDING, _SHAKING, _SHARES]
    show(rows, *tables, as_json=options.json)
    if len(rows) > 1 and not options.json:
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
    parser = options_of("tower", __doc__)
    sizes = [500, 1500, 4000, 11_500]
    parser.add_argument("--blocks", type=int, nargs="+", default=sizes, help="about so many (500 to 11500)")
    parser.add_argument("--steps", type=int, default=300, help="steps of strong motion (300)")
    parser.add_argument("--step", type=float, default=5.0, help="time step in milliseconds (5)")
    parser.add_argument("--seconds", type=float, default=3600.0, help="a motion ends after so many (3600)")
    parser.add_argument("--iterations", type=int, default=5000, help="limit of a step (5000)")
    parser.add_argument("--tolerance", type=float, default=1e-5, help="η of every step (1e-5)")
    parser.add_argument("--velocity-tolerance", type=float, default=1e-2, help="as in [solver] (1e-2)")
    parser.add_argument("--stiffness", type=float, default=0.0, help="of joints across [Pa/m]; 0: rigid")
    parser.add_argument("--threads", type=int, default=1, help="as in [solver] (1)")
    parser.add_argument("--build", type=int, default=0, help="build about so many blocks, and make one step")
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
    clock = ProcessorClock()
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
        "memory_gb": peak_bytes() / 1e9,
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


# --- the tower ---


@dataclass(frozen=True)
class Tower:
    """Blocks on a lattice.

    Attributes
    ----------
    low, high : (n, 3) opposite corners, in units
    unit : (3,) of the lattice [m]
    """

    low: Ints
    high: Ints
    unit: Array


def tower(blocks: int = _USUAL) -> Tower:
    """Return the tower in about as many blocks; the finer, the more leaves."""
    fine = (blocks / _USUAL) ** (1 / 3)
    leaves = max(1, round(_LEAVES * fine))
    # an even number, so that joints of one course lie over the middles of stones of another
    across = max(2 * round(_ACROSS * fine / 2), 2 * leaves + 6)
    courses = max(12, round(100 * fine))
    for _ in range(2):
        number = sum(1 for _ in _stones(across, leaves, courses))
        courses = max(12, round(courses * blocks / number))
    stones = np.array(list(_stones(across, leaves, courses)), dtype=np.int64)
    unit = np.array([_WIDTH / across, _WIDTH / across, _HEIGHT / courses])
    return Tower(stones[:, :3], stones[:, 3:], unit)


def tower_blocks(shape: Tower) -> tuple[Block, ...]:
    """Return the ground, and the blocks of a tower, course by course."""
    edge = 0.1 * _WIDTH
    ground = box(
        BASE, (-edge, -edge, -0.5), (_WIDTH + edge, _WIDTH + edge, 0.0), _STONE, fidelity=Fidelity.FIXED
    )
    corners = zip(shape.low * shape.unit, shape.high * shape.unit, strict=True)
    return (ground, *(box(f"T{n + 1}", low, high, _STONE) for n, (low, high) in enumerate(corners)))


def expected_contacts(shape: Tower) -> int:
    """Count the contact points of a tower: four for each pair of blocks with a common rectangle."""
    owner = np.full(shape.high.max(axis=0), -1)
    for n, (low, high) in enumerate(zip(shape.low.tolist(), shape.high.tolist(), strict=True)):
        owner[low[0] : high[0], low[1] : high[1], low[2] : high[2]] = n
    pairs = len(np.unique(owner[:, :, 0])) - 1  # with the ground; where no stone stands is no block
    for axis in range(3):
        one, other = (np.delete(owner, end, axis=axis) for end in (-1, 0))
        touch = (one != other) & (one >= 0) & (other >= 0)
        pairs += len(np.unique(one[touch] * (len(shape.low) + 1) + other[touch]))
    return 4 * pairs


def _stones(across: int, leaves: int, courses: int) -> Iterator[tuple[int, ...]]:
    """Yield the corners of each stone, low and high."""
    openings = [
        (
            wall,
            round((middle - width / 2) * across),
            round((middle + width / 2) * across),
            round(sill * courses),
            round(head * courses),
        )
        for wall, middle, width, sill, head in _OPENINGS
    ]
    for course in range(courses):
        for a, b in pairwise(_leaves(leaves, course)):
            for wall, start, stop in _sides(a, b, across, course % 2 == 1):
                across_wall = (a, b) if wall in (0, 3) else (across - b, across - a)
                for first, last in _run(start, stop, [one[1:] for one in openings if one[0] == wall], course):
                    x, y = ((first, last), across_wall) if wall in (0, 2) else (across_wall, (first, last))
                    yield x[0], y[0], course, x[1], y[1], course + 1


def _leaves(leaves: int, course: int) -> list[int]:
    """Return the faces between the leaves of a course, from outside; headers of every fourth course join two."""
    if course % _TIES != _TIES - 1 or leaves == 1:
        return list(range(leaves + 1))
    first = (course // _TIES) % 2
    return sorted({0, *range(first, leaves + 1, 2), leaves})


def _sides(a: int, b: int, across: int, turned: bool) -> list[tuple[int, int, int]]:
    """Return wall, start and stop of the four sides of a leaf from a to b; each ends where the next one begins.

    Walls 0 and 2 run along x in front and behind, 1 and 3 along y to the right and to the left. In every second course
    they meet the other way round.
    """
    near, far = (a, across - b), (b, across - a)
    if turned:
        return [(0, *far), (1, *far), (2, *near), (3, *near)]
    return [(0, *near), (1, *near), (2, *far), (3, *far)]


def _run(start: int, stop: int, openings: list[tuple[int, ...]], course: int) -> Iterator[tuple[int, int]]:
    """Yield the ends of the stones of a side: two units long, the last one two or three; lintels bear on one unit."""
    joints = [*range(start, stop - 1, 2), stop]
    pieces = list(pairwise(joints))
    for left, right, sill, head in openings:
        if sill <= course < head:
            pieces = [
                part
                for first, last in pieces
                for part in ((first, min(last, left)), (max(first, right), last))
                if part[0] < part[1]
            ]
        elif course == head:
            left, right = left - 1, right + 1
            pieces = [
                part
                for first, last in pieces
                for part in ((first, min(last, left)), (max(first, right), last))
                if part[0] < part[1]
            ]
            pieces.append((left, right))
    yield from sorted(pieces)


# --- the earthquake ---

_STEP, _DURATION = 0.005, 30.0  # of the record [s]
# of both horizontal components and the vertical one: peak acceleration [m/s²], frequency [Hz] and damping [-] of the
# ground in the spectrum of Kanai (1957) and Tajimi (1960)
_GROUND = ((3.5, 2.5, 0.6), (3.0, 2.5, 0.6), (1.5, 6.0, 0.6))
_LOW_CUT = (0.25, 0.6)  # filter of Clough & Penzien (1975): frequency [Hz] and damping [-]
_HIGH_CUT = 25.0  # [Hz]
_RISE, _FALL, _DECAY = 4.0, 14.0, 0.25  # envelope of Jennings, Housner & Tsai (1968): [s], [s], [1/s]


def earthquake(seed: int = 1) -> tuple[Accelerogram, ...]:
    """Return a synthetic record of 30 s in x, y and z: filtered white noise under an envelope, the same for a seed."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, _DURATION + _STEP / 2, _STEP)
    envelope = np.minimum(1.0, (time / _RISE) ** 2) * np.exp(-_DECAY * np.maximum(time - _FALL, 0.0))
    frequency = np.arange(len(time) // 2 + 1) / (len(time) * _STEP)
    records = []
    for name, (peak, ground, damping) in zip("xyz", _GROUND, strict=True):
        noise = np.fft.rfft(rng.normal(size=len(time)))
        moved = np.fft.irfft(noise * _amplitude(frequency, ground, damping), len(time)) * envelope
        record = Accelerogram(_STEP, moved, f"synthetic {name}, seed {seed}", "synthetic")
        record = without_drift(record)
        scaled = record.acceleration * (peak / record.peak)
        records.append(Accelerogram(_STEP, scaled, record.name, record.source))
    return tuple(records)


def _amplitude(frequency: Array, ground: float, damping: float) -> Array:
    """Return the square root of the spectral density of Kanai and Tajimi, without what is too slow or too fast."""
    f, (low, width) = frequency / ground, _LOW_CUT
    s = frequency / low
    soil = (1 + (2 * damping * f) ** 2) / ((1 - f**2) ** 2 + (2 * damping * f) ** 2)
    slow = s**4 / ((1 - s**2) ** 2 + (2 * width * s) ** 2)
    amplitude: Array = np.sqrt(soil * slow) * (frequency < _HIGH_CUT)
    return amplitude


def strongest(records: tuple[Accelerogram, ...], duration: float, rest: float) -> GroundMotion:
    """Return the strongest part of a record, of most ∫ a² dt, as a motion of the ground after a rest [s].

    It begins from the velocity that the ground has there, as seen by an observer who moves with it.
    """
    count = round(duration / records[0].dt) + 1
    power = np.sum([record.acceleration**2 for record in records], axis=0)
    total = np.concatenate([[0.0], np.cumsum(power)])
    first = int(np.argmax(total[count:] - total[:-count]))
    parts = [
        Accelerogram(
            one.dt,
            one.acceleration[first : first + count],
            one.name,
            f"{one.source}, from {first * one.dt:.3f} s",
        )
        for one in records
    ]
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    components = tuple(Component(axis, part) for axis, part in zip(axes, parts, strict=True))
    return GroundMotion(frozenset({BASE}), components, start=rest)


if __name__ == "__main__":
    guarded(main)
